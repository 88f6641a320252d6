#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "hil/plant/excitation.hpp"
#include "hil/plant/parameters.hpp"
#include "hil/plant/physics.hpp"
#include "hil/plant/recorder.hpp"

namespace flexspline::plant::plant_record_test {
namespace {

double rms(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum / static_cast<double>(x.size()));
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> d(a.size());
  for (std::size_t k = 0; k < a.size(); ++k) d[k] = a[k] - b[k];
  return d;
}

double peak(const std::vector<double>& x) {
  double largest = 0.0;
  for (const double v : x) largest = std::max(largest, std::abs(v));
  return largest;
}

ExperimentPlan short_sine() {
  ExperimentPlan plan;
  plan.name = "short";
  plan.mode = Mode::velocity;
  plan.waveform = Waveform::sine;
  plan.amplitude = 60.0;
  plan.frequency_hz = 2.0;
  plan.duration_s = 1.0;
  return plan;
}

TEST(PlantFile, DemoDriveIsComplete) {
  const PlantFile file = demo_plant();
  EXPECT_EQ(file.drive.gear_ratio, 100.0);
  EXPECT_NEAR(file.drive.torque_constant_nm_a, 0.0543, 1e-12);
  EXPECT_EQ(std::count_if(file.experiments.begin(), file.experiments.end(), [](const auto& e) { return e.holdout; }),
            4);
  EXPECT_NE(file.drive.find("structural_damping"), nullptr);
  EXPECT_EQ(file.drive.find("gravity"), nullptr);
}

TEST(PlantFile, ErrorsNameLineKeyAndCause) {
  const std::string text = "format = \"flexspline-plant/1\"\nname = \"x\"\n[drive]\ngear_ratio = -1\n";
  try {
    parse_plant(text, "mine.toml");
    FAIL() << "a negative gear ratio passed";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "mine.toml:4: [drive]: gear_ratio must be positive");
  }
  EXPECT_THROW(parse_plant(text + "colour = 3\n", "mine.toml"), std::runtime_error);
  EXPECT_THROW(parse_plant("format = ", "mine.toml"), std::runtime_error);
  EXPECT_THROW(load_plant("/no/such/plant.toml"), std::runtime_error);
}

TEST(PlantFile, ARunThatIsFarTooLongIsRefusedWithItsPlace) {
  const auto file = std::filesystem::temp_directory_path() / "flexspline-too-long.toml";
  std::ofstream(file)
      << "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[[run]]\nname = \"a\"\nmode = \"velocity\"\n"
         "waveform = \"sine\"\namplitude = 10\nfrequency_hz = 1\nduration_s = 1e15\n";
  Drive drive = demo_plant().drive;
  try {
    load_plan(file, drive);
    FAIL() << "a run of a thousand years passed";
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("too-long.toml:9: [[run]]: duration_s is 1e+15"), std::string::npos) << what;
    EXPECT_NE(what.find("make it shorter"), std::string::npos) << what;
  }
  std::filesystem::remove(file);
}

TEST(PlantFile, HidingScalesTheTorqueAndTakesAnyOrder) {
  Drive drive = demo_plant().drive;
  hide(drive, "torque_ripple:12", 0.5);
  EXPECT_EQ(drive.hidden(), "torque_ripple:12");
  const auto& ripple = physics_of(drive).friction.ripple;
  ASSERT_EQ(ripple.size(), 1U);
  EXPECT_EQ(ripple[0].order, 12.0);
  EXPECT_NEAR(std::hypot(ripple[0].cosine, ripple[0].sine), 0.5 * 0.004, 1e-9);
  EXPECT_THROW(hide(drive, "gravity"), std::invalid_argument);

  Drive bristle = demo_plant().drive;
  hide(bristle, "dahl_friction", 2.0);
  EXPECT_NEAR(physics_of(bristle).friction.dahl_presliding, 0.1, 1e-12);
  EXPECT_EQ(physics_of(bristle).friction.coulomb, 0.0);
  EXPECT_THROW(with(bristle, "triangle_ripple"), std::invalid_argument);
  EXPECT_THROW(with(bristle, "warp_drive"), std::invalid_argument);
}

