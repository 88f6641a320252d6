// The equations of the effects, written out a second time with <cmath> in SI units; laws with memory by Runge and Kutta
// of their rate form, or by another algorithm.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "tests/unit/effects_record.hpp"

namespace flexspline::tests {

using Values = std::vector<double>;
// What an effect with parameters p (natural, in the order of the catalogue) does at each sample of a record: torque on
// its own balance, torsion after a shift, factor of a modulation.
using Truth = std::function<Values(const Values& p, const Record& record)>;

const std::map<std::string, Truth, std::less<>>& truths();

}  // namespace flexspline::tests
