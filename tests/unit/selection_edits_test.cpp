#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_edits_test {
namespace {

using data::Column;
using estimation::Term;
using estimation::Terms;

constexpr double kPi = 3.14159265358979323846;
constexpr double kInertia = 1e-3, kViscous = 4e-3, kCoulomb = 0.05;
const estimation::PipelineOptions kOptions{40.0, true};

// An axis whose motion (two sines) and torque are written down, not simulated; with white noise on the torque.
data::Experiment experiment(std::string name, double phase, const std::function<double(double q, double w)>& extra,
                            unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.002);
  data::Experiment e;
  e.name = std::move(name);
  e.sample_s = 1e-3;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < 5000; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    double q = 0.0, w = 0.0, a = 0.0;
    for (const auto& [amplitude, frequency_hz] : {std::pair{3.0, 0.9}, {0.5, 2.7}}) {
      const double rate = 2.0 * kPi * frequency_hz, angle = rate * t + phase * frequency_hz;
      q += amplitude * std::sin(angle);
      w += amplitude * rate * std::cos(angle);
      a -= amplitude * rate * rate * std::sin(angle);
    }
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(kInertia * a + kViscous * w + std::copysign(kCoulomb, w) + extra(q, w) +
                                      noise(random));
  }
  e.segments = {{0, e.size()}};
  return e;
}

model::Model model_of(const std::vector<std::string>& effects) {
  model::Model m;
  for (const std::string& name : effects)
    m.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return m;
}

const std::vector<std::string> kPlain{"inertia", "viscous_friction", "coulomb_friction"};

std::vector<std::string> labels(const Terms& terms) {
  std::vector<std::string> list;
  for (const Term& t : terms) list.push_back(t.label());
  return list;
}

std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const model::ModelError& error) {
    return error.what();
  }
  return "no error";
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

TEST(ParseEffect, ReadsANameAndItsOrder) {
  EXPECT_EQ(parse_effect("gravity").entry, catalogue::find("gravity"));
  EXPECT_FALSE(parse_effect("gravity").order);
  EXPECT_EQ(parse_effect("torque_ripple:2").entry, catalogue::find("torque_ripple"));
  EXPECT_EQ(parse_effect("torque_ripple:2").order, 2.0);
  EXPECT_EQ(parse_effect("torque_ripple:0.5").order, 0.5);
}

TEST(ParseEffect, SaysWhatIsWrongAndWhatToWrite) {
  EXPECT_TRUE(contains(error_of([] { parse_effect("gravty"); }), "no effect named \"gravty\""));
  EXPECT_TRUE(contains(error_of([] { parse_effect("gravty:2"); }), "no effect named \"gravty\""));
  EXPECT_TRUE(contains(error_of([] { parse_effect("torque_ripple"); }), "write torque_ripple:2"));
  EXPECT_TRUE(contains(error_of([] { parse_effect("gravity:2"); }), "leave out \":2\""));
  for (const char* text : {"torque_ripple:", "torque_ripple:two", "torque_ripple:2x", "torque_ripple:-1",
                           "torque_ripple:0", "torque_ripple:nan", "torque_ripple:inf", "torque_ripple:5000"})
    EXPECT_TRUE(contains(error_of([&] { parse_effect(text); }), "is no order")) << text;
}

TEST(Extend, PutsTheNewEffectLastAndTakesOutWhatItReplaces) {
  const Terms terms = estimation::terms_of(model_of(kPlain));
  EXPECT_EQ(labels(extend(terms, catalogue::get("viscous_asymmetry"), {})),
            (std::vector<std::string>{"inertia", "viscous_friction", "coulomb_friction", "viscous_asymmetry"}));
  EXPECT_EQ(labels(extend(terms, catalogue::get("dahl_friction"), {})),
            (std::vector<std::string>{"inertia", "viscous_friction", "dahl_friction"}));
}

Unexplained whole(const estimation::RegressionProblem& data) {
  return {data.target(), Eigen::VectorXd::Ones(data.rows()), {}};
}

