// How far a drive's torques can be from the equations, effect by effect and for the sum: a bound that holds for every
// input within the envelope, however long the model runs. PROOF.md explains how to read it and why it holds.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::deployment {

// The envelope: signals within two bases, as they are limited to at entry; positions within a million turns of zero,
// moved by no more in a tick than twice the rated velocity does.
inline constexpr double kMostTurns = 0x1p20;

struct ErrorPart {
  std::string id;
  std::array<double, 3> bound{};  // on each balance, in bases of torque
  std::string unproven;           // why there is no bound; empty where there is
};
struct ErrorProof {
  std::vector<ErrorPart> parts;  // of each effect as it is in the model, in the order given
  std::array<double, 3> sum{};   // of the balances, in bases
  bool holds = true;             // every part has a bound
};
// `effects` have to fit the drive.
ErrorProof prove_error(const std::vector<EffectValues>& effects, const effects::DriveConstants<double>& drive);

}  // namespace flexspline::deployment
