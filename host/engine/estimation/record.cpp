#include "host/engine/estimation/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "host/common/signals/cutoff.hpp"
#include "host/engine/estimation/cancellation.hpp"
#include "host/engine/estimation/filtered_signals.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/reversal_mask.hpp"
#include "host/engine/estimation/zero_order_hold.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;
using data::Experiment;
using data::Segment;

// Positions are differentiated with a wider filter than the target, so that functions of velocity such as its sign are
// evaluated on sharp signals and filtered afterwards like it.
constexpr double kMotionOverRow = 2.5;
// Records of less coherent power than this share of the strongest one's do not determine the pipeline.
constexpr double kCountingPowerShare = 0.01;
constexpr double kMostMaskedShare = 0.75;
constexpr double kMaskedShareThen = 0.5;  // where it was more than that

// Each reversal masks an interval that is as long as the filter rings: a cut-off that serves the slow records may
// leave a fast one nothing at all. Where less than a quarter of a record that counts would be left, raises it until
// half is.
void leave_rows_between_reversals(Pipeline& pipeline, const std::vector<const Experiment*>& experiments,
                                  const std::vector<signals::CutoffChoice>& choices, double highest_hz) {
  double strongest = 0.0;
  for (const signals::CutoffChoice& c : choices) strongest = std::max(strongest, c.coherent_power);
  double wanted = 0.0;
  const Experiment* fastest = nullptr;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const Experiment& e = *experiments[i];
    if (!e.has(Column::motor_position) || !(choices[i].coherent_power > kCountingPowerShare * strongest)) continue;
    const double own_hz = kMotionOverRow * std::max(pipeline.row_cutoff_hz, choices[i].cutoff_hz);
    const double window_s = std::max(e.sample_s, 1.0 / own_hz);
    double reversals = 0.0, length_s = 0.0;
    for (const Segment& s : e.segments) {
      const double part_s = static_cast<double>(s.last - s.first) * e.sample_s;
      const std::span<const double> position(e[Column::motor_position].data() + s.first, s.last - s.first);
      reversals += part_s * signals::reversals_hz(position, e.sample_s, window_s);
      length_s += part_s;
    }
    const double needs = length_s > 0.0 ? 2.0 * kMaskReach / kMostMaskedShare * reversals / length_s : 0.0;
    if (needs > wanted) {
      wanted = needs;
      fastest = &e;
    }
  }
  if (wanted <= pipeline.row_cutoff_hz || pipeline.row_cutoff_hz >= highest_hz) return;
  pipeline.row_cutoff_hz = std::min(std::ceil(wanted * kMostMaskedShare / kMaskedShareThen), highest_hz);
  pipeline.reason += fmt::format("; raised to {:.4g} Hz, so that samples are left between the reversals of {}",
                                 pipeline.row_cutoff_hz, fastest->name);
}

double slowest_sample_hz(const std::vector<const Experiment*>& experiments) {
  double slowest_hz = 1e300;
  for (const Experiment* e : experiments) slowest_hz = std::min(slowest_hz, 1.0 / e->sample_s);
  return slowest_hz;
}

