#include "host/diagnosis/doubts.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "host/comparison/row_variables.hpp"
#include "host/diagnosis/imitation.hpp"

namespace flexspline::diagnosis {
namespace {

using effects::Kind;

// No gear, motor or bearing makes these orders; in data of few turns they explain as much as any.
constexpr double kFirstControl = 0.63;
constexpr int kControls = 24;
constexpr double kBeats = 1.5;
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

// Weighted squares that an order takes off the base model's residual.
double explained(Search& search, const Imitation& imitation, const Terms& terms, double order) {
  const Eigen::MatrixXd own =
      search.base.root_weights.asDiagonal() * imitation.own_part(waves(*search.data, terms, order));
  const Eigen::VectorXd residual = search.base.root_weights.cwiseProduct(search.base.residual);
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(own);
  qr.setThreshold(1e-7);
  const Eigen::VectorXd left = residual - own * qr.solve(residual);
  return residual.squaredNorm() - left.squaredNorm();
}

std::string doubt(Search& search, const Imitation& imitation, const Trial& trial) {
  const double order = *trial.proposal.order;
  const double true_fall = explained(search, imitation, trial.judged.terms, order);
  for (int i = 0; i < kControls; ++i) {
    const double control = kFirstControl + i;
    const double fall = explained(search, imitation, trial.judged.terms, control);
    if (fall * kBeats > true_fall)
      return fmt::format(
          "order {:g} explains {:.0f} % of what this one does, and no drive has that: the data are too "
          "short to tell orders",
          control, 100.0 * fall / std::max(true_fall, 1e-300));
  }
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

void doubt_orders(Search& search, std::vector<Trial>& trials) {
  if (std::none_of(trials.begin(), trials.end(), [](const Trial& t) { return t.proposal.order && passes(t); })) return;
  const Imitation imitation(model_columns(*search.data, search.base.terms), search.base.root_weights);
  for (Trial& t : trials) {
    if (!t.proposal.order || !passes(t)) continue;
    t.why_not = doubt(search, imitation, t);
    t.admissible = t.why_not.empty();
  }
  std::stable_partition(trials.begin(), trials.end(), [](const Trial& t) { return t.admissible; });
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
