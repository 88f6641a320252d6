#include "host/input/data/units.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <numbers>

#include "host/common/text/unit_signs.hpp"

namespace flexspline::data {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPoundForce_n = 4.4482216152605;  // NIST SP 811, exact
constexpr double kKilogramForce_n = 9.80665;
constexpr double kInch_m = 0.0254;

struct Entry {
  std::string_view text;  // as normalised below
  std::string_view shown;
  Unit unit;
};

using enum Quantity;
// The first entry of each quantity is its SI unit. Entries with an empty `shown` are other spellings.
constexpr auto kUnits = std::to_array<Entry>({
    {"s", "s", {time, 1.0, 0.0}},
    {"sec", "", {time, 1.0, 0.0}},
    {"seconds", "", {time, 1.0, 0.0}},
    {"ms", "ms", {time, 1e-3, 0.0}},
    {"us", "us", {time, 1e-6, 0.0}},
    {"ns", "ns", {time, 1e-9, 0.0}},
    {"min", "min", {time, 60.0, 0.0}},
    {"A", "A", {current, 1.0, 0.0}},
    {"mA", "mA", {current, 1e-3, 0.0}},
    {"uA", "uA", {current, 1e-6, 0.0}},
    {"rad", "rad", {angle, 1.0, 0.0}},
    {"mrad", "mrad", {angle, 1e-3, 0.0}},
    {"deg", "deg", {angle, kPi / 180.0, 0.0}},
    {"degree", "", {angle, kPi / 180.0, 0.0}},
    {"degrees", "", {angle, kPi / 180.0, 0.0}},
    {"mdeg", "mdeg", {angle, kPi / 180000.0, 0.0}},
    {"Grad",
     "",
     {angle, kPi / 180.0, 0.0}},  // German; the gon, which has the same name in small letters, drives never use
    {"arcmin", "arcmin", {angle, kPi / 10800.0, 0.0}},
    {"arcsec", "arcsec", {angle, kPi / 648000.0, 0.0}},
    {"rev", "rev", {angle, 2.0 * kPi, 0.0}},
    {"turn", "", {angle, 2.0 * kPi, 0.0}},
    {"turns", "", {angle, 2.0 * kPi, 0.0}},
    {"Umdr", "", {angle, 2.0 * kPi, 0.0}},  // German
    {"rad/s", "rad/s", {angular_velocity, 1.0, 0.0}},
    {"mrad/s", "mrad/s", {angular_velocity, 1e-3, 0.0}},
    {"deg/s", "deg/s", {angular_velocity, kPi / 180.0, 0.0}},
    {"mdeg/s", "mdeg/s", {angular_velocity, kPi / 180000.0, 0.0}},
    {"Grad/s", "", {angular_velocity, kPi / 180.0, 0.0}},
    {"degree/s", "", {angular_velocity, kPi / 180.0, 0.0}},
    {"degrees/s", "", {angular_velocity, kPi / 180.0, 0.0}},
    {"dps", "", {angular_velocity, kPi / 180.0, 0.0}},
    {"rpm", "rpm", {angular_velocity, kPi / 30.0, 0.0}},
    {"RPM", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"1/min", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"U/min", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"Umdr/min", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"Umdr/s", "", {angular_velocity, 2.0 * kPi, 0.0}},
    {"r/min", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"rev/min", "", {angular_velocity, kPi / 30.0, 0.0}},
    {"rev/s", "rev/s", {angular_velocity, 2.0 * kPi, 0.0}},
    {"rps", "", {angular_velocity, 2.0 * kPi, 0.0}},
    {"turn/s", "", {angular_velocity, 2.0 * kPi, 0.0}},
    {"turns/s", "", {angular_velocity, 2.0 * kPi, 0.0}},
    {"Nm", "N*m", {torque, 1.0, 0.0}},
    {"mNm", "mN*m", {torque, 1e-3, 0.0}},
    {"uNm", "uN*m", {torque, 1e-6, 0.0}},
    {"kNm", "kN*m", {torque, 1e3, 0.0}},
    {"Ncm", "N*cm", {torque, 1e-2, 0.0}},
    {"Nmm", "N*mm", {torque, 1e-3, 0.0}},
    {"kgfcm", "kgf*cm", {torque, kKilogramForce_n * 1e-2, 0.0}},
    {"lbfft", "lbf*ft", {torque, kPoundForce_n * 12.0 * kInch_m, 0.0}},
    {"lbfin", "lbf*in", {torque, kPoundForce_n* kInch_m, 0.0}},
    {"ozfin", "ozf*in", {torque, kPoundForce_n / 16.0 * kInch_m, 0.0}},
    {"ozin", "", {torque, kPoundForce_n / 16.0 * kInch_m, 0.0}},
    {"m", "m", {length, 1.0, 0.0}},
    {"mm", "mm", {length, 1e-3, 0.0}},
    {"um", "um", {length, 1e-6, 0.0}},
    {"cm", "cm", {length, 1e-2, 0.0}},
    {"in", "in", {length, kInch_m, 0.0}},
    {"m/s", "m/s", {velocity, 1.0, 0.0}},
    {"mm/s", "mm/s", {velocity, 1e-3, 0.0}},
    {"um/s", "um/s", {velocity, 1e-6, 0.0}},
    {"cm/s", "cm/s", {velocity, 1e-2, 0.0}},
    {"m/min", "m/min", {velocity, 1.0 / 60.0, 0.0}},
    {"mm/min", "mm/min", {velocity, 1e-3 / 60.0, 0.0}},
    {"in/s", "in/s", {velocity, kInch_m, 0.0}},
    {"N", "N", {force, 1.0, 0.0}},
    {"mN", "mN", {force, 1e-3, 0.0}},
    {"kN", "kN", {force, 1e3, 0.0}},
    {"lbf", "lbf", {force, kPoundForce_n, 0.0}},
    {"kgf", "kgf", {force, kKilogramForce_n, 0.0}},
    {"degC", "degC", {temperature, 1.0, 0.0}},
    {"C", "", {temperature, 1.0, 0.0}},
    {"celsius", "", {temperature, 1.0, 0.0}},
    {"K", "K", {temperature, 1.0, -273.15}},
    {"degF", "degF", {temperature, 5.0 / 9.0, -160.0 / 9.0}},
    {"F", "", {temperature, 5.0 / 9.0, -160.0 / 9.0}},
    {"counts", "counts", {counts, 1.0, 0.0}},
    {"count", "", {counts, 1.0, 0.0}},
    {"cnt", "", {counts, 1.0, 0.0}},
    {"ticks", "", {counts, 1.0, 0.0}},
    {"inc", "", {counts, 1.0, 0.0}},
    {"incr", "", {counts, 1.0, 0.0}},
    {"Ink", "", {counts, 1.0, 0.0}},
    {"Inkr", "", {counts, 1.0, 0.0}},
    {"counts/s", "counts/s", {counts_rate, 1.0, 0.0}},
    {"cnt/s", "", {counts_rate, 1.0, 0.0}},
    {"count/s", "", {counts_rate, 1.0, 0.0}},
    {"ticks/s", "", {counts_rate, 1.0, 0.0}},
    {"inc/s", "", {counts_rate, 1.0, 0.0}},
});

// "N*m", "N m" and "Nm" are one spelling.
std::string normalised(std::string_view text) {
  std::string unit = text::unit_in_ascii(text);
  std::erase_if(unit, [](char c) { return c == '*' || c == ' '; });
  if (unit.ends_with("/sec")) unit.resize(unit.size() - 2);
  return unit;
}

std::optional<Unit> listed_unit(std::string_view unit) {
  for (const Entry& entry : kUnits)
    if (entry.text == unit) return entry.unit;
  return std::nullopt;
}

}  // namespace

