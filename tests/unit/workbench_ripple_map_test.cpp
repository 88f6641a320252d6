// host/output/report/maps, as the workbench shows them: a ripple is drawn with enough points for each of its waves.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/app/workbench/result_view.hpp"
#include "host/app/workbench/work.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::workbench::workbench_ripple_map_test {
namespace {

using nlohmann::json;

// The map over the motor's angle where the current has a ripple of this order that the model lacks.
json angle_map(int order) {
  const plant::Drive drive = plant::demo_plant().drive;
  auto dataset = std::make_shared<data::Dataset>(comparison::record(
      drive, {comparison::plan("free", plant::Mode::velocity, plant::Waveform::triangle, 60.0, 0.5, 6.0)}, 1));
  data::Experiment& e = dataset->experiments.front();
  for (std::size_t k = 0; k < e.size(); ++k)
    e[data::Column::current][k] += 0.3 * std::sin(order * e[data::Column::motor_position][k]);
  model::ModelFile file{comparison::known_model(drive), ""};
  file.text = model::write(file.model);
  estimation::PipelineOptions pipeline;
  pipeline.cutoff_hz = 120.0;
  const auto step = open(dataset, file, pipeline, [](std::string_view) {});
  for (const json& of_signal : step->view()->maps())
    if (of_signal["signal"] == "motor_balance")
      for (const json& map : of_signal["maps"])
        if (map["variable"] == "motor_angle") return map;
  return nullptr;
}

TEST(RippleMap, HasSixBinsForEachWaveOfTheLargestOrder) {
  const json map = angle_map(7);
  ASSERT_FALSE(map.is_null());
  const std::vector<double> amplitude = map["orders"]["amplitude"];
  EXPECT_EQ(std::max_element(amplitude.begin(), amplitude.end()) - amplitude.begin(), 6);
  EXPECT_GE(map["x"].size(), 40u);
  // As many maxima as the ripple has waves.
  const json& mean = map["plain"]["mean"];
  int waves = 0;
  for (std::size_t k = 1; k < mean.size(); ++k)
    if (mean[k - 1].is_number() && mean[k].is_number() && mean[k - 1].get<double>() < 0.0 &&
        mean[k].get<double>() >= 0.0)
      ++waves;
  EXPECT_NEAR(waves, 7, 1);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_ripple_map_test
