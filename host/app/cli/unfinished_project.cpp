#include "host/app/cli/unfinished_project.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

#include "host/app/project/candidates.hpp"
#include "host/app/project/column_names.hpp"
#include "host/input/data/findings.hpp"
#include "host/physics/model/text.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;
using project::Candidate;
using project::Kind;

// Behind the first line's text, so that all lines stay where they are.
std::string mark_of(std::string_view other_lines) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(other_lines.data());
  return fmt::format("  # an unfinished draft of flexspline new, CRC-32 of the other lines {:08x}",
                     model::crc32({bytes, other_lines.size()}));
}

std::vector<data::Finding> findings_of(const std::exception& why, data::Severity severity) {
  std::vector<data::Finding> findings;
  if (const auto* unusable = dynamic_cast<const data::DataError*>(&why))
    for (const data::Finding& finding : unusable->findings())
      if (finding.severity == severity) findings.push_back(finding);
  return findings;
}

// Units that are likely wrong are likely why two columns do not fit together.
std::vector<data::Finding> warnings_of_units(const std::exception& why) {
  std::vector<data::Finding> warnings = findings_of(why, data::Severity::warning);
  std::erase_if(warnings, [](const data::Finding& warning) { return warning.kind != "unit"; });
  return warnings;
}

std::string as_argument(const std::string& name, const std::string& value) {
  return value.empty() ? "" : fmt::format(" {} {}", name, quoted(value));
}

std::string number_argument(const std::string& name, const std::optional<double>& value) {
  return value ? fmt::format(" {} {:g}", name, *value) : "";
}

// What was given, to be typed again.
std::string as_given(const project::Request& request) {
  std::string line =
      fmt::format("flexspline new --from {} --out {}", as_arguments(request.data), quoted(request.out.string()));
  for (const std::string& map : request.map) line += as_argument("--map", map);
  for (const std::string& name : request.without) line += as_argument("--without", name);
  for (const std::string& name : request.turned) line += as_argument("--turn", name);
  line += as_argument("--axis", request.axis) + as_argument("--load", request.load) +
          as_argument("--position-side", request.position_side);
  if (request.joint) line += fmt::format(" --joint {}", *request.joint);
  if (request.pole_pairs) line += fmt::format(" --pole-pairs {}", *request.pole_pairs);
  line += number_argument("--gear-ratio", request.gear_ratio);
  line += number_argument("--torque-constant", request.torque_constant_nm_a);
  line += number_argument("--encoder-counts", request.encoder_counts);
  line += number_argument("--pitch-m", request.pitch_m);
  return line + tolerate_arguments(request.tolerate);
}

struct Missing {
  std::string ours;
  Kind kind = Kind::none;
};

// What a motor balance needs and was not found. `candidates`: where they have a torque and no current, that is meant.
std::vector<Missing> missing_of(const project::Draft& draft, const std::vector<Candidate>& candidates) {
  const auto there = [&](std::initializer_list<const char*> any) {
    return std::any_of(any.begin(), any.end(), [&](const char* name) {
      return std::find(draft.there.begin(), draft.there.end(), name) != draft.there.end();
    });
  };
  const auto is_candidate = [&](Kind kind) {
    return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.kind == kind; });
  };
  std::vector<Missing> missing;
  if (!there({"time_s"})) missing.push_back({"time_s", Kind::time});
  if (!there({"current_a", "motor_torque_nm"})) {
    if (is_candidate(Kind::torque) && !is_candidate(Kind::current))
      missing.push_back({"motor_torque_nm", Kind::torque});
    else
      missing.push_back({"current_a", Kind::current});
  }
  if (!there({"motor_position_rad", "motor_velocity_rad_s"})) missing.push_back({"motor_position_rad", Kind::position});
  return missing;
}

