// Measurements that the tests of host/input/data write: a folder that goes away, and a motion whose truth is closed
// form.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

class TestFolder {
 public:
  TestFolder() {
    static int number = 0;
    path_ = std::filesystem::temp_directory_path() / fmt::format("flexspline-data-{}-{}", getpid(), number++);
    std::filesystem::create_directories(path_);
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  std::filesystem::path path() const { return path_; }
  std::filesystem::path write(const std::string& name, std::string_view text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

// Motor position 2 sin(w t), its velocity 2 w cos(w t), a current of 0.5 A that reverses smoothly with the velocity.
constexpr double kOmega_rad_s = 6.0;
inline double position(double t) {
  return 2.0 * std::sin(kOmega_rad_s * t);
}
inline double velocity(double t) {
  return 2.0 * kOmega_rad_s * std::cos(kOmega_rad_s * t);
}
inline double current(double t) {
  return 0.5 * std::tanh(velocity(t)) + 0.01 * velocity(t);
}

using Signal = std::function<double(double)>;
struct TestColumn {
  std::string name;
  Signal signal;
};

// CSV text of the columns at these times.
inline std::string csv_of(const std::vector<double>& times, const std::vector<TestColumn>& columns) {
  std::string text = "time_s";
  for (const TestColumn& column : columns) text += "," + column.name;
  text += "\n";
  for (const double t : times) {
    text += fmt::format("{:.9f}", t);
    for (const TestColumn& column : columns) text += fmt::format(",{:.9g}", column.signal(t));
    text += "\n";
  }
  return text;
}

inline std::vector<double> even_times(std::size_t count, double sample_s = 0.001) {
  std::vector<double> times(count);
  for (std::size_t k = 0; k < count; ++k) times[k] = static_cast<double>(k) * sample_s;
  return times;
}

inline std::vector<TestColumn> good_columns() {
  return {{"current_a", current}, {"motor_position_rad", position}, {"motor_velocity_rad_s", velocity}};
}
inline std::string good_csv(std::size_t count = 2000) {
  return csv_of(even_times(count), good_columns());
}

inline std::vector<Finding> of_kind(const std::vector<Finding>& findings, std::string_view kind) {
  std::vector<Finding> some;
  for (const Finding& finding : findings)
    if (finding.kind == kind) some.push_back(finding);
  return some;
}

// The errors that loading throws; empty if it does not throw.
inline std::vector<Finding> errors_of(const std::vector<std::filesystem::path>& paths,
                                      const LoadOptions& options = {}) {
  std::vector<Finding> errors;
  try {
    load(paths, options);
  } catch (const DataError& error) {
    for (const Finding& finding : error.findings())
      if (finding.severity == Severity::error) errors.push_back(finding);
  }
  return errors;
}

inline LoadOptions tolerating(const std::string& kind) {
  LoadOptions options;
  options.tolerate = {kind};
  return options;
}

}  // namespace flexspline::data
