#include "host/app/project/draft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "host/app/project/candidates.hpp"
#include "host/app/project/unit_guess.hpp"
#include "host/common/text/nearest.hpp"
#include "host/input/data/record_summary.hpp"
#include "host/input/data/recording.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::project {
namespace {

namespace fs = std::filesystem;
using data::Column;

[[noreturn]] void fail(const fs::path& file, const std::string& what, const std::string& remedy) {
  throw data::DataError({{data::Severity::error, "file", file.string(), 0, "", what, remedy}});
}

// The dataset.toml that a path refers to, if any.
std::optional<fs::path> toml_of(const fs::path& path) {
  if (fs::is_directory(path) && fs::exists(path / "dataset.toml")) return path / "dataset.toml";
  if (path.extension() == ".toml") return path;
  return std::nullopt;
}

data::KeyValue number_value(double value) {
  return {model::exact_text(value), value, "", 0};
}

// Those that a column of ours may be given in, on an axis that turns and on one that moves straight.
std::string units_of(const std::string& ours) {
  const std::optional<Column> column = data::column_from_name(ours);
  if (!column) return data::known_units(data::Quantity::time);
  const std::string rotary = data::known_units(data::quantity_of(*column, data::Axis::rotary));
  const std::string linear = data::known_units(data::quantity_of(*column, data::Axis::linear));
  return rotary == linear ? rotary : rotary + "; on a linear axis " + linear;
}

// A number above zero: how many units the column's ones are.
bool is_plain_number(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && stop == end && std::isfinite(value) && value > 0.0;
}

// The unit that a number alone is of: that in the name of theirs, or that of ours.
std::string unit_of_scale(const ColumnGuess& guess, data::Axis axis) {
  const std::string in_name = unit_in_name(guess.theirs);
  if (!in_name.empty() && data::unit_from_text("1 " + in_name)) return in_name;
  const std::optional<Column> column = data::column_from_name(guess.ours);
  return std::string(data::si_unit(column ? data::quantity_of(*column, axis) : data::Quantity::time));
}

// A name that says that it is no SI value, without a unit that is known, needs one.
void require_unit_in_name(const ColumnGuess& guess) {
  const std::string map = fmt::format("--map {}={}", guess.ours, guess.theirs);
  if (guess.ours == "time_s" && counts_samples(guess.theirs))
    throw RequestError(
        fmt::format("{0}: \"{1}\" counts samples; state their period as its unit, as in --map "
                    "'{2}={1}:0.25 ms'",
                    map, guess.theirs, guess.ours));
  const std::string unit = unknown_unit_in_name(guess.theirs);
  if (unit == "%")
    throw RequestError(
        fmt::format("{0}: it is a ratio to a rated value; state the size of 1 % as its unit, as in "
                    "--map '{1}={2}:{3}' where 100 % are {4}",
                    map, guess.ours, guess.theirs, guess.ours == "current_a" ? "0.05 A" : "0.125 N*m",
                    guess.ours == "current_a" ? "5 A" : "12.5 N*m"));
  if (!unit.empty())
    throw RequestError(
        fmt::format("{}: the unit \"{}\" in its name is not known; state one, as in --map '{}={}:UNIT'; "
                    "those of {} are {}, also with a number before them",
                    map, unit, guess.ours, guess.theirs, guess.ours, units_of(guess.ours)));
}

// `names`: the columns of all files; `first` may say why it has none of a name.
ColumnGuess mapping_of(const std::string& text, const std::vector<std::string>& names, const data::Recording& first) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    throw RequestError(fmt::format("--map {} is not OURS=THEIRS[:UNIT]; as in --map current_a=Iq:mA", text));
  ColumnGuess guess{text.substr(0, equals), text.substr(equals + 1), "", ""};
  if (guess.ours != "time_s" && !data::column_from_name(guess.ours)) {
    std::vector<std::string> ours = {"time_s"};
    for (std::size_t c = 0; c < data::kColumns; ++c) ours.emplace_back(data::column_name(static_cast<Column>(c)));
    throw RequestError(fmt::format("--map {}: there is no column \"{}\" of ours; ours are {}", text, guess.ours,
                                   output::listed(ours)));
  }
  const auto is_name = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::size_t colon = guess.theirs.rfind(':');
  // A row of a MAT file's matrix has a colon of its own: data(1,:).
  if (!is_name(guess.theirs) && colon != std::string::npos && guess.theirs.find(')', colon) == std::string::npos) {
    guess.unit = guess.theirs.substr(colon + 1);
    guess.theirs.erase(colon);
    if (!data::unit_from_text(guess.unit) && !is_plain_number(guess.unit))
      throw RequestError(
          fmt::format("--map {}: the unit \"{}\" is not known; those of {} are {}, also with a number above zero "
                      "before them, as in --map '{}={}:0.5 {}'",
                      text, guess.unit, guess.ours, units_of(guess.ours), guess.ours, guess.theirs,
                      unit_of_scale(guess, data::Axis::rotary)));
  }
  if (!is_name(guess.theirs)) {
    const std::string why = first.why_not(guess.theirs);
    throw RequestError(fmt::format("--map {}: {}; the columns are {}", text,
                                   why.empty() ? fmt::format("no file has a column \"{}\"", guess.theirs)
                                               : fmt::format("\"{}\" {}", guess.theirs, why),
                                   output::listed(text::nearest_first(guess.theirs, names))));
  }
  if (guess.unit.empty()) require_unit_in_name(guess);
  return guess;
}

