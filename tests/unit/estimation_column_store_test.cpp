#include "host/engine/estimation/column_store.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "host/engine/estimation/identify.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation::estimation_column_store_test {
namespace {

using What = ColumnKey::What;

ColumnKey key_with(double value) {
  return {What::unit, 0, 0, {{1, {value}}}};
}

Eigen::VectorXd ten(double value) {
  return Eigen::VectorXd::Constant(10, value);
}

TEST(ColumnStore, KeepsTheFirstColumnOfAKey) {
  ColumnStore store(1000);
  EXPECT_EQ(store.find(key_with(1.0)), nullptr);
  const ColumnStore::Column first = store.insert(key_with(1.0), ten(7.0));
  EXPECT_EQ(store.insert(key_with(1.0), ten(8.0)), first);
  EXPECT_EQ((*store.find(key_with(1.0)))[3], 7.0);
  EXPECT_EQ(store.find(key_with(1.0 + 1e-15)), nullptr) << "values are compared exactly";
}

TEST(ColumnStore, DropsWhatWasNotUsedForTheLongestTime) {
  ColumnStore store(30);
  const ColumnStore::Column held = store.insert(key_with(2.0), ten(2.0));
  store.insert(key_with(1.0), ten(1.0));
  store.insert(key_with(3.0), ten(3.0));
  EXPECT_NE(store.find(key_with(1.0)), nullptr);
  store.insert(key_with(4.0), ten(4.0));
  EXPECT_EQ(store.find(key_with(2.0)), nullptr);
  EXPECT_EQ((*held)[9], 2.0) << "who holds a column keeps it";
  for (const double kept : {1.0, 3.0, 4.0}) EXPECT_NE(store.find(key_with(kept)), nullptr) << kept;
}

TEST(ColumnStore, AColumnThatIsLargerThanAllThatMayBeKeptIsStillGivenBack) {
  ColumnStore store(5);
  EXPECT_EQ(store.insert(key_with(1.0), ten(1.0))->size(), 10);
}

TEST(ColumnStore, GivesAllThreadsTheSameColumn) {
  ColumnStore store(1000);
  std::vector<ColumnStore::Column> got(4);
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < got.size(); ++i)
    threads.emplace_back([&, i] {
      for (int k = 0; k < 200; ++k) {
        const auto value = static_cast<double>(k % 20);
        const ColumnStore::Column found = store.find(key_with(value));
        got[i] = found ? found : store.insert(key_with(value), ten(value));
        ASSERT_EQ((*got[i])[0], value);
      }
    });
  for (std::thread& t : threads) t.join();
  for (const ColumnStore::Column& column : got) EXPECT_EQ(column, got[0]);
}

Terms terms_with(std::initializer_list<const char*> names) {
  Terms terms;
  for (const char* name : names) terms.push_back(candidate_term(catalogue::get(name)));
  return terms;
}

TEST(ColumnKey, DistinguishesNonlinearValuesAndNotLinearOnes) {
  Terms terms = terms_with({"stribeck_gaussian"});
  const std::size_t velocity = terms[0].entry->index_of("velocity");
  terms[0].values[velocity] = 1.0;
  const ColumnKey before = key_of(terms, 0, What::unit);
  terms[0].values[terms[0].entry->index_of("amplitude_positive")] = 3.0;
  EXPECT_EQ(key_of(terms, 0, What::unit), before);
  terms[0].values[velocity] = 2.0;
  EXPECT_NE(key_of(terms, 0, What::unit), before);
  EXPECT_NE(key_of(terms, 0, What::slope), key_of(terms, 0, What::unit));
}

TEST(ColumnKey, HoldsTheEffectsThatChangeTheInputsOfATermAndNoOthers) {
  const Terms alone = terms_with({"linear_stiffness"});
  EXPECT_EQ(key_of(terms_with({"linear_stiffness", "coulomb_friction"}), 0, What::unit), key_of(alone, 0, What::unit));
  EXPECT_NE(key_of(terms_with({"linear_stiffness", "kinematic_error"}), 0, What::unit), key_of(alone, 0, What::unit));
}

