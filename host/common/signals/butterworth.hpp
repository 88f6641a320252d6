#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace flexspline::signals {

// The second-order sections of a ZeroPhaseFilter.
struct Sections {
  std::vector<double> a1, a2;
  double gain = 1.0;
  double slowest = 0.0;  // magnitude of the slowest pole
};

Sections sections_of(int order, double cutoff_hz, double sample_hz);

/// Low-pass Butterworth filter applied forward and backward, so that it shifts nothing in time.
///
/// Design: second-order sections by the bilinear transform, pre-warped at the cut-off. The cut-off is the -3 dB point
/// of a single pass, as with MATLAB's filtfilt(butter(...)); both passes together are 6 dB down there. With r = tan(pi
/// f / fs) / tan(pi fc / fs) the gain is 1 / (1 + r^(2 order)), and the phase is zero.
///
/// Ends: the signal is continued by odd reflection, until the slowest pole has decayed or the signal is used up, and
/// each section starts in its steady state. A constant passes bit for bit, a linear ramp to about 1e-6 of its slope
/// times the filter's delay where the signal is longer than `pad_length`. Data with a gap must be filtered segment by
/// segment. A value that is not finite makes the whole signal invalid.
///
/// All methods are const and hold no scratch memory: one filter may serve several threads.
class ZeroPhaseFilter {
 public:
  static constexpr int kDefaultOrder = 5;
  static constexpr int kMaxOrder = 12;

  /// Throws std::invalid_argument unless 1 <= order <= 12 and 0 < cutoff_hz < sample_hz / 2.
  ZeroPhaseFilter(int order, double cutoff_hz, double sample_hz);

  /// The filtered signal, of the same length. An empty or one-sample signal comes back unchanged.
  std::vector<double> apply(std::span<const double> signal) const;
  void apply_in_place(std::span<double> signal) const;

  /// Filters each column as `apply` does, up to rounding. Four columns share one loop: a recursive filter waits for its
  /// own result most of the time, so four take about the time of one and a half.
  void apply_columns_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const;
  Eigen::MatrixXd apply_columns(Eigen::MatrixXd columns) const;

  /// Gain of both passes at a frequency within [0, sample_hz / 2]; the phase is zero.
  double gain(double frequency_hz) const;

  /// How far an edge or a gap disturbs the output: beyond this distance the impulse response of both passes stays below
  /// a thousandth of its peak.
  std::size_t settling_samples() const { return settling_samples_; }
  /// Reflected samples at each end of a signal that is long enough: the slowest pole decays to a millionth.
  std::size_t pad_length() const { return pad_length_; }

  int order() const { return order_; }
  double cutoff_hz() const { return cutoff_hz_; }
  double sample_hz() const { return sample_hz_; }

 private:
  int order_;
  double cutoff_hz_;
  double sample_hz_;
  // Denominators 1 + a1/z + a2/z^2 of the sections; the numerators are (1 + 1/z)^2. With an odd order the last section
  // is of first order: 1 + a1/z below 1 + 1/z. One gain serves the whole cascade.
  std::vector<double> a1_, a2_;
  double gain_ = 1.0;
  std::size_t pad_length_ = 0;
  std::size_t settling_samples_ = 0;
};

}  // namespace flexspline::signals
