#include "tests/counts/bare.hpp"

#include <cstddef>

extern "C" {
extern std::uint32_t data_begin, data_end, data_load, bss_begin, bss_end, stack_top;
extern void (*init_array_begin[])();
extern void (*init_array_end[])();
[[noreturn]] void start();
void reset();
}

namespace flexspline::bare {
namespace {

#if defined(__riscv)
void write(const char* text) {
  auto* const uart = reinterpret_cast<volatile std::uint8_t*>(0x10000000);
  for (; *text != 0; ++text) *uart = static_cast<std::uint8_t>(*text);
}
#else
// Semihosting: a call to the debugger, which QEMU answers.
std::uint32_t call(std::uint32_t operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}
void write(const char* text) {
  constexpr std::uint32_t kWrite0 = 4;
  call(kWrite0, text);
}
#endif

}  // namespace

void print(const char* text) {
  write(text);
}
void print(std::uint32_t number) {
  char digits[11];
  char* at = digits + 10;
  *at = 0;
  do *--at = static_cast<char>('0' + number % 10);
  while ((number /= 10) != 0);
  write(at);
}
void print_hex(std::uint64_t number) {
  char digits[17];
  for (int i = 15; i >= 0; --i, number >>= 4) digits[i] = "0123456789abcdef"[number & 15];
  digits[16] = 0;
  write(digits);
}
void stop(int code) {
#if defined(__riscv)
  auto* const finisher = reinterpret_cast<volatile std::uint32_t*>(0x100000);
  *finisher = code == 0 ? 0x5555 : (static_cast<std::uint32_t>(code) << 16 | 0x3333);
#else
  constexpr std::uint32_t kExitExtended = 0x20, kApplicationExit = 0x20026;
  const std::uint32_t block[2] = {kApplicationExit, static_cast<std::uint32_t>(code)};
  call(kExitExtended, block);
#endif
  for (;;) {
  }
}
void start_counter() {
  auto* const timer = reinterpret_cast<volatile std::uint32_t*>(0x40000000);
  timer[0x2c / 4] = 0xFFFFFFFF;  // ARR
  timer[0x14 / 4] = 1;           // EGR
  timer[0] = 1;                  // CR1
}

}  // namespace flexspline::bare

extern "C" {

#if defined(__riscv)
// There is no C library; compilers call these for copies of structures.
void* memcpy(void* to, const void* from, std::size_t bytes) {
  auto* t = static_cast<volatile char*>(to);
  auto* f = static_cast<const char*>(from);
  while (bytes-- != 0) *t++ = *f++;
  return to;
}
void* memset(void* to, int value, std::size_t bytes) {
  auto* t = static_cast<volatile char*>(to);
  while (bytes-- != 0) *t++ = static_cast<char>(value);
  return to;
}
#endif

// What the host notes about coefficients is thread_local; one thread has its place here.
alignas(8) char thread_storage[64];
#if !defined(__riscv)
void* __aeabi_read_tp() {
  return thread_storage;
}
#endif

void start() {
  for (std::uint32_t *to = &data_begin, *from = &data_load; to != &data_end; ++to, ++from) *to = *from;
  for (std::uint32_t* to = &bss_begin; to != &bss_end; ++to) *to = 0;
  for (auto* f = init_array_begin; f != init_array_end; ++f) (*f)();
  flexspline::bare::stop(main());
}

#if defined(__riscv)
[[gnu::section(".vectors"), gnu::naked]] void reset() {
  asm volatile("la sp, stack_top\n j start");
}
#else
void reset() {
#if defined(__VFP_FP__) && !defined(__SOFTFP__)
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xF << 20;  // the floating-point unit, for the peers
  asm volatile("dsb\n isb");
#endif
  start();
}
[[noreturn]] void fault() {
  flexspline::bare::print("fault\n");
  flexspline::bare::stop(3);
}
struct Vectors {
  const void* stack;
  void (*handlers[15])();
};
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors = {
    &stack_top,
    {reset, fault, fault, fault, fault, fault, nullptr, nullptr, nullptr, nullptr, fault, fault, nullptr, fault,
     fault}};
#endif
}
