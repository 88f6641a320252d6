// The controller on recorded inputs: what it makes of them is compared with what it made when they were recorded. A
// change of behaviour shows as lines of a table; one that is wanted is recorded anew with FLEXSPLINE_RECORD=1.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "hil/board/drive_setup.hpp"
#include "hil/board/scenario.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::controller_regression_test {
namespace {

using board::SoftwareBoard;
using firmware::Channel;
using firmware::N;

constexpr std::uint32_t kTickHz = SoftwareBoard::kTickHz;
constexpr std::uint32_t kTicksPerRow = kTickHz / 100, kBootTicks = 100, kHostTicks = kTickHz / 1000;
constexpr std::size_t kRows = 130;

constexpr std::array<const char*, 5> kOutputs{"velocity", "disturbance", "feedforward_torque", "command_torque",
                                              "command_current"};
// In bases. Arithmetic that differs in its last bits is no change of behaviour.
constexpr double kTolerance = 2e-4;

struct Row {
  std::array<long, 5> inputs{};  // motor and output counts, current, torque, temperature
  std::array<double, 5> outputs{};
};
struct Case {
  const char* scenario;
  bool compensation;
  // RMS of the commanded torque, in bases: below and above.
  double least_torque, most_torque;
};
constexpr std::array<Case, 3> kCases{
    {{"slow-reversals", true, 0.05, 0.6}, {"sine", true, 0.05, 0.7}, {"trapezoid", false, 0.05, 0.8}}};

std::string file_of(const Case& c) {
  return std::string(FLEXSPLINE_SOURCE_DIR) + "/tests/campaign/recorded/" + c.scenario + ".csv";
}
const plant::Drive& drive() {
  static const plant::Drive demo = plant::demo_plant().drive;
  return demo;
}

firmware::Command command_at(const Case& c, firmware::Command::Kind kind, double time_s) {
  const auto d = board::constants_of(drive());
  const board::Reference r = board::scenario(c.scenario).at(time_s);
  firmware::Command command;
  command.kind = kind;
  command.mode = firmware::Mode::position;
  command.compensate = c.compensation;
  command.stream = true;
  command.position = {std::llround(std::ldexp(r.position * d.gear_ratio / kTurn, 32))};
  command.velocity = N::value(r.velocity * d.gear_ratio / d.velocity_base);
  command.acceleration = N::value(r.acceleration * d.gear_ratio / d.acceleration_base);
  return command;
}
firmware::TelemetrySetup telemetry() {
  return {.every = 1,
          .count = 5,
          .channels = {Channel::velocity, Channel::disturbance, Channel::feedforward_torque, Channel::command_torque,
                       Channel::command_current}};
}
// Without slow rates every task runs at each tick, as when the inputs were recorded.
board::Block block(bool slow_rates) {
  auto setup = board::setup_of(drive());
  setup.has_slow_rates = slow_rates;
  return board::Block(board::parameters_of(drive(), setup), board::constants_of(drive()));
}

// Rows of a drive in closed loop: where inputs come from.
std::vector<Row> recorded_inputs(const Case& c) {
  // What is recorded are counts of a drive that wakes at its zero.
  board::PlantRig rig({.drive = drive(), .seed = 11, .start_turns = 0.0});
  board::SoftwareController controller;
  controller.start(block(false), telemetry(), firmware::ResetCause::power);
  std::vector<Row> rows;
  for (std::uint32_t k = 0; rows.size() < kRows; ++k) {
    firmware::CoSimulationInput down;
    down.readings = rig.sense();
    if (k % kTicksPerRow == 0) {
      const firmware::Readings& r = down.readings;
      rows.push_back({{static_cast<std::int32_t>(r.motor_counter), static_cast<std::int32_t>(r.output_counter),
                       r.current, r.torque, r.temperature},
                      {}});
    }
    const double time_s = (static_cast<double>(k) - kBootTicks) / kTickHz;
    if (k >= kBootTicks && (k - kBootTicks) % kHostTicks == 0) {
      down.has_command = true;
      down.command =
          command_at(c, k == kBootTicks ? firmware::Command::Kind::arm : firmware::Command::Kind::set, time_s);
    }
    rig.act(controller.tick(down).actuation);
  }
  return rows;
}

// The controller alone, on straight lines between the inputs of the rows: fills in its outputs.
void replay(const Case& c, bool slow_rates, std::vector<Row>& rows) {
  board::SoftwareController controller;
  controller.start(block(slow_rates), telemetry(), firmware::ResetCause::power);
  firmware::Readings readings;
  for (std::uint32_t k = 0; k < (kRows - 1) * kTicksPerRow; ++k) {
    const Row &from = rows[k / kTicksPerRow], &to = rows[k / kTicksPerRow + 1];
    const auto input = [&](std::size_t i) {
      const long part = static_cast<long>(k % kTicksPerRow);
      return from.inputs[i] + (to.inputs[i] - from.inputs[i]) * part / static_cast<long>(kTicksPerRow);
    };
    readings.motor_counter = static_cast<std::uint32_t>(input(0));
    readings.output_counter = static_cast<std::uint32_t>(input(1));
    readings.current = static_cast<std::int16_t>(input(2));
    // A converter's last bit is never still, and the drive looks for that.
    readings.torque = static_cast<std::int16_t>(input(3) + (k % 2));
    readings.temperature = static_cast<std::int16_t>(input(4));
    ++readings.motor_samples;
    ++readings.output_samples;
    ++readings.analog_samples;
    firmware::CoSimulationInput down;
    down.readings = readings;
    if (k >= kBootTicks && (k - kBootTicks) % kHostTicks == 0) {
      down.has_command = true;
      down.command = command_at(c, k == kBootTicks ? firmware::Command::Kind::arm : firmware::Command::Kind::set,
                                (static_cast<double>(k) - kBootTicks) / kTickHz);
    }
    const firmware::CoSimulationOutput up = controller.tick(down);
    ASSERT_TRUE(k <= kBootTicks || up.status.mode == firmware::Mode::position)
        << c.scenario << ": not armed any more at tick " << k << ", fault " << static_cast<int>(up.status.fault.fault);
    if (k % kTicksPerRow == 0 && up.frame_words > 5)
      for (std::size_t i = 0; i < 5; ++i)
        rows[k / kTicksPerRow].outputs[i] = std::ldexp(static_cast<std::int32_t>(up.frame[2 + i]), -fixed::kValueBits);
  }
}

void write(const Case& c, const std::vector<Row>& rows) {
  std::ofstream out(file_of(c));
  out << "motor_counts,output_counts,current,torque,temperature";
  for (const char* name : kOutputs) out << ',' << name;
  out << '\n';
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < 5; ++i) out << (i == 0 ? "" : ",") << row.inputs[i];
    for (const double x : row.outputs) {
      char text[32];
      std::snprintf(text, sizeof(text), ",%.6f", x);
      out << text;
    }
    out << '\n';
  }
}
std::vector<Row> read(const Case& c) {
  std::ifstream in(file_of(c));
  std::vector<Row> rows;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    Row row;
    char comma = 0;
    for (long& x : row.inputs) cells >> x >> comma;
    for (double& x : row.outputs) cells >> x >> comma;
    rows.push_back(row);
  }
  return rows;
}

