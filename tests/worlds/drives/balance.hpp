#pragma once

#include <vector>

#include "tests/worlds/drives/case.hpp"
#include "tests/worlds/drives/measure.hpp"

namespace flexspline::worlds::drives {

/// ...KnownPresliding: the true state of the contact stands in for the sign of the velocity.
/// kTransmissionAsRead: the encoders' zeros as they are, without a constant.
enum class Balance {
  kMotor,
  kMotorWithReversals,
  kMotorKnownPresliding,
  kReversalsKnownPresliding,
  kTransmission,
  kTransmissionAsRead
};

/// Square sum of what remains of `target` after its projection on the columns, by modified Gram-Schmidt (Golub and Van
/// Loan, ch. 5). Columns and target are left orthogonal.
double residual_square(std::vector<std::vector<double>>& columns, std::vector<double>& target);

/// Low pass without phase: second-order Butterworth, forward and backward (Oppenheim and Schafer, ch. 7).
std::vector<double> zero_phase(const std::vector<double>& signal, double rate_hz, double cutoff_hz);

/// Cut-off in Hz of the balance's filters: the lowest of 5, 10, 20, 40, 80, 160 at which the filter takes at most 1 %
/// of the power of the torque that the planned motions need, but none at which the encoder's steps make more than a
/// twentieth of the RMS torque by way of the acceleration, and none above a sixth of the rate.
double balance_cutoff_hz(const Case& drive, const std::vector<Measured>& records);

/// RMS in N m (at the motor, or of the flange's torque) of what the base model leaves of all records together, fitted
/// by least squares. Motor: Km i = J a + Tv w + Ts s(w) (+ gravity, where the base model has it) + known torques over
/// N, without the samples slower than a hundredth of the 95th percentile of speed or three times the velocity's noise,
/// or, with reversals, without standstills. Transmission: T = K dq + c v + T0.
double balance_error_nm(const Case& drive, const std::vector<Measured>& records, Balance balance, double cutoff_hz);

}  // namespace flexspline::worlds::drives
