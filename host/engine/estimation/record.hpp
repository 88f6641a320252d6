// A measurement prepared for regression: every signal that effects read, aligned, differentiated and with directions,
// and the left sides of the torque balances.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/record_signals.hpp"
#include "host/engine/estimation/terms.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::estimation {

using catalogue::Balance;
using catalogue::Real;
inline constexpr std::size_t kBalances = 3;
constexpr std::size_t index(Balance balance) {
  return static_cast<std::size_t>(balance);
}

// How positions become velocities and accelerations.
enum class Derivatives : std::uint8_t {
  butterworth,  // zero-phase filter, then central differences; a measured velocity helps where it has less noise
  kalman,       // Kalman filter with Rauch-Tung-Striebel smoothing, covariances by likelihood; the position alone
};

struct PreparedData;

struct PipelineOptions {
  std::optional<double> cutoff_hz;  // sets both filters
  bool mask = true;                 // leave out reversals and sticking
  // Records that were made before with these options, by prepare_all: a later request copies them, which costs
  // a tenth. Whoever keeps this keeps the data set, too. Null: nothing was.
  std::shared_ptr<const PreparedData> ready = nullptr;
  Derivatives derivatives = Derivatives::butterworth;
  // Keep reversals of the motor as where the model has a law of presliding: to compare another model with one that has.
  bool keep_motor_reversals = false;
};

// What was chosen for the data at hand; the same for all records, so that their samples can be compared.
struct Pipeline {
  double row_cutoff_hz = 0.0;     // filter of the target and of every column, Butterworth of order five, zero phase
  double motion_cutoff_hz = 0.0;  // filter of positions before they are differentiated
  bool mask = true;
  bool keep_motor_reversals = false;    // on the motor's balance nothing is masked
  bool keep_torsion_reversals = false;  // on the transmission's, where the mask would leave nothing
  double torque_per_step = 0.0;  // of a held effort, that readings of the torque lack half of; see zero_order_hold.hpp
  std::string reason;            // where the cut-off comes from
  Derivatives derivatives = Derivatives::butterworth;

  bool operator==(const Pipeline&) const = default;
};

// Samples of a record that one balance is fitted on.
struct Rows {
  std::vector<std::size_t> samples;  // after decimation and mask
  std::size_t masked = 0;            // left out by the mask, counted after decimation
};
// A record with fewer samples on a balance is not fitted on there.
inline constexpr std::size_t kFewestRows = 16;

// What follows from the measurement alone and takes long: computed at its first use, once for all copies of a
// record.
template <class Value>
class LazyValue {
 public:
  template <class Find>
  const Value& get(const Find& find) {
    std::call_once(is_found_, [&] { value_ = find(); });
    return value_;
  }

 private:
  std::once_flag is_found_;
  Value value_{};
};

struct Record {
  const data::Experiment* experiment = nullptr;
  std::string name;
  bool locked = false;
  bool at_rest = false;  // drive off: nothing moves and no effort changes; shows offsets alone
  double sample_s = 0.0;
  std::size_t decimation = 1;
  std::vector<data::Segment> segments;
  std::size_t settling = 0;  // samples that the filter of positions takes at the ends of a segment
  RecordSignals inputs;
  ScaledSignal effort;         // motor torque (or force), aligned to the instants of the positions; empty: not measured
  std::vector<double> torque;  // as measured
  std::vector<double> load_torque;
  // Of inputs.torque, where the model's weight and inertia were put on top of it; see modelled_torque.hpp.
  std::optional<std::vector<double>> torque_without_load;
  double torsion_zero_rad = 0.0;  // by how much the torsion was moved, see record_constants.hpp
  bool has_motor_motion = false;
  bool has_output_motion = false;  // measured, or locked
  bool has_temperature = false;
  std::optional<double> motor_quantum;  // resolution of the motor position
  std::optional<double> output_quantum;
  // From here on the motor's velocity is the measured one, which has less noise than the derivative of the position;
  // zero: all of it is the derivative.
  double velocity_crossover_hz = 0.0;
  double smoother_corner_hz = 0.0;  // of the motor's Kalman smoother; zero: positions are filtered and differentiated
  // Standard deviation of what the resolution and noise of the positions leave in the direction variable of each
  // balance: motor velocity, torsion rate, output velocity.
  std::array<double, kBalances> velocity_noise{};
  std::array<Rows, kBalances> rows;
  // Of the motion, in samples; nothing where it does not repeat itself. See comparison/noise_floor.cpp.
  std::shared_ptr<LazyValue<std::optional<double>>> period = std::make_shared<LazyValue<std::optional<double>>>();

  // The variable whose sign is the direction of a balance's friction.
  double direction_variable(Balance balance, std::size_t sample) const {
    return balance == Balance::motor  ? inputs.velocity_at(sample)
           : balance == Balance::load ? inputs.output_velocity_at(sample)
                                      : inputs.torsion_rate_at(sample);
  }
};

struct PreparedData {
  Pipeline pipeline;
  std::vector<Record> records;
  catalogue::DriveConstants<double> constants;
  model::Drive drive;  // that they come from
  // Without a torque motor and load are one balance, with load terms divided by the gear ratio.
  OutputSignals output_signals;
  bool effort_is_current = false;
  // Effects that is_nonlinear_in_current() names read the measured current, also where there is a modelled one.
  bool nonlinear_in_measured_current = false;
  bool rotary = true;
  std::vector<const data::Experiment*> chosen_on;  // what the pipeline was chosen for; empty: it was given
  std::optional<double> slowest_law_rad_s;         // whose slow samples the mask had to leave; see prepare()
};

// Whether a model has a law of presliding: friction around reversals follows the model then, so they are not masked.
bool has_presliding(const model::Model& model);

// Makes all experiments ready. Equations: report 82 (motor), 78 (transmission), 45 (load). Positions, where there are
// any, give velocity and acceleration; a measured velocity is combined with them where it has less noise
// (fused_velocity.hpp).
// Of the model the drive is used, as reconcile() leaves it (identify.hpp), and the velocity of its friction laws where
// it is given and fixed: the cut-off leaves samples that are as slow.
// Throws data::DataError where no balance can be formed or a record is too short for the filters.
PreparedData prepare(const std::vector<const data::Experiment*>& experiments, const model::Model& model,
                     const PipelineOptions& options);
// The same with a pipeline that was chosen before, as for hold-out records. Records that are among the ready ones by
// that pipeline are taken from there.
PreparedData prepare_with(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                          const Pipeline& pipeline, const PreparedData* ready = nullptr);
// All experiments of a data set, by the pipeline that suits those to be fitted, or all where none is: errors on them
// can be compared with those of an identification.
PreparedData prepare_all(const data::Dataset& dataset, const model::Model& model, const PipelineOptions& options);

}  // namespace flexspline::estimation
