#include "host/physics/model/text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "host/physics/model/units.hpp"

namespace flexspline::model {
namespace {

// From "-3.630e-04", as std::to_chars writes it, to "-3.63e-4" or a plain decimal number where that is short.
std::string lay_out(std::string_view scientific) {
  std::string sign;
  if (scientific.starts_with('-')) {
    sign = "-";
    scientific.remove_prefix(1);
  }
  const std::size_t mark = scientific.find('e');
  std::string_view exponent_digits = scientific.substr(mark + 1);
  if (exponent_digits.starts_with('+')) exponent_digits.remove_prefix(1);
  int exponent = 0;
  std::from_chars(exponent_digits.data(), exponent_digits.data() + exponent_digits.size(), exponent);
  std::string digits;
  for (const char c : scientific.substr(0, mark))
    if (c != '.') digits += c;
  while (digits.size() > 1 && digits.back() == '0') digits.pop_back();
  if (digits == "0") return "0";

  const auto point = static_cast<std::size_t>(exponent + 1);  // used where not negative
  if (exponent < -3 || exponent >= 6)
    return sign + digits.substr(0, 1) + (digits.size() > 1 ? "." + digits.substr(1) : "") + "e" +
           std::to_string(exponent);
  if (exponent < 0) return sign + "0." + std::string(static_cast<std::size_t>(-exponent - 1), '0') + digits;
  if (digits.size() <= point) return sign + digits + std::string(point - digits.size(), '0');
  return sign + digits.substr(0, point) + "." + digits.substr(point);
}

void require_finite(double value) {
  if (!std::isfinite(value)) throw std::logic_error("a model with a value that is not finite cannot be written");
}

}  // namespace

std::string number_text(double value, int digits) {
  require_finite(value);
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits - 1);
  return lay_out({buffer, static_cast<std::size_t>(result.ptr - buffer)});
}

std::string exact_text(double value) {
  require_finite(value);
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific);
  return lay_out({buffer, static_cast<std::size_t>(result.ptr - buffer)});
}

std::string value_text(const Parameter& parameter) {
  return parameter.fixed ? exact_text(parameter.value.value()) : number_text(parameter.value.value(), kValueDigits);
}

std::string toml_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (c == '\n') {
      result += "\\n";
    } else if (c == '\t') {
      result += "\\t";
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) {
      result += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      result += c;
    }
  }
  return result + "\"";
}

bool is_stated(const Parameter& parameter) {
  return parameter.value || parameter.std || parameter.spread_percent || parameter.fixed || parameter.low ||
         parameter.high;
}

std::string parameter_text(const Parameter& parameter) {
  const bool has_unit = !is_dimensionless(parameter.unit);
  if (parameter.value && !has_unit && !parameter.std && !parameter.spread_percent && !parameter.fixed &&
      !parameter.low && !parameter.high)
    return value_text(parameter);
  std::string fields;
  const auto add = [&fields](std::string_view key, const std::string& text) {
    fields += fmt::format("{}{} = {}", fields.empty() ? "" : ", ", key, text);
  };
  if (parameter.value) add("value", value_text(parameter));
  if (has_unit) add("unit", toml_string(parameter.unit));
  if (parameter.std) add("std", number_text(*parameter.std, kDeviationDigits));
  if (parameter.spread_percent) add("spread_percent", number_text(*parameter.spread_percent, kDeviationDigits));
  if (parameter.fixed) add("fixed", "true");
  if (parameter.low) add("low", exact_text(*parameter.low));
  if (parameter.high) add("high", exact_text(*parameter.high));
  return fields.empty() ? "{}" : "{ " + fields + " }";
}

std::string quantity_text(const Quantity& quantity) {
  std::string fields;
  if (quantity.value) fields = exact_text(*quantity.value);
  if (quantity.source.empty()) return fields.empty() ? "{}" : fields;
  return fmt::format("{{ {}source = {} }}", fields.empty() ? "" : "value = " + fields + ", ",
                     toml_string(quantity.source));
}

std::string effect_block(const Effect& effect, std::string_view newline) {
  std::string block = fmt::format("[[effect]]{0}type = {1}{0}", newline, toml_string(effect.type));
  if (!effect.id.empty() && effect.id != effect.type)
    block += fmt::format("id = {}{}", toml_string(effect.id), newline);
  if (effect.definition) {
    const Definition& d = *effect.definition;
    for (const auto& [key, value] : {std::pair{"variable", &d.variable}, {"formula", &d.formula}})
      if (!value->empty()) block += fmt::format("{} = {}{}", key, toml_string(*value), newline);
    block += fmt::format("balance = {}{}", toml_string(d.balance), newline);
    if (d.times_direction) block += fmt::format("times_direction = true{}", newline);
  }
  bool first = true;
  for (const Parameter& parameter : effect.parameters) {
    // The parameters of a formula are known from here alone.
    if (!is_stated(parameter) && !effect.definition) continue;
    if (first) block += fmt::format("[effect.parameters]{}", newline);
    first = false;
    block += fmt::format("{} = {}{}", parameter.name, parameter_text(parameter), newline);
  }
  if (effect.definition) block += table_block(effect.definition->table, newline);
  return block;
}

std::string list_text(const std::vector<double>& values, int digits, std::string_view newline) {
  constexpr std::size_t kPerLine = 8;
  std::string text = "[";
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (k % kPerLine == 0) text += fmt::format("{}  ", newline);
    text += fmt::format("{},{}", number_text(values[k], digits), k % kPerLine + 1 < kPerLine ? " " : "");
  }
  while (text.ends_with(' ')) text.pop_back();
  return text + fmt::format("{}]", newline);
}

std::string table_block(const Table& table, std::string_view newline) {
  if (table.at.empty()) return {};
  std::string block = fmt::format("[effect.table]{0}at = {1}{0}", newline, list_text(table.at, kPointDigits, newline));
  if (!table.value.empty())
    block += fmt::format("value = {}{}", list_text(table.value, kValueDigits, newline), newline);
  if (!table.std.empty()) block += fmt::format("std = {}{}", list_text(table.std, kDeviationDigits, newline), newline);
  if (table.fixed) block += fmt::format("fixed = true{}", newline);
  return block;
}

std::string history_block(const History& history, std::string_view newline) {
  std::string block = fmt::format("[[history]]{0}action = {1}{0}effect = {2}{0}", newline, toml_string(history.action),
                                  toml_string(history.effect));
  if (history.rmse_before)
    block += fmt::format("rmse_before = {}{}", number_text(*history.rmse_before, kValueDigits), newline);
  if (history.rmse_after)
    block += fmt::format("rmse_after = {}{}", number_text(*history.rmse_after, kValueDigits), newline);
  return block;
}

std::string_view axis_name(data::Axis axis) {
  return axis == data::Axis::linear ? "linear" : "rotary";
}

}  // namespace flexspline::model
