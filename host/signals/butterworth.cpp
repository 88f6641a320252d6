#include "host/signals/butterworth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace flexspline::signals {
namespace {

// Signals filtered in one loop. The lanes are independent, so compiler vectors do what four scalar loops would, to the
// bit, on any processor. (Never passed by value: without AVX their calling convention is not settled.)
using Lanes1 = double;
typedef double Lanes2 __attribute__((vector_size(16)));
typedef double Lanes4 __attribute__((vector_size(32)));

template <typename V>
constexpr std::size_t kLanes = sizeof(V) / sizeof(double);

// Below this a state is rounding dust of a signal that has come to rest; as a denormal it would slow the loop manyfold.
constexpr double kDust = 1e-200;
constexpr std::size_t kBlock = 512;

template <typename V>
double get(const V& v, std::size_t lane) {
  if constexpr (kLanes<V> == 1)
    return v;
  else
    return v[lane];
}

template <typename V>
struct Columns {
  double* data[kLanes<V>];

  inline void load(std::size_t i, V& out) const {
    if constexpr (kLanes<V> == 1)
      out = data[0][i];
    else if constexpr (kLanes<V> == 2)
      out = V{data[0][i], data[1][i]};
    else
      out = V{data[0][i], data[1][i], data[2][i], data[3][i]};
  }
  inline void store(std::size_t i, const V& value) const {
    for (std::size_t l = 0; l < kLanes<V>; ++l) data[l][i] = get(value, l);
  }
};

// The sections in transposed direct form II, all advanced by one sample per step.
template <int Order, typename V>
struct Cascade {
  static constexpr int kPairs = Order / 2;
  static constexpr bool kOdd = Order % 2 == 1;
  static constexpr int kSections = kPairs + (kOdd ? 1 : 0);

  double a1[kSections], a2[kSections], gain;
  V s1[kSections], s2[kSections];

  Cascade(const std::vector<double>& a1s, const std::vector<double>& a2s, double g) : gain(g) {
    std::copy_n(a1s.begin(), kSections, a1);
    std::copy_n(a2s.begin(), kSections, a2);
  }

  // The state after an endless constant input.
  void settle(const V& input) {
    V x = input * gain;
    for (int k = 0; k < kSections; ++k) {
      const bool single = kOdd && k == kPairs;
      const double dc = (single ? 2.0 : 4.0) / ((1.0 + a1[k]) + a2[k]);
      const V y = x * dc;
      s1[k] = y - x;
      s2[k] = single ? x * 0.0 : x - a2[k] * y;
      x = y;
    }
  }

  inline void step(V& value) {
    V x = value * gain;
    for (int k = 0; k < kPairs; ++k) {
      const V y = x + s1[k];
      s1[k] = (x + x + s2[k]) - a1[k] * y;
      s2[k] = x - a2[k] * y;
      x = y;
    }
    if constexpr (kOdd) {
      const V y = x + s1[kPairs];
      s1[kPairs] = x - a1[kPairs] * y;
      x = y;
    }
    value = x;
  }

  void sweep_dust() {
    for (int k = 0; k < kSections; ++k) {
      sweep(s1[k]);
      sweep(s2[k]);
    }
  }

