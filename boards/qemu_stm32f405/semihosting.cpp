#include "boards/qemu_stm32f405/semihosting.hpp"

namespace flexspline::qemu {
namespace {

enum Operation : std::uint32_t { kOpen = 0x01, kPrint = 0x04, kWrite = 0x05, kRead = 0x06, kExit = 0x20 };

std::int32_t call(Operation operation, const void* arguments) {
  register std::uint32_t r0 asm("r0") = operation;
  register const void* r1 asm("r1") = arguments;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return static_cast<std::int32_t>(r0);
}
std::uint32_t word(const void* p) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(p));
}

// Both operations return the number of bytes that they did not transfer.
template <class Byte>
bool transfer(Operation operation, std::int32_t handle, Byte* bytes, std::size_t count) {
  while (count > 0) {
    const std::uint32_t arguments[] = {static_cast<std::uint32_t>(handle), word(bytes),
                                       static_cast<std::uint32_t>(count)};
    const std::int32_t left = call(operation, arguments);
    if (left < 0 || static_cast<std::size_t>(left) >= count) return false;
    bytes += count - static_cast<std::size_t>(left);
    count = static_cast<std::size_t>(left);
  }
  return true;
}

}  // namespace

HostFile::HostFile(const char* name, std::size_t length, For what) {
  const std::uint32_t arguments[] = {word(name), static_cast<std::uint32_t>(what), static_cast<std::uint32_t>(length)};
  handle_ = call(kOpen, arguments);
}
bool HostFile::read(void* to, std::size_t bytes) const {
  return transfer(kRead, handle_, static_cast<char*>(to), bytes);
}
bool HostFile::write(const void* from, std::size_t bytes) const {
  return transfer(kWrite, handle_, static_cast<const char*>(from), bytes);
}
void print(const char* text) {
  call(kPrint, text);
}
void leave(std::uint32_t exit_code) {
  const std::uint32_t arguments[] = {0x20026, exit_code};  // ADP_Stopped_ApplicationExit
  for (;;) call(kExit, arguments);
}

}  // namespace flexspline::qemu
