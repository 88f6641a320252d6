#include "host/engine/estimation/regression_problem.hpp"

#include "host/engine/estimation/cancellation.hpp"

namespace flexspline::estimation {
namespace {

using effects::Kind;
using effects::Phase;

constexpr std::size_t kStoredNumbers = 40'000'000;  // 320 MB of columns

}  // namespace

RegressionProblem::RegressionProblem(const PreparedData& prepared, Balance balance)
    : evaluator_(prepared, balance), store_(std::make_shared<ColumnStore>(kStoredNumbers)) {
  const Eigen::MatrixXd both = evaluator_.left_side();
  target_ = both.col(0);
  delay_ = both.col(1);
  filter_autocorrelation_time_ = evaluator_.filter_autocorrelation_time();
}

RegressionProblem::RegressionProblem(const RegressionProblem& original, RegressorEvaluator evaluator)
    : evaluator_(std::move(evaluator)),
      target_(original.target_),
      delay_(original.delay_),
      filter_autocorrelation_time_(evaluator_.filter_autocorrelation_time()),
      store_(std::make_shared<ColumnStore>(kStoredNumbers)) {}

RegressionProblem RegressionProblem::decimated() const {
  return {*this, evaluator_.decimated()};
}

std::vector<std::vector<RowRange>> RegressionProblem::folds(std::size_t parts) const {
  std::vector<std::vector<RowRange>> folds(parts);
  for (const RowRange& range : records())
    for (std::size_t part = 0; part < parts; ++part) {
      const auto cut = [&](std::size_t p) {
        return range.first + static_cast<Eigen::Index>(static_cast<std::size_t>(range.size()) * p / parts);
      };
      folds[part].push_back({range.record, cut(part), cut(part + 1)});
    }
  return folds;
}

std::size_t RegressionProblem::sample_of(const RowRange& range, Eigen::Index row) const {
  Eigen::Index start = 0;
  for (const RowRange& whole : records())
    if (whole.record == range.record) start = whole.first;
  return prepared().records[range.record].rows[index(balance())].samples[static_cast<std::size_t>(row - start)];
}

std::vector<ColumnStore::Column> RegressionProblem::stored_columns(const Terms& terms,
                                                                   const std::vector<ParameterRef>& refs) const {
  throw_if_cancelled();
  std::vector<ColumnStore::Column> columns;
  std::vector<ColumnKey> keys;
  std::vector<ParameterRef> missing;
  std::vector<std::size_t> places;
  for (const ParameterRef& ref : refs) {
    keys.push_back(key_of(terms, ref.term, ColumnKey::What::unit, ref.parameter));
    columns.push_back(store_->find(keys.back()));
    if (columns.back()) continue;
    missing.push_back(ref);
    places.push_back(columns.size() - 1);
  }
  if (missing.empty()) return columns;
  const Eigen::MatrixXd made = evaluator_.unit_columns(terms, missing);
  for (std::size_t j = 0; j < places.size(); ++j)
    columns[places[j]] = store_->insert(keys[places[j]], made.col(static_cast<Eigen::Index>(j)));
  return columns;
}

Eigen::VectorXd RegressionProblem::column(const Terms& terms, ParameterRef ref) const {
  return *stored_columns(terms, {ref}).front();
}

Eigen::MatrixXd RegressionProblem::columns(const Terms& terms, const std::vector<ParameterRef>& refs) const {
  const std::vector<ColumnStore::Column> stored = stored_columns(terms, refs);
  Eigen::MatrixXd X(rows(), static_cast<Eigen::Index>(refs.size()));
  for (std::size_t j = 0; j < refs.size(); ++j) X.col(static_cast<Eigen::Index>(j)) = *stored[j];
  return X;
}

std::optional<std::size_t> RegressionProblem::scaled_by_one(const Term& term) {
  if (term.entry->info->phase != Phase::source || !term.adds_torque() || term.entry->count(Kind::linear) != 1)
    return std::nullopt;
  std::size_t linear = 0;
  while (term.entry->parameters[linear].kind != Kind::linear) ++linear;
  return linear;
}

ColumnStore::Column RegressionProblem::stored_slope(const Terms& terms, ParameterRef nonlinear,
                                                    std::size_t linear) const {
  const ColumnKey key = key_of(terms, nonlinear.term, ColumnKey::What::slope, linear, nonlinear.parameter);
  if (ColumnStore::Column found = store_->find(key)) return found;
  return store_->insert(key, evaluator_.slope_per_unit(terms, nonlinear, linear));
}

Eigen::MatrixXd RegressionProblem::nonlinear_columns(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                                     const std::vector<ParameterRef>& nonlinear) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows(), static_cast<Eigen::Index>(nonlinear.size()));
  std::vector<ParameterRef> others;
  std::vector<Eigen::Index> places;
  for (std::size_t j = 0; j < nonlinear.size(); ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    const Term& term = terms[nonlinear[j].term];
    if (const std::optional<std::size_t> linear = scaled_by_one(term)) {
      columns.col(column) = term.values[*linear] * *stored_slope(terms, nonlinear[j], *linear);
    } else {
      others.push_back(nonlinear[j]);
      places.push_back(column);
    }
  }
  if (!others.empty()) columns(Eigen::all, places) = evaluator_.slopes(terms, on_balance, others);
  return columns;
}

