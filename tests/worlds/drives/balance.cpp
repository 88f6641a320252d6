#include "tests/worlds/drives/balance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::worlds::drives {
namespace {

using Column = std::vector<double>;

Column derivative(const Column& signal, double rate_hz) {
  Column out(signal.size(), 0.0);
  for (std::size_t k = 1; k + 1 < signal.size(); ++k) out[k] = 0.5 * rate_hz * (signal[k + 1] - signal[k - 1]);
  return out;
}

void low_pass_forward(Column& signal, double rate_hz, double cutoff_hz) {
  const double warped = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * warped + warped * warped);
  const double gain = warped * warped * norm;
  const double a1 = 2.0 * (warped * warped - 1.0) * norm;
  const double a2 = (1.0 - std::numbers::sqrt2 * warped + warped * warped) * norm;
  double x1 = signal.front(), x2 = x1, y1 = x1, y2 = x1;
  for (double& value : signal) {
    const double y = gain * (value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
    x2 = x1;
    x1 = value;
    y2 = y1;
    value = y1 = y;
  }
}

/// RMS of the white noise of an encoder's steps after the filter and `order` derivatives.
double noise_of_steps(const Sensors& sensors, double cutoff_hz, int order) {
  const double steps_rad = kTurn / sensors.motor_counts / std::sqrt(12.0);
  return steps_rad * std::pow(kTurn * cutoff_hz, order) *
         std::sqrt(2.0 * cutoff_hz / sensors.rate_hz / (2 * order + 1));
}

struct Signals {
  Column target, acceleration, velocity, direction, gravity_sine, gravity_cosine;
};

Signals motor_signals(const Case& drive, const Measured& record, double cutoff_hz, double slowest_rad_s,
                      bool knows_contact) {
  const double ratio = drive.mechanics.gear_ratio;
  Column torque(record.current_a.size());
  for (std::size_t k = 0; k < torque.size(); ++k) {
    torque[k] = drive.mechanics.torque_constant_nm_a * record.current_a[k];
    if (!record.torque_nm.empty()) {
      torque[k] -= record.torque_nm[k] / ratio;
    } else if (!record.load_torque_nm.empty()) {
      torque[k] -= record.load_torque_nm[k] / ratio;
    }
  }
  Signals out;
  out.target = zero_phase(torque, record.rate_hz, cutoff_hz);
  const Column position = zero_phase(record.motor_position_rad, record.rate_hz, cutoff_hz);
  out.velocity = derivative(position, record.rate_hz);
  out.acceleration = derivative(out.velocity, record.rate_hz);
  Column direction(position.size());
  for (std::size_t k = 0; k < direction.size(); ++k)
    direction[k] = std::clamp(out.velocity[k] / slowest_rad_s, -1.0, 1.0);
  out.direction = zero_phase(knows_contact ? record.dry_friction_share : direction, record.rate_hz, cutoff_hz);
  for (const double angle : position) {
    out.gravity_sine.push_back(std::sin(angle / ratio));
    out.gravity_cosine.push_back(std::cos(angle / ratio));
  }
  return out;
}

double slowest_rad_s(const Case& drive, const std::vector<Measured>& records, double cutoff_hz) {
  Column speeds;
  for (const Measured& record : records) {
    for (const double v :
         derivative(zero_phase(record.motor_position_rad, record.rate_hz, cutoff_hz), record.rate_hz)) {
      speeds.push_back(std::abs(v));
    }
  }
  const auto place = speeds.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(speeds.size()));
  std::nth_element(speeds.begin(), place, speeds.end());
  return std::max(0.01 * *place, 3.0 * noise_of_steps(drive.sensors, cutoff_hz, 1));
}

/// The inertia of the motor's balance: with the flange between, the motor's alone.
double balanced_inertia_kgm2(const Case& drive) {
  const Mechanics& m = drive.mechanics;
  return m.motor_inertia_kgm2 +
         (drive.sensors.has_torque ? 0.0 : m.output_inertia_kgm2 / (m.gear_ratio * m.gear_ratio));
}

/// Share of the power of the torque for the planned motions that a filter takes away.
double lost_share(const Case& drive, double cutoff_hz) {
  double lost = 0.0;
  double whole = 0.0;
  for (const RecordPlan& plan : drive.records) {
    const double rate_hz = 1.0 / plan.motion.period_s;
    const Column velocity = derivative(plan.motion.position_rad, rate_hz);
    Column torque = derivative(velocity, rate_hz);
    for (std::size_t k = 0; k < torque.size(); ++k) {
      torque[k] =
          balanced_inertia_kgm2(drive) * torque[k] + steady_friction_nm(drive.mechanics.friction, {}, velocity[k]);
    }
    // The last samples have no derivatives.
    std::fill(torque.end() - 3, torque.end(), torque[torque.size() - 4]);
    const Column kept = zero_phase(torque, rate_hz, cutoff_hz);
    for (std::size_t k = 0; k < torque.size(); ++k) {
      lost += (torque[k] - kept[k]) * (torque[k] - kept[k]);
      whole += torque[k] * torque[k];
    }
  }
  return lost / whole;
}

/// Samples at both ends that the filters' starts reach.
std::size_t margin_of(const Measured& record, double cutoff_hz) {
  return std::min(record.time_s.size() / 4, static_cast<std::size_t>(1.5 * record.rate_hz / cutoff_hz) + 2);
}

