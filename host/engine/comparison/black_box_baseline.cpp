#include "host/engine/comparison/black_box_baseline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "host/engine/comparison/full_rate.hpp"
#include "host/engine/comparison/score.hpp"

namespace flexspline::comparison {
namespace {

using blackbox::LinearModel;
using data::Role;
using estimation::Balance;
using estimation::PreparedData;
using estimation::Record;

using Input = double (*)(const effects::Inputs<estimation::Real>&);

struct NamedInput {
  const char* name;
  Input of;
};

constexpr NamedInput kMotor[] = {{"acceleration", [](const auto& in) { return in.acceleration; }},
                                 {"velocity", [](const auto& in) { return in.velocity; }},
                                 {"torsion", [](const auto& in) { return in.torsion; }}};
constexpr NamedInput kTransmission[] = {{"torsion", [](const auto& in) { return in.torsion; }},
                                        {"torsion_rate", [](const auto& in) { return in.torsion_rate; }}};
constexpr NamedInput kLoad[] = {{"output_acceleration", [](const auto& in) { return in.output_acceleration; }},
                                {"output_velocity", [](const auto& in) { return in.output_velocity; }}};

std::span<const NamedInput> inputs_of(Balance balance, bool collapsed) {
  if (balance == Balance::transmission) return kTransmission;
  if (balance == Balance::load) return kLoad;
  return std::span(kMotor).first(collapsed ? 3 : 2);
}

std::vector<double> filtered(const PreparedData& prepared, const Record& record, std::vector<double> signal) {
  const double sample_hz = 1.0 / record.sample_s;
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                        std::min(prepared.pipeline.row_cutoff_hz, 0.45 * sample_hz), sample_hz);
  for (const data::Segment& s : record.segments)
    filter.apply_in_place(std::span<double>(signal.data() + s.first, s.last - s.first));
  return signal;
}

// Signals at full rate; inputs are known `ahead` samples earlier.
struct Series {
  std::vector<double> output, model_error;
  std::vector<std::vector<double>> inputs;
  std::vector<std::uint8_t> scored;
  std::size_t ahead = 0;
};

void add_segments(BaselineSignal& signal, const Record& record, const Series& series) {
  const std::size_t experiment = signal.experiments.size();
  signal.experiments.push_back(record.name);
  signal.roles.push_back(record.experiment->role);
  const std::size_t step = record.decimation;
  for (const data::Segment& s : record.segments) {
    std::vector<std::size_t> samples;
    for (std::size_t k = (s.first + step - 1) / step * step; k < s.last; k += step) samples.push_back(k);
    if (samples.empty()) continue;
    BaselineSignal::Segment segment;
    segment.record.experiment = experiment;
    segment.record.inputs.resize(series.inputs.size());
    for (std::size_t j = 0; j < samples.size(); ++j) {
      segment.record.output.push_back(series.output[samples[j]]);
      segment.record.scored.push_back(series.scored[samples[j]]);
      segment.model_error.push_back(series.model_error[samples[j]]);
      for (std::size_t u = 0; u < series.inputs.size(); ++u)
        segment.record.inputs[u].push_back(series.inputs[u][samples[std::min(j + series.ahead, samples.size() - 1)]]);
    }
    signal.sample_s.push_back(record.sample_s * static_cast<double>(step));
    signal.segments.push_back(std::move(segment));
  }
}

// An input that is zero throughout (torsion without a sensor on the output) would only add parameters without effect.
void drop_dead_inputs(BaselineSignal& signal) {
  for (std::size_t u = signal.inputs.size(); u-- > 0;) {
    const auto is_dead = [u](const BaselineSignal::Segment& s) {
      const std::vector<double>& x = s.record.inputs[u];
      return std::all_of(x.begin(), x.end(), [](double v) { return v == 0.0; });
    };
    if (!std::all_of(signal.segments.begin(), signal.segments.end(), is_dead)) continue;
    signal.inputs.erase(signal.inputs.begin() + static_cast<std::ptrdiff_t>(u));
    for (BaselineSignal::Segment& s : signal.segments)
      s.record.inputs.erase(s.record.inputs.begin() + static_cast<std::ptrdiff_t>(u));
  }
}

// SquareSums over scored samples beyond the memory of a black box.
struct SquareSums {
  blackbox::Errors box;
  double model_squared = 0.0;