std::optional<Unit> unit_from_text(std::string_view text) {
  const std::string name = normalised(text);
  if (const auto unit = listed_unit(name)) return unit;
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) == 0) return std::nullopt;
  double factor = 0.0;
  const char* const end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data(), end, factor);
  std::optional<Unit> unit = error == std::errc{} ? listed_unit({rest, end}) : std::nullopt;
  // Counts get their size from the encoder, and a temperature may have another zero.
  if (!unit || unit->offset != 0.0 || !(factor > 0.0) || unit->quantity == counts || unit->quantity == counts_rate)
    return std::nullopt;
  unit->factor *= factor;
  return unit;
}

std::string known_units(Quantity quantity) {
  std::string text;
  const auto list = [&](Quantity wanted) {
    for (const Entry& entry : kUnits)
      if (entry.unit.quantity == wanted && !entry.shown.empty())
        text += (text.empty() ? "" : ", ") + std::string(entry.shown);
  };
  list(quantity);
  if (quantity == angle || quantity == length) list(counts);
  if (quantity == angular_velocity || quantity == velocity) list(counts_rate);
  return text;
}

std::optional<std::string_view> unit_of_time_step(double step) {
  if (step >= 5e4) return "ns";
  if (step >= 50.0) return "us";
  if (step >= 0.5) return "ms";
  return std::nullopt;
}

Quantity quantity_of(Column column, Axis axis) {
  const bool rotary = axis == Axis::rotary;
  switch (column) {
    case Column::current:
    case Column::current_command:
      return current;
    case Column::motor_torque:
    case Column::torque:
    case Column::load_torque:
      return rotary ? torque : force;
    case Column::motor_position:
    case Column::output_position:
    case Column::position_command:
      return rotary ? angle : length;
    case Column::motor_velocity:
    case Column::output_velocity:
    case Column::velocity_command:
      return rotary ? angular_velocity : velocity;
    case Column::temperature:
      return temperature;
  }
  return current;
}

std::string_view si_unit(Quantity quantity) {
  const auto entry =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Entry& e) { return e.unit.quantity == quantity; });
  return entry == kUnits.end() ? std::string_view{} : entry->shown;
}

bool are_sisters(Quantity a, Quantity b) {
  const auto pair = [&](Quantity x, Quantity y) { return (a == x && b == y) || (a == y && b == x); };
  return pair(angle, length) || pair(torque, force) || pair(angular_velocity, velocity);
}

}  // namespace flexspline::data
