#include "host/input/data/finding.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

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

std::vector<std::string> texts_of(const std::vector<Finding>& findings, Severity severity) {
  constexpr std::size_t kFewestToJoin = 3;
  std::vector<std::string> texts;
  const auto is_alike = [](const Finding& a, const Finding& b) {
    return a.severity == b.severity && a.kind == b.kind && a.column == b.column && a.remedy == b.remedy;
  };
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const Finding& finding = findings[i];
    if (finding.severity != severity) continue;
    std::size_t before = 0;
    std::vector<std::string> others;
    for (std::size_t j = 0; j < findings.size(); ++j) {
      if (j == i || !is_alike(findings[j], finding) || findings[j].file == finding.file) continue;
      if (j < i) ++before;
      const std::string name = std::filesystem::path(findings[j].file).filename().string();
      if (std::find(others.begin(), others.end(), name) == others.end()) others.push_back(name);
    }
    if (others.size() + 1 < kFewestToJoin)
      texts.push_back(finding.text());
    else if (before == 0)
      texts.push_back(fmt::format("{} (likewise in {} more files: {}; flexspline check lists each)", finding.text(),
                                  others.size(), fmt::join(others, ", ")));
  }
  return texts;
}

}  // namespace flexspline::data
