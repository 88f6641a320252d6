// From reset to main(): what the linker script lays out, and nothing that waits for hardware. A board brings its table
// of vectors and Unexpected_Handler().
#include <cstdint>

// Start-up code calls main(), which ISO C++ forbids elsewhere.
#pragma GCC diagnostic ignored "-Wpedantic"

namespace {
constexpr std::uint32_t kPaint = 0xA5A5A5A5;
}  // namespace

extern "C" {
extern std::uint32_t stack_bottom[], stack_top[], data_start[], data_end[], data_load[], bss_start[], bss_end[];
using Constructor = void (*)();
extern const Constructor constructors_start[], constructors_end[];

int main();
[[noreturn]] void Unexpected_Handler();

// None of its loops may become a call of memset(): it would paint over the frame of that call.
[[noreturn, gnu::optimize("no-tree-loop-distribute-patterns")]] void Reset_Handler() {
  const std::uint32_t* from = data_load;
  for (std::uint32_t* to = data_start; to < data_end; ++to) *to = *from++;
  for (std::uint32_t* to = bss_start; to < bss_end; ++to) *to = 0;
  // What is still painted at the end was never used; this function's own frame is above.
  std::uint32_t* own = nullptr;
  asm volatile("mov %0, sp" : "=r"(own));
  for (std::uint32_t* word = stack_bottom; word < own; ++word) *word = kPaint;
  for (const Constructor* c = constructors_start; c < constructors_end; ++c) (*c)();
  main();
  Unexpected_Handler();
}
std::uint32_t used_stack_bytes() {
  const std::uint32_t* word = stack_bottom;
  while (word < stack_top && *word == kPaint) ++word;
  return static_cast<std::uint32_t>(stack_top - word) * 4;
}
}
