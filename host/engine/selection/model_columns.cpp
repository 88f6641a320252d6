// Columns of the model, and relative changes of its friction.
#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/selection/table_builder.hpp"

namespace flexspline::selection {

bool add_model_columns(TableBuilder& builder) {
  estimation::BalanceData& data = builder.data;
  RegressorTable& table = builder.table;
  const estimation::Terms& terms = builder.terms;
  const auto on_balance = builder.on_balance();
  const std::vector<estimation::ParameterRef> linear = estimation::free_linear_parameters(terms, on_balance);
  const std::vector<estimation::ParameterRef> nonlinear = estimation::free_nonlinear_parameters(terms, on_balance);
  table.target = data.target() - data.known_torque(terms, on_balance);
  if (linear.empty() || data.rows() == 0) return false;
  const Eigen::MatrixXd base = data.columns(terms, linear);
  const auto add = [&](Eigen::VectorXd column, std::string name, double low) {
    builder.add(std::move(column));
    table.model_names.push_back(std::move(name));
    table.model_low.push_back(low);
  };
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const estimation::Term& t = terms[linear[j].term];
    const auto& info = t.entry->parameters[linear[j].parameter];
    add(base.col(static_cast<Eigen::Index>(j)), fmt::format("{}.{}", t.id, info.name), info.low);
  }
  if (!nonlinear.empty()) {
    const Eigen::MatrixXd slopes = data.nonlinear_columns(terms, on_balance, nonlinear);
    for (std::size_t j = 0; j < nonlinear.size(); ++j)
      add(slopes.col(static_cast<Eigen::Index>(j)), fmt::format("slope by {}", terms[nonlinear[j].term].id),
          -effects::kUnbounded);
  }
  const Eigen::VectorXd fitted = base * algebra::PivotedQr(base).solve(table.target);
  const estimation::PreparedData& prepared = builder.prepared();
  const Eigen::VectorXd through_gear = prepared.output_signals.torque
                                           ? builder.at_rows([&](const estimation::Record& r, std::size_t k) {
                                               return r.inputs.torque_at(k) / prepared.constants.gear_ratio;
                                             })
                                           : Eigen::VectorXd::Zero(data.rows());
  builder.effort = fitted + through_gear;
  // A lag between the columns is a nuisance parameter of every model.
  add(slope_of(builder.effort, table.runs), "time lag", -effects::kUnbounded);
  table.model_columns = static_cast<Eigen::Index>(builder.columns.size());
  return true;
}

void add_presliding_shape(TableBuilder& builder, Direction direction, const PreslidingTravels& travels) {
  for (const double travel : travels.shape) {
    Eigen::VectorXd column = Eigen::VectorXd::Zero(builder.data.rows());
    if (direction == Direction::presliding) {
      std::vector<std::vector<double>> states;
      for (const estimation::Record& r : builder.prepared().records) states.push_back(presliding_state(r, travel));
      column = builder.at_rows([&](const estimation::Record& r, std::size_t k) {
        return states[static_cast<std::size_t>(&r - builder.prepared().records.data())][k] -
               TableBuilder::direction(r, k);
      });
      builder.filter(column);
    }
    builder.table.presliding_shape.push_back(builder.add(std::move(column)));
  }
}

void add_differences(TableBuilder& builder) {
  using estimation::Record;
  if (builder.data.balance() != Balance::motor) return;
  const estimation::Terms& terms = builder.terms;
  const auto friction_of = [&](std::string_view surface) {
    double sum = 0.0;
    for (const std::size_t t : builder.on_balance())
      if (terms[t].entry->info->surface == surface && terms[t].entry->info->balance == Balance::motor)
        for (std::size_t p = 0; p < terms[t].values.size(); ++p)
          if (terms[t].entry->parameters[p].kind == effects::Kind::linear && terms[t].entry->parameters[p].low == 0.0) {
            sum += terms[t].values[p];
            break;
          }
    return sum;
  };
  const auto difference = [&](double size, auto value) {
    if (size == 0.0) return;
    Eigen::VectorXd column = builder.at_rows([&](const Record& r, std::size_t k) { return size * value(r, k); });
    builder.filter(column);
    builder.table.differences.push_back(builder.add(std::move(column)));
  };
  const auto direction = TableBuilder::direction;
  const double viscous = friction_of("viscous friction"), dry = friction_of("dry friction");
  difference(viscous, [](const Record& r, std::size_t k) { return r.inputs.velocity_at(k); });
  difference(viscous, [](const Record& r, std::size_t k) { return std::abs(r.inputs.velocity_at(k)); });
  difference(dry, [&](const Record& r, std::size_t k) { return direction(r, k); });
  difference(dry, [&](const Record& r, std::size_t k) { return direction(r, k) * direction(r, k); });
}

}  // namespace flexspline::selection
