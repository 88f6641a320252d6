// Motors that a drive was not commissioned with, and what can be wrong with their wires.
#include <cmath>
#include <random>
#include <utility>

#include "hil/board/three_phase.hpp"

namespace flexspline::board {
namespace {

constexpr std::size_t kPhases = 3;
constexpr double kShortShare = 0.05, kGroundShare = 0.1;  // resistance of the fault over that of a phase

// The faults of one phase.
void open(ThreePhaseParameters& p, std::size_t leg) {
  p.wiring.open[leg] = true;
}
void dead_sensor(ThreePhaseParameters& p, std::size_t leg) {
  p.sensors.gain[leg] = 0.0;
}
void to_ground(ThreePhaseParameters& p, std::size_t leg) {
  p.wiring.ground_ohm = kGroundShare * p.motor.resistance_ohm;
  p.wiring.ground_leg = leg;
}
void bad_contact(ThreePhaseParameters& p, std::size_t leg) {
  p.wiring.contact_ohm[leg] = p.motor.resistance_ohm;
}
constexpr std::pair<const char*, void (*)(ThreePhaseParameters&, std::size_t)> kOfAPhase[] = {
    {"phase-open", &open},
    {"sensor-dead", &dead_sensor},
    {"short-to-ground", &to_ground},
    {"bad-contact", &bad_contact}};

// The others.
void swapped(ThreePhaseParameters& p) {
  std::swap(p.wiring.motor_phase[1], p.wiring.motor_phase[2]);
}
void shorted(ThreePhaseParameters& p) {
  p.wiring.short_ohm = kShortShare * p.motor.resistance_ohm;
  p.wiring.short_from = 1;
  p.wiring.short_to = 2;
}
void not_connected(ThreePhaseParameters& p) {
  p.wiring.open = {true, true, true};
}
void swapped_sensors(ThreePhaseParameters& p) {
  std::swap(p.sensors.order[0], p.sensors.order[1]);
}
void standing_encoder(ThreePhaseParameters& p) {
  p.encoder_stands = true;
}
void slipping_encoder(ThreePhaseParameters& p) {
  p.slip_turns = 0.12;
  p.slip_every_turns = 0.5;
}
void low_bus(ThreePhaseParameters& p) {
  p.inverter.supply_v *= 0.4;
}
constexpr std::pair<const char*, void (*)(ThreePhaseParameters&)> kOthers[] = {{"phases-swapped", &swapped},
                                                                               {"phases-shorted", &shorted},
                                                                               {"not-connected", &not_connected},
                                                                               {"sensors-swapped", &swapped_sensors},
                                                                               {"encoder-stands", &standing_encoder},
                                                                               {"encoder-slips", &slipping_encoder},
                                                                               {"bus-low", &low_bus}};

}  // namespace

ThreePhaseParameters drawn_motor(const plant::Drive& drive, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
  };
  const auto spread = [&](double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); };
  ThreePhaseParameters p = three_phase_of(drive);
  p.commissioned = false;
  p.motor.resistance_ohm *= spread(0.6, 1.6);
  p.motor.inductance_d_h *= spread(0.6, 1.6);
  p.motor.inductance_q_h = p.motor.inductance_d_h * spread(0.7, 1.5);
  p.motor.pole_pairs = 4 + static_cast<int>(random() % 9);
  p.motor.flux_vs = drive.torque_constant_nm_a * uniform(0.95, 1.05) / (1.5 * p.motor.pole_pairs);
  p.offset_turns = uniform(0.0, 1.0);
  for (std::size_t leg = 0; leg < kPhases; ++leg) {
    p.sensors.gain[leg] = uniform(0.98, 1.02);
    p.sensors.offset_a[leg] = p.sensors.full_scale_a * uniform(-0.03, 0.03);
  }
  if (random() % 2 == 0) swapped(p);
  return p;
}

std::vector<std::string> wiring_fault_names() {
  std::vector<std::string> names;
  for (const auto& [name, add] : kOfAPhase)
    for (const char* leg : {"-a", "-b", "-c"}) names.push_back(std::string(name) + leg);
  for (const auto& [name, add] : kOthers) names.emplace_back(name);
  return names;
}

bool add_wiring_fault(ThreePhaseParameters& p, const std::string& wanted) {
  for (const auto& [name, add] : kOfAPhase)
    for (std::size_t leg = 0; leg < kPhases; ++leg)
      if (wanted == std::string(name) + "-" + "abc"[leg]) {
        add(p, leg);
        return true;
      }
  for (const auto& [name, add] : kOthers)
    if (wanted == name) {
      add(p);
      return true;
    }
  return false;
}

}  // namespace flexspline::board
