#include "host/engine/selection/output_angle_period.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/model_projection.hpp"

namespace flexspline::selection {
namespace {

// A wave of the output's angle with the period of a turn, which depends on nothing else.
bool is_of_one_turn(const catalogue::Entry& entry) {
  return entry.info->phase == effects::Phase::source && !entry.definition &&
         (entry.info->reads & effects::kOutputAngle) != 0 &&
         (entry.info->reads & ~(effects::kOutputAngle | effects::kOutputMotion)) == 0 &&
         entry.count(effects::Kind::linear) == entry.parameters.size();
}

// What the model leaves, after a fit of columns in addition to its own and to an offset: without one the offset of a
// wave would decide which curvature it has.
class SquaresLeft {
 public:
  explicit SquaresLeft(const BalanceSearch& search)
      : weights_(search.base.root_weights),
        projection_(with_offset(estimation::model_columns(*search.data, search.base.terms)), weights_),
        residual_(weighted(search.base.residual)) {}
  double with_offset_alone() const { return residual_.squaredNorm(); }
  double with(const Eigen::MatrixXd& columns) const {
    const Eigen::MatrixXd own = weighted(columns);
    return (residual_ - own * algebra::PivotedQr(own, 1e-7).solve(residual_)).squaredNorm();
  }

 private:
  static Eigen::MatrixXd with_offset(const Eigen::MatrixXd& columns) {
    Eigen::MatrixXd all(columns.rows(), columns.cols() + 1);
    all << columns, Eigen::VectorXd::Ones(columns.rows());
    return all;
  }
  Eigen::MatrixXd weighted(const Eigen::MatrixXd& columns) const {
    return weights_.asDiagonal() * projection_.orthogonal_part(columns);
  }

  Eigen::VectorXd weights_;
  estimation::ModelProjection projection_;
  Eigen::VectorXd residual_;
};

// Twice log likelihood ratios, of waves with as many parameters.
struct PeriodEvidence {
  double over_half_turn = 0.0;  // of the period of a turn: the difference of the BIC
  bool is_wave = false;         // an offset in its place explains less
};

PeriodEvidence evidence_of_period(const BalanceSearch& search, const CandidateFit& candidate) {
  constexpr int kHalf = 2;
  const RegressionProblem& data = *search.data;
  std::vector<estimation::ParameterRef> own;
  for (std::size_t p = 0; p < candidate.fit.terms.back().values.size(); ++p)
    if (candidate.fit.terms.back().free_linear(p)) own.push_back({candidate.fit.terms.size() - 1, p});
  const SquaresLeft left(search);
  const double of_turn = left.with(data.columns(candidate.fit.terms, own));
  const double of_half = left.with(data.evaluator().wave_columns(search.base.terms, effects::Variable::output_angle,
                                                                 candidate.model.entry->info->balance, kHalf));
  const auto samples =
      static_cast<double>((search.base.root_weights.array() > 0.0).count()) / candidate.fit.autocorrelation_time;
  const auto twice_log_ratio = [&](double squares) {
    return samples * std::log(std::max(squares, 1e-300) / std::max(of_turn, 1e-300));
  };
  const double penalty = static_cast<double>(own.size()) * std::log(std::max(samples, 1.0));
  return {twice_log_ratio(of_half), twice_log_ratio(left.with_offset_alone()) >= penalty + kPolicy.positive_evidence};
}

}  // namespace

void check_output_angle_period(const BalanceSearch& search, std::vector<CandidateFit>& candidates) {
  bool any = false;
  for (CandidateFit& candidate : candidates) {
    if (!is_of_one_turn(*candidate.model.entry) || !candidate.admissible) continue;
    const PeriodEvidence evidence = evidence_of_period(search, candidate);
    // Over a very small travel a wave is an offset, and is named together with it.
    if (evidence.over_half_turn >= kPolicy.positive_evidence || !evidence.is_wave) continue;
    any = true;
    const std::string why_not = fmt::format(
        "a function of the output's angle with half its period explains {} (by a score of {:.0f}): move over a larger "
        "part of a turn",
        evidence.over_half_turn > 0.0 ? "hardly less" : "no less", std::abs(evidence.over_half_turn));
    for (CandidateFit& same : candidates) {
      if (&same != &candidate && !is_same_function(candidate, same)) continue;
      same.has_uncertain_period = true;
      same.admissible = false;
      same.why_not = why_not;
    }
  }
  if (any) sort_candidates(search, candidates);
}

}  // namespace flexspline::selection
