#include "hil/board/events.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace flexspline::board {
namespace {

constexpr std::array<std::pair<std::string_view, Injection>, 26> kInjections{
    {{"motor-encoder-stale", Injection::motor_encoder_stale},
     {"output-encoder-stale", Injection::output_encoder_stale},
     {"analog-stale", Injection::analog_stale},
     {"motor-encoder-stuck", Injection::motor_encoder_stuck},
     {"output-encoder-stuck", Injection::output_encoder_stuck},
     {"motor-encoder-jump", Injection::motor_encoder_jump},
     {"encoder-line-lost", Injection::encoder_line_lost},
     {"output-line-lost", Injection::output_line_lost},
     {"motor-encoder-swapped", Injection::motor_encoder_swapped},
     {"motor-encoder-slips", Injection::motor_encoder_slips},
     {"output-encoder-slips", Injection::output_encoder_slips},
     {"current-out-of-range", Injection::current_out_of_range},
     {"torque-out-of-range", Injection::torque_out_of_range},
     {"temperature-out-of-range", Injection::temperature_out_of_range},
     {"torque-stuck", Injection::torque_stuck},
     {"amplifier-dead", Injection::amplifier_dead},
     {"current-surge", Injection::current_surge},
     {"tick-overrun", Injection::tick_overrun},
     {"phase-lost", Injection::phase_lost},
     {"phases-shorted", Injection::phases_shorted},
     {"phase-grounded", Injection::phase_grounded},
     {"bus-collapse", Injection::bus_collapse},
     {"driver-fault", Injection::driver_fault},
     {"thermistor-open", Injection::thermistor_open},
     {"thermistor-shorted", Injection::thermistor_shorted},
     {"brake-missing", Injection::brake_missing}}};

struct Named {
  std::string_view name;
  Event::Kind kind;
  std::string_view unit;
};
constexpr std::array<Named, 8> kEvents{{{"current-offset", Event::Kind::current_offset, "A"},
                                        {"torque-offset", Event::Kind::torque_offset, "N*m"},
                                        {"output-offset", Event::Kind::output_offset, "rad"},
                                        {"amplifier-saturation", Event::Kind::amplifier_saturation, "A"},
                                        {"load-shock", Event::Kind::load_shock, "N*m"},
                                        {"temperature-ramp", Event::Kind::temperature_ramp, "degC"},
                                        {"usb-unplugged", Event::Kind::usb_unplugged, ""},
                                        {"power-cut", Event::Kind::power_cut, ""}}};

}  // namespace

std::optional<Event> event_named(std::string_view name) {
  Event event;
  for (const Named& one : kEvents)
    if (one.name == name) {
      event.kind = one.kind;
      return event;
    }
  event.injection = injection_named(name);
  if (!event.injection) return {};
  return event;
}

std::vector<std::string> event_names() {
  std::vector<std::string> names;
  for (const Named& one : kEvents) names.emplace_back(one.name);
  for (const auto& one : kInjections) names.emplace_back(one.first);
  return names;
}

std::string_view event_unit(Event::Kind kind) {
  for (const Named& one : kEvents)
    if (one.kind == kind) return one.unit;
  return {};
}

bool EventScript::acts(Event::Kind kind, double time_s) const {
  return std::any_of(events_.begin(), events_.end(), [&](const Event& e) { return e.kind == kind && e.acts(time_s); });
}

void EventScript::apply(double time_s, double load_torque_nm, PlantRig& rig) {
  Disturbances now;
  double load = load_torque_nm;
  for (const Event& e : events_) {
    if (e.injection) {
      if (e.acts(time_s))
        rig.inject(*e.injection);
      else if (e.is_over(time_s))
        rig.clear(*e.injection);
    }
    if (e.kind == Event::Kind::temperature_ramp && time_s >= e.at_s) {
      if (!ramp_from_c_) ramp_from_c_ = rig.temperature_c();
      const double share = e.duration_s > 0.0 ? std::min((time_s - e.at_s) / e.duration_s, 1.0) : 1.0;
      rig.set_temperature(*ramp_from_c_ + share * (e.value - *ramp_from_c_));
    }
    if (!e.acts(time_s)) continue;
    if (e.kind == Event::Kind::current_offset) now.current_offset_a += e.value;
    if (e.kind == Event::Kind::torque_offset) now.torque_offset_nm += e.value;
    if (e.kind == Event::Kind::output_offset) now.output_offset_rad += e.value;
    if (e.kind == Event::Kind::load_shock) load += e.value;
    if (e.kind == Event::Kind::amplifier_saturation) now.amplifier_limit_a = e.value;
  }
  rig.set_load_torque(load);
  rig.disturb(now);
}

std::optional<Injection> injection_named(std::string_view name) {
  for (const auto& [known, injection] : kInjections)
    if (known == name) return injection;
  return {};
}
std::vector<std::string_view> injection_names() {
  std::vector<std::string_view> names;
  for (const auto& one : kInjections) names.push_back(one.first);
  return names;
}

}  // namespace flexspline::board
