#include "host/closed_loop/compare.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "host/deployment/bases.hpp"
#include "host/deployment/pack.hpp"
#include "host/drive/settings_text.hpp"

namespace flexspline::closed_loop {
namespace {

constexpr std::size_t kSamples = 20'000;  // along which a block is compared with double

void pack_all(Contest& contest) {
  std::string settings = contest.settings;
  for (Contender& one : contest.contenders) {
    deployment::PackOptions pack;
    pack.tick_hz = contest.job.tick_hz;
    pack.samples = kSamples;
    pack.settings = settings;
    pack.settings_origin = contest.settings_origin;
    one.block = deployment::pack(one.model, pack).bytes;
    if (&one != contest.contenders.data()) continue;
    const double most_a = 1.99 * deployment::bases_of(one.model, 1.0 / contest.job.tick_hz, 1.0).current_base;
    std::optional<double> lowered_from_a;
    settings = drive::settings_text(deployment::unpack(one.block), most_a, lowered_from_a);
  }
}

std::vector<Prediction> predicted_of(const Contest& contest, const Runner& run, std::string& why_not) {
  try {
    Question question;
    question.believed = contest.contenders.back().model;
    question.bench = bench_of(deployment::unpack(contest.contenders.front().block));
    for (const Contender& one : contest.contenders) question.candidates.push_back({one.label, one.block});
    question.scenario = contest.job.scenario;
    question.seconds = contest.job.seconds;
    question.draws = contest.draws;
    question.seed = contest.job.seed;
    question.tick_hz = contest.job.tick_hz;
    return predict(question, run);
  } catch (const std::runtime_error& error) {
    why_not = error.what();
    return {};
  }
}

}  // namespace

Comparison compare(Contest contest, const Runner& run, const std::function<void(std::string_view)>& say) {
  if (contest.contenders.empty()) throw std::invalid_argument("a comparison needs a model");
  say("packing the models");
  pack_all(contest);
  const model::Model& first = contest.contenders.front().model;
  Comparison c;
  c.scenario = contest.job.scenario;
  c.processor = contest.job.processor;
  c.take_gains(deployment::parse_drive_setup(contest.settings, contest.settings_origin, first,
                                             deployment::bases_of(first, 1.0 / contest.job.tick_hz, 1.0)));
  std::vector<Prediction> predicted;
  if (contest.draws > 0) {
    say("predicting the gain");
    predicted = predicted_of(contest, run, c.no_prediction);
  }
  say("running the drive");
  std::vector<Job> jobs;
  Job job = contest.job;
  job.compensation = false;
  job.block = contest.contenders.front().block;
  jobs.push_back(job);
  job.compensation = true;
  for (const Contender& one : contest.contenders) {
    job.block = one.block;
    jobs.push_back(job);
  }
  std::vector<Outcome> outcomes = run(jobs);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    ComparedRun one;
    one.label = i == 0 ? "none" : contest.contenders[i - 1].label;
    one.model = i == 0 ? "" : contest.contenders[i - 1].name;
    one.outcome = std::move(outcomes[i]);
    if (i > 0 && i <= predicted.size()) one.predicted = predicted[i - 1];
    c.runs.push_back(std::move(one));
  }
  c.finish();
  return c;
}

Runner in_groups(Runner run, std::size_t size, std::function<void(std::size_t done)> told) {
  return [run = std::move(run), size = std::max<std::size_t>(size, 1),
          told = std::move(told)](const std::vector<Job>& jobs) {
    std::vector<Outcome> all;
    while (all.size() < jobs.size()) {
      told(all.size());
      const auto from = jobs.begin() + static_cast<std::ptrdiff_t>(all.size());
      const auto count = std::min(size, jobs.size() - all.size());
      std::vector<Outcome> some = run({from, from + static_cast<std::ptrdiff_t>(count)});
      std::ranges::move(some, std::back_inserter(all));
    }
    return all;
  };
}

}  // namespace flexspline::closed_loop
