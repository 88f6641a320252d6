// Currents in d and q to voltages, with two degrees of freedom: a model of the winding says which voltage makes the
// current follow a first-order response to the set point; a PI loop, which may be faster than that response, takes out
// what the winding does otherwise. So the response stays that of the design where R, L and flux are not exact.
//
// The timing it stands on: sample k in the middle of the low sides' time; its voltage u[k] acts from half a PWM period
// later on, for one period, whose middle is sample k+1. For each axis, with T the period, R and L of the winding,
// a = exp(-R T/L), m[k] the model's current when u[k] begins to act and i the measured one:
//   D    = (1 - exp(-w T)) (r - m[k])                        w: corner of the response, r: set point
//   x    = (sqrt(a) + B) (m_mid[k] - i[k]) - p[k]            error when u[k] begins to act, see below
//   u    = S D + R m[k] + Kp x + I[k] + cross                S = R/(1 - a), about L/T
//   n[k+1] = m[k] + h D - x + p[k+1]                         current at the next sample, about; h = 1/(1 + sqrt(a))
//   p[k+1] = (B sqrt(a) + (1 - B) h Kp/S) x
//   cross = -w_e Lq n_q in d, w_e (Ld n_d + flux) in q       decoupling, feedforward of the back-EMF
//   D    <- D + (u_limited - u)/S                            the model moves as far as the voltage lets it
//   m[k+1] = m[k] + D, m_mid[k+1] = m[k] + h D
//   I[k+1] = I[k] + Ki x, but I[k] where the limit holds u back and x would push it further; within its own limit
// x is an observer's: the error before, less what its correction takes, and sqrt(a) + B of what the sample has more
// than that. An error that a wrong slope has made by the middle of a period is larger at its end, hence B. The three
// gains B, Kp/S and Ki/S belong to the PWM rate over the bandwidth: host/drive_link/deployment/foc_settings. The
// voltage is limited to a circle; d, which holds the flux, has it first: |u_d| <= U, |u_q| <= sqrt(U^2 - u_d^2).
#pragma once

#include <cstdint>

#include "shared/control/foc/transforms.hpp"
#include "shared/fixed/bits.hpp"

