// The application on QEMU's model of an STM32F405 (machine netduinoplus2), in lock step with a drive that the desktop
// simulates: each tick of the timer takes the drive's samples from one pipe and hands back the current in another.
#include <cstddef>
#include <cstdint>
#include <span>

#include "boards/qemu_stm32f405/semihosting.hpp"
#include "firmware/application.hpp"
#include "firmware/lock_step.hpp"

namespace {

using flexspline::firmware::Actuation;
using flexspline::firmware::Application;
using flexspline::firmware::LockStepDown;
using flexspline::firmware::LockStepStart;
using flexspline::firmware::LockStepUp;
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

  Readings read() const { return down.readings; }
  void actuate(const Actuation& wanted) { actuation = wanted; }
  // The next tick is due already.
  bool tick_overrun() const { return down.overrun || (hardware(kInterruptState) & kSysTickPending) != 0; }
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

  LockStepDown down{.reads_frame = false};
  Actuation actuation{};
};

constexpr char kDown[] = "to_drive", kUp[] = "from_drive";
constexpr std::uint32_t kExitDone = 0, kExitNoDesktop = 2;
constexpr std::size_t kPageBytes = 16 * 1024;
[[gnu::section(".parameters")]] alignas(8) std::byte parameter_page[kPageBytes];

QemuBoard board;
constinit Application<QemuBoard> application;
const HostFile* down_pipe = nullptr;
const HostFile* up_pipe = nullptr;

}  // namespace

extern "C" std::uint32_t used_stack_bytes();

extern "C" void SysTick_Handler() {
  if (!down_pipe->read(&board.down, sizeof(board.down))) flexspline::qemu::leave(kExitNoDesktop);
  if (board.down.ends) {
    LockStepUp last;
    last.stack_bytes = used_stack_bytes();
    up_pipe->write(&last, sizeof(last));
    flexspline::qemu::leave(kExitDone);
  }
  LockStepUp up = flexspline::firmware::lock_step(application, board.down, QemuBoard::instructions);
  up.actuation = board.actuation;
  if (!up_pipe->write(&up, sizeof(up))) flexspline::qemu::leave(kExitNoDesktop);
}

[[gnu::cold]] int main() {
  const HostFile down(kDown, sizeof(kDown) - 1, HostFile::For::reading);
  const HostFile up(kUp, sizeof(kUp) - 1, HostFile::For::writing);
  LockStepStart start;
  if (!down.is_open() || !up.is_open() || !down.read(&start, sizeof(start)) || start.block_bytes > kPageBytes ||
      !down.read(parameter_page, start.block_bytes))
    flexspline::qemu::leave(kExitNoDesktop);
  down_pipe = &down;
  up_pipe = &up;
  application.begin(board);
  application.telemetry().configure(start.telemetry);
  if (start.block_bytes > 0) application.boot_with({parameter_page, start.block_bytes});
  QemuBoard::start_timers();
  for (;;) {
    application.background();
    asm volatile("wfi");
  }
}