 private:
  static void sweep(V& state) {
    if constexpr (kLanes<V> == 1) {
      if (std::abs(state) < kDust) state = 0.0;
    } else {
      for (std::size_t l = 0; l < kLanes<V>; ++l)
        if (std::abs(state[l]) < kDust) state[l] = 0.0;
    }
  }
};

// Calls body(cascade, i) for i = 0 .. count-1. The cascade is copied to a local so that its states stay in registers.
template <typename C, typename Body>
inline void in_blocks(C& cascade, std::size_t count, Body&& body) {
  for (std::size_t start = 0; start < count; start += kBlock) {
    const std::size_t stop = std::min(count, start + kBlock);
    C local = cascade;
    for (std::size_t i = start; i < stop; ++i) body(local, i);
    local.sweep_dust();
    cascade = local;
  }
}

template <int Order, typename V>
void both_passes(const std::vector<double>& a1, const std::vector<double>& a2, double gain, const Columns<V>& x,
                 std::size_t n, std::size_t pad_length) {
  if (n < 2) return;
  const std::size_t pad = std::min(n - 1, pad_length);
  Cascade<Order, V> cascade(a1, a2, gain);

  // Everything is relative to the first sample, so that a constant is exactly zero inside.
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

  V value;
  x.load(pad, value);
  value = origin - value;
  cascade.settle(value);
  in_blocks(cascade, pad, [&](auto& c, std::size_t i) {
    V v;
    x.load(pad - i, v);
    v = origin - v;
    c.step(v);
  });
  in_blocks(cascade, n, [&](auto& c, std::size_t i) {
    V v;
    x.load(i, v);
    v = v - origin;
    c.step(v);
    x.store(i, v);
  });
  in_blocks(cascade, pad, [&](auto& c, std::size_t i) {
    V v;
    after.load(i, v);
    c.step(v);
    after.store(i, v);
  });

  after.load(pad - 1, value);
  cascade.settle(value);
  in_blocks(cascade, pad, [&](auto& c, std::size_t i) {
    V v;
    after.load(pad - 1 - i, v);
    c.step(v);
  });
  in_blocks(cascade, n, [&](auto& c, std::size_t i) {
    V v;
    x.load(n - 1 - i, v);
    c.step(v);
    v = v + origin;
    x.store(n - 1 - i, v);
  });
}

template <typename V, int... Less>
void dispatch(int order, const std::vector<double>& a1, const std::vector<double>& a2, double gain, const Columns<V>& x,
              std::size_t n, std::size_t pad_length, std::integer_sequence<int, Less...>) {
  ((order == Less + 1 ? both_passes<Less + 1, V>(a1, a2, gain, x, n, pad_length) : void()), ...);
}

using Orders = std::make_integer_sequence<int, ZeroPhaseFilter::kMaxOrder>;

}  // namespace

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

  const double k = std::tan(std::numbers::pi * cutoff_hz / sample_hz);
  double slowest = 0.0;
  gain_ = 1.0;
  for (int pair = 0; pair < order / 2; ++pair) {
    const double damping = 2.0 * std::sin(std::numbers::pi * (2.0 * pair + 1.0) / (2.0 * order));
    const double norm = 1.0 / (1.0 + damping * k + k * k);
    const double a1 = 2.0 * (k * k - 1.0) * norm;
    const double a2 = (1.0 - damping * k + k * k) * norm;
    a1_.push_back(a1);
    a2_.push_back(a2);
    // From the rounded denominator, so that the gain at zero frequency is one whatever the rounding did to the poles.
    gain_ *= ((1.0 + a1) + a2) / 4.0;
    slowest = std::max(slowest, std::sqrt(std::abs(a2)));
  }
  if (order % 2 == 1) {
    const double a1 = (k - 1.0) / (k + 1.0);
    a1_.push_back(a1);
    a2_.push_back(0.0);
    gain_ *= (1.0 + a1) / 2.0;
    slowest = std::max(slowest, std::abs(a1));
  }
  constexpr double kDecay = 1e-6, kLongest = 1e9;
  const double decay = slowest > 0.0 ? std::log(kDecay) / std::log(slowest) : 1.0;
  pad_length_ = static_cast<std::size_t>(std::clamp(std::ceil(decay), 1.0, kLongest));

  // For slow filters the response only stretches with the period of the cut-off; a faster one tells its length.
  constexpr std::size_t kEnough = 20000;
  if (pad_length_ > kEnough) {
    const double stretch = decay / (0.5 * kEnough);
    const ZeroPhaseFilter faster(order, cutoff_hz * stretch, sample_hz);
    settling_samples_ = static_cast<std::size_t>(std::ceil(stretch * static_cast<double>(faster.settling_samples_)));
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