using Lengths = std::vector<std::pair<std::string, std::size_t>>;

// The runs of a struct array have the same names, so that one mapping fits them all; here they have the first one's
// lengths.
Lengths lengths_of(const data::Recording& recording) {
  Lengths lengths;
  for (std::size_t i = 0; i < recording.names().size(); ++i) {
    const data::ElementName name = data::without_element(recording.names()[i]);
    if (name.element <= 1) lengths.emplace_back(name.name, recording.length(i));
  }
  return lengths;
}

std::size_t elements_of(const data::Recording& recording) {
  std::size_t most = 0;
  for (const std::string& name : recording.names()) most = std::max(most, data::without_element(name).element);
  return most;
}

// A file as one experiment, or each element of a struct array in it.
std::vector<data::ExperimentEntry> entries_of(const fs::path& file, const data::Recording& recording) {
  data::ExperimentEntry entry;
  entry.file = fs::absolute(file);
  const std::size_t elements = elements_of(recording);
  if (elements == 0) return {entry};
  std::vector<data::ExperimentEntry> entries;
  for (std::size_t k = 1; k <= elements; ++k) {
    entry.element = k;
    entry.keys["experiment"] = text_value(fmt::format("{}-{}", file.stem().string(), k));
    entries.push_back(entry);
  }
  return entries;
}

std::vector<std::string> of_length(std::size_t wanted, const Lengths& lengths) {
  std::vector<std::string> names;
  for (const auto& [name, length] : lengths)
    if (length == wanted) names.push_back(name);
  return names;
}

// The columns of a file that make one table with the time called so; where there is none, those of the largest table.
std::vector<std::string> table_with(const std::string& time, const Lengths& lengths) {
  std::size_t wanted = 0, most = 0;
  std::map<std::size_t, std::size_t> values;
  for (const auto& [name, length] : lengths) {
    if (name == time) return of_length(length, lengths);
    values[length] += length;
    if (values[length] > most) {
      most = values[length];
      wanted = length;
    }
  }
  return of_length(wanted, lengths);
}

ColumnGuess* find(std::vector<ColumnGuess>& columns, std::string_view ours) {
  for (ColumnGuess& c : columns)
    if (c.ours == ours) return &c;
  return nullptr;
}

