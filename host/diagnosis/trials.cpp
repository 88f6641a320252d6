#include "host/diagnosis/trials.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "host/regression/in_parallel.hpp"
#include "host/regression/least_squares.hpp"
#include "host/regression/pivoted_qr.hpp"
#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

using regression::Term;

// Relative change of the squares that ends the search: well below one by score.
constexpr double kSameSquares = 1e-5;
constexpr std::size_t kFineGridPoints = 24;
// A candidate that takes as much off the left-out chi-square may change the base model as it likes.
constexpr double kAllExplainedPercent = 99.0;
constexpr std::size_t kRefined = 4;  // candidates whose shapes are searched continuously

// On `coarse`, the same rows from fewer samples.
void choose_shapes(Search& search, BalanceData& coarse, Proposal& proposal) {
  Term& added = proposal.extended.back();
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_shape(p) || begins_at_nought(added, p)) continue;
    double best = added.values[p], least = std::numeric_limits<double>::infinity();
    // What no linear parameter scales fits at its place only.
    const std::size_t points = added.entry->count(effects::Kind::linear) == 0 ? kFineGridPoints : kGridPoints;
    for (const double value : regression::shape_grid(regression::shape_range(*search.data, added, p), points)) {
      added.values[p] = value;
      const double squares = squares_left(coarse, proposal.extended, search.base);
      if (squares < least) {
        least = squares;
        best = value;
      }
    }
    added.values[p] = best;
  }
}

// The effect of the model whose column looks most like that of the added one.
std::string imitator(BalanceData& data, const Judged& judged, std::size_t added) {
  std::string best = "the model";
  double most = 0.0;
  for (const Slot& own : judged.linear) {
    if (own.term != added) continue;
    const Eigen::VectorXd column = data.column(judged.terms, own);
    for (const Slot& other : judged.linear) {
      if (other.term == added) continue;
      const Eigen::VectorXd& theirs = data.column(judged.terms, other);
      const double norm = column.norm() * theirs.norm();
      const double alike = norm > 0.0 ? std::abs(column.dot(theirs)) / norm : 0.0;
      if (alike > most) {
        most = alike;
        best = judged.terms[other.term].id;
      }
    }
  }
  return best;
}

bool scales_torques(const Terms& terms) {
  return std::any_of(terms.begin(), terms.end(),
                     [](const Term& t) { return (t.entry->info->reads & effects::kTorqueScale) != 0; });
}

// A candidate that needs an impossible value, or that makes the base model impossible, is a fit and no explanation.
void check_admissible(BalanceData& data, const Judged& base, Trial& trial) {
  const auto& judged = trial.judged;
  const auto refuse = [&](std::string why) {
    if (trial.admissible) trial.why_not = std::move(why);
    trial.admissible = false;
  };
  const std::size_t added = judged.terms.size() - 1;
  bool any_own = judged.terms[added].entry->count(effects::Kind::linear) == 0;
  for (std::size_t j = 0; j < judged.linear.size(); ++j) {
    const Term& t = judged.terms[judged.linear[j].term];
    const auto& info = t.entry->parameters[judged.linear[j].parameter];
    const double value = judged.theta[static_cast<Eigen::Index>(j)];
    if (judged.linear[j].term == added) {
      any_own = any_own || judged.own_share[static_cast<Eigen::Index>(j)] > kOwnShare;
      if (value < info.low || value > info.high)
        refuse(fmt::format(
            "its {} would be {:.3g} {}, which is not possible", info.name, value,
            catalogue::unit_on(info.unit, data.prepared().rotary ? data::Axis::rotary : data::Axis::linear)));
      continue;
    }
    // Friction, inertia and stiffness have a sign; offsets and asymmetries may have any. What the candidate can draw
    // itself may go over to it.
    if (info.low != 0.0) continue;
    if (catalogue::names_contain(judged.terms[added].entry->info->contains, t.entry->name())) continue;
    const auto before = position(base, t.id, info.name);
    if (!before) continue;
    const double was = base.theta[static_cast<Eigen::Index>(*before)];
    if (was <= 5.0 * base.std[static_cast<Eigen::Index>(*before)]) continue;
    // A coefficient moves with its exponent, so torques are compared, not numbers.
    const std::size_t old = base.linear[*before].term;
    const Eigen::VectorXd torque = data.term_torque(base.terms, old);
    // An effect that is hardly larger than what is missing is not known well enough to rule anything out.
    if (torque.norm() < 2.0 * base.residual.norm()) continue;
    // Where all but nothing is left the base model was worth nothing; unless all torques shrank together.
    if (trial.fall.chi2_percent > kAllExplainedPercent && !scales_torques(judged.terms)) continue;
    // Of the larger one: without what is missing an effect may be found half as large as it is, or twice.
    const Eigen::VectorXd now = data.term_torque(judged.terms, judged.linear[j].term);
    const double change = (now - torque).norm() / std::max(torque.norm(), now.norm());
    if (change > 0.5)
      refuse(fmt::format("{} would change by {:.0f} % (its {} from {:.3g} to {:.3g})", t.id,
                         100.0 * (now - torque).norm() / torque.norm(), info.name, was, value));
  }
  if (!any_own) {
    trial.imitated_by = imitator(data, judged, added);
    refuse(fmt::format("{} can imitate it in these data", trial.imitated_by));
  }
}

