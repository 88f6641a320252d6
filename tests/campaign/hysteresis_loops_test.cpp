// Where the report gave up (4.2.2): its dynamic models of hysteresis came out as narrow loops. The reason, and the laws
// recovered from the same loops.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include "hil/plant/physics.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::hysteresis_loops_test {
namespace {

constexpr double kSample = 1e-3;  // s
constexpr double kGearRatio = 100.0;
constexpr double kTorqueConstant = 0.0543;
constexpr double kLargest = 1.5e-3;  // rad
constexpr double kNoise = 0.01;      // of each loop's RMS

struct Loop {
  std::vector<double> torsion;
  std::vector<double> torque;    // true
  std::vector<double> measured;  // with noise
};

// A sine, a sine with minor loops upon it, a rising and a smaller one; 8 s each.
std::vector<std::vector<double>> paths() {
  std::vector<std::vector<double>> list(4);
  for (int k = 0; k < 8000; ++k) {
    const double t = k * kSample;
    const auto wave = [&](double hz) { return kLargest * std::sin(2.0 * std::numbers::pi * hz * t); };
    list[0].push_back(wave(0.5));
    list[1].push_back(0.5 * wave(0.5) + 0.3 * wave(2.3));
    list[2].push_back((0.2 + 0.8 * t / 8.0) * wave(1.0));
    list[3].push_back(0.5 * wave(1.0));
  }
  return list;
}

double root_mean_square(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

// The law as the plant has it, with the plant's stiffness where it is not the law's own.
std::vector<Loop> loops_of(const std::string& law, std::uint64_t seed) {
  plant::PlantFile demo = plant::demo_plant();
  plant::hide(demo.drive, law);
  const plant::Transmission gear = plant::physics_of(demo.drive).transmission;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Loop> loops;
  for (auto& path : paths()) {
    Loop loop;
    loop.torque = plant::torque_along(gear.loops, gear.stiffness, gear.cubic_stiffness, path);
    const double noise = kNoise * root_mean_square(loop.torque);
    for (const double t : loop.torque) loop.measured.push_back(t + noise * normal(generator));
    loop.torsion = std::move(path);
    loops.push_back(std::move(loop));
  }
  return loops;
}

// Energy lost over the second half of a record, where the start is forgotten: the loop's area.
double area(const Loop& loop, const std::vector<double>& torque) {
  double sum = 0.0;
  for (std::size_t k = torque.size() / 2; k < torque.size(); ++k)
    sum += 0.5 * (torque[k] + torque[k - 1]) * (loop.torsion[k] - loop.torsion[k - 1]);
  return sum;
}

double rms_error(const Loop& loop, const std::vector<double>& torque) {
  double error = 0.0, size = 0.0;
  for (std::size_t k = torque.size() / 2; k < torque.size(); ++k) {
    error += (torque[k] - loop.torque[k]) * (torque[k] - loop.torque[k]);
    size += loop.torque[k] * loop.torque[k];
  }
  return std::sqrt(error / size);
}

// The report's equation 72 for the modified Dahl law with a cubic spring, K0 left out: the backward difference of the
// law, whose state is the measured torque less that of the spring.
struct Report72 {
  const std::vector<Loop>& loops;

  // Parameters: K1, K2, K3, beta, Tc.
  Eigen::VectorXd residual(const Eigen::VectorXd& p) const {
    std::vector<double> f;
    for (const Loop& loop : loops)
      for (std::size_t n = 1; n < loop.torsion.size(); ++n) {
        const auto state = [&](std::size_t k) {
          const double x = loop.torsion[k];
          return loop.measured[k] - x * (p[0] + x * (p[1] + x * p[2]));
        };
        const double travel = loop.torsion[n] - loop.torsion[n - 1];
        const double left = state(n) - p[4] * (travel > 0.0 ? 1.0 : -1.0);
        f.push_back(state(n) - state(n - 1) - p[3] * travel * left * left);
      }
    return Eigen::Map<Eigen::VectorXd>(f.data(), static_cast<Eigen::Index>(f.size()));
  }

  // Levenberg and Marquardt, parameters in units of `scale`.
  Eigen::VectorXd solve(const Eigen::VectorXd& start, const Eigen::VectorXd& scale) const {
    Eigen::VectorXd p = start;
    double damping = 1e-3;
    Eigen::VectorXd r = residual(p);
    for (int iteration = 0; iteration < 200; ++iteration) {
      Eigen::MatrixXd J(r.size(), p.size());
      for (Eigen::Index j = 0; j < p.size(); ++j) {
        Eigen::VectorXd moved = p;
        moved[j] += 1e-6 * scale[j];
        J.col(j) = (residual(moved) - r) / 1e-6;
      }
      Eigen::MatrixXd H = J.transpose() * J;
      H.diagonal() *= 1.0 + damping;
      const Eigen::VectorXd step = -H.ldlt().solve(J.transpose() * r);
      const Eigen::VectorXd next = p + scale.cwiseProduct(step);
      const Eigen::VectorXd left = residual(next);
      if (left.squaredNorm() < r.squaredNorm()) {
        const bool done = left.squaredNorm() > r.squaredNorm() * (1.0 - 1e-12);
        p = next;
        r = left;
        damping *= 0.3;
        if (done) break;
      } else {
        damping *= 5.0;
        if (damping > 1e12) break;
      }
    }
    return p;
  }
};

data::Dataset dataset_of(const std::vector<Loop>& loops) {
  data::Dataset dataset;
  dataset.drive.axis = data::Axis::rotary;
  dataset.drive.gear_ratio = kGearRatio;
  dataset.drive.torque_constant_nm_a = kTorqueConstant;
  constexpr double kCount = 2.0 * std::numbers::pi / 16384.0;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    data::Experiment e;
    e.name = fmt::format("loop-{}", i + 1);
    e.load = data::Load::locked;
    e.current_hold = data::CurrentHold::none;
    e.sample_s = kSample;
    for (std::size_t k = 0; k < loops[i].torsion.size(); ++k) {
      e.time_s.push_back(static_cast<double>(k) * kSample);
      e[data::Column::motor_position].push_back(std::round(loops[i].torsion[k] * kGearRatio / kCount) * kCount);
      e[data::Column::torque].push_back(loops[i].measured[k]);
      e[data::Column::current].push_back(loops[i].torque[k] / (kGearRatio * kTorqueConstant));
    }
    e.segments = {{0, loops[i].torsion.size()}};
    e.masked.assign(loops[i].torsion.size(), 0);
    e.encoder_counts = 16384;
    e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
    dataset.experiments.push_back(std::move(e));
  }
  return dataset;
}

model::Model model_with(const std::vector<std::string>& effects) {
  model::Model model;
  model.drive.gear_ratio.value = kGearRatio;
  model.drive.torque_constant_nm_a.value = kTorqueConstant;
  for (const std::string& name : effects)
    model.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return model;
}

// Torque of an identified model along the true path.
std::vector<double> torque_of(const estimation::Terms& terms, const Loop& loop) {
  std::vector<effects::Inputs<numbers::Real>> inputs(loop.torsion.size());
  for (std::size_t k = 0; k < inputs.size(); ++k) inputs[k].torsion = loop.torsion[k];
  std::vector<double> torque(inputs.size(), 0.0);
  for (const estimation::Term& t : terms)
    t.entry->real.torque(catalogue::natural(*t.entry, t.values).data(), {}, catalogue::Balance::transmission, inputs,
                         torque.data());
  return torque;
}

// What the report's regression makes of one loop, from a default start, as a share of the true area of the first loop.
struct Narrow {
  double area_share = 0.0;
  double bound = 0.0;       // Tc
  double cost_share = 0.0;  // of the cost at the true values
};
Narrow by_report(const std::vector<Loop>& loops, std::size_t which, double noise) {
  std::vector<Loop> seen{loops[which]};
  for (std::size_t k = 0; k < seen[0].measured.size(); ++k)
    seen[0].measured[k] = seen[0].torque[k] + noise * (seen[0].measured[k] - seen[0].torque[k]);
  const Report72 regression{seen};
  const auto vector = [](std::initializer_list<double> x) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x.begin(), static_cast<Eigen::Index>(x.size())));
  };
  // beta (T - Tc s)^2 is sigma (1 - T/Tc s)^2 with sigma = beta Tc^2.
  const Eigen::VectorXd truth = vector({6300.0, 0.0, 0.0, 5000.0 / 4.0, 2.0});
  const Eigen::VectorXd p =
      regression.solve(vector({5000.0, 0.0, 0.0, 10.0, 1.0}), vector({6300.0, 1e6, 1e9, 1250.0, 2.0}));
  plant::Loops law;
  law.dahl.push_back({std::abs(p[4]), std::abs(p[3]) * p[4] * p[4], 2.0, 0.0});
  const std::vector<double> torque = plant::torque_along(law, p[0], p[2], loops[0].torsion);
  return {area(loops[0], torque) / area(loops[0], loops[0].torque), std::abs(p[4]),
          regression.residual(p).squaredNorm() / regression.residual(truth).squaredNorm()};
}

