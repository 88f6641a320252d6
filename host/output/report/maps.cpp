#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/comparison/residual_map.hpp"
#include "host/engine/comparison/sample_variables.hpp"
#include "host/engine/estimation/in_parallel.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/report/parts.hpp"

namespace flexspline::report {
namespace {

using comparison::Bins;
using nlohmann::json;
using output::json_number;
using output::json_numbers;

// As residual maps are tested (comparison/residual_map.cpp).
constexpr std::size_t kMostBins = 24;
constexpr std::size_t kRowsPerBin = 16;
constexpr std::size_t kBinsPerWave = 6;
constexpr std::size_t kFewestInMapBin = 8;
constexpr int kOrders = 24;
constexpr double kWholeWaves = 2.0;

struct BinnedMean {
  std::vector<double> mean, standard_error;
};

// Mean of the residual by bin, times the direction of motion where that is given. Neighbouring samples count as one as
// far as what the map leaves is correlated.
BinnedMean binned(const BalanceView& balance, const Eigen::VectorXd& residual, const Bins& bins,
                  const Eigen::VectorXd* directions) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto sign = [&](Eigen::Index k) { return directions ? (*directions)[k] : 1.0; };
  const auto bin = [&](Eigen::Index k) { return std::isfinite(sign(k)) ? bins.bin[static_cast<std::size_t>(k)] : -1; };
  std::vector<double> sum(bins.count(), 0.0), rows(bins.count(), 0.0), squares(bins.count(), 0.0);
  for (Eigen::Index k = 0; k < residual.size(); ++k)
    if (bin(k) >= 0) {
      sum[static_cast<std::size_t>(bin(k))] += residual[k] * sign(k);
      rows[static_cast<std::size_t>(bin(k))] += 1.0;
    }
  Eigen::VectorXd left = residual;
  for (Eigen::Index k = 0; k < residual.size(); ++k) {
    if (bin(k) < 0) continue;
    const auto b = static_cast<std::size_t>(bin(k));
    left[k] -= sign(k) * sum[b] / rows[b];
    squares[b] += left[k] * left[k];
  }
  const double tau = std::clamp(estimation::autocorrelation_time(balance.data->records(), left), balance.filter_time,
                                std::max(balance.filter_time, balance.autocorrelation_time));
  BinnedMean result;
  for (std::size_t b = 0; b < bins.count(); ++b) {
    const bool enough = rows[b] >= static_cast<double>(kFewestInMapBin);
    result.mean.push_back(enough ? sum[b] / rows[b] : kNone);
    result.standard_error.push_back(enough ? std::sqrt(squares[b] / rows[b] * std::min(tau, rows[b]) / rows[b])
                                           : kNone);
  }
  return result;
}

json mean_json(const BinnedMean& m) {
  return {{"mean", json_numbers(m.mean)}, {"standard_error", json_numbers(m.standard_error)}};
}

// Standard error of a bin's mean if the residual were noise alone.
std::vector<double> noise_of_means(const BalanceView& balance, const Bins& bins) {
  std::vector<double> squares(bins.count(), 0.0), rows(bins.count(), 0.0);
  for (Eigen::Index k = 0; k < balance.floor_squared.size(); ++k)
    if (const int b = bins.bin[static_cast<std::size_t>(k)]; b >= 0) {
      squares[static_cast<std::size_t>(b)] += balance.floor_squared[k];
      rows[static_cast<std::size_t>(b)] += 1.0;
    }
  std::vector<double> noise;
  for (std::size_t b = 0; b < bins.count(); ++b)
    noise.push_back(std::sqrt(squares[b] / rows[b] * std::min(balance.filter_time, rows[b]) / rows[b]));
  return noise;
}

std::vector<double> centres(const Bins& bins, const Eigen::VectorXd& values) {
  std::vector<double> sum(bins.count(), 0.0), rows(bins.count(), 0.0);
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (const int b = bins.bin[static_cast<std::size_t>(k)]; b >= 0) {
      sum[static_cast<std::size_t>(b)] += values[k];
      rows[static_cast<std::size_t>(b)] += 1.0;
    }
  for (std::size_t b = 0; b < sum.size(); ++b) sum[b] /= rows[b];
  return sum;
}

// Amplitude of each order of the motor's turn in the residual: root mean square of the fitted waves times root two.
// Each record has a phase of its own, so that no common zero of the angle is needed; one that sees less than some whole
// waves is left out.
std::vector<double> order_amplitudes(const View& view, const BalanceView& balance, const Eigen::VectorXd& residual) {
  std::vector<double> amplitudes(kOrders);
  const auto at = estimation::index(balance.data->balance());
  estimation::in_parallel(amplitudes.size(), [&](std::size_t of_order) {
    const auto order = static_cast<double>(of_order + 1);
    const double per_unit = order * view.prepared.constants.turn_angle_scale;
    double squares = 0.0, rows = 0.0;
    for (const estimation::RowRange& range : balance.data->records()) {
      const estimation::Record& record = view.prepared.records[range.record];
      if (!record.has_motor_motion) continue;
      Eigen::MatrixX3d x(range.size(), 3);
      for (Eigen::Index k = 0; k < range.size(); ++k) {
        const double wave = per_unit * record.inputs.angle_at(record.rows[at].samples[static_cast<std::size_t>(k)]);
        x.row(k) << 1.0, std::cos(wave), std::sin(wave);
      }
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const std::size_t sample : record.rows[at].samples) {
        low = std::min(low, record.inputs.angle_at(sample));
        high = std::max(high, record.inputs.angle_at(sample));
      }
      if (per_unit * (high - low) < kWholeWaves * 2.0 * M_PI) continue;
      const Eigen::Vector3d theta = algebra::PivotedQr(x).solve(residual.segment(range.first, range.size()));
      squares += 0.5 * (theta[1] * theta[1] + theta[2] * theta[2]) * static_cast<double>(range.size());
      rows += static_cast<double>(range.size());
    }
    amplitudes[of_order] = rows > 0.0 ? std::sqrt(2.0 * squares / rows) : std::numeric_limits<double>::quiet_NaN();
  });
  return amplitudes;
}