namespace flexspline::control::foc {

// Currents in 2^-27 of the current base, voltages in 2^-25 of the voltage base. The voltage base is the full scale of
// the bus voltage times a power of two that leaves each coefficient below two: so products add up in 64 bits, and
// nothing has to be shifted or limited on the way.
struct AxisSettings {
  std::int32_t proportional = 0;               // Kp, 2^-30
  std::int32_t integral = 0;                   // Ki, 2^-30
  std::int32_t resistance = 0;                 // R, 2^-30
  std::int32_t volts_per_change = 0;           // S, 2^-30
  std::int32_t change_per_volt = 0;            // 1/S, 2^-27
  std::int32_t half_period_gain_less_one = 0;  // h - 1, 2^-32
  std::int32_t sample_weight_less_one = 0;     // sqrt(a) + B - 1, 2^-32
  std::int32_t pending_gain = 0;               // B sqrt(a) + (1 - B) h Kp/S, 2^-31
  std::int32_t reactance = 0;  // 2 pi L/(8 T), 2^-30: the speed is counted in eighths of a turn per period
};
struct CurrentSettings {
  AxisSettings d;
  AxisSettings q;
  std::int32_t flux = 0;                 // 2 pi flux/(8 T), 2^-25
  std::int32_t response_per_period = 0;  // 1 - exp(-w T), 2^-32
  std::int32_t integral_limit = 0;       // 2^-25
  std::int32_t voltage_exponent = 0;     // voltages times 2^this are in 2^-30 of the bus voltage's full scale; 5 to 25
};
struct AxisState {
  std::int64_t integral = 0;  // 2^-57
  std::int32_t model = 0;
  std::int32_t expected = 0;  // m_mid
  std::int32_t pending = 0;   // p/2
};
struct CurrentState {
  AxisState d;
  AxisState q;
};
struct Voltages {
  RotorVector limited;   // 2^-30 of the bus voltage's full scale
  RotorVector wanted;    // 2^-25 of the voltage base
  RotorVector expected;  // the currents n, for which the switches are compensated
};

inline constexpr int kCurrentBits = 28;  // two bases, of everything that comes in
inline constexpr int kStepBits = 28;     // electrical turns per period: one sixteenth, in 2^-32

namespace detail {
struct AxisPlan {
  std::int32_t error = 0;
  std::int32_t change = 0;    // D
  std::int32_t expected = 0;  // n
  std::int32_t pending = 0;   // half of it
  std::int32_t voltage = 0;   // without cross
};
constexpr AxisPlan plan(const AxisSettings& c, const AxisState& s, std::int32_t response_per_period,
                        std::int32_t set_point, std::int32_t measured) {
  AxisPlan p;
  const std::int32_t seen = s.expected - measured;  // within four bases
  // Saturated, as readings that mean nothing can drive it up: within four bases, with a pending part below one of
  // itself.
  p.error = saturated_signed<kCurrentBits + 1>(fixed::add_high(seen, seen, c.sample_weight_less_one) - s.pending * 2);
  p.pending = fixed::multiply_high(p.error, c.pending_gain);
  p.change = fixed::multiply_high(set_point - s.model, response_per_period);
  p.expected = saturated_signed<kCurrentBits>(
      fixed::add_high(s.model + p.change, p.change, c.half_period_gain_less_one) - p.error + p.pending * 2);
  // Each product is below 2^60, and so is the integral.
  const std::int64_t sum = s.integral + std::int64_t{c.proportional} * p.error +
                           std::int64_t{c.volts_per_change} * p.change + std::int64_t{c.resistance} * s.model;
  p.voltage = static_cast<std::int32_t>(sum >> 32);
  return p;
}
// `excess`: limited less wanted voltage.
constexpr void advance(AxisState& s, const AxisSettings& c, const AxisPlan& p, std::int32_t excess,
                       std::int32_t integral_limit) {
  const std::int32_t back =
      saturated_signed<22>(fixed::multiply_high(excess, c.change_per_volt));  // four bases in 2^-20
  const std::int32_t next = saturated_signed<kCurrentBits>(s.model + p.change + back * 128);
  s.expected = fixed::add_high(next, next - s.model, c.half_period_gain_less_one);
  s.model = next;
  s.pending = p.pending;
  // Opposite signs: the limit holds back what the error asks for.
  const std::int32_t counted = excess != 0 && (excess ^ p.error) < 0 ? 0 : p.error;
  const std::int64_t sum = s.integral + fixed::long_product(c.integral, counted);
  // Within the limit to both sides: one comparison.
  const auto from_low = static_cast<std::uint32_t>(static_cast<std::int32_t>(sum >> 32) + integral_limit);
  const auto most = static_cast<std::uint32_t>(integral_limit) * 2;
  if (from_low >= most) return;
  s.integral = sum;
}
}  // namespace detail

// `set_point` and `measured` within two bases, `step` within a sixteenth of a turn; `most`: the circle, in 2^-25 of the
// voltage base and within the bus voltage.
constexpr Voltages control_currents(CurrentState& s, const CurrentSettings& c, const RotorVector& set_point,
                                    const RotorVector& measured, std::int32_t step, std::int32_t most) {
  using fixed::multiply_high;
  const detail::AxisPlan d = detail::plan(c.d, s.d, c.response_per_period, set_point.d, measured.d);
  const detail::AxisPlan q = detail::plan(c.q, s.q, c.response_per_period, set_point.q, measured.q);
  const std::int32_t eighths = step * 8;
  const std::int32_t linkage_d = fixed::add_high(c.flux, c.d.reactance, d.expected);
  const std::int32_t linkage_q = multiply_high(c.q.reactance, q.expected);
  Voltages u;
  u.wanted = {d.voltage - multiply_high(linkage_q, eighths), fixed::add_high(q.voltage, linkage_d, eighths)};
  u.expected = {d.expected, q.expected};

  const std::int32_t limited_d = fixed::limited(u.wanted.d, -most, most);
  const std::int32_t whole = most << c.voltage_exponent;
  u.limited.d = limited_d << c.voltage_exponent;
  // 2^-28, of which the root is taken in 2^-32.
  const auto square = static_cast<std::uint32_t>(multiply_high(whole, whole) - multiply_high(u.limited.d, u.limited.d));
  const auto most_q = static_cast<std::int32_t>(root_word(square << 4) >> (c.voltage_exponent + 1));
  const std::int32_t limited_q = fixed::limited(u.wanted.q, -most_q, most_q);
  u.limited.q = limited_q << c.voltage_exponent;
  detail::advance(s.d, c.d, d, limited_d - u.wanted.d, c.integral_limit);
  detail::advance(s.q, c.q, q, limited_q - u.wanted.q, c.integral_limit);
  return u;
}

}  // namespace flexspline::control::foc
