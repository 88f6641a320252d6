// Linear difference equations without physics: what a black box of n parameters reaches on the same data (report,
// section 1.3.3).
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace flexspline::blackbox {

/// y_k = -a_1 y_{k-1} - ... - a_na y_{k-na} + sum over inputs of (b_1 u_{k-nk} + ... + b_nb u_{k-nk-nb+1}) + c
///
/// na = 0 is a finite impulse response (FIR, eq. 10); else ARX, the report's IIR (eq. 12). The report's equations have
/// one input, nk = 1 and no constant c.
struct Orders {
  int na = 0;
  int nb = 1;
  int nk = 1;
  bool constant = true;  // offsets of sensors are in every record

  std::size_t parameters(std::size_t inputs) const {
    return static_cast<std::size_t>(na) + inputs * static_cast<std::size_t>(nb) + (constant ? 1u : 0u);
  }
  /// Samples before the first one that can be predicted: max(na, nb + nk - 1).
  std::size_t memory() const;
  bool operator==(const Orders&) const = default;
};

/// One uninterrupted segment of samples at the sample time of the model.
struct Record {
  std::vector<double> output;
  std::vector<std::vector<double>> inputs;  // each as long as the output
  std::vector<std::uint8_t> scored;  // empty: all. Others are neither fitted nor scored, but are the past of those
  std::size_t experiment = 0;        // segments of one experiment are left out together

  bool is_scored(std::size_t k) const { return scored.empty() || scored[k]; }
};

struct LinearModel {
  Orders orders;
  Eigen::VectorXd a;               // na
  std::vector<Eigen::VectorXd> b;  // one an input, nb each
  double constant = 0.0;
  std::size_t parameters = 0;
  std::size_t rows = 0;  // that it was fitted on
  double condition_number =
      0.0;  // of the columns scaled to unit length; infinite where the inputs do not determine all

  /// Largest modulus of the roots of z^na + a_1 z^(na-1) + ...; zero for FIR.
  double largest_pole() const;
  /// Bounded inputs give bounded outputs.
  bool stable() const { return largest_pole() < 1.0; }
  /// Static gain from an input to the output: sum(b) / (1 + sum(a)).
  double static_gain(std::size_t input) const;

  /// From measured inputs and measured past outputs; the first `orders.memory()` samples are the measured ones.
  std::vector<double> one_step(const Record& record) const;
  /// Free run: from measured inputs and its own past outputs, started with the measured ones of the first
  /// `orders.memory()` samples. May overflow to infinity where the model is not stable.
  std::vector<double> simulate(const Record& record) const;
};

/// Least squares of the equation error (eq. 15 to 19) over all scored samples of all records, by a rank-revealing
/// orthogonal factorisation; parameters that the inputs do not determine share the effect with the least squares of
/// their own (minimum norm of the scaled columns). Throws std::invalid_argument where orders are out of range, records
/// differ in their inputs or lengths, or there are fewer samples than parameters.
LinearModel fit(const std::vector<Record>& records, const Orders& orders);

/// Sums of the errors of a model on records, over scored samples after the first `orders.memory()` of each record.
struct Errors {
  std::size_t samples = 0;
  double squared = 0.0;  // free run
  double squared_one_step = 0.0;
  double mean = 0.0, spread = 0.0;  // of the output: mean, sum of squares about it

  void add(const Errors& other);
  double rms() const;  // NaN without samples or where the free run diverged
  double rms_one_step() const;
  double fit_percent() const;  // of the free run: 100 (1 - |y - yhat| / |y - mean(y)|), NaN for a constant output
  double nrms() const;         // rms / std(y)
};
Errors errors_of(const LinearModel& model, const Record& record);
Errors errors_of(const LinearModel& model, const std::vector<Record>& records);

}  // namespace flexspline::blackbox
