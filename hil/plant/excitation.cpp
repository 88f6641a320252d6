#include "hil/plant/excitation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace flexspline::plant {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
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
    case Waveform::square:
      return fraction < 0.5 ? 1.0 : -1.0;
    case Waveform::composite: {
      static const double peak = composite_peak();
      return composite(phase) / peak;
    }
  }
  return 0.0;
}

double command(const ExperimentPlan& plan, double time_s) {
  if (plan.mode == Mode::off) return 0.0;
  const double fade = std::clamp(time_s / kFadeIn_s, 0.0, 1.0);
  return plan.amplitude * fade * fade * (3.0 - 2.0 * fade) * waveform(plan.waveform, plan.frequency_hz * time_s);
}

}  // namespace flexspline::plant
