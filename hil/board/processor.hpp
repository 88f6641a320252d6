#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>

#include "hil/board/controller.hpp"

namespace flexspline::board {

/// The application as a firmware image on an emulated processor (boards/qemu_stm32f405), in co-simulation over two
/// pipes. The emulator's clock is the number of instructions, so it gives the same bits in every run.
class Processor : public Controller {
 public:
  /// Throws std::runtime_error where the image or the emulator is not there.
  explicit Processor(std::filesystem::path image);
  ~Processor() override;
  Processor(const Processor&) = delete;
  Processor& operator=(const Processor&) = delete;

  void start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause cause) override;
  firmware::CoSimulationOutput tick(const firmware::CoSimulationInput& input) override;
  void offer(std::span<const std::byte> block) override;
  /// Switches it off and returns the image's exit code: 0 for a normal end.
  int stop();

  static bool is_installed();
  /// The largest number of instructions of a control tick so far.
  std::uint32_t most_instructions() const { return most_instructions_; }
  /// Mean over all ticks so far.
  double mean_instructions() const { return ticks_ > 0 ? static_cast<double>(instructions_) / ticks_ : 0.0; }
  /// The largest use of the stack; known after stop().
  std::uint32_t stack_bytes() const { return stack_bytes_; }

 private:
  void end();
  void send(const void* bytes, std::size_t count);
  void receive(void* bytes, std::size_t count);
  [[noreturn]] void fail(const char* what);

  std::filesystem::path image_;
  std::filesystem::path folder_;
  pid_t child_ = -1;
  int to_image_ = -1;
  int from_image_ = -1;
  std::uint32_t most_instructions_ = 0;
  std::uint32_t stack_bytes_ = 0;
  std::uint64_t instructions_ = 0;
  std::uint32_t ticks_ = 0;
};

}  // namespace flexspline::board
