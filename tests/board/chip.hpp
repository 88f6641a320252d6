// A board around the emulated processor: its peripherals, and time, which passes in ticks of the drive and nowhere
// else.
#pragma once

#include <filesystem>

#include "tests/board/angle_sensor_models.hpp"
#include "tests/board/chip_models.hpp"
#include "tests/board/gate_driver_model.hpp"
#include "tests/board/machine.hpp"
#include "tests/board/otg_model.hpp"
#include "tests/board/power_models.hpp"

namespace flexspline::tests {

// What of the flash memory the image writes.
struct WrittenFlash {
  std::uint32_t address = 0x08004000;
  std::vector<FlashSector> sectors{{1, 0, 0x4000}, {2, 0x4000, 0x4000}, {4, 0xC000, 0x10000, false}};
};

// Where the linker script has the word that outlasts a reset.
inline constexpr std::uint32_t kHandover = 0x2001FFF0;

class Chip {
 public:
  explicit Chip(const std::filesystem::path& image, const WrittenFlash& written = {});

  // Start-up and the first turn of the main loop.
  Stop start() { return machine.run(); }
  // 50 us: TIM1 triggers the converter and then interrupts, the main loop turns once. With three half bridges:
  // period().
  Stop tick();
  Stop ticks(int n) {
    Stop stop = Stop::waits;
    for (int i = 0; i < n && stop == Stop::waits; ++i) stop = tick();
    return stop;
  }
  // The same of a chip with three half bridges: the world, the trigger of the converters, the current loop, and every
  // second time the tick.
  Stop period();
  Stop periods(int n) {
    Stop stop = Stop::waits;
    for (int i = 0; i < n && stop == Stop::waits; ++i) stop = period();
    return stop;
  }
  // What the drive's share of full scale would be of the DAC, where it is enabled.
  double command() const { return dac.at(0x08) / 2048.0 - 1.0; }

  Machine machine;
  ClockModel clock{machine};
  FlashModel flash;
  ConverterModel converter{machine, clock};
  AdvancedTimerModel tim1{machine};
  EncoderModel tim2, tim3{0xFFFF}, tim4{0xFFFF}, tim5;
  Registers dac, power;
  RandomModel random;
  WatchdogModel watchdog{machine};
  LineModel usart2, usart3;
  std::array<PortModel, 8> ports;
  OtgModel otg{machine};
  AngleSensorOnSpi spi1{machine, [this] { return !ports[2].high(4); }};
  // Selected by PC13, enabled by PB12.
  GateDriverModel spi3{machine, [this] { return !ports[2].high(13); }, [this] { return ports[1].high(12); }};
  AngleSensorOnI2c i2c1{machine};
  bool converter_is_dead = false, timer_is_dead = false, loop_is_late = false;
  bool loop_takes_a_period = false;  // the current loop: it ends after the timer's next top
  // The next period, with its current loop, comes after so many instructions of a tick; zero: after its end.
  std::uint64_t interrupts_tick_after = 0;
  int interrupted_ticks = 0;
  std::uint64_t loop_instructions = 0;  // of the current loop's interrupt in the last period, while they are counted
  bool is_within_tick = false;
  // What the world does before a tick, and what comes of it.
  std::function<void()> senses, acts;
};

}  // namespace flexspline::tests
