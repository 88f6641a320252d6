#include "host/comparison/beside.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "host/comparison/full_rate.hpp"
#include "host/comparison/score.hpp"

namespace flexspline::comparison {
namespace {

using blackbox::LinearModel;
using data::Role;
using estimation::Balance;
using estimation::Prepared;
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

std::vector<double> filtered(const Prepared& prepared, const Record& record, std::vector<double> signal) {
  const double sample_hz = 1.0 / record.sample_s;
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                        std::min(prepared.pipeline.row_cutoff_hz, 0.45 * sample_hz), sample_hz);
  for (const data::Segment& s : record.segments)
    filter.apply_in_place(std::span<double>(signal.data() + s.first, s.last - s.first));
  return signal;
}

// All at full rate; `ahead` samples of the stretch by which inputs are known earlier.
struct Series {
  std::vector<double> output, model_error;
  std::vector<std::vector<double>> inputs;
  std::vector<std::uint8_t> judged;
  std::size_t ahead = 0;
};

void add_stretches(BesideSignal& signal, const Record& record, const Series& series) {
  const std::size_t experiment = signal.experiments.size();
  signal.experiments.push_back(record.name);
  signal.roles.push_back(record.experiment->role);
  const std::size_t step = record.decimation;
  for (const data::Segment& s : record.segments) {
    std::vector<std::size_t> samples;
    for (std::size_t k = (s.first + step - 1) / step * step; k < s.last; k += step) samples.push_back(k);
    if (samples.empty()) continue;
    BesideSignal::Stretch stretch;
    stretch.record.experiment = experiment;
    stretch.record.inputs.resize(series.inputs.size());
    for (std::size_t j = 0; j < samples.size(); ++j) {
      stretch.record.output.push_back(series.output[samples[j]]);
      stretch.record.judged.push_back(series.judged[samples[j]]);
      stretch.model_error.push_back(series.model_error[samples[j]]);
      for (std::size_t u = 0; u < series.inputs.size(); ++u)
        stretch.record.inputs[u].push_back(series.inputs[u][samples[std::min(j + series.ahead, samples.size() - 1)]]);
    }
    signal.sample_s.push_back(record.sample_s * static_cast<double>(step));
    signal.stretches.push_back(std::move(stretch));
  }
}

// An input that is nought throughout (torsion without a sensor on the output) would only count as parameters.
void drop_dead_inputs(BesideSignal& signal) {
  for (std::size_t u = signal.inputs.size(); u-- > 0;) {
    const auto is_dead = [u](const BesideSignal::Stretch& s) {
      const std::vector<double>& x = s.record.inputs[u];
      return std::all_of(x.begin(), x.end(), [](double v) { return v == 0.0; });
    };
    if (!std::all_of(signal.stretches.begin(), signal.stretches.end(), is_dead)) continue;
    signal.inputs.erase(signal.inputs.begin() + static_cast<std::ptrdiff_t>(u));
    for (BesideSignal::Stretch& s : signal.stretches)
      s.record.inputs.erase(s.record.inputs.begin() + static_cast<std::ptrdiff_t>(u));
  }
}

// SquareSums over judged samples beyond the memory of a black box.
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

SquareSums sums_of(const LinearModel& model, const BesideSignal::Stretch& stretch) {
  SquareSums sums{blackbox::errors_of(model, stretch.record), 0.0};
  for (std::size_t k = model.orders.memory(); k < stretch.model_error.size(); ++k)
    if (stretch.record.is_judged(k)) sums.model_squared += stretch.model_error[k] * stretch.model_error[k];
  return sums;
}

BesideResult result_of(const BesideSignal& signal, const blackbox::Specification& asked, const LinearModel& model,
                       const std::vector<std::size_t>& stretches) {
  BesideResult r;
  r.asked = asked.text;
  r.black_box = blackbox::text_of(model.orders);
  r.signal = signal.signal;
  r.unit = signal.unit;
  r.load = signal.load;
  r.inputs = signal.inputs;
  r.parameters = model.parameters;
  r.sample_s = signal.sample_s[stretches[0]];
  r.largest_pole = model.largest_pole();
  r.stable = model.stable();
  std::vector<SquareSums> by_experiment(signal.experiments.size());
  for (const std::size_t i : stretches)
    by_experiment[signal.stretches[i].record.experiment].add(sums_of(model, signal.stretches[i]));
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
  // How far a free run that grows without bound has come by the end of a record says nothing.
  r.rmse = r.stable ? all.box.rms() : kUnknown;
  r.nrmse = r.stable ? all.box.nrms() : kUnknown;
  r.fit_percent = r.stable ? all.box.fit_percent() : kUnknown;
  r.rmse_fit = r.stable ? fit.box.rms() : kUnknown;
  r.rmse_holdout = r.stable ? holdout.box.rms() : kUnknown;
  return r;
}

}  // namespace