// Position and velocity of two sides of the gear: where one is the other's rate times the gear ratio, both become the
// motor's, whatever side was taken for both.
void take_sides_of_values(HeaderGuess& guess, const data::Recording& recording, const Request& request) {
  constexpr double kSameRatio = 0.03;
  ColumnGuess* position = find(guess.columns, "motor_position_rad");
  ColumnGuess* velocity = find(guess.columns, "motor_velocity_rad_s");
  const ColumnGuess* time = find(guess.columns, "time_s");
  const double ratio = std::abs(request.gear_ratio.value_or(1.0));
  if (position == nullptr || velocity == nullptr || ratio < 2.0) return;
  auto values = values_of(recording, {time != nullptr ? time->theirs : "time_s", position->theirs, velocity->theirs});
  for (double& t : values[0]) t *= time != nullptr ? factor_of(time->unit) : 1.0;
  for (double& q : values[1]) q *= factor_of(*position, request);
  for (double& w : values[2]) w *= factor_of(velocity->unit);
  const double factor = std::abs(velocity_over_slope(values[0], values[1], values[2]).value_or(1.0));
  const auto is = [&](double wanted) { return std::abs(factor / wanted - 1.0) < kSameRatio; };
  const auto says_motor = [&](const ColumnGuess& c) {
    return read_name(c.theirs, "", recording.names()).side == Side::motor;
  };
  // "theta_m" with its rate "theta_dot".
  if (is(1.0) && guess.side_is_asked_for && (says_motor(*position) || says_motor(*velocity))) {
    guess.side = Side::motor;
    guess.side_is_asked_for = false;
  }
  if (!is(ratio) && !is(1.0 / ratio)) return;
  ColumnGuess& link = is(ratio) ? *position : *velocity;
  ColumnGuess& motor = is(ratio) ? *velocity : *position;
  link.scale = *request.gear_ratio;
  motor.scale = 1.0;
  const auto add = [](ColumnGuess& c, const std::string& side) {
    c.why = (c.why.empty() ? fmt::format("\"{}\", as stated", c.theirs) : c.why) + side;
  };
  add(link, fmt::format("; of the link by comparison of both, here times the gear ratio {:g}", ratio));
  add(motor, "; of the motor by comparison of both");
  guess.side.reset();
  guess.side_is_asked_for = guess.joint_side = false;
  guess.scaled_by = 1.0;
}

void turn(HeaderGuess& guess, const std::vector<std::string>& turned) {
  for (const std::string& ours : turned) {
    if (ColumnGuess* column = find(guess.columns, ours)) {
      column->scale *= -1.0;
      continue;
    }
    if (std::find(guess.native.begin(), guess.native.end(), ours) == guess.native.end())
      throw RequestError(fmt::format("--turn {}: there is no such column; map one with --map {}=THEIRS", ours, ours));
    guess.columns.push_back({ours, ours, "", "", -1.0});
  }
}

bool has(const std::vector<std::string>& list, std::string_view text) {
  return std::ranges::find(list, text) != list.end();
}

void add_stated_facts(Draft& draft, const Request& request) {
  for (const data::KindInfo& kind : data::known_kinds())
    if (kind.tolerable && has(request.tolerate, kind.name) && !has(draft.toml.tolerate, kind.name))
      draft.toml.tolerate.emplace_back(kind.name);
  if (!request.axis.empty()) draft.toml.drive["axis"] = text_value(request.axis);
  if (!request.load.empty()) {
    // One line for each experiment, where a user corrects it for one of them.
    for (data::ExperimentEntry& entry : draft.toml.experiments) entry.keys["load"] = text_value(request.load);
    draft.notes.push_back(fmt::format("the output is {} in all recordings, as stated", request.load));
  }
  if (request.gear_ratio) draft.toml.drive["gear_ratio"] = number_value(*request.gear_ratio);
  if (request.torque_constant_nm_a)
    draft.toml.drive["torque_constant_nm_a"] = number_value(*request.torque_constant_nm_a);
  if (request.pole_pairs) draft.toml.drive["pole_pairs"] = number_value(*request.pole_pairs);
  if (request.pitch_m) draft.toml.drive["pitch_m"] = number_value(*request.pitch_m);
  if (request.encoder_counts) draft.toml.defaults["encoder_counts"] = number_value(*request.encoder_counts);
}

std::vector<LoggedColumn> logged_columns(const std::vector<std::string>& names, const data::Recording& first) {
  std::vector<LoggedColumn> logged;
  for (const std::string& name : names) {
    const auto at = std::find(first.names().begin(), first.names().end(), name);
    const bool there = at != first.names().end();
    logged.push_back({name, there ? first.unit(static_cast<std::size_t>(at - first.names().begin())) : ""});
  }
  return logged;
}

