#include "host/engine/sensitivity/sensitivity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <complex>
#include <exception>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "host/engine/comparison/compare.hpp"
#include "host/engine/comparison/free_run.hpp"
#include "host/engine/comparison/score.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/sensitivity/lines.hpp"

namespace flexspline::sensitivity {
namespace {

using data::Experiment;
using estimation::Balance;
using estimation::PreparedData;
using estimation::Record;
using estimation::RegressionProblem;

// Less of a signal's variance in a line does not test the model there.
constexpr double kLeastShareOfLine = 0.01;

// All samples of one signal of a model over experiments, and its sines.
struct PooledErrors {
  SignalError error;
  comparison::Score score;
  bool diverged = false;            // a free run among them diverged
  std::complex<double> across = 0;  // sum of conj(measured) simulated
  double measured_squared = 0.0;
  double largest_growth = 0.0;
};

Response response_of(double frequency_hz, std::complex<double> simulated_over_measured) {
  return {frequency_hz, std::abs(simulated_over_measured),
          std::arg(simulated_over_measured) * 180.0 / std::numbers::pi};
}

double growth_of(const SignalError& changed, const SignalError* full) {
  if (!full || !std::isfinite(full->nrmse)) return kUnknown;
  if (std::isnan(changed.rmse)) return std::numeric_limits<double>::infinity();
  return changed.nrmse - full->nrmse;
}

const SignalError* find_in(const std::vector<SignalError>& signals, std::string_view signal, std::string_view load) {
  for (const SignalError& s : signals)
    if (s.signal == signal && s.load == load) return &s;
  return nullptr;
}

class Analysis {
 public:
  Analysis(const data::Dataset& dataset, const model::Model& model, const Options& options)
      : dataset_(dataset), options_(options), model_(model) {
    for (const Change& change : options.more) require_known(model, change);
    model_.drive = estimation::reconcile(model.drive, dataset, result_.warnings);
    result_.refit = options.refit;
    if (options.refit) {
      const auto fitted = estimation::identify(dataset, model_, options.pipeline);
      model_ = fitted->model;
      result_.warnings.insert(result_.warnings.end(), fitted->warnings.begin(), fitted->warnings.end());
    }
    comparison::require_values(model_);
    std::vector<const Experiment*> all, fit;
    for (const Experiment& e : dataset.experiments) {
      all.push_back(&e);
      if (e.role == data::Role::fit) fit.push_back(&e);
    }
    prepared_ = estimation::prepare(fit.empty() ? all : fit, model_, options.pipeline);
    if (!fit.empty() && fit.size() < all.size())
      prepared_ = estimation::prepare_with(all, model_.drive, prepared_.pipeline);
    estimation::take_torque_where_read(prepared_, estimation::terms_of(model_));
    result_.pipeline = prepared_.pipeline;
    find_balances();
    find_lines();
  }

  Sensitivity all() {
    std::vector<Change> changes = usual_changes(model_);
    changes.insert(changes.end(), options_.more.begin(), options_.more.end());
    for (const Change& change : options_.more)
      apply(model_, change);  // what is out of bounds is reported before the work
    {
      Worker worker(*this);
      result_.full = worker.evaluate(model_, std::nullopt);
    }
    if (!result_.full.note.empty()) result_.warnings.push_back(result_.full.note);
    result_.variants.resize(changes.size());
    run_all(changes);
    std::stable_sort(result_.variants.begin(), result_.variants.end(), [](const Variant& a, const Variant& b) {
      // What is not known comes last.
      if (std::isnan(a.growth) || std::isnan(b.growth)) return !std::isnan(a.growth) && std::isnan(b.growth);
      return a.growth > b.growth;
    });
    return std::move(result_);
  }

 private:
  // What one thread needs for itself: columns of the balances are kept from model to model.
  class Worker {
   public:
    explicit Worker(const Analysis& analysis) : analysis_(analysis) {
      for (const Balance balance : analysis.balances_) data_.emplace_back(analysis.prepared_, balance);
    }

    Variant changed(const Change& change) {
      try {
        ChangedModel changed = apply(analysis_.model_, change);
        if (analysis_.options_.refit)
          changed.model = estimation::identify(analysis_.dataset_, changed.model, analysis_.options_.pipeline)->model;
        Variant variant = evaluate(changed.model, change);
        variant.also_left_out = std::move(changed.also_left_out);
        return variant;
      } catch (const model::ModelError& impossible) {
        return none(change, impossible.what());
      } catch (const data::DataError& unusable) {
        return none(change, unusable.what());
      }
    }