// An axis that moves as a sum of two sines, with friction.
data::Experiment moving_axis() {
  return tests::written_experiment("sines", 1e-3, 5000, [](double t, data::Experiment& e) {
    const double w = 6.0 * std::cos(4.0 * t) + 3.0 * std::cos(13.0 * t);
    e[data::Column::motor_position].push_back(1.5 * std::sin(4.0 * t) + 3.0 / 13.0 * std::sin(13.0 * t));
    e[data::Column::motor_torque].push_back(4e-3 * w + std::copysign(0.05, w));
  });
}

class RegressorEvaluatorOfSines : public ::testing::Test {
 protected:
  void SetUp() override {
    dataset_.experiments.push_back(moving_axis());
    found_ = identify(dataset_, tests::plain_model(), {40.0, true});
    evaluator_.emplace(found_->prepared, Balance::motor);
    for (const catalogue::Entry& entry : catalogue::all()) {
      Term term = candidate_term(entry);
      if (!term.adds_torque() || entry.info->phase != effects::Phase::source) continue;
      std::vector<double> usual;
      for (const effects::ParameterInfo& p : entry.parameters) usual.push_back(p.usual);
      usual = catalogue::reduced(entry, usual);
      for (std::size_t p = 0; p < entry.parameters.size(); ++p) {
        if (entry.parameters[p].kind == effects::Kind::linear) refs_.push_back({terms_.size(), p});
        if (entry.parameters[p].kind == effects::Kind::nonlinear) term.values[p] = usual[p];
      }
      terms_.push_back(term);
    }
  }

  data::Dataset dataset_;
  std::unique_ptr<Identification> found_;
  std::optional<RegressorEvaluator> evaluator_;
  Terms terms_;
  std::vector<ParameterRef> refs_;
};

TEST_F(RegressorEvaluatorOfSines, AColumnDoesNotDependOnWhatIsAskedForWithItInAnyBit) {
  const Eigen::MatrixXd all = evaluator_->unit_columns(terms_, refs_);
  for (std::size_t j = 0; j < refs_.size(); ++j) {
    const Eigen::VectorXd alone = evaluator_->unit_columns(terms_, {refs_[j]});
    EXPECT_TRUE((all.col(static_cast<Eigen::Index>(j)).array() == alone.array()).all())
        << terms_[refs_[j].term].entry->name() << refs_[j].parameter;
  }
}

TEST_F(RegressorEvaluatorOfSines, AColumnIsTheTorqueOfOneUnit) {
  int compared = 0;
  for (const ParameterRef& ref : refs_) {
    Terms one{terms_[ref.term]};
    for (std::size_t p = 0; p < one[0].values.size(); ++p)
      if (one[0].entry->parameters[p].kind == effects::Kind::linear) one[0].values[p] = p == ref.parameter ? 1.0 : 0.0;
    const Eigen::VectorXd torque = evaluator_->torque(one, 0);
    const Eigen::VectorXd column = evaluator_->unit_columns(terms_, {ref});
    EXPECT_LE((column - torque).norm(), 1e-13 * torque.norm()) << one[0].entry->name() << ref.parameter;
    compared += torque.norm() > 0.0 ? 1 : 0;
  }
  EXPECT_GE(compared, 12);
}

TEST_F(RegressorEvaluatorOfSines, AnUnfilteredColumnIsTheLawOfTheSignalsAtTheSamples) {
  const Terms terms = terms_with({"viscous_friction", "quadratic_drag"});
  const Eigen::MatrixXd columns = evaluator_->unfiltered_columns(terms, {{0, 0}, {1, 0}});
  const Eigen::ArrayXd velocity = evaluator_->signal_at_rows(terms, effects::Variable::velocity).array();
  EXPECT_LT((columns.col(0).array() - velocity).abs().maxCoeff(), 1e-12);
  EXPECT_LT((columns.col(1).array() - velocity * velocity.abs()).abs().maxCoeff(), 1e-9);
}

TEST_F(RegressorEvaluatorOfSines, ProblemsGiveTheColumnsOfTheEvaluator) {
  const RegressionProblem problem(found_->prepared, Balance::motor);
  const RegressionProblem copy = problem;
  const Eigen::MatrixXd direct = evaluator_->unit_columns(terms_, refs_);
  EXPECT_EQ((problem.columns(terms_, refs_) - direct).norm(), 0.0);
  EXPECT_EQ((copy.columns(terms_, refs_) - direct).norm(), 0.0);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_column_store_test
