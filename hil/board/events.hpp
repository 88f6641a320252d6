#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/board/plant_rig.hpp"

namespace flexspline::board {

/// An event at a given time of a run.
struct Event {
  enum class Kind {
    injection,             ///< a failure of the drive: `injection`
    current_offset,        ///< A, of the reading; the amplifier follows its reading
    torque_offset,         ///< N m, of the reading
    output_offset,         ///< rad, of the output encoder's reading
    amplifier_saturation,  ///< A, the largest current of the amplifier
    load_shock,            ///< N m on the output, positive resists
    temperature_ramp,      ///< degC, reached at the end of the event, and kept
    usb_unplugged,         ///< messages of the host do not arrive
    power_cut,             ///< supply of processor and amplifier
  };
  Kind kind = Kind::injection;
  double at_s = 0.0;
  double duration_s = 0.0;  ///< zero: until the end; a ramp of zero is a jump
  double value = 0.0;
  std::optional<Injection> injection{};

  bool is_over(double time_s) const { return duration_s > 0.0 && time_s >= at_s + duration_s; }
  bool acts(double time_s) const { return time_s >= at_s && !is_over(time_s); }
};

/// The event of that name in scenario files: an event kind or any injection. The caller sets its value and times.
std::optional<Event> event_named(std::string_view name);
std::vector<std::string> event_names();
/// The unit of its value; empty where it has none.
std::string_view event_unit(Event::Kind kind);

/// Applies the events to a rig at `time_s`. The caller applies those of the host and of the supply.
class EventScript {
 public:
  explicit EventScript(std::vector<Event> events) : events_(std::move(events)) {}
  bool empty() const { return events_.empty(); }
  void apply(double time_s, double load_torque_nm, PlantRig& rig);
  bool acts(Event::Kind kind, double time_s) const;

 private:
  std::vector<Event> events_;
  std::optional<double> ramp_from_c_;
};

/// The names for `--inject`.
std::optional<Injection> injection_named(std::string_view name);
std::vector<std::string_view> injection_names();

}  // namespace flexspline::board
