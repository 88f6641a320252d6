#include "host/input/data/finding.hpp"

#include <fmt/format.h>

namespace flexspline::data {
namespace {

std::string joined(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings) {
    if (finding.severity != Severity::error) continue;
    if (!text.empty()) text += '\n';
    text += finding.text();
  }
  return text.empty() ? "the measurements cannot be used" : text;
}

}  // namespace

std::string Finding::text() const {
  std::string where = file;
  if (line > 0) where += fmt::format(":{}", line);
  if (!column.empty()) where += fmt::format("{}column {}", where.empty() ? "" : ", ", column);
  std::string all = where.empty() ? what : fmt::format("{}: {}", where, what);
  if (!remedy.empty()) all += fmt::format("; {}", remedy);
  return all;
}

DataError::DataError(std::vector<Finding> findings)
    : std::runtime_error(joined(findings)), findings_(std::move(findings)) {}

}  // namespace flexspline::data
