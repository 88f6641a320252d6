#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/comparison/noise_floor.hpp"
#include "host/comparison/residual_map.hpp"
#include "host/diagnosis/candidates.hpp"
#include "host/diagnosis/diagnosis.hpp"
#include "host/diagnosis/disturbances.hpp"
#include "host/diagnosis/score.hpp"
#include "host/regression/least_squares.hpp"
#include "host/regression/shapes.hpp"

namespace flexspline::diagnosis {
namespace {

using effects::Kind;
using regression::Balance;
using regression::BalanceData;
using regression::Slot;
using regression::Term;
using regression::Terms;

// METHOD steps 6 and 8. The score's limit was set on null data; the fall says that an effect matters, not only that it
// is there.
constexpr double kNamedScore = 20.0;
constexpr double kNamedFallPercent = 0.5;
constexpr double kRivalMargin = 10.0;
// A candidate of which the base model can imitate all but this share is one with it in these data.
constexpr double kOwnShare = 0.003;
constexpr std::size_t kGridPoints = 6;
constexpr std::size_t kRefined = 4;  // candidates whose shapes are searched continuously
// Residual over noise floor: what the filters leave around reversals repeats with the motion, so a true model stands
// some 15 % above its floor.
constexpr double kAtFloor = 1.3;
// Maps of a complete model show significant shares of a few percent, too.
constexpr double kShownShare = 5.0;
constexpr double kUnexplained = 1.3;

// One balance with the model as it is, and what adding an effect would do.
struct Search {
  BalanceData* data;
  Eigen::VectorXd keep;
  Judged base;
};

struct Trial {
  Proposal proposal;
  Judged judged;
  Fall fall;
  bool admissible = true;
  std::string why_not;
  std::string imitated_by;  // the effect of the model that the data cannot tell it from
};

// Squares left after the best linear fit, with the base's weights: enough to choose a shape on a grid.
double in_sample(BalanceData& data, const Terms& terms, const Judged& base) {
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  const auto linear = regression::free_linear_slots(terms, on_balance);
  const Eigen::MatrixXd X = regression::columns_of(data, terms, linear);
  const regression::LinearFit fit =
      regression::least_squares(X, data.target() - data.known_torque(terms, on_balance), base.root_weights);
  return base.root_weights.cwiseProduct(fit.residual).squaredNorm();
}

void choose_shapes(Search& search, Proposal& proposal) {
  Term& added = proposal.extended.back();
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (!added.free_shape(p)) continue;
    double best = added.values[p], least = std::numeric_limits<double>::infinity();
    for (const double value : regression::shape_grid(regression::shape_range(*search.data, added, p), kGridPoints)) {
      added.values[p] = value;
      const double squares = in_sample(*search.data, proposal.extended, search.base);
      if (squares < least) {
        least = squares;
        best = value;
      }
    }
    added.values[p] = best;
  }
}

// The value of a parameter in a judged model, or nothing if it is not estimated there.
std::optional<std::size_t> position(const Judged& judged, std::string_view id, std::string_view parameter) {
  for (std::size_t j = 0; j < judged.linear.size(); ++j) {
    const Term& t = judged.terms[judged.linear[j].term];
    if (t.id == id && t.entry->parameters[judged.linear[j].parameter].name == parameter) return j;
  }
  return std::nullopt;
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

// A candidate that needs an impossible value, or that makes the base model impossible, is a fit and no explanation.
void check_admissible(BalanceData& data, const Judged& base, Trial& trial) {
  const auto& judged = trial.judged;
  const auto refuse = [&](std::string why) {
    if (trial.admissible) trial.why_not = std::move(why);
    trial.admissible = false;
  };
  const std::size_t added = judged.terms.size() - 1;
  bool any_own = judged.terms[added].entry->info->phase != effects::Phase::source;
  for (std::size_t j = 0; j < judged.linear.size(); ++j) {
    const Term& t = judged.terms[judged.linear[j].term];
    const auto& info = t.entry->parameters[judged.linear[j].parameter];
    const double value = judged.theta[static_cast<Eigen::Index>(j)];
    if (judged.linear[j].term == added) {
      any_own = any_own || judged.own_share[static_cast<Eigen::Index>(j)] > kOwnShare;
      if (value < info.low || value > info.high)
        refuse(fmt::format("its {} would be {:.3g} {}, which is not possible", info.name, value, info.unit.rotary));
      continue;
    }
    // Friction, inertia and stiffness have a sign; offsets and asymmetries may have any.
    if (info.low != 0.0) continue;
    const auto before = position(base, t.id, info.name);
    if (!before) continue;
    const double was = base.theta[static_cast<Eigen::Index>(*before)];
    if (was <= 5.0 * base.std[static_cast<Eigen::Index>(*before)]) continue;
    // A coefficient moves with its exponent, so torques are compared, not numbers.
    const std::size_t old = base.linear[*before].term;
    const Eigen::VectorXd torque = data.term_torque(base.terms, old);
    // An effect that is hardly larger than what is missing is not known well enough to rule anything out.
    if (torque.norm() < 2.0 * base.residual.norm()) continue;
    const double change = (data.term_torque(judged.terms, judged.linear[j].term) - torque).norm() / torque.norm();
    if (change > 0.5)
      refuse(fmt::format("{} would change by {:.0f} % (its {} from {:.3g} to {:.3g})", t.id, 100.0 * change, info.name,
                         was, value));
  }
  if (!any_own) {
    trial.imitated_by = imitator(data, judged, added);
    refuse(fmt::format("{} can imitate it in these data", trial.imitated_by));
  }
}

Trial evaluate(Search& search, Proposal proposal) {
  Trial trial;
  trial.judged = judge(*search.data, proposal.extended, search.keep);
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
    if (!added.free_shape(p)) continue;
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

bool better(const Trial& a, const Trial& b) {
  if (a.admissible != b.admissible) return a.admissible;
  return a.fall.score > b.fall.score;
}

bool passes(const Trial& t) {
  return t.admissible && t.fall.score > kNamedScore && t.fall.chi2_percent > kNamedFallPercent;
}

// All effects that could be added on one balance, best first. The best ones with their shapes searched continuously.
std::vector<Trial> rank(Search& search) {
  std::vector<Trial> trials;
  for (Proposal& proposal : proposals(*search.data, search.base.terms)) {
    choose_shapes(search, proposal);
    trials.push_back(evaluate(search, proposal));
    if (!trials.back().admissible)
      trials.back() = best_admissible(search, std::move(proposal), std::move(trials.back()));
  }
  std::sort(trials.begin(), trials.end(), better);
  for (std::size_t i = 0; i < std::min(kRefined, trials.size()); ++i) {
    Trial& trial = trials[i];
    const Term& added = trial.proposal.extended.back();
    bool has_shape = false;
    for (std::size_t p = 0; p < added.values.size(); ++p) has_shape = has_shape || added.free_shape(p);
    if (!has_shape || trial.fall.score < kNamedScore) continue;
    Proposal refined = trial.proposal;
    refined.extended = trial.judged.terms;
    const auto on_balance =
        regression::terms_on(refined.extended, search.data->balance(), search.data->prepared().torque_measured);
    regression::refine_shapes(*search.data, refined.extended, on_balance, trial.judged.root_weights);
    Trial again = evaluate(search, std::move(refined));
    if (better(again, trial) || !trial.admissible) trial = std::move(again);
  }
  std::sort(trials.begin(), trials.end(), better);
  return trials;
}

Candidate report(const Trial& trial, const Search& search, data::Axis axis) {
  Candidate c;
  c.effect = std::string(trial.proposal.entry->name());
  c.order = trial.proposal.order;
  c.balance = search.data->balance();
  c.score = trial.fall.score;
  c.chi2_fall_percent = trial.fall.chi2_percent;
  c.rmse_cv_before = search.base.rmse_cv();
  c.rmse_cv_after = trial.judged.rmse_cv();
  c.p_value = trial.fall.p_value;
  c.admissible = trial.admissible;
  c.why_not = trial.why_not;
  if (!trial.imitated_by.empty()) c.rivals.push_back(trial.imitated_by);
  const std::size_t added = trial.judged.terms.size() - 1;
  const Term& term = trial.judged.terms[added];
  for (std::size_t p = 0; p < term.values.size(); ++p) {
    regression::Estimate e;
    e.slot = {added, p};
    e.id = term.id;
    e.effect = std::string(term.entry->name());
    e.parameter = std::string(term.entry->parameters[p].name);
    e.unit = std::string(catalogue::unit_on(term.entry->parameters[p].unit, axis));
    e.value = term.values[p];
    e.fixed = term.known[p] != 0;
    if (const auto at = position(trial.judged, e.id, e.parameter)) {
      e.std = trial.judged.std[static_cast<Eigen::Index>(*at)];
      e.low = e.value - 1.96 * *e.std;
      e.high = e.value + 1.96 * *e.std;
    }
    c.parameters.push_back(std::move(e));
  }
  return c;
}

std::vector<Localised> shares(const BalanceData& data, const Judged& judged) {
  std::vector<Localised> list;
  const data::Axis axis = data.prepared().rotary ? data::Axis::rotary : data::Axis::linear;
  for (const auto& share : comparison::localise(data, judged.residual, judged.autocorrelation_time, axis))
    if (share.share_percent >= kShownShare) list.push_back({share.variable, share.share_percent});
  return list;
}

// Forward once more and back: an effect that was named because it resembles the true one is dropped when the true one
// is in. Returns the trial to name, `first` or one that makes it needless.
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

// Friction that rises out of standstill over a wide range of speed is a concave friction curve, whatever its formula
// (EFFECTS): a Stribeck term with two negative amplitudes is then reported as sublinear friction.
bool is_sublinear(const Trial& trial, const BalanceData& data) {
  if (trial.proposal.entry->name() != "stribeck_gaussian") return false;
  const Term& term = trial.judged.terms.back();
  const auto value = [&](std::string_view name) { return term.values[term.entry->index_of(name)]; };
  const regression::ShapeRange range = regression::shape_range(data, term, term.entry->index_of("velocity"));
  // The range ends at a quarter of the fast motion; wide is from a tenth of it.
  return value("amplitude_positive") < 0.0 && value("amplitude_negative") < 0.0 && value("velocity") > 0.4 * range.high;
}

}  // namespace

std::string verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::missing_effect:
      return "missing_effect";
    case Verdict::confusable_effects:
      return "confusable_effects";
    case Verdict::at_noise_floor:
      return "at_noise_floor";
    case Verdict::nothing_significant:
      return "nothing_significant";
    case Verdict::unknown_structure:
      return "unknown_structure";
    case Verdict::insufficient_excitation:
      return "insufficient_excitation";
  }
  return "";
}