void take_side(Draft& draft, const HeaderGuess& guess) {
  if (!guess.needs_pole_pairs.empty())
    draft.notes.push_back(fmt::format(
        "\"{}\" counts electrical turns; give --pole-pairs P, or it is taken for the motor's", guess.needs_pole_pairs));
  if (guess.joint)
    draft.notes.push_back(
        fmt::format("the file has the joints {}; joint {} was taken, --joint takes another. If others move, "
                    "map what they do to this one as load_torque_nm, or record it alone",
                    fmt::join(guess.joints, ", "), *guess.joint));
  if (guess.joint_side) {
    draft.toml.drive["gear_ratio"] = number_value(1.0);
    draft.gear_comment = "no motor sensors: the joint's columns are used as the motor's";
    draft.notes.push_back(
        "there are no motor sensors: the joint's own columns are used as the motor's, with gear ratio 1; give "
        "--gear-ratio N to have the motor's side of the gear");
  } else if (guess.scaled_by != 1.0) {
    draft.notes.push_back(fmt::format(
        "the position is of the link, current or torque of the motor: the motor's position and velocity are "
        "those of the link times the gear ratio {:g}",
        guess.scaled_by));
  } else if (guess.side == Side::open && guess.axis == data::Axis::rotary) {
    draft.notes.push_back("the position is taken for the motor's; --position-side link says that it is the link's");
  }
  if (guess.side_is_asked_for)
    draft.open_question =
        "the names do not show whether position and velocity are of the motor or of the link, and with this gear ratio "
        "that makes a difference; give --position-side motor or --position-side link";
}

void add_new(const std::vector<std::string>& from, std::vector<std::string>& to) {
  for (const std::string& name : from)
    if (std::find(to.begin(), to.end(), name) == to.end()) to.push_back(name);
}

// The columns of all files.
struct LoggedFiles {
  std::vector<std::string> names;
  std::vector<Lengths> lengths;  // by file
  std::unique_ptr<data::Recording> first;
};

// Adds an experiment a file, or a run in it, to the draft.
LoggedFiles open_files(const std::vector<fs::path>& files, Draft& draft) {
  LoggedFiles logged;
  data::Findings findings;
  for (const fs::path& file : files) {
    std::unique_ptr<data::Recording> recording = data::open_recording(file, findings);
    logged.lengths.push_back(lengths_of(*recording));
    std::vector<std::string> of_file;
    for (const auto& [name, length] : logged.lengths.back()) of_file.push_back(name);
    add_new(of_file, logged.names);
    for (data::ExperimentEntry& entry : entries_of(file, *recording))
      draft.toml.experiments.push_back(std::move(entry));
    if (!logged.first) logged.first = std::move(recording);
  }
  return logged;
}

GuessOptions guess_options(const Request& request, const std::vector<std::string>& names) {
  GuessOptions how;
  if (!request.axis.empty()) how.axis = request.axis == "linear" ? data::Axis::linear : data::Axis::rotary;
  how.position_side = request.position_side == "link"    ? Side::link
                      : request.position_side == "motor" ? Side::motor
                                                         : Side::open;
  how.gear_ratio = request.gear_ratio;
  how.joint = request.joint;
  for (const std::string& name : request.without) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw RequestError(fmt::format("--without {}: no file has such a column; the columns are {}", name,
                                     output::listed(text::nearest_first(name, names))));
    if (name == "time_s" || data::column_from_name(name))
      throw RequestError(
          fmt::format("--without {0}: a column that has a name of ours is always read; give it another name "
                      "in the file, or --map {0}=THEIRS to take another one for it",
                      name));
    how.without.push_back(name);
  }
  how.pole_pairs = request.pole_pairs;
  return how;
}

HeaderGuess guess_of_files(const LoggedFiles& logged, const Request& request) {
  std::vector<ColumnGuess> stated;
  for (const std::string& text : request.map) stated.push_back(mapping_of(text, logged.names, *logged.first));
  GuessOptions how = guess_options(request, logged.names);
  const ColumnGuess* time = find(stated, "time_s");
  std::vector<std::string> of_one_table;
  for (const Lengths& of_file : logged.lengths)
    add_new(table_with(time != nullptr ? time->theirs : "time_s", of_file), of_one_table);
  HeaderGuess guess = guess_columns(logged_columns(of_one_table, *logged.first), stated, how);
  // Text is no measurement, whatever its name, where another column may be it; else the text is reported.
  std::vector<std::string> guessed;
  for (const ColumnGuess& c : guess.columns)
    if (!c.why.empty()) guessed.push_back(c.theirs);
  add_new(texts_in(*logged.first, guessed), how.without);
  HeaderGuess of_numbers = guess_columns(logged_columns(of_one_table, *logged.first), stated, how);
  if (of_numbers.columns.size() == guess.columns.size()) guess = std::move(of_numbers);
  for (ColumnGuess& c : guess.columns)
    if (is_plain_number(c.unit)) c.unit += " " + unit_of_scale(c, guess.axis);
  if (request.joint && std::find(guess.joints.begin(), guess.joints.end(), *request.joint) == guess.joints.end())
    throw RequestError(fmt::format("--joint {}: {}", *request.joint,
                                   guess.joints.empty()
                                       ? std::string("no position or velocity has the number of a joint")
                                       : fmt::format("the joints are {}", fmt::join(guess.joints, ", "))));
  guess_units(guess.columns, *logged.first, request);
  take_sides_of_values(guess, *logged.first, request);
  turn(guess, request.turned);
  return guess;
}

