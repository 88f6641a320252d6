// Real data as they come: what must be said of them, on the EMPS axis (Janot, Gautier, Brunot 2019) and on changes of
// it that logs of other drives have.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>

#include "host/engine/selection/diagnosis.hpp"
#include "host/input/data/findings.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::honest_data_test {
namespace {

namespace fs = std::filesystem;

fs::path emps_file() {
  const char* set = std::getenv("FLEXSPLINE_DATA");
  return fs::path(set ? set : FLEXSPLINE_SOURCE_DIR "/../shared/data") / "emps" / "emps_train.csv";
}

// time_s, motor_voltage_v, motor_force_n, position_m, ...
struct Row {
  double time = 0.0, force = 0.0, position = 0.0;
};

class HonestData : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(emps_file()))
      GTEST_SKIP() << "no measurements of the EMPS axis at " << emps_file()
                   << "; set FLEXSPLINE_DATA to the folder that holds emps";
    std::ifstream in(emps_file());
    std::string line;
    std::vector<std::string> names;
    while (std::getline(in, line)) {
      if (line.empty() || line[0] == '#') continue;
      std::vector<std::string> cells;
      std::istringstream text(line);
      for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
      if (names.empty()) {
        names = cells;
        continue;
      }
      const auto value = [&](const char* name) {
        const auto at = std::find(names.begin(), names.end(), name) - names.begin();
        return std::stod(cells[static_cast<std::size_t>(at)]);
      };
      rows_.push_back({value("time_s"), value("motor_force_n"), value("position_m")});
    }
    ASSERT_GT(rows_.size(), 20000u);
  }

  // A log with these rows; `velocity` adds a column, where it is given.
  data::Dataset load(const std::vector<Row>& rows, const std::vector<double>& velocity = {},
                     const std::vector<std::string>& tolerate = {}) {
    const fs::path folder =
        fs::temp_directory_path() /
        fmt::format("flexspline-honest-{}", ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder);
    {
      std::ofstream csv(folder / "log.csv");
      csv << "time_s,motor_torque_nm,motor_position_rad" << (velocity.empty() ? "" : ",motor_velocity_rad_s") << "\n";
      for (std::size_t k = 0; k < rows.size(); ++k) {
        csv << fmt::format("{:.7f},{:.9g},{:.9g}", rows[k].time, rows[k].force, rows[k].position);
        if (!velocity.empty()) csv << fmt::format(",{:.9g}", velocity[k]);
        csv << "\n";
      }
      std::ofstream(folder / "dataset.toml") << "format = \"flexspline-dataset/1\"\n[drive]\naxis = \"linear\"\n"
                                                "[[experiment]]\nfile = \"log.csv\"\nname = \"log\"\n";
    }
    struct Gone {
      fs::path folder;
      ~Gone() { fs::remove_all(folder); }
    } gone{folder};
    data::LoadOptions options;
    options.tolerate = tolerate;
    return data::load({folder / "dataset.toml"}, options);
  }

  static model::Model base(bool asymmetries) {
    model::Model m;
    m.drive.axis = data::Axis::linear;
    m.drive.gear_ratio.value = 1.0;
    for (const char* effect : {"inertia", "viscous_friction", "coulomb_friction"})
      m.effects.push_back(catalogue::blank_effect(catalogue::get(effect), data::Axis::linear));
    if (asymmetries) m.effects.push_back(catalogue::blank_effect(catalogue::get("torque_bias"), data::Axis::linear));
    return m;
  }

  // The position as the log has it at any time, straight between samples.
  Row at(double time) const {
    const double place = (time - rows_.front().time) / (rows_[1].time - rows_[0].time);
    const auto k = std::min(static_cast<std::size_t>(std::max(place, 0.0)), rows_.size() - 2);
    const double part = place - static_cast<double>(k);
    const auto between = [&](double a, double b) { return a + (b - a) * part; };
    return {time, between(rows_[k].force, rows_[k + 1].force), between(rows_[k].position, rows_[k + 1].position)};
  }

  std::vector<Row> rows_;
};

bool says(const std::vector<data::Finding>& findings, const std::string& kind, const std::string& text) {
  for (const data::Finding& f : findings)
    if (f.kind == kind && f.text().find(text) != std::string::npos) return true;
  return false;
}

