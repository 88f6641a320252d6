#include "host/engine/selection/disturbances.hpp"
#include "host/common/numbers/quantile.hpp"
#include "host/engine/selection/policy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "host/common/signals/spectrum.hpp"

namespace flexspline::selection {
namespace {

using estimation::Record;
using estimation::RegressionProblem;
using estimation::RowRange;

// The residual less a running median, which a burst does not change. What is then beyond far_out robust standard
// deviations is an outlier by the Hampel identifier (Hampel 1974).
std::vector<double> without_slow_part(const Eigen::VectorXd& residual, const RowRange& range, std::size_t half_window) {
  const auto n = static_cast<std::size_t>(range.size());
  std::vector<double> fast(n), window;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t low = k > half_window ? k - half_window : 0, high = std::min(n, k + half_window + 1);
    window.assign(residual.data() + range.first + static_cast<Eigen::Index>(low),
                  residual.data() + range.first + static_cast<Eigen::Index>(high));
    const auto middle = window.begin() + static_cast<std::ptrdiff_t>(window.size() / 2);
    std::nth_element(window.begin(), middle, window.end());
    fast[k] = residual[range.first + static_cast<Eigen::Index>(k)] - *middle;
  }
  return fast;
}

// For each sample, the share of the samples nearest in `signal` that are marked.
std::vector<double> share_among_like(const std::vector<double>& signal, const std::vector<std::uint8_t>& marked) {
  const std::size_t n = signal.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return signal[a] < signal[b]; });
  std::vector<std::size_t> sum(n + 1, 0);
  for (std::size_t k = 0; k < n; ++k) sum[k + 1] = sum[k] + marked[order[k]];
  std::vector<double> share(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t half = std::min(kPolicy.like_rows / 2, n / 4);
    const std::size_t low = k > half ? k - half : 0, high = std::min(n, k + half + 1);
    share[order[k]] = static_cast<double>(sum[high] - sum[low]) / static_cast<double>(high - low);
  }
  return share;
}

// Samples whose residual is above the limit one period of the motion earlier or later as well: a residual that repeats
// with the motion belongs to the drive.
std::vector<std::uint8_t> recurs(const Record& r, const std::vector<std::size_t>& samples,
                                 const std::vector<double>& size, double limit, std::size_t reach) {
  std::vector<std::uint8_t> again(size.size(), 0);
  const std::vector<double>& position = (*r.experiment)[data::Column::motor_position];
  if (position.empty()) return again;
  const auto repetition = signals::find_repetition(position);
  if (!repetition) return again;
  std::vector<std::uint8_t> near(r.inputs.size(), 0);
  const std::size_t wide = reach * r.decimation;
  for (std::size_t k = 0; k < size.size(); ++k)
    if (size[k] > limit)
      for (std::size_t j = samples[k] - std::min(samples[k], wide); j <= std::min(near.size() - 1, samples[k] + wide);
           ++j)
        near[j] = 1;
  for (std::size_t k = 0; k < size.size(); ++k) {
    const std::size_t later = samples[k] + repetition->samples;
    again[k] = (later < near.size() && near[later]) ||
               (samples[k] >= repetition->samples && near[samples[k] - repetition->samples]);
  }
  return again;
}

// For each sample, the largest share of marked samples among its neighbours in a signal that an effect may depend on:
// velocity, time since a reversal, angle, torsion.
std::vector<double> share_among_like(const RegressionProblem& data, const Record& r,
                                     const std::vector<std::size_t>& samples, const std::vector<std::uint8_t>& marked) {
  const std::size_t n = samples.size();
  std::array<std::vector<double>, 4> signals;
  for (auto& signal : signals) signal.resize(n);
  double reversal = r.experiment->time_s.front();
  std::size_t at = 0;
  for (std::size_t k = 0; k < r.inputs.size() && at < n; ++k) {
    if (k > 0 && r.direction_variable(data.balance(), k) * r.direction_variable(data.balance(), k - 1) <= 0.0)
      reversal = r.experiment->time_s[k];
    if (samples[at] != k) continue;
    signals[0][at] = r.direction_variable(data.balance(), k);
    signals[1][at] = r.experiment->time_s[k] - reversal;
    signals[2][at] = r.inputs.angle_at(k);
    signals[3][at] = r.inputs.torsion_at(k);
    ++at;
  }
  std::vector<double> largest(n, 0.0);
  for (const auto& signal : signals) {
    if (signal.front() == signal.back() && *std::max_element(signal.begin(), signal.end()) == signal.front()) continue;
    const std::vector<double> shares = share_among_like(signal, marked);
    for (std::size_t k = 0; k < n; ++k) largest[k] = std::max(largest[k], shares[k]);
  }
  return largest;
}

