#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/text.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::cli {
namespace {

using data::Column;
using data::Experiment;
using nlohmann::json;

struct SimulateOptions {
  DataInputs data;
  std::filesystem::path model;
  std::filesystem::path out;
  bool force = false;
  std::string json;
};

struct OutputColumn {
  Column column;
  const std::vector<double>* values;
};

// Inputs as measured, everything else from the model.
std::vector<OutputColumn> columns_of(const Experiment& e, const simulation::FreeRun& run) {
  std::vector<OutputColumn> columns;
  columns.push_back({run.effort, &e[run.effort]});
  columns.push_back({Column::motor_position, &run.motor_position});
  columns.push_back({Column::motor_velocity, &run.motor_velocity});
  columns.push_back({Column::output_position, &run.output_position});
  columns.push_back({Column::output_velocity, &run.output_velocity});
  columns.push_back({Column::torque, &run.torque});
  for (const Column input : {Column::temperature, Column::load_torque})
    if (e.has(input)) columns.push_back({input, &e[input]});
  return columns;
}

std::string file_name(const Experiment& e) {
  std::string name;
  for (const char c : e.name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
                       c == '_' || c == '.' || (static_cast<unsigned char>(c) & 0x80U) != 0;
    name += plain ? c : '_';
  }
  return (name.empty() || name.front() == '.' ? "run" + name : name) + ".csv";
}

struct WrittenCsv {
  std::string text;
  std::size_t samples = 0;  // those that the model reached
};

WrittenCsv csv_of(const Experiment& e, const simulation::FreeRun& run) {
  WrittenCsv written;
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  // A line feed in the name would end its line.
  std::string name = e.name;
  for (char& c : name)
    if (c == '\n' || c == '\r') c = ' ';
  fmt::format_to(out, "# experiment: {}\n# load: {}\n# current_hold: {}\n", name,
                 e.load == data::Load::locked ? "locked" : "free",
                 e.current_hold == data::CurrentHold::zoh ? "zoh" : "none");
  const std::vector<OutputColumn> columns = columns_of(e, run);
  fmt::format_to(out, "time_s");
  for (const OutputColumn& c : columns) fmt::format_to(out, ",{}", data::column_name(c.column));
  text.push_back('\n');
  for (std::size_t k = 0; k < e.size(); ++k) {
    bool known = true;
    for (const OutputColumn& c : columns) known = known && std::isfinite((*c.values)[k]);
    if (!known) continue;
    ++written.samples;
    fmt::format_to(out, "{:.10g}", e.time_s[k]);
    for (const OutputColumn& c : columns) fmt::format_to(out, ",{:.10g}", (*c.values)[k]);
    text.push_back('\n');
  }
  written.text = fmt::to_string(text);
  return written;
}

std::size_t samples_in_segments(const Experiment& e) {
  std::size_t count = 0;
  for (const data::Segment& s : e.segments) count += s.last - s.first;
  return count;
}

std::string dataset_head(const model::Drive& drive, const std::filesystem::path& model) {
  std::string text =
      fmt::format("# Simulated by flexspline from {}.\nformat = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"{}\"\n",
                  model.filename().string(), drive.axis == data::Axis::rotary ? "rotary" : "linear");
  const auto print = [&](const char* key, const model::Quantity& quantity) {
    if (quantity.value) text += fmt::format("{} = {}\n", key, model::exact_text(*quantity.value));
  };
  print("gear_ratio", drive.gear_ratio);
  print("torque_constant_nm_a", drive.torque_constant_nm_a);
  print("pitch_m", drive.pitch_m);
  print("pole_pairs", drive.pole_pairs);
  print("motor_slots", drive.motor_slots);
  return text;
}

// Even with --force: simulated files would take the place of measurements with the same names, and their dataset.toml
// the place of the measurements' own.
void require_no_measurements(const SimulateOptions& options, const data::Dataset& dataset) {
  std::vector<std::filesystem::path> folders;
  for (const std::filesystem::path& path : options.data.data)
    folders.push_back(std::filesystem::is_directory(path) ? path : path.parent_path());
  for (const Experiment& e : dataset.experiments) folders.push_back(e.file.parent_path());
  for (const std::filesystem::path& folder : folders) {
    std::error_code error;
    if (std::filesystem::equivalent(folder.empty() ? "." : folder, options.out, error))
      throw UsageError(fmt::format("{} is the folder of the measurements, which would be replaced; give another --out",
                                   options.out.string()));
  }
}

int run(const SimulateOptions& options, Console& console) {
  require_empty_folder(options.out, options.force);
  model::Model model = load_model(options.model).model;
  const data::Dataset dataset = load(options.data, console);
  require_no_measurements(options, dataset);
  std::vector<std::string> warnings;
  model.drive = estimation::reconcile(model.drive, dataset, warnings);
  for (const std::string& warning : warnings) console.warn(warning);

  std::string toml = dataset_head(model.drive, options.model);
  std::vector<std::pair<std::string, std::string>> files;
  output::Table table({"experiment", "samples", "file", ""}, "lrll");
  json experiments = json::array();
  for (const Experiment& e : dataset.experiments) {
    console.progress(fmt::format("simulating {}", e.name));
    const simulation::FreeRun run = simulation::run(model, e);
    if (run.motor_position.empty()) {
      console.warn(
          fmt::format("{} is not simulated: its output is locked, and the model has no effect on the "
                      "transmission balance; add linear_stiffness",
                      e.name));
      continue;
    }
    const WrittenCsv written = csv_of(e, run);
    const bool diverged = written.samples < samples_in_segments(e);
    if (diverged)
      console.warn(
          fmt::format("{}: the model diverges after {} of {} samples; compare its parameters with flexspline "
                      "effects",
                      e.name, written.samples, samples_in_segments(e)));
    std::string file = file_name(e);
    const auto taken = [&] {
      return std::any_of(files.begin(), files.end(), [&](const auto& other) { return other.first == file; });
    };
    for (int number = 2; taken(); ++number)
      file = fmt::format("{}-{}.csv", file_name(e).substr(0, file_name(e).size() - 4), number);
    files.emplace_back(file, written.text);
    toml += fmt::format("\n[[experiment]]\nfile = {}\nname = {}\nrole = \"{}\"\n", model::toml_string(file),
                        model::toml_string(e.name), e.role == data::Role::fit ? "fit" : "holdout");
    table.row({e.name, fmt::format("{}", written.samples), file, diverged ? "diverged" : ""});
    experiments.push_back({{"name", e.name}, {"file", file}, {"samples", written.samples}, {"diverged", diverged}});
  }
  if (files.empty())
    throw UsageError("no experiment can be simulated; give free motion, or a model with linear_stiffness");

  make_folder(options.out);
  for (const auto& [file, text] : files) model::save(options.out / file, text);
  model::save(options.out / "dataset.toml", toml);
  console.line(table.text());
  console.line();
  console.line(fmt::format("{} describes them.", (options.out / "dataset.toml").string()));
  output::save_json(options.json, {{"format", "flexspline-simulate/1"}, {"experiments", std::move(experiments)}});
  return kDone;
}

void declare(Parser& parser, SimulateOptions& options) {
  take_data(parser, options.data);
  take_model(parser, options.model);
  parser.option("--out", options.out, "folder for the simulated measurements").required().value("DIR");
  parser.flag("--force", options.force, "write into a folder that is not empty");
}

}  // namespace

Command simulate_command() {
  return command<SimulateOptions>(
      {"simulate",
       "runs a model on the measured input",
       "Runs the model from the measured effort alone, experiment by experiment, and writes the motion and torque "
       "that it predicts as CSV files, with a dataset.toml so that every other command reads them.",
       {kMakeData, kIdentify, "flexspline simulate --model fitted.toml demo-out --out simulated"}},
      declare, run);
}

}  // namespace flexspline::cli
