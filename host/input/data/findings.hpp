// Collects what is found while measurements are read, and knows which kinds there are.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/finding.hpp"

namespace flexspline::data {

// A kind of finding, FINDINGS.md in this folder lists them.
struct KindInfo {
  std::string_view name;
  Severity severity = Severity::warning;  // without `--tolerate`
  bool tolerable = false;                 // `--tolerate` makes it a warning, and work continues
};

// All kinds that reading and checking may give.
std::span<const KindInfo> known_kinds();

// "jitter, not_finite, ...": the kinds that `--tolerate` takes.
std::string tolerable_kinds();

class Findings {
 public:
  // Kinds that do not exist or cannot be tolerated become errors of kind "tolerate".
  explicit Findings(std::vector<std::string> tolerate = {});

  bool tolerates(std::string_view kind) const;
  // Adds an error of kind "tolerate" for each kind that does not exist or cannot be tolerated. `file` and `line`: where
  // they are stated.
  void check_kinds(const std::vector<std::string>& kinds, const std::string& file = {}, std::size_t line = 0);
  // The kinds that the dataset.toml of what is read from now on tolerates besides, instead of those of the one before.
  void tolerate_also(std::vector<std::string> kinds) { tolerate_also_ = std::move(kinds); }
  // An error of a tolerated kind is kept as a warning. Returns the severity it was kept with.
  Severity add(Finding finding);
  Severity add(Severity severity, std::string kind, std::string file, std::size_t line, std::string column,
               std::string what, std::string remedy);
  // Adds an error that cannot be tolerated here although its kind may be, as there is no way to continue.
  void fail_later(std::string kind, std::string file, std::size_t line, std::string column, std::string what,
                  std::string remedy);
  // Adds an error and throws it with all that was found so far.
  [[noreturn]] void fail(std::string kind, std::string file, std::size_t line, std::string what, std::string remedy);
  bool has_errors() const;
  void throw_if_errors() const;
  const std::vector<Finding>& list() const { return list_; }

 private:
  std::vector<std::string> tolerate_, tolerate_also_;
  std::vector<Finding> list_;
};

}  // namespace flexspline::data
