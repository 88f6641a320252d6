// Files, exit and text output through a debugger or an emulator (Arm's semihosting).
#pragma once

#include <cstddef>
#include <cstdint>

namespace flexspline::qemu {

class HostFile {
 public:
  enum class For : std::uint32_t { reading = 1, writing = 5 };  // "rb" and "wb"

  HostFile(const char* name, std::size_t length, For what);
  bool is_open() const { return handle_ >= 0; }
  // Reads everything or returns false. A pipe may deliver the data in pieces.
  bool read(void* to, std::size_t bytes) const;
  bool write(const void* from, std::size_t bytes) const;

 private:
  std::int32_t handle_;
};

void print(const char* text);  // ends with a zero
[[noreturn]] void leave(std::uint32_t exit_code);

}  // namespace flexspline::qemu
