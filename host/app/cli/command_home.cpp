// Shows the positions that a drive knows, and sets the motor position.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/stored_zero.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;

struct HomeOptions {
  std::string drive;
  std::optional<double> position;     // of the motor; none: only queried
  std::filesystem::path pairing_key;  // empty: none
  bool store = false;                 // keep the zero in the drive's flash memory
  std::string json;
};

constexpr double kFarthestTurns = 0x1p23;

std::string described(const protocol::Reference& known) {
  return fmt::format("the turn of the motor is {}, the angle of the output is {}",
                     known.knows_turn ? "known" : "not known", known.knows_output ? "known" : "not known");
}

int run(const HomeOptions& options, Console& console) {
  if (!options.pairing_key.empty() && !options.store)
    throw UsageError("--pairing-key is for --store; the position itself is not locked");
  const auto signer = pairing_signer(options.pairing_key);
  drive::Session session = open_drive(options.drive);
  if (options.store) drive::require_access(session, signer);
  console.line(named(session));
  if (options.position) {
    const drive::Scales scales = drive::scales_of(session);
    const double turns = *options.position / scales.constants.angle_base;
    if (!(std::abs(turns) < kFarthestTurns))
      throw UsageError(
          fmt::format("--position-rad {:g} is further than the {:g} turns that a drive counts to; give the "
                      "angle of the motor",
                      *options.position, kFarthestTurns));
    const std::int64_t position = std::llround(std::ldexp(turns, 32));
    session.home(position);
    if (options.store) {
      const drive::Unlocked unlocked(session, signer);
      drive::store_zero(session, position);
      console.line("  The zero is stored in the parameter block of the drive.");
    }
  }
  const protocol::Reference known = session.reference();
  console.line(fmt::format("  {}", described(known)));
  if (!known.knows_turn)
    console.line("  Effects that repeat with the motor's turn are left out of the compensation until it is known.");
  if (!known.knows_output)
    console.line("  Gravity is left out of the compensation, and limits of position do not hold, until it is known.");
  output::save_json(options.json, {{"format", "flexspline-home/1"},
                                   {"drive", {{"serial", session.serial()}, {"drive", session.name()}}},
                                   {"knows_turn", known.knows_turn},
                                   {"knows_output", known.knows_output},
                                   {"stored", options.store},
                                   {"position_rad", options.position ? json(*options.position) : json()}});
  return kDone;
}

void declare(Parser& parser, HomeOptions& options) {
  take_drive(parser, options.drive);
  Option position = parser.option(
      "--position-rad", options.position,
      "the present position of the motor, m on a linear axis (default: only prints what the drive knows)");
  position.value("RAD");
  parser
      .flag("--store", options.store,
            "keep it in the drive: with absolute encoders or an index pulse it holds after the next power-on")
      .needs(position);
  take_pairing_key(parser, options.pairing_key);
}

}  // namespace

Command home_command() {
  return command<HomeOptions>(
      {"home",
       "sets the motor position of a drive",
       "Incremental encoders do not know their absolute position: until it is set, or an index pulse came, a drive "
       "leaves out of its compensation what depends on the angle, and limits of position do not hold. Bring the "
       "shaft to a mark, at rest and not armed, and give the motor's angle there, as the model's data count it. "
       "Absolute encoders at motor and output need none of this where their zeros are the shafts'; with --store the "
       "drive keeps where the zeros are. The reference is lost when the power goes, or when a fault reports that "
       "counts were lost. Without --position-rad it prints what the drive knows.",
       {"flexspline home --drive twin", "flexspline home --drive twin --position-rad 0",
        "flexspline home --drive twin --position-rad 0 --store"}},
      declare, run);
}

}  // namespace flexspline::cli