// Shapes that begin at nought, where the fit moved them: the model is all but linear in them there.
void take_first_step(const BalanceData& data, Judged& judged) {
  const auto on_balance = regression::terms_on(judged.terms, data.balance(), data.prepared().torque_measured);
  const std::vector<Slot> shapes = regression::free_shape_slots(judged.terms, on_balance);
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    Term& added = judged.terms.back();
    double& step = judged.theta[static_cast<Eigen::Index>(judged.linear.size() + k)];
    if (&judged.terms[shapes[k].term] != &added || !begins_at_nought(added, shapes[k].parameter)) continue;
    added.values[shapes[k].parameter] += step;
    step = 0.0;
  }
}

Trial evaluate(Search& search, Proposal proposal) {
  Trial trial;
  trial.judged = judge(*search.data, proposal.extended, search.keep);
  take_first_step(*search.data, trial.judged);
  trial.fall = fall_of(search.base, trial.judged, proposal.added);
  trial.proposal = std::move(proposal);
  check_admissible(*search.data, search.base, trial);
  return trial;
}

bool better(const Trial& a, const Trial& b);

// Where the best shape makes the model impossible, the best of those that do not: a bound that the model's own meaning
// sets. Returns `refused` where there is none.
Trial best_admissible(Search& search, Proposal proposal, Trial refused) {
  Term& added = proposal.extended.back();
  if (refused.fall.score < kNamedScore) return refused;
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_shape(p) || begins_at_nought(added, p)) continue;
    const double chosen = added.values[p];
    for (const double value : regression::shape_grid(regression::shape_range(*search.data, added, p), kGridPoints)) {
      if (value == chosen) continue;
      added.values[p] = value;
      Trial trial = evaluate(search, proposal);
      if (better(trial, refused)) refused = std::move(trial);
    }
    added.values[p] = chosen;
  }
  return refused;
}

// Of the base model, for the choice of orders.
Unexplained left_by(BalanceData& data, const Judged& base) {
  Unexplained left;
  left.root_weights = base.root_weights;
  left.residual = base.root_weights.cwiseProduct(base.residual);
  if (base.linear.empty()) return left;
  const Eigen::MatrixXd X = base.root_weights.asDiagonal() * regression::columns_of(data, base.terms, base.linear);
  left.own = regression::PivotedQr(X).span();
  return left;
}

bool better(const Trial& a, const Trial& b) {
  if (a.admissible != b.admissible) return a.admissible;
  return a.score() > b.score();
}

}  // namespace

std::optional<std::size_t> position(const Judged& judged, std::string_view id, std::string_view parameter) {
  for (std::size_t j = 0; j < judged.linear.size(); ++j) {
    const Term& t = judged.terms[judged.linear[j].term];
    if (t.id == id && t.entry->parameters[judged.linear[j].parameter].name == parameter) return j;
  }
  return std::nullopt;
}

