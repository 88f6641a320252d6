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

#include "hil/board/scenario.hpp"
#include "hil/plant/parameters.hpp"
#include "hil/twin/line.hpp"
#include "hil/twin/twin_drive.hpp"
#include "hil/twin/usb_line.hpp"

namespace flexspline::twin {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::uint32_t kTickHz = board::SoftwareBoard::kTickHz;

TwinSetup setup_of(const TwinOptions& options) {
  TwinSetup setup;
  setup.drive = options.plant_file.empty() ? plant::demo_plant().drive : plant::load_plant(options.plant_file).drive;
  for (const std::string& effect : options.with) plant::with(setup.drive, effect);
  if (!options.hide.empty()) plant::hide(setup.drive, options.hide);
  setup.flash_file = options.flash_file;
  setup.serial = options.serial;
  setup.seed = options.seed;
  setup.as_made = !options.empty;
  setup.locked = options.locked;
  return setup;
}

std::unique_ptr<HostLine> line_of(const TwinOptions& options) {
  if (options.inherits) return std::make_unique<Line>(Line::inherited(STDIN_FILENO));
  if (options.pty) return std::make_unique<Line>(Line::terminal());
  if (options.usbip >= 0) return std::make_unique<UsbLine>(options.usbip, options.serial);
  return std::make_unique<Line>(Line::listening(std::max(options.port, 0)));
}

// Where it is, for a person or for a program.
void say_where(const TwinOptions& options, const HostLine& line) {
  const auto* usb = dynamic_cast<const UsbLine*>(&line);
  if (options.json_file != "-") {
    if (usb != nullptr)
      fmt::print("port {}\nattach with: sudo usbip --tcp-port {} attach -r 127.0.0.1 -b {}\n", usb->port(), usb->port(),
                 UsbLine::kBusId);
    fmt::print("drive {} at {}\n", options.serial, line.name());
  }
  // Neither a serial number nor a name has letters that JSON writes otherwise.
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
      : options_(options), drive_(setup_of(options)), line_(line_of(options)), due_(Clock::now()) {
    if (!options.inject.empty()) {
      injection_ = board::injection_named(options.inject);
      if (!injection_) throw std::runtime_error("there is no injection '" + options.inject + "'");
    }
  }

  void run() {
    if (!options_.inherits) say_where(options_, *line_);
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(std::max(options_.seconds, 0.0)));
    std::signal(SIGINT, note_signal);
    std::signal(SIGTERM, note_signal);
    int wait_ms = 0;
    while (!line_->ended() && asked_to_end == 0 && (options_.seconds <= 0.0 || Clock::now() < end)) {
      if (line_->turn(wait_ms)) drive_.service().disconnected();
      // What waits in the drive takes its place on the line before that counts as room for more time.
      exchange();
      const std::uint32_t ticks = ticks_now();
      for (std::uint32_t i = 0; i < ticks; ++i) tick();
      exchange();
      wait_ms = ticks > 0 && runs_fast() ? 0 : 1;
    }
  }

 private:
  static constexpr std::uint32_t kBurst = 100;
  // An armed drive without its host for 0.1 s stops: an armed twin that runs fast waits for its host well before.
  static constexpr std::uint32_t kMostAhead = 1'000;

  bool runs_fast() const { return options_.fast && is_armed(drive_.status().mode) && line_->has_host(); }
  std::uint32_t ticks_now() {
    const auto now = Clock::now();
    if (runs_fast()) {
      due_ = now;
      if (since_message_ >= kMostAhead || (!options_.lossy && !line_->has_room())) return 0;
      return kBurst;
    }
    const auto late = std::chrono::duration<double>(now - due_).count();
    // A machine that was busy: time that cannot be made good is dropped.
    if (late > 0.05) due_ = now - std::chrono::milliseconds(50);
    const auto ticks = static_cast<std::uint32_t>(std::max(0.0, std::floor(std::min(late, 0.05) * kTickHz)));
    due_ += std::chrono::nanoseconds(std::int64_t{1'000'000'000} / kTickHz * ticks);
    return ticks;
  }
  void tick() {
    drive_.tick();
    ++since_message_;
    if (injection_ && is_armed(drive_.status().mode) && ++armed_ticks_ == std::llround(options_.inject_at_s * kTickHz))
      drive_.rig().inject(*injection_);
    // Answers and frames leave as they come, so that the drive's ring holds what a real one would.
    if (drive_.status().tick % 20 == 0) exchange();
  }
  void exchange() {
    for (const protocol::Message* m = line_->front(); m != nullptr && drive_.service().take(*m); m = line_->front()) {
      line_->drop();
      since_message_ = 0;
    }
    protocol::Message m;
    while (line_->has_room() && drive_.service().next(m)) line_->send(m);
  }

  TwinOptions options_;
  TwinDrive drive_;
  std::unique_ptr<HostLine> line_;
  Clock::time_point due_;
  std::optional<board::Injection> injection_;
  std::uint32_t since_message_ = 0;
  std::int64_t armed_ticks_ = 0;
};

}  // namespace

void run_twin(const TwinOptions& options) {
  Server(options).run();
}

}  // namespace flexspline::twin
