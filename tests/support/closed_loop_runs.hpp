// Closed loops in this process: drives of the report's class, models of them, and what `flexspline hil` would start a
// twin for.
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "hil/scenario/scenario_file.hpp"
#include "host/app/closed_loop/prediction.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "tests/support/on_all_cores.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::tests {

inline constexpr double kLoopTickHz = board::SoftwareBoard::kTickHz;

// The demo's drive with each torque, inertia and stiffness between 0.7 and 1.4 times its own.
inline plant::Drive random_loop_drive(std::uint64_t seed) {
  plant::Drive drive = plant::demo_plant().drive;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(std::log(0.7), std::log(1.4));
  for (plant::Effect& effect : drive.effects)
    for (plant::Parameter& p : effect.parameters) {
      const double factor = std::exp(share(random));
      if (p.scaled) p.value *= factor;
    }
  return drive;
}

inline std::string loop_settings(const plant::Drive& drive) {
  return "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = " + std::to_string(drive.sensors.motor_counts) +
         "\n[output_encoder]\ncounts = " + std::to_string(drive.sensors.output_counts) +
         "\n[limits]\ncurrent_a = " + std::to_string(drive.current_limit_a) + "\n[torque_sensor]\n";
}

inline std::vector<std::uint8_t> loop_block(const model::Model& model, const std::string& settings) {
  deployment::PackOptions pack;
  pack.tick_hz = kLoopTickHz;
  pack.settings = settings;
  pack.samples = 2'000;
  pack.bound = 1e-5;
  return deployment::pack(model, pack).bytes;
}

// With the loops of `first`, whatever inertia the model holds.
inline std::vector<std::uint8_t> same_loops(const model::Model& model, const std::vector<std::uint8_t>& first) {
  const deployment::Unpacked block = deployment::unpack(first);
  return loop_block(model, closed_loop::settings_like(block, closed_loop::twin_hardware_of(block)));
}

struct LoopRun {
  std::string scenario = "slow-reversals";
  plant::Drive drive{};
  std::vector<std::uint8_t> block{};
  bool compensation = false;
  double seconds = 0.0;  // zero: what the scenario says
  double hold_s = 0.0;
  std::uint64_t seed = 1;
};
inline board::ScenarioResult run_loop(const LoopRun& run) {
  const scenario::ScenarioFile file = scenario::find_scenario(run.scenario);
  board::ScenarioPlan plan = scenario::plan_of(file, run.drive);
  if (run.seconds > 0.0) plan.duration_s = run.seconds;
  plan.hold_s = run.hold_s;
  plan.packed = board::read_packed_model(run.block);
  plan.compensation = run.compensation;
  plan.seed = run.seed;
  return board::run_scenario(plan);
}

inline closed_loop::Runner loop_runner() {
  return [](const std::vector<closed_loop::Job>& jobs) {
    std::vector<closed_loop::Outcome> outcomes(jobs.size());
    on_all_cores(jobs.size(), [&](std::size_t i) {
      const auto& job = jobs[i];
      LoopRun run;
      run.scenario = job.scenario;
      run.drive = plant::parse_plant(job.plant, "drawn").drive;
      run.block = job.block;
      run.compensation = job.compensation;
      run.seconds = job.seconds;
      run.seed = job.seed;
      const board::ScenarioResult r = run_loop(run);
      outcomes[i].rms_error_rad = r.rms_error_rad;
      outcomes[i].peak_error_rad = r.peak_error_rad;
      outcomes[i].ends_in_fault = r.end.mode != firmware::Mode::position;
    });
    return outcomes;
  };
}

}  // namespace flexspline::tests