  void add(const SquareSums& other) {
    box.add(other.box);
    model_squared += other.model_squared;
  }
  double model_rms() const {
    const double rms = box.samples ? std::sqrt(model_squared / static_cast<double>(box.samples)) : kUnknown;
    return std::isfinite(rms) ? rms : kUnknown;
  }
};

SquareSums sums_of(const LinearModel& model, const BaselineSignal::Segment& segment) {
  SquareSums sums{blackbox::errors_of(model, segment.record), 0.0};
  for (std::size_t k = model.orders.memory(); k < segment.model_error.size(); ++k)
    if (segment.record.is_scored(k)) sums.model_squared += segment.model_error[k] * segment.model_error[k];
  return sums;
}

BaselineResult result_of(const BaselineSignal& signal, const blackbox::Specification& requested,
                         const LinearModel& model, const std::vector<std::size_t>& segments) {
  BaselineResult r;
  r.requested = requested.text;
  r.black_box = blackbox::text_of(model.orders);
  r.signal = signal.signal;
  r.unit = signal.unit;
  r.load = signal.load;
  r.inputs = signal.inputs;
  r.parameters = model.parameters;
  r.sample_s = signal.sample_s[segments[0]];
  r.largest_pole = model.largest_pole();
  r.stable = model.stable();
  std::vector<SquareSums> by_experiment(signal.experiments.size());
  for (const std::size_t i : segments)
    by_experiment[signal.segments[i].record.experiment].add(sums_of(model, signal.segments[i]));
  SquareSums all, fit, holdout;
  for (std::size_t e = 0; e < by_experiment.size(); ++e) {
    const SquareSums& sums = by_experiment[e];
    if (sums.box.samples == 0) continue;
    all.add(sums);
    (signal.roles[e] == Role::fit ? fit : holdout).add(sums);
    r.experiments.push_back(
        {signal.experiments[e], signal.roles[e], r.stable ? sums.box.rms() : kUnknown, sums.model_rms()});
  }
  r.samples = all.box.samples;
  r.rmse_one_step = all.box.rms_one_step();
  r.model_rmse = all.model_rms();
  r.model_rmse_holdout = holdout.model_rms();
  // How far a free run that grows without bound has come by the end of a record has no meaning.
  r.rmse = r.stable ? all.box.rms() : kUnknown;
  r.nrmse = r.stable ? all.box.nrms() : kUnknown;
  r.fit_percent = r.stable ? all.box.fit_percent() : kUnknown;
  r.rmse_fit = r.stable ? fit.box.rms() : kUnknown;
  r.rmse_holdout = r.stable ? holdout.box.rms() : kUnknown;
  return r;
}

}  // namespace

BaselineSignal balance_signal(const PreparedData& prepared, const estimation::RegressionProblem& data,
                              const estimation::Terms& terms, const std::string& name, const std::string& unit) {
  BaselineSignal signal;
  signal.signal = name;
  signal.unit = unit;
  const bool collapsed = data.balance() == Balance::motor && !prepared.output_signals.torque;
  const std::span<const NamedInput> inputs = inputs_of(data.balance(), collapsed);
  for (const NamedInput& input : inputs) signal.inputs.emplace_back(input.name);
  for (const estimation::RowRange& range : data.records()) {
    const Record& record = prepared.records[range.record];
    const auto full = full_rate(prepared, record, data.balance(), terms);
    if (!full) continue;
    Series series;
    series.ahead = 1;
    series.output = full->target;
    series.model_error = full->residual;
    series.scored.assign(record.inputs.size(), 0);
    for (const std::size_t k : record.rows[estimation::index(data.balance())].samples) series.scored[k] = 1;
    for (const NamedInput& input : inputs) {
      std::vector<double> values(record.inputs.size());
      record.inputs.all().each_block([&](std::size_t first, auto segment) {
        std::transform(segment.begin(), segment.end(), values.begin() + static_cast<std::ptrdiff_t>(first), input.of);
      });
      series.inputs.push_back(filtered(prepared, record, std::move(values)));
    }
    add_segments(signal, record, series);
  }
  drop_dead_inputs(signal);
  return signal;
}

