// How well the base model explains the logs of a machine, and by how much better with a term that is truly there.
#pragma once

#include "tests/worlds/machines/machine.hpp"

namespace flexspline::worlds::machines {

struct Run {
  const Record* record = nullptr;
  Log log;
  Measured measured;
};

std::vector<Run> run_all(const Machine& machine, const std::vector<Record>& records);

// RMS deviation from the reference over the reference's own.
double tracking_error(const Record& record, const Log& log);

// One signal per run: a torque on the right side of a balance.
using Terms = std::vector<Signal>;

enum class Samples { moving, all };

// RMS error of the base model in a balance, fitted by least squares to the filtered signals of all runs. `known` is
// taken off first; may be empty.
double rms_error(const Machine& machine, const std::vector<Run>& runs, Balance balance, const Terms& known,
                 Samples samples = Samples::moving);

struct HiddenTerms {
  Balance balance = Balance::motor;
  Terms terms;
};

HiddenTerms hidden_terms(const Machine& machine, const std::vector<Run>& runs);

// Coulomb friction with its true direction less the smooth sign that stands for it without presliding.
Signal presliding_term(const Machine& machine, const Run& run, double coulomb_nm);

}  // namespace flexspline::worlds::machines