    Variant evaluate(const model::Model& model, const std::optional<Change>& change) {
      Variant variant;
      variant.change = change;
      for (const Experiment& e : analysis_.dataset_.experiments)
        variant.experiments.push_back({e.name, e.role, e.load == data::Load::locked ? "locked" : "free", {}});
      std::vector<PooledErrors> together;
      const estimation::Terms terms = estimation::terms_of(model);
      for (const RegressionProblem& data : data_) inverse(data, terms, variant, together);
      for (std::size_t i = 0; i < analysis_.prepared_.records.size(); ++i) free_run(i, model, variant, together);
      for (PooledErrors& t : together) {
        SignalError& s = t.error;
        s.samples = t.score.samples();
        if (!t.diverged) {
          s.rmse = t.score.rmse();
          s.nrmse = t.score.nrmse();
          if (t.measured_squared > 0.0) s.response = response_of(kUnknown, t.across / t.measured_squared);
        }
        if (change) s.growth = growth_of(s, analysis_.result_.full.find(s.signal, s.load));
        if (!s.drifts() && !std::isnan(s.growth))
          variant.growth = std::isnan(variant.growth) ? s.growth : std::max(variant.growth, s.growth);
        variant.overall.push_back(std::move(s));
      }
      // Warnings that the full model has given already.
      if (change && variant.note == analysis_.result_.full.note) variant.note.clear();
      return variant;
    }

   private:
    static Variant none(const Change& change, std::string why) {
      Variant variant;
      variant.change = change;
      variant.note = std::move(why);
      return variant;
    }

    void inverse(const RegressionProblem& data, const estimation::Terms& terms, Variant& variant,
                 std::vector<PooledErrors>& together) {
      const Eigen::VectorXd residual = data.residual(terms);
      for (const estimation::RowRange& range : data.records()) {
        comparison::Score score;
        for (Eigen::Index k = range.first; k < range.last; ++k) score.add(data.target()[k], residual[k]);
        SignalError s;
        s.signal = selection::balance_signal(data.balance());
        s.unit = data::unit_of(data::Column::torque, analysis_.model_.drive.axis);
        keep(std::move(s), score, false, range.record, variant, together);
      }
    }

    void free_run(std::size_t i, const model::Model& model, Variant& variant, std::vector<PooledErrors>& together) {
      const Record& record = analysis_.prepared_.records[i];
      std::vector<comparison::FreeRunSignal> signals;
      try {
        signals = comparison::free_run_signals(analysis_.prepared_, i, simulation::run(model, *record.experiment));
      } catch (const std::exception& impossible) {
        // A model that cannot be run, or a record without effort: neither stops the others.
        variant.note = fmt::format("no free run: {}", impossible.what());
        return;
      }
      for (const comparison::FreeRunSignal& signal : signals) score_free_run(i, signal, variant, together);
    }

    void score_free_run(std::size_t i, const comparison::FreeRunSignal& signal, Variant& variant,
                        std::vector<PooledErrors>& together) {
      const Record& record = analysis_.prepared_.records[i];
      const Experiment& e = *record.experiment;
      comparison::Score score;
      bool diverged = false;
      for (const data::Segment& s : record.segments)
        for (std::size_t k = s.first; k < s.last; ++k) {
          if (!e.masked.empty() && e.masked[k]) continue;
          const double error = signal.measured[k] - signal.simulated[k];
          diverged = diverged || !std::isfinite(error);
          score.add(signal.measured[k], error);
        }
      if (score.samples() == 0) return;
      SignalError s;
      s.signal = signal.name;
      s.load = variant.experiments[i].load;
      s.unit = data::unit_of(signal.column, analysis_.model_.drive.axis);
      std::complex<double> across = 0.0;
      double measured_squared = 0.0;
      const Lines& lines = analysis_.lines_[i];
      if (!diverged) {
        const std::size_t size = lines.segment.last - lines.segment.first;
        const double sample_hz = 1.0 / e.sample_s;
        for (const double frequency_hz : lines.frequencies_hz) {
          const Sine measured = sine_at({signal.measured.data() + lines.segment.first, size}, sample_hz, frequency_hz);
          if (!(measured.share >= kLeastShareOfLine)) continue;
          const Sine simulated =
              sine_at({signal.simulated.data() + lines.segment.first, size}, sample_hz, frequency_hz);
          s.lines.push_back(response_of(frequency_hz, simulated.amplitude / measured.amplitude));
          if (frequency_hz != lines.frequencies_hz.front()) continue;
          s.response = s.lines.back();
          across = std::conj(measured.amplitude) * simulated.amplitude;
          measured_squared = std::norm(measured.amplitude);
        }
      }
      PooledErrors& t = keep(std::move(s), score, diverged, i, variant, together);
      t.across += across;
      t.measured_squared += measured_squared;
    }

