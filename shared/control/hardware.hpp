// The hardware of a board, independent of the parameter block: full scales, its largest current, its sensors. A drive
// reports it to a host, which packs a block for it; the drive's validator refuses a block that states something else.
#pragma once

#include <cstdint>

#include "shared/control/drive_parameters.hpp"
#include "shared/fixed/bits.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::control {

enum class SensorKind : std::uint8_t {
  not_stated,  // the sensor is not part of the board: the block states it
  none,
  incremental,  // quadrature: counts from its angle at power-on
  indexed,      // the same, with an index pulse
  absolute,     // its angle within a turn, from the start
  analog,
};
inline constexpr std::uint32_t kSensorKinds = 6;

// Zero: the board does not state it, as for an external sensor or amplifier. Full scale is a reading (or a command)
// of one, 2^15; a temperature is linear in its reading: full scale times the share, less what it is at zero.
struct Hardware {
  std::uint32_t current_full_scale_ma = 0;
  std::uint32_t amplifier_full_scale_ma = 0;
  std::uint32_t most_current_ma = 0;
  std::uint32_t torque_full_scale_mnm = 0;
  std::uint32_t temperature_full_scale_mc = 0;
  std::int32_t temperature_at_zero_mc = 0;
  SensorKind motor_encoder = SensorKind::not_stated;
  SensorKind output_encoder = SensorKind::not_stated;
  SensorKind torque_sensor = SensorKind::not_stated;
  bool operator==(const Hardware&) const = default;
};

// The largest command to the amplifier with any block: a share of its full scale, 2^-15.
constexpr std::int32_t most_command(const Hardware& h) {
  constexpr std::int32_t kAll = 32767;
  if (h.most_current_ma == 0 || h.amplifier_full_scale_ma == 0 || h.most_current_ma >= h.amplifier_full_scale_ma)
    return kAll;
  return static_cast<std::int32_t>(std::uint64_t{h.most_current_ma} * 32768 / h.amplifier_full_scale_ma);
}
// The current's reading at which the drive switches off with any block: a quarter above the largest command. 32768,
// which no reading reaches, where the sensor's range is smaller.
constexpr std::int32_t most_reading(const Hardware& h) {
  constexpr std::uint64_t kNever = 32768;
  if (h.most_current_ma == 0 || h.current_full_scale_ma == 0) return static_cast<std::int32_t>(kNever);
  const std::uint64_t share = std::uint64_t{h.most_current_ma} * 40960 / h.current_full_scale_ma;
  return static_cast<std::int32_t>(share < kNever ? share : kNever);
}

// The values of a block that have to agree with the board.
enum class Disagreement : std::uint8_t {
  none,
  current_full_scale,
  amplifier_full_scale,
  most_current,
  torque_full_scale,
  temperature_law,
  output_encoder,
  torque_sensor,
};
struct Stated {
  using N = fixed::Fixed;
  AnalogScale<N> current{};
  AnalogScale<N> torque{};
  AnalogScale<N> temperature{};
  N::Gain amplifier{};
  fixed::Value current_limit{};
  bool has_output_encoder = false;
  bool has_torque_sensor = false;
  // Bases of the block.
  model::Number current_base{};
  model::Number torque_base{};  // of the output
  model::Number temperature_base{};
};

