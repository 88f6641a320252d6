// What each experiment alone says of a parameter, and how far the experiments agree: std/avg, the report's measure of
// reliability. Whether an experiment counts follows from its own standard error, never from that of the pooled fit: one
// that disagrees with the others would otherwise be left out for its disagreement.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace flexspline::estimation {

inline constexpr double kReliableSpreadPercent = 30.0;  // the report's threshold for std/avg
inline constexpr std::size_t kFewestForReliable = 3;    // two agree too easily by chance

struct ExperimentValue {
  std::string name;
  std::optional<double> value;  // nothing where this experiment alone does not determine it
  std::optional<double> std;    // of this experiment alone
  std::string left_out;         // why there is no value
};

struct ByExperiment {
  std::vector<ExperimentValue> per_experiment;
  std::optional<double> average;         // of the experiments that determine it alone
  std::optional<double> spread_percent;  // standard deviation (n-1) over average
  // Spread not above the report's 30 %. Nothing: fewer than three experiments determine it alone, or the average is
  // zero within its error.
  std::optional<bool> reliable;

  std::size_t counted() const;
  std::size_t left_out() const { return per_experiment.size() - counted(); }
};

// Least squares on the rows of one experiment, with nonlinear parameters as pooled.
struct AloneFit {
  std::string name;
  std::string too_short;  // not empty: there is no fit, and why
  Eigen::VectorXd theta, root_tolerance;
  Eigen::MatrixXd covariance;
};

// A linear parameter of the fits, or the sum or difference of two.
struct Combination {
  Eigen::Index first = 0;
  std::optional<Eigen::Index> second;
  double sign = 1.0;  // of the second
};

// Takes what the experiments determine, says why the others are left out, and summarises.
ByExperiment by_experiment(const std::vector<AloneFit>& alone, const Combination& combination);

// Average, spread and what they say, from `per_experiment`.
void summarise(ByExperiment& e);

}  // namespace flexspline::estimation