TEST(Extend, RefusesToScaleWhatIsNotThere) {
  const Terms without = estimation::terms_of(model_of({"inertia", "coulomb_friction"}));
  const std::string error = error_of([&] { extend(without, catalogue::get("temperature_viscous"), {}); });
  EXPECT_TRUE(contains(error, "temperature_viscous scales viscous_friction, which the model does not have")) << error;
  EXPECT_NO_THROW(extend(estimation::terms_of(model_of(kPlain)), catalogue::get("temperature_viscous"), {}));
}

TEST(Extend, RefusesWhatIsThereAlreadyButTakesAnotherOrder) {
  const catalogue::Entry& ripple = catalogue::get("torque_ripple");
  const Terms terms = estimation::terms_of(model_of(kPlain));
  EXPECT_TRUE(contains(error_of([&] { extend(terms, catalogue::get("inertia"), {}); }), "has inertia already"));
  const Terms one = extend(terms, ripple, 2.0);
  EXPECT_TRUE(contains(error_of([&] { extend(one, ripple, 2.0); }), "has torque_ripple:2 already"));
  const Terms two = extend(one, ripple, 4.0);
  ASSERT_EQ(two.size(), 5u);
  EXPECT_EQ(two[4].label(), "torque_ripple:4");
  EXPECT_NE(two[3].id, two[4].id);
}

TEST(CandidateModels, HoldWhatTheSignalsCanShowAndTheModelLacks) {
  data::Experiment e = experiment(
      "a", 0.0, [](double, double) { return 0.0; }, 1);
  const auto names_for = [&](const Terms& terms) {
    const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
    const estimation::RegressionProblem data(prepared, estimation::Balance::motor);
    std::vector<std::string> names;
    for (const CandidateModel& p : candidate_models(data, terms, whole(data))) names.push_back(p.terms.back().label());
    return names;
  };
  const auto has = [](const std::vector<std::string>& names, std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const Terms terms = extend(estimation::terms_of(model_of(kPlain)), catalogue::get("torque_ripple"), 3.0);
  const std::vector<std::string> names = names_for(terms);
  EXPECT_TRUE(has(names, "viscous_asymmetry"));
  EXPECT_TRUE(has(names, "stribeck_gaussian"));
  EXPECT_TRUE(has(names, "torque_ripple:1"));
  EXPECT_TRUE(has(names, "torque_bias"));
  EXPECT_TRUE(has(names, "dahl_friction")) << "replaces Coulomb friction, which is there";
  EXPECT_FALSE(has(names, "inertia")) << "there already";
  EXPECT_FALSE(has(names, "torque_ripple:3")) << "there already";
  EXPECT_FALSE(has(names, "current_offset")) << "effort is a torque";
  EXPECT_FALSE(has(names, "load_dependent_friction")) << "no torque sensor";
  EXPECT_FALSE(has(names, "temperature_viscous")) << "no temperature";
  e[Column::temperature].assign(e.size(), 25.0);
  EXPECT_FALSE(has(names_for(terms), "temperature_viscous")) << "one temperature only";
  for (std::size_t k = 0; k < e.size(); ++k) e[Column::temperature][k] = 25.0 + 10.0 * e.time_s[k] / 5.0;
  EXPECT_TRUE(has(names_for(terms), "temperature_viscous"));
  EXPECT_FALSE(has(names_for(estimation::terms_of(model_of({"inertia"}))), "temperature_viscous"));
  EXPECT_FALSE(has(names_for(extend(terms, catalogue::get("dahl_friction"), {})), "coulomb_friction")) << "replaced";
}

TEST(CandidateModels, CountTheParametersThatTheyAdd) {
  const data::Experiment e = experiment(
      "a", 0.0, [](double, double) { return 0.0; }, 1);
  const estimation::PreparedData prepared = estimation::prepare({&e}, {}, kOptions);
  const estimation::RegressionProblem data(prepared, estimation::Balance::motor);
  std::map<std::string_view, double> added;
  for (const CandidateModel& p : candidate_models(data, estimation::terms_of(model_of(kPlain)), whole(data)))
    added[p.entry->name()] = p.added;
  EXPECT_EQ(added.at("viscous_asymmetry"), 1.0);
  EXPECT_EQ(added.at("stribeck_gaussian"), 3.0);
  EXPECT_EQ(added.at("torque_ripple"), 2.0) << "its order is given";
  EXPECT_EQ(added.at("dahl_friction"), 1.0) << "two, in place of one";
}

class Edit : public ::testing::Test {
 protected:
  static double asymmetry(double, double w) { return 1e-3 * std::abs(w); }
  Edit() {
    dataset_.experiments = {experiment("fit", 0.0, asymmetry, 1), experiment("never seen", 1.0, asymmetry, 2)};
    dataset_.experiments[1].role = data::Role::holdout;
  }
  data::Dataset dataset_;
};

// At one speed viscous and dry friction are one.
TEST(EditOfOneSpeed, WarnsOfAParameterThatTheDataHardlyDetermineWithTheEffect) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.002);
  data::Dataset dataset;
  dataset.experiments = {tests::written_experiment("triangle", 1e-3, 8000, [&](double t, data::Experiment& e) {
    const double phase = 2.0 * kPi * 0.5 * t;
    e[Column::motor_position].push_back(20.0 / kPi * std::asin(std::sin(phase)));
    e[Column::motor_torque].push_back(kViscous * std::copysign(20.0, std::cos(phase)) + noise(random));
  })};
  const auto warns = [&](const char* effect) {
    const Addition added = add(dataset, model_of({"viscous_friction"}), effect, kOptions);
    return std::ranges::any_of(added.warnings, [](const std::string& w) {
      return contains(w, "these data determine viscous_friction.coefficient without");
    });
  };
  EXPECT_TRUE(warns("coulomb_friction"));
  EXPECT_FALSE(warns("torque_bias"));
}

