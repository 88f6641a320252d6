// From reset to main(): the vector table, what the linker script lays out, and nothing that waits for hardware.
#include <cstddef>
#include <cstdint>

#include "boards/qemu_stm32f405/semihosting.hpp"

// A start-up calls main(), which no other code may.
#pragma GCC diagnostic ignored "-Wpedantic"

namespace {
constexpr std::uint32_t kPaint = 0xA5A5A5A5, kOwnFrameWords = 32;
using Word [[gnu::may_alias, gnu::aligned(1)]] = std::uint32_t;
}  // namespace

extern "C" {
extern std::uint32_t stack_bottom[], stack_top[], data_start[], data_end[], data_load[], bss_start[], bss_end[];
using Constructor = void (*)();
extern const Constructor constructors_start[], constructors_end[];

int main();
void SysTick_Handler();

[[noreturn]] void Reset_Handler() {
  const std::uint32_t* from = data_load;
  for (std::uint32_t* to = data_start; to < data_end; ++to) *to = *from++;
  for (std::uint32_t* to = bss_start; to < bss_end; ++to) *to = 0;
  // What is still painted at the end was never used; this function's own frame is at the top.
  for (std::uint32_t* word = stack_bottom; word + kOwnFrameWords < stack_top; ++word) *word = kPaint;
  for (const Constructor* c = constructors_start; c < constructors_end; ++c) (*c)();
  main();
  flexspline::qemu::leave(1);
}
// Any exception that has no business here.
[[noreturn]] void Unexpected_Handler() {
  flexspline::qemu::print("unexpected exception\n");
  flexspline::qemu::leave(3);
}
std::uint32_t used_stack_bytes() {
  const std::uint32_t* word = stack_bottom;
  while (word < stack_top && *word == kPaint) ++word;
  return static_cast<std::uint32_t>(stack_top - word) * 4;
}
// By words where both ends allow it. The library's take five hundred bytes of flash, for copies longer than any here.
[[gnu::used, gnu::optimize("no-tree-loop-distribute-patterns")]] void* memcpy(void* to, const void* from,
                                                                              std::size_t count) {
  auto* t = static_cast<unsigned char*>(to);
  const auto* f = static_cast<const unsigned char*>(from);
  // Cortex-M4 reads and writes words at any address.
  for (; count >= 4; count -= 4, t += 4, f += 4) *reinterpret_cast<Word*>(t) = *reinterpret_cast<const Word*>(f);
  for (; count > 0; --count) *t++ = *f++;
  return to;
}
[[gnu::used, gnu::optimize("no-tree-loop-distribute-patterns")]] void* memset(void* to, int value, std::size_t count) {
  auto* t = static_cast<unsigned char*>(to);
  const std::uint32_t word = 0x01010101U * static_cast<unsigned char>(value);
  for (; count >= 4; count -= 4, t += 4) *reinterpret_cast<Word*>(t) = word;
  for (; count > 0; --count) *t++ = static_cast<unsigned char>(value);
  return to;
}
// No object is ever destroyed.
int __aeabi_atexit(void*, void (*)(void*), void*) {
  return 0;
}
void* __dso_handle = nullptr;
}

namespace {
union Vector {
  std::uint32_t* stack;
  void (*handler)();
};
// The system exceptions; none of the board's interrupts is ever enabled.
[[gnu::section(".vectors"), gnu::used]] const Vector kVectors[16] = {
    {.stack = stack_top},
    {.handler = Reset_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = nullptr},
    {.handler = Unexpected_Handler},
    {.handler = Unexpected_Handler},
    {.handler = nullptr},
    {.handler = Unexpected_Handler},
    {.handler = SysTick_Handler},
};
}  // namespace
