#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/cli/drive_commands.hpp"
#include "host/cli/twin_runs.hpp"
#include "host/cli/workbench_command.hpp"
#include "host/cli/workbench_project.hpp"
#include "host/output/json.hpp"
#include "host/workbench/server.hpp"
#include "host/workbench/work.hpp"

namespace flexspline::cli {
namespace {

// The desktop's own program to open an address; nothing happens without a desktop.
bool open_browser(const std::string& address) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return false;
  const pid_t child = fork();
  if (child < 0) return false;
  if (child == 0) {
    // In two places, so that the command need not wait for the browser.
    if (fork() == 0) {
      execlp("xdg-open", "xdg-open", address.c_str(), nullptr);
      _exit(1);
    }
    _exit(0);
  }
  waitpid(child, nullptr, 0);
  return true;
}

// The drive that closed loops are run on.
workbench::SimulatedPlant plant_setup_of(const WorkbenchOptions& options, const data::Dataset& dataset) {
  if (options.plant.empty()) return workbench::plant_of_recordings(options.data.data, dataset);
  closed_loop::Job job;
  job.plant_file = options.plant.string();
  const ScratchFolder sheet;
  fetch_data_sheet(job, sheet.path());
  std::ifstream in(sheet.path() / "settings.toml", std::ios::binary);
  workbench::SimulatedPlant plant_setup;
  plant_setup.plant_file = std::filesystem::absolute(options.plant).string();
  plant_setup.settings = {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  plant_setup.settings_origin = options.plant.string();
  plant_setup.what = fmt::format("the simulated drive of {}", options.plant.filename().string());
  return plant_setup;
}

void open_model(const WorkbenchOptions& options, workbench::Setup& setup, Console& console) {
  const model::ModelFile file = load_model(options.model);
  if (options.data.data.empty())
    throw UsageError("--model needs measurements to compare it with: flexspline workbench DATA --model MODEL");
  const auto dataset = std::make_shared<const data::Dataset>(load(options.data, console));
  setup.first = workbench::open(dataset, file, setup.pipeline, [&](std::string_view stage) {
    if (!stage.empty()) console.progress(stage);
  });
  setup.model_name = options.model.string();
  setup.plant_setup = plant_setup_of(options, *dataset);
}

// What there is to begin with is chosen on the page.
void begin_without_model(const WorkbenchOptions& options, workbench::Setup& setup) {
  if (!options.data.holdout.empty())
    throw UsageError("--holdout needs --model; without one, give all measurements as DATA");
  for (const std::filesystem::path& path : options.data.data) {
    if (!std::filesystem::exists(path))
      throw UsageError(fmt::format("{}: there is no such file or folder; check the path", path.string()));
    setup.data.push_back(std::filesystem::absolute(path));
  }
  setup.model_name = "model.toml";
  if (!options.plant.empty()) setup.plant_setup = plant_setup_of(options, {});
}

}  // namespace

int run(const WorkbenchOptions& options, Console& console) {
  workbench::Setup setup;
  setup.pipeline = options.pipeline.options();
  setup.data_name = as_arguments(options.data.data);
  setup.drive = options.drive;
  setup.run = twin_runner();
  setup.folder =
      options.model.empty() ? std::filesystem::current_path() : std::filesystem::absolute(options.model).parent_path();
  setup.projects = projects(std::filesystem::current_path());
  if (options.model.empty())
    begin_without_model(options, setup);
  else
    open_model(options, setup, console);
  const Interruptible interruptible;
  const auto begin = std::chrono::steady_clock::now();
  const auto is_over = [&] {
    const double passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return Interruptible::interrupted() || (options.seconds > 0.0 && passed >= options.seconds);
  };
  workbench::serve(std::move(setup), {.port = options.port,
                                      .listening =
                                          [&](const std::string& address) {
                                            console.line(fmt::format("Workbench: {}", address));
                                            console.line("The address is for you alone. Ctrl-C ends it.");
                                            std::fflush(stdout);  // a program may wait for it
                                            output::save_json(options.json, {{"format", "flexspline-workbench/1"},
                                                                             {"address", address},
                                                                             {"pid", getpid()}});
                                            if (!options.no_open) open_browser(address);
                                          },
                                      .ends = is_over});
  return kDone;
}

}  // namespace flexspline::cli
