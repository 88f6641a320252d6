// The search for a missing effect, compared with the same recipe in NumPy and SciPy, on one core each: times, and that
// both rank the candidates alike. Usage: flexspline_diagnosis_bench PYTHON SCRIPT; without arguments SciPy is left out.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/candidate_models.hpp"
#include "host/engine/selection/cross_validation.hpp"
#include "tests/bench/rows.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline {
namespace {

using estimation::Balance;
using estimation::RegressionProblem;
using estimation::Terms;

constexpr int kRuns = 7;
constexpr std::size_t kGridPoints = 6;

struct Question {
  std::string effect;
  std::optional<double> order;
  std::string label() const { return order ? fmt::format("{}:{:g}", effect, *order) : effect; }
};

// All that is linear and static, and one with a nonlinear parameter that is chosen on a grid.
std::vector<Question> questions() {
  std::vector<Question> list;
  for (const char* name : {"quadratic_drag", "load_dependent_friction", "torque_constant_saturation"})
    list.push_back({name, std::nullopt});
  for (int order = 1; order <= 13; ++order) list.push_back({"torque_ripple", order});
  for (int order = 1; order <= 4; ++order) list.push_back({"load_scaled_ripple", order});
  list.push_back({"stribeck_gaussian", std::nullopt});
  return list;
}

// Two motions of 100 s at 1 kHz of the demo's drive, with dry friction that falls out of standstill. Two records tell
// no spread of friction between records, so that the recipe is least squares with weights by record.
data::Dataset measured(model::Model& model) {
  plant::PlantFile demo = plant::demo_plant();
  plant::hide(demo.drive, "stribeck_gaussian", 1.0);
  std::erase_if(demo.experiments, [](const plant::ExperimentPlan& e) {
    return e.name != "free-composite" && e.name != "free-slow-warm";
  });
  for (plant::ExperimentPlan& e : demo.experiments) e.duration_s = 100.0;
  // Away from standstill an asymmetry of dry friction and a current offset are one constant; one of them is enough.
  model = tests::model_of(demo.drive, false, false);
  std::erase_if(model.effects, [](const model::Effect& e) { return e.type == "coulomb_asymmetry"; });
  return tests::dataset_of(demo.drive, plant::record_all(demo.drive, demo.experiments, 7001));
}

// What the script needs of the measurement; both sides begin here.
void write(const std::filesystem::path& folder, const RegressionProblem& data, const std::vector<double>& grid) {
  const estimation::PreparedData& p = data.prepared();
  std::ofstream about(folder / "about.txt");
  about << fmt::format("{:.17g} {:.17g} {:.17g}\n", 1.0 / p.records[0].sample_s, p.pipeline.row_cutoff_hz,
                       p.constants.torque_constant);
  for (const double value : grid) about << fmt::format("{:.17g} ", value);
  about << "\n";
  for (const Question& q : questions()) about << q.effect << " " << q.order.value_or(0.0) << "\n";
  for (std::size_t i = 0; i < data.records().size(); ++i) {
    const estimation::Record& r = p.records[data.records()[i].record];
    std::ofstream signals(folder / fmt::format("signals{}.bin", i), std::ios::binary);
    const auto put = [&](auto value) {
      for (std::size_t k = 0; k < r.inputs.size(); ++k) {
        const double x = value(k);
        signals.write(reinterpret_cast<const char*>(&x), sizeof x);
      }
    };
    put([&](std::size_t k) { return r.inputs[k].angle; });
    put([&](std::size_t k) { return r.inputs[k].velocity; });
    put([&](std::size_t k) { return r.inputs[k].direction; });
    put([&](std::size_t k) { return r.inputs[k].acceleration; });
    put([&](std::size_t k) { return r.inputs[k].torque; });
    put([&](std::size_t k) { return r.inputs[k].current; });
    put([&](std::size_t k) { return r.effort[k] - r.torque[k] / p.constants.gear_ratio; });
    std::ofstream rows(folder / fmt::format("rows{}.bin", i), std::ios::binary);
    for (const std::size_t k : r.rows[estimation::index(Balance::motor)].samples) {
      const auto at = static_cast<std::int64_t>(k);
      rows.write(reinterpret_cast<const char*>(&at), sizeof at);
    }
  }
}

struct Answer {
  std::vector<double> decrease_percent;  // of the left-out chi-square, of each question
  double nonlinear = 0.0;                // chosen on the grid
};

Answer search(const estimation::PreparedData& prepared, const Terms& terms, const std::vector<double>& grid,
              const std::vector<Question>& asked) {
  RegressionProblem data(prepared, Balance::motor);
  const Eigen::VectorXd keep = Eigen::VectorXd::Ones(data.rows());
  const selection::CrossValidatedFit base = selection::cross_validate(data, terms, keep);
  Answer answer;
  for (const Question& q : asked) {
    const catalogue::Entry& entry = catalogue::get(q.effect);
    Terms extended = selection::extend(terms, entry, q.order);
    if (entry.count(effects::Kind::nonlinear) > 0) {
      double& nonlinear = extended.back().values[entry.index_of("velocity")];
      double least = std::numeric_limits<double>::infinity();
      for (const double value : grid) {
        nonlinear = value;
        const double squares = selection::whitened_squares(data, extended, base);
        if (squares < least) {
          least = squares;
          answer.nonlinear = value;
        }
      }
      nonlinear = answer.nonlinear;
    }
    const selection::CrossValidatedFit judged = selection::cross_validate(data, std::move(extended), keep);
    answer.decrease_percent.push_back(selection::likelihood_gain(base, judged, 1.0).chi2_percent);
  }
  return answer;
}

int compare(const std::string& python, const std::string& script) {
  model::Model model;
  const data::Dataset dataset = measured(model);
  const auto found = estimation::identify(dataset, model, {});
  const RegressionProblem& motor = found->data.front();
  Terms candidate{estimation::candidate_term(catalogue::get("stribeck_gaussian"))};
  const std::size_t velocity = candidate[0].entry->index_of("velocity");
  const std::vector<double> grid =
      estimation::parameter_grid(estimation::parameter_range(motor, candidate[0], velocity), kGridPoints);

  Answer ours;
  // Processor time: other work on the machine does not count.
  const auto median_ms = [&](const std::vector<Question>& asked) {
    std::vector<double> times;
    for (int run = 0; run < kRuns; ++run) {
      const std::clock_t start = std::clock();
      ours = search(found->prepared, found->terms, grid, asked);
      times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    std::nth_element(times.begin(), times.begin() + kRuns / 2, times.end());
    return times[kRuns / 2];
  };
  std::vector<Question> ripples = questions();
  std::erase_if(ripples, [](const Question& q) { return q.effect != "torque_ripple"; });
  const double many = median_ms(ripples);
  const double few = median_ms({ripples.begin(), ripples.begin() + 3});
  const double growth = std::log(many / few) / std::log(static_cast<double>(ripples.size()) / 3.0);
  bench::row("growth of the diagnosis with candidates, 3 to 13", "exponent", "at most 1.1", growth);
  const double ours_ms = median_ms(questions());
  fmt::print("which of {} effects is missing, 200 s at 1 kHz, {} rows, one core\n", questions().size(), motor.rows());
  fmt::print("  diagnosis         {:8.1f} ms   (median of {})\n", ours_ms, kRuns);
  if (python.empty()) return 0;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "flexspline-diagnosis-bench";
  std::filesystem::create_directories(folder);
  write(folder, motor, grid);
  {
    std::ofstream answer(folder / "answer.txt");
    answer << fmt::format("{:.6f} {:.17g}\n", ours_ms, ours.nonlinear);
    for (const double fall : ours.decrease_percent) answer << fmt::format("{:.17g}\n", fall);
  }
  std::fflush(stdout);
  const int code = std::system(
      fmt::format("OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 {} {} {}", python, script, folder.string()).c_str());
  std::filesystem::remove_all(folder);
  if (code != 0) fmt::print("  NumPy and SciPy gave another answer, or could not be run\n");
  return code == 0 ? 0 : 1;
}

}  // namespace
}  // namespace flexspline

int main(int argc, char** argv) {
  return flexspline::compare(argc > 2 ? argv[1] : "", argc > 2 ? argv[2] : "");
}
