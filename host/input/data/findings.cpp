#include "host/input/data/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host/common/text/nearest.hpp"
#include "host/common/text/shortened.hpp"

namespace flexspline::data {
namespace {

constexpr std::array kKinds = {
    KindInfo{"file", Severity::error, false},
    KindInfo{"format", Severity::error, false},
    KindInfo{"header", Severity::error, false},
    KindInfo{"key", Severity::error, false},
    KindInfo{"mapping", Severity::error, false},
    KindInfo{"tolerate", Severity::error, false},
    KindInfo{"text_in_number", Severity::error, false},
    KindInfo{"not_finite", Severity::error, true},
    KindInfo{"row_length", Severity::error, true},
    KindInfo{"time_not_increasing", Severity::error, true},
    KindInfo{"missing_column", Severity::error, false},
    KindInfo{"too_few_samples", Severity::error, false},
    KindInfo{"velocity_position_mismatch", Severity::error, true},
    KindInfo{"wrapped_position", Severity::error, true},
    KindInfo{"time_stamps", Severity::note, false},
    KindInfo{"jitter", Severity::warning, true},
    KindInfo{"conflict", Severity::error, true},
    KindInfo{"gap", Severity::warning, false},
    KindInfo{"left_out", Severity::warning, false},
    KindInfo{"clipping", Severity::warning, false},
    KindInfo{"standstill", Severity::warning, false},
    KindInfo{"constant_column", Severity::warning, false},
    KindInfo{"unit", Severity::warning, false},
    KindInfo{"velocity_lag", Severity::warning, false},
    KindInfo{"sign", Severity::warning, false},
    KindInfo{"gear_ratio", Severity::warning, false},
    KindInfo{"key_differs", Severity::warning, false},
    KindInfo{"unknown_key", Severity::warning, false},
    KindInfo{"duplicate", Severity::warning, false},
    KindInfo{"unused_column", Severity::note, false},
    KindInfo{"empty_column", Severity::note, false},
};

// Names and values from files may be of any length.
void shorten(Finding& finding) {
  constexpr std::size_t kLongestColumn = 200, kLongestSentence = 4000;
  finding.column = text::shortened(finding.column, kLongestColumn);
  finding.what = text::shortened(finding.what, kLongestSentence);
  finding.remedy = text::shortened(finding.remedy, kLongestSentence);
}

}  // namespace

std::span<const KindInfo> known_kinds() {
  return kKinds;
}

std::string tolerable_kinds() {
  std::string text;
  for (const KindInfo& kind : kKinds)
    if (kind.tolerable) text += (text.empty() ? "" : ", ") + std::string(kind.name);
  return text;
}

Findings::Findings(std::vector<std::string> tolerate) : tolerate_(std::move(tolerate)) {
  check_kinds(tolerate_);
}

void Findings::check_kinds(const std::vector<std::string>& kinds, const std::string& file, std::size_t line) {
  for (const std::string& name : kinds) {
    const auto kind = std::find_if(kKinds.begin(), kKinds.end(), [&](const KindInfo& k) { return k.name == name; });
    if (kind == kKinds.end()) {
      std::vector<std::string_view> names;
      for (const KindInfo& k : kKinds) names.push_back(k.name);
      const std::string near = text::nearest(name, names);
      add(Severity::error, "tolerate", file, line, "",
          fmt::format("no finding is of kind \"{}\"{}", name,
                      near.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", near)),
          fmt::format("kinds that can be tolerated are {}", tolerable_kinds()));
    } else if (!kind->tolerable && kind->severity == Severity::error) {
      add(Severity::error, "tolerate", file, line, "",
          fmt::format("\"{}\" cannot be tolerated: the data cannot be used", name),
          fmt::format("correct the data; kinds that can be tolerated are {}", tolerable_kinds()));
    } else if (!kind->tolerable) {
      add(Severity::note, "tolerate", file, line, "", fmt::format("\"{}\" is never an error", name),
          fmt::format("kinds that can be tolerated are {}", tolerable_kinds()));
    }
  }
}

bool Findings::tolerates(std::string_view kind) const {
  const auto has = [&](const std::vector<std::string>& kinds) {
    return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  return has(tolerate_) || has(tolerate_also_);
}

Severity Findings::add(Finding finding) {
  shorten(finding);
  if (finding.severity == Severity::error && tolerates(finding.kind)) {
    const auto kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const KindInfo& k) { return k.name == finding.kind; });
    if (kind != kKinds.end() && kind->tolerable) finding.severity = Severity::warning;
  }
  // Parts of one file share its header and mapping: what is wrong there is reported once.
  const bool known = std::any_of(list_.begin(), list_.end(), [&](const Finding& f) {
    return f.kind == finding.kind && f.line == finding.line && f.file == finding.file && f.column == finding.column &&
           f.what == finding.what;
  });
  const Severity severity = finding.severity;
  if (!known) list_.push_back(std::move(finding));
  return severity;
}

Severity Findings::add(Severity severity, std::string kind, std::string file, std::size_t line, std::string column,
                       std::string what, std::string remedy) {
  return add(
      Finding{severity, std::move(kind), std::move(file), line, std::move(column), std::move(what), std::move(remedy)});
}

void Findings::fail_later(std::string kind, std::string file, std::size_t line, std::string column, std::string what,
                          std::string remedy) {
  Finding finding{Severity::error,   std::move(kind), std::move(file),  line,
                  std::move(column), std::move(what), std::move(remedy)};
  shorten(finding);
  list_.push_back(std::move(finding));
}

void Findings::fail(std::string kind, std::string file, std::size_t line, std::string what, std::string remedy) {
  Finding finding{Severity::error, std::move(kind), std::move(file), line, "", std::move(what), std::move(remedy)};
  shorten(finding);
  list_.push_back(std::move(finding));
  throw DataError(list_);
}

bool Findings::has_errors() const {
  return std::any_of(list_.begin(), list_.end(), [](const Finding& f) { return f.severity == Severity::error; });
}

void Findings::throw_if_errors() const {
  if (has_errors()) throw DataError(list_);
}

}  // namespace flexspline::data
