// The ways to a derivative of a sampled signal that the report lists in section 1.3.4, side by side. What the
// identification uses is the last of them.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "host/common/signals/butterworth.hpp"

namespace flexspline::signals {

/// What low-pass filter the derivative is taken of (eq. 22): H1 has the poles of a second-order Butterworth filter, H2
/// two equal real ones. Both pass the position with a gain of 1/sqrt(2) (H1) or 1/2 (H2) at the cut-off.
enum class AnalogFilter : std::uint8_t { none, h1, h2, butterworth };

/// How a continuous transfer function becomes a difference equation, with q = 1/z and T the sample time.
enum class Discretisation : std::uint8_t {
  backward,            ///< s = (1 - q) / T
  bilinear,            ///< eq. 20: s = 2/T (1 - q) / (1 + q)
  bilinear_prewarped,  ///< s = w0 / tan(w0 T / 2) (1 - q) / (1 + q): exact at the cut-off
  impulse_invariant,   ///< the impulse response, sampled; half of a jump at its start counts
  matched,             ///< poles and zeros at exp(p T), zeros at infinity at z = -1, gain matched at standstill
  forward_backward,    ///< of the Butterworth filter alone: both ways in time, then central differences
};

enum class Differentiator : std::uint8_t {
  backward,
  bilinear,
  bilinear_prewarped,
  impulse_invariant,
  matched,
  h1_backward,
  h1_bilinear,
  h1_bilinear_prewarped,
  h1_impulse_invariant,
  h1_matched,
  h2_backward,
  h2_bilinear,
  h2_bilinear_prewarped,
  h2_impulse_invariant,
  h2_matched,
  butterworth,
};

struct DifferentiatorInfo {
  Differentiator which;
  std::string_view name;  ///< for a command: "h2-bilinear"
  AnalogFilter filter;
  Discretisation discretisation;
  std::string_view source;       ///< equation of the report
  std::string_view explanation;  ///< what it does to delay, gain and noise; one or two sentences
  bool uses_cutoff;
  bool gives_acceleration;
};

/// All of them, in the order of the enumeration.
std::span<const DifferentiatorInfo> differentiators();
const DifferentiatorInfo& info_of(Differentiator which);
std::optional<Differentiator> differentiator_from_name(std::string_view name);

/// Three signals as long as the input; acceleration is empty where the method gives none.
struct Derivatives {
  std::vector<double> position;      ///< through the same filter (y_f of eq. 24); unit of the input
  std::vector<double> velocity;      ///< y_fd of eq. 24; unit per second
  std::vector<double> acceleration;  ///< unit per second squared
};

/// One method at one sample time and cut-off.
///
/// Delay of the velocity at low frequency, in samples (group_delay_samples gives it at any): backward 1/2, bilinear 0,
/// with H1 sqrt(2) / (w0 T) more, with H2 2 / (w0 T), with matched poles likewise within (w0 T)^2; Butterworth forward
/// and backward 0 everywhere. Gain error at low frequency: none, but pre-warping takes (w0 T)^2 / 12 off (per order)
/// and the impulse-invariant velocity of a filter has no zero at standstill (see gain_at_standstill).
///
/// All methods are const and hold no scratch memory: one object may serve several threads.
class DifferentiatingFilter {
 public:
  /// Throws std::invalid_argument unless sample_s > 0 and, where the method uses it, 0 < cutoff_hz < 1 / (2 sample_s).
  DifferentiatingFilter(Differentiator which, double cutoff_hz, double sample_s);

  /// Before its first sample the signal is extrapolated linearly from the first two samples, so that a
  /// constant velocity has no transient. Data with a gap must be given piece by piece.
  Derivatives apply(std::span<const double> position) const;

  /// From the position to its derivative of that order (0: the filter alone, 1, 2) at a frequency from 0 to half the
  /// sample rate; the ideal is (2 pi f j)^order. Throws std::invalid_argument for an order that it does not give.
  std::complex<double> response(int order, double frequency_hz) const;
  /// Ratio of its gain to the ideal one, less one. The frequency must be above 0.
  double gain_error(int order, double frequency_hz) const;
  /// By how much it comes late there, in samples: minus the slope of its phase. The frequency must be above 0.
  double group_delay_samples(int order, double frequency_hz) const;
  /// Standard deviation of the result over that of white noise on the position, 1/s^order. Infinite for the bilinear
  /// derivatives without a filter: their pole at z = -1 keeps all noise for ever.
  double noise_gain(int order) const;
  /// Derivative that a constant position of one shows, 1/s^order (order 1 or 2): zero but for impulse invariance with
  /// a filter, where aliasing leaves w0 (w0 T)^2 / 6 (H2) or sqrt(2) / 12 times w0 (w0 T)^2 (H1), to that order.
  double gain_at_standstill(int order) const { return response(order, 0.0).real(); }

  const DifferentiatorInfo& info() const { return *info_; }
  double cutoff_hz() const { return cutoff_hz_; }
  double sample_s() const { return sample_s_; }

 private:
  /// b(q) / a(q), a[0] = 1.
  struct Rational {
    std::array<double, 3> b{}, a{};
  };
  static Rational substituted(std::span<const double> numerator, std::span<const double> denominator, double scale,
                              bool bilinear);
  Rational designed(int order) const;
  const Rational& rational(int order) const;
  std::vector<double> applied(const Rational& g, std::span<const double> signal) const;

  const DifferentiatorInfo* info_;
  double cutoff_hz_;
  double sample_s_;
  std::array<Rational, 3> rationals_;
  std::optional<ZeroPhaseFilter> zero_phase_;
};

}  // namespace flexspline::signals
