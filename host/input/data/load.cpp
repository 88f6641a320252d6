// From files to experiments: which files, which columns, which rows; then the time base and the checks.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "host/input/data/checks.hpp"
#include "host/input/data/columns.hpp"
#include "host/input/data/dataset.hpp"
#include "host/input/data/dataset_toml.hpp"
#include "host/input/data/experiment_reader.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/keys.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {
namespace {

namespace fs = std::filesystem;

fs::path real_path(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(path, error);
  return error ? path : whole;
}

// The checks on the uniform time base, once all of the drive is known.
void check_experiment(Experiment& experiment, const DriveFacts& drive, Findings& findings) {
  check_velocities(experiment, drive, findings);
  check_velocity_lag(experiment, findings);
  check_effort_sign(experiment, findings);
  check_gear_ratio(experiment, drive, findings);
  check_standstill(experiment, findings);
  check_constant_columns(experiment, findings);
  check_ranges(experiment, drive.axis.value_or(Axis::rotary), findings);
}

class Loader {
 public:
  explicit Loader(const LoadOptions& options) : options_(options), findings_(options.tolerate) {
    findings_.throw_if_errors();
  }

  Dataset load(const std::vector<fs::path>& paths) {
    if (paths.empty())
      findings_.fail("file", "", 0, "no measurements were given", "give files, folders or a dataset.toml");
    for (const fs::path& path : paths) read_path(path);
    // Units were converted before a later file stated the axis.
    if (read_without_axis_ && data_.drive.axis && *data_.drive.axis != assumed_axis()) {
      LoadOptions known = options_;
      known.axis = data_.drive.axis;
      return Loader(known).load(paths);
    }
    findings_.throw_if_errors();
    cached_.reset();  // a file's numbers take as much memory as the experiments
    DriveFacts facts = data_.drive;
    if (!facts.axis) facts.axis = options_.axis;
    for (std::size_t i = 0; i < data_.experiments.size(); ++i) {
      Experiment& experiment = data_.experiments[i];
      if (options_.holdout) experiment.role = Role::holdout;
      findings_.tolerate_also(tolerated_[i]);
      check_experiment(experiment, facts, findings_);
    }
    check_replicates();
    findings_.throw_if_errors();
    data_.findings = findings_.list();
    return std::move(data_);
  }

 private:
  Axis assumed_axis() const { return options_.axis.value_or(Axis::rotary); }

  void read_path(const fs::path& path) {
    std::error_code error;
    if (!fs::exists(path, error))
      findings_.fail("file", path.string(), 0, "there is no such file or folder",
                     "give a CSV or MAT file, a folder of them, or a dataset.toml");
    if (fs::is_directory(path))
      read_folder(path);
    else if (lower_extension(path) == ".toml")
      read_toml(path);
    else
      read_single_file(path);
  }

  void read_folder(const fs::path& folder) {
    if (fs::exists(folder / "dataset.toml")) {
      read_toml(folder / "dataset.toml");
      return;
    }
    for (const fs::path& file : recordings_in(folder, findings_)) read_file(file, nullptr, nullptr);
  }

  void read_toml(const fs::path& path) {
    const DatasetToml toml = read_dataset_toml(path, findings_);
    if (toml.experiments.empty())
      for (const fs::path& file : recordings_in(path.has_parent_path() ? path.parent_path() : fs::path("."), findings_))
        read_file(file, &toml, nullptr);
    for (const ExperimentEntry& entry : toml.experiments) read_file(entry.file, &toml, &entry);
    for (const auto& [name, mapping] : toml.columns)
      // A file without its time was not checked any further.
      if (name != "time_s" && !has_error_of("time_s") && found_mappings_.count({path.string(), name}) == 0 &&
          !has_error_of(name))
        findings_.add(Severity::error, "missing_column", path.string(), mapping.line, name,
                      fmt::format("no file has the column \"{}\" that this is mapped from", mapping.source),
                      "write source as it is written in the header of the files, or take the mapping out");
  }

  bool has_error_of(const std::string& column) const {
    return std::any_of(findings_.list().begin(), findings_.list().end(),
                       [&](const Finding& f) { return f.severity == Severity::error && f.column == column; });
  }

  // A file by itself is read by the dataset.toml in the same folder, if there is one.
  void read_single_file(const fs::path& path) {
    const fs::path toml_path = path.parent_path() / "dataset.toml";
    if (!fs::exists(toml_path)) {
      read_file(path, nullptr, nullptr);
      return;
    }
    const DatasetToml toml = read_dataset_toml(toml_path, findings_);
    findings_.add(Severity::note, "mapping", path.string(), 0, "", "read by the dataset.toml in the same folder", "");
    bool named = false;
    for (const ExperimentEntry& entry : toml.experiments)
      if (real_path(entry.file) == real_path(path)) {
        read_file(entry.file, &toml, &entry);
        named = true;
      }
    if (!named) read_file(path, &toml, nullptr);
  }

  struct Source {
    ColumnPlan plan;
    Table table;
    KeyMap keys;
  };

