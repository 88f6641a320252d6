// Bytes on a drive's serial line: messages, garbage, time that passes. Every request gets one answer that can be read,
// nothing arms a drive that has no parameters or is in a fault, and identify works at the end.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "firmware/service.hpp"
#include "shared/protocol/serial_frame.hpp"
#include "tests/support/flash_model.hpp"

namespace {

using namespace flexspline;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "drive_messages_fuzz: %s\n", what);
  std::abort();
}

// Sensors that are well and a shaft that stands.
struct Board {
  static constexpr std::uint32_t kTickHz = 20'000;
  static constexpr std::uint32_t kTelemetryWords = 256;
  firmware::Readings read() {
    ++readings.motor_samples, ++readings.output_samples, ++readings.analog_samples;
    readings.torque = static_cast<std::int16_t>(readings.motor_samples & 7);
    return readings;
  }
  void actuate(const firmware::Actuation& wanted) { actuation = wanted; }
  firmware::ThreePhaseStage* three_phase() { return &stage; }
  bool tick_overrun() const { return overruns; }
  void feed_watchdog() {}
  firmware::ResetCause reset_cause() const { return firmware::ResetCause::power; }

  firmware::Readings readings{};
  firmware::Actuation actuation{};
  bool overruns = false;
  firmware::ThreePhaseStage stage;
  bool switches = false;

  // Currents and encoder that stand still, and a bus voltage.
  Board() {
    firmware::ThreePhaseSettings s;
    s.foc.sensors.gain = {4096, 4096, 4096};
    s.foc.modulation.period = s.test_modulation.period = 8400;
    s.offsets = {3276, 1638};
    s.least_bus = 8192;
    s.most_phase = 1 << 26;
    s.pole_pairs = 0;
    s.encoder_counts = 4096;
    s.timer_counts = 2100;
    stage.begin(s);
  }
  void interrupt() { switches = stage.update({{0, 0, 0}, 24'000, 0}).enabled; }
};

constexpr std::size_t kSector = 4096;
using Application = firmware::Application<Board>;
using Flash = tests::FlashModel<kSector>;
using Store = storage::ParameterStore<Flash>;
using Blocks = firmware::ApplicationBlocks<Application, Board::kTickHz>;
constexpr std::size_t kPairingSector = 16'384;
using PairingFlash = tests::FlashModel<kPairingSector, 1>;
using Pairing = storage::PairingMemory<PairingFlash>;
using Lock = firmware::ParameterLock<Pairing, Board>;

struct Drive {
  tests::FlashCells<kSector> cells;
  Board board;
  Application application{board};
  Flash flash{cells};
  Store store{flash};
  Blocks blocks{application};
  tests::FlashCells<kPairingSector, 1> pairing_cells;
  PairingFlash pairing_flash{pairing_cells};
  Pairing pairing{pairing_flash};
  Lock lock{pairing, board};
  firmware::Service<Application, Store, Blocks, Lock> service{application, store, blocks, Board::kTickHz, {}, lock};
  std::uint64_t asked = 0, answered = 0;

  Drive() { service.start(); }
  void tick() {
    application.tick();
    board.interrupt();
    require(!board.switches || application.status().mode == protocol::Mode::commissioning,
            "the stage switches although the motor is not being measured");
    application.background();
    service.background();
    require(!board.actuation.enabled, "the amplifier is on without parameters");
    protocol::Message m;
    while (service.next(m)) {
      protocol::Message again;
      require(protocol::decode(protocol::encode(m), again), "it sends what is no message");
      if (m.is_unasked()) {
        require(protocol::for_each_frame(m, [](const auto&, auto, auto) {}), "it sends frames that are none");
      } else {
        require(m.is_answer(), "it sends a request");
        ++answered;
      }
    }
  }
  void take(const protocol::Message& m) {
    for (int i = 0; !service.take(m); ++i) {
      require(i < 100, "it takes no request any more");
      tick();
    }
    asked += m.is_request() ? 1 : 0;
    tick();
  }
};

}  // namespace

// The first byte says whether the drive is in a fault. Then bytes of the line; of each byte 0xFE a tick passes as
// well, and 0xFD says that the rest of up to 64 bytes is a message without its frame, so that checksums are no wall.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Drive* drive = nullptr;
  delete drive;
  drive = new Drive;
  for (int i = 0; i < 60; ++i) drive->tick();
  if (size == 0) return 0;
  if ((data[0] & 1) != 0) {
    drive->board.overruns = true;
    drive->tick();
  }
  protocol::SerialReader reader;
  protocol::Message m;
  for (std::size_t i = 1; i < size; ++i) {
    if (data[i] == 0xFE) drive->tick();
    if (data[i] == 0xFD) {
      const std::size_t left = size - i - 1 < protocol::kReportBytes ? size - i - 1 : protocol::kReportBytes;
      if (protocol::decode(std::span(data + i + 1, left), m)) {
        drive->take(m);
        i += m.size();
      }
      continue;
    }
    if (reader.take(data[i], m)) drive->take(m);
  }
  for (int i = 0; i < 20; ++i) drive->tick();
  drive->take(protocol::request(protocol::Kind::identify, 1, protocol::Hello{}));
  for (int i = 0; i < 20; ++i) drive->tick();
  require(drive->asked == drive->answered, "a request was not answered once");
  return 0;
}
