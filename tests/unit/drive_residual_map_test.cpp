#include "host/drive_link/drive/residual_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hil/twin/factory_block.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/protocol/map_payloads.hpp"
#include "tests/support/loopback.hpp"

namespace flexspline::drive::drive_residual_map_test {
namespace {

using protocol::Kind;
using protocol::Mode;

// A map of so many seconds at each velocity bin. Noise stays the same for kIndependent_s, as filtered noise about does.
struct Made {
  double noise_nm = 0.003;
  double offset_nm = 0.0;  // at velocities of the bins 9 and 10
  double ripple_nm = 0.0;  // of order 3, everywhere
  double seconds = 4.0;
};
ResidualMap made_map(const Made& made, unsigned seed) {
  ResidualMap map;
  map.tick_s = 5e-5;
  map.angle_bins = 32;
  map.edges_rad_s = {0.5, 1.0, 2.0, 5.0, 12.0, 30.0, 80.0};
  map.unit_nm = 5e-5;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, made.noise_nm);
  for (std::size_t v = 0; v < map.velocity_bins(); ++v)
    for (std::size_t a = 0; a < map.angle_bins; ++a) {
      const int samples = static_cast<int>(made.seconds / kIndependent_s / 32.0);
      const double angle = kTurn * (static_cast<double>(a) + 0.5) / 32.0;
      const double truth = (v == 9 || v == 10 ? made.offset_nm : 0.0) + made.ripple_nm * std::cos(3.0 * angle + 1.0);
      double sum = 0.0, squares = 0.0;
      for (int i = 0; i < samples; ++i) {
        const double x = std::round((truth + noise(random)) / map.unit_nm) * map.unit_nm;
        sum += x, squares += x * x;
      }
      const double mean = samples > 0 ? sum / samples : 0.0;
      const double variance = samples > 0 ? std::max(squares / samples - mean * mean, 0.0) : 0.0;
      map.bins.push_back({static_cast<std::uint32_t>(samples * 400), mean, std::sqrt(variance)});
    }
  return map;
}

TEST(ResidualMapVerdict, NoiseAloneFitsInEveryOneOfSixtyMaps) {
  for (unsigned seed = 1; seed <= 60; ++seed)
    EXPECT_EQ(test_map(made_map({}, seed), 1e-9).verdict, MapVerdict::model_fits) << seed;
}

TEST(ResidualMapVerdict, FindsAnOffsetWhereItIsAndAnOrderAndTheirSizes) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const MapTest j = test_map(made_map({.offset_nm = -0.004}, seed), 1e-4);
    ASSERT_EQ(j.verdict, MapVerdict::model_fails) << seed;
    ASSERT_EQ(j.findings.size(), 1U) << "neighbours are one finding";
    EXPECT_EQ(j.findings[0].order, 0);
    EXPECT_EQ(j.findings[0].velocity.low, 1.0);
    EXPECT_EQ(j.findings[0].velocity.high, 5.0);
    EXPECT_NEAR(j.findings[0].size_nm, -0.004, 5.0 * j.findings[0].std_nm);
    const MapTest order = test_map(made_map({.ripple_nm = 0.002}, seed), 1e-4);
    ASSERT_EQ(order.findings.size(), 1U) << seed;
    EXPECT_EQ(order.findings[0].order, 3);
    // The middle of a bin stands for all of it here: the test corrects for a bin's width, 1.4 % at this order.
    EXPECT_NEAR(order.findings[0].size_nm, 0.002 * 1.0146, 5.0 * order.findings[0].std_nm);
    EXPECT_LT(order.findings[0].p_value, kMapCertainty);
  }
}

TEST(ResidualMapVerdict, SaysSoWhereThereIsTooLittleAndPassesOverWhatIsSmallerThanTheLimit) {
  EXPECT_EQ(test_map(made_map({.seconds = 0.0}, 1), 1e-4).verdict, MapVerdict::too_little_data);
  const MapTest j = test_map(made_map({.ripple_nm = 0.002}, 1), 0.003);
  EXPECT_EQ(j.verdict, MapVerdict::model_fits);
  EXPECT_EQ(j.tested_bins, 14U) << "standstill is not tested";
}

TEST(ResidualMapVerdict, VelocitiesOfBinsAreThoseBetweenTheEdges) {
  const ResidualMap map = made_map({}, 1);
  EXPECT_EQ(map.velocity(7).low, -0.5);
  EXPECT_EQ(map.velocity(8).low, 0.5);
  EXPECT_EQ(map.velocity(8).high, 1.0);
  EXPECT_EQ(map.velocity(6).low, -1.0);
  EXPECT_EQ(map.velocity(6).high, -0.5);
  EXPECT_TRUE(std::isinf(map.velocity(14).high));
  EXPECT_EQ(map.velocity(0).high, -80.0);
}

// Over the protocol: a drive that has a ripple, with a block that knows it or does not.

