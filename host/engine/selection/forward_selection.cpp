#include "host/engine/selection/forward_selection.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::selection {
namespace {

// Coefficients below their bound by no more than that share of the target are noise about zero.
constexpr double kSmall = 0.02;

double squares(const Eigen::MatrixXd& products, const std::vector<Eigen::Index>& columns,
               const Eigen::VectorXd& theta) {
  const Eigen::Index y = products.cols() - 1;
  double sum = products(y, y);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    double row = -2.0 * products(columns[i], y);
    for (std::size_t j = 0; j < columns.size(); ++j)
      row += products(columns[i], columns[j]) * theta[static_cast<Eigen::Index>(j)];
    sum += theta[static_cast<Eigen::Index>(i)] * row;
  }
  return std::max(sum, 0.0);
}

bool has_presliding(const std::vector<int>& terms) {
  return std::find(terms.begin(), terms.end(), kPreslidingTerm) != terms.end();
}

}  // namespace

TermFit fit_terms(const RegressorTable& table, const std::vector<int>& terms, const HalfData& fit,
                  const HalfData& validation) {
  const bool presliding = has_presliding(terms);
  const Eigen::MatrixXd& on = presliding ? fit.presliding : fit.sign;
  const Eigen::MatrixXd& other = presliding ? validation.presliding : validation.sign;
  TermFit result;
  for (Eigen::Index j = 0; j < table.model_columns; ++j) result.columns.push_back(j);
  for (const int t : terms)
    if (t >= 0)
      for (const Eigen::Index c : table.terms[static_cast<std::size_t>(t)].columns) result.columns.push_back(c);
  const auto n = static_cast<Eigen::Index>(result.columns.size());
  Eigen::MatrixXd inner(n, n);
  Eigen::VectorXd along(n), size(n);
  const Eigen::Index y = on.cols() - 1;
  for (Eigen::Index i = 0; i < n; ++i) size[i] = std::sqrt(std::max(on(result.columns[i], result.columns[i]), 1e-300));
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) inner(i, j) = on(result.columns[i], result.columns[j]) / (size[i] * size[j]);
    along[i] = on(result.columns[i], y) / size[i];
  }
  // Columns that are collinear share their coefficient.
  inner.diagonal().array() += 1e-8;
  result.theta = algebra::SymmetricFactor(inner).solve(along).col(0).cwiseQuotient(size);
  result.training_squares = squares(on, result.columns, result.theta);
  result.validation_squares = squares(other, result.columns, result.theta);
  return result;
}

namespace {

// Whether all coefficients keep their signs, but for those that are about zero.
bool is_possible(const RegressorTable& table, const std::vector<int>& terms, const TermFit& fitted,
                 const HalfData& half) {
  const Eigen::MatrixXd& on = has_presliding(terms) ? half.presliding : half.sign;
  const Eigen::Index y = on.cols() - 1;
  const double small = kSmall * std::sqrt(on(y, y));
  const auto check = [&](std::size_t at, double low) {
    const double value = fitted.theta[static_cast<Eigen::Index>(at)];
    const Eigen::Index c = fitted.columns[at];
    return low < 0.0 || value >= 0.0 || -value * std::sqrt(on(c, c)) <= small;
  };
  for (std::size_t j = 0; j < table.model_low.size(); ++j)
    if (!check(j, table.model_low[j])) return false;
  std::size_t at = table.model_low.size();
  for (const int t : terms) {
    if (t < 0) continue;
    const CandidateTerm& term = table.terms[static_cast<std::size_t>(t)];
    double sum = 0.0;
    for (std::size_t k = 0; k < term.low.size(); ++k) {
      const double low = term.low[k];
      // Bounds other than zero are those of what is possible, in the parameter's own unit.
      const double value = fitted.theta[static_cast<Eigen::Index>(at)] / table.scale[fitted.columns[at]];
      if ((low < 0.0 && value < low) || (k < term.high.size() && value > term.high[k])) return false;
      sum += fitted.theta[static_cast<Eigen::Index>(at)];
      if (!check(at++, low)) return false;
    }
    if (term.most_at_peak > 0.0 && sum > term.most_at_peak) return false;
    // Friction that rises from standstill belongs to another law.
    if (term.sum_is_positive && sum < 0.0) return false;
  }
  return true;
}

}  // namespace

