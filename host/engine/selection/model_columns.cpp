// Columns of the model, and relative changes of its friction.
#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/selection/table_builder.hpp"

namespace flexspline::selection {

namespace {

// What the model's parameters make of the target, and the torque that goes through the gear.
Eigen::VectorXd modelled_effort(const DirectedData& from, const Eigen::MatrixXd& base, const Eigen::VectorXd& target) {
  Eigen::VectorXd effort = base * algebra::PivotedQr(base).solve(target);
  if (from.prepared.output_signals.torque)
    effort += from.at_rows([&](const estimation::Record& r, std::size_t k) {
      return r.inputs.torque_at(k) / from.prepared.constants.gear_ratio;
    });
  return effort;
}

}  // namespace

bool add_model_columns(TableBuilder& builder) {
  RegressorTable& table = builder.table;
  const estimation::Terms& terms = builder.terms;
  const auto on_balance = builder.on_balance();
  const std::vector<estimation::ParameterRef> linear = estimation::free_linear_parameters(terms, on_balance);
  const std::vector<estimation::ParameterRef> nonlinear = estimation::free_nonlinear_parameters(terms, on_balance);
  const auto target_of = [&](DirectedData& from) {
    return Eigen::VectorXd(from.data.target() - from.data.known_torque(terms, on_balance));
  };
  table.target = target_of(builder.sign);
  if (linear.empty() || table.target.size() == 0) return false;
  if (builder.presliding) table.presliding = {{}, {}, target_of(*builder.presliding)};
  const auto add = [&](TableBuilder::DirectedColumns made, std::string name, double low) {
    builder.add(std::move(made));
    table.model_names.push_back(std::move(name));
    table.model_low.push_back(low);
  };
  const TableBuilder::DirectedColumns base =
      builder.directed_columns([&](DirectedData& d) { return d.data.columns(terms, linear); }, true);
  const auto column_of = [](const TableBuilder::DirectedColumns& made, std::size_t j) {
    const auto at = static_cast<Eigen::Index>(j);
    TableBuilder::DirectedColumns one{made.sign.col(at), {}};
    if (made.presliding.cols() > 0) one.presliding = made.presliding.col(at);
    return one;
  };
  for (std::size_t j = 0; j < linear.size(); ++j) {
    const estimation::Term& t = terms[linear[j].term];
    const auto& info = t.entry->parameters[linear[j].parameter];
    add(column_of(base, j), fmt::format("{}.{}", t.id, info.name), info.low);
  }
  if (!nonlinear.empty()) {
    const TableBuilder::DirectedColumns slopes = builder.directed_columns(
        [&](DirectedData& d) { return d.data.nonlinear_columns(terms, on_balance, nonlinear); }, true);
    for (std::size_t j = 0; j < nonlinear.size(); ++j)
      add(column_of(slopes, j), fmt::format("slope by {}", terms[nonlinear[j].term].id), -effects::kUnbounded);
  }
  builder.sign.effort = modelled_effort(builder.sign, base.sign, table.target);
  if (builder.presliding)
    builder.presliding->effort = modelled_effort(*builder.presliding, base.presliding, table.presliding->target);
  // A lag between the columns is a nuisance parameter of every model.
  add(builder.directed_columns([&](DirectedData& d) { return slope_of(d.effort, table.runs); }, true), "time lag",
      -effects::kUnbounded);
  table.model_columns = static_cast<Eigen::Index>(builder.columns.size());
  return true;
}

namespace {

// The state of presliding over a travel less another state of each record, which is given sample by sample.
template <class State>
Eigen::MatrixXd change_of_state(const TableBuilder& builder, const DirectedData& from, double travel, State less) {
  std::vector<std::vector<double>> change;
  for (const estimation::Record& r : from.prepared.records) {
    change.push_back(presliding_state(r, travel));
    const std::vector<double> other = less(r);
    for (std::size_t k = 0; k < other.size(); ++k) change.back()[k] -= other[k];
  }
  return builder.filtered(from.at_rows([&](const estimation::Record& r, std::size_t k) {
    return change[static_cast<std::size_t>(&r - from.prepared.records.data())][k];
  }));
}

}  // namespace

void add_presliding_shape(TableBuilder& builder, const PreslidingTravels& travels) {
  const auto of_law = [](const estimation::Record& r) { return r.inputs.directions[0]; };
  for (const double travel : travels.shape)
    builder.shapes.emplace_back(change_of_state(builder, *builder.presliding, travel, of_law));
}

void add_other_travels(TableBuilder& builder) {
  for (const std::size_t t : builder.on_balance()) {
    const estimation::Term& law = builder.terms[t];
    const auto is_travel = [](const effects::ParameterInfo& p) { return p.limit == effects::Limit::travel; };
    const auto at = std::find_if(law.entry->parameters.begin(), law.entry->parameters.end(), is_travel);
    if (!law.entry->is_presliding() || at == law.entry->parameters.end()) continue;
    const double travel = law.values[static_cast<std::size_t>(at - law.entry->parameters.begin())];
    const auto of_law = [&](const estimation::Record& r) { return presliding_state(r, travel); };
    for (const double factor : {1.0 / builder.policy.presliding_shape_factor, builder.policy.presliding_shape_factor}) {
      CandidateTerm term;
      term.name = "presliding over another travel";
      term.columns = builder.add({change_of_state(builder, builder.sign, factor * travel, of_law), {}});
      term.low = {0.0};
      builder.table.terms.push_back(std::move(term));
    }
  }
}

void add_differences(TableBuilder& builder) {
  using estimation::Record;
  if (builder.sign.data.balance() != Balance::motor) return;
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
  const auto difference = [&](double size, bool reads_direction, auto value) {
    if (size == 0.0) return;
    const auto column = [&](DirectedData& d) {
      return builder.filtered(d.at_rows([&](const Record& r, std::size_t k) { return size * value(r, k); }));
    };
    builder.table.differences.push_back(builder.add(builder.directed_columns(column, reads_direction)).front());
  };
  const auto direction = DirectedData::direction;
  const double viscous = friction_of("viscous friction"), dry = friction_of("dry friction");
  difference(viscous, false, [](const Record& r, std::size_t k) { return r.inputs.velocity_at(k); });
  difference(viscous, false, [](const Record& r, std::size_t k) { return std::abs(r.inputs.velocity_at(k)); });
  difference(dry, true, [&](const Record& r, std::size_t k) { return direction(r, k); });
  difference(dry, true, [&](const Record& r, std::size_t k) { return direction(r, k) * direction(r, k); });
}

}  // namespace flexspline::selection