class Controller : public testing::TestWithParam<Case> {};

TEST_P(Controller, MakesOfRecordedInputsWhatItMadeOfThem) {
  const Case& c = GetParam();
  if (std::getenv("FLEXSPLINE_RECORD") != nullptr) {
    std::vector<Row> rows = recorded_inputs(c);
    replay(c, false, rows);
    write(c, rows);
  }
  const std::vector<Row> expected = read(c);
  ASSERT_EQ(expected.size(), kRows) << file_of(c) << " is missing or short";
  std::vector<Row> now = expected;
  ASSERT_NO_FATAL_FAILURE(replay(c, false, now));
  std::size_t different = 0;
  double squares = 0.0;
  std::ostringstream table;
  for (std::size_t k = 0; k + 1 < kRows; ++k) {
    squares += now[k].outputs[3] * now[k].outputs[3];
    for (std::size_t i = 0; i < kOutputs.size(); ++i) {
      const double was = expected[k].outputs[i], is = now[k].outputs[i];
      if (std::abs(is - was) <= kTolerance) continue;
      if (++different <= 12)
        table << "  line " << k + 2 << " (" << 0.01 * static_cast<double>(k) << " s) " << kOutputs[i] << ": was " << was
              << ", is " << is << "\n";
    }
  }
  EXPECT_EQ(different, 0u) << file_of(c) << ", in bases:\n" << table.str();
  const double torque = std::sqrt(squares / static_cast<double>(kRows - 1));
  EXPECT_GT(torque, c.least_torque);
  EXPECT_LT(torque, c.most_torque);
}

// No loop reads the disturbance that is updated at every fourth tick only, and between updates it is held.
TEST_P(Controller, ChangesTheDisturbanceAloneWhereSlowTasksHaveTheirOwnRates) {
  const Case& c = GetParam();
  const std::vector<Row> expected = read(c);
  ASSERT_EQ(expected.size(), kRows);
  std::vector<Row> now = expected;
  ASSERT_NO_FATAL_FAILURE(replay(c, true, now));
  double apart = 0.0, whole = 0.0;
  for (std::size_t k = 0; k + 1 < kRows; ++k)
    for (std::size_t i = 0; i < kOutputs.size(); ++i) {
      const double was = expected[k].outputs[i], is = now[k].outputs[i];
      if (i != 1) {
        EXPECT_NEAR(is, was, kTolerance) << "line " << k + 2 << " " << kOutputs[i];
        continue;
      }
      apart += (is - was) * (is - was);
      whole += was * was;
    }
  EXPECT_GT(apart, 0.0);
  EXPECT_LT(apart, 0.05 * 0.05 * whole);
}

INSTANTIATE_TEST_SUITE_P(Recorded, Controller, testing::ValuesIn(kCases), [](const auto& test) {
  std::string name = test.param.scenario;
  for (char& letter : name)
    if (letter == '-') letter = '_';
  return name;
});

}  // namespace
}  // namespace flexspline::tests::controller_regression_test
