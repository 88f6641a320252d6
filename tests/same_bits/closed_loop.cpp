// Whole drives in closed loop, firmware, plant, sensors with their noise and a host, as hashes of what they did:
// closed_loop.cmake builds it by two compilers and compares. All sources it needs are compiled as one, which takes each
// compiler half a minute.
//
//   closed_loop SEED SECONDS      a line each half second of each case, and one of its telemetry
#include <bit>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "hil/board/controller.cpp"
#include "hil/board/drive_setup.cpp"
#include "hil/board/events.cpp"
#include "hil/board/motion.cpp"
#include "hil/board/motor_ripples.cpp"
#include "hil/board/packed_model.cpp"
#include "hil/board/plant_rig.cpp"
#include "hil/board/scenario.cpp"
#include "hil/board/stage_protection.cpp"
#include "hil/board/three_phase.cpp"
#include "hil/board/virtual_drive.cpp"
#include "hil/motor/motor.cpp"
#include "hil/motor/power_stage.cpp"
#include "hil/motor/shaft.cpp"
#include "hil/motor/shunts.cpp"
#include "hil/plant/friction.cpp"
#include "hil/plant/hysteresis.cpp"
#include "hil/plant/input_files.cpp"
#include "hil/plant/normal.cpp"
#include "hil/plant/parameters.cpp"
#include "hil/plant/physics.cpp"
#include "hil/plant/sensors.cpp"
#include "hil/plant/transmission.cpp"
#include "hil/plant/two_mass.cpp"
#include "hil/plant/whole_file.cpp"
#include "hil/scenario/scenario_file.cpp"

namespace {

using namespace flexspline;

struct Case {
  const char* scenario;
  std::vector<std::string> with;  // effects that the drive knows of
  std::string hide;               // and one that it does not
  bool compensation;
  std::uint32_t tick_hz;
  bool three_phase = false;
};

// Every function of the C library that the twin computes with, loops of the gear, sticking, a slow amplifier, heat, an
// event; at the rate of ticks of the images and at another one.
std::vector<Case> cases() {
  return {
      {"sine", {}, "", true, 20'000},
      {"sine", {}, "", false, 8'000},
      {"slow-reversals", {"torque_ripple:2", "kinematic_error:2"}, "stribeck_gaussian", true, 8'000},
      {"loaded-reversals", {"load_dependent_friction"}, "power_law_friction", true, 8'000},
      {"warm-up", {"temperature_viscous", "cubic_stiffness"}, "lugre_friction", true, 8'000},
      {"weak-amplifier", {"backlash"}, "bouc_wen_hysteresis", false, 8'000},
      {"power-cut", {}, "dahl_hysteresis", true, 8'000},
      {"sine", {}, "torque_ripple:2", true, 20'000, true},
  };
}

class Bits {
 public:
  void add(double x) { hash_.add(std::bit_cast<std::uint64_t>(x)); }
  unsigned long long value() const { return hash_.value(); }

 private:
  board::FrameHash hash_;
};

void run(const Case& one, std::uint64_t seed, double seconds) {
  const scenario::ScenarioFile file = scenario::find_scenario(one.scenario);
  board::ScenarioPlan plan = scenario::plan_of(file, scenario::drive_of(file, "", one.with, one.hide));
  plan.seed = seed;
  plan.compensation = one.compensation;
  plan.tick_hz = one.tick_hz;
  plan.duration_s = seconds;
  plan.hold_s = 0.0;
  plan.keeps_trace = true;
  plan.three_phase = one.three_phase;
  const board::ScenarioResult result = board::run_scenario(plan);
  const std::string name = std::string(one.scenario) + (one.compensation ? " on " : " off ") +
                           std::to_string(one.tick_hz) + " Hz" + (one.hide.empty() ? "" : " " + one.hide) +
                           (one.three_phase ? " three-phase" : "");
  Bits positions, currents, torques;
  for (std::size_t i = 0; i < result.trace.size(); ++i) {
    const board::TracePoint& p = result.trace[i];
    positions.add(p.output_rad);
    positions.add(p.motor_velocity_rad_s);
    currents.add(p.current_a);
    torques.add(p.torque_nm);
    torques.add(p.temperature_c);
    if ((i + 1) % 500 == 0)
      std::printf("%s, %.1f s: motion %016llx current %016llx torque %016llx\n", name.c_str(), p.time_s,
                  positions.value(), currents.value(), torques.value());
  }
  std::printf("%s: %llu frames of telemetry %016llx\n", name.c_str(), static_cast<unsigned long long>(result.frames),
              static_cast<unsigned long long>(result.telemetry_hash));
}

}  // namespace

int main(int count, char** words) {
  const std::uint64_t seed = count > 1 ? std::strtoull(words[1], nullptr, 10) : 1;
  const double seconds = count > 2 ? std::strtod(words[2], nullptr) : 9.0;
  for (const Case& one : cases()) run(one, seed, seconds);
  return 0;
}
