#include "host/selection/setting.hpp"

#include <algorithm>
#include <cmath>

#include "host/signals/butterworth.hpp"

namespace flexspline::selection {
namespace {

constexpr double kRowsPerPeriod = 4.0;
constexpr double kStanding = 0.5;  // periods of the cut-off
constexpr double kVisible = 3.0;   // velocities in units of their noise

}  // namespace

Setting make_setting(const RegressorTable& table, double cutoff_hz, bool mask, bool held_out,
                     const SelectionPolicy& policy) {
  Setting setting;
  setting.cutoff_hz = cutoff_hz;
  setting.mask = mask;
  const Eigen::Index p = table.columns.cols();
  std::vector<Eigen::MatrixXd> kept;  // by run
  std::vector<Run> runs;
  Eigen::Index total = 0;
  for (const Run& run : table.runs) {
    if ((table.held_out[run.record] != 0) != held_out) continue;
    const Eigen::Index n = run.last - run.first;
    Eigen::MatrixXd rows(n, p + 1);
    rows << table.columns.middleRows(run.first, n), table.target.segment(run.first, n);
    if (cutoff_hz < 0.99 * table.highest_hz) {
      const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                            std::min(cutoff_hz, 0.45 / run.row_s), 1.0 / run.row_s);
      filter.apply_columns_in_place(rows);
    }
    const auto step = std::max<Eigen::Index>(
        1, static_cast<Eigen::Index>(std::floor(1.0 / (kRowsPerPeriod * cutoff_hz * run.row_s) + 1e-6)));
    const auto reach = static_cast<Eigen::Index>(std::lround(kFilterReach / (cutoff_hz * run.row_s)));
    const Eigen::Index edge = std::min(reach, n / 10);
    std::vector<std::uint8_t> unsure(static_cast<std::size_t>(n), 0);
    if (mask)
      for (Eigen::Index k = 0; k < n; ++k) {
        const double v = table.velocity_over_noise[run.first + k];
        const double before = k > 0 ? table.velocity_over_noise[run.first + k - 1] : v;
        if (!std::isinf(v) && (std::abs(v) <= kVisible || v * before < 0.0))
          for (Eigen::Index j = std::max<Eigen::Index>(0, k - reach); j <= std::min(n - 1, k + reach); ++j)
            unsure[static_cast<std::size_t>(j)] = 1;
      }
    // Where the axis stands, friction takes any value up to its limit, whatever law holds in motion.
    const auto standing = std::max<Eigen::Index>(2, std::lround(kStanding / (cutoff_hz * run.row_s)));
    for (Eigen::Index k = 0; k < n;) {
      Eigen::Index end = k;
      while (end < n && std::abs(table.velocity_over_noise[run.first + end]) <= kVisible) ++end;
      if (end - k >= standing)
        for (Eigen::Index j = std::max<Eigen::Index>(0, k - reach / 2); j < std::min(n, end + reach / 2); ++j)
          unsure[static_cast<std::size_t>(j)] = 1;
      k = std::max(end, k + 1);
    }
    std::vector<Eigen::Index> take;
    const auto close = [&] {
      if (take.size() >= 4) {
        kept.push_back(rows(take, Eigen::all));
        const auto count = static_cast<Eigen::Index>(take.size());
        runs.push_back({run.record, total, total + count, run.row_s * static_cast<double>(step)});
        total += count;
      }
      take.clear();
    };
    for (Eigen::Index k = edge; k < n - edge; k += step) {
      if (unsure[static_cast<std::size_t>(k)])
        close();
      else
        take.push_back(k);
    }
    close();
  }
  setting.rows.resize(total, p + 1);
  for (std::size_t i = 0; i < runs.size(); ++i)
    setting.rows.middleRows(runs[i].first, runs[i].last - runs[i].first) = kept[i];
  setting.runs = std::move(runs);

  // Blocks: of every record a share of them that follows its rows, and at least two, so that each half can have one.
  std::vector<Eigen::Index> of_record(table.records, 0);
  for (const Run& run : setting.runs) of_record[run.record] += run.last - run.first;
  for (std::size_t r = 0; r < table.records; ++r) {
    if (of_record[r] == 0) continue;
    const auto parts =
        std::max<Eigen::Index>(2, std::lround(static_cast<double>(policy.blocks) * static_cast<double>(of_record[r]) /
                                              static_cast<double>(total)));
    Eigen::Index seen = 0;
    const std::size_t first = setting.blocks.size();
    for (Eigen::Index b = 0; b < parts; ++b) setting.blocks.push_back({r, 0.0, Eigen::MatrixXd::Zero(p + 1, p + 1)});
    for (const Run& run : setting.runs) {
      if (run.record != r) continue;
      for (Eigen::Index k = run.first; k < run.last;) {
        const Eigen::Index b = std::min(parts - 1, (seen * parts) / of_record[r]);
        const Eigen::Index end_of_block = ((b + 1) * of_record[r] + parts - 1) / parts;
        const Eigen::Index many = std::max<Eigen::Index>(1, std::min(run.last - k, end_of_block - seen));
        Block& block = setting.blocks[first + static_cast<std::size_t>(b)];
        block.products.selfadjointView<Eigen::Lower>().rankUpdate(setting.rows.middleRows(k, many).transpose());
        block.rows += static_cast<double>(many);
        k += many;
        seen += many;
      }
    }
  }
  for (Block& block : setting.blocks)
    block.products.triangularView<Eigen::StrictlyUpper>() = block.products.transpose();
  std::erase_if(setting.blocks, [](const Block& b) { return b.rows == 0.0; });
  return setting;
}

double semivariance(const Setting& setting, const Eigen::VectorXd& residual) {
  double sum = 0.0, count = 0.0;
  for (const Run& run : setting.runs) {
    const auto lag = std::max<Eigen::Index>(1, std::lround(1.0 / (setting.cutoff_hz * run.row_s)));
    for (Eigen::Index k = run.first + lag; k < run.last; ++k) {
      const double d = residual[k] - residual[k - lag];
      sum += 0.5 * d * d;
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

}  // namespace flexspline::selection
