// Position and velocity of one side of the gear, filtered, from what was measured of it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/common/signals/butterworth.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::estimation {

// How positions become velocities and accelerations.
enum class Derivatives : std::uint8_t {
  butterworth,  // zero-phase filter, then central differences; a measured velocity helps where it has less noise
  kalman,       // Kalman filter with Rauch-Tung-Striebel smoothing, covariances by likelihood; the position alone
};

struct SideMotion {
  std::vector<double> position, velocity;
  std::vector<double> acceleration;  // empty: the slope of the velocity
  double smoother_corner_hz = 0.0;   // of the Kalman smoother; zero: there is none
  double position_noise = 0.0;       // white, before the filter
  double velocity_noise = 0.0;       // after the filter
  std::optional<double> quantum;     // smallest step of the position
  bool measured = false;
  double velocity_crossover_hz = 0.0;  // from here on the velocity is the measured one; zero: the derivative alone
};

// Nothing is measured where the experiment has neither position nor velocity of that side.
SideMotion motor_side(const data::Experiment& e, const catalogue::DriveConstants<double>& drive,
                      const signals::ZeroPhaseFilter& filter, Derivatives derivatives = Derivatives::butterworth);
// Of a load that is free.
SideMotion output_side(const data::Experiment& e, const signals::ZeroPhaseFilter& filter,
                       Derivatives derivatives = Derivatives::butterworth);

// A signal through a filter, segment by segment.
std::vector<double> filtered(const std::vector<double>& signal, const std::vector<data::Segment>& segments,
                             const signals::ZeroPhaseFilter& filter);
// Its derivative, likewise.
std::vector<double> slope_of(const std::vector<double>& signal, const std::vector<data::Segment>& segments,
                             double sample_s);

}  // namespace flexspline::estimation
