// Commissioning for a host: the stage, the progress, the result, and what begins it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "firmware/commissioning_control.hpp"

namespace flexspline::firmware {

struct CommissioningMessages {
  // Serves a request of the kinds `commissioning_...`; `answer` gets the payload, where there is one. `command`: for
  // the tick, where the code is `done` and the request begins or ends it; otherwise a heartbeat.
  template <class Control>
  static protocol::Code serve(Control& control, const protocol::Message& m, protocol::Message& answer,
                              Command::Kind& command) {
    using protocol::Code, protocol::Kind;
    command = Command::Kind::heartbeat;
    if constexpr (!Control::kHasStage) {
      return Code::not_available;
    } else {
      if (!control.exists()) return Code::not_available;
      if (m.request() == Kind::commissioning_begin) {
        protocol::CommissioningBegin begin;
        const Code code = protocol::take_payload(m.content(), begin);
        if (code != Code::done) return code;
        command = Command::Kind::commission;
        return control.prepare(begin) ? Code::done : Code::wrong_value;
      }
      if (m.length != 0) return Code::wrong_length;
      if (m.request() == Kind::commissioning_stop) command = Command::Kind::stop_commissioning;
      if (m.request() == Kind::commissioning_stage) protocol::put_payload(answer, stage(control.stage()));
      if (m.request() == Kind::commissioning_state) protocol::put_payload(answer, progress(control));
      if (m.request() != Kind::commissioning_result) return Code::done;
      if (control.state() != protocol::CommissioningState::done) return Code::not_measured;
      protocol::put_payload(answer, result(control.stage().commissioning().result()));
      return Code::done;
    }
  }

 private:
  template <class Stage>
  static protocol::CommissioningStage stage(const Stage& stage) {
    const ThreePhaseSettings& s = stage.settings();
    protocol::CommissioningStage out;
    out.current_full_scale_ma = s.current_full_scale_ma;
    out.bus_full_scale_mv = s.bus_full_scale_mv;
    out.pwm_hz = s.pwm_hz;
    out.timer_counts = static_cast<std::uint32_t>(s.timer_counts);
    // The rest is what a voltage may use. With two sensors nothing stands in for a phase that cannot be sampled.
    out.shortest_pulse = s.foc.sensors.two ? s.foc.modulation.window : s.foc.modulation.pulse;
    out.most_current = s.most_phase;
    out.bus = static_cast<std::uint16_t>(std::max<std::int32_t>(stage.bus(), 0));
    out.least_bus = static_cast<std::uint16_t>(s.least_bus);
    out.most_bus = static_cast<std::uint16_t>(s.most_bus);
    out.encoder_counts = s.encoder_counts;
    out.two_sensors = s.foc.sensors.two;
    out.pole_pairs = static_cast<std::uint8_t>(s.pole_pairs);
    out.reversed = s.reversed;
    out.offset_angle = s.offset_angle;
    return out;
  }
  template <class Control>
  static protocol::CommissioningProgress progress(const Control& control) {
    using State = protocol::CommissioningState;
    protocol::CommissioningProgress out;
    out.state = control.state();
    if (out.state == State::none) return out;
    const control::commissioning::Commissioning& c = control.stage().commissioning();
    out.step = out.state == State::done ? control::commissioning::Step::done : control.step();
    if (out.state == State::fault) {
      out.fault = c.result().fault;
      out.phase = c.result().phase;
    }
    out.periods = static_cast<std::uint32_t>(c.periods());
    out.most_periods = static_cast<std::uint32_t>(control.request().most_periods);
    return out;
  }
  static protocol::CommissioningResult result(const control::commissioning::Result& r) {
    protocol::CommissioningResult out;
    out.gain = {r.gain.a, r.gain.b, r.gain.c};
    out.offset = {r.offset.a, r.offset.b, r.offset.c};
    out.resistance = r.resistance;
    out.inductance_d = r.inductance_d;
    out.inductance_q = r.inductance_q;
    out.flux = r.flux;
    out.lost_voltage = r.lost_voltage;
    out.pole_pairs = static_cast<std::uint8_t>(std::clamp<std::int32_t>(r.pole_pairs, 0, UINT8_MAX));
    out.reversed = r.reversed;
    out.offset_angle = r.offset_angle;
    out.lag = r.lag;
    return out;
  }
};

}  // namespace flexspline::firmware
