#include "host/diagnosis/other_balances.hpp"

#include <algorithm>
#include <cmath>

#include "host/diagnosis/imitation.hpp"
#include "host/regression/both_balances.hpp"
#include "host/regression/in_parallel.hpp"

namespace flexspline::diagnosis {
namespace {

// The other balance's own terms as they stand there; all others as the trial found them.
Terms as_seen_by(const Search& other, const Trial& trial) {
  Terms terms = trial.judged.terms;
  for (regression::Term& term : terms) {
    if (term.entry->told_by() != other.data->balance()) continue;
    const auto own = std::find_if(other.base.terms.begin(), other.base.terms.end(),
                                  [&](const regression::Term& t) { return t.id == term.id; });
    if (own != other.base.terms.end()) term = *own;
  }
  return terms;
}

// Free parameters of the added effect that its balance determines, with their values and their places in the
// covariance.
struct Found {
  std::vector<std::size_t> parameters;
  std::vector<Eigen::Index> at;
};
Found found_of(const Search& told, Trial& trial) {
  Found found;
  Judged& judged = trial.judged;
  const std::size_t added = judged.terms.size() - 1;
  const auto on_balance =
      regression::terms_on(judged.terms, told.data->balance(), told.data->prepared().torque_measured);
  std::vector<Slot> slots = judged.linear;
  const std::vector<Slot> shapes = regression::free_shape_slots(judged.terms, on_balance);
  slots.insert(slots.end(), shapes.begin(), shapes.end());
  for (std::size_t j = 0; j < slots.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (slots[j].term != added || !std::isfinite(judged.covariance(at, at))) continue;
    found.parameters.push_back(slots[j].parameter);
    found.at.push_back(at);
    // Shapes stand where they were searched; the fit moved them from there.
    if (j >= judged.linear.size()) {
      judged.terms[added].values[slots[j].parameter] += judged.theta[at];
      judged.theta[at] = 0.0;
    }
  }
  return found;
}

// Moves the added effect's parameters to where both balances have them, and returns the score there less what the move
// costs where they are told.
double score_on(Search& other, Trial& trial, const Found& found) {
  BalanceData data = *other.data;
  Terms terms = as_seen_by(other, trial);
  const std::size_t added = terms.size() - 1;
  const double tau = std::max(1.0, other.base.autocorrelation_time);
  const Eigen::VectorXd residual = other.base.residual - data.term_torque(terms, added);
  const regression::Testimony says =
      regression::testimony_of(regression::reaching_columns(data, terms, added, found.parameters),
                               model_columns(data, other.base.terms), residual, other.base.root_weights, tau);
  const regression::Agreement both =
      regression::agree(regression::scaled_inverse(trial.judged.covariance(found.at, found.at)), says);
  if (!both.change.allFinite()) return 0.0;
  for (std::size_t k = 0; k < found.parameters.size(); ++k)
    terms[added].values[found.parameters[k]] += both.change[static_cast<Eigen::Index>(k)];
  trial.judged.terms.back().values = terms[added].values;
  // No parameter is free there, so none is paid for.
  const Judged judged = judge(data, terms, other.keep);
  trial.at_floor_elsewhere = trial.at_floor_elsewhere && other.at_floor(judged);
  const Fall fall = fall_of(other.base, judged, 0.0);
  trial.elsewhere_percent = std::max(trial.elsewhere_percent, fall.chi2_percent);
  return fall.score - both.cost;
}

bool acts_on(const catalogue::Entry& entry, const Search& told, const Search& other) {
  return &other != &told && entry.adds_to(other.data->balance());
}

}  // namespace

std::vector<Search*> others_of(const std::vector<Search*>& all, const Search& told, const Trial& trial) {
  std::vector<Search*> others;
  if (!told.data->prepared().torque_measured) return others;  // the motor's balance is the only one
  for (Search* other : all)
    if (acts_on(*trial.proposal.entry, told, *other)) others.push_back(other);
  return others;
}

void hear_other_balances(const std::vector<Search*>& all, Search& told, std::vector<Trial>& trials) {
  // Those as well of which the own balance hardly tells: a sensor's offset is a small one to the spring, and all to a
  // load that moves freely.
  std::vector<Trial*> heard;
  for (Trial& trial : trials)
    if (trial.admissible && !others_of(all, told, trial).empty()) heard.push_back(&trial);
  if (heard.empty()) return;
  regression::in_parallel(heard.size(), [&](std::size_t i) {
    Trial& trial = *heard[i];
    const Found found = found_of(told, trial);
    if (found.parameters.empty()) return;
    for (Search* other : others_of(all, told, trial)) trial.elsewhere += score_on(*other, trial, found);
    if (trial.fall.score <= kNamedScore || trial.score() > kNamedScore) return;
    trial.admissible = false;
    trial.why_not = "it acts on another torque balance as well, and that one fits worse with it";
  });
  put_in_order(told, trials);
}

}  // namespace flexspline::diagnosis
