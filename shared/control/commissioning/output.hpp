// Samples to currents, wanted voltages to on-times, and the voltages that these really are.
#pragma once

#include <cstdint>

#include "shared/control/commissioning/settings.hpp"
#include "shared/control/foc/modulation.hpp"
#include "shared/control/foc/phase_currents.hpp"
#include "shared/control/foc/transforms.hpp"

namespace flexspline::control::commissioning {

// Once a PWM period, as field-oriented control has it (foc/field_oriented.hpp).
struct Inputs {
  foc::Phases readings;       // 2^-15 of full scale
  std::int32_t bus = 0;       // likewise
  std::uint32_t encoder = 0;  // of the rotor, 2^-32 turns
};
struct Outputs {
  foc::Phases counts;    // on-times of the high sides
  bool enabled = false;  // not: all switches are open
};

// One sample with the voltage that acted around it.
struct Sample {
  foc::Phases phases;
  foc::StatorVector current;
  foc::StatorVector voltage;
  std::int32_t bus = 0;  // 2^-15
  std::uint32_t encoder = 0;
  std::int32_t moved = 0;  // of the encoder since the last one
};

constexpr foc::RotorVector in_axes(const foc::StatorVector& x, const foc::Rotation& r) {
  const foc::RotorVector quarter = foc::park_quarter(x, r);
  return {quarter.d * 4, quarter.q * 4};
}
constexpr foc::StatorVector in_stator(const foc::RotorVector& x, const foc::Rotation& r) {
  const foc::StatorVector quarter = foc::inverse_park_quarter(x, r);
  return {quarter.alpha * 4, quarter.beta * 4};
}

class PowerOutput {
 public:
  constexpr void begin(const Settings& s) {
    per_count_ = (std::int32_t{1} << 28) / s.timer_counts;
    rest_ = s.timer_counts / 2;
    counts_ = {};
  }
  constexpr Sample sample(const foc::SensorSettings& sensors, const Inputs& in) {
    Sample s;
    s.phases = foc::phase_currents(sensors, in.readings, 0);
    s.current = foc::clarke(s.phases);
    s.bus = in.bus;
    // The on-times of the last period: rounded ones, so that no resolution of a timer is in what is measured.
    const foc::StatorVector share =
        foc::clarke({counts_.a * per_count_, counts_.b * per_count_, counts_.c * per_count_});
    s.voltage = {fixed::multiply_high(share.alpha, in.bus << 16) * 2,
                 fixed::multiply_high(share.beta, in.bus << 16) * 2};
    s.encoder = in.encoder;
    s.moved = static_cast<std::int32_t>(in.encoder - encoder_);
    encoder_ = in.encoder;
    return s;
  }
  // A voltage in 2^-28 of full scale.
  constexpr foc::Phases on_times(const Settings& s, const foc::StatorVector& voltage, std::int32_t bus) {
    const std::int32_t held_bus = bus < foc::kLeastBus ? foc::kLeastBus : bus;
    counts_ = foc::modulate(s.modulation, voltage, foc::per_bus(held_bus), {}).counts;
    return counts_;
  }
  // All legs the same, from zero to half.
  constexpr foc::Phases common(std::int32_t count) {
    counts_ = {count, count, count};
    return counts_;
  }
  constexpr std::int32_t rest() const { return rest_; }

 private:
  std::int32_t per_count_ = 0;
  std::int32_t rest_ = 0;
  foc::Phases counts_;
  std::uint32_t encoder_ = 0;
};

}  // namespace flexspline::control::commissioning
