#include "host/engine/estimation/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "host/common/signals/butterworth.hpp"
#include "host/common/signals/cutoff.hpp"
#include "host/engine/estimation/cancellation.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/mask_cutoff.hpp"
#include "host/engine/estimation/side_motion.hpp"
#include "host/engine/estimation/zero_order_hold.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;
using data::Experiment;
using data::Segment;
using signals::ZeroPhaseFilter;

// Positions are differentiated with a wider filter than the target, so that functions of velocity such as its sign are
// evaluated on sharp signals and filtered afterwards like it.
constexpr double kMotionOverRow = 2.5;
// Samples per second after decimation, over the cut-off: twice the Nyquist rate of what the filter lets through.
constexpr double kRowsOverCutoff = 4.0;

// How far, in periods of the cut-off, the step of friction at a reversal rings through the filter.
constexpr double kMaskReach = 1.5;
// Records of less coherent power than this share of the strongest one's do not determine the pipeline.
constexpr double kCountingPowerShare = 0.01;
constexpr double kMostMaskedShare = 0.75;
constexpr double kMaskedShareThen = 0.5;  // where it was more than that

// A current that is held for a sample acts, on average, half a sample after its time stamp; the mean with the sample
// before puts it at the instant at which positions are read.
std::vector<double> align_held(const std::vector<double>& held, const std::vector<Segment>& segments) {
  std::vector<double> aligned = held;
  for (const Segment& s : segments)
    for (std::size_t k = s.last; k-- > s.first + 1;) aligned[k] = 0.5 * (held[k] + held[k - 1]);
  return aligned;
}

// Marks what is within `reach` samples of a sample for which `bad` holds.
std::vector<std::uint8_t> spread(const std::vector<std::uint8_t>& bad, std::size_t reach) {
  std::vector<std::uint8_t> marked(bad.size(), 0);
  std::ptrdiff_t last = -1;
  const auto n = static_cast<std::ptrdiff_t>(bad.size());
  const auto r = static_cast<std::ptrdiff_t>(reach);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    if (!bad[static_cast<std::size_t>(k)]) continue;
    for (std::ptrdiff_t j = std::max(last + 1, k - r); j <= std::min(n - 1, k + r); ++j) {
      marked[static_cast<std::size_t>(j)] = 1;
      last = j;
    }
  }
  return marked;
}

// Drive off: nothing moves, and the effort changes no more than noise does. A stuck axis under a changing effort is
// none: its friction is unknown. Noise may be correlated over some samples (of the first order, by its correlation of
// neighbours); its means over eighths of the record then scatter no more than three times as they should.
bool is_at_rest(const Record& record, double motion_span, double resolution) {
  constexpr double kMostCorrelated = 0.97, kMostScatter = 3.0;
  constexpr std::size_t kParts = 8;
  const std::size_t n = record.effort.size();
  if (record.locked || n < 2 * kParts || motion_span > 2.0 * resolution) return false;
  const auto mean_of = [&](std::size_t from, std::size_t to) {
    double sum = 0.0;
    for (std::size_t k = from; k < to; ++k) sum += record.effort[k];
    return sum / static_cast<double>(to - from);
  };
  const double mean = mean_of(0, n);
  double steps = 0.0, spread_squared = 0.0;
  for (std::size_t k = 1; k < n; ++k) {
    steps += (record.effort[k] - record.effort[k - 1]) * (record.effort[k] - record.effort[k - 1]);
    spread_squared += (record.effort[k] - mean) * (record.effort[k] - mean);
  }
  const double rounding = 1e-12 * mean * mean * static_cast<double>(n);
  // Neighbours of white noise differ by sqrt(2) times its deviation; of noise averaged over two samples by once (von
  // Neumann 1941).
  if (spread_squared <= 2.0 * steps + rounding) return true;
  const double correlation = 1.0 - 0.5 * steps / spread_squared;
  if (correlation > kMostCorrelated) return false;
  double between = 0.0;
  for (std::size_t p = 0; p < kParts; ++p) {
    const double off = mean_of(n * p / kParts, n * (p + 1) / kParts) - mean;
    between += off * off / static_cast<double>(kParts - 1);
  }
  const double variance = spread_squared / static_cast<double>(n);
  const double as_one = (1.0 + correlation) / (1.0 - correlation);
  return between <= kMostScatter * variance * as_one * static_cast<double>(kParts) / static_cast<double>(n);
}

