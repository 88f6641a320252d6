// Stability selection over bandwidths, masks and halves of the data.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "host/engine/selection/candidate_tables.hpp"
#include "host/engine/selection/halves.hpp"
#include "host/engine/selection/time_lag.hpp"

namespace flexspline::selection {

struct Frequency {
  std::string name;
  const catalogue::Entry* entry = nullptr;
  std::optional<double> order;
  double frequency = 0.0;                                    // of the subsamples that do not abstain
  double share = 0.0;                                        // of the excess squares, median where it was selected
  double share_low = 0.0, share_high = 0.0;                  // of 95 % of these subsamples
  double first = 0.0;                                        // of the subsamples in which it came first
  double near = 0.0;                                         // chosen, or nearly as good as what was
  double least_near_by_mask = 1.0;                           // the same with reversals or without, the lesser one
  std::vector<std::pair<std::string, double>> alternatives;  // how often, of the times that it was chosen
};

struct Stability {
  std::vector<Frequency> frequencies;  // largest first
  double subsamples = 0.0, abstained = 0.0;
  // Of what is left, reversals masked, halved: semivariance over variance (von Neumann 1941); median of the settings.
  double von_neumann_ratio = 0.0;
};

class StabilitySelection {
 public:
  // Experiments of role fit are chosen with; those of role holdout are kept for held_out_ratios().
  StabilitySelection(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                     const estimation::Terms& terms, Balance balance, const SelectionPolicy& policy);

  const CandidateTables& tables() const { return tables_; }
  const Stability& result() const { return result_; }

  // Lag of the effort's time base, with these terms (of frequencies) in the model, where it is significant and takes
  // off as much as a term must.
  std::optional<TimeLag> time_lag(const std::vector<std::string>& names) const;
  // Selects again with that lag taken off the effort.
  void correct_lag(const TimeLag& lag);
  // Selects again without the terms of these names.
  void leave_out(const std::vector<std::string>& names);
  bool is_left_out(const std::string& name) const { return left_out_.count(name) != 0; }

  // Of each of `names` (of frequencies): held-out error of the model with all of them over that with all others, the
  // median of all settings; fitted on what is not held out. Empty where nothing is held out.
  std::vector<double> held_out_ratios(const std::vector<std::string>& names) const;

 private:
  // One bandwidth: the samples of the terms that may be seen there, for both masks.
  struct BandwidthSamples {
    double cutoff_hz = 0.0;
    std::vector<int> terms;  // of the whole table
    RegressorTable table;    // of these terms
  };
  // One bandwidth, with or without reversals.
  struct SettingResult {
    std::vector<SelectionPath> votes;  // places of terms as in the whole table
    std::vector<int> terms;            // of the whole table, those that may be seen at this bandwidth
    RegressorTable columns;            // of these terms, without samples
    double von_neumann_ratio = -1.0;
    HalfData all, held_out;
  };

  void filter_samples();
  SettingResult evaluate_setting(const BandwidthSamples& samples, bool mask, std::uint64_t seed) const;
  // Noise that the best model of all data leaves: first with the same friction in all records, then with random
  // effects, which would otherwise count as slow noise. Sets `differences`, and of `result` the sums and the ratio.
  Noise noise_of_best(const Setting& setting, const std::vector<double>& weights, FrictionRandomEffects& differences,
                      SettingResult& result) const;
  // Chooses on each of policy.pairs pairs of halves, in both directions.
  void select_on_halves(const Setting& setting, const std::vector<double>& weights,
                        const FrictionRandomEffects& differences, const Noise& noise, std::uint64_t seed,
                        SettingResult& result) const;
  void evaluate();
  void count();
  // The terms of these names that fit best together (places in setting.columns.terms); none where one cannot be seen
  // there.
  std::vector<int> terms_of(const SettingResult& setting, const std::vector<std::string>& names) const;

  SelectionPolicy policy_;
  CandidateTables tables_;
  std::vector<BandwidthSamples> samples_;   // one each bandwidth
  std::set<std::string> left_out_;          // names of terms
  std::vector<SettingResult> per_setting_;  // one each setting
  Stability result_;
};

}  // namespace flexspline::selection
