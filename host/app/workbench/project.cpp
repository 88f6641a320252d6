#include "host/app/workbench/project.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/workbench/result_view.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;

std::string text(const json& body, const char* key) {
  if (!body.contains(key) || body[key].is_null()) return {};
  if (!body[key].is_string()) throw UnknownNameError(fmt::format("{} is not a text", key));
  return body[key].get<std::string>();
}

std::vector<std::string> texts(const json& body, const char* key) {
  std::vector<std::string> all;
  if (!body.contains(key) || body[key].is_null()) return all;
  if (!body[key].is_array()) throw UnknownNameError(fmt::format("{} is not a list", key));
  for (const json& one : body[key]) {
    if (!one.is_string()) throw UnknownNameError(fmt::format("{} holds something that is not a text", key));
    all.push_back(one.get<std::string>());
  }
  return all;
}

std::optional<double> positive(const json& body, const char* key) {
  if (!body.contains(key) || body[key].is_null()) return std::nullopt;
  if (!body[key].is_number() || !(body[key].get<double>() > 0.0))
    throw UnknownNameError(fmt::format("{} has to be a number above zero", key));
  return body[key].get<double>();
}

std::optional<int> whole(const json& body, const char* key, int least) {
  if (!body.contains(key) || body[key].is_null()) return std::nullopt;
  const double value = body[key].is_number() ? body[key].get<double>() : -1.0;
  if (value != std::floor(value) || value < least || value > 1e4)
    throw UnknownNameError(fmt::format("{} has to be a whole number from {} on", key, least));
  return static_cast<int>(value);
}

}  // namespace

Choices choices_of(const json& body) {
  Choices choices;
  if (!body.contains("choices")) return choices;
  const json& given = body["choices"];
  if (!given.is_object()) throw UnknownNameError("choices are no object");
  choices.map = texts(given, "map");
  choices.without = texts(given, "without");
  choices.turned = texts(given, "turned");
  choices.tolerate = texts(given, "tolerate");
  choices.axis = text(given, "axis");
  choices.position_side = text(given, "position_side");
  if (!choices.axis.empty() && choices.axis != "rotary" && choices.axis != "linear")
    throw UnknownNameError("axis is rotary or linear");
  if (!choices.position_side.empty() && choices.position_side != "link" && choices.position_side != "motor")
    throw UnknownNameError("position_side is link or motor");
  choices.joint = whole(given, "joint", 0);
  choices.pole_pairs = whole(given, "pole_pairs", 1);
  choices.gear_ratio = positive(given, "gear_ratio");
  choices.torque_constant_nm_a = positive(given, "torque_constant_nm_a");
  choices.encoder_counts = positive(given, "encoder_counts");
  choices.pitch_m = positive(given, "pitch_m");
  return choices;
}

}  // namespace flexspline::workbench
