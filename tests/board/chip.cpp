#include "tests/board/chip.hpp"

#include <utility>

namespace flexspline::tests {

Chip::Chip(const std::filesystem::path& image, const WrittenFlash& written)
    : machine(image), flash(machine, clock, written.sectors) {
  machine.is_clocked = [this](std::uint32_t address) { return clock.gate(address); };
  machine.attach(0x40023800, clock);
  machine.attach(0x40023C00, flash);
  const auto bytes = static_cast<std::uint32_t>(flash.bytes.size());
  machine.attach_memory(written.address, bytes, flash.cells);
  // The slot of a download, which the application looks at.
  if (written.address + bytes <= 0x08020000) machine.map_erased(0x08040000, 0x20000);
  machine.attach(0x40012000, converter);
  machine.attach(0x40010000, tim1);
  machine.attach(0x40000000, tim2);
  machine.attach(0x40000400, tim3);
  machine.attach(0x40000800, tim4);
  machine.attach(0x40000C00, tim5);
  machine.attach(0x40003000, watchdog);
  machine.attach(0x40003C00, spi3);
  machine.attach(0x40004400, usart2);
  machine.attach(0x40004800, usart3);
  machine.attach(0x40005400, i2c1);
  machine.attach(0x40007000, power);
  machine.attach(0x40013000, spi1);
  machine.attach(0x40007400, dac);
  for (std::uint32_t i = 0; i < ports.size(); ++i) machine.attach(0x40020000 + 0x400 * i, ports[i]);
  machine.attach(0x50000000, otg, 0x5000);
  machine.attach(0x50060800, random);
  for (std::uint32_t& input : converter.inputs) input = 2048;
}

Stop Chip::tick() {
  if (tim1.triggers_by_compare4()) return period();
  constexpr std::uint32_t kTickInterrupt = 27;
  if (senses) senses();
  usart2.pass();
  usart3.pass();
  watchdog.pass(50e-6);
  if (machine.ticks_itself()) {
    const Stop stop = machine.interrupt(15);
    if (stop != Stop::waits) return stop;
  }
  if (tim1.triggers() && !converter_is_dead) converter.trigger();
  if (!timer_is_dead && tim1.reach_compare4() && machine.interrupt_is_enabled(kTickInterrupt)) {
    const Stop stop = machine.interrupt(16 + kTickInterrupt);
    if (stop != Stop::waits) return stop;
  }
  if (acts) acts();
  return machine.run();
}

Stop Chip::period() {
  constexpr std::uint32_t kWatch = 27, kConverted = 18, kTick = 14;
  usart2.pass();
  usart3.pass();
  watchdog.pass(50e-6);
  if (senses) senses();
  tim1.counts_down = false;
  if (!timer_is_dead && tim1.reach_compare4() && machine.interrupt_is_enabled(kWatch)) {
    const Stop stop = machine.interrupt(16 + kWatch);
    if (stop != Stop::waits) return stop;
  }
  if (tim1.triggers_by_compare4() && !converter_is_dead) converter.trigger();
  tim1.counts_down = !loop_is_late;
  if (loop_takes_a_period) tim1.reach_compare4();
  if (converter.interrupts() && machine.interrupt_is_enabled(kConverted)) {
    const std::uint64_t before = machine.instructions();
    const Stop stop = machine.interrupt(16 + kConverted);
    loop_instructions = machine.instructions() - before;
    if (stop != Stop::waits) return stop;
  }
  if (machine.tick_is_requested()) {
    const std::uint64_t after = std::exchange(interrupts_tick_after, 0);
    const Stop stop = after == 0 ? machine.interrupt(kTick) : machine.interrupted_interrupt(kTick, after, [this] {
      ++interrupted_ticks;
      is_within_tick = true;
      const Stop other = period();
      is_within_tick = false;
      return other;
    });
    if (stop != Stop::waits) return stop;
  }
  if (acts) acts();
  return is_within_tick ? Stop::waits : machine.run();
}

}  // namespace flexspline::tests
