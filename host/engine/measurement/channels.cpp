#include "host/engine/measurement/channels.hpp"

#include <algorithm>
#include <numbers>

namespace flexspline::measurement {
namespace {

using data::Axis;
using data::Column;
using data::Experiment;

// Of rounding to steps at a random place.
double step_variance(const std::optional<double>& counts, Axis axis) {
  const std::optional<double> step = data::encoder_step(counts, axis);
  return step ? *step * *step / 12.0 : 0.0;
}
double step_variance(const Experiment& e, Column column, Axis axis) {
  if (column == Column::motor_position) return step_variance(e.encoder_counts, axis);
  if (column == Column::output_position) return step_variance(e.output_encoder_counts, axis);
  return 0.0;
}

// On a linear axis columns keep their names.
Channel column_channel(const Experiment& e, Column column, Axis axis) {
  Channel c{std::string(data::column_name(column)), data::unit_of(column, axis), e[column]};
  if (column == Column::current || column == Column::motor_torque) c.held = e.current_hold == data::CurrentHold::zoh;
  c.step_variance = step_variance(e, column, axis);
  return c;
}

Channel velocity_from(const Experiment& e, Column position, Column velocity, Axis axis) {
  Channel c{std::string(data::column_name(velocity)), data::unit_of(velocity, axis),
            std::vector<double>(e.size(), 0.0)};
  c.differenced = true;
  c.step_variance = step_variance(e, position, axis);
  const std::vector<double>& p = e[position];
  for (const data::Segment& s : e.segments) {
    for (std::size_t k = s.first + 1; k < s.last; ++k) c.values[k] = (p[k] - p[k - 1]) / e.sample_s;
    if (s.last - s.first > 1) c.values[s.first] = c.values[s.first + 1];
  }
  return c;
}

std::optional<Channel> velocity_of(const Experiment& e, Axis axis) {
  if (e.has(Column::motor_position)) return velocity_from(e, Column::motor_position, Column::motor_velocity, axis);
  if (e.has(Column::motor_velocity)) return column_channel(e, Column::motor_velocity, axis);
  if (e.has(Column::output_position)) return velocity_from(e, Column::output_position, Column::output_velocity, axis);
  if (e.has(Column::output_velocity)) return column_channel(e, Column::output_velocity, axis);
  return std::nullopt;
}

std::optional<Channel> torsion_of(const Experiment& e, const data::DriveFacts& drive) {
  if (!e.has(Column::motor_position) || !drive.gear_ratio || !(*drive.gear_ratio > 0.0)) return std::nullopt;
  const bool output = e.has(Column::output_position);
  if (!output && e.load != data::Load::locked) return std::nullopt;
  Channel c{"torsion_rad", data::unit_of(Column::output_position, drive.axis.value_or(Axis::rotary)),
            e[Column::motor_position]};
  for (std::size_t k = 0; k < c.values.size(); ++k)
    c.values[k] = c.values[k] / *drive.gear_ratio - (output ? e[Column::output_position][k] : 0.0);
  const Axis axis = drive.axis.value_or(Axis::rotary);
  c.step_variance = step_variance(e, Column::motor_position, axis) / (*drive.gear_ratio * *drive.gear_ratio) +
                    (output ? step_variance(e, Column::output_position, axis) : 0.0);
  return c;
}

bool is_set_point(Column c) {
  return c == Column::velocity_command || c == Column::position_command || c == Column::current_command;
}

}  // namespace

std::complex<double> Channel::correction(double frequency_hz, double sample_s) const {
  using namespace std::complex_literals;
  const double half = std::numbers::pi * frequency_hz * sample_s;  // omega T / 2
  if (!(half > 0.0)) return 1.0;
  // A held sample is the sample times sin(half) / half, half a sample late; a backward difference is the derivative
  // times the same. So the one multiplies and the other divides.
  const std::complex<double> hold = std::sin(half) / half * std::exp(-1i * half);
  std::complex<double> factor = 1.0;
  if (held) factor *= hold;
  if (differenced) factor /= hold;
  return factor;
}

std::optional<Channel> effort_of(const Experiment& e, Axis axis) {
  for (const Column c : {Column::current, Column::motor_torque})
    if (e.has(c)) return column_channel(e, c, axis);
  return std::nullopt;
}

std::vector<Channel> responses_of(const Experiment& e, const data::DriveFacts& drive) {
  const Axis axis = drive.axis.value_or(Axis::rotary);
  std::vector<Channel> channels;
  if (auto velocity = velocity_of(e, axis)) channels.push_back(std::move(*velocity));
  if (e.has(Column::torque)) channels.push_back(column_channel(e, Column::torque, axis));
  if (auto torsion = torsion_of(e, drive)) channels.push_back(std::move(*torsion));
  return channels;
}

std::vector<Channel> measured_channels(const Experiment& e, const data::DriveFacts& drive) {
  const Axis axis = drive.axis.value_or(Axis::rotary);
  std::vector<Channel> channels;
  for (std::size_t c = 0; c < data::kColumns; ++c)
    if (const auto column = static_cast<Column>(c); e.has(column) && !is_set_point(column))
      channels.push_back(column_channel(e, column, axis));
  for (Channel& response : responses_of(e, drive))
    if (std::none_of(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == response.name; }))
      channels.push_back(std::move(response));
  return channels;
}

}  // namespace flexspline::measurement