TEST(Excitation, CompositeIsEquationSixtyOfUnitPeak) {
  double largest = 0.0;
  for (int k = 0; k < 5000; ++k) largest = std::max(largest, std::abs(waveform(Waveform::composite, k / 5000.0)));
  EXPECT_NEAR(largest, 1.0, 1e-5);
  const double t = 0.7;
  const double ratio = (std::cos(t) + 0.5 * std::sin(2 * t) + std::sin(3 * t)) / 1.0;
  EXPECT_NEAR(waveform(Waveform::composite, t / (2.0 * std::numbers::pi)) / waveform(Waveform::composite, 0.0), ratio,
              1e-12);
  EXPECT_NEAR(waveform(Waveform::asymmetric_sine, 0.75), -1.2, 1e-12);
}

TEST(Record, BalancesHoldWithTheTruth) {
  const Drive drive = demo_plant().drive;
  ExperimentPlan plan = short_sine();
  const Record record = record_one(drive, plan, 3, 0);
  const auto& t = record.truth;
  for (std::size_t k = 0; k < t.current_a.size(); ++k) {
    const double w = t.motor_velocity_rad_s[k];
    if (std::abs(w) < 1.0) continue;
    const double s = w > 0.0 ? 1.0 : -1.0;
    const double right = 1.04e-4 * t.motor_acceleration_rad_s2[k] + 3.6e-4 * w + 0.045 * s + 1e-5 * std::abs(w) + 1e-3 +
                         t.torque_nm[k] / 100.0;
    ASSERT_NEAR(0.0543 * t.current_a[k], right, 1e-9) << k;
    ASSERT_NEAR(record.current_a[k] - t.current_a[k], 0.05, 6.0 * record.current_noise_std);
  }
}

TEST(Record, SensorsHaveTheNoiseThatTheyState) {
  Drive drive = demo_plant().drive;
  drive.sensors.has_tachometer = true;
  const Record record = record_one(drive, short_sine(), 5, 0);
  const auto noise = [&](const std::vector<double>& measured, const std::vector<double>& truth) {
    return rms(difference(measured, truth));
  };
  std::vector<double> offset_current = record.truth.current_a;
  for (double& value : offset_current) value += 0.05;
  EXPECT_NEAR(record.current_noise_std, 0.005 * peak(offset_current), 1e-12);
  EXPECT_NEAR(noise(record.current_a, offset_current) / record.current_noise_std, 1.0, 0.1);
  EXPECT_NEAR(record.torque_noise_std, 0.01 * peak(record.truth.torque_nm), 1e-12);
  EXPECT_NEAR(noise(record.torque_nm, record.truth.torque_nm) / record.torque_noise_std, 1.0, 0.1);
  EXPECT_NEAR(noise(record.motor_velocity_rad_s, record.truth.motor_velocity_rad_s) / record.tachometer_noise_std, 1.0,
              0.1);
  EXPECT_NEAR(noise(record.motor_position_rad, record.truth.motor_position_rad) / record.motor_position_noise_std, 1.0,
              0.1);
  const double count = 2.0 * std::numbers::pi / 262144;
  EXPECT_LE(peak(difference(record.output_position_rad, record.truth.output_position_rad)), 0.5001 * count);
}

TEST(Record, ColouredNoiseKeepsItsSizeAndCorrelates) {
  Drive drive = demo_plant().drive;
  drive.sensors.torque.correlation = 0.9;
  ExperimentPlan plan;
  plan.duration_s = 8.0;
  const Record record = record_one(drive, plan, 5, 0);
  double lagged = 0.0, square = 0.0;
  for (std::size_t k = 1; k < record.torque_nm.size(); ++k) {
    lagged += record.torque_nm[k] * record.torque_nm[k - 1];
    square += record.torque_nm[k] * record.torque_nm[k];
  }
  EXPECT_NEAR(lagged / square, 0.9, 0.03);
  EXPECT_NEAR(rms(record.torque_nm) / record.torque_noise_std, 1.0, 0.15);
}

TEST(Record, RestShowsTheCurrentOffsetAlone) {
  const PlantFile file = demo_plant();
  ExperimentPlan plan = file.experiments.front();
  plan.duration_s = 1.0;
  const Record record = record_one(file.drive, plan, 1, 0);
  double mean = 0.0;
  for (const double value : record.current_a) mean += value / static_cast<double>(record.current_a.size());
  EXPECT_NEAR(mean, 0.05, 2e-4);
  EXPECT_EQ(peak(record.motor_position_rad), 0.0);
}

