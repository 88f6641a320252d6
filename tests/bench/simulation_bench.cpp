// The free run of the library, a plain C loop of the same scheme, and SciPy, on one record: times and answers.
// Usage: flexspline_simulation_bench PYTHON SCRIPT; without arguments SciPy is left out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "host/physics/catalogue/constants.hpp"
#include "host/physics/simulation/simulation.hpp"
#include "tests/bench/plain_c_loop.hpp"
#include "tests/bench/rows.hpp"

namespace flexspline {
namespace {

using data::Column;

constexpr double kSample = 1e-3;  // s
constexpr std::size_t kSamples = 8000;
constexpr int kRuns = 15;

PlainDrive drive(bool locked) {
  return {100.0, 0.0543, 1.04e-4, 3.6e-4, 0.045, 6340.0, 57.0, 0.5, 0.06, 0.5, 0.6, locked};
}

model::Model model_of(const PlainDrive& d) {
  model::Model model;
  model.drive.gear_ratio.value = d.gear_ratio;
  model.drive.torque_constant_nm_a.value = d.torque_constant;
  const auto add = [&](const char* name, const std::vector<double>& values) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(name), data::Axis::rotary);
    for (std::size_t k = 0; k < values.size(); ++k) effect.parameters.at(k).value = values[k];
    model.effects.push_back(std::move(effect));
  };
  add("inertia", {d.inertia});
  add("viscous_friction", {d.viscous});
  add("coulomb_friction", {d.coulomb});
  add("linear_stiffness", {d.stiffness});
  add("structural_damping", {d.damping, d.exponent});
  add("output_inertia", {d.output_inertia});
  add("output_viscous_friction", {d.output_viscous});
  add("output_coulomb_friction", {d.output_coulomb});
  return model;
}

data::Experiment record(bool locked) {
  data::Experiment e;
  e.name = "bench";
  e.load = locked ? data::Load::locked : data::Load::free;
  e.sample_s = kSample;
  e.current_hold = data::CurrentHold::none;
  e.segments.push_back({0, kSamples});
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double t = static_cast<double>(k) * kSample;
    e.time_s.push_back(t);
    e[Column::current].push_back(std::sin(2.0 * std::numbers::pi * 0.7 * t) +
                                 0.7 * std::sin(2.0 * std::numbers::pi * 2.3 * t));
  }
  for (const Column c :
       {Column::motor_position, Column::output_position, Column::motor_velocity, Column::output_velocity})
    e[c].assign(kSamples, 0.0);
  return e;
}

double median_ms(const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < kRuns; ++i) {
    const std::clock_t start = std::clock();
    work();
    times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::nth_element(times.begin(), times.begin() + kRuns / 2, times.end());
  return times[kRuns / 2];
}

// Largest difference over the largest value.
double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0, size = 1e-300;
  for (std::size_t k = 0; k < a.size(); ++k) {
    most = std::max(most, std::abs(a[k] - b[k]));
    size = std::max(size, std::abs(b[k]));
  }
  return most / size;
}

void compare(bool locked, const std::string& python, const std::string& script) {
  const PlainDrive d = drive(locked);
  const model::Model model = model_of(d);
  const data::Experiment e = record(locked);
  simulation::FreeRun run;
  std::vector<double> q(kSamples), w(kSamples), qo(kSamples), wo(kSamples), torque(kSamples);
  const double ours = median_ms([&] { run = simulation::run(model, e); });
  const double plain = median_ms([&] {
    plain_c_loop(&d, {}, e[Column::current].data(), kSamples, kSample, 16,
                 {q.data(), w.data(), qo.data(), wo.data(), torque.data()});
  });
  simulation::Options fine;
  fine.step_s = 1.0 / 256000.0;
  const simulation::FreeRun reference = simulation::run(model, e, fine);
  const double error = difference(run.motor_position, reference.motor_position);
  fmt::print("{} load, 8 s at 1 kHz, steps of 1/16 ms\n", locked ? "locked" : "free");
  fmt::print("  simulation::run   {:8.1f} ms\n", ours);
  fmt::print("  plain C loop      {:8.1f} ms   ratio {:.2f}   positions differ by {:.1e}\n", plain, ours / plain,
             difference(run.motor_position, q));
  fmt::print("  error of both against steps sixteen times finer: {:.1e} of the largest position\n", error);
  bench::row(fmt::format("simulation, {} load, time", locked ? "locked" : "free"), "plain C loop", "at most 1.5",
             ours / plain);
  if (python.empty()) return;
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::filesystem::path file = folder / "flexspline-bench.csv";
  {
    std::ofstream out(file);
    for (std::size_t k = 0; k < kSamples; ++k)
      out << fmt::format("{:.17g},{:.17g}\n", e[Column::current][k], reference.motor_position[k]);
  }
  std::fflush(stdout);
  const std::string command =
      fmt::format("{} {} {} {} {:.3e} {:.3f}", python, script, file.string(), locked ? 1 : 0, error, ours);
  if (std::system(command.c_str()) != 0) fmt::print("  SciPy could not be run\n");
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace flexspline

int main(int argc, char** argv) {
  const std::string python = argc > 2 ? argv[1] : "", script = argc > 2 ? argv[2] : "";
  for (const bool locked : {false, true}) flexspline::compare(locked, python, script);
  return 0;
}
