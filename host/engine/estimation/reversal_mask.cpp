#include "host/engine/estimation/reversal_mask.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "host/engine/estimation/cancellation.hpp"
#include "host/engine/estimation/filtered_signals.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::estimation {
namespace {

// Marks what is within `reach` samples of a sample for which `bad` holds.
std::vector<std::uint8_t> spread(const std::vector<std::uint8_t>& bad, std::size_t reach) {
  std::vector<std::uint8_t> marked(bad.size(), 0);
  std::ptrdiff_t last = -1;
  const auto n = static_cast<std::ptrdiff_t>(bad.size());
  const auto r = static_cast<std::ptrdiff_t>(reach);
  for (std::ptrdiff_t k = 0; k < n; ++k) {
    if (!bad[static_cast<std::size_t>(k)]) continue;
    for (std::ptrdiff_t j = std::max(last + 1, k - r); j <= std::min(n - 1, k + r); ++j) {
      marked[static_cast<std::size_t>(j)] = 1;
      last = j;
    }
  }
  return marked;
}

bool has_torsion(const Record& r) {
  return !r.torque.empty() && r.has_motor_motion && r.has_output_motion && !r.at_rest;
}

double mean_torsion(const Record& r) {
  double sum = 0.0;
  for (std::size_t k = 0; k < r.inputs.size(); ++k) sum += r.inputs.torsion_at(k);
  return sum / static_cast<double>(r.inputs.size());
}

// Whether the torsion of a record is far above its noise, whatever its rate is. Noise of a position that is white below
// the cut-off has a rate of 2 pi f / sqrt(3) times its own deviation.
bool has_large_torsion(const Record& r, double cutoff_hz) {
  constexpr double kLarge = 10.0;
  if (!has_torsion(r)) return false;
  const double middle = mean_torsion(r);
  double squares = 0.0;
  for (std::size_t k = 0; k < r.inputs.size(); ++k) squares += std::pow(r.inputs.torsion_at(k) - middle, 2);
  const double deviation = std::sqrt(squares / static_cast<double>(r.inputs.size()));
  const double noise =
      r.velocity_noise[index(Balance::transmission)] * std::sqrt(3.0) / (2.0 * std::numbers::pi * cutoff_hz);
  return deviation > kLarge * noise;
}

// Of the samples that the best cut-off leaves of a record. The information of a fit goes with the number of samples:
// with less than a tenth the record is as good as lost, and then so many are wanted. From 0.05 to 0.17 the report's
// tables and the coverage of intervals come out as they should; at 0.25 the intervals are too wide.
constexpr double kLeastOfTheBest = 0.1, kThenOfTheBest = 0.9;
constexpr double kWorthKeeping = 0.025;  // of a record's samples, in one direction, at its best cut-off
// Of the squares of the torsion: with less the standard error of the stiffness more than doubles. The mask left 0.33 to
// 0.45 of the demo's, and at most 0.11 of those of twenty drawn cobots.
constexpr double kLeastOfTorsion = 0.2;
constexpr double kCutoffStep = 1.25;

double length_of(const Record& r) {
  return r.sample_s * static_cast<double>(r.inputs.size());
}

// The square of a law exp(-(w/v)^2) at this velocity, if it has this direction: a sample's information on the law's
// amplitude. Without a law every sample of the direction counts.
double information(double velocity, int direction, std::optional<double> law_rad_s) {
  if (velocity * direction <= 0.0) return 0.0;
  return law_rad_s ? std::exp(-2.0 * velocity * velocity / (*law_rad_s * *law_rad_s)) : 1.0;
}

// What the mask leaves of a record's information, and what there is without it, per sample.
double information_left(const Record& r, int direction, std::optional<double> law_rad_s) {
  const Rows& rows = r.rows[index(Balance::motor)];
  double sum = 0.0;
  for (const std::size_t k : rows.samples) sum += information(r.inputs.velocity_at(k), direction, law_rad_s);
  const std::size_t all = rows.samples.size() + rows.masked;
  return all > 0 ? sum / static_cast<double>(all) : 0.0;
}
double information_of_all(const Record& r, int direction, std::optional<double> law_rad_s) {
  double sum = 0.0;
  for (std::size_t k = 0; k < r.inputs.size(); ++k) sum += information(r.inputs.velocity_at(k), direction, law_rad_s);
  return r.inputs.size() > 0 ? sum / static_cast<double>(r.inputs.size()) : 0.0;
}

// What the mask has to leave of a record, at rising cut-offs of which the first is the present one.
struct MaskedShare {
  int direction = 1;
  std::optional<double> law_rad_s;
  double worth_keeping = 0.0;     // at the best cut-off
  std::vector<double> at_cutoff;  // see information_left()

