#include "host/engine/selection/forward_selection.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::selection {
namespace {

bool has_presliding(const std::vector<int>& terms) {
  return std::find(terms.begin(), terms.end(), kPreslidingTerm) != terms.end();
}

}  // namespace

double squares_left(const Eigen::MatrixXd& products, const std::vector<Eigen::Index>& columns,
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

namespace {

// Coefficients of some columns by least squares, from their products.
Eigen::VectorXd coefficients(const Eigen::MatrixXd& products, const std::vector<Eigen::Index>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd inner(n, n);
  Eigen::VectorXd along(n), size(n);
  const Eigen::Index y = products.cols() - 1;
  const auto at = [&](Eigen::Index i) { return columns[static_cast<std::size_t>(i)]; };
  for (Eigen::Index i = 0; i < n; ++i) size[i] = std::sqrt(std::max(products(at(i), at(i)), 1e-300));
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) inner(i, j) = products(at(i), at(j)) / (size[i] * size[j]);
    along[i] = products(at(i), y) / size[i];
  }
  // Columns that are collinear share their coefficient.
  inner.diagonal().array() += 1e-8;
  return algebra::SymmetricFactor(inner).solve(along).col(0).cwiseQuotient(size);
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
  const std::size_t others = result.columns.size();
  if (presliding)
    for (const Eigen::Index place : table.presliding_shape()) result.columns.push_back(place);
  result.theta = coefficients(on, result.columns);
  // Bristles in parallel (Maxwell slip) each hold a force of their own. With negative ones their sum could fall after a
  // reversal, which is another law: friction that falls with speed.
  while (result.columns.size() > others) {
    Eigen::Index least = 0;
    const auto shape = result.theta.tail(std::ssize(result.columns) - static_cast<std::ptrdiff_t>(others));
    if (shape.minCoeff(&least) >= 0.0) break;
    result.columns.erase(result.columns.begin() + static_cast<std::ptrdiff_t>(others) + least);
    result.theta = coefficients(on, result.columns);
  }
  result.training_squares = squares_left(on, result.columns, result.theta);
  result.validation_squares = squares_left(other, result.columns, result.theta);
  return result;
}

