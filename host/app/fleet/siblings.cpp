#include "host/app/fleet/siblings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "host/input/data/recording.hpp"

namespace flexspline::fleet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kGaussian = 1.4826;  // standard deviations of a normal distribution in a median distance

double median_of(std::vector<double> values) {
  const std::size_t half = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half), values.end());
  const double upper = values[half];
  if (values.size() % 2 != 0) return upper;
  return 0.5 * (upper + *std::max_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(half)));
}

struct Centre {
  double median;
  double deviation;
};
Centre centre_of(const std::vector<double>& values) {
  const double median = median_of(values);
  std::vector<double> distances;
  distances.reserve(values.size());
  for (const double value : values) distances.push_back(std::abs(value - median));
  return {median, kGaussian * median_of(std::move(distances))};
}

json read_json(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FleetError(fmt::format("{} cannot be read; is the path right?", file.string()));
  json content = json::parse(in, nullptr, false);
  if (content.is_discarded())
    throw FleetError(fmt::format("{} is no JSON; delete it and run flexspline fleet run again", file.string()));
  return content;
}
bool is_result(const json& content) {
  return content.is_object() && content.value("format", json()) == json(kResultFormat);
}

// A folder with a drive's measurements in it.
bool is_of_a_drive(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return false;
  if (fs::exists(folder / "dataset.toml", error) || fs::exists(folder / "base-model.toml", error)) return true;
  const auto entries = fs::directory_iterator(folder, error);
  return !error && std::any_of(begin(entries), end(entries),
                               [](const fs::directory_entry& entry) { return data::is_recording(entry.path()); });
}

// A drive whose job never wrote anything: it counts, or the missing drive would go unnoticed.
DriveResult without_result(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  DriveResult result;
  result.drive = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  result.file = folder;
  result.failed =
      fmt::format("there is no {} in {}; run flexspline fleet run {}", kResultName, folder.string(), folder.string());
  return result;
}

// Results at a place that the user named.
void gather(const fs::path& place, std::vector<DriveResult>& results) {
  std::error_code error;
  if (!fs::is_directory(place, error)) {
    results.push_back(result_from(read_json(place), place));
    return;
  }
  if (fs::exists(place / kResultName, error)) {
    results.push_back(result_from(read_json(place / kResultName), place / kResultName));
    return;
  }
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(place)) entries.push_back(entry.path());
  std::sort(entries.begin(), entries.end());
  const std::size_t before = results.size();
  for (const fs::path& entry : entries) {
    if (fs::exists(entry / kResultName, error)) {
      results.push_back(result_from(read_json(entry / kResultName), entry / kResultName));
    } else if (entry.extension() == ".json") {
      // Others may be here, too.
      const json content = read_json(entry);
      if (is_result(content)) results.push_back(result_from(content, entry));
    } else if (is_of_a_drive(entry)) {
      results.push_back(without_result(entry));
    }
  }
  if (results.size() == before && is_of_a_drive(place)) results.push_back(without_result(place));
}

}  // namespace

DriveResult result_from(const json& content, const fs::path& file) {
  if (!is_result(content))
    throw FleetError(fmt::format("{} is no result of flexspline fleet run (format {})", file.string(), kResultFormat));
  DriveResult result;
  result.file = file;
  try {
    result.drive = content.at("drive").get<std::string>();
    if (!content.at("failed").is_null()) result.failed = content.at("failed").get<std::string>();
    if (!result.failed.empty()) return result;
    const auto number = [](const json& value) {
      return value.is_null() ? std::optional<double>() : std::optional(value.get<double>());
    };
    for (const json& p : content.at("parameters")) {
      const auto value = number(p.at("value"));
      if (value && p.value("identifiable", true))
        result.quantities.push_back({p.at("id").get<std::string>() + "." + p.at("parameter").get<std::string>(),
                                     p.at("unit").get<std::string>(), *value, number(p.at("std"))});
    }
    for (const json& e : content.at("errors"))
      if (const auto value = number(e.at("rmse")))
        result.quantities.push_back(
            {"error of " + e.at("signal").get<std::string>(), e.at("unit").get<std::string>(), *value, std::nullopt});
    if (!content.at("diagnosis").is_null()) {
      result.verdict = content["diagnosis"].at("verdict").get<std::string>();
      for (const json& one : content["diagnosis"].at("named"))
        result.named.push_back(one.at("effect").get<std::string>());
    }
  } catch (const json::exception& wrong) {
    throw FleetError(
        fmt::format("{} is damaged ({}); delete it and run flexspline fleet run again", file.string(), wrong.what()));
  }
  return result;
}