// A --map for each signal that a motor balance needs and that was not found.
std::string missing_maps(const project::Draft& draft, const project::Request& request) {
  // There the columns are mapped by the dataset.toml, with which no --map goes.
  if (draft.from_toml) return {};
  std::vector<Candidate> left = candidates_of(draft, request);
  std::string line;
  for (const Missing& missing : missing_of(draft, left)) {
    // "torque_nm" is the torque sensor's by its name, but many drives call their motor's torque so.
    if (missing.kind == Kind::current && !draft.toml.columns.contains("torque_nm") &&
        std::find(draft.there.begin(), draft.there.end(), "torque_nm") != draft.there.end()) {
      line += " --map motor_torque_nm=torque_nm";
      continue;
    }
    std::string theirs = "NAME";
    if (const Candidate* nearest = nearest_candidate(left, missing.ours, missing.kind)) {
      theirs = nearest->name;
      std::erase_if(left, [&](const Candidate& c) { return c.name == theirs; });
      if (missing.kind == Kind::time && project::counts_samples(theirs))
        theirs += ":PERIOD ms";
      else if (!project::unknown_unit_in_name(theirs).empty())
        theirs += ":UNIT";
    }
    // A set point is not taken by itself: how late the current follows is not known.
    const auto set_point = std::ranges::find(draft.columns, "current_command_a", &project::ColumnGuess::ours);
    if (theirs == "NAME" && missing.kind == Kind::current && set_point != draft.columns.end())
      theirs = set_point->theirs;
    line += fmt::format(" --map {}", quoted(fmt::format("{}={}", missing.ours, theirs)));
  }
  return line;
}

// A --map with a unit for position and velocity whose units do not fit together and are not stated.
std::string missing_units(const project::Draft& draft, const std::vector<data::Finding>& errors) {
  const bool is_unit = std::any_of(errors.begin(), errors.end(), [](const data::Finding& error) {
    return error.kind == "velocity_position_mismatch" && error.remedy.find("--tolerate") == std::string::npos;
  });
  std::string line;
  for (const project::ColumnGuess& c : draft.columns)
    if (is_unit && c.unit.empty() && !c.why.empty() &&
        (c.ours.find("position_rad") != std::string::npos || c.ours.find("velocity_rad_s") != std::string::npos))
      line += fmt::format(" --map {}", quoted(fmt::format("{}={}:UNIT", c.ours, c.theirs)));
  return line;
}

// The kinds to tolerate, where that alone would do.
std::string tolerations(const std::vector<data::Finding>& errors) {
  std::set<std::string> kinds;
  for (const data::Finding& error : errors) {
    const auto known = data::known_kinds();
    const auto kind = std::find_if(known.begin(), known.end(), [&](const auto& k) { return k.name == error.kind; });
    if (kind == known.end() || !kind->tolerable || error.remedy.find("--tolerate") == std::string::npos) return {};
    kinds.insert(error.kind);
  }
  std::string line;
  for (const std::string& kind : kinds) line += fmt::format(" --tolerate {}", kind);
  return line;
}

// A number of counts a turn, where a position in counts needs it, and the gear ratio where a velocity may be that of
// the other side.
std::string missing_numbers(const std::vector<data::Finding>& errors) {
  const auto says = [&](std::string_view words) {
    return std::any_of(errors.begin(), errors.end(),
                       [&](const data::Finding& error) { return error.text().find(words) != std::string::npos; });
  };
  return std::string(says("write encoder_counts ") ? " --encoder-counts NUMBER" : "") +
         (says("state gear_ratio then") ? " --gear-ratio NUMBER" : "");
}

}  // namespace

bool is_unfinished(const fs::path& dataset_toml) {
  std::ifstream file(dataset_toml, std::ios::binary);
  std::string first;
  if (!std::getline(file, first)) return false;
  const std::string others{std::istreambuf_iterator<char>(file), {}};
  return first.ends_with(mark_of(others));
}

void leave_unfinished(const project::Draft& draft, const project::Request& request, const std::exception& why,
                      Console& console) {
  const fs::path file = request.out / "dataset.toml";
  make_folder(request.out);
  std::string text = project::text_of(draft, request.out);
  const std::size_t end_of_first = text.find('\n');
  text.insert(end_of_first, mark_of(std::string_view(text).substr(end_of_first + 1)));
  model::save(file, text);
  const std::vector<data::Finding> errors = findings_of(why, data::Severity::error);
  for (const std::string& error : data::texts_of(errors, data::Severity::error)) console.error(error);
  for (const std::string& warning : data::warning_texts(warnings_of_units(why))) console.warn(warning);
  if (errors.empty()) console.error(why.what());
  std::string line = as_given(request) + missing_maps(draft, request) + missing_units(draft, errors) +
                     missing_numbers(errors) + tolerations(errors);
  if (!draft.open_question.empty()) line += " --position-side SIDE";
  console.error(
      fmt::format("{} holds what could be found; replace NAME, UNIT, PERIOD, NUMBER, SIDE or a wrong name by the right "
                  "one (NAME:UNIT states its unit), and continue with\n  {}",
                  file.string(), line));
}

}  // namespace flexspline::cli