namespace {

// Whether all coefficients keep their signs, but for those that are about zero.
bool is_possible(const RegressorTable& table, const std::vector<int>& terms, const TermFit& fitted,
                 const HalfData& half) {
  const Eigen::MatrixXd& on = has_presliding(terms) ? half.presliding : half.sign;
  const Eigen::Index y = on.cols() - 1;
  const double small = kPolicy.noise_below_bound * std::sqrt(on(y, y));
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

bool is_generic_curve(const RegressorTable& table, int term) {
  return term >= 0 && !table.terms[static_cast<std::size_t>(term)].entry &&
         !table.terms[static_cast<std::size_t>(term)].is_placebo;
}

// The terms that were taken so far, and what a step from there needs to know.
class ForwardStep {
 public:
  struct Best {
    int term = 0;
    TermFit fitted;
    double gain = -1e300;
    double criterion = 1e300;  // of training squares and of how many parameters they took
  };

  ForwardStep(const RegressorTable& table, const HalfData& fit, const HalfData& validation, const Noise& noise,
              const SelectionPolicy& policy)
      : table_(table),
        fit_(fit),
        validation_(validation),
        noise_(noise),
        policy_(policy),
        now_(fit_terms(table, {}, fit, validation)),
        was_possible_(is_possible(table, {}, now_, fit)) {}

  const TermFit& now() const { return now_; }
  double floor() const { return floor_; }
  void set_floor(double floor) { floor_ = floor; }

  // Of each name the values of its nonlinear parameters that fit best on the training half.
  std::map<std::string, Best> best_by_name() const {
    std::map<std::string, Best> by_name;
    for (std::size_t t = 0; t < table_.terms.size(); ++t)
      if (std::find(terms_.begin(), terms_.end(), static_cast<int>(t)) == terms_.end() && !is_excluded(table_.terms[t]))
        try_term(static_cast<int>(t), table_.terms[t].name,
                 static_cast<double>(table_.terms[t].columns.size() + table_.terms[t].nonlinear), by_name);
    if (fit_.presliding.size() > 0 && !has_presliding(terms_))
      try_term(kPreslidingTerm, kPresliding, 1.0 + static_cast<double>(table_.presliding_shape().size()), by_name);
    return by_name;
  }

  bool is_worth_it(const Best& chosen) const {
    const bool law =
        chosen.term == kPreslidingTerm || table_.terms[static_cast<std::size_t>(chosen.term)].nonlinear > 0;
    const double drop = now_.validation_squares - chosen.fitted.validation_squares;
    return drop >= (law ? policy_.law_share : policy_.line_share) * above() &&
           drop >= policy_.least_gain * per_one(chosen);
  }

  // Names that would have done as well.
  std::vector<std::string> alternatives(const std::map<std::string, Best>& by_name, const Best& chosen) const {
    std::vector<std::string> names;
    const auto left = [&](const TermFit& f) { return std::max(f.validation_squares - floor_, 0.0); };
    for (const auto& [name, other] : by_name) {
      // A generic curve that fits no better than a law does not refute that law.
      if (is_generic_curve(table_, other.term) || other.term == chosen.term ||
          other.gain < policy_.similar * chosen.gain)
        continue;
      // Where the chosen one leaves noise and the other one does not, they are distinguished.
      if (left(other.fitted) <= policy_.similar_left * left(chosen.fitted) + policy_.least_gain * per_one(chosen))
        names.push_back(name);
    }
    return names;
  }

  // Squares above the noise.
  double above() const { return std::max(now_.validation_squares - floor_, 1e-300); }

  void take(const Best& chosen) {
    terms_.push_back(chosen.term);
    now_ = chosen.fitted;
    was_possible_ = is_possible(table_, terms_, now_, fit_);
  }

 private:
  bool is_excluded(const CandidateTerm& term) const {
    return std::any_of(terms_.begin(), terms_.end(), [&](int t) {
      return t >= 0 && std::find(term.excludes.begin(), term.excludes.end(),
                                 table_.terms[static_cast<std::size_t>(t)].name) != term.excludes.end();
    });
  }
  // What one parameter takes off by chance.
  double per_one(const Best& chosen) const { return chosen.fitted.validation_squares / validation_.rows * noise_.tau; }

  void try_term(int t, const std::string& name, double parameters, std::map<std::string, Best>& by_name) const {
    std::vector<int> with = terms_;
    with.push_back(t);
    TermFit fitted = fit_terms(table_, with, fit_, validation_);
    const auto found = by_name.find(name);
    const double by_chance = now_.validation_squares / validation_.rows * noise_.tau;
    const double criterion = fitted.training_squares + parameters * by_chance;
    if (found != by_name.end() && found->second.criterion <= criterion) return;
    if (!is_possible(table_, with, fitted, fit_) && was_possible_) return;
    double gain = now_.validation_squares - fitted.validation_squares - parameters * by_chance;
    // A curve that is in no catalogue can follow most laws: it has to do better.
    if (is_generic_curve(table_, t) && gain > 0.0) gain *= policy_.curve_discount;
    by_name[name] = {t, std::move(fitted), gain, criterion};
  }

  const RegressorTable& table_;
  const HalfData &fit_, &validation_;
  const Noise& noise_;
  const SelectionPolicy& policy_;
  std::vector<int> terms_;
  TermFit now_;
  double floor_ = 0.0;
  bool was_possible_;
};

}  // namespace

SelectionPath select_forward(const RegressorTable& table, const HalfData& fit, const HalfData& validation,
                             const Noise& noise, const SelectionPolicy& policy) {
  SelectionPath result;
  ForwardStep at(table, fit, validation, noise, policy);
  const double before = at.now().validation_squares;
  result.before = result.after = before;
  const auto carries_over = [&] {
    return at.now().validation_squares / validation.rows <=
           policy.max_validation_to_training * at.now().training_squares / fit.rows;
  };
  const bool base_carries_over = carries_over();
  at.set_floor(std::min(noise.variance * validation.rows, 0.999 * before));
  const double excess = before - at.floor();
  if (excess < policy.least_excess * before) {
    result.abstains = true;
    return result;
  }
  for (std::size_t step = 0; step < policy.most_steps; ++step) {
    const auto by_name = at.best_by_name();
    if (by_name.empty()) break;
    const ForwardStep::Best& chosen =
        std::max_element(by_name.begin(), by_name.end(), [](const auto& a, const auto& b) {
          return a.second.gain < b.second.gain;
        })->second;
    if (!at.is_worth_it(chosen)) break;
    const double drop = at.now().validation_squares - chosen.fitted.validation_squares;
    result.steps.push_back({chosen.term, drop / at.above(), drop / excess, at.alternatives(by_name, chosen)});
    at.take(chosen);
    result.after = at.now().validation_squares;
    if (result.after - at.floor() < policy.least_excess * result.after) break;
  }
  // What a term takes off a model that does not hold on other data is extrapolation, unless it holds with the term.
  if (!base_carries_over && !carries_over()) {
    result.steps.clear();
    result.after = before;
    result.abstains = true;
  }
  return result;
}

}  // namespace flexspline::selection
