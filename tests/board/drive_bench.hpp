// The real image on its register model, wired to a simulated drive: converter, encoders and amplifier. The host is on
// the bus.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>

#include "hil/board/drive_setup.hpp"
#include "hil/board/plant_rig.hpp"
#include "hil/twin/factory_block.hpp"
#include "tests/board/stored_block.hpp"
#include "tests/board/usb_bus.hpp"

namespace flexspline::tests {

inline const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}

// The parameter sectors of a chip, for a test that fills them before it is switched on.
class CellsPort {
 public:
  static constexpr std::size_t kSectorBytes = 0x4000;
  explicit CellsPort(FlashModel& flash) : flash_(flash) {}
  bool erase(std::size_t) { return true; }
  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i)
      flash_.bytes[sector * kSectorBytes + 4 * word + i] = static_cast<std::uint8_t>(value >> (8 * i));
    return true;
  }
  std::span<const std::uint8_t> bytes(std::size_t sector) const {
    return std::span<const std::uint8_t>(flash_.bytes).subspan(sector * kSectorBytes, kSectorBytes);
  }

 private:
  FlashModel& flash_;
};

class DriveBench {
 public:
  // `variant`: dac or pwm; dac-abs or dac-index for other encoders. An empty flash memory without `parameters`.
  // `initial_turns`: the motor's angle at power-on, turns.
  explicit DriveBench(const std::string& variant, bool parameters = true, double initial_turns = 0.7)
      : chip(std::string(FLEXSPLINE_BOARDS) + "/stm32f405/f405-" + variant + ".elf"),
        rig({.drive = made_for(variant), .seed = 3, .start_turns = initial_turns, .encoders = kind_of(variant)}),
        is_bridge_(variant == "pwm"),
        drive_(made_for(variant)) {
    if (parameters) store(twin::factory_block(drive_, setup()));
    chip.senses = [this] { sense(); };
    chip.acts = [this] { act(); };
  }
  // The demo's, with the full scales of the board where it states them.
  control::DriveSetup<double> setup() const {
    auto s = board::setup_of(drive_);
    s.current.full_scale = sensor_a();
    if (is_bridge_) s.amplifier_full_scale = kBridgeA;
    return s;
  }
  void store(const std::vector<std::uint8_t>& block) { tests::store(CellsPort(chip.flash), block); }
  // Started, enumerated, identified, and idle.
  void come_up() {
    ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
    ASSERT_TRUE(bus.enumerate());
    chip.ticks(100);
    ASSERT_EQ(bus.code(protocol::Kind::identify, protocol::Hello{}), protocol::Code::done);
    ASSERT_EQ(bus.status().mode, protocol::Mode::idle);
  }
  protocol::CommandAnswer command(const protocol::Command& c) {
    protocol::CommandAnswer answer;
    EXPECT_EQ(protocol::take_payload(bus.ask(protocol::Kind::command, c).content(), answer), protocol::Code::done);
    return answer;
  }
  // With a host that says each two milliseconds that it is there.
  void run_with_host(double seconds) {
    for (int left = static_cast<int>(std::lround(seconds * 20'000)); left > 0; left -= 40) {
      command({.kind = protocol::CommandKind::heartbeat});
      chip.ticks(std::min(left, 40));
    }
  }
  static std::int32_t per_unit(double value, double base) {
    return static_cast<std::int32_t>(std::lround(std::ldexp(value / base, 27)));
  }
  bool enabled() const { return is_bridge_ ? chip.tim1.outputs_on() && chip.ports[2].high(6) : chip.ports[2].high(6); }

  Chip chip;
  UsbBus bus{chip};
  board::PlantRig rig;
  bool wired = true;      // to the simulated drive; else the test sets the inputs
  double bridge_a = 0.0;  // what flows out of the bridge

 private:
  // The demo's, with as many counts a turn as the encoders of a variant have.
  static plant::Drive made_for(const std::string& variant) {
    plant::Drive drive = demo();
    if (!variant.ends_with("-abs")) return drive;
    drive.sensors.motor_counts = 1 << 14;
    drive.sensors.output_counts = 1 << 12;
    return drive;
  }
  static control::SensorKind kind_of(const std::string& variant) {
    return variant.ends_with("-abs")     ? control::SensorKind::absolute
           : variant.ends_with("-index") ? control::SensorKind::indexed
                                         : control::SensorKind::incremental;
  }
  static constexpr double kBridgeA = 5.0, kBridgeSensorA = 8.0;
  double sensor_a() const { return is_bridge_ ? kBridgeSensorA : board::scales_of(demo()).current_a; }
  // A converter of 12 bits with noise of its own, as real ones have.
  std::uint32_t converted(double share) {
    const double raw = (share + 1.0) * 2047.5 + noise_(random_);
    return static_cast<std::uint32_t>(std::clamp(std::lround(raw), 0L, 4095L));
  }
  void sense() {
    if (!wired) return;
    const firmware::Readings r = rig.sense();
    chip.converter.inputs[10] = converted(r.current / 32768.0 * board::scales_of(demo()).current_a / sensor_a());
    chip.converter.inputs[11] = converted(r.torque / 32768.0);
    chip.converter.inputs[12] = static_cast<std::uint32_t>(std::clamp(r.temperature / 8, 0, 4095));
    chip.spi1.angle = r.motor_counter & 0x3FFF;
    chip.i2c1.angle = r.output_counter & 0xFFF;
    chip.tim2.move_to(r.motor_counter);
    if (r.index_passes != passes_) chip.tim2.pulse(r.motor_counter - r.index_counter);
    passes_ = r.index_passes;
    chip.tim5.move_to(r.output_counter);
  }
  void act() {
    if (!wired) return;
    firmware::Actuation a;
    a.enabled = enabled();
    a.current = static_cast<std::int16_t>(std::clamp(std::lround(chip.command() * 32768.0), -32768L, 32767L));
    if (is_bridge_) a = bridge(a.enabled);
    rig.act(a);
  }
  // A winding of 0.5 ohm and 0.25 mH on 24 V.
  firmware::Actuation bridge(bool enabled) {
    constexpr double kTick = 50e-6;
    if (!enabled) {
      bridge_a = 0.0;
      return {};
    }
    bridge_a += (24.0 * chip.tim1.duty() - 0.5 * bridge_a) / 0.25e-3 * kTick;
    const double share = bridge_a / board::scales_of(demo()).amplifier_a;
    return {static_cast<std::int16_t>(std::clamp(std::lround(share * 32768.0), -32768L, 32767L)), true};
  }

  bool is_bridge_;
  plant::Drive drive_;
  std::uint16_t passes_ = 0;
  std::mt19937 random_{7};
  std::uniform_real_distribution<double> noise_{-1.5, 1.5};
};

}  // namespace flexspline::tests
