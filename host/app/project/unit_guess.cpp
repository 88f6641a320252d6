#include "host/app/project/unit_guess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/input/data/dataset.hpp"
#include "host/input/data/units.hpp"

namespace flexspline::project {

std::vector<std::vector<double>> values_of(const data::Recording& recording, const std::vector<std::string>& names) {
  const std::vector<std::string>& there = recording.names();
  const auto find_name = [&](const std::string& name) {
    return std::find(there.begin(), there.end(), data::name_of_element(there, name, 1));
  };
  std::vector<std::size_t> wanted;
  std::vector<std::optional<std::size_t>> refs;
  for (const std::string& name : names) {
    const auto at = find_name(name);
    refs.push_back(at == there.end() ? std::nullopt : std::optional(wanted.size()));
    if (at != there.end()) wanted.push_back(static_cast<std::size_t>(at - there.begin()));
  }
  const data::Table table = recording.read(wanted);
  std::vector<std::vector<double>> values;
  for (const auto& ref : refs) values.push_back(ref ? table.columns[*ref] : std::vector<double>{});
  return values;
}

double factor_of(const std::string& unit) {
  const auto known = data::unit_from_text(unit);
  return known ? known->factor : 1.0;
}

double factor_of(const ColumnGuess& c, const Request& request) {
  if (c.unit != "counts") return factor_of(c.unit);
  const data::Axis axis = request.axis == "linear" ? data::Axis::linear : data::Axis::rotary;
  return data::encoder_step(request.encoder_counts, axis).value_or(1.0);
}

namespace {

// Whole numbers, where the counts of the encoder are stated.
bool are_counts(const std::vector<double>& position, const Request& request) {
  if (!request.encoder_counts || position.empty()) return false;
  const auto [low, high] = std::ranges::minmax(position);
  return high - low > 2.0 && std::ranges::all_of(position, [](double q) { return q == std::round(q); });
}

}  // namespace

void guess_units(std::vector<ColumnGuess>& columns, const data::Recording& recording, const Request& request) {
  const auto find = [&](std::string_view ours) {
    const auto at = std::ranges::find(columns, ours, &ColumnGuess::ours);
    return at == columns.end() ? nullptr : &*at;
  };
  ColumnGuess* time = find("time_s");
  ColumnGuess* velocity = find("motor_velocity_rad_s");
  ColumnGuess* position = find("motor_position_rad");
  const auto source = [](const ColumnGuess* c, const char* ours) { return c ? c->theirs : std::string(ours); };
  auto values = values_of(recording, {source(time, "time_s"), source(position, "motor_position_rad"),
                                      source(velocity, "motor_velocity_rad_s")});
  if (time != nullptr && time->unit.empty())
    if (const auto unit = time_unit_by_values(values[0])) {
      time->unit = *unit;
      time->why = fmt::format("\"{}\" reads as a time, in {} by the size of its steps", time->theirs, *unit);
    }
  if (position != nullptr && position->unit.empty() && !position->why.empty() && are_counts(values[1], request)) {
    position->unit = "counts";
    position->why = fmt::format("\"{}\" reads as a position, in counts as it has whole numbers only", position->theirs);
  }
  if (velocity == nullptr || !velocity->unit.empty() || values[1].empty()) return;
  for (double& t : values[0]) t *= time != nullptr ? factor_of(time->unit) : 1.0;
  for (double& q : values[1]) q *= position != nullptr ? factor_of(*position, request) : 1.0;
  if (const auto unit = velocity_unit_by_values(values[0], values[1], values[2])) {
    velocity->unit = *unit;
    velocity->why =
        fmt::format("\"{}\" reads as a velocity, in {} by comparison with the position", velocity->theirs, *unit);
  }
}

}  // namespace flexspline::project
