#include "host/common/signals/butterworth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "host/common/signals/cascade.hpp"

namespace flexspline::signals {
namespace {

template <int Order, typename V>
void both_passes(const std::vector<double>& a1, const std::vector<double>& a2, double gain, const Columns<V>& x,
                 std::size_t n, std::size_t pad_length) {
  if (n < 2) return;
  const std::size_t pad = std::min(n - 1, pad_length);
  Cascade<Order, V> cascade(a1, a2, gain);

  V origin, last;
  x.load(0, origin);
  x.load(n - 1, last);
  std::vector<double> tail(pad * kLanes<V>);
  Columns<V> after;
  for (std::size_t l = 0; l < kLanes<V>; ++l) {
    after.data[l] = tail.data() + l * pad;
    for (std::size_t k = 0; k < pad; ++k)
      after.data[l][k] = (get(last, l) - x.data[l][n - 2 - k]) + (get(last, l) - get(origin, l));
  }

  begin_forward(cascade, x, pad, origin);
  pass_forward(cascade, x, 0, n, origin);
  in_blocks(cascade, pad, [&](auto& c, std::size_t i) {
    V v;
    after.load(i, v);
    c.step(v);
    after.store(i, v);
  });
  begin_backward(cascade, after, 0, pad);
  pass_backward(cascade, x, n, origin);
}

template <typename V, int... Less>
void dispatch(int order, const std::vector<double>& a1, const std::vector<double>& a2, double gain, const Columns<V>& x,
              std::size_t n, std::size_t pad_length, std::integer_sequence<int, Less...>) {
  ((order == Less + 1 ? both_passes<Less + 1, V>(a1, a2, gain, x, n, pad_length) : void()), ...);
}

using Orders = std::make_integer_sequence<int, ZeroPhaseFilter::kMaxOrder>;

}  // namespace

Sections sections_of(int order, double cutoff_hz, double sample_hz) {
  const double k = std::tan(std::numbers::pi * cutoff_hz / sample_hz);
  Sections s;
  for (int pair = 0; pair < order / 2; ++pair) {
    const double damping = 2.0 * std::sin(std::numbers::pi * (2.0 * pair + 1.0) / (2.0 * order));
    const double norm = 1.0 / (1.0 + damping * k + k * k);
    const double a1 = 2.0 * (k * k - 1.0) * norm;
    const double a2 = (1.0 - damping * k + k * k) * norm;
    s.a1.push_back(a1);
    s.a2.push_back(a2);
    // From the rounded denominator, so that the gain at zero frequency is one whatever the rounding did to the poles.
    s.gain *= ((1.0 + a1) + a2) / 4.0;
    s.slowest = std::max(s.slowest, std::sqrt(std::abs(a2)));
  }
  if (order % 2 == 1) {
    const double a1 = (k - 1.0) / (k + 1.0);
    s.a1.push_back(a1);
    s.a2.push_back(0.0);
    s.gain *= (1.0 + a1) / 2.0;
    s.slowest = std::max(s.slowest, std::abs(a1));
  }
  return s;
}

ZeroPhaseFilter::ZeroPhaseFilter(int order, double cutoff_hz, double sample_hz)
    : order_(order), cutoff_hz_(cutoff_hz), sample_hz_(sample_hz) {
  if (order < 1 || order > kMaxOrder)
    throw std::invalid_argument(
        fmt::format("Butterworth filter: order {} is not within 1..{}; 5 is usual", order, kMaxOrder));
  if (!(sample_hz > 0.0) || !std::isfinite(sample_hz))
    throw std::invalid_argument(
        fmt::format("Butterworth filter: sample rate {} Hz is not positive; check the time column", sample_hz));
  if (!(cutoff_hz > 0.0 && cutoff_hz < 0.5 * sample_hz))
    throw std::invalid_argument(
        fmt::format("Butterworth filter: cut-off {} Hz is not between 0 and half the sample rate ({} Hz); choose a "
                    "lower cut-off",
                    cutoff_hz, 0.5 * sample_hz));

  Sections sections = sections_of(order, cutoff_hz, sample_hz);
  a1_ = std::move(sections.a1);
  a2_ = std::move(sections.a2);
  gain_ = sections.gain;
  const double slowest = sections.slowest;
  constexpr double kDecay = 1e-6, kLongest = 1e9;
  const double decay = slowest > 0.0 ? std::log(kDecay) / std::log(slowest) : 1.0;
  pad_length_ = static_cast<std::size_t>(std::clamp(std::ceil(decay), 1.0, kLongest));

  // For slow filters the response only scales with the period of the cut-off; a faster one shows its length.
  constexpr std::size_t kEnough = 20000;
  if (pad_length_ > kEnough) {
    const double scale = decay / (0.5 * kEnough);
    const ZeroPhaseFilter faster(order, cutoff_hz * scale, sample_hz);
    settling_samples_ = static_cast<std::size_t>(std::ceil(scale * static_cast<double>(faster.settling_samples_)));
    return;
  }
  std::vector<double> response(2 * pad_length_ + 1, 0.0);
  response[pad_length_] = 1.0;
  apply_in_place(response);
  const double limit = 1e-3 * std::abs(response[pad_length_]);
  settling_samples_ = pad_length_;
  while (settling_samples_ > 1 && std::abs(response[pad_length_ + settling_samples_]) < limit) --settling_samples_;
  ++settling_samples_;
}

void ZeroPhaseFilter::apply_in_place(std::span<double> signal) const {
  dispatch(order_, a1_, a2_, gain_, Columns<Lanes1>{{signal.data()}}, signal.size(), pad_length_, Orders{});
}

std::vector<double> ZeroPhaseFilter::apply(std::span<const double> signal) const {
  std::vector<double> result(signal.begin(), signal.end());
  apply_in_place(result);
  return result;
}

void ZeroPhaseFilter::apply_columns_in_place(Eigen::Ref<Eigen::MatrixXd> columns) const {
  const auto n = static_cast<std::size_t>(columns.rows());
  const auto at = [&](Eigen::Index c) { return columns.data() + c * columns.outerStride(); };
  Eigen::Index c = 0;
  for (; c + 4 <= columns.cols(); c += 4)
    dispatch(order_, a1_, a2_, gain_, Columns<Lanes4>{{at(c), at(c + 1), at(c + 2), at(c + 3)}}, n, pad_length_,
             Orders{});
  for (; c + 2 <= columns.cols(); c += 2)
    dispatch(order_, a1_, a2_, gain_, Columns<Lanes2>{{at(c), at(c + 1)}}, n, pad_length_, Orders{});
  for (; c < columns.cols(); ++c) dispatch(order_, a1_, a2_, gain_, Columns<Lanes1>{{at(c)}}, n, pad_length_, Orders{});
}

Eigen::MatrixXd ZeroPhaseFilter::apply_columns(Eigen::MatrixXd columns) const {
  apply_columns_in_place(columns);
  return columns;
}

double ZeroPhaseFilter::gain(double frequency_hz) const {
  const double ratio =
      std::tan(std::numbers::pi * frequency_hz / sample_hz_) / std::tan(std::numbers::pi * cutoff_hz_ / sample_hz_);
  return 1.0 / (1.0 + std::pow(ratio * ratio, order_));
}

}  // namespace flexspline::signals
