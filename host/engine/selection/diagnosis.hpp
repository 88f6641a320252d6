// Which physical effect is missing from a model, or that none is.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/trends.hpp"
#include "host/engine/selection/unknown_structure.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/order_causes.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::selection {

struct NamedEffect {
  std::string effect;
  std::optional<double> order;
  bool operator==(const NamedEffect&) const = default;
};

// The smallest effect that these data, with this model, would have shown.
struct Detectable {
  // The smallest value that would be named: of the effect's only size, of the first of several in their usual ratio,
  // or, as "amplitude", of a wave at the phase that is seen worst. Without std and interval.
  estimation::Estimate size;
  bool at_most = false;                  // an effect that grows as this falls: a limit that it stays below
  std::vector<estimation::Estimate> at;  // nonlinear parameters at which that holds
};

// Why an effect is confounded with another one in these data.
struct ConfoundingReason {
  std::string effect;
  double own_percent = 0.0;  // of its torque that is orthogonal to the other
  std::string variable;      // over which both do the same; empty: no single one
};

// What the model lacks over the variable in which an effect shows most, and what the effect makes of it.
struct Evidence {
  std::string variable, unit;
  bool resisting = false;  // torques count as positive where they resist the motion
  double share_percent = 0.0;
  struct Bin {
    double low = 0.0, high = 0.0;
    double lacking = 0.0;  // mean, N m
    double effect = 0.0;
  };
  std::vector<Bin> bins;
};

// The torque of an effect that the model cannot replace (orthogonal to the model's regressors), on the samples of the
// fit.
struct EffectSize {
  double rms = 0.0, peak = 0.0;            // N m, N on a linear axis
  std::optional<double> percent_of_rated;  // the RMS, of the rated torque on this balance; none: not stated
};

struct Candidate {
  std::string effect;
  std::optional<double> order;
  estimation::Balance balance = estimation::Balance::motor;
  double score = 0.0;                  // decrease of the cross-validated deviance, less k ln(n_eff)
  double other_balance_score = 0.0;    // on the other balances that the effect acts on, with the same parameters
  double chi2_decrease_percent = 0.0;  // cross-validated
  double rmse_cv_before = 0.0;
  double rmse_cv_after = 0.0;
  std::optional<double> p_value;
  std::vector<estimation::Estimate> parameters;
  bool admissible = true;
  std::string why_not;  // where it is not admissible
  // It is named for another reason than its own fit.
  void admit() {
    admissible = true;
    why_not.clear();
  }
  std::vector<std::string> cannot_distinguish;
  std::vector<ConfoundingReason> confounding_reasons;
  std::optional<Evidence> evidence;  // of named effects
  std::optional<EffectSize> size;    // of named effects
  std::optional<Detectable> minimum_detectable;
  std::string note;  // what its values mean, where that differs from the effect's name
  // Of presliding: what all samples, those around reversals among them, say against it. Nothing where they were not
  // asked; empty where nothing does.
  std::optional<std::string> presliding_doubt;
  bool is_lag = false;  // values, errors, score and size are those of the lag that every model has as a column
  // What on this drive makes its order, and which fact of the drive would tell more.
  std::vector<catalogue::OrderCause> order_causes;
  std::string order_hint;
};

struct LocalisedResidual {
  std::string variable;
  double share_percent = 0.0;
};

// An interval in which something acted on the axis that no model of the drive explains.
struct Disturbance {
  std::string experiment;
  double from_s = 0.0;
  double to_s = 0.0;
  double peak = 0.0;
  std::string unit;
};

// The result of resampling: how often a term is chosen on halves of the data, over bandwidths and with and without
// reversals.
struct Resampling {
  struct FoundTerm {
    std::vector<NamedEffect> group;  // more than one: these data cannot distinguish them; empty: in no catalogue
    std::string name;                // of what is in no catalogue
    double frequency = 0.0;          // of the subsamples
    double least_by_mask = 1.0;      // of those with reversals, or of those without: the lesser one
    double share_percent = 0.0;      // of the squared error above the noise, median of the subsamples
    double share_low_percent = 0.0, share_high_percent = 0.0;  // of 95 % of the subsamples
    // Error on the experiments that are held out, with it over without it; nothing where none are.
    std::optional<double> held_out_ratio;
    bool refused_by_holdout = false;  // in the catalogue, but the held-out error rises with it
    bool is_second_choice = false;    // found without the terms that the held-out error refused
    bool may_be_sticking = false;     // presliding whose travel is no longer than what the encoder hides
    // The squared error on the experiments that are held out falls by as much as a term must take off.
    bool is_confirmed() const;
    // It falls by as much as an effect that matters.
    bool is_strongly_confirmed() const;
    // It falls by more than what stays, so that nothing else can be the larger part of what is missing.
    bool is_most_of_held_out_error() const;
    // It is in no catalogue, and the data show it for certain: held-out experiments confirm it by the share that a law
    // has to take off; without any, nearly all subsamples chose it.
    bool is_unknown_structure() const;
  };
  // How often a term was chosen, or was nearly as good as what was; zero for one that never was.
  struct Support {
    std::string effect;
    std::optional<double> order;
    double frequency = 0.0;
  };
  double subsamples = 0.0;
  bool torque_has_noise = false;  // of its sensor, so that what reads the measured torque also explains its noise
  bool too_little = false;        // there are not enough samples for halves
  double abstained = 0.0;         // saw nothing above the noise
  // Von Neumann's ratio, halved, of what the best terms leave, reversals masked: 1 for noise, 0 for structure.
  double von_neumann_ratio = 0.0;
  double lowest_hz = 0.0, highest_hz = 0.0;
  std::optional<double> lag_s, lag_std_s;  // of the effort's time base, taken off; nothing: not significant
  std::vector<FoundTerm> found;            // largest share first
  std::vector<std::string> not_visible;    // effects that these data could not show to resampling
  std::vector<FoundTerm> undecided;        // in the catalogue; neither found nor ruled out
  std::vector<Support> support;            // of all terms that could be chosen
  // The group that a name was found in.
  std::vector<NamedEffect> found_group(const NamedEffect& name) const;
  // Whether these data could show an effect to resampling at all: what corrects the effort needs peaks of it.
  bool is_visible(std::string_view effect) const;
  bool decides = false;  // about the verdict; else likelihood does
};

