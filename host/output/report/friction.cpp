#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/parts.hpp"
#include "host/physics/catalogue/steady_torques.hpp"

namespace flexspline::report {
namespace {

using estimation::Balance;
using nlohmann::json;
using output::json_number;
using output::json_numbers;

constexpr std::size_t kBinsOfADirection = 30;
constexpr double kFewestInBin = 8.0;

// Torque on the motor of an effect in steady motion of a loaded drive, with its memory in steady state. The angle is
// the same in all: what follows it is no friction.
double steady_torque(const estimation::Term& term, const View& view, double velocity) {
  const std::vector<double> values = catalogue::natural(*term.entry, term.values);
  const auto instance = term.entry->make(values.data(), view.prepared.constants);
  const double gear = view.prepared.constants.gear_ratio;
  effects::Inputs<catalogue::Real> in{};
  in.velocity = velocity;
  in.speed = std::abs(velocity);
  in.direction = in.output_direction = velocity < 0.0 ? -1.0 : 1.0;
  in.output_velocity = velocity / gear;
  in.torque = in.torque_magnitude = gear;
  in.current = 1.0;
  in.temperature = view.prepared.constants.reference_temperature;
  in.viscous_scale = in.coulomb_scale = 1.0;
  const effects::Torques<catalogue::Real> torques = catalogue::steady_torques(*instance, term.entry->has_state, in);
  return torques.motor + (view.prepared.output_signals.torque ? 0.0 : torques.load / gear);
}

// What depends on how fast, or in which direction, the motor turns.
bool is_friction(const estimation::Term& term, const View& view) {
  if (!term.adds_torque()) return false;
  const double fast = 100.0 / view.prepared.constants.turn_angle_scale;
  const double reference = steady_torque(term, view, fast);
  for (const double velocity : {-fast, 0.05 * fast, -0.05 * fast, 0.01 * fast}) {
    const double other = steady_torque(term, view, velocity);
    if (std::abs(other - reference) > 1e-9 * std::max(std::abs(reference), std::abs(other))) return true;
  }
  return false;
}

// Bins of equal counts, for each direction apart: between them friction jumps.
comparison::Bins bins_by_direction(const Eigen::VectorXd& velocity) {
  comparison::Bins bins;
  bins.bin.assign(static_cast<std::size_t>(velocity.size()), -1);
  for (const double sign : {-1.0, 1.0}) {
    Eigen::VectorXd side = velocity;
    for (double& v : side)
      if (!(sign * v > 0.0)) v = std::nan("");
    const comparison::Bins part = comparison::equal_count_bins(side, kBinsOfADirection);
    const auto before = static_cast<int>(bins.edges.empty() ? 0 : bins.edges.size() - 1);
    for (std::size_t k = 0; k < part.bin.size(); ++k)
      if (part.bin[k] >= 0) bins.bin[k] = before + part.bin[k];
    // Only the number of bins matters below.
    bins.edges.resize(static_cast<std::size_t>(before) + part.count() + 1);
  }
  return bins;
}

struct Averages {
  const comparison::Bins& bins;
  std::vector<double> rows;

  explicit Averages(const comparison::Bins& b) : bins(b), rows(b.count(), 0.0) {
    for (const int bin : bins.bin)
      if (bin >= 0) rows[static_cast<std::size_t>(bin)] += 1.0;
  }
  std::vector<double> of(const Eigen::VectorXd& values) const {
    std::vector<double> sum(bins.count(), 0.0);
    for (Eigen::Index k = 0; k < values.size(); ++k)
      if (const int bin = bins.bin[static_cast<std::size_t>(k)]; bin >= 0)
        sum[static_cast<std::size_t>(bin)] += values[k];
    for (std::size_t b = 0; b < sum.size(); ++b) sum[b] = rows[b] >= kFewestInBin ? sum[b] / rows[b] : std::nan("");
    return sum;
  }
};

}  // namespace

json friction_curve(View& view) {
  const auto balance = std::find_if(view.balances.begin(), view.balances.end(),
                                    [](const BalanceView& b) { return b.data->balance() == Balance::motor; });
  if (balance == view.balances.end()) return nullptr;
  const estimation::RegressionProblem& data = *balance->data;
  Eigen::VectorXd velocity;
  for (const comparison::SampleVariable& v : comparison::sample_variables(data, view.axis()))
    if (v.name == "velocity") velocity = v.values;
  std::vector<std::size_t> friction;
  std::vector<std::size_t> all = estimation::terms_on(view.terms, Balance::motor, view.prepared.output_signals);
  for (const std::size_t t :
       estimation::terms_acting_on_other_balance(view.terms, Balance::motor, view.prepared.output_signals))
    all.push_back(t);
  for (const std::size_t t : all)
    if (is_friction(view.terms[t], view)) friction.push_back(t);
  if (velocity.size() == 0 || friction.empty()) return nullptr;

  const comparison::Bins bins = bins_by_direction(velocity);
  if (bins.count() < 2) return nullptr;
  const Averages averages(bins);
  Eigen::VectorXd total = Eigen::VectorXd::Zero(data.rows());
  json parts = json::array();
  for (const std::size_t t : friction) {
    const Eigen::VectorXd torque = data.term_torque(view.terms, t);
    total += torque;
    parts.push_back({{"id", view.terms[t].id},
                     {"effect", view.terms[t].entry->name()},
                     {"torque", json_numbers(averages.of(torque))}});
  }
  // Measured friction is what the rest of the model leaves of the balance.
  const Eigen::VectorXd measured = total + balance->residual;
  const std::vector<double> mean = averages.of(measured);
  Eigen::VectorXd squares = measured;
  for (Eigen::Index k = 0; k < squares.size(); ++k) {
    const int bin = bins.bin[static_cast<std::size_t>(k)];
    const double d = bin >= 0 ? measured[k] - mean[static_cast<std::size_t>(bin)] : 0.0;
    squares[k] = d * d;
  }
  std::vector<double> error = averages.of(squares);
  for (std::size_t b = 0; b < error.size(); ++b)
    error[b] = std::sqrt(error[b] * std::min(balance->autocorrelation_time, averages.rows[b]) / averages.rows[b]);
  return {{"unit", balance->unit},
          {"velocity_unit", view.unit_of(data::Column::motor_velocity)},
          {"velocity", json_numbers(averages.of(velocity))},
          {"measured", json_numbers(mean)},
          {"standard_error", json_numbers(error)},
          {"model", json_numbers(averages.of(total))},
          {"parts", std::move(parts)}};
}

}  // namespace flexspline::report
