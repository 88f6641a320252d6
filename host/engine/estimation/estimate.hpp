// The estimators: how parameters are found from data, chosen by the user.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/engine/estimation/identify.hpp"

namespace flexspline::estimation {

enum class Method : std::uint8_t {
  automatic,     // ls or nls, as the model needs
  ls,            // linear least squares; the model has no free nonlinear parameter
  nls,           // separable nonlinear least squares
  partitioned,   // linear first, then what is left over nonlinearly (report 3.4)
  instruments,   // iv: columns of the simulated motion in place of the noisy ones
  output_error,  // oe: least error of the free run
};
enum class Intervals : std::uint8_t {
  standard,   // from the covariance, corrected for the residual's autocorrelation and, for ls and nls, for what twice
              // the cut-off changes
  profile,    // where the best fit of all others gets significantly worse
  bootstrap,  // from fits to blocks of the samples drawn at random
};

// A parameter that the user supplies for this run: known, as where the data leave the scale open (report 3.6).
struct SuppliedValue {
  std::string id;  // of the effect
  std::string parameter;
  double value = 0.0;
};

struct Options {
  Method method = Method::automatic;
  Intervals intervals = Intervals::standard;
  int starts = 3;  // of the search for nonlinear parameters: the swept one and random ones
  std::uint64_t seed = 1;
  int replicates = 200;  // of the bootstrap
  std::function<void(std::string_view)> progress = [](std::string_view) {};
};

// "ls", ...; the empty name is `automatic`. Throws std::invalid_argument for another one.
Method method_from_name(std::string_view name);
std::string_view name_of(Method method);
Intervals intervals_from_name(std::string_view name);

// Fits the model to the experiments of role fit. What the method could not do is among the warnings. Throws
// data::DataError as identify does, and std::invalid_argument where the options do not suit the model: ls
// with free nonlinear parameters; the text states what to do.
std::unique_ptr<Identification> estimate(const data::Dataset& dataset, const model::Model& model,
                                         const PipelineOptions& pipeline, const Options& options = {});

// Puts a supplied value into a model, as one that is known. Throws std::invalid_argument where it has no place.
void supply(model::Model& model, const SuppliedValue& supplied);

// The method that `automatic` chooses.
Method method_for(const model::Model& model);

}  // namespace flexspline::estimation
