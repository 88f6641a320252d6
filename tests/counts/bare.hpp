// What a program needs to run on a bare machine in QEMU: text out, an end, and on Cortex-M a counter of instructions.
#pragma once

#include <cstdint>

namespace flexspline::bare {

void print(const char* text);
void print(std::uint32_t number);  // decimal
void print_hex(std::uint64_t number);
[[noreturn]] void stop(int code);

// Instructions since the counter was started, where one tick of the machine is one instruction (QEMU's -icount shift=0
// with TIM2 of its STM32F405, which counts at 1 GHz).
void start_counter();
inline std::uint32_t counted() {
  asm volatile("" ::: "memory");
  const std::uint32_t now = *reinterpret_cast<volatile std::uint32_t*>(0x40000024);
  asm volatile("" ::: "memory");
  return now;
}

}  // namespace flexspline::bare

int main();
