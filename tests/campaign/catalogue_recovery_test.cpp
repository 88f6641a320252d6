// Every effect of the catalogue, put into the plant, which is written apart from the library: identified from noisy
// records, shown by the right map, and missed when it is taken out.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include "host/engine/comparison/residual_map.hpp"
#include "host/engine/selection/add.hpp"
#include "tests/support/campaign_size.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::catalogue_recovery_test {
namespace {

struct Recovered {
  std::string name;
  double truth = 0.0;
  double value = 0.0;
  std::optional<double> std;
  bool nonlinear = false;
  double error_percent() const {
    return truth != 0.0 ? 100.0 * std::abs(value / truth - 1.0) : std::numeric_limits<double>::infinity();
  }
  bool inside() const { return std && std::abs(value - truth) <= 1.96 * *std; }
};

struct Outcome {
  std::string effect;
  std::vector<Recovered> parameters;
  double without_over_floor = 0.0;  // hold-out error of the model without the effect
  double with_over_floor = 0.0;
  double removed_over_floor = 0.0;
  double fit_share = 0.0;          // error on the records of the fit, with over without
  std::vector<std::string> maps;   // variables that the error without it depends on, most explaining first
  std::vector<double> map_shares;  // percent that each explains
  std::string failure;
};

double root_mean_square(const Eigen::VectorXd& r) {
  return std::sqrt(r.squaredNorm() / std::max<double>(1.0, static_cast<double>(r.size())));
}

// A delay of a millisecond that the model lacks is drawn in part by friction that may differ from record to record.
const std::map<std::string, double> kTimesUsual = {{"current_delay", 1.5}};

Outcome recover(const std::string& label, std::uint64_t seed) {
  Outcome outcome;
  outcome.effect = label;
  plant::PlantFile demo = plant::demo_plant();
  const std::string type = label.substr(0, label.find(':'));
  // What the base model has already is hidden as it is.
  plant::without(demo.drive, label);
  const auto size = kTimesUsual.find(type);
  plant::hide(demo.drive, label, size == kTimesUsual.end() ? 1.0 : size->second);
  const auto records = plant::record_all(demo.drive, demo.experiments, seed);
  const data::Dataset dataset = tests::dataset_of(demo.drive, records);
  const model::Model base = tests::model_of(demo.drive, false, false);
  const model::Model truth = tests::model_of(demo.drive, true, true);
  const auto balance = catalogue::get(type).identified_on();

  std::vector<const data::Experiment*> fit, holdout;
  for (const auto& e : dataset.experiments) (e.role == data::Role::holdout ? holdout : fit).push_back(&e);
  const estimation::PreparedData prepared = estimation::prepare(fit, truth, {});
  const estimation::PreparedData held_out = estimation::prepare_with(holdout, truth.drive, prepared.pipeline);
  estimation::RegressionProblem on_holdout(held_out, balance);
  const double floor = root_mean_square(on_holdout.residual(estimation::terms_of(truth)));

  const selection::Addition added = selection::add(dataset, base, label, {});
  outcome.without_over_floor = *added.before.rmse_holdout / floor;
  outcome.with_over_floor = *added.after.rmse_holdout / floor;
  outcome.fit_share = added.after.rmse_fit / added.before.rmse_fit;
  const model::Effect* hidden = nullptr;
  for (const model::Effect& e : truth.effects)
    if (estimation::term_of(e).label() == label) hidden = &e;
  if (!hidden) throw std::runtime_error("the truth lacks " + label);
  for (const auto& e : added.estimates) {
    if (e.effect != type || estimation::term_of(*added.model.find(e.id)).label() != label) continue;
    const model::Parameter* p = hidden->find(e.parameter);
    if (!p || !p->value) continue;
    const auto& infos = catalogue::get(type).parameters;
    const auto& info = infos[catalogue::get(type).index_of(e.parameter)];
    outcome.parameters.push_back({e.parameter, *p->value, e.value, e.std, info.kind == effects::Kind::nonlinear});
  }
  // An effect that took the place of another leaves a gap; the base model is then what comes back.
  if (catalogue::get(type).info->replaces.empty() && catalogue::get(type).info->contains.empty())
    outcome.removed_over_floor = *selection::remove(dataset, added.model, label, {}).after.rmse_holdout / floor;
  else
    outcome.removed_over_floor = outcome.without_over_floor;

  const auto without = estimation::identify(dataset, base, {});
  for (std::size_t b = 0; b < without->data.size(); ++b)
    if (without->data[b].balance() == balance)
      for (const auto& share : comparison::localise(without->data[b], without->data[b].residual(without->terms),
                                                    without->fits[b].autocorrelation_time))
        if (share.share_percent > 1.0) {
          outcome.maps.push_back(share.variable);
          outcome.map_shares.push_back(share.share_percent);
        }
  return outcome;
}

std::vector<Outcome> recover_all(const std::vector<std::string>& labels, std::uint64_t seed) {
  std::vector<Outcome> outcomes(labels.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < labels.size(); i = next++) try {
        outcomes[i] = recover(labels[i], seed);
      } catch (const std::exception& error) {
        outcomes[i].effect = labels[i];
        outcomes[i].failure = error.what();
      }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < std::max(1u, std::thread::hardware_concurrency()); ++t) threads.emplace_back(work);
  for (std::thread& t : threads) t.join();
  return outcomes;
}