TEST(NarrowLoops, ComeOutOfTheReportsRegressionBecauseTheNoisyTorqueIsItsState) {
  const std::vector<Loop> loops = loops_of("modified_dahl_hysteresis", 7001);
  for (const auto& [which, noise] : {std::pair<std::size_t, double>{0, 0.0}, {0, 1.0}, {2, 3.0}}) {
    const Narrow found = by_report(loops, which, noise);
    fmt::print("eq. 72 on loop {} with {:g} % noise: Tc {:.3f} for 2, area {:.0f} %, cost {:.4f} of the true values'\n",
               which + 1, 100.0 * kNoise * noise, found.bound, 100.0 * found.area_share, found.cost_share);
    if (noise == 0.0) {
      EXPECT_NEAR(found.area_share, 1.0, 0.01) << "without noise the regression works";
      continue;
    }
    EXPECT_LT(found.area_share, noise > 1.0 ? 0.5 : 0.75);
    EXPECT_LT(found.bound, 1.1);
    // No local optimum is to blame, as the report supposed: the narrow loop fits equation 72 better than the truth.
    EXPECT_LT(found.cost_share, 1.0);
  }
}

class Law : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Hysteresis, Law,
                         ::testing::Values("dahl_hysteresis", "modified_dahl_hysteresis", "duhem_hysteresis",
                                           "bouc_wen_hysteresis", "prandtl_ishlinskii_hysteresis",
                                           "preisach_hysteresis"),
                         [](const auto& law) { return law.param; });

