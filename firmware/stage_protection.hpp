// What switches a three-phase power stage off by itself, the periods within which it does, and the parts that a board
// may have: brake resistor, gate driver with a fault line, thermistor, bootstrap supplies. A part that a board has not
// costs it neither code nor memory.
#pragma once

#include <cstdint>
#include <type_traits>

#include "shared/control/foc/phase_currents.hpp"
#include "shared/control/protection/brake_chopper.hpp"
#include "shared/control/protection/thermistor.hpp"
#include "shared/control/protection/winding_watch.hpp"
#include "shared/protocol/states.hpp"

namespace flexspline::firmware {

using protocol::StageFault;

inline constexpr std::uint32_t kSumPeriods = 4;

// PWM periods from the first one that is sampled with the cause, until all switches are open; the drive has
// `amplifier_fault` at the next tick. Zero: it never switches on.
constexpr std::uint32_t periods_of(StageFault fault) {
  switch (fault) {
    case StageFault::bus_low:
    case StageFault::bus_high:
    case StageFault::overcurrent:
    case StageFault::driver:
      return 1;
    case StageFault::current_sum:
      return kSumPeriods;
    case StageFault::hot:
      return control::protection::Thermistor::kHotSamples;
    case StageFault::thermistor_open:
    case StageFault::thermistor_shorted:
      return control::protection::Thermistor::kWireSamples;
    case StageFault::phase_lost:
      return control::protection::WindingWatch::kLostPeriods;
    case StageFault::voltage_residual:
      return control::protection::WindingWatch::kResidualPeriods;
    case StageFault::none:
    case StageFault::sensor_zero:
      return 0;
  }
  return 0;
}

struct StageParts {
  bool brake = false;
  bool driver_fault = false;
  bool thermistor = false;
  bool bootstrap = false;
};
inline constexpr StageParts kAllStageParts{true, true, true, true};

struct ProtectionSettings {
  control::protection::ChopperSettings chopper;
  control::protection::ThermistorSettings thermistor;
  control::protection::WindingSettings winding;
  // Low sides on for so long before the first voltage: five time constants of the bootstrap supplies.
  std::uint32_t bootstrap_periods = 0;
};

namespace detail {
struct NoPart {};
template <bool kHas, class Part>
using PartOf = std::conditional_t<kHas, Part, NoPart>;
}  // namespace detail

// The parts that work whether the stage switches or not.
template <StageParts kParts>
class StageProtection {
 public:
  // Share of the period for the brake resistor, 2^-15.
  std::int32_t brake(const ProtectionSettings& s, std::int32_t bus) {
    if constexpr (kParts.brake) {
      return chopper_.update(s.chopper, bus);
    } else {
      return 0;
    }
  }
  // Once a PWM period.
  StageFault update(const ProtectionSettings& s, bool driver_fault, std::int32_t temperature) {
    if constexpr (kParts.driver_fault) {
      if (driver_fault) return StageFault::driver;
    }
    if constexpr (kParts.thermistor) {
      using control::protection::ThermistorFault;
      switch (thermistor_.update(s.thermistor, temperature)) {
        case ThermistorFault::none:
          break;
        case ThermistorFault::hot:
          return StageFault::hot;
        case ThermistorFault::open:
          return StageFault::thermistor_open;
        case ThermistorFault::shorted:
          return StageFault::thermistor_shorted;
      }
    }
    return StageFault::none;
  }
  // The line that resets the gate driver: for some periods, once each time that the stage is switched off.
  bool clears_driver(bool may_switch, bool driver_fault) {
    if constexpr (kParts.driver_fault) {
      return driver_.update(may_switch, driver_fault);
    } else {
      return false;
    }
  }
  // Whether the bootstrap supplies are charged; counts a period with all low sides on.
  bool charge(const ProtectionSettings& s) {
    if constexpr (kParts.bootstrap) {
      if (charged_.periods >= s.bootstrap_periods) return true;
      ++charged_.periods;
      return false;
    } else {
      return true;
    }
  }
  void discharge() {
    if constexpr (kParts.bootstrap) charged_ = {};
  }

 private:
  class DriverReset {
   public:
    bool update(bool may_switch, bool faulty) {
      if (may_switch) {
        asked_ = false;
        left_ = 0;
        return false;
      }
      if (faulty && !asked_) {
        asked_ = true;
        left_ = kResetPeriods;
      }
      if (left_ == 0) return false;
      --left_;
      return true;
    }

   private:
    static constexpr std::uint32_t kResetPeriods = 8;
    bool asked_ = false;
    std::uint32_t left_ = 0;
  };
  struct Charge {
    std::uint32_t periods = 0;
  };

  [[no_unique_address]] detail::PartOf<kParts.brake, control::protection::BrakeChopper> chopper_;
  [[no_unique_address]] detail::PartOf<kParts.thermistor, control::protection::Thermistor> thermistor_;
  [[no_unique_address]] detail::PartOf<kParts.driver_fault, DriverReset> driver_;
  [[no_unique_address]] detail::PartOf<kParts.bootstrap, Charge> charged_;
};

}  // namespace flexspline::firmware
