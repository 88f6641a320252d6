#include "host/engine/comparison/noise_floor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include "host/engine/comparison/full_rate.hpp"
#include "host/engine/estimation/balance_fit.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/prepared_again.hpp"
#include "host/input/data/period.hpp"

namespace flexspline::comparison {
namespace {

using data::Column;
using data::Experiment;
using estimation::PreparedData;
using estimation::Record;
using estimation::RegressionProblem;
using estimation::Terms;

// A motion counts as repeated at a sample where the motor returns to within this angle (a ripple of order ten then
// cancels to a half) and within this share of the motion's RMS in position and in velocity.
constexpr double kSameAngleRad = 0.05;
constexpr double kSamePosition = 0.01;
constexpr double kSamePositionUnknownPitch = 0.005;
constexpr double kSameVelocity = 0.02;
// The limits of the search for the period are wide: samples that did not repeat are left out afterwards.
constexpr double kRepetition = 0.02;
constexpr double kLooseRepetition = 0.25;
// Pairs wanted, as a share of the record's usable samples and as a number of samples.
constexpr double kWantedShare = 0.3;
constexpr std::size_t kWantedRows = 50;
constexpr int kRealisations = 2;

// Largest difference of two instants that count as the same point of the same motion.
struct SameMotion {
  double position = 0.0;
  double velocity = 0.0;
};

SameMotion same_motion(const Record& record, const PreparedData& prepared, bool turns_known) {
  double mean = 0.0, position = 0.0, velocity = 0.0;
  const auto n = static_cast<double>(record.inputs.size());
  const estimation::RecordSignals& in = record.inputs;
  for (std::size_t k = 0; k < in.size(); ++k) mean += in.angle_at(k) / n;
  for (std::size_t k = 0; k < in.size(); ++k) {
    position += (in.angle_at(k) - mean) * (in.angle_at(k) - mean) / n;
    velocity += in.velocity_at(k) * in.velocity_at(k) / n;
  }
  SameMotion same;
  same.position = (turns_known ? kSamePosition : kSamePositionUnknownPitch) * std::sqrt(position);
  if (turns_known) same.position = std::min(same.position, kSameAngleRad / prepared.constants.turn_angle_scale);
  // Differences within the resolution and noise of the encoder do not count.
  same.position += 2.0 * record.motor_quantum.value_or(0.0);
  same.velocity =
      kSameVelocity * std::sqrt(velocity) + 4.0 * record.velocity_noise[estimation::index(estimation::Balance::motor)];
  return same;
}

double at(const std::vector<double>& x, std::size_t k, double fraction) {
  // Cubic through four samples; the residual is filtered far below the sample rate.
  if (fraction == 0.0 || k == 0 || k + 2 >= x.size()) return x[k];
  const double f = fraction;
  return x[k - 1] * (-f * (f - 1.0) * (f - 2.0) / 6.0) + x[k] * ((f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0) +
         x[k + 1] * (-(f + 1.0) * f * (f - 2.0) / 2.0) + x[k + 2] * ((f + 1.0) * f * (f - 1.0) / 6.0);
}

// Half the mean square of differences between instants of equal phase: the variance of independent noise. Successive
// periods are compared, not each with the mean of all, so that a slow drift (warming up) does not count as noise.
struct Pairs {
  double sum = 0.0;
  std::size_t count = 0;
  std::size_t offered = 0;

  void add(const FullRate& a, const Record& ra, const FullRate& b, const Record& rb, double shift,
           const SameMotion& same) {
    const auto whole = static_cast<std::size_t>(shift);
    const double fraction = shift - static_cast<double>(whole);
    for (std::size_t k = 0; k < a.residual.size(); ++k) {
      if (!a.valid[k]) continue;
      const std::size_t j = k + whole;
      if (j + 2 >= b.residual.size()) break;
      ++offered;
      if (!b.valid[j] || !b.valid[j + 1]) continue;
      const auto away = [&](double p, double q, double own) { return std::abs(p + fraction * (q - p) - own); };
      const estimation::RecordSignals &own = ra.inputs, &other = rb.inputs;
      if (away(other.angle_at(j), other.angle_at(j + 1), own.angle_at(k)) > same.position ||
          away(other.velocity_at(j), other.velocity_at(j + 1), own.velocity_at(k)) > same.velocity)
        continue;
      const double d = at(b.residual, j, fraction) - a.residual[k];
      sum += d * d;
      ++count;
    }
  }

  std::optional<double> rmse(std::size_t decimation) const {
    if (count < kWantedRows * decimation || static_cast<double>(count) < kWantedShare * static_cast<double>(offered))
      return std::nullopt;
    return std::sqrt(0.5 * sum / static_cast<double>(count));
  }
};

// A motion that repeats exactly is preferred to one that repeats about.
std::optional<double> period_of(const Experiment& e) {
  const std::optional<double> exact = data::period_samples(e, kRepetition);
  return exact ? exact : data::period_samples(e, kLooseRepetition);
}

bool are_replicates(const Experiment& a, const Experiment& b) {
  if (a.load != b.load || std::abs(a.sample_s - b.sample_s) > 1e-6 * a.sample_s) return false;
  if (a.replicate_of == b.name || b.replicate_of == a.name ||
      (!a.replicate_of.empty() && a.replicate_of == b.replicate_of))
    return true;
  if (!a.has(Column::position_command) || !b.has(Column::position_command)) return false;
  const auto &x = a[Column::position_command], &y = b[Column::position_command];
  const std::size_t n = std::min(x.size(), y.size());
  if (50 * n < 49 * std::max(x.size(), y.size())) return false;
  double power = 0.0, difference = 0.0, mean = 0.0;
  for (std::size_t k = 0; k < n; ++k) mean += x[k] / static_cast<double>(n);
  for (std::size_t k = 0; k < n; ++k) {
    power += (x[k] - mean) * (x[k] - mean);
    difference += (x[k] - y[k]) * (x[k] - y[k]);
  }
  return power > 0.0 && difference < 1e-6 * power;
}

// Quantisation noise of an encoder on a smooth motion, with the steps at a random place. In slow motion it is not
// white, and most of it passes the filters.
void add_quantisation(std::vector<double>& position, const std::vector<double>& smooth, double quantum, double offset) {
  for (std::size_t k = 0; k < position.size(); ++k) {
    const double x = smooth[k] + offset;
    position[k] += quantum * std::round(x / quantum) - x;
  }
}

Experiment with_noise(const Record& record, std::uint64_t seed) {
  Experiment e = *record.experiment;
  std::mt19937_64 generator(seed);
  const auto gaussian = [&](std::vector<double>& x, double std) {
    if (!(std > 0.0)) return;
    std::normal_distribution<double> noise(0.0, std);
    for (double& value : x) value += noise(generator);
  };
  for (std::size_t c = 0; c < data::kColumns; ++c) {
    const auto column = static_cast<Column>(c);
    if (!e.has(column)) continue;
    const bool motor = column == Column::motor_position, output = column == Column::output_position;
    const std::optional<double> quantum = motor ? record.motor_quantum : output ? record.output_quantum : std::nullopt;
    double std = e.noise_std[c].value_or(0.0);
    if (quantum) {
      // The stated noise includes the rounding already.
      std = std::sqrt(std::max(0.0, std * std - *quantum * *quantum / 12.0));
      std::vector<double> smooth(e.size());
      for (std::size_t k = 0; k < smooth.size(); ++k)
        smooth[k] = motor ? record.inputs.angle_at(k) : record.inputs.output_angle_at(k);
      const double share = std::uniform_real_distribution<double>(0.0, 1.0)(generator);
      if (motor || !record.locked) add_quantisation(e[column], smooth, *quantum, share * *quantum);
      // A remainder within the rounding of the stated digits is not noise.
      if (std < 0.1 * *quantum) std = 0.0;
    }
    gaussian(e[column], std);
  }
  return e;
}

bool noise_is_stated(const Record& record, estimation::Balance balance, bool torque_measured) {
  const auto stated = [&](Column column) {
    return record.experiment->noise_std[static_cast<std::size_t>(column)].has_value();
  };
  if (balance == estimation::Balance::motor &&
      !stated(record.experiment->has(Column::current) ? Column::current : Column::motor_torque))
    return false;
  return !(balance != estimation::Balance::motor || torque_measured) || stated(Column::torque);
}

class Floors {
 public:
  Floors(const RegressionProblem& data, const Terms& terms, const std::vector<const Experiment*>& experiments,
         const model::Drive& drive)
      : data_(data), terms_(terms), experiments_(experiments), prepared_(data.prepared()) {
    turns_known_ = drive.axis == data::Axis::rotary || drive.pitch_m.value.has_value();
  }

  std::vector<NoiseFloor> all() {
    const Eigen::VectorXd residual = data_.residual(terms_);
    std::vector<NoiseFloor> floors(data_.records().size());
    estimation::in_parallel(floors.size(), [&](std::size_t i) {
      const estimation::RowRange& range = data_.records()[i];
      floors[i] = of(prepared_.records[range.record], residual.segment(range.first, range.size()));
    });
    return floors;
  }

 private:
  // Called from several threads.
  NoiseFloor of(const Record& record, const Eigen::VectorXd& residual) const {
    if (record.at_rest) {
      // Standstill repeats with any period.
      const double n = static_cast<double>(residual.size());
      return {std::sqrt((residual.array() - residual.mean()).square().sum() / (n - 1.0)), "periods"};
    }
    if (const auto rmse = by_periods(record)) return {rmse, "periods"};
    if (const auto rmse = by_replicates(record)) return {rmse, "replicates"};
    if (noise_is_stated(record, data_.balance(), prepared_.output_signals.torque))
      if (const auto rmse = by_propagation(record, residual)) return {rmse, "propagated"};
    return {};
  }

  std::optional<double> by_periods(const Record& record) const {
    if (!record.has_motor_motion) return std::nullopt;
    const std::optional<double> period = record.period->get([&] { return period_of(*record.experiment); });
    if (!period) return std::nullopt;
    const auto full = full_rate(prepared_, record, data_.balance(), terms_);
    if (!full) return std::nullopt;
    Pairs pairs;
    pairs.add(*full, record, *full, record, *period, same_motion(record, prepared_, turns_known_));
    return pairs.rmse(record.decimation);
  }

  std::optional<double> by_replicates(const Record& record) const {
    Pairs pairs;
    for (const Experiment* other : experiments_) {
      if (other == record.experiment || other->name == record.name || !are_replicates(*record.experiment, *other))
        continue;
      const Record its = record_of(*other, record);
      const auto a = full_rate(prepared_, record, data_.balance(), terms_);
      const auto b = full_rate(prepared_, its, data_.balance(), terms_);
      if (a && b) pairs.add(*a, record, *b, its, 0.0, same_motion(record, prepared_, turns_known_));
    }
    return pairs.rmse(record.decimation);
  }

  // Of an experiment that is perhaps not among those prepared; the zero of its torsion is then that of its replicate.
  Record record_of(const Experiment& experiment, const Record& replicate) const {
    const auto found = std::ranges::find(prepared_.records, &experiment, &Record::experiment);
    if (found != prepared_.records.end()) return *found;
    Record record = estimation::prepare_as(prepared_, prepared_.pipeline, {&experiment}, terms_).records[0];
    estimation::take_torsion_zero(record, replicate);
    return record;
  }

  // The record contains its noise already. Adding the same amount again and taking the difference shows its effect on
  // the residual.
  std::optional<double> by_propagation(const Record& record, const Eigen::VectorXd& residual) const {
    double sum = 0.0;
    for (int realisation = 0; realisation < kRealisations; ++realisation) {
      const Experiment noisy = with_noise(record, static_cast<std::uint64_t>(realisation) + 1);
      PreparedData again = estimation::prepare_as(prepared_, prepared_.pipeline, {&noisy}, terms_);
      estimation::take_decisions(again.records[0], record);  // the mask depends on the noise
      RegressionProblem data(again, data_.balance());
      if (data.rows() != residual.size()) return std::nullopt;
      sum += (data.residual(terms_) - residual).squaredNorm();
    }
    return std::sqrt(sum / (kRealisations * static_cast<double>(residual.size())));
  }

  const RegressionProblem& data_;
  const Terms& terms_;
  const std::vector<const Experiment*>& experiments_;
  const PreparedData& prepared_;
  bool turns_known_ = false;
};

}  // namespace

std::vector<NoiseFloor> noise_floors(const RegressionProblem& data, const Terms& terms,
                                     const std::vector<const Experiment*>& experiments, const model::Drive& drive) {
  return Floors(data, terms, experiments, drive).all();
}

NoiseFloor pooled(const std::vector<NoiseFloor>& floors, const std::vector<estimation::RowRange>& records) {
  if (floors.size() != records.size()) throw std::invalid_argument("one noise floor a record is needed");
  // Worst source first: the pooled floor is named after its worst part.
  constexpr std::array<const char*, 3> kSources{"propagated", "replicates", "periods"};
  double sum = 0.0, rows = 0.0;
  std::size_t worst = kSources.size();
  for (std::size_t k = 0; k < floors.size(); ++k) {
    if (!floors[k].rmse) return {};
    const auto n = static_cast<double>(records[k].size());
    sum += *floors[k].rmse * *floors[k].rmse * n;
    rows += n;
    worst = std::min(worst, static_cast<std::size_t>(std::find(kSources.begin(), kSources.end(), floors[k].from) -
                                                     kSources.begin()));
  }
  if (!(rows > 0.0) || worst == kSources.size()) return {};
  return {std::sqrt(sum / rows), kSources[worst]};
}

}  // namespace flexspline::comparison
