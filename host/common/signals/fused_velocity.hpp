#pragma once

#include <optional>
#include <span>
#include <vector>

namespace flexspline::signals {

/// A velocity from two measurements of it.
struct FusedVelocity {
  std::vector<double> velocity;
  double crossover_hz = 0.0;  // the position's derivative counts below it, the measured velocity above it
  double std = 0.0;           // of what the noise of both leaves in it
};

/// The derivative of a position and a measured velocity, weighed by their noise at each frequency. With white noise of
/// the standard deviations `position_std` and `velocity_std` a sample, the derivative's noise grows with the frequency
/// and is as large as the velocity's at velocity_std / (2 pi position_std): the weights that leave the least noise,
/// those of a Kalman smoother, are a first-order low-pass at that frequency, forward and backward, and what is left of
/// one.
///
/// Both signals must have passed the same zero-phase filter, of `cutoff_hz`. The measured velocity is put on the
/// position's time and scale by the lag and gain that it has below the crossover. Nothing where it cannot help: the
/// crossover is near the filter's cut-off, its gain is off by more than 5 %, it lags by more than two samples, it lacks
/// more of the fast motion than the derivative has noise there, or the signals are too short.
std::optional<FusedVelocity> fused_velocity(std::span<const double> position, std::span<const double> measured,
                                            double position_std, double velocity_std, double cutoff_hz,
                                            double sample_s);

}  // namespace flexspline::signals