SelectionPath select_forward(const RegressorTable& table, const HalfData& fit, const HalfData& validation,
                             const Noise& noise, const std::vector<std::uint8_t>& may_enter,
                             const SelectionPolicy& policy) {
  SelectionPath result;
  std::vector<int> terms;
  TermFit now = fit_terms(table, terms, fit, validation);
  result.before = result.after = now.validation_squares;
  if (now.validation_squares / validation.rows > policy.most_leverage * now.training_squares / fit.rows) {
    result.abstains = result.extrapolates = true;
    return result;
  }
  const double floor = std::min(noise.variance * validation.rows, 0.999 * now.validation_squares);
  const double excess = now.validation_squares - floor;
  if (excess < policy.least_excess * now.validation_squares) {
    result.abstains = true;
    return result;
  }
  bool was_possible = is_possible(table, terms, now, fit);
  for (std::size_t step = 0; step < policy.most_steps; ++step) {
    struct Best {
      int term = 0;
      TermFit fitted;
      double gain = -1e300;
    };
    // For each name the values of its nonlinear parameters that fit best on the training half.
    std::map<std::string, Best> by_name;
    const auto try_term = [&](int t, const std::string& name, double parameters) {
      std::vector<int> with = terms;
      with.push_back(t);
      TermFit fitted = fit_terms(table, with, fit, validation);
      const auto found = by_name.find(name);
      if (found != by_name.end() && found->second.fitted.training_squares <= fitted.training_squares) return;
      if (!is_possible(table, with, fitted, fit) && was_possible) return;
      const double per_one = now.validation_squares / validation.rows * noise.tau;
      double gain = now.validation_squares - fitted.validation_squares - parameters * per_one;
      // A curve that is in no catalogue can follow most laws: it has to do better.
      const bool curve = t >= 0 && !table.terms[static_cast<std::size_t>(t)].entry &&
                         !table.terms[static_cast<std::size_t>(t)].is_placebo;
      if (curve && gain > 0.0) gain *= policy.curve_discount;
      by_name[name] = {t, std::move(fitted), gain};
    };
    for (std::size_t t = 0; t < table.terms.size(); ++t)
      if (may_enter[t] && std::find(terms.begin(), terms.end(), static_cast<int>(t)) == terms.end())
        try_term(static_cast<int>(t), table.terms[t].name,
                 static_cast<double>(table.terms[t].columns.size() + table.terms[t].nonlinear));
    if (fit.presliding.size() > 0 && !has_presliding(terms)) try_term(kPreslidingTerm, "presliding", 1.0);
    if (by_name.empty()) break;
    const auto best = std::max_element(by_name.begin(), by_name.end(),
                                       [](const auto& a, const auto& b) { return a.second.gain < b.second.gain; });
    const Best& chosen = best->second;
    const double drop = now.validation_squares - chosen.fitted.validation_squares;
    const double above = std::max(now.validation_squares - floor, 1e-300);
    const bool law = chosen.term == kPreslidingTerm || table.terms[static_cast<std::size_t>(chosen.term)].nonlinear > 0;
    const double per_one = chosen.fitted.validation_squares / validation.rows * noise.tau;
    if (drop < (law ? policy.law_share : policy.line_share) * above || drop < policy.least_gain * per_one) break;
    terms.push_back(chosen.term);
    SelectionStep taken{chosen.term, drop / above, drop / excess, {}};
    const auto left = [&](const TermFit& f) { return std::max(f.validation_squares - floor, 0.0); };
    for (const auto& [name, other] : by_name) {
      // A generic curve that fits no better than a law does not refute that law.
      const bool curve = other.term >= 0 && !table.terms[static_cast<std::size_t>(other.term)].entry &&
                         !table.terms[static_cast<std::size_t>(other.term)].is_placebo;
      if (curve || other.term == chosen.term || other.gain < policy.similar * chosen.gain) continue;
      // Where the chosen one leaves noise and the other one does not, they are distinguished.
      if (left(other.fitted) > policy.similar_left * left(chosen.fitted) + policy.least_gain * per_one) continue;
      taken.alternatives.push_back(name);
    }
    result.steps.push_back(std::move(taken));
    now = chosen.fitted;
    was_possible = is_possible(table, terms, now, fit);
    result.after = now.validation_squares;
    if (now.validation_squares - floor < policy.least_excess * now.validation_squares) break;
  }
  return result;
}

}  // namespace flexspline::selection
