#include "host/app/cli/unfinished_project.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

#include "host/app/project/column_names.hpp"
#include "host/common/text/nearest.hpp"
#include "host/input/data/findings.hpp"
#include "host/physics/model/text.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::cli {
namespace {

namespace fs = std::filesystem;

// Behind the first line's text, so that all lines stay where they are.
std::string mark_of(std::string_view other_lines) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(other_lines.data());
  return fmt::format("  # an unfinished draft of flexspline new, CRC-32 of the other lines {:08x}",
                     model::crc32({bytes, other_lines.size()}));
}

std::vector<data::Finding> errors_of(const std::exception& why) {
  std::vector<data::Finding> errors;
  if (const auto* unusable = dynamic_cast<const data::DataError*>(&why))
    for (const data::Finding& finding : unusable->findings())
      if (finding.severity == data::Severity::error) errors.push_back(finding);
  return errors;
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
  line += as_argument("--axis", request.axis) + as_argument("--position-side", request.position_side);
  if (request.joint) line += fmt::format(" --joint {}", *request.joint);
  if (request.pole_pairs) line += fmt::format(" --pole-pairs {}", *request.pole_pairs);
  line += number_argument("--gear-ratio", request.gear_ratio);
  line += number_argument("--torque-constant", request.torque_constant_nm_a);
  line += number_argument("--encoder-counts", request.encoder_counts);
  for (const std::string& kind : request.tolerate) line += as_argument("--tolerate", kind);
  return line;
}

// A --map for each signal that a motor balance needs and that was not found.
std::string missing_maps(const project::Draft& draft) {
  const auto there = [&](std::initializer_list<const char*> any) {
    return std::any_of(any.begin(), any.end(), [&](const char* name) {
      return std::find(draft.there.begin(), draft.there.end(), name) != draft.there.end();
    });
  };
  std::vector<std::string> missing;
  std::string line;
  if (!there({"time_s"})) missing.emplace_back("time_s");
  // "torque_nm" is the torque sensor's by its name, but many drives call their motor's torque so.
  if (!there({"current_a", "motor_torque_nm"})) {
    if (there({"torque_nm"}) && !draft.toml.columns.contains("torque_nm"))
      line += " --map motor_torque_nm=torque_nm";
    else
      missing.emplace_back("current_a");
  }
  if (!there({"motor_position_rad", "motor_velocity_rad_s"})) missing.emplace_back("motor_position_rad");
  std::vector<std::string> left = draft.unused;
  for (const std::string& ours : missing) {
    std::string theirs = "NAME";
    if (!left.empty()) {
      theirs = text::nearest_first(ours, left).front();
      std::erase(left, theirs);
      if (ours == "time_s" && project::counts_samples(theirs))
        theirs += ":PERIOD ms";
      else if (!project::unknown_unit_in_name(theirs).empty())
        theirs += ":UNIT";
    }
    line += fmt::format(" --map {}", quoted(fmt::format("{}={}", ours, theirs)));
  }
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

// A number of counts a turn, where a position in counts needs it.
std::string missing_counts(const std::vector<data::Finding>& errors) {
  const bool is_missing = std::any_of(errors.begin(), errors.end(), [](const data::Finding& error) {
    return error.remedy.find("write encoder_counts ") != std::string::npos;
  });
  return is_missing ? " --encoder-counts NUMBER" : "";
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
  const std::vector<data::Finding> errors = errors_of(why);
  for (const data::Finding& error : errors) console.error(error.text());
  if (errors.empty()) console.error(why.what());
  std::string line = as_given(request) + missing_maps(draft) + missing_counts(errors) + tolerations(errors);
  if (!draft.open_question.empty()) line += " --position-side SIDE";
  console.error(
      fmt::format("{} holds what could be found; replace NAME, UNIT, PERIOD, NUMBER, SIDE or a wrong name by the right "
                  "one (NAME:UNIT states its unit), and continue with\n  {}",
                  file.string(), line));
}

}  // namespace flexspline::cli
