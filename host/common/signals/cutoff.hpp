#pragma once

#include <span>
#include <string>

namespace flexspline::signals {

/// A cut-off for the filters of the identification, with the facts that it rests on.
struct CutoffChoice {
  double cutoff_hz = 0.0;
  /// Upper end of the band with coherent power; 0 if there is none.
  double coherent_to_hz = 0.0;
  /// Mean square of the effort that is coherent with the motion, in its unit squared. Weighs records against each
  /// other.
  double coherent_power = 0.0;
  std::string reason;
};

inline constexpr double kLowestCutoffHz = 5.0;

/// Chooses the cut-off from the coherence of effort (current, force) and motion (velocity or acceleration).
///
/// Bands of a sixth of an octave count where their coherence, weighted by the power of the effort, exceeds what
/// unrelated signals reach in 5 % of cases. The coherent band ends where the bands below hold 99.9 % of the coherent
/// power, or where none counts for a factor 3.2 in frequency (the harmonics of one sine are a factor 3 apart),
/// whichever is lower. The cut-off is 1.25 times that, so that the filter takes at most 10 % there, within 5 Hz ..
/// sample_hz / 10 (the upper bound wins), rounded to two digits. Without enough data, or without coherence, it is the
/// upper bound or 5 Hz, and the reason states it.
///
/// In closed loop the controller returns encoder noise as effort: coherent, too. The power keeps it out unless it is
/// large. Throws std::invalid_argument if the lengths differ or the sample rate is not positive.
CutoffChoice choose_cutoff(std::span<const double> effort, std::span<const double> motion_velocity_or_acceleration,
                           double sample_hz);

/// How often a motion turns back, Hz: its velocity over `window_s`, beyond a fifth of its root mean square on either
/// side. Positions of one uninterrupted segment, in any unit. 0 where it is shorter than eight windows or nothing
/// moves. Throws std::invalid_argument unless 0 < sample_s <= window_s.
double reversals_hz(std::span<const double> position, double sample_s, double window_s);

enum class CutoffCombination {
  kWeightedMedian,  ///< half of the coherent power is in records with this cut-off or a lower one
  kLargest,         ///< enough for each record that holds at least 1 % of the strongest one's coherent power
};

/// One cut-off for several records. Records without coherence count only if all are so. Throws std::invalid_argument if
/// there are none.
CutoffChoice combine_cutoffs(std::span<const CutoffChoice> records,
                             CutoffCombination combination = CutoffCombination::kWeightedMedian);

}  // namespace flexspline::signals
