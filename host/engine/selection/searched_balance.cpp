#include "host/engine/selection/searched_balance.hpp"

#include "host/engine/selection/effect_names.hpp"
#include "host/engine/selection/record_cross_validation.hpp"

namespace flexspline::selection {

void check_first(SearchedBalance& balance) {
  std::vector<CandidateFit>& candidates = balance.candidates;
  while (balance.names_one()) {
    check_by_record(balance.search, candidates);
    if (!balance.names_one()) return;
    const NamedEffect checked = name_of(candidates.front());
    // Of the torsion each record has a zero of its own, which held-out ones were not fitted for.
    if (balance.held_out)
      check_on_held_out(*balance.held_out, balance.search, candidates);
    else
      check_worth(balance.search, candidates);
    // Another one came first, which the records were not asked about.
    if (balance.names_one() && name_of(candidates.front()) == checked) return;
  }
}

}  // namespace flexspline::selection