const plant::Drive& demo() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}
plant::Drive with_ripple() {
  plant::Drive drive = demo();
  plant::with(drive, "torque_ripple:2");
  return drive;
}
protocol::Command velocity_command(const Scales& scales, protocol::CommandKind kind, double rad_s) {
  protocol::Command c;
  c.kind = kind;
  c.mode = Mode::velocity;
  c.compensate = true;
  c.velocity = scales.per_unit(rad_s, scales.constants.velocity_base);
  return c;
}
void turn(Session& session, twin::TwinDrive& drive, const Scales& scales) {
  session.command(velocity_command(scales, protocol::CommandKind::arm, 20.0));
  for (const double rad_s : {20.0, -20.0, 35.0, -35.0})
    for (int i = 0; i < 15; ++i) {
      session.command(velocity_command(scales, protocol::CommandKind::set, rad_s));
      drive.run(1500);
    }
  session.stop();
}

TEST(ResidualMapOverTheProtocol, NamesARippleThatTheBlockLacksAndFindsNothingWhereItIsKnown) {
  for (const bool known : {false, true}) {
    twin::TwinDrive drive({.drive = with_ripple(), .seed = 11});
    Session session = tests::open_session(drive);
    if (!known) session.write_block(twin::factory_block(demo()));
    const Scales scales = scales_of(session);
    EXPECT_TRUE(start_residual_map(session));
    EXPECT_FALSE(start_residual_map(session)) << "it counts already";
    turn(session, drive, scales);
    const ResidualMap map = read_residual_map(session, scales);
    EXPECT_TRUE(map.counts);
    EXPECT_TRUE(map.of_one_moment) << "nothing is fed forward any more";
    EXPECT_GT(map.seconds(), 4.0);
    const MapTest j = test_map(map, 1e-3);
    for (const MapFinding& f : j.findings)
      std::printf("known %d: order %d, %.2f to %.2f rad/s, %.5f +- %.5f N m, p %.2g\n", known, f.order, f.velocity.low,
                  f.velocity.high, f.size_nm, f.std_nm, f.p_value);
    EXPECT_EQ(j.verdict, known ? MapVerdict::model_fits : MapVerdict::model_fails);
    if (!known) {
      ASSERT_FALSE(j.findings.empty());
      EXPECT_EQ(j.findings[0].order, 2);
      EXPECT_NEAR(j.findings[0].size_nm, 0.004, 0.001);  // of the plant, through the encoder's filter
    }
    reset_residual_map(session);
    EXPECT_EQ(read_residual_map(session, scales).seconds(), 0.0);
    EXPECT_TRUE(read_residual_map(session, scales).counts) << "it counts on";
  }
}

std::string error_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(ResidualMapOverTheProtocol, AFirmwareOfAnEarlierMinorIsNotAskedAndTheErrorSaysWhatToDo) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = tests::open_session(drive, [](protocol::Message& m) {
    EXPECT_LT(m.request(), Kind::map_info) << "asked for what it does not know";
    if (m.request() == Kind::identify) m.payload[1] = 0;  // minor
    return false;
  });
  const Scales scales = scales_of(session);
  EXPECT_NE(error_of([&] { read_residual_map(session, scales); }).find("a residual map needs 1.1"), std::string::npos);
  EXPECT_NE(error_of([&] { start_residual_map(session); }).find("bring the firmware up to date"), std::string::npos);
}

TEST(ResidualMapOverTheProtocol, IsNotEmptiedWhileTheDriveIsArmedAndANewBlockStopsIt) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = tests::open_session(drive);
  const Scales scales = scales_of(session);
  start_residual_map(session);
  session.command(velocity_command(scales, protocol::CommandKind::arm, 0.0));
  EXPECT_NE(error_of([&] { reset_residual_map(session); }).find("disarm it first"), std::string::npos);
  session.stop();
  session.write_block(twin::factory_block(with_ripple()));
  EXPECT_FALSE(read_residual_map(session, scales_of(session)).counts);
  EXPECT_TRUE(start_residual_map(session));
}

TEST(ResidualMapOverTheProtocol, BinsBeyondTheMapAndOtherActionsAreRefused) {
  twin::TwinDrive drive({.drive = demo()});
  Session session = tests::open_session(drive);
  const auto code = [&](const protocol::Message& m) { return static_cast<protocol::Code>(session.exchange(m).code); };
  EXPECT_EQ(code(protocol::request(Kind::map_bins, 0, protocol::MapFirst{480})), protocol::Code::wrong_value);
  EXPECT_EQ(code(protocol::request(Kind::map_bins, 0, protocol::MapFirst{479})), protocol::Code::done);
  protocol::Message m = protocol::request(Kind::map_command, 0, protocol::MapCommand{});
  m.payload[0] = 3;
  EXPECT_EQ(code(m), protocol::Code::wrong_value);
  twin::TwinDrive empty({.drive = demo(), .as_made = false});
  Session without = tests::open_session(empty);
  EXPECT_EQ(static_cast<protocol::Code>(without.exchange(protocol::request(Kind::map_info, 0, protocol::Empty{})).code),
            protocol::Code::no_parameters);
}

}  // namespace
}  // namespace flexspline::drive::drive_residual_map_test