void print(const std::vector<Outcome>& outcomes) {
  for (const Outcome& o : outcomes) {
    fmt::print("{:34} hold-out {:9.3f} -> {:.3f} of floor, removed {:9.3f} | {}", o.effect, o.without_over_floor,
               o.with_over_floor, o.removed_over_floor, o.failure);
    for (const Recovered& r : o.parameters)
      fmt::print(" {} {:.2f} %{}", r.name, r.error_percent(), r.inside() ? " in" : "");
    fmt::print(" | maps:");
    for (std::size_t i = 0; i < std::min<std::size_t>(4, o.maps.size()); ++i) fmt::print(" [{}]", o.maps[i]);
    fmt::print("\n");
  }
}

// Errors in percent that are allowed where the demo's motions show a parameter badly, and why.
const std::map<std::string, double> kHardToSee = {
    // It acts only while the bristles bend, which the mask of reversals hides: its standard error is 21 %.
    {"lugre_friction.damping", 70.0},
    // Found 2 % high with the stiffness, one against the other; its error is at the floor all the same.
    {"torque_proportional_hysteresis.torque", 3.0},
};

// Laws whose weights stand on another grid of thresholds than the plant's.
const std::set<std::string> kJudgedByTheirLoops = {"prandtl_ishlinskii_hysteresis", "preisach_hysteresis"};

// What a single bias of these records cannot be distinguished from but by the record at rest, which is not held out.
const std::set<std::string> kHiddenByOffsets = {"coulomb_asymmetry", "current_offset"};

// Maps of which one must be among the first four of the residual without the effect.
const std::map<std::string, std::string> kShownBy = {
    {"inertia", "acceleration"},
    {"viscous_friction", "velocity,speed"},
    {"coulomb_friction", "speed x direction,velocity x direction"},
    {"viscous_asymmetry", "velocity,speed"},
    {"coulomb_asymmetry", "record"},
    {"stribeck_gaussian", "speed x direction"},
    {"stribeck_hess_soom", "speed x direction"},
    {"power_law_friction", "speed x direction"},
    {"quadratic_drag", "speed x direction"},
    {"load_dependent_friction", "torque x direction"},
    {"load_dependent_stiction", "torque x direction,speed x direction"},
    {"driving_dependent_loss", "torque x direction"},
    {"temperature_viscous", "temperature,record x direction"},
    {"temperature_coulomb", "temperature x direction"},
    {"dahl_friction", "travel x direction"},
    {"lugre_friction", "travel x direction"},
    {"torque_ripple", "motor_angle"},
    {"load_scaled_ripple", "torque"},
    {"angle_dependent_friction", "motor_angle x direction"},
    {"current_offset", "record"},
    {"torque_constant_error", "torque,current"},
    {"torque_constant_saturation", "current"},
    {"current_saturation", "current"},
    {"current_delay", "velocity,record x direction"},
    {"linear_stiffness", "torsion"},
    {"quadratic_stiffness", "torsion"},
    {"cubic_stiffness", "torsion"},
    {"piecewise_stiffness", "torsion"},
    {"structural_damping", "velocity,torsion_rate"},
    {"dahl_hysteresis", "travel x direction"},
    {"modified_dahl_hysteresis", "travel x direction"},
    {"duhem_hysteresis", "travel x direction"},
    {"bouc_wen_hysteresis", "travel x direction"},
    {"prandtl_ishlinskii_hysteresis", "travel x direction"},
    {"preisach_hysteresis", "travel x direction,record"},
    {"torque_proportional_hysteresis", "travel x direction"},
    // In locked load the motor hardly turns, and free motion is masked where it does not twist the flexspline: over
    // these records a ripple of the second order is an offset that goes with the direction of its reversal.
    {"kinematic_error", "motor_angle,velocity x direction"},
    {"torque_sensor_ripple", "motor_angle,velocity x direction"},
    {"backlash", "torsion"},
    {"torque_offset", "velocity x direction"},
    {"torque_sensor_gain", "torque"},
    {"torsion_zero", "velocity x direction"},
    {"output_inertia", "acceleration"},
    {"output_viscous_friction", "velocity,speed"},
    {"output_coulomb_friction", "speed x direction"},
    {"gravity", "output_angle"},
};