TEST(Record, ADelayedSensorShowsWhatWas) {
  Drive drive = demo_plant().drive;
  drive.sensors.torque.noise_share = drive.sensors.torque.noise_floor = 0.0;
  drive.sensors.motor_counts = 1 << 30;
  drive.sensors.torque.delay_samples = 3.0;
  drive.sensors.motor_delay_samples = 0.5;
  const Record record = record_one(drive, short_sine(), 1, 0);
  for (std::size_t k = 3; k < record.time_s.size(); ++k) {
    ASSERT_EQ(record.torque_nm[k], record.truth.torque_nm[k - 3]);
    const double between = 0.5 * (record.truth.motor_position_rad[k] + record.truth.motor_position_rad[k - 1]);
    ASSERT_NEAR(record.motor_position_rad[k], between, 5e-4);
  }
}

TEST(Record, TheSameSeedGivesTheSameBitsAndAnotherSeedDoesNot) {
  Drive drive = demo_plant().drive;
  drive.friction_variation = 0.03;
  const std::vector<ExperimentPlan> plans(2, short_sine());
  const auto a = record_all(drive, plans, 11), b = record_all(drive, plans, 11), c = record_all(drive, plans, 12);
  EXPECT_EQ(a[1].torque_nm, b[1].torque_nm);
  EXPECT_EQ(a[1].motor_position_rad, b[1].motor_position_rad);
  EXPECT_NE(a[1].current_a, c[1].current_a);
  EXPECT_NE(a[0].current_a, a[1].current_a);
  EXPECT_NE(a[0].viscous_factor, a[1].viscous_factor);
  drive.sensors.has_tachometer = true;
  EXPECT_EQ(record_all(drive, plans, 11)[1].torque_nm, a[1].torque_nm);
}

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Dataset, FilesHoldWhatTheContractPromises) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "plant_test_dataset";
  std::filesystem::remove_all(folder);
  Drive drive = demo_plant().drive;
  with(drive, "torque_ripple:2");
  hide(drive, "stribeck_gaussian", 0.5);
  ExperimentPlan locked = short_sine();
  locked.name = "locked";
  locked.mode = Mode::current;
  locked.amplitude = 2.0;
  locked.locked = locked.holdout = true;
  write_dataset(record_all(drive, {short_sine(), locked}, 9), drive, folder);

  const std::string csv = read(folder / "short.csv");
  for (const char* part : {"# experiment: short\n", "# load: free\n", "# role: fit\n", "# current_hold: zoh\n",
                           "# encoder_counts: 16384\n", "# output_encoder_counts: 262144\n", "# noise_std_torque_nm: ",
                           "\ntime_s,current_a,motor_position_rad,output_position_rad,torque_nm,temperature_c,"}) {
    EXPECT_NE(csv.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1001 + std::count(csv.begin(), csv.end(), '#'));
  EXPECT_NE(read(folder / "locked.csv").find("# load: locked\n# role: holdout\n"), std::string::npos);

  const std::string base = read(folder / "base-model.toml");
  EXPECT_EQ(base.find("stribeck"), std::string::npos);
  EXPECT_NE(base.find("type = \"torque_ripple\""), std::string::npos);
  EXPECT_NE(base.find("order = { value = 2, fixed = true }"), std::string::npos);
  EXPECT_EQ(base.find("0.045"), std::string::npos) << "the base model must not give the truth away";

  const std::string truth = read(folder / "truth.toml");
  EXPECT_NE(truth.find("hidden = \"stribeck_gaussian\"\nseed = 9\nscale = 0.5\n"), std::string::npos);
  EXPECT_NE(truth.find("amplitude_positive = { value = 0.006, unit = \"N*m\" }"), std::string::npos);
  EXPECT_NE(truth.find("coefficient = { value = 1e-05, unit"), std::string::npos) << "1.e-05 would be no TOML";
  EXPECT_NE(truth.find("gear_ratio = 100.0\n"), std::string::npos);
  EXPECT_NE(read(folder / "dataset.toml").find("file = \"locked.csv\""), std::string::npos);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    EXPECT_NE(entry.path().extension(), ".partial");
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace flexspline::plant::plant_record_test
