#include "host/app/closed_loop/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "host/common/numbers/distributions.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::closed_loop {
namespace {

constexpr double kMostDeviations = 3.0;
// What draws do not show: that a fit's own parameters are not the drive's where two effects are confounded.
constexpr double kLeastSpread = 0.05;

// What cannot be, a fit would not have found either: for example an exponent near zero makes a plant that no step is
// short enough for. Bounds of nonlinear parameters that are searched as ratios are not those of their values.
double within_bounds(const model::Effect& effect, const model::Parameter& p, double value) {
  const catalogue::Entry* entry = catalogue::find(effect.type);
  if (entry == nullptr) return value;
  for (const effects::ParameterInfo& info : entry->parameters)
    if (info.name == p.name && info.per.empty() && info.root_of.empty()) return std::clamp(value, info.low, info.high);
  return value;
}

}  // namespace

model::Model drawn(const model::Model& model, std::uint64_t seed, std::uint64_t number) {
  std::seed_seq mixed{seed, number, std::uint64_t{0x70726564}};
  std::mt19937_64 generator(mixed);
  std::normal_distribution<double> normal;
  model::Model out = model;
  for (model::Effect& effect : out.effects)
    for (model::Parameter& p : effect.parameters) {
      const double deviation = std::clamp(normal(generator), -kMostDeviations, kMostDeviations);
      if (!p.value || !p.std || p.fixed || !(*p.std > 0.0)) continue;
      const double moved = *p.value + deviation * *p.std;
      // A sign is physics.
      p.value = within_bounds(effect, p, moved * *p.value > 0.0 ? moved : 0.1 * *p.value);
    }
  return out;
}

std::vector<Prediction> predict(const Question& question, const Runner& run) {
  if (question.candidates.empty() || question.draws < 3)
    throw std::invalid_argument("a prediction needs a candidate and three draws");
  std::vector<Job> jobs;
  for (int k = 0; k < question.draws; ++k) {
    Job job;
    job.scenario = question.scenario;
    job.plant = plant_text(drawn(question.identified, question.seed, static_cast<std::uint64_t>(k)), question.hardware);
    job.seconds = question.seconds;
    job.tick_hz = question.tick_hz;
    job.seed = question.seed + 1000 + static_cast<std::uint64_t>(k);
    job.block = question.candidates.front().block;
    jobs.push_back(job);
    job.compensation = true;
    for (const Candidate& c : question.candidates) {
      job.block = c.block;
      jobs.push_back(job);
    }
  }
  const std::vector<Outcome> outcomes = run(jobs);
  const std::size_t runs = question.candidates.size() + 1;
  std::vector<Prediction> all;
  for (std::size_t c = 0; c < question.candidates.size(); ++c) {
    Prediction p;
    p.label = question.candidates[c].label;
    p.draws = question.draws;
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k < question.draws; ++k) {
      const Outcome& none = outcomes[static_cast<std::size_t>(k) * runs];
      const Outcome& with = outcomes[static_cast<std::size_t>(k) * runs + 1 + c];
      p.stable = p.stable && !with.ends_in_fault;
      p.rms_none_rad += none.rms_error_rad / question.draws;
      p.rms_error_rad += with.rms_error_rad / question.draws;
      const double ratio = std::log(std::max(with.rms_error_rad, 1e-12) / std::max(none.rms_error_rad, 1e-12));
      sum += ratio;
      squares += ratio * ratio;
    }
    const double n = question.draws, mean = sum / n;
    const double variance = std::max(0.0, (squares - n * mean * mean) / (n - 1.0)) + kLeastSpread * kLeastSpread;
    const double half = numbers::student_t_quantile(n - 1.0, 0.975) * std::sqrt(variance * (1.0 + 1.0 / n));
    p.ratio = std::exp(mean);
    p.low = std::exp(mean - half);
    p.high = std::exp(mean + half);
    all.push_back(p);
  }
  return all;
}

}  // namespace flexspline::closed_loop
