#include "host/engine/planning/information.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/model_projection.hpp"

namespace flexspline::planning {
namespace {

using estimation::ParameterRef;
using estimation::Term;

// User-defined effects share their names.
std::string name_of(const Term& term) {
  return term.entry->definition ? fmt::format("{} {}", term.entry->name(), term.id) : std::string(term.entry->name());
}

// Everything that a column depends on except the data: the term's own nonlinear parameters, and those of what may
// change its inputs.
std::string label_of(const Terms& terms, ParameterRef ref) {
  std::string label = fmt::format("{} {}", name_of(terms[ref.term]), ref.parameter);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (t != ref.term && terms[t].entry->info->phase == effects::Phase::source) continue;
    label += fmt::format(" {}", name_of(terms[t]));
    for (std::size_t p = 0; p < terms[t].values.size(); ++p)
      if (terms[t].entry->parameters[p].kind != effects::Kind::linear)
        label += fmt::format(",{:a}", terms[t].values[p]);
  }
  return label;
}

std::string label_of(const Terms& terms) {
  std::string label;
  for (const Term& t : terms) {
    label += fmt::format(" {}", name_of(t));
    for (std::size_t p = 0; p < t.values.size(); ++p) label += fmt::format(",{:a}", t.values[p]);
  }
  return label;
}

std::vector<std::size_t> on_balance(const Terms& terms, const RegressionProblem& data) {
  return estimation::terms_on(terms, data.balance(), data.prepared().output_signals);
}

bool is_on(const Terms& terms, const RegressionProblem& data, std::size_t term) {
  const auto list = on_balance(terms, data);
  return std::find(list.begin(), list.end(), term) != list.end();
}

}  // namespace

std::size_t ColumnLayout::place(std::string label, std::function<Eigen::VectorXd(const RegressionProblem&)> make) {
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (columns_[i].label == label) return i;
  columns_.push_back({std::move(label), std::move(make)});
  return columns_.size() - 1;
}

Hypothesis ColumnLayout::add(Terms terms) {
  Hypothesis h;
  for (std::size_t t = 0; t < terms.size(); ++t)
    for (std::size_t p = 0; p < terms[t].values.size(); ++p) {
      const ParameterRef ref{t, p};
      if (terms[t].free_linear(p))
        h.columns.push_back(place(label_of(terms, ref), [terms, ref](const RegressionProblem& data) -> Eigen::VectorXd {
          if (!is_on(terms, data, ref.term)) return Eigen::VectorXd::Zero(data.rows());
          return data.column(terms, ref);
        }));
      else if (terms[t].free_nonlinear(p))
        h.columns.push_back(place(fmt::format("slope {}{}", label_of(terms, ref), label_of(terms)),
                                  [terms, ref](const RegressionProblem& data) -> Eigen::VectorXd {
                                    return data.nonlinear_columns(terms, on_balance(terms, data), {ref});
                                  }));
    }
  h.columns.push_back(
      place("delay", [](const RegressionProblem& data) -> Eigen::VectorXd { return data.delay_column(); }));
  h.torque = place("torque" + label_of(terms), [terms](const RegressionProblem& data) -> Eigen::VectorXd {
    return estimation::model_torque(data, terms);
  });
  h.known = place("known" + label_of(terms), [terms](const RegressionProblem& data) -> Eigen::VectorXd {
    return data.known_torque(terms, on_balance(terms, data));
  });
  h.terms = std::move(terms);
  return h;
}

Eigen::MatrixXd ColumnLayout::over(const RegressionProblem& data) const {
  Eigen::MatrixXd all(data.rows(), static_cast<Eigen::Index>(columns_.size()));
  for (std::size_t i = 0; i < columns_.size(); ++i) all.col(static_cast<Eigen::Index>(i)) = columns_[i].make(data);
  return all;
}

std::vector<Eigen::MatrixXd> factors(const RegressionProblem& data, const Eigen::MatrixXd& columns) {
  std::vector<Eigen::MatrixXd> all(data.prepared().records.size());
  for (const estimation::RowRange& range : data.records()) {
    const Eigen::MatrixXd rows = columns.middleRows(range.first, range.size());
    all[range.record] = stacked_factor({&rows});
  }
  return all;
}

Eigen::MatrixXd stacked_factor(const std::vector<const Eigen::MatrixXd*>& parts) {
  Eigen::Index rows = 0, columns = 0;
  for (const Eigen::MatrixXd* part : parts) {
    rows += part->rows();
    columns = std::max(columns, part->cols());
  }
  if (rows <= columns) {
    Eigen::MatrixXd stack(rows, columns);
    rows = 0;
    for (const Eigen::MatrixXd* part : parts)
      if (part->rows() > 0) {
        stack.middleRows(rows, part->rows()) = *part;
        rows += part->rows();
      }
    return stack;
  }
  Eigen::MatrixXd stack(rows, columns);
  rows = 0;
  for (const Eigen::MatrixXd* part : parts)
    if (part->rows() > 0) {
      stack.middleRows(rows, part->rows()) = *part;
      rows += part->rows();
    }
  return algebra::r_factor(std::move(stack));
}

double unexplained(const Eigen::MatrixXd& factor, const Hypothesis& truth, const Hypothesis& other) {
  if (factor.rows() == 0) return 0.0;
  Eigen::MatrixXd X(factor.rows(), static_cast<Eigen::Index>(other.columns.size()));
  for (std::size_t j = 0; j < other.columns.size(); ++j) {
    X.col(static_cast<Eigen::Index>(j)) = factor.col(static_cast<Eigen::Index>(other.columns[j]));
    const double length = X.col(static_cast<Eigen::Index>(j)).norm();
    if (length > 0.0) X.col(static_cast<Eigen::Index>(j)) /= length;
  }
  const Eigen::VectorXd y =
      factor.col(static_cast<Eigen::Index>(truth.torque)) - factor.col(static_cast<Eigen::Index>(other.known));
  return (y - X * algebra::PivotedQr(X, 1e-7).solve(y)).squaredNorm();
}

}  // namespace flexspline::planning