Pipeline choose_pipeline(const std::vector<const Experiment*>& experiments, const PipelineOptions& options) {
  Pipeline pipeline;
  pipeline.mask = options.mask;
  pipeline.derivatives = options.derivatives;
  const double slowest_hz = slowest_sample_hz(experiments);
  if (options.cutoff_hz) {
    pipeline.row_cutoff_hz = pipeline.motion_cutoff_hz = *options.cutoff_hz;
    pipeline.reason = "given by --cutoff-hz";
    if (!(*options.cutoff_hz > 0.0) || *options.cutoff_hz >= 0.45 * slowest_hz)
      throw data::DataError(
          {{data::Severity::error, "cutoff", "", 0, "",
            fmt::format("a cut-off of {} Hz does not fit data sampled at {:.6g} Hz", *options.cutoff_hz, slowest_hz),
            fmt::format("give --cutoff-hz between 0.1 and {:.4g}", 0.45 * slowest_hz)}});
    return pipeline;
  }
  std::vector<const Experiment*> of_choice;
  for (const Experiment* e : experiments)
    if ((e->has(Column::current) || e->has(Column::motor_torque)) &&
        (e->has(Column::motor_position) || e->has(Column::motor_velocity)))
      of_choice.push_back(e);
  std::vector<signals::CutoffChoice> choices(of_choice.size());
  in_parallel(of_choice.size(), [&](std::size_t i) {
    const Experiment& e = *of_choice[i];
    const std::vector<double>& effort = e[e.has(Column::current) ? Column::current : Column::motor_torque];
    const std::vector<double> velocity = e.has(Column::motor_position)
                                             ? slope_of(e[Column::motor_position], e.segments, e.sample_s)
                                             : e[Column::motor_velocity];
    choices[i] = signals::choose_cutoff(effort, velocity, 1.0 / e.sample_s);
  });
  if (choices.empty())
    throw data::DataError({{data::Severity::error, "missing_column", "", 0, "current_a",
                            "no experiment has both an effort (current_a or motor_torque_nm) and a motion of the motor",
                            "record both, or map their columns in dataset.toml"}});
  const signals::CutoffChoice choice = signals::combine_cutoffs(choices);
  pipeline.row_cutoff_hz = std::min(choice.cutoff_hz, slowest_hz / 10.0);
  pipeline.reason = choice.reason;
  if (pipeline.mask) leave_rows_between_reversals(pipeline, of_choice, choices, slowest_hz / 10.0);
  pipeline.motion_cutoff_hz = std::min(kMotionOverRow * pipeline.row_cutoff_hz, 0.45 * slowest_hz);
  return pipeline;
}

// Facts of the drive that a record is made with.
bool are_similar(const catalogue::DriveConstants<double>& a, const catalogue::DriveConstants<double>& b) {
  return a.gear_ratio == b.gear_ratio && a.torque_constant == b.torque_constant &&
         a.reference_temperature == b.reference_temperature && a.turn_angle_scale == b.turn_angle_scale;
}

// All but the records.
PreparedData without_records(const std::vector<const Experiment*>& experiments, const model::Drive& drive,
                             const Pipeline& pipeline) {
  PreparedData prepared;
  prepared.pipeline = pipeline;
  prepared.constants = catalogue::constants_of(drive);
  prepared.drive = drive;
  prepared.rotary = drive.axis == data::Axis::rotary;
  for (const Experiment* e : experiments) {
    prepared.output_signals.torque = prepared.output_signals.torque || e->has(Column::torque);
    prepared.effort_is_current = prepared.effort_is_current || e->has(Column::current);
  }
  return prepared;
}

// Makes those records that are not among the ready ones, by the three stages: signals, rows, torque.
void make_records(PreparedData& prepared, const std::vector<const Experiment*>& experiments,
                  const PreparedData* ready) {
  const bool is_ready =
      ready != nullptr && ready->pipeline == prepared.pipeline && are_similar(ready->constants, prepared.constants);
  prepared.records.resize(experiments.size());
  in_parallel(experiments.size(), [&](std::size_t i) {
    if (is_ready) {
      const auto found = std::ranges::find(ready->records, experiments[i], &Record::experiment);
      if (found != ready->records.end()) {
        prepared.records[i] = *found;
        return;
      }
    }
    throw_if_cancelled();
    Record& record = prepared.records[i];
    record = with_signals(*experiments[i], prepared, prepared.pipeline);
    choose_rows(record, prepared.pipeline);
    if (prepared.pipeline.torque_per_step != 0.0)
      correct_zero_order_hold(record, prepared.constants, prepared.pipeline.torque_per_step);
  });
  prepared.output_signals.torsion = std::ranges::any_of(prepared.records, shows_torsion);
}

