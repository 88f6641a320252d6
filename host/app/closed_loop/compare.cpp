#include "host/app/closed_loop/compare.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/drive/settings_text.hpp"

namespace flexspline::closed_loop {
namespace {

constexpr std::size_t kSamples = 20'000;  // along which a block is compared with double

void pack_all(ComparisonSetup& setup) {
  std::string settings = setup.settings;
  for (ComparedModel& one : setup.models) {
    deployment::PackOptions pack;
    pack.tick_hz = setup.job.tick_hz;
    pack.samples = kSamples;
    pack.settings = settings;
    pack.settings_origin = setup.settings_origin;
    one.block = deployment::pack(one.model, pack).bytes;
    if (&one != setup.models.data()) continue;
    const double most_a = 1.99 * deployment::bases_of(one.model, 1.0 / setup.job.tick_hz).current_base;
    settings = drive::kept_settings(deployment::unpack(one.block), most_a).text;
  }
}

std::vector<Prediction> predicted_of(const ComparisonSetup& setup, const Runner& run, std::string& why_not) {
  try {
    Question question;
    question.identified = setup.models.back().model;
    question.hardware = twin_hardware_of(deployment::unpack(setup.models.front().block));
    for (const ComparedModel& one : setup.models) question.candidates.push_back({one.label, one.block});
    question.scenario = setup.job.scenario;
    question.seconds = setup.job.seconds;
    question.draws = setup.draws;
    question.seed = setup.job.seed;
    question.tick_hz = setup.job.tick_hz;
    return predict(question, run);
  } catch (const std::runtime_error& error) {
    why_not = error.what();
    return {};
  }
}

}  // namespace

Comparison compare(ComparisonSetup setup, const Runner& run, const std::function<void(std::string_view)>& progress) {
  if (setup.models.empty()) throw std::invalid_argument("a comparison needs a model");
  progress("packing the models");
  pack_all(setup);
  const model::Model& first = setup.models.front().model;
  Comparison c;
  c.scenario = setup.job.scenario;
  c.processor = setup.job.processor;
  c.take_gains(deployment::parse_drive_setup(setup.settings, setup.settings_origin, first,
                                             deployment::bases_of(first, 1.0 / setup.job.tick_hz)));
  std::vector<Prediction> predicted;
  if (setup.draws > 0) {
    progress("predicting the gain");
    predicted = predicted_of(setup, run, c.no_prediction);
  }
  progress("running the drive");
  std::vector<Job> jobs;
  Job job = setup.job;
  job.compensation = false;
  job.block = setup.models.front().block;
  jobs.push_back(job);
  job.compensation = true;
  for (const ComparedModel& one : setup.models) {
    job.block = one.block;
    jobs.push_back(job);
  }
  std::vector<Outcome> outcomes = run(jobs);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    ComparedRun one;
    one.label = i == 0 ? "none" : setup.models[i - 1].label;
    one.model = i == 0 ? "" : setup.models[i - 1].name;
    one.outcome = std::move(outcomes[i]);
    if (i > 0 && i <= predicted.size()) one.predicted = predicted[i - 1];
    c.runs.push_back(std::move(one));
  }
  c.finish();
  return c;
}

Runner in_groups(Runner run, std::size_t size, std::function<void(std::size_t)> done) {
  return [run = std::move(run), size = std::max<std::size_t>(size, 1),
          done = std::move(done)](const std::vector<Job>& jobs) {
    std::vector<Outcome> all;
    while (all.size() < jobs.size()) {
      done(all.size());
      const auto from = jobs.begin() + static_cast<std::ptrdiff_t>(all.size());
      const auto count = std::min(size, jobs.size() - all.size());
      std::vector<Outcome> some = run({from, from + static_cast<std::ptrdiff_t>(count)});
      std::ranges::move(some, std::back_inserter(all));
    }
    return all;
  };
}

}  // namespace flexspline::closed_loop