TEST(Catalogue, IsRecoveredEffectByEffectFromThePlant) {
  std::vector<std::string> labels;
  for (const auto& effect : plant::demo_plant().drive.effects)
    if (effect.catalogue) labels.push_back(effect.label());
  labels = tests::part_of(labels, 5);
  const auto outcomes = recover_all(labels, 7001);
  print(outcomes);
  for (const Outcome& o : outcomes) {
    SCOPED_TRACE(o.effect);
    ASSERT_EQ(o.failure, "");
    const std::string type = o.effect.substr(0, o.effect.find(':'));
    const bool any_shape_of_loop = kJudgedByTheirLoops.contains(type);
    for (const Recovered& r : o.parameters) {
      if (any_shape_of_loop) break;
      const auto known = kHardToSee.find(type + "." + r.name);
      const double most = known != kHardToSee.end() ? known->second : r.nonlinear ? 5.0 : 2.0;
      // A parameter that these motions hardly excite is known no better than its interval says.
      EXPECT_TRUE(r.error_percent() <= most || r.inside())
          << r.name << " is " << r.value << " instead of " << r.truth << ", standard error " << r.std.value_or(0.0);
    }
    // Without it the error stands above the floor, with it at the floor; plays on another grid come halfway. Of the
    // many relays of Preisach's law these few amplitudes show too little for another one: hysteresis_loops_test has
    // more.
    if (type == "preisach_hysteresis")
      EXPECT_LT(o.fit_share, 0.2);
    else
      EXPECT_LE(o.with_over_floor, type == "prandtl_ishlinskii_hysteresis" ? 1.3 : 1.1);
    EXPECT_TRUE(o.without_over_floor >= 1.8 || kHiddenByOffsets.contains(type)) << o.without_over_floor;
    EXPECT_NEAR(o.removed_over_floor, o.without_over_floor, 0.06 * o.without_over_floor);
    const auto expected = kShownBy.find(type);
    ASSERT_NE(expected, kShownBy.end());
    const auto names = catalogue::split_names(expected->second);
    // The first four, and what explains as much: seven maps of a Bouc-Wen law have 39 to 45 %, in an order by chance.
    constexpr double kAsMuch = 0.85;
    std::size_t looked_at = std::min<std::size_t>(4, o.maps.size());
    while (looked_at < o.maps.size() && o.map_shares[looked_at] >= kAsMuch * o.map_shares.front()) ++looked_at;
    EXPECT_TRUE(std::any_of(o.maps.begin(), o.maps.begin() + static_cast<std::ptrdiff_t>(looked_at),
                            [&](const std::string& map) {
                              return std::any_of(names.begin(), names.end(),
                                                 [&](std::string_view n) { return map.starts_with(n); });
                            }))
        << "none of the first maps is one of " << expected->second;
  }
}

}  // namespace
}  // namespace flexspline::catalogue_recovery_test