bool has_torsion(const Record& r) {
  return !r.torque.empty() && r.has_motor_motion && r.has_output_motion && !r.at_rest;
}

// Whether the torsion of a record is far above its noise, whatever its rate is. Noise of a position that is white below
// the cut-off has a rate of 2 pi f / sqrt(3) times its own deviation.
bool has_large_torsion(const Record& r, double cutoff_hz) {
  constexpr double kLarge = 10.0;
  if (!has_torsion(r)) return false;
  double sum = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < r.inputs.size(); ++k) {
    const double torsion = r.inputs[k].torsion;
    sum += torsion;
    squares += torsion * torsion;
  }
  const auto n = static_cast<double>(r.inputs.size());
  const double deviation = std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
  const double noise =
      r.velocity_noise[index(Balance::transmission)] * std::sqrt(3.0) / (2.0 * std::numbers::pi * cutoff_hz);
  return deviation > kLarge * noise;
}

void choose_rows(Record& record, const Pipeline& pipeline, std::size_t settling) {
  const std::size_t n = record.inputs.size();
  const auto reach = static_cast<std::size_t>(std::lround(kMaskReach / (pipeline.row_cutoff_hz * record.sample_s)));
  std::vector<std::uint8_t> unusable(n, 1);
  for (const Segment& s : record.segments) {
    // The ends of a segment carry the filters' guess of what is beyond; short segments keep at least their middle.
    const std::size_t edge = std::min(settling, (s.last - s.first) / 10);
    for (std::size_t k = s.first + edge; k + edge < s.last; ++k) unusable[k] = 0;
  }
  const std::vector<std::uint8_t> clipped = spread(record.experiment->masked, reach);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    Rows& rows = record.rows[index(balance)];
    std::vector<std::uint8_t> unsure(n, 0);
    const bool is_kept = (balance == Balance::motor && pipeline.keep_motor_reversals) ||
                         (balance == Balance::transmission && pipeline.keep_torsion_reversals &&
                          has_large_torsion(record, pipeline.row_cutoff_hz));
    if (pipeline.mask && !is_kept && !record.at_rest) {
      const double visible = 3.0 * record.velocity_noise[index(balance)];
      for (std::size_t k = 0; k < n; ++k) {
        const double v = record.direction_variable(balance, k);
        const double before = k > 0 ? record.direction_variable(balance, k - 1) : v;
        unsure[k] = std::abs(v) <= visible || v * before < 0.0;  // a position that stays is without noise, too
      }
      unsure = spread(unsure, reach);
    }
    for (std::size_t k = 0; k < n; k += record.decimation) {
      if (unusable[k]) continue;
      if (unsure[k] || (!clipped.empty() && clipped[k]))
        ++rows.masked;
      else
        rows.samples.push_back(k);
    }
  }
}

// Torques, temperature and effort.
void take_torques(Record& r, const Experiment& e, const catalogue::DriveConstants<double>& drive,
                  const ZeroPhaseFilter& filter) {
  if (e.has(Column::torque)) {
    r.torque = e[Column::torque];
    r.inputs.torque = filtered(r.torque, r.segments, filter);
  }
  if (e.has(Column::load_torque)) {
    r.load_torque = e[Column::load_torque];
    // Without a sensor it is what is known of the torque through the gear.
    if (!e.has(Column::torque)) r.inputs.torque = filtered(r.load_torque, r.segments, filter);
  }
  if (e.has(Column::temperature)) {
    // Housings warm up over minutes: all that is faster is noise.
    const double sample_hz = 1.0 / e.sample_s;
    const ZeroPhaseFilter slow(2, std::min(0.5, 0.4 * sample_hz), sample_hz);
    r.inputs.temperature = filtered(e[Column::temperature], r.segments, slow);
    r.has_temperature = true;
  }
  const auto aligned = [&](const std::vector<double>& measured) {
    return e.current_hold == data::CurrentHold::zoh ? ScaledSignal(align_held(measured, r.segments))
                                                    : ScaledSignal(measured);
  };
  if (e.has(Column::current)) {
    r.inputs.current = aligned(e[Column::current]);
    r.effort = r.inputs.current.times(drive.torque_constant);
  } else if (e.has(Column::motor_torque)) {
    r.effort = aligned(e[Column::motor_torque]);
  }
}