  // The lowest cut-off that leaves nearly the most, if the present one leaves next to nothing of that; else 0.
  double cutoff_hz(const std::vector<double>& cutoffs) const {
    const double best = *std::max_element(at_cutoff.begin(), at_cutoff.end());
    if (best < worth_keeping || at_cutoff.front() >= kLeastOfTheBest * best) return 0.0;
    const auto enough = std::ranges::find_if(at_cutoff, [&](double s) { return s >= kThenOfTheBest * best; });
    return cutoffs[static_cast<std::size_t>(enough - at_cutoff.begin())];
  }
};

bool counts(const Record& r) {
  return r.has_motor_motion && !r.at_rest;
}

// A law's amplitude is found from all records together: what the present mask leaves of one direction, where that is
// next to nothing of what there is. Worth keeping is the time of one independent sample, a period of the highest
// cut-off.
std::vector<MaskedShare> shares_of_law(const std::vector<Record>& records, double law_rad_s, double highest_hz) {
  std::vector<MaskedShare> shares;
  for (const int direction : {1, -1}) {
    double left = 0.0, all = 0.0, length_s = 0.0;
    for (const Record& r : records) {
      if (!counts(r)) continue;
      const double record_s = length_of(r);
      left += record_s * information_left(r, direction, law_rad_s);
      all += record_s * information_of_all(r, direction, law_rad_s);
      length_s += record_s;
    }
    if (left < kLeastOfTheBest * all) shares.push_back({direction, law_rad_s, 1.0 / (highest_hz * length_s), {}});
  }
  return shares;
}

std::vector<MaskedShare> shares_of_record(const Record& r) {
  std::vector<MaskedShare> shares;
  for (const int direction : {1, -1})
    if (counts(r) && information_left(r, direction, {}) < kLeastOfTheBest * information_of_all(r, direction, {}))
      shares.push_back({direction, std::nullopt, kWorthKeeping, {}});
  return shares;
}

// What is left of a law's information on all records, by their lengths; `parts` are those of the records.
MaskedShare together(const MaskedShare& law, const std::vector<Record>& records,
                     const std::vector<std::vector<MaskedShare>>& parts, std::size_t which) {
  MaskedShare sum = law;
  double length_s = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::vector<double>& part = parts[i][which].at_cutoff;
    if (part.empty()) continue;
    sum.at_cutoff.resize(part.size(), 0.0);
    length_s += length_of(records[i]);
    for (std::size_t c = 0; c < part.size(); ++c) sum.at_cutoff[c] += length_of(records[i]) * part[c];
  }
  for (double& share : sum.at_cutoff) share /= length_s;
  return sum;
}

struct MaskCutoff {
  double hz = 0.0;     // 0: the present one does
  std::string reason;  // what samples it leaves: a record's name, or a velocity
};

// Slow motion is what such records have: a velocity that is small for its noise puts the friction of one speed at
// another one, so the positions' filter is no wider than it must be.
Pipeline raised(Pipeline pipeline, double cutoff_hz) {
  pipeline.row_cutoff_hz = cutoff_hz;
  pipeline.motion_cutoff_hz = std::max(pipeline.motion_cutoff_hz, cutoff_hz);
  return pipeline;
}

bool masks_most_torsion(const std::vector<Record>& records, const Pipeline& pipeline) {
  double left = 0.0, all = 0.0;
  for (const Record& r : records) {
    if (!has_large_torsion(r, pipeline.row_cutoff_hz)) continue;
    const double middle = mean_torsion(r);
    const auto information = [&](std::size_t k) { return std::pow(r.inputs.torsion_at(k) - middle, 2); };
    for (std::size_t k = 0; k < r.inputs.size(); k += r.decimation) all += information(k);
    if (shows_torsion(r))
      for (const std::size_t k : r.rows[index(Balance::transmission)].samples) left += information(k);
  }
  return left < kLeastOfTorsion * all;
}

}  // namespace

void choose_rows(Record& record, const Pipeline& pipeline) {
  const std::size_t n = record.inputs.size();
  const auto reach = static_cast<std::size_t>(std::lround(kMaskReach / (pipeline.row_cutoff_hz * record.sample_s)));
  std::vector<std::uint8_t> unusable(n, 1);
  for (const data::Segment& s : record.segments) {
    // The ends of a segment carry the filters' guess of what is beyond; short segments keep at least their middle.
    const std::size_t edge = std::min(record.settling, (s.last - s.first) / 10);
    for (std::size_t k = s.first + edge; k + edge < s.last; ++k) unusable[k] = 0;
  }
  const std::vector<std::uint8_t> clipped = spread(record.experiment->masked, reach);
  for (const Balance balance : {Balance::motor, Balance::transmission, Balance::load}) {
    Rows& rows = record.rows[index(balance)];
    rows = {};
    std::vector<std::uint8_t> unsure(n, 0);
    const bool is_kept = (balance == Balance::motor && pipeline.keep_motor_reversals) ||
                         (balance == Balance::transmission && pipeline.keep_torsion_reversals &&
                          has_large_torsion(record, pipeline.row_cutoff_hz));
    if (pipeline.mask && !is_kept && !record.at_rest) {
      const double visible = 3.0 * record.velocity_noise[index(balance)];
      for (std::size_t k = 0; k < n; ++k) {
        const double v = record.direction_variable(balance, k);
        const double before = k > 0 ? record.direction_variable(balance, k - 1) : v;
        unsure[k] = std::abs(v) <= visible || v * before < 0.0;  // a position that stays is without noise, too
      }
      unsure = spread(unsure, reach);
    }
    for (std::size_t k = 0; k < n; k += record.decimation) {
      if (unusable[k]) continue;
      if (unsure[k] || (!clipped.empty() && clipped[k]))
        ++rows.masked;
      else
        rows.samples.push_back(k);
    }
  }
}

