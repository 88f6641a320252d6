// Recordings that are dropped on the page: additions to the open data, and those of a new project.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/app/workbench/access_control.hpp"
#include "host/app/workbench/api.hpp"
#include "host/app/workbench/work.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 200;
// Accepts files that can be read; refuses others with the command that converts them.
constexpr std::string_view kEndings[] = {".csv",  ".tsv",     ".txt",  ".dat",  ".asc", ".log", ".gz",
                                         ".mat",  ".h5",      ".hdf5", ".npz",  ".npy", ".bag", ".db3",
                                         ".mcap", ".parquet", ".mf4",  ".tdms", ".xlsx"};

std::string ending_of_recording(const std::string& name) {
  const std::string ending = fs::path(name).extension().string();
  std::string lower = ending;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (std::ranges::find(kEndings, lower) == std::end(kEndings))
    throw UnknownNameError(fmt::format(
        "{} is not a recording; drop CSV, MAT, HDF5, NumPy, bag or MCAP files. A dataset.toml names files by "
        "their place: start the workbench with it",
        name));
  return ending;
}

// Loggers call each of their files the same: the second of a name gets a number.
std::string free_name(const fs::path& folder, const std::string& name) {
  const std::size_t compressed = name.ends_with(".gz") ? name.size() - 3 : name.size();  // "log.csv.gz"
  const std::size_t stem = std::min(name.rfind('.', compressed - 1), compressed);
  std::string free = name;
  for (int number = 2; fs::exists(folder / free); ++number)
    free = fmt::format("{}-{}{}", name.substr(0, stem), number, name.substr(stem));
  return free;
}

std::vector<fs::path> write(const fs::path& folder, const std::vector<Upload>& files) {
  std::vector<fs::path> written;
  for (const Upload& file : files) {
    inside(folder, file.name, ending_of_recording(file.name));
    const fs::path path = folder / free_name(folder, file.name);
    std::ofstream out(path, std::ios::binary);
    out.write(file.content.data(), static_cast<std::streamsize>(file.content.size()));
    if (!out.flush()) throw std::runtime_error("the files could not be stored: is the disk full?");
    written.push_back(path);
  }
  return written;
}

// The folder of the recordings that a tab's proposal is about; nothing where there are none.
std::optional<fs::path> proposed(const Session& session) {
  const auto stored = session.stored("recordings");
  return stored && stored->is_string() ? std::optional(fs::path(stored->get<std::string>())) : std::nullopt;
}

// The user has to choose columns where names are unknown.
bool is_foreign(const json& proposal) {
  bool has_time = false, is_ours = true;
  for (const json& column : proposal.at("columns")) {
    const json& source = column.at("source");
    if (source.is_null()) continue;
    has_time = has_time || column.at("column") == "time_s";
    is_ours = is_ours && source == column.at("column");
  }
  return !has_time || !is_ours;
}

std::string names_of(const std::vector<fs::path>& files) {
  std::string names;
  for (std::size_t k = 0; k < std::min<std::size_t>(files.size(), 3); ++k)
    names += (k > 0 ? ", " : "") + files[k].filename().string();
  return files.size() > 3 ? fmt::format("{} and {} more", names, files.size() - 3) : names;
}

// Recordings that are added are of the drive of the model: what the user does not state is as there.
Choices with_facts_of(const Session& session, Choices choices) {
  const std::shared_ptr<Step> now = session.history().current();
  if (!now) return choices;
  const model::Drive& drive = now->model.drive;
  if (!choices.gear_ratio) choices.gear_ratio = drive.gear_ratio.value;
  if (!choices.torque_constant_nm_a) choices.torque_constant_nm_a = drive.torque_constant_nm_a.value;
  if (choices.axis.empty() && drive.axis == data::Axis::linear) choices.axis = "linear";
  if (!choices.pitch_m && drive.axis == data::Axis::linear) choices.pitch_m = drive.pitch_m.value;
  return choices;
}

// Null where the files were added, else what is to be chosen for them.
json add_or_propose(Session& session, const fs::path& folder, const estimation::PipelineOptions& pipeline,
                    const std::function<json(const Choices&)>& propose, const Progress& progress) {
  try {
    const std::shared_ptr<Step> next = with_files(*session.history().current(), folder, {}, pipeline, progress);
    session.change([&](auto& history) { history.take(next); });
    return nullptr;
  } catch (const data::DataError&) {
    json proposal;
    try {
      proposal = propose(with_facts_of(session, {}));
    } catch (const std::runtime_error&) {
      // The first error is more useful.
    }
    if (proposal.is_null() || !is_foreign(proposal)) throw;
    return proposal;
  }
}

}  // namespace

