#include "hil/thesis_figures/twin_runs.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "hil/thesis_models/published.hpp"

namespace flexspline::thesis_figures {

namespace published = report::published;

plant::Record twin_record(const rhs100::Set& set, std::string_view name, std::uint64_t seed) {
  for (std::size_t k = 0; k < set.experiments.size(); ++k)
    if (set.experiments[k].plan.name == name) return rhs100::record(set, k, seed);
  throw std::invalid_argument(set.name + " has no experiment " + std::string(name));
}

plant::Record twin_record(const plant::ExperimentPlan& plan, std::uint64_t seed) {
  // The hold-outs of table 4 have the averages.
  const rhs100::Set set = rhs100::table_4();
  return plant::record_one(set.experiments.back().drive, plan, seed, 4900);
}

plant::ExperimentPlan free_sine(double amplitude_rad_s, double frequency_hz) {
  plant::ExperimentPlan plan;
  plan.name = "free sine";
  plan.mode = plant::Mode::velocity;
  plan.waveform = plant::Waveform::sine;
  plan.amplitude = amplitude_rad_s;
  plan.frequency_hz = frequency_hz;
  plan.duration_s = 6.0;
  return plan;
}

plant::ExperimentPlan locked(plant::Waveform waveform, double share, double frequency_hz) {
  plant::ExperimentPlan plan;
  plan.name = "locked";
  plan.mode = plant::Mode::current;
  plan.waveform = waveform;
  plan.amplitude = share * rhs100::kFullLockedCurrent;
  plan.frequency_hz = frequency_hz;
  plan.duration_s = 8.0;
  plan.locked = true;
  return plan;
}

report::DriveSystemParts nominal_parts() {
  report::DriveSystemParts parts;
  parts.motor = {published::identified_motor().torque_constant, rhs100::kFullSlowCurrent, published::kEffectiveInertia,
                 published::total_friction()};
  parts.drive.gear.gear_ratio = published::kGearRatio;
  parts.drive.spring = report::CubicSpring(published::kStiffness, 0.0);
  parts.drive.damping_torque = published::kDampingTorque;
  parts.drive.damping_exponent = published::kDampingExponent;
  parts.drive.output_bearing =
      report::FrictionCurve::symmetric({rhs100::kOutputViscous, rhs100::kOutputCoulomb, 0.0, 1.0});
  parts.output_inertia = rhs100::kOutputInertia;
  return parts;
}

report::SystemTrace simulate(const report::DriveSystemParts& parts, const plant::Record& measured) {
  const report::DriveSystem system(parts, measured.locked ? report::Load::locked : report::Load::free,
                                   report::FrictionMethod::implicit, published::kSampleS);
  const std::vector<double>& current = measured.current_a;
  // The implicit step asks for the current at its end; what flows in it is the sample at its beginning.
  const auto held = [&current](double t) {
    const auto k = static_cast<std::size_t>(std::max(0.0, std::floor((t + 1e-9) / published::kSampleS - 1.0 + 1e-6)));
    return current[std::min(k, current.size() - 1)];
  };
  report::SystemState start;
  start.input_angle = measured.motor_position_rad.front();
  start.output_angle =
      measured.locked ? start.input_angle / published::kGearRatio : measured.output_position_rad.front();
  return system.run(start, held, current.size());
}

std::vector<double> input_velocity(const report::SystemTrace& trace) {
  std::vector<double> v;
  for (const report::SystemState& s : trace.state) v.push_back(s.input_velocity);
  return v;
}

namespace {

// One stage of a digital filter, b over a with a[0] = 1, in place; it starts as if the first value had stood for ever.
void pass(std::vector<double>& y, const double (&b)[3], const double (&a)[3]) {
  double x1 = y.front(), x2 = y.front(), y1 = y.front(), y2 = y.front();
  for (double& value : y) {
    const double x0 = value;
    const double y0 = b[0] * x0 + b[1] * x1 + b[2] * x2 - a[1] * y1 - a[2] * y2;
    x2 = x1;
    x1 = x0;
    y2 = y1;
    y1 = y0;
    value = y0;
  }
}

// Butterworth of order five by the bilinear rule with the cut-off warped: a first-order stage and two of second order.
void butterworth_5(std::vector<double>& y, double cutoff_hz, double sample_hz) {
  const double w = std::tan(M_PI * cutoff_hz / sample_hz);
  const double first = 1.0 / (1.0 + w);
  pass(y, {w * first, w * first, 0.0}, {1.0, (w - 1.0) * first, 0.0});
  for (const double angle : {M_PI / 5.0, 2.0 * M_PI / 5.0}) {
    const double damping = 2.0 * std::cos(angle), scale = 1.0 / (1.0 + damping * w + w * w), gain = w * w * scale;
    pass(y, {gain, 2.0 * gain, gain}, {1.0, 2.0 * (w * w - 1.0) * scale, (1.0 - damping * w + w * w) * scale});
  }
}

}  // namespace

std::vector<double> zero_phase(std::vector<double> signal, double cutoff_hz, double sample_hz) {
  if (signal.empty()) return signal;
  for (int way = 0; way < 2; ++way) {
    butterworth_5(signal, cutoff_hz, sample_hz);
    std::reverse(signal.begin(), signal.end());
  }
  return signal;
}

Curve part(std::string label, const plant::Record& record, const std::vector<double>& signal, double from_s,
           double to_s, Stroke stroke) {
  Curve c{std::move(label), {}, {}, stroke};
  for (std::size_t k = 0; k < signal.size(); ++k)
    if (record.time_s[k] >= from_s && record.time_s[k] <= to_s) {
      c.x.push_back(record.time_s[k]);
      c.y.push_back(signal[k]);
    }
  return c;
}

}  // namespace flexspline::thesis_figures
