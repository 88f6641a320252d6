#include "host/engine/estimation/regressor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <random>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/filtered_signals.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/linearised.hpp"

namespace flexspline::estimation {
namespace {

using data::Column;

constexpr std::size_t kDraws = 3;
// Factors on the noise that is added: the variance is twice and four times what it was.
constexpr std::array<double, 4> kFactors = {1.0, -1.0, 1.7320508075688772, -1.7320508075688772};

// Noise of one signal of a record.
struct SignalNoise {
  Column column{};
  std::vector<double> values;
};

// Standard deviation of white noise, from what a filter has taken away of a signal.
double white_noise(const std::vector<double>& raw, const std::vector<double>& kept, double kept_share) {
  double sum = 0.0;
  for (std::size_t k = 0; k < raw.size(); ++k) sum += (raw[k] - kept[k]) * (raw[k] - kept[k]);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, raw.size())) / (1.0 - kept_share));
}

SignalNoise draw(const data::Experiment& e, Column column, const signals::ZeroPhaseFilter& filter,
                 std::optional<double> quantum, std::mt19937_64& random) {
  constexpr double kMoreThanSteps = 1.5;
  const std::vector<double>& measured = e[column];
  const std::vector<double> smooth = filtered(measured, e.segments, filter);
  const double white = white_noise(measured, smooth, std::min(0.8, 2.0 * filter.cutoff_hz() * e.sample_s));
  SignalNoise noise{column, std::vector<double>(measured.size(), 0.0)};
  if (quantum && white < kMoreThanSteps * *quantum / std::sqrt(12.0)) {
    const double zero = std::uniform_real_distribution<double>(0.0, *quantum)(random);
    for (std::size_t k = 0; k < measured.size(); ++k)
      noise.values[k] = std::round((smooth[k] + zero) / *quantum) * *quantum - zero - smooth[k];
    return noise;
  }
  std::normal_distribution<double> normal(0.0, white);
  for (double& value : noise.values) value = normal(random);
  return noise;
}

// By record.
std::vector<std::vector<SignalNoise>> draw_all(const Identification& found, std::uint64_t seed) {
  // On the other balances the torque is what is explained.
  const bool reads_torque = std::ranges::any_of(found.terms, [](const Term& t) {
    return t.entry->identified_on() == Balance::motor && (t.entry->info->reads & effects::kTorque) != 0;
  });
  std::mt19937_64 random(seed);
  std::vector<std::vector<SignalNoise>> all;
  for (const Record& record : found.prepared.records) {
    std::vector<SignalNoise>& noise = all.emplace_back();
    if (record.at_rest) continue;
    const data::Experiment& e = *record.experiment;
    const double sample_hz = 1.0 / record.sample_s;
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                          std::min(found.prepared.pipeline.motion_cutoff_hz, 0.45 * sample_hz),
                                          sample_hz);
    if (e.has(Column::motor_position))
      noise.push_back(draw(e, Column::motor_position, filter, record.motor_quantum, random));
    if (e.has(Column::output_position) && !record.locked)
      noise.push_back(draw(e, Column::output_position, filter, record.output_quantum, random));
    if (e.has(Column::torque) && reads_torque) noise.push_back(draw(e, Column::torque, filter, std::nullopt, random));
  }
  return all;
}

std::vector<Linearised> with_noise(const Identification& found, const std::vector<std::vector<SignalNoise>>& noise,
                                   double factor, const std::vector<std::vector<Eigen::Index>>& identified) {
  std::vector<data::Experiment> noisy;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    data::Experiment& e = noisy.emplace_back(*found.prepared.records[i].experiment);
    for (const SignalNoise& signal : noise[i])
      for (std::size_t k = 0; k < signal.values.size(); ++k) e[signal.column][k] += factor * signal.values[k];
  }
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : noisy) experiments.push_back(&e);
  return linearised_with(found, experiments, found.prepared.pipeline, identified);
}

struct Changes {
  Eigen::MatrixXd at_twice, at_four_times, chance;  // a column a draw
  Eigen::MatrixXd middle;                           // of the covariance that standard errors count
};

