#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/worlds/drives/case.hpp"
#include "tests/worlds/drives/measure.hpp"

namespace flexspline::worlds::drives {

struct Name {
  std::string effect;
  std::optional<double> order;
};

/// Something that is not in the base model and was not hidden.
struct Imperfection {
  std::string name;
  double excess = 0.0;      // rise of the RMS error by it alone
  std::vector<Name> names;  // names of the catalogue that describe it
};

struct Truth {
  double excess = 0.0;
  double error_nm = 0.0;  // RMS of the base model's error
  double cutoff_hz = 0.0;
  std::vector<std::string> accepted;
  std::vector<Imperfection> imperfections;
  std::vector<Name> also_true;
};

/// The case without what it hides; without an imperfection by its name (none, if the case does not have it).
Case without_hidden(Case drive);
std::optional<Case> without_imperfection(const Case& drive, const std::string& name);

/// The case with one thing alone that the catalogue describes: what it hides ("hidden"), an imperfection, or none ("").
/// Noise, and what no effect describes, stays.
Case alone(const Case& drive, const std::string& name);

/// Rise of the RMS error of the base model by the hidden effect, where it alone is missing: the case is simulated and
/// measured with it alone and without it, with the same random numbers, and the base model is fitted to both by least
/// squares (balance.hpp), at the cut-off of the case and at twice it, without and with the reversals. The largest of
/// the four counts.
double hidden_excess(const Case& drive, const std::vector<Measured>& fitted);

/// Adds to the hidden effect's excess all else that is known of a case; the excess of each imperfection is found as
/// that one.
void complete(Truth& truth, const Case& drive, const std::vector<Measured>& fitted);

/// Names of the catalogue that explain at least 97 % of the squared torque of the hidden effect which the base model
/// leaves, on the true signals of these motions; itself among them.
std::vector<std::string> accepted_names(const Case& drive);

}  // namespace flexspline::worlds::drives
