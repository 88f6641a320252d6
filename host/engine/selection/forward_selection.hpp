// Forward selection of terms: fitted on one half of the data, accepted by what they take off the other half.
#pragma once

#include <string>
#include <vector>

#include "host/engine/selection/setting.hpp"

namespace flexspline::selection {

// Products of a half of the data, weighted by record, for the sign of the velocity and for the presliding state (empty
// where that does not compete).
struct HalfData {
  Eigen::MatrixXd sign, presliding;
  double rows = 0.0;
};

inline constexpr int kPreslidingTerm = -1;
inline constexpr const char* kPresliding = "presliding";  // its name among the terms

struct SelectionStep {
  int term = 0;                           // index of RegressorTable::terms, or kPreslidingTerm
  double share = 0.0;                     // of the squares above the noise that were left before it
  double of_all = 0.0;                    // of the squares above the noise of the model alone
  std::vector<std::string> alternatives;  // names that would have taken off nearly as much
};

struct Noise {
  double variance = 0.0;  // of a sample, weighted: what no model can take off
  double tau = 1.0;       // samples that count as one
};

struct SelectionPath {
  bool abstains = false;
  double before = 0.0, after = 0.0;  // squares of the validation half, model alone and with all steps
  std::vector<SelectionStep> steps;
};

// The model with some terms added, fitted on the training half `fit`. Squares on both halves.
struct TermFit {
  Eigen::VectorXd theta;
  std::vector<Eigen::Index> columns;
  double training_squares = 0.0, validation_squares = 0.0;
};
// Squares that coefficients of some columns leave of the target, from its products.
double squares_left(const Eigen::MatrixXd& products, const std::vector<Eigen::Index>& columns,
                    const Eigen::VectorXd& theta);
TermFit fit_terms(const RegressorTable& table, const std::vector<int>& terms, const HalfData& fit,
                  const HalfData& validation);

SelectionPath select_forward(const RegressorTable& table, const HalfData& fit, const HalfData& validation,
                             const Noise& noise, const SelectionPolicy& policy);

}  // namespace flexspline::selection