bool Search::at_floor(const Judged& judged) const {
  return floor && judged.rmse() < kAtFloor * *floor;
}

bool passes(const Trial& t) {
  // What differs from record to record only, as temperature does, takes from the deviations and hardly from the rest.
  return t.admissible && t.score() > kNamedScore &&
         std::max({t.fall.chi2_percent, t.fall.alike_percent, t.elsewhere_percent}) > kNamedFallPercent;
}

// Whether the law bends over a travel that the encoder resolves in few steps: what it leaves there is the encoder's.
bool is_smeared(const BalanceData& data, const Trial& trial) {
  constexpr double kFewQuanta = 20.0;
  const Term& added = trial.judged.terms.back();
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_shape(p) || added.entry->parameters[p].limit != effects::Limit::travel) continue;
    for (const RowRange& range : data.records()) {
      const std::optional<double>& quantum = data.prepared().records[range.record].motor_quantum;
      if (quantum && added.values[p] < kFewQuanta * *quantum) return true;
    }
  }
  return false;
}

// How much more a simpler law may leave than one with more to bend: of the error itself, as a ratio of squares, and of
// what was missing. From drives with laws of friction and hysteresis of which one contains the other: where the simpler
// one was the truth the other took 0.02 % of what was missing (an encoder that smears it 0.8 %), by however much it
// led; where the wider one was, at least 0.2 %.
struct Same {
  double left, share_of_fall;
};
constexpr Same kTheSame{2.25, 0.001}, kHardlyMore{1.21, 0.005}, kTheSameSmeared{2.89, 0.01};

// A law that contains another fits at least as well. Of the best one and its rivals in the catalogue that leave all but
// the same error the one with the fewest parameters comes first.
void prefer_simple(const Search& search, std::vector<Trial>& trials) {
  const Judged& base = search.base;
  constexpr double kDozens = 12.0;
  for (Trial& trial : trials) trial.leads = false;
  if (trials.empty() || !passes(trials.front())) return;
  const Trial& best = trials.front();
  // Left-out squares over the noise of each record as the best one has it: a loud record must not decide alone.
  const std::vector<LeftOut> noise = best.judged.left_out;
  const auto chi2 = [&](const Judged& judged) {
    double sum = 0.0;
    for (std::size_t i = 0; i < noise.size(); ++i)
      sum += judged.left_out[i].squares * noise[i].rows / std::max(noise[i].squares, 1e-300);
    return sum;
  };
  const double least = chi2(best.judged), fall = chi2(base) - least;
  std::size_t simplest = 0;
  bool told_apart = true;
  for (std::size_t i = 1; i < trials.size(); ++i) {
    const Trial& other = trials[i];
    // A law of dozens of parameters is everyone's rival.
    const bool dozens = best.proposal.added >= other.proposal.added + kDozens;
    const bool rivals = dozens ||
                        catalogue::names_contain(best.proposal.entry->info->rivals, other.proposal.entry->name()) ||
                        catalogue::names_contain(other.proposal.entry->info->rivals, best.proposal.entry->name());
    if (!rivals || !passes(other) || other.proposal.added >= trials[simplest].proposal.added) continue;
    const double left = chi2(other.judged);
    const auto within = [&](const Same& same) {
      return left <= same.left * least && left - least <= same.share_of_fall * fall;
    };
    const bool same =
        within(is_smeared(*search.data, other) ? kTheSameSmeared : kTheSame) || (dozens && within(kHardlyMore));
    if (!same && !(best.score() - other.score() <= kRivalMargin && within(kHardlyMore))) continue;
    simplest = i;
    told_apart = same;
  }
  trials.front().leads = !told_apart;
  std::rotate(trials.begin(), trials.begin() + static_cast<std::ptrdiff_t>(simplest),
              trials.begin() + static_cast<std::ptrdiff_t>(simplest) + 1);
}