    // Adds one signal of one experiment.
    PooledErrors& keep(SignalError s, const comparison::Score& score, bool diverged, std::size_t experiment,
                       Variant& variant, std::vector<PooledErrors>& together) const {
      auto t = std::find_if(together.begin(), together.end(), [&](const PooledErrors& other) {
        return other.error.signal == s.signal && other.error.load == s.load;
      });
      if (t == together.end()) {
        together.emplace_back();
        t = together.end() - 1;
        t->error.signal = s.signal;
        t->error.load = s.load;
        t->error.unit = s.unit;
      }
      t->score.add(score);
      t->diverged = t->diverged || diverged;
      s.samples = score.samples();
      if (!diverged) {
        s.rmse = score.rmse();
        s.nrmse = score.nrmse();
      }
      if (variant.change) {
        s.growth = growth_of(s, find_in(analysis_.result_.full.experiments[experiment].signals, s.signal, s.load));
        // A drive that is off is at rest: any motion is many times its own.
        if (!analysis_.prepared_.records[experiment].at_rest && s.growth > t->largest_growth) {
          t->largest_growth = s.growth;
          t->error.worst_experiment = variant.experiments[experiment].name;
        }
      }
      variant.experiments[experiment].signals.push_back(std::move(s));
      return *t;
    }

    const Analysis& analysis_;
    std::vector<RegressionProblem> data_;
  };

  struct Lines {
    data::Segment segment;
    std::vector<double> frequencies_hz;
  };

  void find_balances() {
    const estimation::Terms terms = estimation::terms_of(model_);
    for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
      if (balance != Balance::motor && !prepared_.output_signals.torque) continue;
      if (estimation::terms_on(terms, balance, prepared_.output_signals).empty()) continue;
      if (!RegressionProblem(prepared_, balance).empty()) balances_.push_back(balance);
    }
    if (balances_.empty())
      throw data::DataError({{data::Severity::error, "missing_column", "", 0, "",
                              "no torque balance of the model can be formed from these columns",
                              "record current (or torque) and motor position together"}});
  }

  // Of the motor's measured velocity, else of the output's, else of the effort.
  void find_lines() {
    for (const Record& record : prepared_.records) {
      Lines lines;
      for (const data::Segment& s : record.segments)
        if (s.last - s.first > lines.segment.last - lines.segment.first) lines.segment = s;
      std::vector<double> motion;
      for (std::size_t k = lines.segment.first; k < lines.segment.last && !record.at_rest; ++k) {
        if (record.has_motor_motion)
          motion.push_back(record.inputs.velocity_at(k));
        else if (record.has_output_motion && !record.locked)
          motion.push_back(record.inputs.output_velocity_at(k));
        else if (!record.effort.empty())
          motion.push_back(record.effort[k]);
      }
      lines.frequencies_hz = motion_lines(motion, 1.0 / record.sample_s, prepared_.pipeline.row_cutoff_hz);
      lines_.push_back(std::move(lines));
    }
  }

  // Each change is evaluated by itself and has its own place, so that the answer is the same with any number of
  // threads.
  void run_all(const std::vector<Change>& changes) {
    std::atomic<std::size_t> next = 0;
    std::size_t done = 0;
    std::mutex guard;
    const std::size_t wanted = options_.threads > 0 ? options_.threads : std::thread::hardware_concurrency();
    estimation::in_parallel(std::min(std::max<std::size_t>(wanted, 1), changes.size()), [&](std::size_t) {
      Worker worker(*this);
      for (std::size_t i = next++; i < changes.size(); i = next++) {
        Variant variant = worker.changed(changes[i]);
        const std::lock_guard lock(guard);
        result_.variants[i] = std::move(variant);
        if (options_.progress) options_.progress(++done, changes.size());
      }
    });
  }

  const data::Dataset& dataset_;
  const Options& options_;
  model::Model model_;
  PreparedData prepared_;
  std::vector<Balance> balances_;
  std::vector<Lines> lines_;  // one a record
  Sensitivity result_;
};

}  // namespace

const SignalError* Variant::find(std::string_view signal, std::string_view load) const {
  return find_in(overall, signal, load);
}

Sensitivity analyse(const data::Dataset& dataset, const model::Model& model, const Options& options) {
  return Analysis(dataset, model, options).all();
}

}  // namespace flexspline::sensitivity
