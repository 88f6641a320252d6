// A voltage vector to the on-times of three half bridges: space-vector modulation by injection of the mean of the
// largest and the smallest phase. Its duties are those of the textbook's sectors: there the two active vectors take
// the times that the line voltages ask for, and the rest of the period is shared in halves by both zero vectors. The
// line voltages fix the differences of the three duties, and with them the active times; the zero vectors last for
// the smallest duty (all high) and one less the largest (all low). They are equal exactly where largest + smallest = 1,
// which is what the injection makes. One duty is free and one equation fixes it, so both are the same duties.
//
// Where the low sides would be on for less than the sampling window, all duties go down together; where a high side
// would be on for less than the shortest pulse, its phase rests on the low side for that period and the others go down
// with it. Line voltages stay as they are in both cases, as long as the circle of the voltage leaves one pulse free.
//
// Dead time: a leg whose current flows out loses it once a period, one whose current flows in gains it. Each leg gets
// it back with the sign of the current that is expected in the middle of that period; around zero, where capacitances
// and ripple make the change gradual, in proportion. A leg that rests does not switch and gets nothing.
#pragma once

#include <cstdint>

#include "shared/control/foc/transforms.hpp"
#include "shared/fixed/bits.hpp"

namespace flexspline::control::foc {

inline constexpr int kDutyBits = 30;
inline constexpr int kZoneBits = 12;  // steps of the compensation within its linear zone
struct ModulationSettings {
  std::int32_t window = 0;          // least time of a low side for a sample, 2^-30 of the period
  std::int32_t pulse = 0;           // shortest pulse and the dead-time compensation, likewise
  std::int32_t dead_time = 0;       // what a leg loses, 2^-18 of the period
  std::int32_t dead_time_gain = 0;  // the current's base over the width of the linear zone, 2^-19
  std::int32_t period = 0;          // counts of the timer for a duty of one, times 4
};
struct Pulses {
  Phases counts;
  std::int32_t unmeasured = 0;  // 1 to 3: the phase whose low side is on for too short to be sampled; 0: none
};

// One over the bus voltage, 2^-27, from its reading in 2^-15. Held where the reading leaves an eighth of full scale to
// one: below, the drive is off.
inline constexpr std::int32_t kLeastBus = 4096;
constexpr std::int32_t per_bus(std::int32_t bus) {
  return static_cast<std::int32_t>((0xFFFFFFFFU / static_cast<std::uint32_t>(bus)) << 10);
}

namespace detail {
constexpr std::int32_t count_of(const ModulationSettings& c, std::int32_t duty, std::int32_t current) {
  const std::int32_t share = saturated_signed<kZoneBits>(fixed::multiply_high(current, c.dead_time_gain));
  const std::int32_t all = duty > 0 ? duty + share * c.dead_time : 0;
  return fixed::multiply_high(static_cast<std::int32_t>(fixed::saturated<kDutyBits>(all)), c.period);
}
}  // namespace detail

// `u` in 2^-28 of the bus voltage's full scale, within a circle of 1/sqrt(3) of the bus voltage; `currents` of the
// phases in 2^-25, as they are expected in the middle of the period.
constexpr Pulses modulate(const ModulationSettings& c, const StatorVector& u, std::int32_t per_bus_voltage,
                          const Phases& currents) {
  constexpr std::int32_t kOne = std::int32_t{1} << kDutyBits;
  const Phases share = inverse_clarke(
      {fixed::multiply_high(u.alpha, per_bus_voltage) * 128, fixed::multiply_high(u.beta, per_bus_voltage) * 128});
  const std::int32_t low_ab = share.a < share.b ? share.a : share.b, high_ab = share.a < share.b ? share.b : share.a;
  const std::int32_t low = low_ab < share.c ? low_ab : share.c, high = high_ab < share.c ? share.c : high_ab;
  const std::int32_t span = high - low;
  std::int32_t least = (kOne - span) >> 1;  // the smallest duty
  if (least < c.window) least = kOne - c.window - span;
  if (least < c.pulse) least = 0;
  const std::int32_t shift = least - low;
  Pulses p;
  p.counts = {detail::count_of(c, share.a + shift, currents.a), detail::count_of(c, share.b + shift, currents.b),
              detail::count_of(c, share.c + shift, currents.c)};
  if (kOne - span - least < c.window) p.unmeasured = high == share.a ? 1 : high == share.b ? 2 : 3;
  return p;
}

}  // namespace flexspline::control::foc
