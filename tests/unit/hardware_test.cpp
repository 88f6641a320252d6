// What a board states of itself holds whatever a block says: its validator refuses other full scales, its largest
// current is a limit of its own, and who packs for a drive takes what its board states.
#include <gtest/gtest.h>

#include <random>

#include "hil/twin/factory_block.hpp"
#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/drive_settings.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "tests/support/service_host.hpp"
#include "tests/support/two_ampere_drive.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::hardware_test {
namespace {

using control::Hardware;
using firmware::BlockFinding;

Hardware demo_hardware() {
  return board::hardware_of(demo_drive(), control::SensorKind::absolute);
}
BlockFinding finding(const Hardware& hardware, const control::DriveSetup<double>& setup = demo_setup()) {
  return firmware::check_block(demo_block(setup).bytes(), kTickHz, hardware);
}

TEST(BoardHardware, ABlockOfOtherFullScalesOrSensorsIsRefused) {
  EXPECT_EQ(finding(demo_hardware()), BlockFinding::none);
  EXPECT_EQ(finding({}), BlockFinding::none) << "a board that states nothing";
  const auto with = [](auto&& change) {
    Hardware h = demo_hardware();
    change(h);
    return finding(h);
  };
  constexpr auto kOther = BlockFinding::other_hardware;
  EXPECT_EQ(with([](Hardware& h) { h.current_full_scale_ma = 8000; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.amplifier_full_scale_ma = 5000; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.most_current_ma = 2000; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.torque_full_scale_mnm /= 2; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.temperature_full_scale_mc = 150'000; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.temperature_at_zero_mc = 40'000; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.output_encoder = control::SensorKind::none; }), kOther);
  EXPECT_EQ(with([](Hardware& h) { h.torque_sensor = control::SensorKind::none; }), kOther);
  auto cold = demo_setup();
  cold.temperature.at_zero = 40.0;
  Hardware shifted = demo_hardware();
  EXPECT_EQ(finding(shifted, cold), kOther);
  shifted.temperature_at_zero_mc = 40'000;
  EXPECT_EQ(finding(shifted, cold), BlockFinding::none);
  shifted.temperature_at_zero_mc = -40'000;
  EXPECT_EQ(finding(shifted, cold), kOther);
}

// The drive compares in integers: here against the same in double, over full scales of three orders of magnitude.
TEST(BoardHardware, FullScalesAgreeWithinTheirRoundingAndNotBeyondAPercent) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-0.5, 2.5), share(-0.002, 0.002);
  for (int k = 0; k < 20'000; ++k) {
    const double base_a = std::pow(10.0, exponent(random)),
                 full_a = base_a * std::pow(10.0, 0.4 * exponent(random) + 0.2);
    int two = 0;
    const double mantissa = std::frexp(base_a, &two);
    control::Stated s;
    s.current_base = {static_cast<std::int32_t>(std::lround(std::ldexp(mantissa, 30))), two};
    s.torque_base = s.temperature_base = s.current_base;
    s.current.gain = s.temperature.gain = N::gain(full_a / base_a);
    s.amplifier = N::gain(base_a / full_a);
    s.current_limit = N::value(0.5);
    const auto milli = [](double x) { return static_cast<std::uint32_t>(std::lround(1000.0 * x)); };
    Hardware h;
    h.current_full_scale_ma = milli(full_a * (1.0 + share(random)));
    h.amplifier_full_scale_ma = milli(full_a * (1.0 + share(random)));
    h.temperature_full_scale_mc = milli(full_a);
    h.most_current_ma = milli(0.5 * base_a) + 1;
    ASSERT_EQ(control::disagreement(s, h), control::Disagreement::none) << base_a << ' ' << full_a;
    const double off = random() % 2 == 0 ? 1.01 : 0.99;
    Hardware other = h;
    other.current_full_scale_ma = milli(full_a * off);
    ASSERT_EQ(control::disagreement(s, other), control::Disagreement::current_full_scale) << full_a;
    other = h;
    other.amplifier_full_scale_ma = milli(full_a * off);
    ASSERT_EQ(control::disagreement(s, other), control::Disagreement::amplifier_full_scale) << full_a;
    other = h;
    other.most_current_ma = milli(0.495 * base_a);
    ASSERT_EQ(control::disagreement(s, other), control::Disagreement::most_current) << base_a;
  }
}

