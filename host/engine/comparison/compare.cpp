#include "host/engine/comparison/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "host/engine/comparison/free_run.hpp"
#include "host/engine/comparison/full_rate.hpp"
#include "host/engine/comparison/noise_floor.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/comparison/score.hpp"
#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/estimation/record_constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "host/physics/simulation/simulation.hpp"

namespace flexspline::comparison {
namespace {

using data::Column;
using data::Experiment;
using estimation::Balance;
using estimation::PreparedData;
using estimation::Record;
using estimation::RegressionProblem;

constexpr std::size_t kFewestBins = 12;
constexpr std::size_t kMostBins = 24;
constexpr std::size_t kFewestInRegion = 30;
constexpr std::size_t kRowsPerBin = 100;

const char* signal_name(Balance balance) {
  return balance == Balance::motor          ? "motor_balance"
         : balance == Balance::transmission ? "transmission_balance"
                                            : "load_balance";
}

// All samples of one signal, over experiments.
struct PooledScores {
  std::string signal;
  Score score;
  HInfinityNorm h_infinity;  // the largest
  std::size_t masked = 0;
  bool diverged_or_empty = false;  // a free run among them diverged
};

class Comparer {
 public:
  Comparer(const data::Dataset& dataset, const model::Model& model, const estimation::PipelineOptions& options,
           const std::vector<blackbox::Specification>& baselines)
      : model_(model), baseline_specifications_(baselines) {
    require_values(model);
    model_.drive = estimation::reconcile(model.drive, dataset, result_.warnings);
    terms_ = estimation::terms_of(model_);
    for (const Experiment& e : dataset.experiments) {
      all_.push_back(&e);
      result_.experiments.push_back({e.name, e.role, {}});
    }
    prepared_ = estimation::prepare_all(dataset, model_, options);
    estimation::take_torque_where_read(prepared_, terms_);
    result_.pipeline = prepared_.pipeline;
  }

  Comparison all(const CompareOptions& extent) {
    for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
      if (balance != Balance::motor && !prepared_.output_signals.torque) continue;
      if (estimation::terms_on(terms_, balance, prepared_.output_signals).empty()) continue;
      RegressionProblem data(prepared_, balance);
      if (data.empty()) continue;
      if (estimation::refine_record_constants(prepared_, data, terms_, {}, Eigen::VectorXd::Ones(data.rows())))
        data = RegressionProblem(prepared_, balance);
      inverse(data, extent.regions_and_gains);
    }
    if (result_.experiments.empty() || together_.empty())
      throw data::DataError({{data::Severity::error, "missing_column", "", 0, "",
                              "no torque balance of the model can be formed from these columns",
                              "record current (or torque) and motor position together"}});
    for (std::size_t i = 0; extent.free_runs && i < all_.size(); ++i) free_run(i);
    for (const PooledScores& t : together_) {
      if (std::any_of(result_.overall.begin(), result_.overall.end(), [&](auto& s) { return s.signal == t.signal; }))
        continue;
      SignalResult s = result_of(t.signal, t.score, t.masked, t.diverged_or_empty);
      s.h_infinity = t.h_infinity;
      result_.overall.push_back(std::move(s));
    }
    warn_of_free_runs();
    result_.baselines = fit_baselines(baseline_signals_, baseline_specifications_, result_.warnings);
    return std::move(result_);
  }

 private:
  // A free run whose velocity is further from the measured one than its mean is says nothing about the model.
  void warn_of_free_runs() {
    const SignalResult* velocity = result_.find_overall("motor_velocity");
    if (velocity == nullptr || !(velocity->nrmse > 1.0)) return;
    result_.warnings.push_back(fmt::format(
        "free runs miss the measured velocity by {:.0f} % of its standard deviation. They simulate the "
        "drive from its effort alone, with nothing at the output but what the model states: where a brake, "
        "a load or a hand acts there, or where little friction holds the axis, compare the balances instead",
        100.0 * velocity->nrmse));
  }

  std::string unit_of(const std::string& signal) const {
    const data::Axis axis = model_.drive.axis;
    if (signal == "motor_velocity") return data::unit_of(Column::motor_velocity, axis);
    if (signal == "motor_position") return data::unit_of(Column::motor_position, axis);
    if (signal == "output_position") return data::unit_of(Column::output_position, axis);
    return data::unit_of(Column::torque, axis);
  }

