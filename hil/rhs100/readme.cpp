#include "hil/rhs100/readme.hpp"

#include <fmt/format.h>

namespace flexspline::rhs100 {

std::string readme(const std::vector<Set>& sets, std::uint64_t seed) {
  std::string text = fmt::format(
      R"(# rhs-100: the experiments of the report, simulated

Simulated measurements of the drive of Taghirad and Belanger's report (RHS series, 100:1, 40 N m, brushed DC motor), seed {}.
Each experiment of tables 4, 6, 7 and 8 has the parameters of its own row, so that an identification should give
that row, and the standard deviations of a table those of the report. Made by `flexspline-hil rhs-100`; nothing here was measured on a drive.

| folder | experiments | what |
| --- | --- | --- |
)",
      seed);
  for (const Set& set : sets) text += fmt::format("| `{}` | {} | {} |\n", set.name, set.experiments.size(), set.title);
  text += fmt::format(
      R"(
Each folder has `dataset.toml`, `base-model.toml` (the parameters to identify; those that the report takes as known are fixed) and
`truth.toml` (the true parameters of each experiment). The `dataset.toml` and `base-model.toml` next to this file are of the
drive as a whole: tables 4, 7 and 8 together.

    flexspline identify table-7 --model table-7/base-model.toml --out friction.toml

## From the report

Names (amplitude in percent, wave form, frequency in tenths of a hertz; 0.5 Hz where there is none), wave forms, frequencies,
percentages; velocity mode for table 7, current mode for table 8; locked output for tables 4 to 6; 1 kHz; parameters of all
rows; torque constant 4.275e-2 N m/A (table 3); inertia of the bare motor 4.376e-5 kg m^2 (table 2); table 1's first row; noise of 0.5 %
(bare motor, fast) to 2 % (slow, table 1) of each record's peak; 1 % in all other records.
Friction of locked runs is the average of tables 7 and 8, compliance of free runs equation 79.

## Chosen, because the report does not state it

| what | value | why |
| --- | --- | --- |
| wave-form codes | 1 sine, 3 triangle, 4 square, 7 composite (eq. 60), 8 asymmetric sine | four types and the asymmetric one are named, their numbers are not |
| output inertia | {} kg m^2 | reflected, {:.2g} of the motor's side |
| output friction | {} N m s/rad, {} N m | |
| 100 % in velocity mode | {} rad/s at the motor | a speed that 3.5 A can follow at 0.8 Hz |
| 100 % with the output locked | {} A | gives the torsion at which the linear and the cubic fit of tables 4 and 6 agree (about 3 mrad in 100-8) |
| 100 % in current mode, free | {} A | 18 % of less does not move a drive with table 7's Coulomb friction |
| asymmetric sine | its larger half is the amplitude | |
| the seven experiments of section 4.2.2 that are in no table | 50-3, 50-4; sines 20-1-02, 40-1-04, 60-1-06, 80-1-08, 100-1-10; eq. 79's values; role `holdout` | the ranges are given |
| encoders | {} counts at the motor, {} at the output | the report's motor has a tachometer only, whose 2 % of noise hide the motion at 0.1 rad/s; it is recorded as well |
| table 3's rows | the scan has the last column only; the others are the final decision, up and down by the printed deviation | |
| currents of the bare motor | 0.5 A at 0.5 Hz; saw-teeth of 0.30 to 0.36 A at 0.2 to 0.5 Hz | |
| table 1: load | {} N m with the composite, {} with the saw-tooth, constant | with the smaller one both directions break away in the same way |
| table 1: inputs | composite 3 A at 0.25, 0.5, 0.75 Hz, 180 s; saw-tooth 0.7 A at 0.5 Hz, 60 s | three harmonics, and slow |
| lengths | 10 to 20 s, at least three periods | |
)",
      kOutputInertia, kOutputInertia / 1e4 / 1.04e-4, kOutputViscous, kOutputCoulomb, kFullVelocity, kFullLockedCurrent,
      kFullSlowCurrent, kMotorCounts, kOutputCounts, kSimulationLoad, kSlowSimulationLoad);
  return text;
}

}  // namespace flexspline::rhs100