namespace detail {
// A number above zero: mantissa 2^exponent, its highest bit the 62nd.
struct Size {
  std::uint64_t mantissa = 0;
  int exponent = 0;
  static constexpr Size of(std::uint64_t mantissa, int exponent) {
    if (mantissa == 0) return {};
    const int up = std::countl_zero(mantissa) - 1;
    return {mantissa << up, exponent - up};
  }
  // Of two numbers below 2^31 in size.
  static constexpr Size product(std::int64_t a, int a_exponent, std::int64_t b, int b_exponent) {
    return of(fixed::long_product(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)),
              a_exponent + b_exponent);
  }
  // A thousand times it.
  constexpr Size thousandfold() const { return of((mantissa >> 10) * 1000, exponent + 10); }
};
// Within 2^-8 of each other: full scales are rounded to a thousandth, and gains of resistors are no better.
constexpr bool is_near(Size a, Size b) {
  if (a.mantissa == 0 || b.mantissa == 0) return a.mantissa == b.mantissa;
  if (a.exponent - b.exponent == 1) b = {b.mantissa >> 1, a.exponent};
  if (b.exponent - a.exponent == 1) a = {a.mantissa >> 1, b.exponent};
  if (a.exponent != b.exponent) return false;
  const std::uint64_t off = a.mantissa > b.mantissa ? a.mantissa - b.mantissa : b.mantissa - a.mantissa;
  return off <= (a.mantissa >> 8);
}
constexpr bool is_above(Size a, Size b) {
  if (a.mantissa == 0 || b.mantissa == 0) return a.mantissa > b.mantissa;
  return a.exponent != b.exponent ? a.exponent > b.exponent : a.mantissa > b.mantissa;
}
// A gain of a reading times its base, in thousandths of the unit.
constexpr Size thousandths(const fixed::Gain& gain, const model::Number& base) {
  if (gain.mantissa <= 0) return {};
  return Size::product(gain.mantissa, gain.exponent - fixed::kMantissaBits, base.mantissa,
                       base.exponent - fixed::kMantissaBits)
      .thousandfold();
}
constexpr Size thousandths(std::int32_t raw, const model::Number& base) {
  return Size::product(raw < 0 ? -std::int64_t{raw} : raw, -fixed::kValueBits, base.mantissa,
                       base.exponent - fixed::kMantissaBits)
      .thousandfold();
}
}  // namespace detail

// The first disagreement between a block and its board.
constexpr Disagreement disagreement(const Stated& s, const Hardware& h) {
  using detail::Size, detail::thousandths, detail::is_near;
  const auto whole = [](std::uint32_t x) { return Size::of(x, 0); };
  const auto agrees = [&](std::uint32_t stated, Size is) { return stated == 0 || is_near(is, whole(stated)); };
  if (!agrees(h.current_full_scale_ma, thousandths(s.current.gain, s.current_base)))
    return Disagreement::current_full_scale;
  // The amplifier's gain is a share of it per base: times full scale it is the base.
  const Size of_amplifier = s.amplifier.mantissa <= 0
                                ? Size{}
                                : Size::product(s.amplifier.mantissa, s.amplifier.exponent - fixed::kMantissaBits,
                                                h.amplifier_full_scale_ma, 0);
  const Size base =
      Size::of(static_cast<std::uint32_t>(s.current_base.mantissa), s.current_base.exponent - fixed::kMantissaBits)
          .thousandfold();
  if (h.amplifier_full_scale_ma != 0 && !is_near(of_amplifier, base)) return Disagreement::amplifier_full_scale;
  const Size limit = thousandths(s.current_limit.raw, s.current_base), most = whole(h.most_current_ma);
  if (h.most_current_ma != 0 && is_above(limit, most) && !is_near(limit, most)) return Disagreement::most_current;
  if (s.has_torque_sensor && !agrees(h.torque_full_scale_mnm, thousandths(s.torque.gain, s.torque_base)))
    return Disagreement::torque_full_scale;
  if (!agrees(h.temperature_full_scale_mc, thousandths(s.temperature.gain, s.temperature_base)))
    return Disagreement::temperature_law;
  // A block without an offset reads zero at zero.
  const std::int32_t offset = s.temperature.offset.raw, zero = h.temperature_at_zero_mc;
  const auto size = static_cast<std::uint32_t>(zero < 0 ? -std::int64_t{zero} : zero);
  const bool same_zero =
      size == 0 ? offset == 0
                : (offset < 0) == (zero < 0) && is_near(thousandths(offset, s.temperature_base), whole(size));
  if (h.temperature_full_scale_mc != 0 && !same_zero) return Disagreement::temperature_law;
  if (s.has_output_encoder && h.output_encoder == SensorKind::none) return Disagreement::output_encoder;
  if (s.has_torque_sensor && h.torque_sensor == SensorKind::none) return Disagreement::torque_sensor;
  return Disagreement::none;
}

}  // namespace flexspline::control
