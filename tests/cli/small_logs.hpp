// Logs of one drive in columns that a test names.
#pragma once

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

namespace flexspline::cli_test::small_logs {

using Signal = std::function<double(double)>;

// A motion that does not repeat itself in the time of a log, and the torque of an inertia with friction.
inline double angle(double t) {
  return std::sin(2.0 * t) / 2.0 + 0.5 * std::sin(5.3 * t) / 5.3;
}
inline double speed(double t) {
  return std::cos(2.0 * t) + 0.5 * std::cos(5.3 * t);
}
inline double torque(double t) {
  return 0.2 * -(2.0 * std::sin(2.0 * t) + 2.65 * std::sin(5.3 * t)) + 0.1 * speed(t) + std::tanh(speed(t) / 0.02);
}
inline Signal time_in(double unit_s) {
  return [=](double t) { return t / unit_s; };
}
inline Signal constant(double value) {
  return [=](double) { return value; };
}
inline Signal times(double factor, const Signal& signal) {
  return [=](double t) { return factor * signal(t); };
}
inline Signal whole(double factor, const Signal& signal) {
  return [=](double t) { return std::round(factor * signal(t)); };
}

// Every 2 ms; each third sample late by `jitter_s`.
inline std::string log_of(const std::string& header, const std::vector<Signal>& signals, double jitter_s = 0.0,
                          char separator = ',') {
  std::string text = header + "\n";
  for (int k = 0; k < 3000; ++k) {
    const double t = 0.002 * k + (k % 3 == 0 ? jitter_s : 0.0);
    for (std::size_t i = 0; i < signals.size(); ++i) {
      char field[40];
      std::snprintf(field, sizeof field, "%.15g", signals[i](t));
      text += (i == 0 ? "" : std::string(1, separator)) + field;
    }
    text += '\n';
  }
  return text;
}

}  // namespace flexspline::cli_test::small_logs