std::vector<Trial> rank(Search& search) {
  std::vector<Proposal> tried = proposals(*search.data, search.base.terms, left_by(*search.data, search.base));
  std::vector<Trial> trials(tried.size());
  regression::Prepared few;
  BalanceData thinned = search.data->thinned(few);
  thinned.columns(search.base.terms, search.base.linear);
  // Each on its own copy of the data, with the columns that are there: the result is that of one thread.
  regression::in_parallel(tried.size(), [&](std::size_t i) {
    BalanceData data = *search.data, coarse = thinned;
    Search own{&data, search.keep, search.base};
    Proposal& proposal = tried[i];
    choose_shapes(own, coarse, proposal);
    trials[i] = evaluate(own, proposal);
    if (!trials[i].admissible) trials[i] = best_admissible(own, std::move(proposal), std::move(trials[i]));
  });
  // By score alone: a shape that is only near may make the model impossible where the best one does not.
  std::stable_sort(trials.begin(), trials.end(),
                   [](const Trial& a, const Trial& b) { return a.fall.score > b.fall.score; });
  std::vector<Trial*> unrefined;
  for (Trial& trial : trials) {
    const Term& added = trial.proposal.extended.back();
    bool has_shape = false;
    for (std::size_t p = 0; p < added.values.size(); ++p) has_shape = has_shape || added.free_shape(p);
    if (has_shape && trial.fall.score >= kNamedScore && unrefined.size() < kRefined) unrefined.push_back(&trial);
  }
  regression::in_parallel(unrefined.size(), [&](std::size_t i) {
    Trial& trial = *unrefined[i];
    BalanceData data = *search.data, coarse = thinned;
    Search own{&data, search.keep, search.base};
    Proposal refined = trial.proposal;
    refined.extended = trial.judged.terms;
    const auto on_balance = regression::terms_on(refined.extended, data.balance(), data.prepared().torque_measured);
    regression::refine_shapes(data, refined.extended, on_balance, whitening_of(data, trial.judged), kSameSquares,
                              &coarse);
    Trial again = evaluate(own, std::move(refined));
    if (better(again, trial) || !trial.admissible) trial = std::move(again);
  });
  put_in_order(search, trials);
  return trials;
}

void put_in_order(const Search& search, std::vector<Trial>& trials) {
  std::stable_sort(trials.begin(), trials.end(), better);
  prefer_simple(search, trials);
}

bool is_rising(const Trial& trial) {
  const Term& term = trial.judged.terms.back();
  return term.entry->name().starts_with("stribeck_") && term.values[term.entry->index_of("amplitude_positive")] < 0.0 &&
         term.values[term.entry->index_of("amplitude_negative")] < 0.0;
}

// Friction that rises out of standstill over a wide range of speed is a concave friction curve, whatever its formula
// (EFFECTS): a Stribeck term with two negative amplitudes is then reported as sublinear friction.
bool is_sublinear(const Trial& trial, const BalanceData& data) {
  if (trial.proposal.entry->name() != "stribeck_gaussian" || !is_rising(trial)) return false;
  const Term& term = trial.judged.terms.back();
  const auto value = [&](std::string_view name) { return term.values[term.entry->index_of(name)]; };
  const regression::ShapeRange range = regression::shape_range(data, term, term.entry->index_of("velocity"));
  // The range ends at a quarter of the fast motion; wide is from a tenth of it.
  return value("velocity") > 0.4 * range.high;
}

std::optional<Trial> eliminate(Search& search, const Trial& first) {
  Search next{search.data, search.keep, first.judged};
  std::vector<Trial> more = rank(next);
  if (more.empty() || !passes(more.front())) return std::nullopt;
  const Trial& second = more.front();
  // Only what may be added to the base model alone can take the place of the first.
  Proposal alone;
  try {
    alone.extended = extend(search.base.terms, *second.proposal.entry, second.proposal.order);
  } catch (const model::ModelError&) {
    return std::nullopt;
  }
  alone.entry = second.proposal.entry;
  alone.order = second.proposal.order;
  alone.added = second.proposal.added;
  alone.extended.back().values = second.judged.terms.back().values;
  Trial instead = evaluate(search, std::move(alone));
  const Fall lost = fall_of(instead.judged, second.judged, first.proposal.added);
  if (passes(instead) && lost.score < kNamedScore) return instead;
  return std::nullopt;
}

}  // namespace flexspline::diagnosis
