// The EMPS, a real linear axis (Janot, Gautier, Brunot 2019): published parameters, and what its friction lacks.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "host/engine/selection/add.hpp"
#include "host/engine/selection/diagnosis.hpp"

namespace flexspline::emps_axis_test {
namespace {

std::filesystem::path emps_folder() {
  const char* set = std::getenv("FLEXSPLINE_DATA");
  return std::filesystem::path(set ? set : FLEXSPLINE_SOURCE_DIR "/../shared/data") / "emps";
}

class EmpsAxis : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(emps_folder() / "emps_train.csv"))
      GTEST_SKIP() << "no measurements of the EMPS axis in " << emps_folder()
                   << "; set FLEXSPLINE_DATA to their parent folder";
    model_.drive.axis = data::Axis::linear;
    model_.drive.gear_ratio.value = 1.0;
    for (const char* effect : {"inertia", "viscous_friction", "coulomb_friction", "torque_bias"})
      model_.effects.push_back(catalogue::blank_effect(catalogue::get(effect), data::Axis::linear));
  }

  // A data set as a user writes it: the columns are theirs, the experiments are parts of a file.
  data::Dataset dataset(const std::string& file, const std::string& experiments) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() /
        fmt::format("flexspline-emps-{}", ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder);
    std::filesystem::copy_file(emps_folder() / file, folder / file, std::filesystem::copy_options::overwrite_existing);
    std::ofstream(folder / "dataset.toml") << R"(format = "flexspline-dataset/1"
[drive]
axis = "linear"
[columns.motor_torque_nm]
source = "motor_force_n"
unit = "N"
[columns.motor_position_rad]
source = "position_m"
unit = "m"
)" << experiments;
    const data::Dataset loaded = data::load({folder / "dataset.toml"});
    std::filesystem::remove_all(folder);
    return loaded;
  }
  data::Dataset halves() {
    return dataset("emps_train.csv", R"([[experiment]]
file = "emps_train.csv"
name = "first-half"
to_s = 12.48
[[experiment]]
file = "emps_train.csv"
name = "second-half"
from_s = 12.48
role = "holdout"
)");
  }

  model::Model model_;
};

const estimation::Estimate& estimate(const estimation::Identification& found, std::string_view effect) {
  return *std::find_if(found.estimates.begin(), found.estimates.end(),
                       [&](const auto& e) { return e.effect == effect; });
}

double value(const model::Model& model, std::string_view effect, std::string_view parameter) {
  return *model.find(effect)->find(parameter)->value;
}

TEST_F(EmpsAxis, PublishedParametersComeOutWithThePublishedPipeline) {
  const data::Dataset data = dataset(
      "emps_train.csv", "[[experiment]]\nfile = \"emps_train.csv\"\nname = \"train\"\ncurrent_hold = \"none\"\n");
  const auto found = estimation::identify(data, model_, {.cutoff_hz = 100.0, .mask = false});
  EXPECT_NEAR(estimate(*found, "inertia").value, 95.1089, 0.006 * 95.1089);
  EXPECT_NEAR(estimate(*found, "viscous_friction").value, 203.5034, 0.006 * 203.5034);
  EXPECT_NEAR(estimate(*found, "coulomb_friction").value, 20.3935, 0.006 * 20.3935);
  EXPECT_NEAR(estimate(*found, "torque_bias").value, -3.1648, 0.01 * 3.1648);
  EXPECT_EQ(estimate(*found, "inertia").unit, "kg");
  EXPECT_EQ(estimate(*found, "viscous_friction").unit, "N*s/m");
  EXPECT_EQ(estimate(*found, "coulomb_friction").unit, "N");
  for (const char* effect : {"inertia", "viscous_friction", "coulomb_friction", "torque_bias"})
    fmt::print("{:18} {:10.4f} {}\n", effect, estimate(*found, effect).value, estimate(*found, effect).unit);
}

TEST_F(EmpsAxis, DirectionDependenceIsNamedFirstAndStribeckIsNot) {
  const selection::Diagnosis d = selection::diagnose(halves(), model_, {});
  ASSERT_EQ(d.named.size(), 1u);
  EXPECT_EQ(d.named.front().effect, "viscous_asymmetry");
  EXPECT_EQ(d.noise_floor_from, "periods");
  EXPECT_EQ(d.unit, "N");
  // No record shows the axis at rest: what is constant, the bias and the asymmetry share.
  const auto shared = std::find_if(d.candidates.begin(), d.candidates.end(),
                                   [](const auto& c) { return c.effect == "coulomb_asymmetry"; });
  ASSERT_NE(shared, d.candidates.end());
  EXPECT_FALSE(shared->admissible);
  ASSERT_EQ(shared->cannot_distinguish.size(), 1u);
  EXPECT_EQ(shared->cannot_distinguish.front(), "torque_bias");
}

TEST_F(EmpsAxis, AddingItTakesTheHeldOutErrorDownByAFifthAndKeepsTheModelSensible) {
  const data::Dataset data = halves();
  const selection::Addition added = selection::add(data, model_, "viscous_asymmetry", {});
  fmt::print("held-out error {:.3f} N to {:.3f} N, noise {:.3f} N ({})\n", *added.before.rmse_holdout,
             *added.after.rmse_holdout, added.noise_floor.value_or(0.0), added.noise_floor_from);
  EXPECT_LT(*added.after.rmse_holdout, 0.8 * *added.before.rmse_holdout);
  EXPECT_GT(*added.after.rmse_holdout, 0.3 * *added.before.rmse_holdout);
  EXPECT_NEAR(value(added.model, "inertia", "inertia"), 95.1, 2.0);
  EXPECT_NEAR(value(added.model, "viscous_friction", "coefficient"), 203.5, 12.0);
  EXPECT_NEAR(value(added.model, "coulomb_friction", "torque"), 20.4, 1.5);
  EXPECT_LT(std::abs(value(added.model, "torque_bias", "torque")), 5.0);

  const selection::Diagnosis second = selection::diagnose(data, added.model, {});
  const bool sublinear = std::any_of(second.named.begin(), second.named.end(),
                                     [](const auto& n) { return n.effect == "power_law_friction"; });
  EXPECT_TRUE(sublinear || !second.remaining_structure.empty()) << selection::verdict_name(second.verdict);
}

TEST_F(EmpsAxis, ForcePulsesAreDisturbancesAndNoFriction) {
  const data::Dataset data =
      dataset("emps_test_pulses.csv", "[[experiment]]\nfile = \"emps_test_pulses.csv\"\nname = \"pulses\"\n");
  const selection::Diagnosis d = selection::diagnose(data, model_, {});
  // Sublinear friction is the other structure of this axis (tests/real_joints/expected.json).
  ASSERT_FALSE(d.named.empty());
  EXPECT_EQ(d.named.front().effect, "viscous_asymmetry");
  for (const auto& n : d.named)
    EXPECT_TRUE(n.effect == "viscous_asymmetry" || n.effect == "power_law_friction") << n.effect;
  ASSERT_GE(d.disturbances.size(), 5u);
  // The force steps every half second, first at 0.344 s; the tool does not know that.
  for (const selection::Disturbance& x : d.disturbances) {
    const double middle = 0.5 * (x.from_s + x.to_s);
    const double from_edge = std::abs(std::remainder(middle - 0.344, 0.5));
    EXPECT_LT(from_edge, 0.04) << "at " << middle << " s";
  }
  fmt::print("{} disturbances of 49 force steps\n", d.disturbances.size());
}

}  // namespace
}  // namespace flexspline::emps_axis_test
