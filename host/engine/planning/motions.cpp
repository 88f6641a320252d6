#include "host/engine/planning/motions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "shared/control/excitation_setup.hpp"

namespace flexspline::planning {
namespace {

// Margin below the limits for errors of the model.
constexpr double kMargin = 0.9;

std::vector<Line> lines_of(std::uint64_t seed, std::uint16_t first, std::uint16_t last) {
  const auto setup = control::multi_sine(control::ExcitationSetup<double>{},
                                         {.seed = seed, .first = first, .last = last, .odd = true});
  std::vector<Line> lines;
  for (std::size_t i = 0; i < setup.line_count; ++i)
    lines.push_back(
        {setup.lines[i].harmonic, static_cast<double>(setup.lines[i].phase) * 0x1p-32, setup.lines[i].weight});
  return lines;
}

class Builder {
 public:
  explicit Builder(const MotionSettings& setting) : s_(setting) {}

  // A velocity of the motor; its amplitude shrinks where the output would travel too far.
  Run velocity(std::string name, Waveform waveform, double share, double frequency_hz) const {
    Run run;
    run.name = std::move(name);
    run.mode = Mode::velocity;
    run.waveform = waveform;
    run.frequency_hz = frequency_hz;
    const double wanted = share * kMargin * s_.limits.velocity_rad_s;
    // Half a cycle at the largest speed is more than any waveform travels.
    const double farthest = 2.0 * frequency_hz * s_.gear_ratio * s_.limits.travel_rad;
    run.amplitude = std::min(wanted, kMargin * farthest);
    if (waveform == Waveform::asymmetric_sine) run.amplitude /= 1.2;
    if (waveform == Waveform::square || waveform == Waveform::saw_tooth)
      run.slope_limit = 40.0 * s_.limits.velocity_rad_s / 4.0;
    run.duration_s = std::max(s_.run_s, std::ceil(1.0 / frequency_hz));
    return run;
  }
  Run current(std::string name, Waveform waveform, double amplitude_a, double frequency_hz, bool locked) const {
    Run run;
    run.name = std::move(name);
    run.mode = Mode::current;
    run.waveform = waveform;
    run.frequency_hz = frequency_hz;
    run.amplitude = kMargin * amplitude_a;
    if (waveform == Waveform::asymmetric_sine) run.amplitude /= 1.2;
    run.duration_s = std::max(s_.run_s, std::ceil(1.0 / frequency_hz));
    run.locked = locked;
    if (locked) run.instructions = "Lock the output so that it cannot turn.";
    return run;
  }
  Run chirp(Run run, double end_hz) const {
    run.end_frequency_hz = end_hz;
    return run;
  }
  Run multi_sine(Run run, std::uint64_t seed, std::uint16_t last) const {
    run.waveform = Waveform::multi_sine;
    run.lines = lines_of(seed, 1, last);
    return run;
  }
  Run with_load(Run run, double torque_nm) const {
    run.load_torque_nm = torque_nm;
    run.instructions = fmt::format(
        "Let a constant torque of {:.3g} N m act on the output, {} positive motion (a weight on a drum or a lever of "
        "constant arm); write its true size into load_torque_nm.",
        std::abs(torque_nm), torque_nm > 0.0 ? "against" : "with");
    return run;
  }
  Run at(Run run, double temperature_c) const {
    run.temperature_c = temperature_c;
    run.instructions = fmt::format("{}Record with the housing at about {:.0f} degC.",
                                   run.instructions.empty() ? "" : run.instructions + " ", temperature_c);
    return run;
  }

