#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/common/numbers/real.hpp"
#include "host/engine/planning/excitation.hpp"
#include "shared/control/excitation.hpp"

namespace flexspline::planning {
namespace {

using control::ExcitationSetup;
using numbers::Real;

std::uint32_t turns(double phase) {
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(std::llround((phase - std::floor(phase)) * 0x1p32)));
}

ExcitationSetup<double> shaped(const Run& run, ExcitationSetup<double> setup) {
  switch (run.waveform) {
    case Waveform::zero:
    case Waveform::sine:
      return control::sine(setup);
    case Waveform::inverted_sine:
      return control::inverted_sine(setup);
    case Waveform::composite:
      return control::composite(setup);
    case Waveform::multi_sine:
      setup.shape = control::Shape::lines;
      for (const Line& line : run.lines)
        setup.lines[setup.line_count++] = {static_cast<std::uint16_t>(line.harmonic), turns(line.phase_turns),
                                           line.weight};
      return setup;
    case Waveform::asymmetric_sine:
      setup.shape = control::Shape::asymmetric_sine;
      return setup;
    case Waveform::square:
      setup.shape = control::Shape::square;
      return setup;
    case Waveform::saw_tooth:
      setup.shape = control::Shape::saw_tooth;
      return setup;
    case Waveform::triangle:
      setup.shape = control::Shape::triangle;
      return setup;
  }
  return setup;
}

}  // namespace

control::ExcitationSetup<double> excitation_of(const Run& run, double tick_s) {
  const auto ticks = static_cast<std::uint32_t>(std::llround(run.duration_s / tick_s));
  if (run.waveform == Waveform::multi_sine && (run.lines.empty() || run.lines.size() > control::kMostLines))
    throw PlanError(fmt::format("run \"{}\": a multi_sine has 1 to {} lines, not {}; state them under lines", run.name,
                                control::kMostLines, run.lines.size()));
  ExcitationSetup<double> setup;
  setup.amplitude = run.waveform == Waveform::zero ? 0.0 : std::abs(run.amplitude);
  setup.offset = run.offset;
  setup.frequency_hz = run.frequency_hz;
  setup.end_frequency_hz = run.end_frequency_hz.value_or(-1.0);
  setup.ticks = ticks;
  setup.fade_ticks = static_cast<std::uint32_t>(std::min<double>(kFade_s / tick_s, 0.5 * static_cast<double>(ticks)));
  const double largest = (run.waveform == Waveform::asymmetric_sine ? setup.negative_per_positive : 1.0);
  setup.limit = 1.000001 * (largest * setup.amplitude + std::abs(run.offset));
  setup.slope_limit = run.slope_limit.value_or(4.0 * setup.limit / tick_s);
  setup = shaped(run, setup);
  const double highest = run.frequency_hz * control::detail::highest_harmonic(setup);
  if (!(std::max(highest, run.end_frequency_hz.value_or(0.0)) * tick_s < 0.5))
    throw PlanError(fmt::format("run \"{}\": {:g} Hz is more than half of the sample rate; plan a lower frequency",
                                run.name, std::max(highest, run.end_frequency_hz.value_or(0.0))));
  return setup;
}

std::vector<double> set_points(const Run& run, double sample_s) {
  const auto samples = static_cast<std::size_t>(std::llround(run.duration_s / sample_s));
  std::vector<double> points(samples, 0.0);
  const double amplitude = run.waveform == Waveform::zero ? 0.0 : run.amplitude;
  if (run.mode == Mode::off || samples == 0 || (amplitude == 0.0 && run.offset == 0.0)) return points;
  const ExcitationSetup<double> setup = excitation_of(run, sample_s);
  effects::DriveConstants<double> unit;
  unit.time_base = sample_s;
  const double base = setup.limit;
  const auto c = control::Excitation::derive<Real>(setup, base, unit);
  control::Excitation::State<Real> state;
  control::Excitation::start<Real>(state, c);
  for (double& point : points) point = base * control::Excitation::update<Real>(state, c, 0.0);
  return points;
}

}  // namespace flexspline::planning
