// What makes ripples in a three-phase motor that runs, hidden where calibration and commissioning do not see it.
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "hil/board/three_phase.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::board {
namespace {

using Random = std::mt19937_64;

// Usual sizes: cogging as shares of the largest torque (full scale is 2.86 of it), an offset and a gain as amplifiers
// of shunts drift, a dead time as drivers have it without being asked, an angle as a magnet at the shaft's end shows it
// 0.2 mm off its sensor.
constexpr double kCoggingShare = 0.02, kMagnetShare = 0.02, kOffsetShare = 0.01, kGain = 0.05, kDeadTimeS = 0.5e-6,
                 kEccentricityRad = 10e-3, kFifth = 0.06, kSeventh = 0.01;
constexpr double kTorquePeakShare = 0.35;  // of full scale

double uniform(Random& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -53);
}
double peak_torque(const ThreePhaseParameters& p) {
  return 1.5 * p.motor.pole_pairs * p.motor.flux_vs * p.sensors.full_scale_a * kTorquePeakShare;
}

void cogging(ThreePhaseParameters& p, double size, Random&) {
  p.motor.cogging_nm = size * kCoggingShare * peak_torque(p);
  p.motor.cogging_per_turn = std::lcm(usual_slots(p.motor.pole_pairs), 2 * p.motor.pole_pairs);
}
// One magnet that differs: each slot passes it once a turn.
void cogging_magnet(ThreePhaseParameters& p, double size, Random&) {
  p.motor.cogging_nm = size * kMagnetShare * peak_torque(p);
  p.motor.cogging_per_turn = usual_slots(p.motor.pole_pairs);
}
void current_offset(ThreePhaseParameters& p, double size, Random& random) {
  p.drift_offset_a[random() % 3] += size * kOffsetShare * p.sensors.full_scale_a;
}
void current_gain(ThreePhaseParameters& p, double size, Random& random) {
  p.drift_gain[random() % 3] += size * kGain;
}
// Harmonics of the flux, as shares of it.
void back_emf(ThreePhaseParameters& p, double size, Random&) {
  p.motor.harmonic_5 = size * kFifth;
  p.motor.harmonic_7 = size * kSeventh;
}
void dead_time(ThreePhaseParameters& p, double size, Random&) {
  p.inverter.dead_time_s += size * kDeadTimeS;
}
void eccentricity(ThreePhaseParameters& p, double size, Random& random) {
  p.eccentricity_rad = size * kEccentricityRad;
  p.eccentricity_phase_rad = kTurn * uniform(random);
}
constexpr std::pair<const char*, void (*)(ThreePhaseParameters&, double, Random&)> kRipples[] = {
    {"cogging", &cogging},
    {"cogging-magnet", &cogging_magnet},
    {"current-offset", &current_offset},
    {"current-gain", &current_gain},
    {"back-emf", &back_emf},
    {"dead-time", &dead_time},
    {"encoder-eccentricity", &eccentricity}};

}  // namespace

// Twelve slots for ten and fourteen poles; else one slot for each phase and pole pair.
int usual_slots(int pole_pairs) {
  return pole_pairs == 5 || pole_pairs == 7 ? 12 : 3 * pole_pairs;
}

std::vector<std::string> motor_ripple_names() {
  std::vector<std::string> names;
  for (const auto& [name, add] : kRipples) names.emplace_back(name);
  return names;
}

bool add_motor_ripple(ThreePhaseParameters& p, const std::string& wanted, double size, std::uint64_t seed) {
  Random random(seed);
  for (const auto& [name, add] : kRipples)
    if (wanted == name) {
      add(p, size, random);
      return true;
    }
  return false;
}

}  // namespace flexspline::board