TEST_F(Edit, AddingTheMissingEffectBringsBothErrorsDownToTheNoise) {
  const model::Model model = model_of(kPlain);
  const Addition added = add(dataset_, model, "viscous_asymmetry", kOptions);
  EXPECT_EQ(added.effect, "viscous_asymmetry");
  EXPECT_EQ(added.signal, "motor_balance");
  EXPECT_EQ(added.unit, "N*m");
  // White noise through the filter twice: of a bandwidth near 2 fc / fs, of which the filter of order ten leaves most.
  const double noise = 0.002 * std::sqrt(2.0 * 40.0 * 1e-3);
  EXPECT_NEAR(added.after.rmse_fit / noise, 1.0, 0.15);
  ASSERT_TRUE(added.after.rmse_holdout && added.before.rmse_holdout);
  EXPECT_NEAR(*added.after.rmse_holdout / noise, 1.0, 0.15);
  EXPECT_GT(added.before.rmse_fit, 3.0 * noise);
  EXPECT_GT(*added.before.rmse_holdout, 3.0 * noise);
  ASSERT_NE(added.model.find("viscous_asymmetry"), nullptr);
  EXPECT_NEAR(*added.model.find("viscous_asymmetry")->find("coefficient")->value, 1e-3, 3e-5);
  EXPECT_NEAR(*added.model.find("viscous_friction")->find("coefficient")->value, kViscous, 5e-5);
}

TEST_F(Edit, TheStepStandsInTheHistoryWithTheHoldOutErrors) {
  model::Model model = model_of(kPlain);
  model.history.push_back({"add", "earlier", 2.0, 1.0});
  const Addition added = add(dataset_, model, "viscous_asymmetry", kOptions);
  ASSERT_EQ(added.model.history.size(), 2u);
  EXPECT_EQ(added.model.history[0].effect, "earlier");
  EXPECT_EQ(added.model.history[1].action, "add");
  EXPECT_EQ(added.model.history[1].effect, "viscous_asymmetry");
  EXPECT_EQ(added.model.history[1].rmse_before, added.before.rmse_holdout);
  EXPECT_EQ(added.model.history[1].rmse_after, added.after.rmse_holdout);
  dataset_.experiments.pop_back();
  const Addition alone = add(dataset_, model, "viscous_asymmetry", kOptions);
  EXPECT_FALSE(alone.after.rmse_holdout);
  EXPECT_EQ(alone.model.history[1].rmse_after, alone.after.rmse_fit) << "without hold-out records, those of the fit";
}

