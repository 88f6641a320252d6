// What of a current set point may stand, at the divided rate of the motion loops: field weakening, the thermal limit,
// the circle of the current.
//   f     <- clamp(f + G (share U - |u|), -weakening, 0)     |u|: wanted voltage, U: the circle of the voltage
//   heat  <- heat + (i^2 - heat) T/tau                        I2t: temperature of the winding in units of a current^2
//   I^2   = peak^2 up to heat = start, then linearly down to continuous^2 at heat = continuous^2
//   d     = clamp(d_wanted + f, I), q = clamp(q_wanted, sqrt(I^2 - d^2))
// At a constant current set point heat ends where I^2 = heat: at the continuous current and never above it.
#pragma once

#include <cstdint>

#include "shared/control/foc/current_control.hpp"

namespace flexspline::control::foc {

struct LimitSettings {
  std::int32_t weakening_gain = 0;      // G: bases of the current for full scales of the bus voltage, 2^-29
  std::int32_t weakening = 0;           // most that d is lowered by, 2^-27
  std::int32_t voltage_share = 0;       // of the circle that is used, 2^-31
  std::uint32_t peak_square = 0;        // 2^-30, of currents of at most one base
  std::uint32_t continuous_square = 0;  // 2^-30
  std::uint32_t start_square = 0;       // 2^-30
  std::uint32_t fade = 0;               // (peak^2 - continuous^2)/(continuous^2 - start), 2^-16
  std::uint32_t heating = 0;            // T/tau, 2^-32
};
struct LimitState {
  std::int32_t weakening = 0;  // f
  std::uint64_t heat = 0;      // 2^-62
};
struct Limits {
  RotorVector set_point;
  std::int32_t current = 0;  // what the circle has left, 2^-27
  bool by_heat = false;
};

namespace detail {
// Of a current: 2^-30. Held at 1.4 bases, so that the sum of two squares fits.
constexpr std::uint32_t square_of(std::int32_t x) {
  constexpr std::int32_t kMost = 187'904'819;
  const std::int32_t held = fixed::limited(x, -kMost, kMost);
  return static_cast<std::uint32_t>(fixed::multiply_high(held * 8, held * 8)) * 4;
}
// The root of a square in 2^-30: 2^-27.
constexpr std::int32_t current_of(std::uint32_t square) {
  return static_cast<std::int32_t>(root_word(square) >> 3);
}
// Of two voltages of at most one, 2^-30.
constexpr std::int32_t magnitude(std::int32_t d, std::int32_t q) {
  const auto square = static_cast<std::uint32_t>(fixed::multiply_high(d, d) + fixed::multiply_high(q, q));  // 2^-28
  return static_cast<std::int32_t>(root_word(square << 2));
}
}  // namespace detail

// The current that heat leaves, 2^-27.
constexpr std::int32_t heat_limit(const LimitSettings& c, const LimitState& s) {
  const auto heat = static_cast<std::uint32_t>(s.heat >> 32);
  if (heat <= c.start_square) return detail::current_of(c.peak_square);
  const std::uint64_t less = (std::uint64_t{heat - c.start_square} * c.fade) >> 16;
  const std::uint32_t span = c.peak_square - c.continuous_square;
  return detail::current_of(less < span ? c.peak_square - static_cast<std::uint32_t>(less) : c.continuous_square);
}

// `measured` currents in 2^-27; `wanted` voltages and `most` as control_currents has them, with its `up`.
constexpr Limits limit_currents(LimitState& s, const LimitSettings& c, const RotorVector& set_point,
                                const RotorVector& measured, const RotorVector& wanted, std::int32_t most, int up) {
  const std::int32_t bound = 0x3FFFFFFF >> up;
  const std::int32_t size =
      detail::magnitude(fixed::limited(wanted.d, -bound, bound) << up, fixed::limited(wanted.q, -bound, bound) << up);
  const std::int32_t spare = fixed::multiply_high(most << up, c.voltage_share) * 2 - size;
  s.weakening =
      fixed::limited<std::int32_t>(s.weakening + fixed::multiply_high(spare, c.weakening_gain), -c.weakening, 0);

  const std::uint32_t square = detail::square_of(measured.d) + detail::square_of(measured.q);
  const auto heat = static_cast<std::uint32_t>(s.heat >> 32);
  if (square > heat)
    s.heat += std::uint64_t{square - heat} * c.heating;
  else
    s.heat -= std::uint64_t{heat - square} * c.heating;

  Limits l;
  l.current = heat_limit(c, s);
  l.by_heat = static_cast<std::uint32_t>(s.heat >> 32) > c.start_square;
  l.set_point.d = fixed::limited(saturated_signed<kCurrentBits>(set_point.d) + s.weakening, -l.current, l.current);
  const std::uint32_t all = detail::square_of(l.current), of_d = detail::square_of(l.set_point.d);
  const std::int32_t most_q = detail::current_of(all > of_d ? all - of_d : 0);
  l.set_point.q = fixed::limited(set_point.q, -most_q, most_q);
  return l;
}

}  // namespace flexspline::control::foc
