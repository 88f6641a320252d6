// monitor --residual-map: where the model on the drive fails.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/app/cli/command_monitor.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/drive_link/drive/residual_map_json.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"

namespace flexspline::cli {
namespace {

using drive::MapFinding;
using drive::MapVerdict;
using drive::ResidualMap;
using nlohmann::json;

const char* torque_unit(const ResidualMap& map) {
  return map.is_linear ? "N" : "N*m";
}
const char* velocity_unit(const ResidualMap& map) {
  return map.is_linear ? "m/s" : "rad/s";
}
std::string text_of(const ResidualMap::Range& v) {
  if (std::isinf(v.low)) return fmt::format("below {}", output::number(v.high, 3));
  if (std::isinf(v.high)) return fmt::format("above {}", output::number(v.low, 3));
  return fmt::format("{} to {}", output::number(v.low, 3), output::number(v.high, 3));
}
// A glyph for a mean: the middle one is zero, a full bar the largest of the map.
std::string glyph_of(const drive::ResidualBin& bin, double largest) {
  constexpr std::string_view kBars[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇"};
  if (bin.ticks == 0) return "·";
  const double share = largest > 0.0 ? bin.mean_nm / largest : 0.0;
  return std::string(kBars[static_cast<std::size_t>(std::lround(3.0 + 3.0 * std::clamp(share, -1.0, 1.0)))]);
}

void show(const ResidualMap& map, Console& console) {
  double largest = 0.0;
  for (const drive::ResidualBin& bin : map.bins) largest = std::max(largest, std::abs(bin.mean_nm));
  console.line(
      fmt::format("Measured less modelled {} over motor angle (0 to 1 turn, left to right), {:.3g} s in "
                  "all;\na full bar is {} {}, half of one zero, a dot nothing yet:",
                  map.is_linear ? "force" : "torque", map.seconds(), output::number(largest, 3), torque_unit(map)));
  console.line(fmt::format("{:>20}", fmt::format("velocity, {}", velocity_unit(map))));
  for (std::size_t v = map.velocity_bins(); v-- > 0;) {
    double ticks = 0.0, mean = 0.0;
    std::string bars;
    for (std::size_t a = 0; a < map.angle_bins; ++a) {
      const drive::ResidualBin& bin = map.at(v, a);
      ticks += bin.ticks;
      mean += bin.ticks * bin.mean_nm;
      bars += glyph_of(bin, largest);
    }
    if (ticks == 0.0) continue;
    console.line(fmt::format("{:>20}  {}  mean {:>10} {}, {:.2g} s", text_of(map.velocity(v)), bars,
                             output::number(mean / ticks, 3), torque_unit(map), ticks * map.tick_s));
  }
}
std::string text_of(const MapFinding& f, const ResidualMap& map) {
  const std::string p_value = f.p_value < 1e-12 ? "p below 1e-12" : fmt::format("p = {:.1g}", f.p_value);
  const char* const effort = map.is_linear ? "force" : "torque";
  const std::string what = f.order == 0 ? fmt::format("a {} of {} {} at {} {}", effort, output::number(f.size_nm, 3),
                                                      torque_unit(map), text_of(f.velocity), velocity_unit(map))
                                        : fmt::format("a {} of order {} of the motor's turn, amplitude {} {}", effort,
                                                      f.order, output::number(f.size_nm, 3), torque_unit(map));
  return fmt::format("{} +- {}; {}, corrected for the number of tests", what, output::number(f.std_nm, 2), p_value);
}
void print(const drive::MapTest& j, const ResidualMap& map, double limit_nm, Console& console) {
  switch (j.verdict) {
    case MapVerdict::too_little_data:
      return console.line(
          "Too little data: 0.4 s at a velocity are needed. Move the drive with feedforward of its model (record "
          "--compensate), then read it again.");
    case MapVerdict::model_fits:
      return console.line(console.good("The model fits") +
                          fmt::format(": nothing certain above {} {} at the {} velocities that were seen.",
                                      output::number(limit_nm, 3), torque_unit(map), j.tested_bins));
    case MapVerdict::model_fails:
      console.line(console.bad("The model fails") + " here:");
      for (const MapFinding& f : j.findings) console.line("  " + text_of(f, map));
  }
}

}  // namespace

int run_residual_map(const MonitorOptions& options, Console& console) {
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  const drive::Scales scales = drive::scales_of(session);
  console.line(named(session));
  const bool started = drive::start_residual_map(session, signer);
  const Interruptible interruptible;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.seconds);
  while (std::chrono::steady_clock::now() < end && !Interruptible::interrupted())
    std::this_thread::sleep_for(transport::Milliseconds(20));
  const ResidualMap map = drive::read_residual_map(session, scales);
  const double limit_nm = options.limit_nm.value_or(drive::usual_map_limit_nm(scales));
  const drive::MapTest test = drive::test_map(map, limit_nm);
  if (started)
    console.line(
        "The residual map was not recorded before (first reading, or a new block). Recording starts now; read it again "
        "after some motion.");
  show(map, console);
  print(test, map, limit_nm, console);
  if (options.reset) {
    drive::reset_residual_map(session, signer);
    console.line("The residual map is empty again.");
  }
  json answer = drive::map_json(map, test, limit_nm);
  answer["format"] = "flexspline-residual-map/1";
  answer["drive"] = {{"serial", session.serial()}, {"board", session.board()}};
  answer["started"] = started;
  answer["reset"] = options.reset;
  output::save_json(options.json, answer);
  return kDone;
}

}  // namespace flexspline::cli