  SignalResult result_of(const std::string& signal, const Score& score, std::size_t masked,
                         bool diverged_or_empty) const {
    SignalResult s;
    s.signal = signal;
    s.unit = unit_of(signal);
    s.samples = score.samples();
    s.masked = masked;
    s.rmse = diverged_or_empty ? kUnknown : score.rmse();
    s.nrmse = diverged_or_empty ? kUnknown : score.nrmse();
    s.fit_percent = diverged_or_empty ? kUnknown : score.fit_percent();
    s.vaf_percent = diverged_or_empty ? kUnknown : score.vaf_percent();
    s.max_abs = diverged_or_empty ? kUnknown : score.max_abs();
    return s;
  }

  PooledScores& together(const std::string& signal) {
    for (PooledScores& t : together_)
      if (t.signal == signal) return t;
    together_.push_back({signal, {}, {}, 0, false});
    return together_.back();
  }

  void keep(std::size_t experiment, SignalResult s, const Score& score) {
    PooledScores& t = together(s.signal);
    t.score.add(score);
    t.masked += s.masked;
    t.diverged_or_empty = t.diverged_or_empty || std::isnan(s.rmse);
    if (!(t.h_infinity.value >= s.h_infinity.value) && std::isfinite(s.h_infinity.value)) t.h_infinity = s.h_infinity;
    result_.experiments[experiment].signals.push_back(std::move(s));
  }

  // Of the balance at full rate, by range of its samples.
  std::vector<HInfinityNorm> h_infinity_norms(const RegressionProblem& data) const {
    std::vector<HInfinityNorm> norms(data.records().size());
    estimation::in_parallel(norms.size(), [&](std::size_t i) {
      const Record& record = prepared_.records[data.records()[i].record];
      // A drive that is off excites no lines.
      const auto full = record.at_rest ? std::nullopt : full_rate(prepared_, record, data.balance(), terms_);
      if (!full) return;
      norms[i] = h_infinity_norm(full->target, full->residual, record.segments, 1.0 / record.sample_s,
                                 prepared_.pipeline.row_cutoff_hz);
    });
    return norms;
  }

  void inverse(const RegressionProblem& data, bool regions_and_gains) {
    const Eigen::VectorXd residual = data.residual(terms_);
    const std::vector<NoiseFloor> floors = noise_floors(data, terms_, all_, model_.drive);
    const std::string signal = signal_name(data.balance());
    const bool collapsed = data.balance() == Balance::motor && !prepared_.output_signals.torque;
    Eigen::VectorXd floor_squared = Eigen::VectorXd::Constant(data.rows(), kUnknown);
    const std::vector<HInfinityNorm> norms =
        regions_and_gains ? h_infinity_norms(data) : std::vector<HInfinityNorm>(data.records().size());
    for (std::size_t i = 0; i < data.records().size(); ++i) {
      const estimation::RowRange& range = data.records()[i];
      const Record& record = prepared_.records[range.record];
      Score score;
      for (Eigen::Index k = range.first; k < range.last; ++k) score.add(data.target()[k], residual[k]);
      SignalResult s = result_of(signal, score, record.rows[estimation::index(data.balance())].masked, false);
      s.noise_floor = floors[i].rmse;
      s.noise_floor_from = floors[i].from;
      s.collapsed = collapsed;
      s.h_infinity = norms[i];
      if (floors[i].rmse)
        floor_squared.segment(range.first, range.size()).setConstant(*floors[i].rmse * *floors[i].rmse);
      keep(range.record, std::move(s), score);
    }
    if (!baseline_specifications_.empty())
      baseline_signals_.push_back(balance_signal(prepared_, data, terms_, signal, unit_of(signal)));
    const PooledScores& t = together(signal);
    SignalResult overall = result_of(signal, t.score, t.masked, false);
    overall.h_infinity = t.h_infinity;
    const NoiseFloor floor = pooled(floors, data.records());
    overall.noise_floor = floor.rmse;
    overall.noise_floor_from = floor.from;
    overall.collapsed = collapsed;
    result_.overall.push_back(std::move(overall));
    if (regions_and_gains) add_regions(data, signal, residual, floor_squared);
  }