/// Marks the samples to leave out: all slow ones, or those of a standstill of more than 20 ms alone.
std::vector<bool> left_out(const Column& velocity, double rate_hz, double slowest_rad_s, bool keeps_reversals) {
  std::vector<bool> out(velocity.size(), false);
  const auto least = keeps_reversals ? static_cast<std::size_t>(0.02 * rate_hz) : std::size_t{0};
  for (std::size_t k = 0; k < velocity.size();) {
    std::size_t end = k;
    while (end < velocity.size() && std::abs(velocity[end]) < slowest_rad_s) ++end;
    if (end - k > least)
      std::fill(out.begin() + static_cast<std::ptrdiff_t>(k), out.begin() + static_cast<std::ptrdiff_t>(end), true);
    k = std::max(end, k + 1);
  }
  return out;
}

double motor_error_nm(const Case& drive, const std::vector<Measured>& records, double cutoff_hz, bool keeps_reversals,
                      bool knows_contact) {
  const double slowest = slowest_rad_s(drive, records, cutoff_hz);
  std::vector<Column> columns(drive.models_gravity ? 5 : 3);
  Column target;
  for (const Measured& record : records) {
    const Signals s = motor_signals(drive, record, cutoff_hz, slowest, knows_contact);
    const std::size_t margin = margin_of(record, cutoff_hz);
    const std::vector<bool> is_left_out = left_out(s.velocity, record.rate_hz, slowest, keeps_reversals);
    for (std::size_t k = margin; k + margin < s.target.size(); ++k) {
      if (is_left_out[k]) continue;
      target.push_back(s.target[k]);
      columns[0].push_back(s.acceleration[k]);
      columns[1].push_back(s.velocity[k]);
      columns[2].push_back(s.direction[k]);
      if (!drive.models_gravity) continue;
      columns[3].push_back(s.gravity_sine[k]);
      columns[4].push_back(s.gravity_cosine[k]);
    }
  }
  return std::sqrt(residual_square(columns, target) / static_cast<double>(std::max<std::size_t>(1, target.size())));
}

double transmission_error_nm(const Case& drive, const std::vector<Measured>& records, double cutoff_hz,
                             bool has_constant) {
  std::vector<Column> columns(has_constant ? 3 : 2);
  Column target;
  for (const Measured& record : records) {
    Column torsion(record.time_s.size());
    for (std::size_t k = 0; k < torsion.size(); ++k) {
      torsion[k] = record.motor_position_rad[k] / drive.mechanics.gear_ratio - record.output_position_rad[k];
    }
    torsion = zero_phase(torsion, record.rate_hz, cutoff_hz);
    const Column rate = derivative(torsion, record.rate_hz);
    const Column torque = zero_phase(record.torque_nm, record.rate_hz, cutoff_hz);
    const std::size_t margin = margin_of(record, cutoff_hz);
    for (std::size_t k = margin; k + margin < torsion.size(); ++k) {
      target.push_back(torque[k]);
      columns[0].push_back(torsion[k]);
      columns[1].push_back(rate[k]);
      if (has_constant) columns[2].push_back(1.0);
    }
  }
  return std::sqrt(residual_square(columns, target) / static_cast<double>(std::max<std::size_t>(1, target.size())));
}

}  // namespace

double residual_square(std::vector<std::vector<double>>& columns, std::vector<double>& target) {
  const auto dot = [](const Column& a, const Column& b) {
    double sum = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
    return sum;
  };
  const auto take_out = [&](const Column& unit, Column& from) {
    const double share = dot(unit, from);
    for (std::size_t k = 0; k < from.size(); ++k) from[k] -= share * unit[k];
  };
  for (std::size_t j = 0; j < columns.size(); ++j) {
    Column& column = columns[j];
    const double before = std::sqrt(dot(column, column));
    for (std::size_t earlier = 0; earlier < j; ++earlier) take_out(columns[earlier], column);
    const double length = std::sqrt(dot(column, column));
    // A column that the others span has nothing to add.
    const double scale = length > 1e-9 * before ? 1.0 / length : 0.0;
    for (double& value : column) value *= scale;
    take_out(column, target);
  }
  return dot(target, target);
}

std::vector<double> zero_phase(const std::vector<double>& signal, double rate_hz, double cutoff_hz) {
  Column out = signal;
  for (int pass = 0; pass < 2; ++pass) {
    low_pass_forward(out, rate_hz, cutoff_hz);
    std::reverse(out.begin(), out.end());
  }
  return out;
}

double balance_cutoff_hz(const Case& drive, const std::vector<Measured>& records) {
  double squared = 0.0;
  double samples = 0.0;
  for (const Measured& record : records) {
    for (const double current : record.current_a) squared += current * current;
    samples += static_cast<double>(record.current_a.size());
  }
  const double torque_nm = drive.mechanics.torque_constant_nm_a * std::sqrt(squared / samples);
  double best = 5.0;
  for (const double candidate : {5.0, 10.0, 20.0, 40.0, 80.0, 160.0}) {
    const bool is_noisy = balanced_inertia_kgm2(drive) * noise_of_steps(drive.sensors, candidate, 2) > 0.05 * torque_nm;
    if (candidate > drive.sensors.rate_hz / 6.0 || is_noisy) break;
    best = candidate;
    if (lost_share(drive, candidate) < 0.01) break;
  }
  return best;
}

double balance_error_nm(const Case& drive, const std::vector<Measured>& records, Balance balance, double cutoff_hz) {
  switch (balance) {
    case Balance::kMotor:
      return motor_error_nm(drive, records, cutoff_hz, false, false);
    case Balance::kMotorWithReversals:
      return motor_error_nm(drive, records, cutoff_hz, true, false);
    case Balance::kMotorKnownPresliding:
      return motor_error_nm(drive, records, cutoff_hz, false, true);
    case Balance::kReversalsKnownPresliding:
      return motor_error_nm(drive, records, cutoff_hz, true, true);
    default:
      break;
  }
  return transmission_error_nm(drive, records, cutoff_hz, balance == Balance::kTransmission);
}

}  // namespace flexspline::worlds::drives