Eigen::MatrixXd RegressionProblem::slopes(const Terms& terms, const std::vector<std::size_t>& on_balance,
                                          const std::vector<ParameterRef>& linear,
                                          const std::vector<ParameterRef>& nonlinear) const {
  Eigen::MatrixXd both(rows(), static_cast<Eigen::Index>(linear.size() + nonlinear.size()));
  both << columns(terms, linear), nonlinear_columns(terms, on_balance, nonlinear);
  return both;
}

Eigen::VectorXd RegressionProblem::known_torque(const Terms& terms, const std::vector<std::size_t>& on_balance) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows());
  for (const std::size_t t : on_balance)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].adds_torque() && terms[t].known[p] && terms[t].entry->parameters[p].kind == Kind::linear &&
          terms[t].values[p] != 0.0)
        sum += terms[t].values[p] * *stored_columns(terms, {{t, p}}).front();
  for (const std::size_t t : on_balance)
    if (terms[t].scaled_by_none()) sum += term_torque(terms, t);
  for (const std::size_t t : terms_acting_on_other_balance(terms, balance(), prepared().output_signals))
    sum += term_torque(terms, t);
  return sum;
}

RegressionProblem::Regression RegressionProblem::regression(const Terms& terms,
                                                            const std::vector<std::size_t>& on_balance,
                                                            const std::vector<ParameterRef>& linear) const {
  return {columns(terms, linear), target() - known_torque(terms, on_balance)};
}

Eigen::VectorXd RegressionProblem::residual(const Terms& terms) const {
  Eigen::VectorXd left = target();
  for (const std::size_t t : terms_on(terms, balance(), prepared().output_signals)) left -= term_torque(terms, t);
  for (const std::size_t t : terms_acting_on_other_balance(terms, balance(), prepared().output_signals))
    left -= term_torque(terms, t);
  return left;
}

Eigen::VectorXd RegressionProblem::term_torque(const Terms& terms, std::size_t t) const {
  if (!terms[t].adds_torque()) return Eigen::VectorXd::Zero(rows());
  if (terms[t].scaled_by_none()) {
    const ColumnKey key = key_of(terms, t, ColumnKey::What::torque);
    if (const ColumnStore::Column found = store_->find(key)) return *found;
    return *store_->insert(key, evaluator_.torque(terms, t));
  }
  std::vector<ParameterRef> linear;
  for (std::size_t p = 0; p < terms[t].values.size(); ++p)
    if (terms[t].entry->parameters[p].kind == Kind::linear) linear.push_back({t, p});
  const std::vector<ColumnStore::Column> stored = stored_columns(terms, linear);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(rows());
  for (std::size_t j = 0; j < linear.size(); ++j) sum += terms[t].values[linear[j].parameter] * *stored[j];
  return sum;
}

}  // namespace flexspline::estimation
