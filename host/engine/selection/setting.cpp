#include "host/engine/selection/setting.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/common/signals/butterworth.hpp"

namespace flexspline::selection {
namespace {

constexpr double kRowsPerPeriod = 4.0;
constexpr double kAtRest = 0.5;   // periods of the cut-off
constexpr double kVisible = 3.0;  // velocities in units of their noise

// Samples of a run that are left out: around reversals and sticking where `mask` is set, and where the axis is at rest.
std::vector<std::uint8_t> unsure_rows(const RegressorTable& table, const Run& run, double cutoff_hz, bool mask,
                                      Eigen::Index reach) {
  const Eigen::Index n = run.last - run.first;
  std::vector<std::uint8_t> unsure(static_cast<std::size_t>(n), 0);
  if (mask)
    for (Eigen::Index k = 0; k < n; ++k) {
      const double v = table.velocity_over_noise[run.first + k];
      const double before = k > 0 ? table.velocity_over_noise[run.first + k - 1] : v;
      if (!std::isinf(v) && (std::abs(v) <= kVisible || v * before < 0.0))
        for (Eigen::Index j = std::max<Eigen::Index>(0, k - reach); j <= std::min(n - 1, k + reach); ++j)
          unsure[static_cast<std::size_t>(j)] = 1;
    }
  // Where the axis is at rest, friction takes any value up to its limit, whatever law holds in motion.
  const auto rest_rows = std::max<Eigen::Index>(2, std::lround(kAtRest / (cutoff_hz * run.row_s)));
  for (Eigen::Index k = 0; k < n;) {
    Eigen::Index end = k;
    while (end < n && std::abs(table.velocity_over_noise[run.first + end]) <= kVisible) ++end;
    if (end - k >= rest_rows)
      for (Eigen::Index j = std::max<Eigen::Index>(0, k - reach / 2); j < std::min(n, end + reach / 2); ++j)
        unsure[static_cast<std::size_t>(j)] = 1;
    k = std::max(end, k + 1);
  }
  return unsure;
}

// Samples of the setting, run by run.
struct SelectedRows {
  std::vector<Eigen::MatrixXd> rows;  // by run
  std::vector<Run> runs;
  Eigen::Index total = 0;
};

Eigen::Index width_of(const RegressorTable& table) {
  return table.columns.cols() + 1 + (table.presliding ? table.presliding->columns.cols() + 1 : 0);
}

// Adds the samples of a run, filtered and decimated, without those that are left out.
void take_rows(const RegressorTable& table, const Run& run, double cutoff_hz, bool mask, SelectedRows& kept) {
  const Eigen::Index n = run.last - run.first;
  Eigen::MatrixXd rows(n, width_of(table));
  rows.leftCols(table.columns.cols()) = table.columns.middleRows(run.first, n);
  rows.col(table.columns.cols()) = table.target.segment(run.first, n);
  if (table.presliding) {
    rows.middleCols(table.columns.cols() + 1, table.presliding->columns.cols()) =
        table.presliding->columns.middleRows(run.first, n);
    rows.rightCols(1) = table.presliding->target.segment(run.first, n);
  }
  if (cutoff_hz < 0.99 * table.highest_hz) {
    const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder,
                                          std::min(cutoff_hz, 0.45 / run.row_s), 1.0 / run.row_s);
    filter.apply_columns_in_place(rows);
  }
  const auto step = std::max<Eigen::Index>(
      1, static_cast<Eigen::Index>(std::floor(1.0 / (kRowsPerPeriod * cutoff_hz * run.row_s) + 1e-6)));
  const auto reach = static_cast<Eigen::Index>(std::lround(kFilterReach / (cutoff_hz * run.row_s)));
  const Eigen::Index edge = std::min(reach, n / 10);
  const std::vector<std::uint8_t> unsure = unsure_rows(table, run, cutoff_hz, mask, reach);
  std::vector<Eigen::Index> take;
  const auto close = [&] {
    if (take.size() >= 4) {
      kept.rows.push_back(rows(take, Eigen::all));
      const auto count = static_cast<Eigen::Index>(take.size());
      kept.runs.push_back({run.record, kept.total, kept.total + count, run.row_s * static_cast<double>(step)});
      kept.total += count;
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

// Columns of a setting's rows, by place.
std::vector<Eigen::Index> presliding_columns(const RegressorTable& table) {
  const PreslidingColumns& own = *table.presliding;
  std::vector<Eigen::Index> columns(static_cast<std::size_t>(table.columns.cols()));
  std::iota(columns.begin(), columns.end(), Eigen::Index{0});
  const Eigen::Index first = table.columns.cols() + 1;
  for (std::size_t i = 0; i < own.instead_of.size(); ++i)
    columns[static_cast<std::size_t>(own.instead_of[i])] = first + static_cast<Eigen::Index>(i);
  for (auto i = std::ssize(own.instead_of); i <= own.columns.cols(); ++i) columns.push_back(first + i);
  return columns;
}

// Number of blocks of one record: in proportion to its samples, at least two, so that each half can have one.
void add_blocks(Setting& setting, std::vector<Eigen::MatrixXd>& products, std::size_t record,
                Eigen::Index rows_of_record, std::size_t blocks) {
  const Eigen::Index columns = setting.rows.cols();
  const auto parts =
      std::max<Eigen::Index>(2, std::lround(static_cast<double>(blocks) * static_cast<double>(rows_of_record) /
                                            static_cast<double>(setting.rows.rows())));
  Eigen::Index seen = 0;
  const std::size_t first = setting.blocks.size();
  setting.blocks.resize(first + static_cast<std::size_t>(parts), {record, 0.0});
  products.resize(setting.blocks.size(), Eigen::MatrixXd::Zero(columns, columns));
  for (const Run& run : setting.runs) {
    if (run.record != record) continue;
    for (Eigen::Index k = run.first; k < run.last;) {
      const Eigen::Index b = std::min(parts - 1, (seen * parts) / rows_of_record);
      const Eigen::Index end_of_block = ((b + 1) * rows_of_record + parts - 1) / parts;
      const Eigen::Index many = std::max<Eigen::Index>(1, std::min(run.last - k, end_of_block - seen));
      const std::size_t block = first + static_cast<std::size_t>(b);
      products[block].selfadjointView<Eigen::Lower>().rankUpdate(setting.rows.middleRows(k, many).transpose());
      setting.blocks[block].rows += static_cast<double>(many);
      k += many;
      seen += many;
    }
  }
}

// Puts the products of the blocks into columns, without blocks that have no samples.
void take_products(Setting& setting, std::vector<Eigen::MatrixXd>& products) {
  const Eigen::Index columns = setting.rows.cols();
  std::vector<Block> blocks;
  setting.products.resize(columns * (columns + 1) / 2, std::ssize(products));
  for (std::size_t b = 0; b < products.size(); ++b) {
    if (setting.blocks[b].rows == 0.0) continue;
    setting.products.col(std::ssize(blocks)) = lower_triangle(products[b]);
    blocks.push_back(setting.blocks[b]);
  }
  setting.products.conservativeResize(Eigen::NoChange, std::ssize(blocks));
  setting.blocks = std::move(blocks);
}

}  // namespace

Eigen::VectorXd lower_triangle(const Eigen::MatrixXd& symmetric) {
  const Eigen::Index n = symmetric.cols();
  Eigen::VectorXd packed(n * (n + 1) / 2);
  Eigen::Index at = 0;
  for (Eigen::Index j = 0; j < n; at += n - j, ++j) packed.segment(at, n - j) = symmetric.col(j).tail(n - j);
  return packed;
}

std::vector<BlockRange> blocks_by_record(const Setting& setting) {
  std::vector<BlockRange> ranges;
  for (std::size_t b = 0; b < setting.blocks.size(); ++b) {
    const std::size_t record = setting.blocks[b].record;
    if (ranges.empty() || ranges.back().record != record) ranges.push_back({record, b, b});
    ranges.back().last = b + 1;
  }
  return ranges;
}

Eigen::MatrixXd products_of(const Setting& setting, const Eigen::Ref<const Eigen::VectorXd>& all, Direction direction) {
  const Eigen::Index columns = setting.rows.cols();
  const bool presliding = direction == Direction::presliding;
  const Eigen::Index n = presliding ? std::ssize(setting.presliding) : setting.sign_width;
  Eigen::MatrixXd square(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    if (!presliding) {
      square.col(j).tail(n - j) = all.segment(place_in_triangle(j, j, columns), n - j);
      continue;
    }
    const Eigen::Index own = setting.presliding[static_cast<std::size_t>(j)];
    for (Eigen::Index i = j; i < n; ++i)
      square(i, j) = all[place_in_triangle(setting.presliding[static_cast<std::size_t>(i)], own, columns)];
  }
  square.triangularView<Eigen::StrictlyUpper>() = square.transpose();
  return square;
}

Eigen::MatrixXd products_of(const Setting& setting, const BlockRange& blocks, Direction direction) {
  const Eigen::VectorXd sum =
      setting.products
          .middleCols(static_cast<Eigen::Index>(blocks.first), static_cast<Eigen::Index>(blocks.last - blocks.first))
          .rowwise()
          .sum();
  return products_of(setting, sum, direction);
}

Setting make_setting(const RegressorTable& table, double cutoff_hz, bool mask, bool held_out,
                     const SelectionPolicy& policy) {
  Setting setting;
  setting.cutoff_hz = cutoff_hz;
  setting.mask = mask;
  SelectedRows kept;
  for (const Run& run : table.runs)
    if ((table.held_out[run.record] != 0) == held_out) take_rows(table, run, cutoff_hz, mask, kept);
  setting.rows.resize(kept.total, width_of(table));
  setting.sign_width = table.columns.cols() + 1;
  if (table.presliding) setting.presliding = presliding_columns(table);
  for (std::size_t i = 0; i < kept.runs.size(); ++i)
    setting.rows.middleRows(kept.runs[i].first, kept.runs[i].last - kept.runs[i].first) = kept.rows[i];
  setting.runs = std::move(kept.runs);
  std::vector<Eigen::Index> of_record(table.records, 0);
  for (const Run& run : setting.runs) of_record[run.record] += run.last - run.first;
  std::vector<Eigen::MatrixXd> products;
  for (std::size_t r = 0; r < table.records; ++r)
    if (of_record[r] > 0) add_blocks(setting, products, r, of_record[r], policy.blocks);
  take_products(setting, products);
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