TEST_F(HonestData, TimeStampsThatJitterAreSaidAndResampled) {
  // A logger that is busy: steps between 10 and 12 ms, the position read at the time that is stated.
  std::mt19937 random(5);
  std::vector<Row> jittered;
  for (double time = rows_.front().time; time < rows_.back().time - 0.02;
       time += 0.011 + std::uniform_real_distribution<double>(-0.001, 0.001)(random))
    jittered.push_back(at(time));
  const data::Dataset loaded = load(jittered, {}, {"jitter"});
  EXPECT_TRUE(says(loaded.findings, "jitter", "resampled"));
  // The same as from a logger with an even clock of that rate.
  std::vector<Row> even;
  for (double time = rows_.front().time; time < rows_.back().time - 0.02; time += 0.011) even.push_back(at(time));
  const auto from_jittered = estimation::identify(loaded, base(true), {});
  const auto from_even = estimation::identify(load(even), base(true), {});
  for (std::size_t i = 0; i < from_even->estimates.size(); ++i) {
    const double expected = from_even->estimates[i].value;
    EXPECT_NEAR(from_jittered->estimates[i].value, expected, 0.05 * std::abs(expected)) << from_even->estimates[i].id;
  }
}

TEST_F(HonestData, AVelocityThatIsTwiceTheDerivativeIsRefusedWithItsFactor) {
  std::vector<double> velocity(rows_.size(), 0.0);
  for (std::size_t k = 5; k + 5 < rows_.size(); ++k)
    velocity[k] = 2.0 * (rows_[k + 5].position - rows_[k - 5].position) / (rows_[k + 5].time - rows_[k - 5].time);
  try {
    load(rows_, velocity);
    FAIL() << "a velocity column of twice the derivative was taken";
  } catch (const data::DataError& error) {
    bool factor = false;
    for (const data::Finding& f : error.findings()) {
      const std::string text = f.text();
      factor = factor || text.find("it is 2") != std::string::npos || text.find("it is 1.99") != std::string::npos;
    }
    EXPECT_TRUE(factor);
  }
}

TEST_F(HonestData, MotionInOneDirectionShowsNoAsymmetryAndSaysSo) {
  // The strokes forward alone, as a conveyor moves.
  std::vector<Row> forward;
  double shift = 0.0, time = 0.0;
  for (std::size_t k = 20; k + 20 < rows_.size(); ++k) {
    const double slope = (rows_[k + 20].position - rows_[k - 20].position) / 0.04;
    if (slope < 0.01) continue;
    if (forward.empty() || std::abs(rows_[k].position + shift - forward.back().position) > 2e-3)
      shift = forward.empty() ? 0.0 : forward.back().position - rows_[k].position;
    forward.push_back({time, rows_[k].force, rows_[k].position + shift});
    time += 1e-3;
  }
  ASSERT_GT(forward.size(), 3000u);
  const data::Dataset loaded = load(forward);
  const selection::Diagnosis d = selection::diagnose(loaded, base(false), {});
  bool said = false;
  for (const std::string& warning : d.warnings) said = said || warning.find("moves forward in") != std::string::npos;
  EXPECT_TRUE(said);
  for (const selection::NamedEffect& n : d.named) {
    EXPECT_NE(n.effect, "coulomb_asymmetry");
    EXPECT_NE(n.effect, "viscous_asymmetry");
    EXPECT_NE(n.effect, "torque_bias");
  }
}

TEST_F(HonestData, CoarsePositionsLeaveTheParametersAndNameNothingElse) {
  // A linear scale of 10 micrometres. Its steps hide slow motion, and the friction of the axis is curved.
  std::vector<Row> coarse = rows_;
  for (Row& r : coarse) r.position = std::floor(r.position / 10e-6 + 0.5) * 10e-6;
  const auto fine_fit = estimation::identify(load(rows_), base(true), {});
  const auto coarse_fit = estimation::identify(load(coarse), base(true), {});
  for (std::size_t i = 0; i < fine_fit->estimates.size(); ++i) {
    const double fine = fine_fit->estimates[i].value;
    EXPECT_NEAR(coarse_fit->estimates[i].value, fine, 0.08 * std::abs(fine)) << fine_fit->estimates[i].id;
  }
}

TEST_F(HonestData, AnOrderIsNamedFromAFewTurnsOnlyWhereTheWholeMeasurementHasTheWave) {
  // A second and a half: the axis has moved by some turns of the screw at most, and any order explains something. The
  // axis has a ripple of 2.5 mm (tests/real_joints/README.md).
  model::Model m = base(true);
  m.drive.pitch_m.value = 0.04;
  const std::vector<Row> part(rows_.begin() + 1000, rows_.begin() + 2500);
  const selection::Diagnosis d = selection::diagnose(load(part), m, {});
  for (const selection::NamedEffect& n : d.named)
    if (n.order) {
      EXPECT_NEAR(*m.drive.pitch_m.value / *n.order, 2.5e-3, 0.05e-3) << n.effect << ":" << *n.order;
    }
}

}  // namespace
}  // namespace flexspline::honest_data_test