// Motion of both sides, the noise of their directions, and whether the drive is off.
void take_motion(Record& r, const Experiment& e, SideMotion motor, SideMotion output, double gear_ratio) {
  r.has_motor_motion = motor.measured;
  r.has_output_motion = output.measured || r.locked;
  r.motor_quantum = motor.quantum;
  r.velocity_crossover_hz = motor.velocity_crossover_hz;
  r.smoother_corner_hz = motor.smoother_corner_hz;
  r.output_quantum = output.quantum;
  r.velocity_noise[index(Balance::motor)] = motor.velocity_noise;
  r.velocity_noise[index(Balance::load)] =
      r.has_output_motion && output.velocity_noise > 0.0 ? output.velocity_noise : motor.velocity_noise / gear_ratio;
  r.velocity_noise[index(Balance::transmission)] =
      std::hypot(motor.velocity_noise / gear_ratio, r.locked ? 0.0 : output.velocity_noise);
  if (r.has_motor_motion) {
    const std::vector<double>& p = e.has(Column::motor_position) ? e[Column::motor_position] : motor.position;
    const auto [low, high] = std::minmax_element(p.begin(), p.end());
    r.at_rest = is_at_rest(r, *high - *low, std::max(r.motor_quantum.value_or(0.0), motor.position_noise));
  }
  r.inputs.angle = std::move(motor.position);
  r.inputs.velocity = std::move(motor.velocity);
  r.inputs.acceleration = std::move(motor.acceleration);
  r.inputs.output_angle = std::move(output.position);
  r.inputs.output_velocity = std::move(output.velocity);
  r.inputs.output_acceleration = std::move(output.acceleration);
  r.inputs.at_rest = r.at_rest;
  r.inputs.velocity_noise = r.velocity_noise;
}

Record prepare_one(const Experiment& e, const catalogue::DriveConstants<double>& drive, const Pipeline& pipeline) {
  Record r;
  r.experiment = &e;
  r.name = e.name;
  r.locked = e.load == data::Load::locked;
  r.sample_s = e.sample_s;
  r.segments = e.segments;
  const double sample_hz = 1.0 / e.sample_s;
  r.decimation = std::max<std::size_t>(
      1, static_cast<std::size_t>(std::floor(sample_hz / (kRowsOverCutoff * pipeline.row_cutoff_hz) + 1e-9)));
  const ZeroPhaseFilter filter(ZeroPhaseFilter::kDefaultOrder, std::min(pipeline.motion_cutoff_hz, 0.45 * sample_hz),
                               sample_hz);
  r.inputs.resize(e.size());
  r.inputs.segments = e.segments;
  r.inputs.sample_s = e.sample_s;
  r.inputs.gear_ratio = drive.gear_ratio;
  r.inputs.reference_temperature = drive.reference_temperature;
  r.inputs.locked = r.locked;
  take_torques(r, e, drive, filter);
  take_motion(r, e, motor_side(e, drive, filter, pipeline.derivatives),
              r.locked ? SideMotion{} : output_side(e, filter, pipeline.derivatives), drive.gear_ratio);
  r.inputs.keep_directions();
  choose_rows(r, pipeline, filter.settling_samples());
  return r;
}

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

