#include "tests/soak/diagnose_case.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "host/engine/estimation/variable_projection.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/add_until_complete.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/twin_data.hpp"

namespace flexspline::soak {
namespace {

using estimation::Balance;
using estimation::RegressionProblem;

// Of a set in which no candidate is admissible.
constexpr double kNoScore = -20.0;
constexpr std::size_t kMostRounds = 4;

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find(at, from), text.size());
    parts.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return parts;
}

std::string label(const std::string& effect, const std::optional<double>& order) {
  return order ? fmt::format("{}:{:g}", effect, *order) : effect;
}

// As the diagnosis names it: with the order, which the plant's name of the usual order does not have.
std::string as_named(const std::string& hidden) {
  const catalogue::Entry* entry = catalogue::find(hidden);
  return entry && entry->count(effects::Kind::given) > 0 ? hidden + ":2" : hidden;
}

double root_mean_square(const Eigen::VectorXd& r) {
  return r.size() ? std::sqrt(r.squaredNorm() / static_cast<double>(r.size())) : 0.0;
}

// A drive's recordings, and the truth that only the plant has.
struct Bench {
  plant::PlantFile file;
  std::vector<plant::Record> records;
  data::Dataset dataset;
  model::Model base, truth;

  explicit Bench(const Case& c) : file(plant::demo_plant()) {
    const std::vector<std::string> hidden = split(c.hidden, '+'), with = split(c.with, ',');
    // The plant hides one effect; further ones are added to the plant and removed from the model.
    for (std::size_t k = 0; k < hidden.size(); ++k) {
      if (k == 0) {
        plant::hide(file.drive, hidden[k], c.scale);
        continue;
      }
      plant::with(file.drive, hidden[k]);
      for (plant::Effect& e : file.drive.effects) e.hidden = e.hidden || e.label() == hidden[k];
    }
    for (const std::string& name : with)
      if (std::find(hidden.begin(), hidden.end(), name) == hidden.end()) plant::with(file.drive, name);
    file.drive.friction_variation = c.friction_variation;
    file.drive.sensors.current.correlation = c.noise_correlation;
    file.drive.sensors.torque.correlation = c.noise_correlation;
    records = plant::record_all(file.drive, file.experiments, c.seed);
    dataset = tests::dataset_of(file.drive, records);
    base = tests::model_of(file.drive, false, false);
    truth = tests::model_of(file.drive, true, true);
  }

  std::vector<const data::Experiment*> of(data::Role role) const {
    std::vector<const data::Experiment*> list;
    for (const auto& e : dataset.experiments)
      if (e.role == role) list.push_back(&e);
    return list;
  }

  // RMS of the true model's residual on the hold-out records.
  double holdout_floor(Balance balance) const {
    const estimation::PreparedData prepared = estimation::prepare(of(data::Role::fit), truth, {});
    const estimation::PreparedData held_out =
        estimation::prepare_with(of(data::Role::holdout), truth.drive, prepared.pipeline);
    RegressionProblem data(held_out, balance);
    return root_mean_square(data.residual(estimation::terms_of(truth)));
  }

  // The torque of the hidden effects orthogonal to the base model, over the noise, on the fitted records.
  double missing_over_noise(Balance balance) const {
    const estimation::PreparedData prepared = estimation::prepare(of(data::Role::fit), truth, {});
    RegressionProblem data(prepared, balance);
    const estimation::Terms full = estimation::terms_of(truth),
                            without = estimation::terms_of(tests::model_of(file.drive, false, true));
    Eigen::VectorXd noise = data.residual(full);
    Eigen::VectorXd missing = data.residual(without) - noise;
    for (std::size_t t = 0; t < full.size(); ++t) {
      const std::string_view name = full[t].entry->name();
      const bool viscous = name == "viscous_friction", dry = name == "coulomb_friction" || name == "dahl_friction";
      if (!viscous && !dry) continue;
      const Eigen::VectorXd torque = data.term_torque(full, t);
      for (const auto& range : data.records()) {
        const auto at = std::find_if(records.begin(), records.end(), [&](const plant::Record& r) {
          return r.name == prepared.records[range.record].name;
        });
        noise.segment(range.first, range.size()) -=
            ((viscous ? at->viscous_factor : at->coulomb_factor) - 1.0) * torque.segment(range.first, range.size());
      }
    }
    const auto on_balance = estimation::terms_on(without, balance, {.torque = true, .torsion = true});
    Eigen::MatrixXd X = data.columns(without, estimation::free_linear_parameters(without, on_balance));
    if (X.cols() == 0) {
      estimation::Terms open = estimation::terms_of(base);
      X = data.columns(open, estimation::free_linear_parameters(open, on_balance));
    }
    const Eigen::VectorXd size = X.colwise().norm().transpose().array().max(1e-300);
    X *= size.cwiseInverse().asDiagonal();
    missing -= X * Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(X).solve(missing);
    return root_mean_square(missing) / root_mean_square(noise);
  }
};