// Samples of a record that stand out, and what speaks against a disturbance at each.
struct Outliers {
  std::vector<double> size;  // without the slow part
  std::vector<std::uint8_t> marked, recurring;
  std::vector<double> similar;  // share of marked samples among those like this one
  std::size_t reach = 0;        // of the filter, in samples
};

// Nothing where no sample stands out, or too many do.
std::optional<Outliers> outliers(const RegressionProblem& data, const Eigen::VectorXd& residual, const RowRange& range,
                                 const std::vector<std::size_t>& samples) {
  const Record& r = data.prepared().records[range.record];
  const std::size_t n = samples.size();
  const double row_s = r.sample_s * static_cast<double>(r.decimation);
  Outliers found;
  found.size = without_slow_part(residual, range, static_cast<std::size_t>(std::ceil(kPolicy.longest_burst_s / row_s)));
  for (double& size : found.size) size = std::abs(size);
  const double far = kPolicy.far_out * 1.4826 * numbers::upper_median(found.size);
  found.marked.resize(n);
  for (std::size_t k = 0; k < n; ++k) found.marked[k] = found.size[k] > far;
  const double share =
      static_cast<double>(std::accumulate(found.marked.begin(), found.marked.end(), 0)) / static_cast<double>(n);
  if (share == 0.0 || share > kPolicy.most_disturbed) return std::nullopt;
  found.similar = share_among_like(data, r, samples, found.marked);
  found.reach = static_cast<std::size_t>(std::ceil(1.0 / data.prepared().pipeline.row_cutoff_hz / row_s));
  found.recurring = recurs(r, samples, found.size, 0.6 * far, found.reach);
  return found;
}

// Whether the direction changes from one sample of a record to another.
bool reverses(const RegressionProblem& data, const Record& r, std::size_t first, std::size_t last) {
  for (std::size_t k = first + 1; k <= last; ++k)
    if (r.direction_variable(data.balance(), k) * r.direction_variable(data.balance(), k - 1) <= 0.0) return true;
  return false;
}

// Lists the bursts of a record that are disturbances, and leaves out their samples.
void list_bursts(const RegressionProblem& data, const Record& r, const Outliers& rows,
                 const std::vector<std::size_t>& samples, Eigen::Ref<Eigen::VectorXd> keep,
                 std::vector<Disturbance>& found) {
  const std::size_t n = samples.size(), reach = rows.reach;
  for (std::size_t k = 0; k < n;) {
    if (!rows.marked[k]) {
      ++k;
      continue;
    }
    // One burst may dip below the limit where it changes sign.
    std::size_t end = k, last = k;
    double peak = 0.0, explained = 0.0, count = 0.0;
    while (end < n && end - last <= 2 * reach && samples[end] - samples[last] <= 4 * reach * r.decimation) {
      if (rows.marked[end]) {
        last = end;
        peak = std::max(peak, rows.size[end]);
        explained += rows.recurring[end] ? 1.0 : rows.similar[end];
        count += 1.0;
      }
      ++end;
    }
    const double from = r.experiment->time_s[samples[k]], to = r.experiment->time_s[samples[last]];
    const std::size_t low = k > reach ? k - reach : 0, high = std::min(n - 1, last + reach);
    // At a reversal or a start, which the mask may have left out, friction that the model lacks has the same residual.
    const std::size_t before = low > reach ? low - reach : 0, after = std::min(n - 1, high + reach);
    const bool next_to_mask =
        samples[after] - samples[before] != (after - before) * r.decimation || before == 0 || after == n - 1;
    if (to - from <= kPolicy.longest_burst_s && explained / count < kPolicy.burst_repeats && !next_to_mask &&
        !reverses(data, r, samples[before], samples[after])) {
      found.push_back({r.name, from, to, peak, {}});
      for (std::size_t j = low; j <= high; ++j) keep[static_cast<Eigen::Index>(j)] = 0.0;
    }
    k = end;
  }
}

}  // namespace

std::vector<Disturbance> find_disturbances(const RegressionProblem& data, const Eigen::VectorXd& residual,
                                           Eigen::VectorXd& keep) {
  constexpr std::size_t kFewestRows = 200;
  std::vector<Disturbance> found;
  for (const RowRange& range : data.records()) {
    const Record& r = data.prepared().records[range.record];
    const auto& samples = r.rows[estimation::index(data.balance())].samples;
    if (r.at_rest || samples.size() < kFewestRows) continue;
    if (const auto rows = outliers(data, residual, range, samples))
      list_bursts(data, r, *rows, samples, keep.segment(range.first, range.size()), found);
  }
  return found;
}

}  // namespace flexspline::selection
