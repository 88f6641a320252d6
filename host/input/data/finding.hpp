// What was found in a measurement: each with where it is and what to do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexspline::data {

enum class Severity : std::uint8_t { note, warning, error };

struct Finding {
  Severity severity = Severity::warning;
  std::string kind;      // "not_a_number", "jitter", "unit": what `--tolerate` takes
  std::string file;      // empty: of the data set as a whole
  std::size_t line = 0;  // 0: of no one line
  std::string column;
  std::string what;    // a sentence
  std::string remedy;  // what to do, a sentence

  // "runs/slow.csv:14, column current_a: ... ; do ..."
  std::string text() const;
};

// The findings of one severity as texts. Of what three or more files share, the first text stands for all and names the
// other files: `flexspline check` lists each.
std::vector<std::string> texts_of(const std::vector<Finding>& findings, Severity severity);
inline std::vector<std::string> warning_texts(const std::vector<Finding>& findings) {
  return texts_of(findings, Severity::warning);
}

// Unusable measurements: exit 2.
class DataError : public std::runtime_error {
 public:
  explicit DataError(std::vector<Finding> findings);
  const std::vector<Finding>& findings() const { return findings_; }

 private:
  std::vector<Finding> findings_;
};

}  // namespace flexspline::data