Diagnosis diagnose(const data::Dataset& dataset, const model::Model& model, const Options& options) {
  const auto say = [&](std::string_view what) {
    if (options.progress) options.progress(what);
  };
  Diagnosis result;
  const data::Axis axis = model.drive.axis;
  result.unit = axis == data::Axis::linear ? "N" : "N*m";
  say("fitting the model");
  const auto base = regression::identify(dataset, model, options.pipeline);
  result.warnings = base->warnings;
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : dataset.experiments)
    if (e.role == data::Role::fit) experiments.push_back(&e);

  std::vector<Search> searches;
  std::vector<std::vector<Trial>> ranked;
  for (std::size_t b = 0; b < base->data.size(); ++b) {
    BalanceData& data = base->data[b];
    Search search{&data, Eigen::VectorXd::Ones(data.rows()), {}};
    Judged whole = judge(data, base->terms, search.keep);
    for (Disturbance& d : find_disturbances(data, whole.residual, search.keep)) {
      d.unit = result.unit;
      result.disturbances.push_back(std::move(d));
    }
    search.base = search.keep.minCoeff() < 1.0 ? judge(data, base->terms, search.keep) : std::move(whole);
    searches.push_back(std::move(search));
  }
  for (Search& search : searches) {
    say(fmt::format("trying effects ({} of {} balances)", ranked.size() + 1, searches.size()));
    ranked.push_back(rank(search));
  }

  // The balance that falls most; without a fall, the one that stands highest above its floor.
  std::size_t chosen = 0;
  double best = -1e300;
  std::vector<comparison::NoiseFloor> floors;
  for (std::size_t b = 0; b < searches.size(); ++b) {
    floors.push_back(comparison::pooled(
        comparison::noise_floors(*searches[b].data, searches[b].base.terms, experiments, base->model.drive),
        searches[b].data->records()));
    const double score =
        ranked[b].empty() ? -1e299 : ranked[b].front().fall.score - (passes(ranked[b].front()) ? 0.0 : 1e9);
    if (score > best) {
      best = score;
      chosen = b;
    }
  }
  std::string alias;  // an effect that the named one stands for as well
  const bool named = !ranked[chosen].empty() && passes(ranked[chosen].front());
  if (named) {
    say("checking what else could explain it");
    if (auto instead = eliminate(searches[chosen], ranked[chosen].front())) {
      auto& list = ranked[chosen];
      list.erase(std::remove_if(list.begin(), list.end(),
                                [&](const Trial& t) {
                                  return t.proposal.entry == instead->proposal.entry &&
                                         t.proposal.order == instead->proposal.order;
                                }),
                 list.end());
      list.insert(list.begin(), std::move(*instead));
    }
    if (is_sublinear(ranked[chosen].front(), *searches[chosen].data)) {
      auto& list = ranked[chosen];
      const auto law = std::find_if(list.begin(), list.end(),
                                    [](const Trial& t) { return t.proposal.entry->name() == "power_law_friction"; });
      if (law != list.end() && law->fall.score > kNamedScore) {
        std::rotate(list.begin(), law, law + 1);
        alias = "stribeck_gaussian";
      }
    }
  } else {
    double excess = 0.0;
    for (std::size_t b = 0; b < searches.size(); ++b)
      if (floors[b].rmse && searches[b].base.rmse() / *floors[b].rmse > excess) {
        excess = searches[b].base.rmse() / *floors[b].rmse;
        chosen = b;
      }
  }

  Search& search = searches[chosen];
  auto& list = ranked[chosen];
  result.balance = search.data->balance();
  result.base_rmse = search.base.rmse();
  result.base_rmse_cv = search.base.rmse_cv();
  result.noise_floor = floors[chosen].rmse;
  result.noise_floor_from = floors[chosen].from;
  result.localised = shares(*search.data, search.base);
  for (std::size_t b = 0; b < ranked.size(); ++b)
    for (const Trial& t : ranked[b])
      if (!t.imitated_by.empty())
        result.warnings.push_back(fmt::format(
            "{0} cannot be told from {1} in these data: {1} stands for what both share; {2} would tell them apart",
            t.proposal.entry->name(), t.imitated_by, t.proposal.entry->info->separated_by));
  // All balances' candidates in one list, the named one's balance first where scores are equal.
  for (std::size_t b = 0; b < ranked.size(); ++b)
    for (const Trial& t : ranked[b]) result.candidates.push_back(report(t, searches[b], axis));
  const std::string first_name = named ? std::string(list.front().proposal.entry->name()) : "";
  std::stable_sort(result.candidates.begin(), result.candidates.end(), [&](const Candidate& a, const Candidate& b) {
    const bool a_first = a.effect == first_name && named && a.order == list.front().proposal.order;
    const bool b_first = b.effect == first_name && named && b.order == list.front().proposal.order;
    if (a_first != b_first) return a_first;
    if (a.admissible != b.admissible) return a.admissible;
    return a.score > b.score;
  });

  const Judged* after = &search.base;
  if (named) {
    result.named.push_back({std::string(list.front().proposal.entry->name()), list.front().proposal.order});
    for (std::size_t i = 1; i < list.size(); ++i) {
      const bool close = passes(list[i]) && list[i].fall.score >= list.front().fall.score - kRivalMargin;
      if (!close && list[i].proposal.entry->name() != alias) continue;
      result.named.push_back({std::string(list[i].proposal.entry->name()), list[i].proposal.order});
    }
    result.verdict = result.named.size() > 1 ? Verdict::confusable_effects : Verdict::missing_effect;
    for (Candidate& c : result.candidates)
      for (const Named& n : result.named)
        if (c.effect == n.effect && c.order == n.order)
          for (const Named& other : result.named)
            if (other.effect != n.effect || other.order != n.order) c.rivals.push_back(other.effect);
    after = &list.front().judged;
  }
  // What is missing may pass for a delay, so it is read off the better model.
  const Eigen::Index delay = after->theta.size() - 1;
  if (std::abs(after->theta[delay]) > 5.0 * after->std[delay]) result.delay_s = after->theta[delay];
  const auto remaining = shares(*search.data, *after);
  const double left_over = result.noise_floor ? after->rmse() / *result.noise_floor : 0.0;
  if (result.noise_floor ? left_over > kUnexplained : !remaining.empty()) result.remaining_structure = remaining;
  if (!named) {
    if (!result.noise_floor)
      result.verdict = Verdict::nothing_significant;
    else if (left_over < kAtFloor)
      result.verdict = Verdict::at_noise_floor;
    else
      result.verdict = remaining.empty() ? Verdict::nothing_significant : Verdict::unknown_structure;
    const bool moves = std::any_of(base->prepared.records.begin(), base->prepared.records.end(),
                                   [](const regression::Record& r) { return !r.at_rest; });
    if (!moves) result.verdict = Verdict::insufficient_excitation;
  }
  return result;
}

}  // namespace flexspline::diagnosis