  // Null if the file cannot be used; what is wrong is among the findings.
  const Source* source(const fs::path& path, const DatasetToml* toml, std::optional<std::size_t> element) {
    const std::string key = fmt::format("{}\n{}\n{}", toml == nullptr ? "" : toml->file.string(),
                                        real_path(path).string(), element.value_or(0));
    if (cached_key_ == key) return cached_.get();
    cached_key_ = key;
    cached_.reset();
    std::error_code error;
    if (!fs::is_regular_file(path, error)) {
      findings_.add(Severity::error, "file", path.string(), 0, "",
                    fs::exists(path, error) ? "this is not a file" : "there is no such file",
                    toml == nullptr ? "check the path" : fmt::format("correct its name in {}", toml->file.string()));
      return nullptr;
    }
    const std::unique_ptr<Recording> recording = open_recording(path, findings_);
    KeyMap keys = keys_of_header(recording->keys(), path.string(), findings_);
    std::optional<ColumnPlan> plan = plan_columns(*recording, path, toml, element, findings_);
    if (!plan) return nullptr;
    Table table = recording->read(plan->wanted);
    cached_ = std::make_unique<Source>(Source{std::move(*plan), std::move(table), std::move(keys)});
    return cached_.get();
  }

  void read_file(const fs::path& path, const DatasetToml* toml, const ExperimentEntry* entry) {
    const std::vector<std::string> tolerated = toml != nullptr ? toml->tolerate : std::vector<std::string>{};
    findings_.tolerate_also(tolerated);
    TimeBounds bounds;
    if (entry != nullptr) bounds = {entry->from_s, entry->to_s};
    const std::optional<std::size_t> element = entry != nullptr ? entry->element : std::nullopt;
    const std::string identity = fmt::format("{} {} {} {}", real_path(path).string(), bounds.from_s.value_or(-1e300),
                                             bounds.to_s.value_or(1e300), element.value_or(0));
    if (!seen_.insert(identity).second) {
      findings_.add(Severity::warning, "duplicate", path.string(), 0, "",
                    "this measurement was given twice and is used once", "take one of them out");
      return;
    }
    const Source* file = source(path, toml, element);
    if (file == nullptr) return;
    for (const PlannedColumn& column : file->plan.columns)
      if (toml != nullptr && column.mapped)
        found_mappings_.insert({toml->file.string(), std::string(column_name(column.column))});

    KeyMap keys = file->keys;
    if (toml != nullptr) {
      KeyMap stated = entry == nullptr ? KeyMap{} : entry->keys;
      stated.insert(toml->defaults.begin(), toml->defaults.end());
      stated.insert(toml->drive.begin(), toml->drive.end());
      // One name in a header cannot fit several parts of the file, so a part with another name is not a contradiction.
      if (stated.count("experiment") != 0) keys.erase("experiment");
      keys = merged(stated, keys, findings_);
    }
    Experiment experiment;
    experiment.name = path.stem().string();
    experiment.file = path;
    experiment.unused_columns = file->plan.unused;
    apply_drive_keys(keys, data_.drive, findings_);
    apply_experiment_keys(keys, experiment, findings_);
    make_unique(experiment);

    read_without_axis_ = read_without_axis_ || !data_.drive.axis;
    if (read_experiment(file->table, file->plan, bounds, data_.drive.axis.value_or(assumed_axis()), experiment,
                        findings_)) {
      data_.experiments.push_back(std::move(experiment));
      tolerated_.push_back(tolerated);
    }
  }

  void make_unique(Experiment& experiment) {
    const std::string name = experiment.name;
    for (int number = 2; !names_.insert(experiment.name).second; ++number)
      experiment.name = fmt::format("{}-{}", name, number);
    if (experiment.name != name)
      findings_.add(Severity::warning, "duplicate", experiment.file.string(), 0, "",
                    fmt::format("another experiment is named \"{}\": this one is \"{}\"", name, experiment.name),
                    "give it a name of its own in dataset.toml or by \"# experiment: NAME\"");
  }

  void check_replicates() {
    for (const Experiment& experiment : data_.experiments)
      if (!experiment.replicate_of.empty() && names_.count(experiment.replicate_of) == 0)
        findings_.add(Severity::warning, "unknown_key", experiment.file.string(), 0, "",
                      fmt::format("\"{}\" is a replicate of \"{}\", which is not in the data", experiment.name,
                                  experiment.replicate_of),
                      "name an experiment of the same data set");
  }

  const LoadOptions& options_;
  Findings findings_;
  Dataset data_;
  std::vector<std::vector<std::string>> tolerated_;  // of each experiment, by its dataset.toml
  bool read_without_axis_ = false;                   // an experiment, by the one that is assumed
  std::string cached_key_;
  std::unique_ptr<Source> cached_;
  std::set<std::string> seen_;
  std::set<std::string> names_;
  std::set<std::pair<std::string, std::string>> found_mappings_;  // dataset.toml, our column
};

}  // namespace

Dataset load(const std::vector<std::filesystem::path>& paths, const LoadOptions& options) {
  return Loader(options).load(paths);
}

}  // namespace flexspline::data
