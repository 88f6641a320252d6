// Columns of a logger's file that may be one of ours that was not found.
#pragma once

#include <string>
#include <vector>

#include "host/app/project/column_names.hpp"
#include "host/app/project/draft.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::project {

struct Candidate {
  std::string name;
  Kind kind = Kind::none;  // by its name
};

// Those of the first file that are not used and may be measured: no texts, no set points, nothing of another joint, and
// none that the user left out.
std::vector<Candidate> candidates_of(const Draft& draft, const Request& request);

// Those of the columns with these names that hold text.
std::vector<std::string> texts_in(const data::Recording& recording, const std::vector<std::string>& names);

// The candidate whose name is nearest to that of a column of ours, of its kind or else of none; null: there is none.
const Candidate* nearest_candidate(const std::vector<Candidate>& candidates, const std::string& ours, Kind kind);

}  // namespace flexspline::project