fs::path Api::new_folder() {
  const std::lock_guard lock(mutex_);
  const fs::path folder = dropped_ / std::to_string(drops_++);
  fs::create_directory(folder);
  return folder;
}

std::vector<fs::path> Api::recordings_for(const fs::path& folder) const {
  if (folder.empty()) return setup_.data;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() != ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void Api::start_proposal(const std::shared_ptr<Session>& session, const json& body) {
  const Choices choices = with_facts_of(*session, choices_of(body));
  const std::optional<fs::path> folder = proposed(*session);
  if (!setup_.projects.propose || (!folder && setup_.data.empty()))
    throw UnknownNameError("there are no recordings to begin with; drop some");
  session->start("Reading the recordings",
                 [this, choices, given = body.value("choices", json()), folder = folder.value_or(""),
                  session = session.get()](const Progress& progress) {
                   progress("");
                   json proposal = setup_.projects.propose(recordings_for(folder), choices);
                   proposal["adds"] = session->has_model();
                   proposal["choices"] = given;  // a page that is loaded again goes on with them
                   progress("");
                   session->set("proposal", std::move(proposal));
                 });
}

void Api::start_project(const std::shared_ptr<Session>& session, const Choices& stated) {
  const Choices choices = with_facts_of(*session, stated);
  const std::optional<fs::path> folder = proposed(*session);
  if (!setup_.projects.make || (!folder && setup_.data.empty()))
    throw UnknownNameError("there are no recordings to begin with; drop some");
  const bool adds = session->has_model();
  session->start(adds ? "Adding the recordings" : "Identifying a first model",
                 [this, choices, adds, folder, session = session.get()](const Progress& progress) {
                   progress("reading the recordings");
                   const std::vector<fs::path> files = recordings_for(folder.value_or(""));
                   const fs::path place = folder ? *folder : new_folder();
                   const Project project = setup_.projects.make(files, choices, place);
                   std::shared_ptr<Step> step;
                   if (adds) {
                     step =
                         with_files(*session->history().current(), place, choices.tolerate, setup_.pipeline, progress);
                     session->change([&](auto& history) { history.take(step); });
                   } else {
                     step = first_of(project, place, setup_.pipeline, progress);
                     step->tolerated = choices.tolerate;
                     step->data_name = names_of(files);
                     session->change([&](auto& history) { history = History<std::shared_ptr<Step>>(step); });
                   }
                   session->store("recordings", nullptr);
                   store_all_tabs();
                 });
}

void Api::start_drop(const std::shared_ptr<Session>& session, const std::vector<Upload>& files) {
  if (files.empty()) throw UnknownNameError("no file came");
  if (files.size() > kMostFiles) throw UnknownNameError(fmt::format("at most {} files at a time", kMostFiles));
  for (const Upload& file : files) {
    if (file.name.find('\0') != std::string::npos)
      throw UnknownNameError("the name of a file holds a byte that is not text");
    ending_of_recording(file.name);
  }
  if (session->works()) throw BusyError("something is still running; wait, or cancel it");
  const bool adds = session->has_model();
  // Recordings whose columns are not chosen yet may come one after the other.
  const std::optional<fs::path> before = proposed(*session);
  const fs::path folder = before && !before->empty() ? *before : new_folder();
  const std::vector<fs::path> written = write(folder, files);
  const std::string what = fmt::format("Reading {} file{}", files.size(), files.size() == 1 ? "" : "s");
  const auto propose = [this, folder](const Choices& choices) {
    return setup_.projects.propose ? setup_.projects.propose(recordings_for(folder), choices)
                                   : throw UnknownNameError("there is no model yet");
  };
  session->start(what, [this, adds, folder, written, propose, session = session.get()](const Progress& progress) {
    json proposal;
    try {
      progress("");
      proposal = adds ? add_or_propose(*session, folder, setup_.pipeline, propose, progress) : propose({});
    } catch (...) {
      for (const fs::path& file : written) fs::remove(file);
      throw;
    }
    if (proposal.is_null()) return store_all_tabs();
    proposal["adds"] = adds;
    progress("");
    session->store("recordings", folder.string());
    session->set("proposal", std::move(proposal));
  });
}

}  // namespace flexspline::workbench
