#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hil/board/drive_rig.hpp"

namespace flexspline::board {

/// What happens to a drive at a stated time of a run.
struct Event {
  enum class Kind {
    injection,             ///< something of the drive breaks: `injection`
    current_offset,        ///< A, of the reading; the amplifier follows its reading
    torque_offset,         ///< N m, of the reading
    output_offset,         ///< rad, of the output encoder's reading
    amplifier_saturation,  ///< A, that the amplifier gives at most
    load_shock,            ///< N m on the output, positive resists
    temperature_ramp,      ///< degC, reached at the end of the event, and kept
    usb_unplugged,         ///< the host is not heard
    power_cut,             ///< supply of processor and amplifier
  };
  Kind kind = Kind::injection;
  double at_s = 0.0;
  double duration_s = 0.0;  ///< nought: until the end; a ramp of nought is a jump
  double value = 0.0;
  std::optional<Injection> injection{};

  bool is_over(double time_s) const { return duration_s > 0.0 && time_s >= at_s + duration_s; }
  bool acts(double time_s) const { return time_s >= at_s && !is_over(time_s); }
};

/// The event of that name, as it stands in scenario files: one of its own or any injection. Its value and times stay to
/// be set.
std::optional<Event> event_named(std::string_view name);
std::vector<std::string> event_names();
/// Of its value; empty where it has none.
std::string_view event_unit(Event::Kind kind);

/// Makes a rig what the events say it is at `time_s`. The events of the host and of the supply are the caller's.
class EventScript {
 public:
  explicit EventScript(std::vector<Event> events) : events_(std::move(events)) {}
  bool empty() const { return events_.empty(); }
  void apply(double time_s, double load_torque_nm, DriveRig& rig);
  bool acts(Event::Kind kind, double time_s) const;

 private:
  std::vector<Event> events_;
  std::optional<double> ramp_from_c_;
};

/// The names that `--inject` knows.
std::optional<Injection> injection_named(std::string_view name);
std::vector<std::string_view> injection_names();

}  // namespace flexspline::board
