#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>

#include "hil/board/brain.hpp"

namespace flexspline::board {

/// The application as a firmware image on an emulated processor (boards/qemu_stm32f405), in lock step over two pipes.
/// The emulator's clock is the number of instructions, so it gives the same bits in every run.
class Processor : public Brain {
 public:
  /// Throws std::runtime_error where the image or the emulator is not there.
  explicit Processor(std::filesystem::path image);
  ~Processor() override;
  Processor(const Processor&) = delete;
  Processor& operator=(const Processor&) = delete;

  void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) override;
  firmware::LockStepUp tick(const firmware::LockStepDown& down) override;
  void offer(std::span<const std::byte> block) override;
  /// Switches it off and returns the image's exit code: 0 when it ended as it was told to.
  int stop();

  static bool is_installed();
  /// Most instructions that one control tick took so far.
  std::uint32_t most_instructions() const { return most_instructions_; }
  /// Of all ticks so far, on average.
  double mean_instructions() const { return ticks_ > 0 ? static_cast<double>(instructions_) / ticks_ : 0.0; }
  /// Most of the stack that was ever in use; known after stop().
  std::uint32_t stack_bytes() const { return stack_bytes_; }

 private:
  void end();
  void send(const void* bytes, std::size_t count);
  void receive(void* bytes, std::size_t count);
  [[noreturn]] void fail(const char* what);

  std::filesystem::path image_;
  std::filesystem::path folder_;
  pid_t child_ = -1;
  int down_ = -1;
  int up_ = -1;
  std::uint32_t most_instructions_ = 0;
  std::uint32_t stack_bytes_ = 0;
  std::uint64_t instructions_ = 0;
  std::uint32_t ticks_ = 0;
};

}  // namespace flexspline::board
