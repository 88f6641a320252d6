#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/app/cli/twin_runs.hpp"
#include "host/app/cli/workbench_project.hpp"
#include "host/app/workbench/server.hpp"
#include "host/app/workbench/work.hpp"
#include "host/common/system/temporary_folder.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

struct WorkbenchOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::string drive;                  // empty: none yet
  std::filesystem::path pairing_key;  // empty: none
  std::filesystem::path plant;        // for closed loops; empty: the twin that recorded the data, or the model
  int port = 0;                       // zero: any that is free
  double seconds = 0.0;               // zero: until Ctrl-C
  bool no_open = false;
  std::string json;
};

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
  const system::TemporaryFolder sheet;
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

int run(const WorkbenchOptions& options, Console& console) {
  workbench::Setup setup;
  setup.pipeline = options.pipeline.options();
  setup.data_name = as_arguments(options.data.data);
  setup.drive = options.drive;
  setup.signer = pairing_signer(options.pairing_key);
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

void declare(Parser& parser, WorkbenchOptions& options) {
  parser.option("DATA", options.data.data, kDataHelp).value("");
  take_tolerate(parser, options.data.tolerate);
  parser.option("--model", options.model, "model file (default: a first one, from what is chosen on the page)")
      .value("MODEL");
  parser.option("--drive", options.drive, fmt::format("{} (default: choose on the page)", transport::kDriveHelp))
      .value("DRIVE");
  take_pairing_key(parser, options.pairing_key);
  parser
      .option(
          "--plant", options.plant,
          "plant file of the drive that closed loops are run on (default: the twin that recorded the data, else one "
          "of which the model is true)")
      .existing_file()
      .value("FILE");
  parser.option("--port", options.port, "of 127.0.0.1 (default: any that is free)").within(1, 65535).value("PORT");
  parser.option("--seconds", options.seconds, "ends after so long (default: at Ctrl-C)").positive().value("S");
  parser.flag("--no-open", options.no_open, "open no browser; the address is printed");
  take_holdout(parser, options.data);
  take_pipeline(parser, options.pipeline);
}

}  // namespace

Command workbench_command() {
  return command<WorkbenchOptions>(
      {"workbench",
       "all steps with the mouse: a page in the browser of this machine",
       "Serves a page on 127.0.0.1 and opens it: how good the model is, where it fails, what is missing, and the "
       "error with that added; steps can be undone and compared. Without --model it begins as "
       "flexspline new does: drop recordings on the page (or give them as DATA), look at the signals, choose which "
       "column is which, type gear ratio and torque constant, and a first model is identified. Models, reports and "
       "blocks are saved into the model's folder (without --model into this one), run in closed loop on a simulated "
       "drive (--plant), and flashed to a drive or the twin, whose signals and residual map are shown. The address "
       "has a token in it: requests without it are refused. Runs until Ctrl-C; --json writes the address once it "
       "listens.",
       {"flexspline workbench --no-open --seconds 0.5", kMakeData,
        "flexspline workbench demo-out --model demo-out/base-model.toml --no-open --seconds 0.5"}},
      declare, run);
}

}  // namespace flexspline::cli
