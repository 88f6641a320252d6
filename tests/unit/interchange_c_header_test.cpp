// The C header of a model, compiled by a C compiler and compared with the simulation's balances.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "host/output/interchange/export.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "host/physics/simulation/balances.hpp"

namespace flexspline::interchange::interchange_c_header_test {
namespace {

using simulation::Balances;
using simulation::Inputs;
using simulation::Torques;

constexpr double kRatio = 100.0;
constexpr int kSamples = 300;

model::Effect usual(std::string_view type) {
  model::Effect effect = catalogue::blank_effect(catalogue::get(type), data::Axis::rotary);
  const auto& infos = catalogue::get(type).parameters;
  for (std::size_t p = 0; p < effect.parameters.size(); ++p) effect.parameters[p].value = infos[p].usual;
  return effect;
}

model::Model model_with(std::string_view type) {
  model::Model m;
  m.name = fmt::format("with {}", type);
  m.drive.gear_ratio.value = kRatio;
  m.drive.torque_constant_nm_a.value = 0.05;
  m.drive.rated_velocity_rad_s.value = 200.0;
  m.drive.rated_torque_nm.value = 40.0;
  m.drive.temperature_reference_c.value = 30.0;
  const auto& info = *catalogue::get(type).info;
  for (const char* base : {"inertia", "viscous_friction", "coulomb_friction", "linear_stiffness"})
    if (type != base && !catalogue::names_contain(info.replaces, base)) m.effects.push_back(usual(base));
  m.effects.push_back(usual(type));
  return m;
}

std::vector<Inputs> motion() {
  std::vector<Inputs> all(kSamples);
  const double dt = 2e-3;
  for (int k = 0; k < kSamples; ++k) {
    Inputs& in = all[static_cast<std::size_t>(k)];
    const double t = k * dt;
    in.angle = 5.0 * std::sin(9.0 * t) + 0.3 * std::sin(70.0 * t);
    in.velocity = 45.0 * std::cos(9.0 * t) + 21.0 * std::cos(70.0 * t);
    in.acceleration = -405.0 * std::sin(9.0 * t) - 1470.0 * std::sin(70.0 * t);
    in.output_angle = in.angle / kRatio - 2e-3 * std::sin(31.0 * t) - 1e-4;
    in.output_velocity = in.velocity / kRatio - 0.062 * std::cos(31.0 * t);
    in.output_acceleration = in.acceleration / kRatio + 1.922 * std::sin(31.0 * t);
    in.direction = in.velocity > 0 ? 1.0 : -1.0;
    in.output_direction = in.output_velocity > 0 ? 1.0 : -1.0;
    in.torque = 25.0 * std::sin(31.0 * t);
    in.current = 3.0 * std::sin(11.0 * t);
    in.temperature = 30.0 + 20.0 * std::sin(3.0 * t);
    in.elapsed = k == 0 ? 0.0 : dt;
    in.speed = std::abs(in.velocity);
    in.torque_magnitude = std::abs(in.torque);
    in.torsion = in.angle / kRatio - in.output_angle;
    in.torsion_rate = in.velocity / kRatio - in.output_velocity;
    in.torsion_direction = in.torsion_rate > 0 ? 1.0 : in.torsion_rate < 0 ? -1.0 : 0.0;
    in.viscous_scale = in.coulomb_scale = 1.0;
  }
  return all;
}

std::vector<Torques> simulated(const model::Model& model) {
  Balances balances(model, catalogue::constants_of(model.drive));
  std::vector<Torques> all;
  Inputs before;
  for (Inputs in : motion()) {
    const double rate = in.torsion_rate;
    balances.change(in);
    if (in.torsion_rate != rate) in.torsion_direction = in.torsion_rate > 0 ? 1.0 : in.torsion_rate < 0 ? -1.0 : 0.0;
    // The first sample only says where the drive stands.
    Torques sums;
    if (!all.empty()) {
      balances.add_motor(in, before, sums);
      balances.add_transmission(in, before, sums);
      balances.add_load(in, before, sums);
      balances.advance(in, before);
    }
    before = in;
    all.push_back(sums);
  }
  return all;
}

struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / fmt::format("flexspline-header-{}", ::getpid());
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

// Runs the headers of all models along the motion, in one C program: three torques a sample and model.
std::vector<std::vector<Torques>> compiled(const std::vector<model::Model>& models) {
  const Folder folder;
  std::ofstream program(folder.path / "run.c");
  for (const model::Model& m : models) {
    const std::string name = c_name(m.name) + ".h";
    std::ofstream(folder.path / name) << c_header(m, "test.toml");
    program << fmt::format("#include \"{}\"\n", name);
  }
  program << "#include <stdio.h>\nstatic const double motion[][12] = {\n";
  for (const Inputs& in : motion())
    program << fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}}},\n", in.angle, in.velocity,
                           in.acceleration, in.direction, in.output_angle, in.output_velocity, in.output_acceleration,
                           in.output_direction, in.torque, in.current, in.temperature, in.elapsed);
  program << "};\nint main(void) {\n  int k;\n";
  for (const model::Model& m : models)
    program << fmt::format(
        "  {{\n    {0}_state state = {{0}};\n    {0}_torques out;\n    for (k = 0; k < {1}; ++k) {{\n"
        "      {0}_step(&state, (const {0}_inputs*)motion[k], &out);\n"
        "      printf(\"%.17g %.17g %.17g\\n\", out.motor, out.transmission, out.load);\n    }}\n  }}\n",
        c_name(m.name), kSamples);
  program << "  return 0;\n}\n";
  program.close();
  const std::string where = folder.path.string();
  const std::string build = fmt::format(
      "cd '{}' && cc -std=c99 -O1 -Wall -Wextra -Wno-unused-parameter -pedantic -Werror run.c -o run -lm && ./run > "
      "out.txt",
      where);
  EXPECT_EQ(std::system(build.c_str()), 0) << build;
  std::ifstream out(folder.path / "out.txt");
  std::vector<std::vector<Torques>> all(models.size(), std::vector<Torques>(kSamples));
  for (auto& one : all)
    for (Torques& t : one) out >> t.motor >> t.transmission >> t.load;
  EXPECT_TRUE(static_cast<bool>(out)) << "fewer numbers than samples";
  return all;
}

