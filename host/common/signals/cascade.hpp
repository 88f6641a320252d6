// The sections of a Butterworth filter at work, on one signal or on some side by side. For the filters of this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace flexspline::signals {

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
  void set_steady_state(const V& input) {
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

// What both passes of a zero-phase filter consist of; all of it relative to the first sample, `origin`, so that a
// constant is exactly zero inside.

// The state that `pad` samples before the signal leave behind: those after its first one, turned about it.
template <typename C, typename V>
void begin_forward(C& cascade, const Columns<V>& x, std::size_t pad, const V& origin) {
  V value;
  x.load(pad, value);
  value = origin - value;
  cascade.set_steady_state(value);
  in_blocks(cascade, pad, [&](auto& c, std::size_t i) {
    V v;
    x.load(pad - i, v);
    v = origin - v;
    c.step(v);
  });
}
template <typename C, typename V>
void pass_forward(C& cascade, const Columns<V>& x, std::size_t from, std::size_t to, const V& origin) {
  in_blocks(cascade, to - from, [&](auto& c, std::size_t i) {
    V v;
    x.load(from + i, v);
    v = v - origin;
    c.step(v);
    x.store(from + i, v);
  });
}
// The state that samples end-1 .. begin, filtered once already, leave behind.
template <typename C, typename V>
void begin_backward(C& cascade, const Columns<V>& after, std::size_t begin, std::size_t end) {
  V value;
  after.load(end - 1, value);
  cascade.set_steady_state(value);
  in_blocks(cascade, end - begin, [&](auto& c, std::size_t i) {
    V v;
    after.load(end - 1 - i, v);
    c.step(v);
  });
}
template <typename C, typename V>
void pass_backward(C& cascade, const Columns<V>& x, std::size_t count, const V& origin) {
  in_blocks(cascade, count, [&](auto& c, std::size_t i) {
    V v;
    x.load(count - 1 - i, v);
    c.step(v);
    v = v + origin;
    x.store(count - 1 - i, v);
  });
}

}  // namespace flexspline::signals
