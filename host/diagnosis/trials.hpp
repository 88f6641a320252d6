// What adding each effect of the catalogue would do on one torque balance.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/diagnosis/candidates.hpp"
#include "host/diagnosis/named_score.hpp"
#include "host/diagnosis/score.hpp"

namespace flexspline::diagnosis {

// One balance with the model as it is.
struct Search {
  BalanceData* data = nullptr;
  Eigen::VectorXd keep;  // nought for rows in which a disturbance acted
  Judged base;
  std::optional<double> floor = std::nullopt;  // RMS of the noise, N m, where it is known

  bool at_floor(const Judged& judged) const;
};

struct Trial {
  Proposal proposal;
  Judged judged;
  Fall fall;
  double elsewhere = 0.0;          // score on the other balances that the effect acts on, with the same parameters
  double elsewhere_percent = 0.0;  // largest fall of left-out chi-square on those
  bool at_floor_elsewhere = true;  // on those
  bool admissible = true;
  std::string why_not;
  std::string imitated_by;  // the effect of the model that the data cannot tell it from
  std::string note;         // what is to be known of it if it is named
  bool leads = false;       // scores more than a simpler rival that comes first, by too little to tell the two apart
  bool doubtful_order = false;  // not admissible for that alone: the usual order, and the best of those that were tried

  double score() const { return fall.score + elsewhere; }
};

// Margin of score within which two effects are rivals.
inline constexpr double kRivalMargin = 10.0;
// The fall of chi-square, in percent, that says that an effect matters, not only that it is there.
inline constexpr double kNamedFallPercent = 0.5;
// A candidate of which the model can imitate all but this share is one with it in the data.
inline constexpr double kOwnShare = 0.003;
// Residual over noise floor: what the filters leave around reversals repeats with the motion, so a true model stands
// some 15 % above its floor.
inline constexpr double kAtFloor = 1.3;
// Values of a shape that the search tries first; who asks for the same finds its columns at hand.
inline constexpr std::size_t kGridPoints = 6;

// Whether an effect may be named: admissible, certain, and large enough to matter.
bool passes(const Trial& trial);

// All effects that could be added, best first; the best ones with their shapes searched continuously.
std::vector<Trial> rank(Search& search);
// Best first: admissible ones before others, by score; of rivals that leave all but the same error, the simplest.
void put_in_order(const Search& search, std::vector<Trial>& trials);

// Forward once more and back: an effect that was named because it resembles the true one is dropped when the true one
// is in. Returns the trial to name in the place of `first`, or nothing.
std::optional<Trial> eliminate(Search& search, const Trial& first);

// A Stribeck term that is sublinear friction: both amplitudes negative, over a wide range of speed.
bool is_sublinear(const Trial& trial, const BalanceData& data);
// A Stribeck term whose amplitudes are both negative: friction rises out of standstill.
bool is_rising(const Trial& trial);

// Where a parameter stands among the linear ones of a judged model, or nothing if it is not estimated there.
std::optional<std::size_t> position(const Judged& judged, std::string_view id, std::string_view parameter);

}  // namespace flexspline::diagnosis
