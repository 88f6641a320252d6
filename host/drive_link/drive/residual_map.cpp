#include "host/drive_link/drive/residual_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "shared/control/residual_map.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/protocol/map_payloads.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::drive {
namespace {

using protocol::Kind;
using protocol::MapAction;

constexpr double kLeastIndependent = 20.0;  // samples of a velocity bin that is tested

protocol::MapInfo info_of(Session& session) {
  const protocol::Identity& id = session.identity();
  if (id.minor < protocol::kMinorOfMap)
    session.fail(
        fmt::format("its firmware speaks version {}.{} of the protocol; a residual map needs {}.{}: bring the "
                    "firmware up to date",
                    id.major, id.minor, protocol::kMajor, protocol::kMinorOfMap));
  const auto info = session.ask<protocol::MapInfo>(Kind::map_info);
  if (info.angle_bins == 0 || info.edge_count == 0 || info.scale <= 0)
    session.fail("its residual map could not be read; update the tool");
  return info;
}
void command(Session& session, MapAction action) {
  const protocol::Message m = session.exchange(protocol::request(Kind::map_command, 0, protocol::MapCommand{action}));
  const auto code = static_cast<protocol::Code>(m.code);
  protocol::CommandAnswer answer;
  const bool has_reason = protocol::take_payload(m.content(), answer) == protocol::Code::done;
  if (code == protocol::Code::refused && has_reason) session.fail(std::string(protocol::text_of(answer.refusal)));
  if (code != protocol::Code::done) session.fail(std::string(protocol::text_of(code)));
}

double independent_of(const ResidualMap& map, double ticks) {
  return ticks * map.tick_s / kIndependent_s;
}
// Of an independent sample of a row: the scatter inside of its bins, of which each has taken its own mean away. No
// scatter is smaller than that of rounding to the map's units.
double variance_of(std::span<const ResidualBin> row, const ResidualMap& map) {
  double ticks = 0.0, squares = 0.0;
  for (const ResidualBin& bin : row) {
    ticks += bin.ticks;
    squares += bin.ticks * bin.std_nm * bin.std_nm;
  }
  const double samples = independent_of(map, ticks);
  const double left = std::max(samples - static_cast<double>(row.size()), 0.25 * samples);
  return std::max(squares / ticks, map.unit_nm * map.unit_nm / 12.0) * samples / left;
}

struct Mean {
  double value = 0.0;
  double std = 0.0;
  double ticks = 0.0;
};
Mean mean_of(std::span<const ResidualBin> row, const ResidualMap& map) {
  Mean mean;
  double squares = 0.0;
  for (const ResidualBin& bin : row) {
    mean.ticks += bin.ticks;
    mean.value += bin.ticks * bin.mean_nm;
    squares += bin.ticks * (bin.std_nm * bin.std_nm + bin.mean_nm * bin.mean_nm);
  }
  if (mean.ticks == 0.0) return mean;
  mean.value /= mean.ticks;
  // Scatter with the structure over the angle in it: half a turn is not a whole one.
  const double variance = std::max(squares / mean.ticks - mean.value * mean.value, map.unit_nm * map.unit_nm / 12.0);
  mean.std = std::sqrt(variance / std::max(independent_of(map, mean.ticks), 1e-9));
  return mean;
}

// Amplitude of an order in a row, and the variance of each of its two coefficients; a bin's width takes from it.
struct Amplitude {
  double squared = 0.0;
  double variance = 0.0;
};
Amplitude amplitude_of(std::span<const ResidualBin> row, const ResidualMap& map, int order) {
  const auto n = static_cast<double>(row.size());
  const double of_sample = variance_of(row, map);
  double cosine = 0.0, sine = 0.0, variance = 0.0;
  for (std::size_t a = 0; a < row.size(); ++a) {
    const double angle = kTurn * order * (static_cast<double>(a) + 0.5) / n;
    cosine += 2.0 / n * row[a].mean_nm * std::cos(angle);
    sine += 2.0 / n * row[a].mean_nm * std::sin(angle);
    variance += 2.0 / (n * n) * of_sample / independent_of(map, row[a].ticks);
  }
  const double half = std::numbers::pi * order / n;
  const double width = std::pow(std::sin(half) / half, 2);
  return {(cosine * cosine + sine * sine) / width, variance / width};
}
// Of chi squared with 2 k degrees of freedom, above x: a Poisson distribution up to k - 1.
double chi2_tail(double x, std::size_t k) {
  double term = std::exp(-0.5 * x), sum = 0.0;
  for (std::size_t j = 0; j < k; ++j) {
    sum += term;
    term *= 0.5 * x / static_cast<double>(j + 1);
  }
  return sum;
}

}  // namespace

ResidualMap::Range ResidualMap::velocity(std::size_t bin) const {
  const std::size_t middle = edges_rad_s.size();
  if (bin == middle) return {-edges_rad_s.front(), edges_rad_s.front()};
  const std::size_t k = bin > middle ? bin - middle : middle - bin;
  const double low = edges_rad_s[k - 1];
  const double high = k < edges_rad_s.size() ? edges_rad_s[k] : std::numeric_limits<double>::infinity();
  return bin > middle ? Range{low, high} : Range{-high, -low};
}
double ResidualMap::seconds() const {
  double ticks = 0.0;
  for (const ResidualBin& bin : bins) ticks += bin.ticks;
  return ticks * tick_s;
}

