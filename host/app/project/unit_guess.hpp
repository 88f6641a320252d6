// Units of columns that their names do not give.
#pragma once

#include <string>
#include <vector>

#include "host/app/project/column_guess.hpp"
#include "host/app/project/request.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::project {

// Values of some columns of one table in a file, by name; empty where it does not have one.
std::vector<std::vector<double>> values_of(const data::Recording& recording, const std::vector<std::string>& names);

// SI units in one of a unit; one where it is not known.
double factor_of(const std::string& unit);
// Likewise of a column: counts become rad, or m.
double factor_of(const ColumnGuess& column, const Request& request);

// Takes units that names do not give from the values of the first file.
void guess_units(std::vector<ColumnGuess>& columns, const data::Recording& recording, const Request& request);

}  // namespace flexspline::project
