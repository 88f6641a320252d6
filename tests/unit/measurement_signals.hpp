// Excitations and exact answers for the tests of host/engine/measurement.
#pragma once

#include <complex>
#include <cstddef>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "host/engine/measurement/channels.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::measurement::tests {

inline constexpr double kTwoPi = 2.0 * std::numbers::pi;

// A line of a periodic signal: amplitude cos(2 pi line t / period + phase).
struct Line {
  std::size_t line = 0;
  std::complex<double> amplitude;  // magnitude and phase
};

// Odd lines up to `highest`, one of each group of four left out at random, or all lines; random phases.
inline std::vector<Line> multisine(std::size_t highest, double amplitude, unsigned seed, bool odd = true,
                                   bool leave_out = true) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> phase(0.0, kTwoPi);
  std::vector<Line> lines;
  std::size_t left_out = random() % 4, place = 0;
  for (std::size_t k = 1; k <= highest; k += odd ? 2 : 1, ++place) {
    if (place == 4) {
      place = 0;
      left_out = random() % 4;
    }
    // The first and the last line bound the band.
    if (leave_out && place == left_out && k > 1 && k + 2 <= highest) continue;
    lines.push_back({k, std::polar(amplitude, phase(random))});
  }
  return lines;
}

// Samples of the lines after a linear system, whose response at the frequency f in Hz is `response(f)`.
inline std::vector<double> signal_of(const std::vector<Line>& lines, double period_s, double sample_s,
                                     std::size_t samples,
                                     const std::function<std::complex<double>(double)>& response = nullptr) {
  std::vector<double> signal(samples, 0.0);
  for (const Line& line : lines) {
    const double f = static_cast<double>(line.line) / period_s;
    const std::complex<double> amplitude = response ? line.amplitude * response(f) : line.amplitude;
    // A rotation a sample, set anew now and then, instead of a cosine each.
    const std::complex<double> step = std::polar(1.0, kTwoPi * f * sample_s);
    std::complex<double> value;
    for (std::size_t k = 0; k < samples; ++k) {
      value = k % 256 == 0 ? amplitude * std::polar(1.0, kTwoPi * f * sample_s * static_cast<double>(k)) : value * step;
      signal[k] += value.real();
    }
  }
  return signal;
}

inline void add_noise(std::vector<double>& signal, double std, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, std);
  for (double& v : signal) v += normal(random);
}

inline data::Experiment experiment_of(std::size_t samples, double sample_s) {
  data::Experiment e;
  e.name = "made";
  e.sample_s = sample_s;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < samples; ++k) e.time_s.push_back(static_cast<double>(k) * sample_s);
  e.segments = {{0, samples}};
  e.masked.assign(samples, 0);
  return e;
}

inline Channel channel(std::vector<double> values, const char* name = "x", const char* unit = "1") {
  Channel c;
  c.name = name;
  c.unit = unit;
  c.values = std::move(values);
  return c;
}

}  // namespace flexspline::measurement::tests
