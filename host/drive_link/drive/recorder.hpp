// Runs the motions of a plan on a drive, one at a time, and collects its sensors' signals.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/drive_link/drive/position_motion.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/session.hpp"
#include "host/engine/planning/plan.hpp"

namespace flexspline::drive {

struct Gap {
  double from_s = 0.0;
  std::uint32_t frames = 0;
};

struct Recording {
  planning::Run run;
  std::vector<double> time_s, current_a, motor_position_rad, output_position_rad, torque_nm, temperature_c, command;
  std::uint32_t lost = 0;     // frames, wherever
  std::uint32_t dropped = 0;  // of these on the drive, which had no room for them
  std::uint32_t gap_count = 0;
  std::vector<Gap> gaps;  // the first of them
  bool complete = false;
  std::string ended;  // why it is not: "interrupted", a limit, a fault
};

class Recorder {
 public:
  // Of a whole plan, before anything moves: throws DriveError or PlanError for a run that this drive cannot make.
  // `compensates`: runs of mode position with the feedforward of the drive's model; excitations have none.
  Recorder(Session& session, const Scales& scales, const planning::Plan& plan, bool compensates = false);

  struct Watch {
    std::function<bool()> stops;  // called repeatedly: the user requested a stop
    std::function<void(double time_s)> progress{};
    std::function<void(const Recording& so_far)> seen{};
  };
  // Clears a fault of the drive whose cause, as the user states, is gone.
  void clear_fault();
  // What the drive knows of its positions; nothing where its firmware is older than that.
  protocol::Reference reference();
  // The drive is at rest and not armed when it returns, and where the link still works also when it throws.
  Recording record(const planning::Run& run, const Watch& watch);

 private:
  class Columns;
  class Exchange;
  void require_idle();
  void send_excitation(const planning::Run& run);
  // 2^-32 turns.
  struct ShaftPositions {
    std::int64_t motor = 0, output = 0;
  };
  ShaftPositions read_shaft_positions();
  protocol::Mode start(const planning::Run& run, std::optional<PositionMotion>& position);

  Session& session_;
  const Scales& scales_;
  const planning::Plan& plan_;
  bool compensates_;
  std::uint16_t every_ = 1;
};

}  // namespace flexspline::drive