bool shows_torsion(const Record& r) {
  return has_torsion(r) && r.rows[index(Balance::transmission)].samples.size() >= kFewestRows;
}

bool masks_most_torsion(const PreparedData& prepared) {
  return masks_most_torsion(prepared.records, prepared.pipeline);
}

std::optional<double> slowest_law_rad_s(const model::Model& model) {
  std::optional<double> slowest;
  for (const model::Effect& effect : model.effects) {
    const catalogue::Entry* entry = catalogue::find(effect.type);
    if (!entry) continue;
    for (const effects::ParameterInfo& info : entry->parameters) {
      const model::Parameter* p = effect.find(info.name);
      if (info.limit != effects::Limit::velocity || !p || !p->fixed || !p->value) continue;
      slowest = std::min(slowest.value_or(*p->value), *p->value);
    }
  }
  return slowest;
}

namespace {

MaskCutoff cutoff_for_mask(const PreparedData& prepared, double highest_hz, std::optional<double> law_rad_s) {
  const std::vector<Record>& records = prepared.records;
  std::vector<double> cutoffs;
  for (double hz = prepared.pipeline.row_cutoff_hz; hz < highest_hz; hz *= kCutoffStep) cutoffs.push_back(hz);
  cutoffs.push_back(highest_hz);
  std::vector<MaskedShare> of_law;
  if (law_rad_s) of_law = shares_of_law(records, *law_rad_s, highest_hz);
  std::vector<std::vector<MaskedShare>> parts(records.size(), of_law);
  std::vector<double> wanted(records.size(), 0.0);
  in_parallel(records.size(), [&](std::size_t i) {
    std::vector<MaskedShare> of_record = shares_of_record(records[i]);
    if (!counts(records[i]) || (of_law.empty() && of_record.empty())) return;
    for (const double hz : cutoffs) {
      throw_if_cancelled();
      const Pipeline tried = raised(prepared.pipeline, hz);
      Record again = with_signals(*records[i].experiment, prepared, tried);
      choose_rows(again, tried);
      for (std::vector<MaskedShare>* shares : {&of_record, &parts[i]})
        for (MaskedShare& s : *shares) s.at_cutoff.push_back(information_left(again, s.direction, s.law_rad_s));
    }
    for (const MaskedShare& share : of_record) wanted[i] = std::max(wanted[i], share.cutoff_hz(cutoffs));
  });
  MaskCutoff best;
  for (std::size_t i = 0; i < records.size(); ++i)
    if (wanted[i] > best.hz) best = {wanted[i], records[i].name};
  for (std::size_t d = 0; d < of_law.size(); ++d) {
    const double hz = together(of_law[d], records, parts, d).cutoff_hz(cutoffs);
    if (hz > best.hz) best = {hz, fmt::format("{:.4g} rad/s, which the model's friction needs", *law_rad_s)};
  }
  return best;
}

}  // namespace

bool raise_cutoff_for_torsion(PreparedData& prepared, double highest_hz) {
  Pipeline& pipeline = prepared.pipeline;
  std::vector<const data::Experiment*> large;
  for (const Record& r : prepared.records)
    if (has_large_torsion(r, pipeline.row_cutoff_hz)) large.push_back(r.experiment);
  for (double hz = kCutoffStep * pipeline.row_cutoff_hz; hz < kCutoffStep * highest_hz; hz *= kCutoffStep) {
    const Pipeline tried = raised(pipeline, std::min(std::ceil(hz), highest_hz));
    std::vector<Record> again(large.size());
    in_parallel(large.size(), [&](std::size_t i) {
      throw_if_cancelled();
      again[i] = with_signals(*large[i], prepared, tried);
      choose_rows(again[i], tried);
    });
    if (masks_most_torsion(again, tried)) continue;
    pipeline = tried;
    pipeline.reason +=
        fmt::format("; raised to {:.4g} Hz, so that the mask leaves samples of the torsion", pipeline.row_cutoff_hz);
    return true;
  }
  return false;
}

bool raise_cutoff_for_mask(PreparedData& prepared, std::optional<double> law_rad_s, double highest_hz) {
  Pipeline& pipeline = prepared.pipeline;
  const MaskCutoff wanted = cutoff_for_mask(prepared, highest_hz, law_rad_s);
  if (wanted.hz <= pipeline.row_cutoff_hz) return false;
  pipeline = raised(pipeline, std::min(std::ceil(wanted.hz), highest_hz));
  pipeline.reason += fmt::format("; raised to {:.4g} Hz, so that the mask leaves samples of {}", pipeline.row_cutoff_hz,
                                 wanted.reason);
  return true;
}

}  // namespace flexspline::estimation
