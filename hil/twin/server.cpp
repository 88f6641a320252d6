#include "hil/twin/server.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "firmware/update_watch.hpp"
#include "hil/board/scenario.hpp"
#include "hil/plant/parameters.hpp"
#include "hil/twin/line.hpp"
#include "hil/twin/link_fault.hpp"
#include "hil/twin/machine.hpp"
#include "hil/twin/twin_drive.hpp"
#include "hil/twin/usb_line.hpp"

namespace flexspline::twin {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint32_t kTickHz = board::SoftwareBoard::kTickHz;

constexpr auto kAfterDetach = std::chrono::milliseconds(100);  // so that the host receives its answer
constexpr auto kWatchdog = std::chrono::milliseconds(200);

TwinSetup setup_of(const TwinOptions& options) {
  TwinSetup setup;
  setup.drive = options.plant_file.empty() ? plant::demo_plant().drive : plant::load_plant(options.plant_file).drive;
  for (const std::string& effect : options.with) plant::with(setup.drive, effect);
  if (!options.hide.empty()) plant::hide(setup.drive, options.hide);
  setup.serial = options.serial;
  setup.seed = options.seed;
  setup.as_made = !options.empty;
  setup.locked = options.locked;
  setup.three_phase = options.motor == "three-phase";
  if (options.motor_seed == 0 && options.wiring_fault.empty() && options.motor_ripple.empty()) return setup;
  if (!setup.three_phase)
    throw std::runtime_error("--motor-seed, --wiring-fault and --motor-ripple need --motor three-phase");
  setup.motor = options.motor_seed == 0 ? board::three_phase_of(setup.drive)
                                        : board::drawn_motor(setup.drive, options.motor_seed);
  if (!options.wiring_fault.empty() && !board::add_wiring_fault(*setup.motor, options.wiring_fault))
    throw std::runtime_error(fmt::format("there is no wiring fault '{}'; there are {}", options.wiring_fault,
                                         fmt::join(board::wiring_fault_names(), ", ")));
  if (!options.motor_ripple.empty() &&
      !board::add_motor_ripple(*setup.motor, options.motor_ripple, options.motor_ripple_size, options.seed))
    throw std::runtime_error(fmt::format("there is no cause of ripple '{}'; there are {}", options.motor_ripple,
                                         fmt::join(board::motor_ripple_names(), ", ")));
  return setup;
}

std::unique_ptr<HostLine> line_of(const TwinOptions& options) {
  if (options.inherits) return std::make_unique<Line>(Line::inherited(STDIN_FILENO));
  if (options.pty) return std::make_unique<Line>(Line::terminal());
  if (options.usbip >= 0) return std::make_unique<UsbLine>(options.usbip, options.serial);
  return std::make_unique<Line>(Line::listening(std::max(options.port, 0), options.token));
}

// Its address, for a person or for a program.
void write_address(const TwinOptions& options, const HostLine& line) {
  const auto* usb = dynamic_cast<const UsbLine*>(&line);
  if (options.json_file != "-") {
    if (usb != nullptr)
      fmt::print("port {}\nattach with: sudo usbip --tcp-port {} attach -r 127.0.0.1 -b {}\n", usb->port(), usb->port(),
                 UsbLine::kBusId);
    fmt::print("drive {} at {}\n", options.serial, line.name());
  }
  // Neither a serial number nor a name has characters that JSON escapes.
  const std::string json =
      fmt::format("{{\"format\": \"flexspline-twin/1\", \"serial\": \"{}\", \"drive\": \"{}\", \"usbip_port\": {}}}\n",
                  options.serial, line.name(), usb != nullptr ? std::to_string(usb->port()) : "null");
  if (options.json_file == "-") {
    fmt::print("{}", json);
  } else if (!options.json_file.empty()) {
    std::ofstream out(options.json_file);
    if (!(out << json << std::flush)) throw std::runtime_error(options.json_file + ": cannot be written");
  }
  std::fflush(stdout);
}

volatile std::sig_atomic_t asked_to_end = 0;
void note_signal(int) {
  asked_to_end = 1;
}

class Server {
 public:
  explicit Server(const TwinOptions& options)
      : options_(options),
        flash_(options.flash_file),
        pairing_(options.flash_file.empty() ? "" : options.flash_file + ".pairing"),
        setup_(setup_of(options)),
        line_(line_of(options)),
        link_fault_(options.link_fault_file) {
    setup_.flash = &flash_;
    setup_.pairing = &pairing_;
    usb_ = dynamic_cast<UsbLine*>(line_.get());
    if (usb_ != nullptr)
      machine_ =
          std::make_unique<Machine>(options.flash_file.empty() ? "" : options.flash_file + ".images", !options.empty);
    drive_ = std::make_unique<TwinDrive>(setup_);
    if (!options.inject.empty()) {
      injection_ = board::injection_named(options.inject);
      if (!injection_) throw std::runtime_error("there is no injection '" + options.inject + "'");
    }
  }