  void add_regions(const RegressionProblem& data, const std::string& signal, const Eigen::VectorXd& residual,
                   const Eigen::VectorXd& floor_squared) {
    // A short record has few samples; its regions are wider then, never too small for a test.
    const auto rows = static_cast<std::size_t>(data.rows());
    const std::size_t wanted = std::min(std::clamp(rows / kRowsPerBin, kFewestBins, kMostBins),
                                        std::max<std::size_t>(1, rows / kFewestInRegion));
    for (const SampleVariable& variable : sample_variables(data, model_.drive.axis)) {
      const Bins bins = equal_count_bins(variable.values, wanted, variable.narrowest_bin);
      struct Sums {
        double error = 0.0, squared = 0.0, floor = 0.0;
        std::size_t rows = 0;
      };
      std::vector<Sums> sums(bins.count());
      for (Eigen::Index k = 0; k < residual.size(); ++k) {
        const int bin = bins.bin[static_cast<std::size_t>(k)];
        if (bin < 0) continue;
        Sums& b = sums[static_cast<std::size_t>(bin)];
        b.error += residual[k];
        b.squared += residual[k] * residual[k];
        b.floor += floor_squared[k];
        ++b.rows;
      }
      for (std::size_t b = 0; b < sums.size(); ++b) {
        if (sums[b].rows < kFewestInRegion) continue;
        const auto n = static_cast<double>(sums[b].rows);
        const double floor = std::sqrt(sums[b].floor / n);
        Region region{signal,        unit_of(signal),   variable.name,
                      variable.unit, bins.edges[b],     bins.edges[b + 1],
                      sums[b].rows,  sums[b].error / n, std::sqrt(sums[b].squared / n),
                      kUnknown};
        if (floor > 0.0) region.excess = region.rmse / floor;
        result_.regions.push_back(std::move(region));
      }
    }
  }

  void free_run(std::size_t i) {
    const Experiment& e = *all_[i];
    simulation::FreeRun run;
    try {
      run = simulation::run(model_, e);
    } catch (const simulation::ModelIncomplete& incomplete) {
      // The same for every experiment.
      if (i == 0) result_.warnings.push_back(fmt::format("no free run: {}", incomplete.what()));
      return;
    } catch (const std::invalid_argument& unusable) {
      result_.warnings.push_back(fmt::format("no free run: {}", unusable.what()));
      return;
    }
    const auto signals = free_run_signals(prepared_, i, std::move(run));
    for (const FreeRunSignal& signal : signals) add_free_run(i, signal.name, signal.measured, signal.simulated);
  }

  void add_free_run(std::size_t i, const std::string& signal, const std::vector<double>& measured,
                    const std::vector<double>& simulated) {
    const Experiment& e = *all_[i];
    const Record& record = prepared_.records[i];
    Score score;
    std::vector<double> error(measured.size(), 0.0);
    std::size_t masked = 0;
    bool diverged = false;
    for (const data::Segment& s : record.segments)
      for (std::size_t k = s.first; k < s.last; ++k) {
        error[k] = measured[k] - simulated[k];
        if (!e.masked.empty() && e.masked[k]) {
          ++masked;
          continue;
        }
        diverged = diverged || !std::isfinite(error[k]);
        score.add(measured[k], error[k]);
      }
    if (score.samples() == 0) return;
    if (!baseline_specifications_.empty())
      add_free_run_signal(prepared_, i, signal, unit_of(signal), measured, error, baseline_signals_);
    SignalResult result = result_of(signal, score, masked, diverged);
    if (diverged)
      result_.warnings.push_back(fmt::format("{}: the free run diverges ({})", e.name, signal));
    else if (!record.at_rest)
      result.h_infinity =
          h_infinity_norm(measured, error, record.segments, 1.0 / e.sample_s, prepared_.pipeline.row_cutoff_hz);
    keep(i, std::move(result), score);
  }

  model::Model model_;
  estimation::Terms terms_;
  std::vector<const Experiment*> all_;
  PreparedData prepared_;
  std::vector<PooledScores> together_;
  std::vector<blackbox::Specification> baseline_specifications_;
  std::vector<BaselineSignal> baseline_signals_;
  Comparison result_;
};

}  // namespace

void require_values(const model::Model& model) {
  std::string missing;
  for (const model::Effect& effect : model.effects)
    for (const std::string& name : catalogue::missing_values(effect))
      missing += fmt::format("{}{}.{}", missing.empty() ? "" : ", ", effect.id, name);
  if (!missing.empty())
    throw model::ModelError(fmt::format(
        "model \"{}\" cannot be compared: no value for {}; identify first, or write the values into the model file",
        model.name, missing));
}

const SignalResult* Comparison::find_overall(std::string_view signal) const {
  for (const SignalResult& s : overall)
    if (s.signal == signal) return &s;
  return nullptr;
}

Comparison compare(const data::Dataset& dataset, const model::Model& model, const estimation::PipelineOptions& options,
                   const std::vector<blackbox::Specification>& baselines, CompareOptions extent) {
  return Comparer(dataset, model, options, baselines).all(extent);
}

}  // namespace flexspline::comparison