void take_columns(Draft& draft, const HeaderGuess& guess) {
  for (const ColumnGuess& c : guess.columns) {
    data::ColumnMapping mapping;
    mapping.source = c.theirs;
    mapping.unit = c.unit;
    mapping.scale = c.scale;
    draft.toml.columns[c.ours] = mapping;
    draft.comments[c.ours] = c.why.empty() ? "stated" : fmt::format("guess: {}", c.why);
    draft.notes.push_back(fmt::format("{}: {}{}", c.ours,
                                      c.why.empty() ? fmt::format("\"{}\", as stated", c.theirs) : c.why,
                                      c.unit.empty() ? "" : fmt::format(" ({})", c.unit)));
  }
}

Draft draft_of_files(const std::vector<fs::path>& files, const Request& request) {
  Draft draft;
  const LoggedFiles logged = open_files(files, draft);
  const HeaderGuess guess = guess_of_files(logged, request);
  take_columns(draft, guess);
  if (request.pitch_m && guess.axis != data::Axis::linear)
    throw RequestError(fmt::format("--pitch-m {:g}: the axis is rotary; give --axis linear with it, or leave it out",
                                   *request.pitch_m));
  if (guess.axis == data::Axis::linear || !request.axis.empty()) {
    draft.toml.drive["axis"] = text_value(guess.axis == data::Axis::linear ? "linear" : "rotary");
    if (!guess.axis_why.empty()) {
      draft.axis_comment = fmt::format("guess: {}", guess.axis_why);
      draft.notes.push_back(fmt::format("the axis is linear (m, m/s, N), as {}", guess.axis_why));
    }
  }
  take_side(draft, guess);
  draft.side = guess.side;
  draft.joints = guess.joints;
  draft.joint = guess.joint;
  draft.needs_pole_pairs = guess.needs_pole_pairs;
  draft.there = guess.native;
  for (const ColumnGuess& c : guess.columns) draft.there.push_back(c.ours);
  draft.columns = guess.columns;
  draft.unused = guess.unused;
  add_stated_facts(draft, request);
  return draft;
}

Draft draft_of_toml(const fs::path& path, const Request& request) {
  if (!request.map.empty())
    throw RequestError(fmt::format("--map does not go with {}, which maps columns; change it there", path.string()));
  Draft draft;
  data::Findings findings(request.tolerate);
  draft.toml = data::read_dataset_toml(path, findings);
  if (draft.toml.experiments.empty())
    for (const fs::path& file :
         data::recordings_in(path.has_parent_path() ? path.parent_path() : fs::path("."), findings)) {
      data::ExperimentEntry entry;
      entry.file = file;
      draft.toml.experiments.push_back(std::move(entry));
    }
  for (data::ExperimentEntry& entry : draft.toml.experiments) entry.file = fs::absolute(entry.file);
  draft.from_toml = true;
  draft.notes.push_back(fmt::format("the facts in {} are kept", path.string()));
  add_stated_facts(draft, request);
  return draft;
}

}  // namespace

Draft draft_of(const Request& request) {
  data::Findings findings;
  std::vector<fs::path> files;
  for (const fs::path& path : request.data) {
    if (!fs::exists(path))
      fail(path, "there is no such file or folder", "give CSV or MAT files, folders of them, or a dataset.toml");
    if (const auto toml = toml_of(path)) {
      if (request.data.size() > 1)
        throw RequestError(fmt::format("{} already lists what belongs together; give it alone, or give recordings only",
                                       toml->string()));
      return draft_of_toml(*toml, request);
    }
    if (fs::is_directory(path))
      for (fs::path& file : data::recordings_in(path, findings)) files.push_back(std::move(file));
    else
      files.push_back(path);
  }
  return draft_of_files(files, request);
}

}  // namespace flexspline::project