  void run() {
    if (!options_.inherits) write_address(options_, *line_);
    end_ = Clock::now() +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::max(options_.seconds, 0.0)));
    std::signal(SIGINT, note_signal);
    std::signal(SIGTERM, note_signal);
    if (machine_ == nullptr) return run_application(nullptr);
    // One iteration from each reset to the next.
    while (!over()) {
      if (!machine_->start()) {
        usb_->reconnect();
        machine_->serve_loader(usb_->bus(), UsbLine::kBusId, options_.serial, [this] { return over(); });
      } else if (machine_->hangs()) {
        usb_->reconnect();
        wait_for_watchdog();
      } else {
        setup_.version = machine_->version();
        drive_.reset();
        drive_ = std::make_unique<TwinDrive>(setup_);
        usb_->plug_in();
        Watch watch(machine_->slots(), kTickHz);
        run_application(&watch);
        machine_->request_loader();
        usb_->reconnect();
      }
    }
  }

 private:
  static constexpr std::uint32_t kBurst = 100;
  // An armed drive stops after 0.1 s without its host: an armed twin that runs fast waits for its host long before
  // that.
  static constexpr std::uint32_t kMostAhead = 1'000;
  // A host times its set points by the drive's time that it has received: the twin waits so that they arrive in time.
  // Otherwise each is late by the machine's delay, and the shaft overshoots its turning points.
  static constexpr std::uint32_t kMostAheadOfSetPoints = 200;

  using Watch = firmware::UpdateWatch<Machine::Slots>;

  bool over() const { return line_->ended() || asked_to_end != 0 || (options_.seconds > 0.0 && Clock::now() >= end_); }
  // Until the twin ends, or a host requests the boot loader.
  void run_application(Watch* watch) {
    due_ = Clock::now();
    std::optional<Clock::time_point> leaves_at;
    int wait_ms = 0;
    while (!over() && (!leaves_at || Clock::now() < *leaves_at)) {
      link_fault_.read_file();
      follow_link_fault();
      if (line_->transfer(wait_ms)) drive_->service().disconnected();
      // Waiting data of the drive are sent first, before room on the line counts as time to run.
      exchange();
      const std::uint32_t ticks = ticks_now();
      for (std::uint32_t i = 0; i < ticks; ++i) tick();
      exchange();
      if (watch != nullptr && watch->poll(drive_->status(), line_->has_host(), usb_->dfu()) && !leaves_at)
        leaves_at = Clock::now() + kAfterDetach;
      wait_ms = ticks > 0 && runs_fast() ? 0 : 1;
    }
  }
  void wait_for_watchdog() {
    const auto until = Clock::now() + kWatchdog;
    while (!over() && Clock::now() < until) usb_->bus().serve(5);
  }
  bool runs_fast() const { return options_.fast && is_live(drive_->status().mode) && line_->has_host(); }
  std::uint32_t most_ahead() const {
    const firmware::Mode mode = drive_->status().mode;
    const bool streams = mode == firmware::Mode::position || mode == firmware::Mode::velocity;
    return streams ? kMostAheadOfSetPoints : kMostAhead;
  }
  void follow_link_fault() {
    if (link_fault_.plugged() == std::exchange(was_plugged_, link_fault_.plugged())) return;
    line_->plug(link_fault_.plugged());
    drive_->service().disconnected();
  }
  std::uint32_t ticks_now() {
    const auto now = Clock::now();
    if (runs_fast()) {
      due_ = now;
      if (since_message_ >= most_ahead() || (!options_.lossy && !line_->has_room())) return 0;
      return kBurst;
    }
    const auto late = std::chrono::duration<double>(now - due_).count();
    // The machine was busy: lost time that cannot be recovered is dropped.
    if (late > 0.05) due_ = now - std::chrono::milliseconds(50);
    const auto ticks = static_cast<std::uint32_t>(std::max(0.0, std::floor(std::min(late, 0.05) * kTickHz)));
    due_ += std::chrono::nanoseconds(std::int64_t{1'000'000'000} / kTickHz * ticks);
    return ticks;
  }
  void tick() {
    drive_->tick();
    ++since_message_;
    if (injection_ && is_armed(drive_->status().mode) && ++armed_ticks_ == std::llround(options_.inject_at_s * kTickHz))
      drive_->rig().inject(*injection_);
    // Answers and frames are sent at once, so that the drive's ring fills as in a real drive.
    if (drive_->status().tick % 20 == 0) exchange();
  }
  void exchange() {
    for (const protocol::Message* m = line_->front(); m != nullptr && drive_->service().take(*m); m = line_->front()) {
      line_->drop();
      since_message_ = 0;
      link_fault_.count();
      if (!link_fault_.plugged()) break;
    }
    follow_link_fault();
    protocol::Message m;
    while (line_->has_room() && drive_->service().next(m)) line_->send(m);
  }

  TwinOptions options_;
  FlashFile flash_;
  PairingFile pairing_;
  TwinSetup setup_;
  std::unique_ptr<TwinDrive> drive_;
  std::unique_ptr<HostLine> line_;
  UsbLine* usb_ = nullptr;            ///< the line, where it is one
  std::unique_ptr<Machine> machine_;  ///< with it
  Clock::time_point due_{};
  Clock::time_point end_{};
  std::optional<board::Injection> injection_;
  std::uint32_t since_message_ = 0;
  std::int64_t armed_ticks_ = 0;
  LinkFault link_fault_;
  bool was_plugged_ = true;
};

}  // namespace

void run_twin(const TwinOptions& options) {
  Server(options).run();
}

}  // namespace flexspline::twin
