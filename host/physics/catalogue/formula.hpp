// A user's formula over the signals, evaluated along whole records.
#pragma once

#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/common/numbers/real.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::catalogue {

// What is wrong with a formula, and what to do.
class FormulaError : public std::runtime_error {
 public:
  FormulaError(const std::string& what, std::string remedy) : std::runtime_error(what), remedy_(std::move(remedy)) {}
  const std::string& remedy() const { return remedy_; }

 private:
  std::string remedy_;
};

// Names in a formula: the signals of shared/effects/variables.hpp, the directions, `pi`, and its parameters. Signals
// are in SI units; angles are those within a turn. Not for use by two threads at once.
class Formula {
 public:
  // Throws FormulaError where the text is no formula, uses a name that is not known, or leaves a parameter out.
  Formula(const std::string& text, const std::vector<std::string>& parameters);
  ~Formula();
  Formula(Formula&&) noexcept;

  // Adds the formula's value at each sample to `torque`. `turn_angle_scale` as in effects::DriveConstants. Throws
  // FormulaError where it gives no finite number, with the sample's signals.
  void add(std::span<const double> parameters, double turn_angle_scale,
           std::span<const effects::Inputs<numbers::Real>> inputs, double* torque);
  // What it reads (effects::Signals).
  unsigned reads() const;
  // Names that it reads, directions among them.
  std::vector<std::string> signals() const;

  // Names that a formula may read.
  static std::vector<std::string> known_signals();

 private:
  class Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace flexspline::catalogue
