#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace flexspline::signals {

/// What a Kalman filter assumes of a measured position: the acceleration is a random walk, driven by white jerk, and
/// the position has white noise (report sections 4.1 and 4.3, after Belanger; shared/observers/encoder_kalman.hpp is
/// the drive's filter on the same assumptions).
struct MotionCovariances {
  double position_variance = 0.0;  ///< of the noise of one sample, unit squared
  double jerk_density = 0.0;       ///< (unit/s^3)^2/Hz: how fast accelerations are expected to change

  /// The magnitude of the filter's three poles over 2 pi, (S / (T r))^(1/6) / (2 pi): slower motion passes.
  double corner_hz(double sample_s) const;
};

/// The covariances under which the position is most likely: maximum of the likelihood of the filter's innovations
/// (prediction error decomposition, Schweppe 1965), over the corner frequency; the variance follows from the mean
/// square of the innovations, but is at least `least_variance`, the twelfth of a squared encoder step: an encoder at
/// standstill shows no noise, although its position is known no better than to a step. Long signals are represented by
/// a part in their middle. Throws std::invalid_argument for fewer than 16 samples or a sample time that is not
/// positive.
MotionCovariances most_likely_covariances(std::span<const double> position, double sample_s, double least_variance);

struct SmoothedMotion {
  std::vector<double> position, velocity, acceleration;
  /// Standard deviations in the middle of the signal, if the assumptions hold.
  double position_std = 0.0, velocity_std = 0.0, acceleration_std = 0.0;
};

/// Position, velocity and acceleration at each sample from all samples, earlier and later ones: the Kalman filter
/// forward and its correction backward (Rauch, Tung, Striebel 1965). It shifts nothing in time. Data with a gap must be
/// smoothed segment by segment. Throws as above, for fewer than 3 samples.
SmoothedMotion rauch_tung_striebel(std::span<const double> position, double sample_s,
                                   const MotionCovariances& covariances);

/// Standard deviation of the smoothed velocity and acceleration over that of white noise on the position, 1/s and
/// 1/s^2, in the middle of a long signal.
struct SmootherNoise {
  double velocity = 0.0, acceleration = 0.0;
};
SmootherNoise smoother_noise(double sample_s, const MotionCovariances& covariances);

}  // namespace flexspline::signals
