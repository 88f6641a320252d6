#include "host/drive_link/drive/commissioning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "host/drive_link/drive/commissioning_result.hpp"

namespace flexspline::drive {
namespace {

using protocol::Code;
using protocol::CommissioningState;
using protocol::Kind;

constexpr Milliseconds kAskEvery{20};
constexpr double kUsualBusV = 48.0, kUsualRampVS = 20.0;  // of the voltage, on such a bus

double share(std::int32_t x, int bits) {
  return std::ldexp(static_cast<double>(x), -bits);
}

protocol::CommissioningBegin begin_of(const deployment::CommissioningSetup& setup) {
  const control::commissioning::Settings s = deployment::commissioning_settings(setup);
  protocol::CommissioningBegin b;
  b.least_bus = s.least_bus;
  b.current = s.current;
  b.most_current = s.most_current;
  b.most_voltage = s.most_voltage;
  b.voltage_ramp = s.voltage_ramp;
  b.slow_step = s.slow_step;
  b.fast_step = s.fast_step;
  b.most_shaft_step = s.most_shaft_step;
  b.step_ramp = s.step_ramp;
  b.most_travel = s.most_travel;
  b.most_periods = s.most_periods;
  b.stated_pole_pairs = s.stated_pole_pairs;
  return b;
}

}  // namespace

protocol::CommissioningStage stage_of(Session& session) {
  if (session.identity().minor < protocol::kMinorOfCommissioning)
    session.fail("its firmware is older than commissioning; bring the firmware up to date");
  const protocol::Message m = session.exchange(protocol::request(Kind::commissioning_stage, 0, protocol::Empty{}));
  if (static_cast<Code>(m.code) == Code::not_available)
    session.fail(
        "it has no three-phase power stage: its amplifier takes a current and has settings of its own, so there is "
        "nothing to commission");
  protocol::CommissioningStage stage;
  if (static_cast<Code>(m.code) != Code::done || protocol::take_payload(m.content(), stage) != Code::done)
    session.fail("what it states of its power stage cannot be understood");
  if (stage.current_full_scale_ma == 0 || stage.bus_full_scale_mv == 0 || stage.pwm_hz == 0 || stage.timer_counts == 0)
    session.fail("its board does not state the scales of its power stage; that is an error of its firmware");
  return stage;
}

double pulse_of(const protocol::CommissioningStage& stage) {
  return share(stage.shortest_pulse, control::foc::kDutyBits);
}

deployment::CommissioningSetup setup_of(const Session& session, const protocol::CommissioningStage& stage,
                                        const control::Hardware& hardware, const CommissioningOptions& options) {
  deployment::CommissioningSetup s;
  s.current_full_scale_a = 1e-3 * stage.current_full_scale_ma;
  s.bus_full_scale_v = 1e-3 * stage.bus_full_scale_mv;
  s.pwm_hz = stage.pwm_hz;
  s.timer_counts = static_cast<int>(stage.timer_counts);
  s.two_sensors = stage.two_sensors;
  const double most_a = share(stage.most_current, 27) * s.current_full_scale_a;
  constexpr double kPeak = 1.5;  // the limit of the test over its current
  // A small current measures the dead time's losses as resistance (shared/control/commissioning/README.md), so the test
  // takes what the block allows the motor. Without a block nothing is known of the motor.
  constexpr double kUnknownMotor = 1.0 / 3.0;
  const double board_a = hardware.most_current_ma > 0 ? 1e-3 * hardware.most_current_ma : most_a;
  const double motor_a = options.motor_a.value_or(kUnknownMotor * board_a);
  s.current_a = options.current_a.value_or(std::min({motor_a, board_a, most_a / kPeak}));
  if (!(s.current_a <= 0.999 * most_a / kPeak) && options.current_a)
    session.fail(
        fmt::format("a test current of {:.3g} A needs a limit of {:.3g} A, and its stage takes {:.3g} A; give "
                    "at most {:.3g} A",
                    s.current_a, kPeak * s.current_a, most_a, 0.999 * most_a / kPeak));
  s.current_a = std::min(s.current_a, 0.999 * most_a / kPeak);
  s.most_current_a = kPeak * s.current_a;
  const double least_v = share(stage.least_bus, 15) * s.bus_full_scale_v;
  s.bus_v = options.bus_v.value_or(std::max(share(stage.bus, 15) * s.bus_full_scale_v, least_v));
  s.least_bus_v = std::max(0.75 * s.bus_v, 1.001 * least_v);
  s.voltage_ramp_v_s = kUsualRampVS * s.bus_v / kUsualBusV;
  s.fast_hz = std::min(s.fast_hz, s.pwm_hz / 100.0);
  if (options.most_speed_rad_s) s.most_shaft_hz = *options.most_speed_rad_s / (2.0 * std::numbers::pi);
  s.most_travel_turns = options.most_turns;
  s.pole_pairs = options.pole_pairs;
  try {
    if (!(s.most_shaft_hz > 0.0 && s.most_shaft_hz <= s.pwm_hz / 100.0))
      throw std::invalid_argument(
          fmt::format("the speed is not between 0 and {:.3g} rad/s", 2.0 * std::numbers::pi * s.pwm_hz / 100.0));
    deployment::commissioning_settings(s);
  } catch (const std::invalid_argument& error) {
    session.fail(error.what());
  }
  return s;
}

protocol::CommissioningProgress commission(
    Session& session, const deployment::CommissioningSetup& setup,
    const std::function<bool(const protocol::CommissioningProgress&)>& progress) {
  session.start_commissioning(begin_of(setup));
  bool stops = false;
  for (;;) {
    const auto now = session.ask<protocol::CommissioningProgress>(Kind::commissioning_state);
    if (now.state != CommissioningState::runs) return now;
    if (!stops && !progress(now)) {
      session.exchange(protocol::request(Kind::commissioning_stop, 0, protocol::Empty{}));
      stops = true;
    }
    std::this_thread::sleep_for(kAskEvery);
  }
}

control::commissioning::Result commissioning_result(Session& session) {
  return result_of(session.ask<protocol::CommissioningResult>(Kind::commissioning_result));
}

control::commissioning::Result mean_of(const std::vector<control::commissioning::Result>& results) {
  using control::commissioning::Result;
  Result mean = results.front();
  const auto n = static_cast<double>(results.size());
  const auto average = [&](auto&& member) {
    double sum = 0.0;
    for (const Result& r : results) sum += static_cast<double>(member(r));
    return static_cast<std::int32_t>(std::lround(sum / n));
  };
  mean.gain.a = average([](const Result& r) { return r.gain.a; });
  mean.gain.b = average([](const Result& r) { return r.gain.b; });
  mean.gain.c = average([](const Result& r) { return r.gain.c; });
  mean.offset.a = average([](const Result& r) { return r.offset.a; });
  mean.offset.b = average([](const Result& r) { return r.offset.b; });
  mean.offset.c = average([](const Result& r) { return r.offset.c; });
  mean.resistance = average([](const Result& r) { return r.resistance; });
  mean.inductance_d = average([](const Result& r) { return r.inductance_d; });
  mean.inductance_q = average([](const Result& r) { return r.inductance_q; });
  mean.flux = average([](const Result& r) { return r.flux; });
  mean.lost_voltage = average([](const Result& r) { return r.lost_voltage; });
  mean.lag = average([](const Result& r) { return r.lag; });
  const std::int32_t beyond = average(
      [&](const Result& r) { return static_cast<std::int32_t>(r.offset_angle - results.front().offset_angle); });
  mean.offset_angle = results.front().offset_angle + static_cast<std::uint32_t>(beyond);
  return mean;
}

std::vector<FoundValue> found_values(const deployment::CommissioningSetup& setup,
                                     const std::vector<control::commissioning::Result>& results) {
  using deployment::CommissioningFindings;
  std::vector<CommissioningFindings> found;
  for (const auto& r : results) found.push_back(deployment::commissioning_findings(setup, r));
  std::vector<FoundValue> values;
  // `wraps`: a difference of angles is within half a turn of the first one.
  const auto add = [&](const char* name, const char* unit, double scale, bool wraps, auto&& member) {
    const double first = member(found.front());
    double sum = 0.0, squares = 0.0;
    for (const CommissioningFindings& f : found) {
      double off = member(f) - first;
      if (wraps) off -= std::round(off);
      sum += off;
      squares += off * off;
    }
    const auto n = static_cast<double>(found.size());
    FoundValue v{name, scale * (first + sum / n), {}, unit};
    if (found.size() > 1) v.spread = scale * std::sqrt(std::max(squares - sum * sum / n, 0.0) / (n - 1.0));
    values.push_back(std::move(v));
  };
  add("resistance", "ohm", 1.0, false, [](const auto& f) { return f.resistance_ohm; });
  add("inductance_d", "H", 1.0, false, [](const auto& f) { return f.inductance_d_h; });
  add("inductance_q", "H", 1.0, false, [](const auto& f) { return f.inductance_q_h; });
  add("flux_linkage", "V*s", 1.0, false, [](const auto& f) { return f.flux_vs; });
  add("torque_constant", "N*m/A", 1.0, false, [](const auto& f) { return 1.5 * f.pole_pairs * f.flux_vs; });
  add("pole_pairs", "1", 1.0, false, [](const auto& f) { return static_cast<double>(f.pole_pairs); });
  add("encoder_direction", "1", 1.0, false, [](const auto& f) { return f.reversed ? -1.0 : 1.0; });
  add("encoder_offset", "deg", 360.0, true, [](const auto& f) { return f.offset_turns; });
  for (std::size_t leg = 0; leg < (setup.two_sensors ? 2 : 3); ++leg) {
    const std::string phase(1, "abc"[leg]);
    add(("current_gain_" + phase).c_str(), "1", 1.0, false, [&](const auto& f) { return f.gain[leg]; });
    add(("current_offset_" + phase).c_str(), "A", 1.0, false, [&](const auto& f) { return f.offset_a[leg]; });
  }
  add("lost_voltage", "V", 1.0, false, [](const auto& f) { return f.lost_v; });
  add("lag_by_friction", "deg", 360.0, false, [](const auto& f) { return f.lag_turns; });
  return values;
}

std::string phase_name(std::uint8_t phase) {
  return phase >= 1 && phase <= 3 ? std::string("phase ") + "abc"[phase - 1] : "";
}

std::string_view name_of(CommissioningState state) {
  switch (state) {
    case CommissioningState::none:
      return "none";
    case CommissioningState::runs:
      return "runs";
    case CommissioningState::done:
      return "done";
    case CommissioningState::fault:
      return "fault";
    case CommissioningState::stopped:
      return "stopped";
    case CommissioningState::host_lost:
      return "host_lost";
    case CommissioningState::drive_fault:
      return "drive_fault";
    case CommissioningState::bus_high:
      return "bus_high";
  }
  return "unknown";
}

std::vector<std::string> commissioning_warnings(const deployment::CommissioningSetup& setup,
                                                const deployment::CommissioningFindings& f,
                                                const control::Hardware& hardware, double torque_constant_nm_a) {
  constexpr double kGain = 0.1, kOffset = 0.05, kLagTurns = 20.0 / 360.0, kConstant = 0.1;
  std::vector<std::string> all;
  if (f.reversed)
    all.emplace_back(
        "the encoder counts against the order of the phases: two of the motor's wires are swapped, or the encoder is "
        "mounted the other way round. The drive takes it back; positive still is where the encoder counts up");
  for (std::size_t leg = 0; leg < (setup.two_sensors ? 2 : 3); ++leg) {
    if (std::abs(f.gain[leg] - 1.0) > kGain)
      all.push_back(fmt::format("the current sensor of phase {} has a gain that is off by {:.0f} %; check its shunt",
                                "abc"[leg], 100.0 * (f.gain[leg] - 1.0)));
    if (std::abs(f.offset_a[leg]) > kOffset * setup.current_full_scale_a)
      all.push_back(fmt::format("the zero of the current sensor of phase {} is off by {:.2g} A; check its reference",
                                "abc"[leg], f.offset_a[leg]));
  }
  if (std::abs(f.lag_turns) > kLagTurns)
    all.push_back(
        fmt::format("friction held the rotor {:.0f} degrees (electrical) behind the test current; a larger "
                    "test current gives a better angle of the encoder",
                    360.0 * std::abs(f.lag_turns)));
  const double measured = 1.5 * f.pole_pairs * f.flux_vs;
  if (torque_constant_nm_a > 0.0 && std::abs(measured / torque_constant_nm_a - 1.0) > kConstant)
    all.push_back(
        fmt::format("the torque constant by the flux is {:.3g} N*m/A, and the block of the drive has {:.3g}; "
                    "identify again, or correct it in the model",
                    measured, torque_constant_nm_a));
  using control::SensorKind;
  if (hardware.motor_encoder == SensorKind::incremental || hardware.motor_encoder == SensorKind::indexed)
    all.emplace_back(
        "the motor's encoder does not know its angle when it is switched on: its offset holds until the power goes");
  return all;
}

}  // namespace flexspline::drive