// Where a law is named by how friction differs between records.
struct BetweenRecords {
  std::size_t records = 0;
  double explained_percent = 0.0;  // of the variance between records
  double p_value = 1.0;            // by permutation of the records
};

// A law that the friction of the slower, or of the faster, records follows, but not that of all: it is not named.
struct LawInRange {
  std::vector<std::string> effects;  // more than one: not distinguished
  std::size_t records = 0, of_records = 0;
  double lowest_speed = 0.0, highest_speed = 0.0;  // rms of the records, in speed_unit
  std::string speed_unit;                          // rad/s, or m/s on a linear axis
  double explained_percent = 0.0;                  // of the variance between the records of the range
  double p_value = 1.0;                            // by permutation; that ranges were tried is counted
  double p_value_of_all = 1.0;                     // of the best law over all records
};

enum class Verdict {
  missing_effect,
  confusable_effects,
  at_noise_floor,
  nothing_significant,
  unknown_structure,
  insufficient_excitation,
};
std::string verdict_name(Verdict verdict);

// Effects of which these data cannot tell whether the model lacks them.
struct PossibleEffect {
  std::vector<NamedEffect> group;  // more than one: not distinguished
  std::string why_not;             // it is not named
  // Of the subsamples that chose one of them, and error on the experiments that are held out, with it over without it.
  std::optional<double> frequency, held_out_ratio;
};

// What one cut-off or mask would give alone, where the user states one.
struct StatedSetting {
  Verdict verdict = Verdict::nothing_significant;
  std::vector<NamedEffect> named;
};

// Noise of the records whose noise is known, where that of others is not.
struct NoiseOfSome {
  std::vector<std::string> records;
  double rmse = 0.0, noise = 0.0;  // of the balance on these records
  std::string from;                // as noise_floor_from
};

struct Diagnosis {
  Verdict verdict = Verdict::nothing_significant;
  std::vector<NamedEffect> named;
  std::optional<estimation::Balance> balance;  // of the named effect, else of the largest excess
  std::string unit;                            // of the balances' errors
  double base_rmse = 0.0;                      // with one friction for all runs, as all errors of candidates are
  double base_rmse_cv = 0.0;
  bool reversals_left_out = false;      // of these errors, as alone presliding shows there
  double base_rmse_own_friction = 0.0;  // with each run's own friction where it differs from run to run
  double target_rms = 0.0;              // of the measured side of the balance, with weights as for the errors
  std::optional<double> noise_floor;
  std::string noise_floor_from = "none";
  std::optional<NoiseOfSome> noise_of_some;
  std::vector<LocalisedResidual> localised;
  std::vector<Candidate> candidates;    // best first
  std::vector<Trend> parameter_trends;  // of the model as it is
  std::vector<Drift> friction_drift;    // with the named effect in the model
  std::vector<LocalisedResidual> remaining_structure;
  // Of the chi-square above the noise floor, the share in percent that the named effect takes off.
  std::optional<double> recovered_percent;
  std::vector<Disturbance> disturbances;
  std::vector<std::string> warnings;
  std::optional<Resampling> resampling;     // of the motor's balance
  std::vector<PossibleEffect> possible;     // not named, and not ruled out
  bool partial = false;                     // more is missing than what is named
  std::optional<UnknownStructure> unknown;  // where the verdict is unknown_structure and a curve shows what it is
  std::optional<BetweenRecords> between_records;
  std::optional<LawInRange> law_in_range;
  std::optional<double>
      delay_s;  // of the effort against the motion, where significant; the half sample of a held one is out
  std::string delay_advice;    // where it is large enough to matter
  std::string untried_advice;  // which effects these signals cannot show, where something is missing that is not named
  std::optional<StatedSetting> at_stated_setting;
};

struct Options {
  estimation::PipelineOptions pipeline;
  std::function<void(std::string_view)> progress;  // called at each stage; may be empty
};

// The method is in METHOD.md. Experiments of role fit are fitted on; held-out ones decide about names. The model need
// not have values: all free parameters are estimated. A verdict must not depend on a cut-off or a mask, so it is made
// at those that are found in the data; where `options` state others, at_stated_setting says what these would give
// alone.
Diagnosis diagnose(const data::Dataset& dataset, const model::Model& model, const Options& options);

}  // namespace flexspline::selection