// A block that the validator let pass, as before there was one: the board's own limits hold all the same.
TEST(BoardHardware, TheLargestCurrentIsNeverCommandedAndOneAboveItSwitchesOff) {
  const Block block = demo_block();
  board::SoftwareBoard software;
  software.hardware_stated = demo_hardware();
  software.hardware_stated.most_current_ma = 1000;
  firmware::Application<board::SoftwareBoard> application(software);
  software.hardware_stated = {};
  application.boot_with(block.bytes());
  firmware::Readings r;
  software.readings = &r;
  const auto scales = board::scales_of(demo_drive());
  const auto tick = [&](double measured_a) {
    ++r.motor_samples, ++r.output_samples, ++r.analog_samples;
    r.torque = static_cast<std::int16_t>(1 + r.motor_samples % 2);
    r.current = static_cast<std::int16_t>(measured_a / scales.current_a * 32768.0);
    application.tick();
    return software.actuation.current / 32768.0 * scales.amplifier_a;
  };
  for (int k = 0; k < 100; ++k) tick(0.0);
  ASSERT_EQ(application.status().mode, Mode::idle);
  application.submit(arm_current(3.0));
  double commanded = 0.0;
  for (int k = 0; k < 50; ++k) commanded = std::max(commanded, tick(commanded));
  EXPECT_EQ(application.status().mode, Mode::current);
  EXPECT_LE(commanded, 1.0);
  EXPECT_GT(commanded, 0.99);
  for (int k = 0; k < 2; ++k) tick(1.3);
  EXPECT_EQ(application.status().fault.fault, Fault::overcurrent);
  EXPECT_FALSE(software.actuation.enabled);
}

TEST(BoardHardware, ADriveSaysWhatItsBoardIsAndRefusesABlockForAnother) {
  twin::TwinDrive drive({.drive = demo_drive()});
  ServiceHost host(drive);
  drive.run(200);
  ASSERT_EQ(host.identify(), protocol::Code::done);
  protocol::Hardware stated;
  ASSERT_EQ(protocol::take_payload(host.ask(protocol::Kind::hardware).content(), stated), protocol::Code::done);
  EXPECT_EQ(stated.board, demo_hardware());
  auto setup = demo_setup();
  setup.amplifier_full_scale = 5.0;
  setup.current.full_scale = 8.0;
  std::uint32_t reason = 0;
  EXPECT_EQ(host.flash(twin::factory_block(demo_drive(), setup), &reason), protocol::Code::invalid);
  EXPECT_EQ(static_cast<BlockFinding>(reason), BlockFinding::other_hardware);
  EXPECT_EQ(host.flash(twin::factory_block(demo_drive())), protocol::Code::done);
}

// The case: a drive of 2 A on a bridge of 5 A whose sensor shows 8 A.
TEST(BoardHardware, PackTakesWhatTheBoardStatesAndSaysWhichSettingDisagrees) {
  const Hardware bridge{.current_full_scale_ma = 8000,
                        .amplifier_full_scale_ma = 5000,
                        .most_current_ma = 5000,
                        .torque_sensor = control::SensorKind::none};
  const model::Model m = tests::two_ampere_drive();
  const auto d = deployment::bases_of(m, 1.0 / kTickHz);
  const auto setup = [&](const std::string& tables, const Hardware& hardware) {
    return deployment::parse_drive_setup("format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 16384\n" + tables,
                                         "d.toml", m, d, {}, hardware);
  };
  const auto said = [&](const std::string& tables) -> std::string {
    try {
      setup(tables, bridge);
    } catch (const deployment::PackError& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(setup("", {}).amplifier_full_scale, 2.5);
  EXPECT_EQ(setup("", bridge).amplifier_full_scale, 5.0);
  EXPECT_EQ(setup("", bridge).current.full_scale, 8.0);
  EXPECT_EQ(setup("[amplifier]\nfull_scale_a = 5\n", bridge).amplifier_full_scale, 5.0);
  const std::string wrong = said("[amplifier]\nfull_scale_a = 2.5\n");
  EXPECT_NE(wrong.find("d.toml:5: [amplifier] full_scale_a is 2.5 A, but the drive's board states 5 A"),
            std::string::npos)
      << wrong;
  EXPECT_NE(said("[torque_sensor]\n").find("[torque_sensor] is there, but the drive's board"), std::string::npos);
  Hardware small = bridge;
  small.most_current_ma = 1500;
  EXPECT_EQ(setup("", small).loops.current_limit, 1.5);
  EXPECT_THROW(setup("[limits]\ncurrent_a = 2\n", small), deployment::PackError);
}

}  // namespace
}  // namespace flexspline::tests::hardware_test
