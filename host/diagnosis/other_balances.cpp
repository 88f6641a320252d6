#include "host/diagnosis/other_balances.hpp"

#include <algorithm>

#include "host/estimation/in_parallel.hpp"

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

bool acts_on(const Trial& trial, const Search& told, const Search& other) {
  return &other != &told && trial.proposal.entry->adds_to(other.data->balance());
}

}  // namespace

void hear_other_balances(const std::vector<Search*>& all, Search& told, std::vector<Trial>& trials) {
  if (!told.data->prepared().torque_measured) return;  // the motor's balance is the only one
  std::vector<std::pair<Trial*, Search*>> heard;
  for (Trial& trial : trials)
    for (Search* other : all)
      if (trial.fall.score > kNamedScore && acts_on(trial, told, *other)) heard.emplace_back(&trial, other);
  std::vector<double> scores(heard.size());
  estimation::in_parallel(heard.size(), [&](std::size_t i) {
    const auto& [trial, other] = heard[i];
    BalanceData data = *other->data;
    // No parameter is free there, so none is paid for.
    scores[i] = fall_of(other->base, judge(data, as_seen_by(*other, *trial), other->keep), 0.0).score;
  });
  for (std::size_t i = 0; i < heard.size(); ++i) heard[i].first->elsewhere += scores[i];
  for (Trial& trial : trials) {
    if (!trial.admissible || trial.fall.score <= kNamedScore || trial.score() > kNamedScore) continue;
    trial.admissible = false;
    trial.why_not = "it acts on another torque balance as well, and that one fits worse with it";
  }
  if (!heard.empty()) put_in_order(told.base, trials);
}

}  // namespace flexspline::diagnosis
