#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace flexspline::plant {

/// Torque and its slope over the torsion.
struct TorqueSlope {
  double torque = 0.0;
  double slope = 0.0;
};

/// T' = sigma v |1 - T/Tc s(v)|^i s(1 - T/Tc s(v)); with `torque_share` the bound is Tc + torque_share |T total|.
struct DahlLoop {
  double torque = 0.0;
  double stiffness = 0.0;
  double exponent = 1.0;
  double torque_share = 0.0;
};

/// T' = a |v| (phi(x) - T) + b v with phi a cubic of the torsion.
struct DuhemLoop {
  double rate = 0.0;
  double stiffness = 0.0;
  std::array<double, 4> phi{};
};

/// stiffness z, z' = v - beta |v| |z|^(n-1) z - gamma v |z|^n.
struct BoucWenLoop {
  double stiffness = 0.0;
  double beta = 0.0;
  double gamma = 0.0;
  double exponent = 1.0;
};

/// A play of half-width `threshold`, weighted.
struct Play {
  double threshold = 0.0;
  double weight = 0.0;
};

/// A relay that goes to +1 at `high` and to -1 at `low`.
struct Relay {
  double high = 0.0;
  double low = 0.0;
  double weight = 0.0;
};

/// The states of the loops, and the torsion to which they belong.
struct LoopState {
  static constexpr int kLoops = 6;
  static constexpr int kPlays = 16;
  static constexpr int kRelays = 288;
  double torsion = 0.0;
  double total_torque = 0.0;  ///< of the flexspline, for bounds that grow with it
  std::array<double, kLoops> inner{};
  std::array<double, kPlays> play{};
  std::array<std::int8_t, kRelays> relay{};
};

/// All hysteresis laws of a drive; each adds to the torque of the flexspline and depends on the torsion only, not on
/// its rate.
struct Loops {
  std::vector<DahlLoop> dahl;
  std::vector<DuhemLoop> duhem;
  std::vector<BoucWenLoop> bouc_wen;
  std::vector<Play> plays;
  std::vector<Relay> relays;

  bool empty() const { return dahl.empty() && duhem.empty() && bouc_wen.empty() && plays.empty() && relays.empty(); }
  /// The state after the torsion changed, in one direction, to `torsion`. Dahl's laws in closed form, the others by
  /// Runge and Kutta with at least 50 steps for each characteristic length. Relays switch only where the state is
  /// `kept`: a solver that evaluates ahead must not see their jumps.
  LoopState ahead(const LoopState& from, double torsion, bool kept) const;
  /// Torque of a state, with its slope in the direction of `sign`.
  TorqueSlope torque(const LoopState& state, double sign) const;
  /// A gear that was cycled until its history has no influence.
  LoopState at_rest() const;
};

/// Torque along a prescribed path of the torsion (rad), N m: `loops` in parallel with a spring of this stiffness and
/// cubic stiffness.
std::vector<double> torque_along(const Loops& loops, double stiffness, double cubic_stiffness,
                                 const std::vector<double>& torsion);

}  // namespace flexspline::plant
