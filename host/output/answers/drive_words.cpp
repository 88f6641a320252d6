#include "host/output/answers/drive_words.hpp"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <optional>
#include <utility>

#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::output {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kOnLinearAxis = {{
    {"torque", "force"},
    {"torques", "forces"},
    {"Torque", "Force"},
    {"Torques", "Forces"},
    {"N m", "N"},
    {"N*m", "N"},
    {"rad", "m"},
    {"output angle", "output position"},
}};

// An underscore or a dash makes a word a part of a name: torque_nm, --travel-rad.
bool is_of_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
}

bool is_word_at(std::string_view text, std::size_t at, std::string_view word) {
  if (text.substr(at, word.size()) != word) return false;
  const std::size_t end = at + word.size();
  return (at == 0 || !is_of_name(text[at - 1])) && (end == text.size() || !is_of_name(text[end]));
}

// What an effect's equation refers to besides its parameters.
struct Reference {
  std::string_view symbol;
  std::string_view key;  // of the model's [drive]
  double value = 0.0;
  std::string_view unit;
  bool stated = false;
};

std::optional<Reference> reference_of(std::string_view effect, const model::Drive& drive) {
  const catalogue::Entry* entry = catalogue::find(effect);
  if (entry == nullptr) return std::nullopt;
  const auto constants = catalogue::constants_of(drive);
  const std::string_view equation = entry->info->equation;
  if (equation.find("wref") != std::string_view::npos)
    return Reference{"wref", "rated_velocity_rad_s", constants.rated_velocity,
                     catalogue::unit_on(effects::units::kVelocity, drive.axis),
                     drive.rated_velocity_rad_s.value.has_value()};
  if (equation.find("temp0") != std::string_view::npos)
    return Reference{"temp0", "temperature_reference_c", constants.reference_temperature, "degC",
                     drive.temperature_reference_c.value.has_value()};
  return std::nullopt;
}

}  // namespace

std::string words_on(data::Axis axis, std::string_view text) {
  if (axis == data::Axis::rotary) return std::string(text);
  std::string changed;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t length = 1;
    std::string_view by = text.substr(at, 1);
    for (const auto& [word, replacement] : kOnLinearAxis)
      if (is_word_at(text, at, word)) {
        length = word.size();
        by = replacement;
      }
    changed += by;
    at += length;
  }
  return changed;
}

data::Axis axis_of(std::string_view unit) {
  return unit == "N" ? data::Axis::linear : data::Axis::rotary;
}

std::string reference_text(std::string_view effect, const model::Drive& drive) {
  const auto r = reference_of(effect, drive);
  if (!r) return {};
  return fmt::format("{} = {}, {}", r->symbol, with_unit(r->value, r->unit),
                     r->stated ? fmt::format("{} of the model's [drive]", r->key)
                               : fmt::format("as the model's [drive] has no {}", r->key));
}

std::string reference_rule(std::string_view effect) {
  model::Drive linear;
  linear.axis = data::Axis::linear;
  const auto r = reference_of(effect, {}), on_linear = reference_of(effect, linear);
  if (!r || !on_linear) return {};
  return fmt::format("{}: {} of the model's [drive], without it {}{}", r->symbol, r->key, with_unit(r->value, r->unit),
                     r->unit == on_linear->unit
                         ? ""
                         : fmt::format(" (on a linear axis {})", with_unit(on_linear->value, on_linear->unit)));
}

}  // namespace flexspline::output