// `start`: the step that the samples as they are would take.
void add_draw(const RegressionProblem& data, const BalanceFit& fit, const Linearised& own, const Eigen::VectorXd& start,
              const std::vector<const Linearised*>& noisy, Eigen::Index draw_index, Changes& changes) {
  std::vector<Eigen::VectorXd> step;
  for (const Linearised* n : noisy)
    step.push_back(generalised_least_squares(n->J, n->residual, fit.error_covariance).theta - start);
  changes.at_twice.col(draw_index) = 0.5 * (step[0] + step[1]);
  changes.at_four_times.col(draw_index) = 0.5 * (step[2] + step[3]);
  changes.chance.col(draw_index) = 0.5 * (step[0] - step[1]);
  const Eigen::VectorXd moved =
      0.5 * (noisy[0]->residual - noisy[1]->residual) - own.J * changes.chance.col(draw_index);
  changes.middle +=
      newey_west(data.records(), fit.error_covariance.score_columns(own.J), fit.root_weights.cwiseProduct(moved),
                 newey_west_lags(fit.autocorrelation_time, data.rows())) /
      static_cast<double>(kDraws);
}

RegressorNoise summarised(const Changes& changes, const Eigen::MatrixXd& unit,
                          const std::vector<Eigen::Index>& identified, Eigen::Index parameters) {
  RegressorNoise result{Eigen::VectorXd::Zero(parameters), Eigen::MatrixXd::Zero(parameters, parameters),
                        Eigen::MatrixXd::Zero(parameters, parameters)};
  result.chance(identified, identified) =
      changes.chance * changes.chance.transpose() / static_cast<double>(changes.chance.cols());
  if (unit.allFinite()) result.counted(identified, identified) = unit * changes.middle * unit;
  for (std::size_t j = 0; j < identified.size(); ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    result.bias[identified[j]] =
        extrapolated_bias(changes.at_twice.row(row).mean(), changes.at_four_times.row(row).mean());
  }
  return result;
}

}  // namespace

double extrapolated_bias(double at_twice, double at_four_times) {
  // Of a bias c V^p the changes are c (2^p - 1) and c (4^p - 1), whose ratio is 2^p + 1.
  const double ratio = at_twice != 0.0 ? at_four_times / at_twice : 0.0;
  const double two_to_p = std::clamp(ratio - 1.0, std::sqrt(2.0), 2.0);
  return at_four_times / (two_to_p * two_to_p - 1.0);
}

std::vector<RegressorNoise> regressor_noise(const Identification& found) {
  const std::vector<std::vector<Eigen::Index>> identified = parameters_with_errors(found);
  std::vector<Linearised> own;
  std::vector<LinearFit> fits;  // of the samples as they are
  std::vector<Changes> changes(found.fits.size());
  for (std::size_t b = 0; b < found.fits.size(); ++b) {
    own.push_back(linearised(found.data[b], found.fits[b], found.terms, identified[b]));
    fits.push_back(generalised_least_squares(own.back().J, own.back().residual, found.fits[b].error_covariance));
    const Eigen::Index n = own.back().J.cols();
    changes[b].at_twice = changes[b].at_four_times = changes[b].chance =
        Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(kDraws));
    changes[b].middle = Eigen::MatrixXd::Zero(n, n);
  }
  for (std::size_t d = 0; d < kDraws; ++d) {
    const auto noise = draw_all(found, d + 1);
    std::array<std::vector<Linearised>, kFactors.size()> noisy;
    in_parallel(kFactors.size(), [&](std::size_t f) { noisy[f] = with_noise(found, noise, kFactors[f], identified); });
    for (std::size_t b = 0; b < found.fits.size(); ++b) {
      std::vector<const Linearised*> of_balance;
      for (const std::vector<Linearised>& n : noisy) of_balance.push_back(&n[b]);
      if (!identified[b].empty())
        add_draw(found.data[b], found.fits[b], own[b], fits[b].theta, of_balance, static_cast<Eigen::Index>(d),
                 changes[b]);
    }
  }
  std::vector<RegressorNoise> result;
  for (std::size_t b = 0; b < found.fits.size(); ++b) {
    if (identified[b].empty()) {
      const Eigen::Index n = found.fits[b].covariance.rows();
      result.push_back({Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n)});
      continue;
    }
    result.push_back(summarised(changes[b], fits[b].unit_covariance, identified[b], found.fits[b].covariance.rows()));
  }
  return result;
}

}  // namespace flexspline::estimation