TEST_P(Law, IsRecoveredFromNoisyLoopsToFivePercentOfAreaAndThreeOfTheirSize) {
  const std::vector<Loop> loops = loops_of(GetParam(), 7001);
  const bool whole = GetParam() == "duhem_hysteresis";
  const auto found = estimation::identify(
      dataset_of(loops), whole ? model_with({GetParam()}) : model_with({"linear_stiffness", GetParam()}), {});
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const std::vector<double> torque = torque_of(found->terms, loops[i]);
    const double share = area(loops[i], torque) / area(loops[i], loops[i].torque);
    const double error = rms_error(loops[i], torque);
    fmt::print("{} loop {}: area {:+.2f} %, RMS {:.2f} %\n", GetParam(), i + 1, 100.0 * (share - 1.0), 100.0 * error);
    EXPECT_NEAR(share, 1.0, 0.05);
    EXPECT_LE(error, 0.03);
  }
}

TEST_P(Law, IsToldFromTheOthersUpToThoseThatContainIt) {
  const std::map<std::string, std::string> alike = {
      // The same law where i = 1, n = 1 and gamma = 0, and where the bound does not grow with the torque.
      {"dahl_hysteresis", "dahl_hysteresis,bouc_wen_hysteresis,torque_proportional_hysteresis"},
      {"modified_dahl_hysteresis", "modified_dahl_hysteresis,dahl_hysteresis"},
      {"duhem_hysteresis", "duhem_hysteresis"},
      {"bouc_wen_hysteresis", "bouc_wen_hysteresis"},
      {"prandtl_ishlinskii_hysteresis", "prandtl_ishlinskii_hysteresis,preisach_hysteresis"},
      {"preisach_hysteresis", "preisach_hysteresis,prandtl_ishlinskii_hysteresis"},
  };
  const auto found = selection::diagnose(dataset_of(loops_of(GetParam(), 7001)), model_with({"linear_stiffness"}), {});
  std::string named;
  for (const auto& n : found.named) named += n.effect + " ";
  fmt::print("{}: named {}|", GetParam(), named);
  for (std::size_t i = 0; i < std::min<std::size_t>(5, found.candidates.size()); ++i)
    fmt::print(" {}({:.0f}, {:.5f}{})", found.candidates[i].effect, found.candidates[i].score,
               found.candidates[i].rmse_cv_after, found.candidates[i].admissible ? "" : ", x");
  fmt::print("\n");
  ASSERT_FALSE(found.named.empty());
  for (const auto& n : found.named) EXPECT_TRUE(catalogue::names_contain(alike.at(GetParam()), n.effect)) << n.effect;
}

}  // namespace
}  // namespace flexspline::hysteresis_loops_test