// What the records show changes the pipeline. Each change repeats the stage that it is about, and those after it.
void suit_to_records(PreparedData& prepared, const std::vector<const Experiment*>& experiments,
                     std::optional<double> law_rad_s, bool may_raise, bool keeps_motor_reversals) {
  Pipeline& pipeline = prepared.pipeline;
  if (may_raise && pipeline.mask) {
    const double highest_hz = slowest_sample_hz(experiments) / 10.0;
    if (raise_cutoff_for_mask(prepared, law_rad_s, highest_hz)) make_records(prepared, experiments, nullptr);
    if (masks_most_torsion(prepared) && raise_cutoff_for_torsion(prepared, highest_hz))
      make_records(prepared, experiments, nullptr);
  }
  // The cut-off is that of the other models, so that their errors can be compared.
  pipeline.keep_motor_reversals = keeps_motor_reversals;
  pipeline.keep_torsion_reversals = pipeline.mask && masks_most_torsion(prepared);
  if (pipeline.keep_torsion_reversals)
    pipeline.reason += "; reversals of the torsion are kept, as its rate is hardly above its noise";
  if (pipeline.keep_motor_reversals || pipeline.keep_torsion_reversals)
    for (Record& r : prepared.records) choose_rows(r, pipeline);
  prepared.output_signals.torsion = std::ranges::any_of(prepared.records, shows_torsion);
  if (const HeldStep step = held_step(prepared); step.lacks) {
    pipeline.torque_per_step = step.torque_per_step;
    for (Record& r : prepared.records) correct_zero_order_hold(r, prepared.constants, step.torque_per_step);
  }
}

}  // namespace

PreparedData prepare_with(const std::vector<const Experiment*>& experiments, const model::Drive& drive,
                          const Pipeline& pipeline, const PreparedData* ready) {
  PreparedData prepared = without_records(experiments, drive, pipeline);
  make_records(prepared, experiments, ready);
  return prepared;
}

bool has_presliding(const model::Model& model) {
  return std::any_of(model.effects.begin(), model.effects.end(), [](const model::Effect& effect) {
    const catalogue::Entry* entry = catalogue::find(effect.type);
    return entry && entry->is_presliding();
  });
}

PreparedData prepare(const std::vector<const Experiment*>& experiments, const model::Model& model,
                     const PipelineOptions& options) {
  PreparedData prepared = without_records(experiments, model.drive, {});
  const std::optional<double> law_rad_s = slowest_law_rad_s(model);
  const bool keeps_reversals = options.mask && (options.keep_motor_reversals || has_presliding(model));
  const PreparedData* ready = options.ready.get();
  if (ready &&
      !(ready->chosen_on == experiments && ready->slowest_law_rad_s == law_rad_s &&
        ready->pipeline.keep_motor_reversals == keeps_reversals && are_similar(ready->constants, prepared.constants)))
    ready = nullptr;
  prepared.pipeline = ready ? ready->pipeline : choose_pipeline(experiments, options);
  make_records(prepared, experiments, ready);
  if (!ready) suit_to_records(prepared, experiments, law_rad_s, !options.cutoff_hz, keeps_reversals);
  prepared.chosen_on = experiments;
  prepared.slowest_law_rad_s = law_rad_s;
  return prepared;
}

PreparedData prepare_all(const data::Dataset& dataset, const model::Model& model, const PipelineOptions& options) {
  std::vector<const Experiment*> all, fit;
  for (const Experiment& e : dataset.experiments) {
    all.push_back(&e);
    if (e.role == data::Role::fit) fit.push_back(&e);
  }
  if (fit.empty()) fit = all;
  PreparedData prepared = prepare(fit, model, options);
  if (fit.size() == all.size()) return prepared;
  const PreparedData* ready =
      options.ready && options.ready->records.size() == all.size() ? options.ready.get() : &prepared;
  const std::optional<double> law_rad_s = prepared.slowest_law_rad_s;
  prepared = prepare_with(all, model.drive, prepared.pipeline, ready);
  prepared.chosen_on = std::move(fit);
  prepared.slowest_law_rad_s = law_rad_s;
  return prepared;
}

}  // namespace flexspline::estimation
