// Times of a record in messages: as its column has them where that starts near zero, else after its first sample, as
// six digits of a date in seconds would hide the time within the record.
#pragma once

#include <string>
#include <string_view>

#include "host/input/data/dataset.hpp"

namespace flexspline::data {

inline constexpr std::string_view kAfterFirstSample = " after the first sample";

// What is subtracted: the time of the first sample, or zero where the column starts near it.
double start_of_times(const Experiment& experiment);
// Of the experiment of that name; zero without one.
double start_of_times(const Dataset& dataset, std::string_view name);
// Behind a time: kAfterFirstSample, or empty.
std::string_view times_are(const Experiment& experiment);
// "1.25 s", "1.25 s after the first sample".
std::string time_text(const Experiment& experiment, double time_s);
// "from 1.25 s to 2 s", "from 1.25 s to 2 s after the first sample".
std::string times_text(const Experiment& experiment, double from_s, double to_s);

}  // namespace flexspline::data
