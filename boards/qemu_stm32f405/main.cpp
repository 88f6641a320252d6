// The application on QEMU's model of an STM32F405 (machine netduinoplus2), in co-simulation with a drive that the
// desktop simulates: each tick of the timer takes the drive's samples from one pipe and hands back the current in
// another.
#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/qemu_stm32f405/semihosting.hpp"
#include "firmware/application.hpp"
#include "firmware/co_simulation.hpp"

namespace {

using flexspline::firmware::Actuation;
using flexspline::firmware::Application;
using flexspline::firmware::CoSimulationInput;
using flexspline::firmware::CoSimulationOutput;
using flexspline::firmware::CoSimulationStart;
using flexspline::firmware::Readings;
using flexspline::firmware::ResetCause;
using flexspline::qemu::HostFile;

volatile std::uint32_t& hardware(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(static_cast<std::uintptr_t>(address));
}
constexpr std::uint32_t kSysTickControl = 0xE000E010, kSysTickReload = 0xE000E014, kSysTickCurrent = 0xE000E018;
constexpr std::uint32_t kInterruptState = 0xE000ED04, kSysTickPending = 1U << 26;
constexpr std::uint32_t kApb1Enable = 0x40023840, kTimer2Control = 0x40000000, kTimer2Event = 0x40000014,
                        kTimer2Count = 0x40000024, kTimer2Reload = 0x4000002C;
constexpr std::uint32_t kCoreHz = 168'000'000;

class QemuBoard {
 public:
  static constexpr std::uint32_t kTickHz = 20'000;
  static constexpr std::uint32_t kTelemetryWords = 2048;

  const Readings& read() const { return input.readings; }
  void actuate(const Actuation& command) { actuation = command; }
  // The next tick is due already.
  bool tick_overrun() const { return input.overrun || (hardware(kInterruptState) & kSysTickPending) != 0; }
  void feed_watchdog() {}  // the model has none
  ResetCause reset_cause() const { return ResetCause::power; }

  // TIM2 runs freely; in QEMU with -icount shift=0 it counts instructions.
  static void start_timers() {
    hardware(kApb1Enable) = hardware(kApb1Enable) | 1U;
    hardware(kTimer2Reload) = 0xFFFFFFFF;
    hardware(kTimer2Event) = 1;
    hardware(kTimer2Control) = 1;
    hardware(kSysTickReload) = kCoreHz / kTickHz - 1;
    hardware(kSysTickCurrent) = 0;
    hardware(kSysTickControl) = 7;  // on, with its interrupt, from the core's clock
  }
  static std::uint32_t instructions() { return hardware(kTimer2Count); }

  CoSimulationInput input{.reads_frame = false};
  Actuation actuation{};
};

constexpr char kInputPipe[] = "to_drive", kOutputPipe[] = "from_drive";
constexpr std::uint32_t kExitDone = 0, kExitNoDesktop = 2;
constexpr std::size_t kPageBytes = 16 * 1024;
[[gnu::section(".parameters")]] alignas(8) std::byte parameter_page[kPageBytes];

QemuBoard board;
constinit Application<QemuBoard> application;
const HostFile* input_pipe = nullptr;
const HostFile* output_pipe = nullptr;

}  // namespace

extern "C" std::uint32_t used_stack_bytes();

extern "C" void SysTick_Handler() {
  if (!input_pipe->read(&board.input, sizeof(board.input))) flexspline::qemu::leave(kExitNoDesktop);
  if (board.input.ends) {
    CoSimulationOutput last;
    last.stack_bytes = used_stack_bytes();
    output_pipe->write(&last, sizeof(last));
    flexspline::qemu::leave(kExitDone);
  }
  CoSimulationOutput output = flexspline::firmware::co_simulate(application, board.input, QemuBoard::instructions);
  output.actuation = board.actuation;
  if (!output_pipe->write(&output, sizeof(output))) flexspline::qemu::leave(kExitNoDesktop);
}

[[gnu::cold]] int main() {
  const HostFile input(kInputPipe, sizeof(kInputPipe) - 1, HostFile::For::reading);
  const HostFile output(kOutputPipe, sizeof(kOutputPipe) - 1, HostFile::For::writing);
  CoSimulationStart start;
  if (!input.is_open() || !output.is_open() || !input.read(&start, sizeof(start)) || start.block_bytes > kPageBytes ||
      !input.read(parameter_page, start.block_bytes))
    flexspline::qemu::leave(kExitNoDesktop);
  input_pipe = &input;
  output_pipe = &output;
  application.begin(board);
  application.telemetry().configure(start.telemetry);
  if (start.block_bytes > 0) application.boot_with({parameter_page, start.block_bytes});
  QemuBoard::start_timers();
  for (;;) {
    application.background();
    asm volatile("wfi");
  }
}
