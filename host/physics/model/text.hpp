// How numbers, texts and blocks of a model file are written.
#pragma once

#include <string>
#include <string_view>

#include "host/physics/model/model.hpp"

namespace flexspline::model {

inline constexpr int kValueDigits = 6;
inline constexpr int kDeviationDigits = 3;  // of std and spread
inline constexpr int kPointDigits = 9;      // of a table: its steps are even

// Shortest text with at most `digits` significant digits: "0.045", "3.63e-4", "3e8". The value is finite.
std::string number_text(double value, int digits);
// Shortest text that reads back as the same number: for what is stated, not estimated.
std::string exact_text(double value);
// The text of a parameter's value: fixed ones are stated.
std::string value_text(const Parameter& parameter);

// Quoted and escaped.
std::string toml_string(std::string_view text);

// What is right of the equals sign: a number, or a table in braces where there are more fields.
std::string parameter_text(const Parameter& parameter);
std::string quantity_text(const Quantity& quantity);

// "[[effect]]" or "[[history]]" with its lines, each ended by `newline`.
std::string effect_block(const Effect& effect, std::string_view newline = "\n");
std::string history_block(const History& history, std::string_view newline = "\n");

// "[effect.table]" with its lists; empty where the table has no points.
std::string table_block(const Table& table, std::string_view newline = "\n");
// A list in brackets, eight numbers a line.
std::string list_text(const std::vector<double>& values, int digits, std::string_view newline = "\n");

// Whether there is anything of the parameter to write.
bool is_stated(const Parameter& parameter);

// The keys of [drive] that hold a number, in the order of the file, and where their values live.
struct DriveKey {
  std::string_view key;
  Quantity Drive::*quantity;
  bool is_count = false;  // a whole number
};
inline constexpr DriveKey kDriveKeys[] = {
    {"gear_ratio", &Drive::gear_ratio},
    {"torque_constant_nm_a", &Drive::torque_constant_nm_a},
    {"rated_current_a", &Drive::rated_current_a},
    {"rated_velocity_rad_s", &Drive::rated_velocity_rad_s},
    {"rated_torque_nm", &Drive::rated_torque_nm},
    {"temperature_reference_c", &Drive::temperature_reference_c},
    {"pitch_m", &Drive::pitch_m},
    {"pole_pairs", &Drive::pole_pairs, true},
    {"motor_slots", &Drive::motor_slots, true},
};

std::string_view axis_name(data::Axis axis);

}  // namespace flexspline::model
