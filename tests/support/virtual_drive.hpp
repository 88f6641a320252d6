// The demo's drive with its application on the desktop, and the commands that tests give it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>

#include "hil/board/drive_setup.hpp"
#include "hil/board/virtual_drive.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests {

using board::Block;
using board::Injection;
using board::RigSetup;
using board::SoftwareController;
using board::VirtualDrive;
using firmware::Channel;
using firmware::Command;
using firmware::Fault;
using firmware::Mode;
using firmware::N;
using firmware::Refusal;

constexpr std::uint32_t kTickHz = board::SoftwareBoard::kTickHz;

inline const plant::Drive& demo_drive() {
  static const plant::Drive drive = plant::demo_plant().drive;
  return drive;
}
inline effects::DriveConstants<double> demo_constants() {
  return board::constants_of(demo_drive());
}
inline control::DriveSetup<double> demo_setup() {
  return board::setup_of(demo_drive());
}
inline Block demo_block(const control::DriveSetup<double>& setup = demo_setup()) {
  return Block(board::parameters_of(demo_drive(), setup), demo_constants());
}
inline double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
inline double real(std::uint32_t word) {
  return std::ldexp(static_cast<std::int32_t>(word), -fixed::kValueBits);
}

inline Command arm(Mode mode, bool compensate = false) {
  Command c;
  c.kind = Command::Kind::arm;
  c.mode = mode;
  c.compensate = compensate;
  return c;
}
inline Command arm_velocity(double rad_s) {
  Command c = arm(Mode::velocity);
  c.velocity = N::value(rad_s / demo_constants().velocity_base);
  return c;
}
inline Command arm_current(double amperes) {
  Command c = arm(Mode::current);
  c.current = N::value(amperes / demo_constants().current_base);
  return c;
}
inline Command arm_position(double turns) {
  Command c = arm(Mode::position);
  c.position = {std::llround(std::ldexp(turns, 32))};
  return c;
}
inline Command as_set_point(Command c) {
  c.kind = Command::Kind::set;
  return c;
}
inline Command of_kind(Command::Kind kind) {
  Command c;
  c.kind = kind;
  return c;
}
// Runs with a host that says each millisecond that it is there.
inline void run_with_host(VirtualDrive& drive, double seconds) {
  const auto ticks = static_cast<std::uint32_t>(std::lround(seconds * kTickHz));
  for (std::uint32_t k = 0; k < ticks; ++k) {
    if (k % (kTickHz / 1000) == 0) drive.post(of_kind(Command::Kind::heartbeat));
    drive.run(1);
  }
}
// Ready to be armed: parameters taken, sensors found good. Its encoders are absolute, as a twin's.
inline std::unique_ptr<VirtualDrive> idle_drive(const control::DriveSetup<double>& setup = demo_setup(),
                                                std::uint64_t seed = 1) {
  auto controller = std::make_unique<SoftwareController>();
  controller->state({.motor_encoder = control::SensorKind::absolute, .output_encoder = control::SensorKind::absolute});
  auto drive = std::make_unique<VirtualDrive>(RigSetup{.drive = demo_drive(),
                                                       .seed = seed,
                                                       .start_turns = board::initial_turns(seed),
                                                       .encoders = control::SensorKind::absolute},
                                              demo_block(setup), firmware::TelemetrySetup{}, std::move(controller));
  drive->run(100);
  EXPECT_EQ(drive->status().mode, Mode::idle);
  EXPECT_TRUE(drive->status().has_parameters);
  return drive;
}
inline SoftwareController& software(VirtualDrive& drive) {
  return dynamic_cast<SoftwareController&>(drive.controller());
}

}  // namespace flexspline::tests