void expect_same(const std::vector<Torques>& found, const std::vector<Torques>& truth, const std::string& name) {
  double size = 0.0, worst = 0.0;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    for (const auto at : {&Torques::motor, &Torques::transmission, &Torques::load}) {
      size = std::max(size, std::abs(truth[k].*at));
      worst = std::max(worst, std::abs(truth[k].*at - found[k].*at));
    }
  }
  EXPECT_GT(size, 0.0) << name;
  EXPECT_LT(worst, 1e-11 * size) << name;
}

TEST(CHeader, OfEveryEffectComputesWhatTheSimulationDoes) {
  std::vector<model::Model> models;
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (entry.info->user_defined) continue;
    models.push_back(model_with(entry.name()));
  }
  ASSERT_GT(models.size(), 40u);
  const auto found = compiled(models);
  for (std::size_t m = 0; m < models.size(); ++m) expect_same(found[m], simulated(models[m]), models[m].name);
}

model::Effect table(const char* variable, std::vector<double> at, bool times_direction) {
  model::Effect effect;
  effect.type = "table_effect";
  effect.id = fmt::format("table_{}", variable);
  effect.definition = model::Definition{};
  effect.definition->variable = variable;
  effect.definition->times_direction = times_direction;
  effect.definition->table.at = std::move(at);
  for (std::size_t k = 0; k < effect.definition->table.at.size(); ++k)
    effect.definition->table.value.push_back(0.01 * std::sin(2.0 * static_cast<double>(k)));
  return effect;
}

TEST(CHeader, HoldsTablesOverASignalAndOverATurn) {
  model::Model m = model_with("gravity");
  m.effects.push_back(table("velocity", catalogue::even_points(-60.0, 60.0, 9), true));
  m.effects.push_back(table("motor_angle", catalogue::points_of_turn(16), false));
  expect_same(compiled({m}).front(), simulated(m), m.name);
}

TEST(CHeader, RefusesAFormulaByItsName) {
  model::Model m = model_with("gravity");
  model::Effect formula;
  formula.type = "expression_effect";
  formula.id = "mine";
  formula.definition = model::Definition{};
  formula.definition->formula = "k * velocity";
  formula.parameters = {{.name = "k", .value = 1e-4, .unit = "N*m*s/rad", .std = {}, .spread_percent = {}}};
  m.effects.push_back(formula);
  try {
    c_header(m, "test.toml");
    FAIL();
  } catch (const ExportError& error) {
    EXPECT_NE(std::string(error.what()).find("\"mine\""), std::string::npos);
  }
}

TEST(CHeader, NamesAreThoseOfCWhateverTheModelIsCalled) {
  EXPECT_EQ(c_name("rhs-100"), "rhs_100");
  EXPECT_EQ(c_name("3rd axis"), "model_3rd_axis");
  EXPECT_EQ(c_name(""), "model_");
}

}  // namespace
}  // namespace flexspline::interchange::interchange_c_header_test