double share_of(const std::vector<comparison::Share>& shares, const std::string& variable) {
  for (const comparison::Share& s : shares)
    if (s.variable == variable) return s.share_percent;
  return 0.0;
}

// Bins of a map, enough to draw each wave of the order that is largest in the residual: fewer would draw it as a wave
// of another order.
std::size_t bins_for(Eigen::Index rows, const std::vector<double>& amplitudes) {
  const auto most = static_cast<std::size_t>(rows) / kRowsPerBin;
  std::size_t wanted = std::clamp<std::size_t>(most, 4, kMostBins);
  const auto largest = std::max_element(amplitudes.begin(), amplitudes.end(),
                                        [](double a, double b) { return !(a >= b) && std::isfinite(b); });
  if (largest == amplitudes.end() || !std::isfinite(*largest)) return wanted;
  const std::size_t order = static_cast<std::size_t>(largest - amplitudes.begin()) + 1;
  return std::max(wanted, std::min(kBinsPerWave * order, most));
}

json map_of(const View& view, const BalanceView& balance, const comparison::SampleVariable& variable,
            const std::vector<comparison::Share>& shares, const Eigen::VectorXd& directions) {
  const std::vector<double> amplitudes =
      variable.name == "motor_angle" ? order_amplitudes(view, balance, balance.residual) : std::vector<double>{};
  const Bins bins = comparison::equal_count_bins(variable.values, bins_for(balance.residual.size(), amplitudes),
                                                 variable.narrowest_bin);
  if (bins.count() < 2) return nullptr;
  json map{{"variable", variable.name},
           {"unit", variable.unit},
           {"x", json_numbers(centres(bins, variable.values))},
           {"edges", json_numbers(bins.edges)},
           {"noise", json_numbers(noise_of_means(balance, bins))},
           {"share_percent", share_of(shares, variable.name)},
           {"share_with_direction_percent", share_of(shares, variable.name + " x direction")},
           {"plain", mean_json(binned(balance, balance.residual, bins, nullptr))},
           {"with_direction", mean_json(binned(balance, balance.residual, bins, &directions))},
           {"plain_before", nullptr},
           {"with_direction_before", nullptr},
           {"orders", nullptr}};
  if (balance.before) {
    map["plain_before"] = mean_json(binned(balance, *balance.before, bins, nullptr));
    map["with_direction_before"] = mean_json(binned(balance, *balance.before, bins, &directions));
  }
  if (variable.name == "motor_angle") {
    map["orders"] = {{"amplitude", json_numbers(amplitudes)}, {"before", nullptr}};
    if (balance.before) map["orders"]["before"] = json_numbers(order_amplitudes(view, balance, *balance.before));
    for (int order = 1; order <= kOrders; ++order)
      map["share_percent"] =
          std::max(map["share_percent"].get<double>(), share_of(shares, fmt::format("motor_angle order {}", order)));
  }
  return map;
}

}  // namespace

json residual_maps(const View& view) {
  json list = json::array();
  for (const BalanceView& balance : view.balances) {
    const Eigen::VectorXd directions = comparison::sample_directions(*balance.data);
    const std::vector<comparison::Share> shares =
        comparison::localise(*balance.data, View::shown(balance), balance.autocorrelation_time, view.axis());
    const std::vector<comparison::SampleVariable> variables = comparison::sample_variables(*balance.data, view.axis());
    std::vector<json> maps(variables.size());
    estimation::in_parallel(maps.size(),
                            [&](std::size_t v) { maps[v] = map_of(view, balance, variables[v], shares, directions); });
    std::erase_if(maps, [](const json& map) { return map.is_null(); });
    const auto strength = [](const json& m) {
      return std::max(m["share_percent"].get<double>(), m["share_with_direction_percent"].get<double>());
    };
    std::stable_sort(maps.begin(), maps.end(), [&](const json& a, const json& b) { return strength(a) > strength(b); });
    list.push_back({{"signal", balance.signal}, {"unit", balance.unit}, {"maps", maps}});
  }
  return list;
}

}  // namespace flexspline::report
