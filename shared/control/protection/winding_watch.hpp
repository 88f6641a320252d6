// Whether a motor answers to its currents and voltages as its model does, while it runs.
//
// Lost phase, by the errors of the reference currents (Estima and Marques Cardoso, "A New Algorithm for Real-Time
// Multiple Open-Circuit Fault Diagnosis in Voltage-Fed PWM Motor Drives by the Reference Current Errors", IEEE Trans.
// Ind. Electronics 60(8), 2013), here with mean magnitudes. Of each phase x, over the filter's time constant:
//   E = mean |set point of the phase|, M = mean |its current|
//   lost: E > least, M < E/4, for a number of samples
// A motor at the end of its voltage does not carry its set point either, but then no phase does. So either the other
// two phases carry at least half of theirs, or the back-EMF is below half of the voltage, which cannot hold a current
// back.
//
// Voltage that the model does not explain: the current loop adds the voltage of the model (R i, L di/dt, decoupling,
// back-EMF; current_control.hpp) and a PI part. In steady state its integral is the residual of the voltage equation
//   r = u - (R i + j w L i + j w flux)
// A short between phases, a wrong angle of the field or another motor show in it. What R is off by (temperature) is a
// voltage R `resistance_error`, what the dead time leaves is `lost_voltage`; the flux is off by less than a quarter:
//   residual: |r_d| or |r_q| > R resistance_error + lost_voltage + w flux/4, for a number of samples
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/control/foc/field_oriented.hpp"

namespace flexspline::control::protection {

struct WindingSettings {
  std::int32_t least_current = INT32_MAX;  // of E, 2^-27 of the current's base
  std::int32_t resistance_error = 0;       // largest current times the relative error of R, 2^-27
  std::int32_t lost_voltage = INT32_MAX;   // 2^-30 of the bus voltage's full scale
  // PWM periods a sample, at most kEvery. A drive has other checks of its current, of a few milliseconds: at 20 kHz two
  // name the cause before them.
  std::uint32_t every = 4;
};
enum class WindingFault : std::uint8_t { none, phase_lost, residual };

class WindingWatch {
 public:
  static constexpr std::uint32_t kEvery = 4;
  // What both faults take at most, with a set point of the lost phase that stays above its threshold and a residual
  // that stays above its own.
  static constexpr std::uint32_t kLostPeriods = 128;
  static constexpr std::uint32_t kResidualPeriods = 260;

  constexpr void reset() { *this = {}; }
  // Once a PWM period, after foc::update with the same inputs. `phases`: as it measured them.
  constexpr WindingFault update(const WindingSettings& s, const foc::Settings& c, const foc::State& state,
                                const foc::Inputs& in, const foc::Outputs& out, const foc::Phases& phases) {
    if (++period_ < s.every) return WindingFault::none;
    period_ = 0;
    const std::int32_t emf =
        size(fixed::multiply_high(c.current.flux, foc::saturated_signed<foc::kStepBits>(in.step) * 8));
    if (is_lost(s, in, phases, emf < out.most / 2)) return WindingFault::phase_lost;
    const std::int32_t most = fixed::multiply_high(c.current.d.resistance, s.resistance_error) +
                              (s.lost_voltage >> c.current.voltage_exponent) + emf / 4;
    const bool unexplained = size(integral(state.current.d)) > most || size(integral(state.current.q)) > most;
    residual_samples_ = unexplained ? residual_samples_ + 1 : 0;
    return residual_samples_ >= kResidualSamples ? WindingFault::residual : WindingFault::none;
  }
  // 1 to 3, of a phase that is lost.
  constexpr std::uint8_t phase() const { return phase_; }

 private:
  static constexpr int kFilterBits = 3;  // of the means: 8 samples, 32 periods
  // A mean falls to a quarter within 11 samples.
  static constexpr std::uint32_t kLostSamples = 20;
  static constexpr std::uint32_t kResidualSamples = 64;

  static constexpr std::int32_t size(std::int32_t x) { return x < 0 ? -x : x; }
  static constexpr std::int32_t integral(const foc::AxisState& s) {
    return static_cast<std::int32_t>(s.integral >> 32);
  }
  constexpr bool is_lost(const WindingSettings& s, const foc::Inputs& in, const foc::Phases& phases, bool has_voltage) {
    const foc::Rotation at = foc::rotation(in.angle);
    const foc::RotorVector set = {foc::saturated_signed<foc::kCurrentBits>(in.set_point.d),
                                  foc::saturated_signed<foc::kCurrentBits>(in.set_point.q)};
    const foc::Phases quarter = foc::inverse_clarke(foc::inverse_park_quarter(set, at));
    const std::array<std::int32_t, 3> wanted = {quarter.a * 4, quarter.b * 4, quarter.c * 4};
    const std::array<std::int32_t, 3> measured = {phases.a, phases.b, phases.c};
    for (std::size_t x = 0; x < wanted.size(); ++x) {
      wanted_[x] += (size(wanted[x]) - wanted_[x]) >> kFilterBits;
      measured_[x] += (size(measured[x]) - measured_[x]) >> kFilterBits;
    }
    for (std::size_t x = 0; x < wanted.size(); ++x) {
      const std::size_t y = (x + 1) % 3, z = (x + 2) % 3;
      const bool others_carry = measured_[y] + measured_[z] > (wanted_[y] + wanted_[z]) / 2;
      const bool lost = wanted_[x] > s.least_current && measured_[x] < wanted_[x] / 4 && (others_carry || has_voltage);
      samples_[x] = lost ? samples_[x] + 1 : 0;
      if (samples_[x] < kLostSamples) continue;
      phase_ = static_cast<std::uint8_t>(x + 1);
      return true;
    }
    return false;
  }

  std::array<std::int32_t, 3> wanted_{};
  std::array<std::int32_t, 3> measured_{};
  std::array<std::uint32_t, 3> samples_{};
  std::uint32_t residual_samples_ = 0;
  std::uint32_t period_ = 0;
  std::uint8_t phase_ = 0;
};

}  // namespace flexspline::control::protection
