#include "host/diagnosis/doubts.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "host/comparison/row_variables.hpp"
#include "host/diagnosis/imitation.hpp"
#include "host/diagnosis/other_balances.hpp"
#include "host/regression/both_balances.hpp"
#include "host/regression/pivoted_qr.hpp"

namespace flexspline::diagnosis {
namespace {

using effects::Kind;

// No gear, motor or bearing makes these orders; in data of few turns they explain as much as any.
constexpr double kFirstControl = 0.63;
constexpr int kControls = 24;
constexpr double kBeats = 1.5;
// Where nothing but noise is left, the likelihood tells orders, although a wrong one may explain most of it, too: twice
// its logarithm by this much.
constexpr double kSurer = 3.0 * kNamedScore;
// Parts that all rows are cut into, in which a true order shows again and again.
constexpr Eigen::Index kParts = 8;
constexpr int kSeenIn = 5;
constexpr double kLargestPart = 0.7;
// Rows of the rarer direction, below which asymmetry cannot be told.
constexpr double kOneWay = 0.01;

std::size_t order_place(const catalogue::Entry& entry) {
  for (std::size_t p = 0; p < entry.parameters.size(); ++p)
    if (entry.parameters[p].kind == Kind::given) return p;
  return entry.parameters.size();
}

// Columns of the added effect at an order: of its linear parameters, or slopes by its shapes about nought.
Eigen::MatrixXd waves(BalanceData& data, Terms terms, double order) {
  regression::Term& added = terms.back();
  added.values[order_place(*added.entry)] = order;
  const auto on_balance = regression::terms_on(terms, data.balance(), data.prepared().torque_measured);
  Eigen::MatrixXd columns(data.rows(), 0);
  const auto take = [&](const Eigen::VectorXd& column) {
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = column;
  };
  for (std::size_t p = 0; p < added.values.size(); ++p)
    if (added.free_shape(p)) added.values[p] = 0.0;
  for (std::size_t p = 0; p < added.values.size(); ++p) {
    if (added.free_linear(p)) take(data.column(terms, {terms.size() - 1, p}));
    if (added.free_shape(p)) take(data.shape_column(terms, on_balance, {terms.size() - 1, p}));
  }
  return columns;
}

// A balance on which the effect of a trial acts, and what its model could imitate there.
struct Witness {
  Search* search = nullptr;
  const Imitation* imitation = nullptr;
  const Judged* noise = nullptr;  // whose weights count
};

// Squares in units of the noise that an order takes off the residuals of all balances on which it acts, its own first.
double explained(const std::vector<Witness>& witnesses, const Terms& terms, double order) {
  std::vector<Eigen::MatrixXd> parts;
  std::vector<Eigen::VectorXd> residuals;
  Eigen::Index rows = 0;
  for (const Witness& w : witnesses) {
    Terms tried = terms;
    regression::Term& added = tried.back();
    added.values[order_place(*added.entry)] = order;
    Eigen::MatrixXd columns;
    if (parts.empty()) {
      columns = waves(*w.search->data, terms, order);
    } else {
      std::vector<std::size_t> parameters;
      for (std::size_t p = 0; p < added.values.size(); ++p)
        if (added.free_linear(p) || added.free_shape(p)) {
          parameters.push_back(p);
          added.values[p] = 0.0;
        }
      columns = regression::reaching_columns(*w.search->data, tried, tried.size() - 1, parameters);
    }
    const Eigen::VectorXd weights = w.noise->root_weights / std::sqrt(std::max(1.0, w.noise->autocorrelation_time));
    parts.push_back(weights.asDiagonal() * w.imitation->own_part(columns));
    residuals.push_back(weights.cwiseProduct(w.search->base.residual));
    rows += residuals.back().size();
  }
  Eigen::MatrixXd own(rows, parts.front().cols());
  Eigen::VectorXd residual(rows);
  for (std::size_t i = 0, at = 0; i < parts.size(); at += static_cast<std::size_t>(parts[i].rows()), ++i) {
    own.middleRows(static_cast<Eigen::Index>(at), parts[i].rows()) = parts[i];
    residual.segment(static_cast<Eigen::Index>(at), parts[i].rows()) = residuals[i];
  }
  // Parameters differ in size by their units.
  for (auto column : own.colwise()) column /= std::max(column.norm(), 1e-300);
  const Eigen::VectorXd left = residual - own * regression::PivotedQr(own, 1e-7).solve(residual);
  return residual.squaredNorm() - left.squaredNorm();
}

// Whether the order is surer than any that no drive has, by the noise that is left with it.
bool surer(std::vector<Witness> witnesses, const Trial& trial) {
  Search& told = *witnesses.front().search;
  if (!told.at_floor(trial.judged) || (witnesses.size() > 1 && !trial.at_floor_elsewhere)) return false;
  const Imitation imitation(model_columns(*told.data, told.base.terms), trial.judged.root_weights);
  witnesses.front() = {&told, &imitation, &trial.judged};
  const double true_fall = explained(witnesses, trial.judged.terms, *trial.proposal.order);
  for (int i = 0; i < kControls; ++i)
    if (explained(witnesses, trial.judged.terms, kFirstControl + i) > true_fall - kSurer) return false;
  return true;
}

// The order that such effects mostly have, if none of the others that were tried fits better by more than that.
bool usual_and_best(const std::vector<Trial>& trials, const Trial& trial, double better_by) {
  const catalogue::Entry& entry = *trial.proposal.entry;
  return *trial.proposal.order == entry.parameters[order_place(entry)].usual &&
         std::none_of(trials.begin(), trials.end(), [&](const Trial& other) {
           return other.proposal.entry == &entry && other.score() > trial.score() + better_by;
         });
}

std::string doubt(const std::vector<Witness>& witnesses, const Trial& trial) {
  Search& search = *witnesses.front().search;
  const double order = *trial.proposal.order;
  const double true_fall = explained(witnesses, trial.judged.terms, order);
  double best_fall = 0.0, best_control = 0.0;
  for (int i = 0; i < kControls; ++i) {
    const double control = kFirstControl + i;
    const double fall = explained(witnesses, trial.judged.terms, control);
    if (fall <= best_fall) continue;
    best_fall = fall;
    best_control = control;
  }
  if (best_fall * kBeats > true_fall && !surer(witnesses, trial))
    return fmt::format(
        "order {:g} explains {:.0f} % of what this one does, and no drive has that: the data are too "
        "short to tell orders",
        best_control, 100.0 * best_fall / std::max(true_fall, 1e-300));
  int seen = 0;
  double whole = 0.0, largest = 0.0;
  const Eigen::Index rows = search.base.residual.size();
  for (Eigen::Index part = 0; part < kParts; ++part) {
    double fall = 0.0;
    for (Eigen::Index k = rows * part / kParts; k < rows * (part + 1) / kParts; ++k) {
      const double weight = search.base.root_weights[k] * search.base.root_weights[k];
      fall += weight *
              (search.base.residual[k] * search.base.residual[k] - trial.judged.residual[k] * trial.judged.residual[k]);
    }
    seen += fall > 0.0;
    whole += std::max(fall, 0.0);
    largest = std::max(largest, fall);
  }
  if (seen < kSeenIn) return fmt::format("it shows in {} of {} parts of the data only", seen, kParts);
  if (largest > kLargestPart * whole)
    return fmt::format("{:.0f} % of what it explains lies in one part of the data", 100.0 * largest / whole);
  return {};
}

}  // namespace

void doubt_orders(const std::vector<Search*>& all, Search& told, std::vector<Trial>& trials) {
  std::map<const Search*, Imitation> imitations;
  const auto witness = [&](Search& search) {
    auto at = imitations.find(&search);
    if (at == imitations.end())
      at = imitations
               .emplace(&search, Imitation(model_columns(*search.data, search.base.terms), search.base.root_weights))
               .first;
    return Witness{&search, &at->second, &search.base};
  };
  for (Trial& t : trials) {
    if (!t.proposal.order || !passes(t)) continue;
    std::vector<Witness> witnesses = {witness(told)};
    for (Search* other : others_of(all, told, t)) witnesses.push_back(witness(*other));
    t.why_not = doubt(witnesses, t);
    t.admissible = t.why_not.empty();
    if (t.admissible || !usual_and_best(trials, t, kRivalMargin)) continue;
    t.note = fmt::format(
        "These data are too short to tell its order: {:g} a turn is what such effects mostly have, and fits best of "
        "the "
        "whole orders; {} would tell.",
        *t.proposal.order, t.proposal.entry->info->separated_by);
    // Its own balance says that the effect is there; where another says so, too, its order is taken for the usual one.
    t.doubtful_order = t.elsewhere <= kRivalMargin || !usual_and_best(trials, t, 0.0);
    if (t.doubtful_order) continue;
    t.admissible = true;
    t.why_not.clear();
  }
  put_in_order(told, trials);
}

std::string one_way_warning(const BalanceData& data) {
  const Eigen::VectorXd directions = comparison::row_directions(data);
  double forward = 0.0, backward = 0.0;
  for (const double d : directions) (d > 0.0 ? forward : backward) += std::isfinite(d) && d != 0.0 ? 1.0 : 0.0;
  const double rarer = std::min(forward, backward), all = forward + backward;
  if (all == 0.0 || rarer > kOneWay * all) return {};
  return fmt::format(
      "the axis moves {} in {:.1f} % of these data: dry friction, its difference between the directions and any offset "
      "are one constant here, and what differs by direction cannot be told; record both directions",
      forward > backward ? "forward" : "backward", 100.0 * (all - rarer) / all);
}

}  // namespace flexspline::diagnosis
