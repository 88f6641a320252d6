#include "hil/plant/excitation.hpp"

#include <algorithm>
#include <cmath>

#include "shared/fixed/turn.hpp"

namespace flexspline::plant {
namespace {

constexpr double kFadeIn_s = 0.25;
constexpr double kRamp = 0.1;

double composite(double phase) {
  return std::cos(kTurn * phase) + 0.5 * std::sin(2.0 * kTurn * phase) + std::sin(3.0 * kTurn * phase);
}

double composite_peak() {
  constexpr int kPoints = 20000;
  double peak = 0.0;
  for (int i = 0; i < kPoints; ++i) peak = std::max(peak, std::abs(composite(static_cast<double>(i) / kPoints)));
  return peak;
}

}  // namespace

double waveform(Waveform shape, double phase) {
  const double fraction = phase - std::floor(phase);
  switch (shape) {
    case Waveform::zero:
      return 0.0;
    case Waveform::sine:
      return std::sin(kTurn * phase);
    case Waveform::asymmetric_sine: {
      const double value = std::sin(kTurn * phase);
      return value < 0.0 ? 1.2 * value : value;
    }
    case Waveform::triangle:
      return fraction < 0.25 ? 4.0 * fraction : (fraction < 0.75 ? 2.0 - 4.0 * fraction : 4.0 * fraction - 4.0);
    case Waveform::trapezoid: {
      const double half = fraction < 0.5 ? fraction : fraction - 0.5;
      const double value = std::min({half / kRamp, (0.5 - half) / kRamp, 1.0});
      return fraction < 0.5 ? value : -value;
    }
    case Waveform::inverted_sine:
      return -std::sin(kTurn * phase);
    case Waveform::saw_tooth:
      return fraction < 0.5 ? 2.0 * fraction : 2.0 * fraction - 2.0;
    case Waveform::multi_sine:
      return 0.0;  // of its lines: see commands
    case Waveform::square:
      return fraction < 0.5 ? 1.0 : -1.0;
    case Waveform::composite: {
      static const double peak = composite_peak();
      return composite(phase) / peak;
    }
  }
  return 0.0;
}

namespace {

double multi_sine(const std::vector<Line>& lines, double phase) {
  double sum = 0.0;
  for (const Line& line : lines) sum += line.weight * std::sin(kTurn * (line.harmonic * phase + line.phase_turns));
  return sum;
}

double multi_sine_peak(const std::vector<Line>& lines) {
  int highest = 1;
  for (const Line& line : lines) highest = std::max(highest, line.harmonic);
  const int points = 2000 * highest;
  double peak = 1e-300;
  for (int i = 0; i < points; ++i) peak = std::max(peak, std::abs(multi_sine(lines, static_cast<double>(i) / points)));
  return peak;
}

double faded(double part) {
  const double x = std::clamp(part, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

}  // namespace

std::vector<double> commands(const ExperimentPlan& plan, double sample_s) {
  const auto samples = static_cast<std::size_t>(std::llround(plan.duration_s / sample_s));
  std::vector<double> list(samples, 0.0);
  if (plan.mode == Mode::off) return list;
  const double peak = plan.waveform == Waveform::multi_sine ? multi_sine_peak(plan.lines) : 1.0;
  const double fade_s = plan.fades_out ? std::min(kFadeIn_s, 0.5 * plan.duration_s) : kFadeIn_s;
  double last = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double time = static_cast<double>(k) * sample_s;
    double phase = plan.frequency_hz * time;
    if (plan.end_frequency_hz >= 0.0)
      phase += 0.5 * (plan.end_frequency_hz - plan.frequency_hz) * time * time / plan.duration_s;
    const double shape =
        plan.waveform == Waveform::multi_sine ? multi_sine(plan.lines, phase) / peak : waveform(plan.waveform, phase);
    double value = faded(time / fade_s) * (plan.offset + plan.amplitude * shape);
    if (plan.fades_out) value *= faded((plan.duration_s - time) / fade_s);
    if (plan.slope_limit > 0.0)
      value = last + std::clamp(value - last, -plan.slope_limit * sample_s, plan.slope_limit * sample_s);
    list[k] = last = value;
  }
  return list;
}

}  // namespace flexspline::plant
