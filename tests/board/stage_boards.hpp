// The boards with three half bridges, as their own papers have them.
#pragma once

#include <algorithm>
#include <string>

#include "tests/board/stage_host.hpp"

namespace flexspline::tests {

// RM0390 and the schematic of the X-NUCLEO-IHM08M1: shunts of 10 milliohm, amplifiers of 5.182 about 1.71 V, which fall
// with a current into the motor; a divider of 169 and 9.31 kiloohm at the bus.
inline StageWiring nucleo(const std::string& name = "ihm08m1") {
  StageWiring w;
  w.image = std::string(FLEXSPLINE_BOARDS) + "/nucleo_ihm08m1/" + name + ".elf";
  w.written = {.address = 0x08020000,
               .sectors = {{5, 0, 0x20000}, {6, 0x20000, 0x20000}, {7, 0x40000, 0x20000, false}}};
  w.currents = {0, 11, 10};
  w.full_scale_a = 1.65 / (0.01 * 5.1818);
  w.zero_share = 1.71 / 1.65 - 1.0;
  w.currents_fall = true;
  w.bus = 1;
  w.bus_full_scale_v = 3.3 * (169.0 + 9.31) / 9.31;
  w.temperature = 12;
  w.temperature_share = 4.7 / (10.0 + 4.7);  // 25 degrees Celsius
  return w;
}
struct NucleoBench : StageBench {
  explicit NucleoBench(const std::string& name = "ihm08m1", const motor::MotorParameters& motor = some_motor(),
                       const motor::ShaftParameters& shaft = {}, const motor::WiringParameters& wires = {})
      : StageBench(nucleo(name), motor, inverter_of_24_v(), shaft, wires) {}
};
// Schematic and sources of the ODrive v3.6: shunts of 0.5 milliohm in legs B and C, a divider by 19 at the bus.
inline StageWiring odrive() {
  StageWiring w;
  w.image = std::string(FLEXSPLINE_BOARDS) + "/odrive_v36/odrive.elf";
  w.written = {
      .address = 0x08004000,
      .sectors = {{1, 0, 0x4000}, {2, 0x4000, 0x4000}, {3, 0x8000, 0x4000, false}, {4, 0xC000, 0x10000, false}}};
  w.channels = {1, 2, 3};
  w.currents = {0, 10, 11};
  w.has_shunt = {false, true, true};
  w.full_scale_a = 1.65 / (40.0 * 0.5e-3);
  w.bus = 6;
  w.bus_full_scale_v = 62.7;
  w.temperature = 15;
  w.temperature_share = 3.3 / (10.0 + 3.3);  // 25 degrees Celsius
  w.counts = 8192;
  return w;
}
struct OdriveBench : StageBench {
  explicit OdriveBench(const motor::MotorParameters& motor = some_motor(), const motor::ShaftParameters& shaft = {},
                       double supply_v = 24.0, const motor::WiringParameters& wires = {})
      : StageBench(odrive(), motor, inverter(supply_v), shaft, wires) {
    driver_is_on = [this] { return chip.spi3.is_good(); };
    encoder = [this](std::uint32_t counts) {
      chip.tim3.move_to(counts);
      chip.ports[3].words[0x10] = chip.spi3.is_good() ? 1U << 2 : 0U;  // its fault line
    };
    chip.ports[3].words[0x10] = 1U << 2;
  }
  static motor::InverterParameters inverter(double supply_v) {
    motor::InverterParameters i = inverter_of_24_v();
    i.supply_v = supply_v;
    i.dead_time_s = 0.24e-6;
    return i;
  }
  // Shares of the period of both switches of the brake resistor, and the time from one's end to the other's begin.
  double brake_high() const { return std::max(0.0, 1.0 - double(chip.tim2.at(0x40)) / chip.tim2.at(0x2C)); }
  double brake_gap_us() const {
    return (double(chip.tim2.at(0x40)) - double(chip.tim2.at(0x3C))) / (2.0 * chip.clock.apb1_hz()) * 1e6;
  }
};

}  // namespace flexspline::tests