void add_free_run_signal(const PreparedData& prepared, std::size_t index, const std::string& name,
                         const std::string& unit, const std::vector<double>& measured,
                         const std::vector<double>& model_error, std::vector<BaselineSignal>& signals) {
  const Record& record = prepared.records[index];
  if ((name != "motor_velocity" && name != "torque") || record.effort.empty()) return;
  const char* load = record.locked ? "locked" : "free";
  auto at = std::find_if(signals.begin(), signals.end(),
                         [&](const BaselineSignal& s) { return s.signal == name && s.load == load; });
  if (at == signals.end()) {
    signals.push_back({name, unit, load, {"effort"}, {}, {}, {}, {}});
    at = std::prev(signals.end());
  }
  Series series;
  series.output = filtered(prepared, record, measured);
  // A free run that diverges makes the error of the whole segment infinite.
  series.model_error = filtered(prepared, record, model_error);
  series.inputs = {filtered(prepared, record, record.effort.values())};
  series.scored.assign(measured.size(), 1);
  const std::vector<std::uint8_t>& masked = record.experiment->masked;
  for (std::size_t k = 0; k < masked.size(); ++k)
    if (masked[k]) series.scored[k] = 0;
  add_segments(*at, record, series);
}

std::vector<BaselineResult> fit_baselines(const std::vector<BaselineSignal>& signals,
                                          const std::vector<blackbox::Specification>& requested,
                                          std::vector<std::string>& warnings) {
  std::vector<BaselineResult> results;
  bool printed = false;
  for (const blackbox::Specification& specification : requested)
    for (const BaselineSignal& signal : signals) {
      const auto is_fit = [&](std::size_t i) {
        return signal.roles[signal.segments[i].record.experiment] == Role::fit;
      };
      std::vector<std::size_t> all(signal.segments.size());
      for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
      if (all.empty()) continue;
      const auto first_fit = std::find_if(all.begin(), all.end(), is_fit);
      const bool has_fit = first_fit != all.end();
      if (!has_fit && !std::exchange(printed, true))
        warnings.push_back(
            "black boxes: for some signals all experiments are held out; they are fitted and scored on the same data");
      // A difference equation holds at one sample time.
      const double sample_s = signal.sample_s[has_fit ? *first_fit : 0];
      std::erase_if(all, [&](std::size_t i) { return std::abs(signal.sample_s[i] / sample_s - 1.0) > 1e-6; });
      if (all.size() < signal.segments.size() && specification.text == requested[0].text)
        warnings.push_back(
            fmt::format("black boxes of {}: experiments sampled otherwise than every {:g} s are left out",
                        signal.signal, sample_s));
      std::vector<blackbox::Record> records;
      for (const std::size_t i : all)
        if (!has_fit || is_fit(i)) records.push_back(signal.segments[i].record);
      try {
        const blackbox::Orders orders =
            specification.orders ? *specification.orders : blackbox::choose_orders(records, specification.family);
        results.push_back(result_of(signal, specification, blackbox::fit(records, orders), all));
      } catch (const std::invalid_argument& impossible) {
        warnings.push_back(fmt::format("--baseline {}: none for {}{}{}: {}", specification.text, signal.signal,
                                       signal.load.empty() ? "" : " ", signal.load, impossible.what()));
      }
    }
  return results;
}

}  // namespace flexspline::comparison
