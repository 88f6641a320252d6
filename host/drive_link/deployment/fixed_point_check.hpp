// A model in the drive's arithmetic, compared with double.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "host/physics/model/model.hpp"
#include "shared/effects/effect.hpp"
#include "shared/model/block.hpp"

namespace flexspline::deployment {

struct EffectValues {
  std::size_t number = 0;  // of the catalogue
  std::string id;
  std::vector<double> parameters;
};

inline constexpr std::array<const char*, 3> kBalances = {"motor", "transmission", "load"};

struct Bounds {
  bool holds = false;
  std::string reason;
  std::array<double, 3> torque{};            // largest magnitude on each balance, in bases
  std::vector<std::array<double, 3>> alone;  // the same of each effect by itself
};
// The proof over intervals. Where it fails, the reason names the effect that fails by itself, if one does. Throws
// PackError where an effect does not fit: a coefficient leaves its format, or there is no place left.
Bounds prove(const std::vector<EffectValues>& effects, const effects::DriveConstants<double>& drive);

struct Difference {
  std::array<double, 3> worst{};             // in bases
  std::array<double, 3> largest{};           // torque
  std::string finding;                       // of a step that left its range; none: empty
  bool within = true;                        // the bounds
  std::vector<std::array<double, 3>> parts;  // of each effect, the worst in bases
};
// Along samples of the whole envelope.
Difference compare(const std::vector<EffectValues>& effects, const effects::DriveConstants<double>& drive,
                   const Bounds& bounds, std::size_t samples, std::uint64_t seed);

// Writes the coefficients of each effect into a block.
void write_effects(model::BlockWriter& writer, const std::vector<EffectValues>& effects,
                   const effects::DriveConstants<double>& drive);

}  // namespace flexspline::deployment