ResidualMap read_residual_map(Session& session, const Scales& scales) {
  const protocol::MapInfo info = info_of(session);
  ResidualMap map;
  map.is_linear = scales.is_linear();
  map.counts = info.counts;
  map.tick_s = static_cast<double>(control::ResidualMap::kEveryTicks) / session.identity().tick_hz;
  map.angle_bins = info.angle_bins;
  map.unit_nm = std::ldexp(scales.constants.torque_base, fixed::kValueBits) / static_cast<double>(info.scale);
  for (std::size_t i = 0; i < info.edge_count; ++i)
    map.edges_rad_s.push_back(std::ldexp(info.edges[i], -fixed::kValueBits) * scales.constants.velocity_base);
  const std::size_t all = map.velocity_bins() * map.angle_bins;
  while (map.bins.size() < all) {
    const protocol::MapFirst wanted{static_cast<std::uint16_t>(map.bins.size())};
    const auto part = session.ask<protocol::MapBins>(Kind::map_bins, wanted);
    if (part.first != wanted.first || part.count == 0)
      session.fail("what it sends is not a part of its residual map; try again");
    for (std::size_t i = 0; i < part.count && map.bins.size() < all; ++i) {
      const protocol::MapBin& bin = part.bins[i];
      ResidualBin out{bin.count, 0.0, 0.0};
      if (bin.count > 0) {
        const double mean = static_cast<double>(bin.sum) / bin.count;
        out.mean_nm = map.unit_nm * mean;
        out.std_nm = map.unit_nm * std::sqrt(std::max(static_cast<double>(bin.squares) / bin.count - mean * mean, 0.0));
      }
      map.bins.push_back(out);
    }
  }
  map.of_one_moment = info_of(session).version == info.version;
  return map;
}

bool start_residual_map(Session& session, const std::optional<PairingSigner>& signer) {
  if (info_of(session).counts) return false;
  const Unlocked unlocked(session, signer);
  command(session, MapAction::reset);
  command(session, MapAction::start);
  return true;
}

void reset_residual_map(Session& session, const std::optional<PairingSigner>& signer) {
  info_of(session);
  const Unlocked unlocked(session, signer);
  command(session, MapAction::reset);
}

std::string_view name_of(MapVerdict verdict) {
  switch (verdict) {
    case MapVerdict::too_little_data:
      return "too_little_data";
    case MapVerdict::model_fits:
      return "model_fits";
    case MapVerdict::model_fails:
      return "model_fails";
  }
  return "";
}

MapTest test_map(const ResidualMap& map, double limit_nm) {
  MapTest out;
  const auto row_of = [&](std::size_t v) { return std::span(map.bins).subspan(v * map.angle_bins, map.angle_bins); };
  std::vector<std::size_t> tested, whole;
  for (std::size_t v = 0; v < map.velocity_bins(); ++v) {
    if (v == map.edges_rad_s.size()) continue;
    const auto row = row_of(v);
    if (independent_of(map, mean_of(row, map).ticks) < kLeastIndependent) continue;
    tested.push_back(v);
    // An order needs the whole turn, and an independent sample or so of each part of it.
    if (std::ranges::all_of(row, [&](const ResidualBin& b) { return independent_of(map, b.ticks) >= 0.25; }))
      whole.push_back(v);
  }
  out.tested_bins = tested.size();
  if (tested.empty()) return out;
  const double tests = static_cast<double>(tested.size()) + (whole.empty() ? 0.0 : kMostMapOrder);
  ResidualMap::Range range{map.velocity(tested.front()).low, map.velocity(tested.back()).high};

  std::size_t last = 0;
  for (const std::size_t v : tested) {
    const Mean mean = mean_of(row_of(v), map);
    const double p = std::min(1.0, tests * std::erfc(std::abs(mean.value) / mean.std / std::numbers::sqrt2));
    if (p > kMapCertainty || std::abs(mean.value) < limit_nm) continue;
    const ResidualMap::Range here = map.velocity(v);
    // Neighbours of one sign are one finding.
    if (!out.findings.empty() && last + 1 == v && (out.findings.back().size_nm > 0.0) == (mean.value > 0.0)) {
      MapFinding& before = out.findings.back();
      before.velocity.high = here.high;
      if (std::abs(mean.value) > std::abs(before.size_nm)) before.size_nm = mean.value, before.std_nm = mean.std;
      before.p_value = std::min(before.p_value, p);
    } else {
      out.findings.push_back({0, here, mean.value, mean.std, p});
    }
    last = v;
  }
  for (int order = 1; order <= kMostMapOrder && !whole.empty(); ++order) {
    double x = 0.0, squared = 0.0, variance = 0.0;
    for (const std::size_t v : whole) {
      const Amplitude a = amplitude_of(row_of(v), map, order);
      x += a.squared / a.variance;
      squared += std::max(a.squared - 2.0 * a.variance, 0.0) / static_cast<double>(whole.size());
      variance += a.variance / static_cast<double>(whole.size() * whole.size());
    }
    const double p = std::min(1.0, tests * chi2_tail(x, whole.size()));
    if (p <= kMapCertainty && std::sqrt(squared) >= limit_nm)
      out.findings.push_back({order, range, std::sqrt(squared), std::sqrt(variance), p});
  }
  std::ranges::stable_sort(out.findings, [](const MapFinding& a, const MapFinding& b) {
    return std::abs(a.size_nm) / a.std_nm > std::abs(b.size_nm) / b.std_nm;
  });
  out.verdict = out.findings.empty() ? MapVerdict::model_fits : MapVerdict::model_fails;
  return out;
}

}  // namespace flexspline::drive
