// Trends of parameters over the experiments: evidence of an effect that the model lacks.
#pragma once

#include <string>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/cross_validation.hpp"

namespace flexspline::selection {

struct Trend {
  std::string id, parameter;
  // "speed", "frequency", "acceleration", "temperature", "order in time", "torque"
  std::string over;
  double slope = 0.0;  // of the logarithm of the parameter by the logarithm of speed, frequency, acceleration or torque
                       // (a power); by 1 degC or by one record: share of the average
  double p_value = 1.0;  // two-sided t-test, times the number of things tried for this parameter
};

// Regresses the value of each parameter of physical sign by experiment on what its experiments differ in. Only trends
// with a corrected p-value below 0.001 that move the parameter by more than 3 % over the records are returned, surest
// first. Needs six experiments that identify the parameter; standing still counts as none.
std::vector<Trend> parameter_trends(const estimation::Identification& identified);

// Of the velocity that the balance of the motor has, rad/s.
double rms_speed(const estimation::Record& record);

// Friction that differs between runs without a known cause.
struct Drift {
  std::string group;  // "viscous friction"
  double percent = 0.0;
};

// Standard deviations of the random effects of a cross-validated model, from 1 % on.
std::vector<Drift> drifts(const CrossValidatedFit& fit);

}  // namespace flexspline::selection