std::vector<DriveResult> read_results(const std::vector<fs::path>& places) {
  std::vector<DriveResult> results;
  for (const fs::path& place : places) gather(place, results);
  const bool none = std::all_of(results.begin(), results.end(), [](const DriveResult& result) {
    return fs::is_directory(result.file);  // where no job wrote anything
  });
  if (none)
    throw FleetError(fmt::format("there are no results in {}; flexspline fleet run makes one a drive",
                                 places.empty() ? std::string("no place") : places.front().string()));
  // Folders of one name in different places.
  std::map<std::string, int> often;
  for (const DriveResult& result : results) ++often[result.drive];
  for (DriveResult& result : results)
    if (often[result.drive] > 1) result.drive = result.file.string();
  return results;
}

double usual_limit(std::size_t drives, std::size_t quantities) {
  constexpr std::size_t kFleets = 20000;
  constexpr double kFalse = 0.01;
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> largest(kFleets), values(drives);
  for (double& most : largest) {
    for (double& value : values) value = normal(random);
    const Centre centre = centre_of(values);
    most = 0.0;
    for (const double value : values) most = std::max(most, std::abs(value - centre.median) / centre.deviation);
  }
  const double share = kFalse / static_cast<double>(std::max<std::size_t>(quantities, 1));
  const auto above = static_cast<std::size_t>(std::max(1.0, share * static_cast<double>(kFleets)));
  std::nth_element(largest.begin(), largest.end() - static_cast<std::ptrdiff_t>(above), largest.end());
  return largest[kFleets - above];
}

Merged merge(const std::vector<DriveResult>& results, std::optional<double> limit) {
  Merged merged;
  std::vector<const DriveResult*> good;
  for (const DriveResult& result : results) (result.failed.empty() ? good : merged.failed).push_back(&result);
  std::vector<std::string> names;  // in the order of their first use
  for (const DriveResult* result : good)
    for (const Quantity& q : result->quantities)
      if (std::find(names.begin(), names.end(), q.name) == names.end()) names.push_back(q.name);
  merged.limit = limit ? *limit : good.size() < kFewestDrives ? INFINITY : usual_limit(good.size(), names.size());

  for (const std::string& name : names) {
    std::vector<double> values;
    std::vector<std::pair<const DriveResult*, const Quantity*>> all;
    for (const DriveResult* result : good)
      for (const Quantity& q : result->quantities)
        if (q.name == name) {
          values.push_back(q.value);
          all.push_back({result, &q});
        }
    if (all.empty()) continue;
    const Centre centre = centre_of(values);
    merged.spreads.push_back({name, all.front().second->unit, all.size(), centre.median, centre.deviation});
    if (all.size() < kFewestDrives) continue;
    for (const auto& [result, q] : all) {
      // A value that is itself uncertain is not reported, and where most are equal to the last digit, rounding is none.
      const double deviation =
          std::max({centre.deviation, q->std.value_or(0.0), 1e-9 * std::abs(centre.median), 1e-300});
      const double z = (q->value - centre.median) / deviation;
      if (std::abs(z) > merged.limit)
        merged.differences.push_back({result->drive, name, q->unit, q->value, centre.median, deviation, z});
    }
  }
  std::stable_sort(merged.differences.begin(), merged.differences.end(),
                   [](const Difference& a, const Difference& b) { return std::abs(a.z) > std::abs(b.z); });

  // The most frequent verdict of the diagnosis.
  const auto said = [](const DriveResult& result) {
    std::string text = result.verdict;
    for (const std::string& effect : result.named) text += " " + effect;
    return text;
  };
  std::map<std::string, std::size_t> often;
  for (const DriveResult* result : good)
    if (!result->verdict.empty()) ++often[said(*result)];
  for (const auto& [verdict, count] : often)
    if (merged.usual_verdict.empty() || count > often[merged.usual_verdict]) merged.usual_verdict = verdict;
  for (const DriveResult* result : good)
    if (!result->verdict.empty() && said(*result) != merged.usual_verdict) merged.verdicts.push_back(result);
  return merged;
}

}  // namespace flexspline::fleet