BesideSignal balance_signal(const Prepared& prepared, const estimation::BalanceData& data,
                            const estimation::Terms& terms, const std::string& name, const std::string& unit) {
  BesideSignal signal;
  signal.signal = name;
  signal.unit = unit;
  const bool collapsed = data.balance() == Balance::motor && !prepared.torque_measured;
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
    series.judged.assign(record.inputs.size(), 0);
    for (const std::size_t k : record.rows[estimation::index(data.balance())].samples) series.judged[k] = 1;
    for (const NamedInput& input : inputs) {
      std::vector<double> values(record.inputs.size());
      record.inputs.all().each_stretch([&](std::size_t first, auto stretch) {
        std::transform(stretch.begin(), stretch.end(), values.begin() + static_cast<std::ptrdiff_t>(first), input.of);
      });
      series.inputs.push_back(filtered(prepared, record, std::move(values)));
    }
    add_stretches(signal, record, series);
  }
  drop_dead_inputs(signal);
  return signal;
}

void add_free_run_signal(const Prepared& prepared, std::size_t index, const std::string& name, const std::string& unit,
                         const std::vector<double>& measured, const std::vector<double>& model_error,
                         std::vector<BesideSignal>& signals) {
  const Record& record = prepared.records[index];
  if ((name != "motor_velocity" && name != "torque") || record.effort.empty()) return;
  const char* load = record.locked ? "locked" : "free";
  auto at = std::find_if(signals.begin(), signals.end(),
                         [&](const BesideSignal& s) { return s.signal == name && s.load == load; });
  if (at == signals.end()) {
    signals.push_back({name, unit, load, {"effort"}, {}, {}, {}, {}});
    at = std::prev(signals.end());
  }
  Series series;
  series.output = filtered(prepared, record, measured);
  // An error that is not finite stays so along its whole stretch, as does the figure.
  series.model_error = filtered(prepared, record, model_error);
  series.inputs = {filtered(prepared, record, record.effort.values())};
  series.judged.assign(measured.size(), 1);
  const std::vector<std::uint8_t>& masked = record.experiment->masked;
  for (std::size_t k = 0; k < masked.size(); ++k)
    if (masked[k]) series.judged[k] = 0;
  add_stretches(*at, record, series);
}

std::vector<BesideResult> judge_beside(const std::vector<BesideSignal>& signals,
                                       const std::vector<blackbox::Specification>& asked,
                                       std::vector<std::string>& warnings) {
  std::vector<BesideResult> results;
  bool said = false;
  for (const blackbox::Specification& specification : asked)
    for (const BesideSignal& signal : signals) {
      const auto is_fit = [&](std::size_t i) {
        return signal.roles[signal.stretches[i].record.experiment] == Role::fit;
      };
      std::vector<std::size_t> all(signal.stretches.size());
      for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
      if (all.empty()) continue;
      const auto first_fit = std::find_if(all.begin(), all.end(), is_fit);
      const bool has_fit = first_fit != all.end();
      if (!has_fit && !std::exchange(said, true))
        warnings.push_back(
            "black boxes: for some signals all experiments are held out; they are fitted on what they are judged on");
      // A difference equation holds at one sample time.
      const double sample_s = signal.sample_s[has_fit ? *first_fit : 0];
      std::erase_if(all, [&](std::size_t i) { return std::abs(signal.sample_s[i] / sample_s - 1.0) > 1e-6; });
      if (all.size() < signal.stretches.size() && specification.text == asked[0].text)
        warnings.push_back(
            fmt::format("black boxes of {}: experiments sampled otherwise than every {:g} s are left out",
                        signal.signal, sample_s));
      std::vector<blackbox::Record> records;
      for (const std::size_t i : all)
        if (!has_fit || is_fit(i)) records.push_back(signal.stretches[i].record);
      try {
        const blackbox::Orders orders =
            specification.orders ? *specification.orders : blackbox::choose_orders(records, specification.family);
        results.push_back(result_of(signal, specification, blackbox::fit(records, orders), all));
      } catch (const std::invalid_argument& impossible) {
        warnings.push_back(fmt::format("--beside {}: none for {}{}{}: {}", specification.text, signal.signal,
                                       signal.load.empty() ? "" : " ", signal.load, impossible.what()));
      }
    }
  return results;
}

}  // namespace flexspline::comparison
