#include "host/app/project/candidates.hpp"

#include <algorithm>
#include <map>

#include "host/common/text/nearest.hpp"

namespace flexspline::project {
namespace {

bool is_in(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

std::vector<std::string> texts_in(const data::Recording& recording, const std::vector<std::string>& names) {
  // Each table of a file has columns of one length.
  std::map<std::size_t, std::vector<std::size_t>> tables;
  for (std::size_t i = 0; i < recording.names().size(); ++i)
    if (is_in(names, recording.names()[i])) tables[recording.length(i)].push_back(i);
  std::vector<std::string> texts;
  for (const auto& [length, columns] : tables) {
    const data::Table table = recording.read(columns);
    std::vector<std::size_t> counts(columns.size(), 0);
    for (const data::BadCell& cell : table.bad_cells) counts[cell.column] += cell.kind == data::BadCell::Kind::text;
    for (std::size_t k = 0; k < columns.size(); ++k)
      if (2 * counts[k] > table.rows()) texts.push_back(recording.names()[columns[k]]);
  }
  return texts;
}

std::vector<Candidate> candidates_of(const Draft& draft, const Request& request) {
  if (draft.toml.experiments.empty() || draft.unused.empty()) return {};
  data::Findings findings;
  const auto recording = data::open_recording(draft.toml.experiments.front().file, findings);
  const std::vector<std::string> texts = texts_in(*recording, draft.unused);
  std::vector<Candidate> candidates;
  for (const std::string& name : draft.unused) {
    const ColumnReading reading = read_name(name, "", recording->names());
    const bool is_of_other_joint = draft.joint && reading.joint && *reading.joint != *draft.joint;
    if (reading.set_point || is_of_other_joint || is_in(texts, name) || is_in(request.without, name)) continue;
    candidates.push_back({name, reading.kind});
  }
  return candidates;
}

const Candidate* nearest_candidate(const std::vector<Candidate>& candidates, const std::string& ours, Kind kind) {
  for (const Kind wanted : {kind, Kind::none}) {
    std::vector<std::string> names;
    for (const Candidate& c : candidates)
      if (c.kind == wanted) names.push_back(c.name);
    if (names.empty()) continue;
    const std::string nearest = text::nearest_first(ours, names).front();
    return &*std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& c) { return c.name == nearest; });
  }
  return nullptr;
}

}  // namespace flexspline::project