TEST_F(Edit, AddingWhatReplacesAnEffectTakesThatOut) {
  const Addition added = add(dataset_, model_of(kPlain), "dahl_friction", kOptions);
  EXPECT_EQ(added.model.find("coulomb_friction"), nullptr);
  EXPECT_NE(added.model.find("dahl_friction"), nullptr);
}

TEST_F(Edit, AddingKeepsTheOrderThatWasGiven) {
  const Addition added = add(dataset_, model_of(kPlain), "torque_ripple:3", kOptions);
  EXPECT_EQ(added.effect, "torque_ripple:3");
  EXPECT_EQ(added.model.effects.back().find("order")->value, 3.0);
  EXPECT_TRUE(added.model.effects.back().find("order")->fixed);
}

TEST_F(Edit, RemovingUndoesAddingAndShowsWhatItCosts) {
  const Addition added = add(dataset_, model_of(kPlain), "viscous_asymmetry", kOptions);
  const Addition removed = remove(dataset_, added.model, "viscous_asymmetry", kOptions);
  EXPECT_EQ(removed.model.find("viscous_asymmetry"), nullptr);
  EXPECT_NEAR(removed.before.rmse_fit, added.after.rmse_fit, 1e-9);
  EXPECT_NEAR(removed.after.rmse_fit, added.before.rmse_fit, 1e-9);
  EXPECT_NEAR(*removed.after.rmse_holdout, *added.before.rmse_holdout, 1e-9);
  EXPECT_EQ(removed.model.history.back().action, "remove");
  EXPECT_EQ(removed.model.history.size(), 2u);
}

TEST_F(Edit, RemovesByIdAndByNameWithOrder) {
  model::Model model = model_of(kPlain);
  for (const double order : {2.0, 4.0}) {
    model.effects.push_back(catalogue::blank_effect(catalogue::get("torque_ripple"), data::Axis::rotary));
    model.effects.back().find("order")->value = order;
  }
  model.effects[3].id = "lobes";
  model.effects[4].id = "slots";
  const auto ids = [](const Addition& a) {
    std::vector<std::string> list;
    for (const model::Effect& e : a.model.effects) list.push_back(e.id);
    return list;
  };
  const std::vector<std::string> base{"inertia", "viscous_friction", "coulomb_friction"};
  EXPECT_EQ(ids(remove(dataset_, model, "slots", kOptions)),
            (std::vector<std::string>{base[0], base[1], base[2], "lobes"}));
  EXPECT_EQ(ids(remove(dataset_, model, "torque_ripple:2", kOptions)),
            (std::vector<std::string>{base[0], base[1], base[2], "slots"}));
  EXPECT_TRUE(contains(error_of([&] { remove(dataset_, model, "torque_ripple:3", kOptions); }), "lobes, slots"));
  EXPECT_TRUE(contains(error_of([&] { remove(dataset_, model, "gravity", kOptions); }), "the model has no effect"));
}

TEST_F(Edit, RefusesToRemoveWhatAnotherEffectScales) {
  model::Model model = model_of({"inertia", "viscous_friction", "coulomb_friction", "temperature_viscous"});
  const std::string error = error_of([&] { remove(dataset_, model, "viscous_friction", kOptions); });
  EXPECT_TRUE(contains(error, "temperature_viscous scales viscous_friction; remove temperature_viscous first"))
      << error;
}

}  // namespace
}  // namespace flexspline::selection::selection_edits_test
