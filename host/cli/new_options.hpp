// The options of flexspline new. A template over CLI11's command: app.cpp alone has its header, and includes it before
// this one.
#pragma once

#include "host/cli/commands.hpp"

namespace flexspline::cli {

// Its options other than DATA and --tolerate.
template <class Parser>
void take_new(Parser& command, NewOptions& options) {
  command.add_option("--out", options.out, "folder for dataset.toml and base-model.toml")->required()->type_name("DIR");
  command.add_option("--map", options.map, "a column of ours is theirs, in this unit; may be repeated")
      ->type_name("OURS=THEIRS[:UNIT]")
      ->allow_extra_args(false);
  command
      .add_option("--without", options.without,
                  "a column of theirs that is not to be used, whatever its name says; may be repeated")
      ->type_name("THEIRS")
      ->allow_extra_args(false);
  command
      .add_option(
          "--turn", options.turned,
          "a column of ours whose sign is the other one, as current_a where a positive current decelerates; may "
          "be repeated")
      ->type_name("OURS")
      ->allow_extra_args(false);
  command.add_option("--axis", options.axis, "rotary, or linear (m, m/s, N)")
      ->check(CLI::IsMember({"rotary", "linear"}))
      ->type_name("");
  command.add_option("--gear-ratio", options.gear_ratio, "motor turns per output turn")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  command
      .add_option("--position-side", options.position_side,
                  "where the only position and velocity are measured: link or motor. Of the link, with --gear-ratio N, "
                  "the motor's are N times those, as most robots log them together with the motor's current")
      ->check(CLI::IsMember({"link", "motor"}))
      ->type_name("");
  command.add_option("--joint", options.joint, "of a file with several joints, by the number in the names")
      ->check(CLI::NonNegativeNumber)
      ->type_name("K");
  command.add_option("--torque-constant", options.torque_constant_nm_a, "motor torque per ampere, N*m/A")
      ->check(CLI::PositiveNumber)
      ->type_name("KM");
  command.add_option("--encoder-counts", options.encoder_counts, "counts per motor turn (per metre on a linear axis)")
      ->check(CLI::PositiveNumber)
      ->type_name("COUNTS");
  command
      .add_option("--pole-pairs", options.pole_pairs, "of the motor, where the log has its speed in electrical turns")
      ->check(CLI::Range(1, 1000))
      ->type_name("P");
  command.add_flag("--force", options.force, "write over a dataset.toml and base-model.toml that are there");
}

}  // namespace flexspline::cli