void compare_parameters(const Bench& bench, const std::string& hidden, const selection::Addition& added,
                        Outcome& outcome) {
  const catalogue::Entry& entry = catalogue::get(hidden.substr(0, hidden.find(':')));
  const plant::Effect* truth = nullptr;
  for (const plant::Effect& e : bench.file.drive.effects)
    if (e.hidden) truth = &e;
  // Errors of cosine and sine are relative to the amplitude, as either may be near zero.
  double height = 0.0;
  for (const plant::Parameter& p : truth->parameters)
    if (p.key == "cosine" || p.key == "sine") height = std::hypot(height, p.value);
  // Weights at points that depend on the data cannot be compared with those at the plant's points.
  const bool laid_by_data = entry.count(effects::Kind::grid) > 0;
  for (const estimation::Estimate& e : added.estimates) {
    if (laid_by_data) break;
    if (e.effect != entry.name() || !truth->has(e.parameter) || !e.std || e.fixed) continue;
    if (e.id != added.model.effects.back().id) continue;
    const double is = truth->value(e.parameter);
    const auto kind = entry.parameters[entry.index_of(e.parameter)].kind;
    if (kind == effects::Kind::given || kind == effects::Kind::grid) continue;
    const double scale = height > 0.0 ? height : std::abs(is);
    outcome.recovered.push_back({e.parameter, kind == effects::Kind::nonlinear,
                                 scale > 0.0 ? (e.value - is) / scale : 0.0,
                                 e.low && e.high && *e.low <= is && is <= *e.high});
  }
}

// Adds the named effects until none is named, and compares with all hidden ones.
bool finds_all(const Bench& bench, const std::vector<std::string>& hidden) {
  std::multiset<std::string> found, wanted;
  for (const std::string& h : hidden) wanted.insert(as_named(h));
  const selection::StepwiseSelection done = selection::add_until_complete(bench.dataset, bench.base, {}, kMostRounds);
  for (std::size_t round = 0; round + 1 < done.rounds.size(); ++round)
    found.insert(label(done.rounds[round].named.front().effect, done.rounds[round].named.front().order));
  for (const std::string& out : done.removed) found.erase(out);
  return found == wanted;
}

}  // namespace

std::string Case::key() const {
  return fmt::format("{} x{:g} seed {} friction {:g} colour {:g} with {}", hidden.empty() ? "-" : hidden, scale, seed,
                     friction_variation, noise_correlation, with.empty() ? "-" : with);
}

Outcome run(const Case& what) {
  Outcome outcome;
  outcome.what = what;
  const Bench bench(what);
  const auto start = std::chrono::steady_clock::now();
  const selection::Diagnosis d = selection::diagnose(bench.dataset, bench.base, {});
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  outcome.best_score = kNoScore;
  outcome.verdict = selection::verdict_name(d.verdict);
  for (const auto& n : d.named) outcome.named += (outcome.named.empty() ? "" : "+") + label(n.effect, n.order);
  if (d.named.empty()) outcome.named = "-";
  for (std::size_t i = 0; i < d.candidates.size(); ++i) {
    const selection::Candidate& c = d.candidates[i];
    if (i < 4)
      outcome.detail += fmt::format(" {}({:.1f},{:.2f}%{})", label(c.effect, c.order), c.score, c.chi2_decrease_percent,
                                    c.admissible ? "" : ",x");
    if (c.admissible) outcome.best_score = std::max(outcome.best_score, c.score + c.other_balance_score);
  }
  const std::vector<std::string> hidden = split(what.hidden, '+');
  if (hidden.empty()) {
    outcome.right = d.named.empty();
    return outcome;
  }
  const bool known = std::all_of(hidden.begin(), hidden.end(),
                                 [](const auto& h) { return catalogue::find(h.substr(0, h.find(':'))); });
  if (!known) {
    outcome.right = d.verdict == selection::Verdict::unknown_structure ||
                    (d.verdict == selection::Verdict::missing_effect && !d.remaining_structure.empty());
    return outcome;
  }
  if (hidden.size() > 1) {
    outcome.found_all = finds_all(bench, hidden);
    outcome.right = outcome.found_all;
    return outcome;
  }
  const std::string truth = as_named(hidden.front());
  outcome.right = outcome.named == truth;
  const std::vector<std::string> group = split(outcome.named, '+');
  outcome.found_all = std::find(group.begin(), group.end(), truth) != group.end();
  const Balance balance = catalogue::get(truth.substr(0, truth.find(':'))).identified_on();
  outcome.missing_over_noise = bench.missing_over_noise(balance);
  const selection::Addition added = selection::add(bench.dataset, bench.base, truth, {});
  outcome.holdout_over_floor = *added.after.rmse_holdout / bench.holdout_floor(balance);
  compare_parameters(bench, truth, added, outcome);
  return outcome;
}

}  // namespace flexspline::soak