  void free_motions(std::vector<Motion>& list) const {
    const auto one = [&](Run run) { list.push_back({run.name, {run}, 0.0}); };
    one(velocity("slow-triangle", Waveform::triangle, 0.06, 0.15));
    one(velocity("very-slow-triangle", Waveform::triangle, 0.02, 0.125));
    one(velocity("slow-saw-tooth", Waveform::saw_tooth, 0.1, 0.25));
    one(velocity("small-reversals", Waveform::sine, 0.03, 2.0));
    one(velocity("fast-triangle", Waveform::triangle, 1.0, 0.25));
    one(velocity("fast-sine", Waveform::sine, 1.0, 0.5));
    one(velocity("sine", Waveform::sine, 0.5, 1.0));
    one(velocity("quick-sine", Waveform::sine, 0.3, 2.5));
    one(velocity("asymmetric-sine", Waveform::asymmetric_sine, 0.8, 0.5));
    one(velocity("composite", Waveform::composite, 0.7, 0.5));
    one(velocity("square", Waveform::square, 0.6, 0.5));
    one(chirp(velocity("chirp", Waveform::sine, 0.25, 0.25), 8.0));
    one(multi_sine(velocity("multi-sine", Waveform::sine, 0.6, 0.25), 1, 31));
    one(current("current-triangle", Waveform::triangle, 0.5 * s_.limits.current_a, 0.25, false));
    Motion ladder{"speeds", {}, 0.0};
    for (const double share : {0.02, 0.06, 0.2, 0.5, 1.0}) {
      Run run = velocity(fmt::format("speed-{:.0f}-percent", 100.0 * share), Waveform::square, share, 0.5);
      run.duration_s = 4.0;
      ladder.runs.push_back(run);
    }
    list.push_back(std::move(ladder));
  }
  void locked_motions(std::vector<Motion>& list) const {
    const double full = s_.locked_current_a;
    const auto one = [&](Run run) { list.push_back({run.name, {run}, 1.0}); };
    one(current("locked-slow-sine", Waveform::sine, full, 0.25, true));
    one(current("locked-sine", Waveform::sine, full, 1.0, true));
    one(current("locked-triangle", Waveform::triangle, 0.6 * full, 0.5, true));
    one(current("locked-asymmetric", Waveform::asymmetric_sine, full, 0.25, true));
    one(multi_sine(current("locked-small-multi-sine", Waveform::sine, 0.35 * full, 0.25, true), 2, 15));
    one(multi_sine(current("locked-multi-sine", Waveform::sine, full, 0.25, true), 3, 31));
    one(chirp(current("locked-chirp", Waveform::sine, 0.7 * full, 0.25, true), 10.0));
    list.push_back({"locked-two-frequencies",
                    {current("locked-sine-at-0.25hz", Waveform::sine, 0.8 * full, 0.25, true),
                     current("locked-sine-at-4hz", Waveform::sine, 0.8 * full, 4.0, true)},
                    1.0});
    list.push_back({"locked-two-amplitudes",
                    {current("locked-sine-full", Waveform::sine, full, 0.5, true),
                     current("locked-sine-third", Waveform::sine, full / 3.0, 0.5, true)},
                    1.0});
  }
  void loaded_motions(std::vector<Motion>& list) const {
    const double load = s_.limits.load_torque_nm;
    const auto both = [&](const std::string& name, const Run& run) {
      Motion motion{name, {}, 2.0};
      for (const double sign : {1.0, -1.0}) {
        Run loaded = with_load(run, sign * load);
        loaded.name = fmt::format("{}-{}", name, sign > 0.0 ? "against" : "with");
        motion.runs.push_back(loaded);
      }
      list.push_back(std::move(motion));
    };
    both("loaded-slow", velocity("", Waveform::triangle, 0.1, 0.25));
    both("loaded-sine", velocity("", Waveform::sine, 0.4, 0.5));
  }
  void temperatures(std::vector<Motion>& list) const {
    const double full = s_.locked_current_a;
    const Run slow = s_.free ? velocity("slow", Waveform::triangle, 0.06, 0.25)
                             : current("locked-slow", Waveform::sine, full, 0.25, true);
    const Run fast = s_.free ? velocity("fast", Waveform::triangle, 1.0, 0.25)
                             : current("locked-fast", Waveform::sine, full, 1.0, true);
    Motion motion{"two-temperatures", {}, 3.0};
    for (const double temperature : {s_.cold_c, s_.warm_c})
      for (Run run : {slow, fast}) {
        run.name += temperature == s_.cold_c ? "-cold" : "-warm";
        motion.runs.push_back(at(run, temperature));
      }
    list.push_back(std::move(motion));
  }

 private:
  const MotionSettings& s_;
};

}  // namespace

std::vector<Motion> motions(const MotionSettings& setting) {
  std::vector<Motion> list;
  const Builder build(setting);
  const bool locked = setting.locked && setting.locked_current_a > 0.0;
  if (setting.free) build.free_motions(list);
  if (setting.off) {
    Run run;
    run.name = "drive-off";
    run.mode = Mode::off;
    run.waveform = Waveform::zero;
    run.duration_s = 4.0;
    run.instructions = "Switch the drive's power stage off and leave the axis at rest; the sensors stay on.";
    list.push_back({"drive-off", {run}, 0.5});
  }
  if (locked) build.locked_motions(list);
  if (setting.free && setting.external_load && setting.limits.load_torque_nm > 0.0) build.loaded_motions(list);
  if (setting.temperature && (setting.free || locked)) build.temperatures(list);
  return list;
}

}  // namespace flexspline::planning