Pipeline choose_pipeline(const std::vector<const Experiment*>& experiments, const PipelineOptions& options) {
  Pipeline pipeline;
  pipeline.mask = options.mask;
  pipeline.derivatives = options.derivatives;
  double slowest_hz = 1e300;
  for (const Experiment* e : experiments) slowest_hz = std::min(slowest_hz, 1.0 / e->sample_s);
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

// Whether the mask of reversals leaves nothing to fit on of a torsion that is far above its noise: its rate is the
// difference of two velocities, and often hardly above theirs.
bool masks_all_torsion(const PreparedData& prepared) {
  bool is_large = false;
  for (const Record& r : prepared.records) {
    if (has_torsion(r) && r.rows[index(Balance::transmission)].samples.size() >= kFewestRows) return false;
    is_large = is_large || has_large_torsion(r, prepared.pipeline.row_cutoff_hz);
  }
  return is_large;
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

// Returns whether the cut-off was raised.
bool raise_for_mask(PreparedData& prepared, std::optional<double> law_rad_s, double highest_hz) {
  Pipeline& pipeline = prepared.pipeline;
  const auto made_at = [&](const Record& r, double hz) {
    Pipeline tried = pipeline;
    tried.row_cutoff_hz = hz;
    tried.motion_cutoff_hz = std::max(pipeline.motion_cutoff_hz, hz);
    return prepare_one(*r.experiment, prepared.constants, tried);
  };
  const MaskCutoff wanted = cutoff_for_mask(prepared.records, {pipeline.row_cutoff_hz, highest_hz}, law_rad_s, made_at);
  if (wanted.hz <= pipeline.row_cutoff_hz) return false;
  pipeline.row_cutoff_hz = std::min(std::ceil(wanted.hz), highest_hz);
  // Slow motion is what such records have: a velocity that is small for its noise puts the friction of one speed at
  // another one, so the positions' filter is no wider than it must be.
  pipeline.motion_cutoff_hz = std::max(pipeline.motion_cutoff_hz, pipeline.row_cutoff_hz);
  pipeline.reason += fmt::format("; raised to {:.4g} Hz, so that the mask leaves samples of {}", pipeline.row_cutoff_hz,
                                 wanted.reason);
  return true;
}

}  // namespace

PreparedData prepare_with(const std::vector<const Experiment*>& experiments, const model::Drive& drive,
                          const Pipeline& pipeline, const PreparedData* ready) {
  PreparedData prepared = without_records(experiments, drive, pipeline);
  prepared.records.resize(experiments.size());
  const bool is_ready =
      ready != nullptr && ready->pipeline == pipeline && are_similar(ready->constants, prepared.constants);
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < experiments.size(); ++i) {
    if (is_ready) {
      const auto found = std::ranges::find(ready->records, experiments[i], &Record::experiment);
      if (found != ready->records.end()) {
        prepared.records[i] = *found;
        continue;
      }
    }
    missing.push_back(i);
  }
  std::vector<Record> made(missing.size());
  in_parallel(missing.size(), [&](std::size_t m) {
    throw_if_cancelled();
    made[m] = prepare_one(*experiments[missing[m]], prepared.constants, pipeline);
    if (pipeline.torque_per_step != 0.0) correct_zero_order_hold(made[m], prepared.constants, pipeline.torque_per_step);
  });
  for (std::size_t m = 0; m < made.size(); ++m) prepared.records[missing[m]] = std::move(made[m]);
  prepared.output_signals.torsion = std::ranges::any_of(prepared.records, [](const Record& r) {
    return has_torsion(r) && r.rows[index(Balance::transmission)].samples.size() >= kFewestRows;
  });
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
  const model::Drive& drive = model.drive;
  const std::optional<double> law_rad_s = slowest_law_rad_s(model);
  const bool keeps_reversals = options.mask && (options.keep_motor_reversals || has_presliding(model));
  if (options.ready && options.ready->chosen_on == experiments && options.ready->slowest_law_rad_s == law_rad_s &&
      options.ready->pipeline.keep_motor_reversals == keeps_reversals &&
      are_similar(options.ready->constants, without_records(experiments, drive, {}).constants)) {
    PreparedData prepared = prepare_with(experiments, drive, options.ready->pipeline, options.ready.get());
    prepared.chosen_on = experiments;
    prepared.slowest_law_rad_s = law_rad_s;
    return prepared;
  }
  PreparedData prepared = prepare_with(experiments, drive, choose_pipeline(experiments, options));
  Pipeline& pipeline = prepared.pipeline;
  // What the records show changes the pipeline; then they are prepared again.
  const auto again = [&] { prepared = prepare_with(experiments, drive, Pipeline(pipeline)); };
  if (!options.cutoff_hz && options.mask) {
    double slowest_hz = 1e300;
    for (const Experiment* e : experiments) slowest_hz = std::min(slowest_hz, 1.0 / e->sample_s);
    if (raise_for_mask(prepared, law_rad_s, slowest_hz / 10.0)) again();
  }
  // The cut-off is that of the other models, so that their errors can be compared.
  if (keeps_reversals) {
    pipeline.keep_motor_reversals = true;
    again();
  }
  if (pipeline.mask && masks_all_torsion(prepared)) {
    pipeline.keep_torsion_reversals = true;
    pipeline.reason += "; reversals of the torsion are kept, as its rate is hardly above its noise";
    again();
  }
  if (const HeldStep step = held_step(prepared); step.lacks) {
    pipeline.torque_per_step = step.torque_per_step;
    again();
  }
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
