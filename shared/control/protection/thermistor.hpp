// Temperature of a power stage by a thermistor (NTC) in a divider: a table over the converter's reading, which the host
// makes from the beta equation 1/T = 1/T25 + ln(R/R25)/beta, piecewise linear between its points. A reading beyond
// either end of the range is a wire that is open, or shorted.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace flexspline::control::protection {

inline constexpr int kThermistorStepBits = 9;
inline constexpr std::size_t kThermistorPoints = (std::size_t{1} << (15 - kThermistorStepBits)) + 1;
inline constexpr int kCelsiusBits = 7;  // a temperature is in 2^-7 degrees Celsius

struct ThermistorSettings {
  std::array<std::int16_t, kThermistorPoints> celsius{};  // at readings of k 2^9
  // Readings beyond these are faults; which one is an open wire depends on the divider.
  std::int32_t least = 0;
  std::int32_t most = INT16_MAX;
  bool opens_upwards = true;         // the thermistor is on the side of ground
  std::int32_t limit = INT16_MAX;    // too hot
  std::int32_t restart = INT16_MAX;  // no longer
};

// Of a reading from zero to 2^15 - 1.
constexpr std::int32_t celsius(const ThermistorSettings& s, std::int32_t reading) {
  constexpr std::int32_t kStep = 1 << kThermistorStepBits;
  const auto point = static_cast<std::size_t>(reading) >> kThermistorStepBits;
  const std::int32_t rest = reading & (kStep - 1), from = s.celsius[point], to = s.celsius[point + 1];
  return from + (((to - from) * rest + kStep / 2) >> kThermistorStepBits);
}

enum class ThermistorFault : std::uint8_t { none, hot, open, shorted };
// A cause has to last for the stated number of samples.
class Thermistor {
 public:
  static constexpr std::uint32_t kHotSamples = 256;
  static constexpr std::uint32_t kWireSamples = 64;

  constexpr ThermistorFault update(const ThermistorSettings& s, std::int32_t reading) {
    const bool below = reading<s.least, above = reading> s.most;
    wire_samples_ = below || above ? next(wire_samples_, kWireSamples) : 0;
    if (wire_samples_ >= kWireSamples)
      return above == s.opens_upwards ? ThermistorFault::open : ThermistorFault::shorted;
    if (below || above) return fault_;
    celsius_ = celsius(s, reading);
    hot_samples_ = celsius_ >= s.limit ? next(hot_samples_, kHotSamples) : 0;
    if (hot_samples_ >= kHotSamples) fault_ = ThermistorFault::hot;
    if (celsius_ < s.restart) fault_ = ThermistorFault::none;
    return fault_;
  }
  constexpr std::int32_t now() const { return celsius_; }

 private:
  static constexpr std::uint32_t next(std::uint32_t count, std::uint32_t most) {
    return count < most ? count + 1 : most;
  }
  std::int32_t celsius_ = 0;
  std::uint32_t hot_samples_ = 0;
  std::uint32_t wire_samples_ = 0;
  ThermistorFault fault_ = ThermistorFault::none;
};

}  // namespace flexspline::control::protection
