#include "host/engine/selection/setting.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace flexspline::selection {
namespace {

// Samples of the table that follow each other and are taken, and their places in the setting.
struct TakenRun {
  Eigen::Index from = 0;  // in the table
  Run run;
};

std::vector<TakenRun> taken_runs(const RegressorTable& table, bool mask, bool held_out) {
  constexpr Eigen::Index kFewest = 4;
  std::vector<TakenRun> taken;
  Eigen::Index rows = 0;
  for (const Run& run : table.runs) {
    if ((table.held_out[run.record] != 0) != held_out) continue;
    const auto is_sure = [&](Eigen::Index at) {
      const SampleState state = table.states[static_cast<std::size_t>(at)];
      return state == SampleState::in_motion || (state == SampleState::near_reversal && !mask);
    };
    for (Eigen::Index k = run.first; k < run.last;) {
      Eigen::Index end = k;
      while (end < run.last && is_sure(end)) ++end;
      if (end - k >= kFewest) {
        taken.push_back({k, {run.record, rows, rows + end - k, run.row_s}});
        rows += end - k;
      }
      k = end + 1;
    }
  }
  return taken;
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

// Appends the blocks of one record, with the products of their samples: so many that they are in proportion to its
// samples, at least two, so that each half can have one.
void add_blocks(Setting& setting, std::vector<Eigen::VectorXd>& products, std::size_t record,
                Eigen::Index rows_of_record, std::size_t blocks) {
  const Eigen::Index columns = setting.rows.cols();
  const auto parts =
      std::max<Eigen::Index>(2, std::lround(static_cast<double>(blocks) * static_cast<double>(rows_of_record) /
                                            static_cast<double>(setting.rows.rows())));
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(columns, columns);
  Block block{record, 0.0};
  Eigen::Index seen = 0, part = 0;
  const auto finish = [&] {
    if (block.rows > 0.0) {
      products.push_back(lower_triangle(product));
      setting.blocks.push_back(block);
      product.setZero();
      block.rows = 0.0;
    }
  };
  for (const Run& run : setting.runs) {
    if (run.record != record) continue;
    for (Eigen::Index k = run.first; k < run.last;) {
      const Eigen::Index b = std::min(parts - 1, (seen * parts) / rows_of_record);
      if (b != part) finish();
      part = b;
      const Eigen::Index end_of_block = ((b + 1) * rows_of_record + parts - 1) / parts;
      const Eigen::Index many = std::max<Eigen::Index>(1, std::min(run.last - k, end_of_block - seen));
      product.selfadjointView<Eigen::Lower>().rankUpdate(setting.rows.middleRows(k, many).transpose());
      block.rows += static_cast<double>(many);
      k += many;
      seen += many;
    }
  }
  finish();
}

// Puts the products of the blocks into columns.
void take_products(Setting& setting, const std::vector<Eigen::VectorXd>& products) {
  const Eigen::Index columns = setting.rows.cols();
  setting.products.resize(columns * (columns + 1) / 2, std::ssize(products));
  for (std::size_t b = 0; b < products.size(); ++b) setting.products.col(static_cast<Eigen::Index>(b)) = products[b];
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

Setting make_setting(const RegressorTable& table, const ChosenColumns& chosen, bool mask, bool held_out,
                     const SelectionPolicy& policy) {
  Setting setting;
  setting.cutoff_hz = table.highest_hz;
  setting.mask = mask;
  const std::vector<TakenRun> taken = taken_runs(table, mask, held_out);
  const auto own = std::ssize(chosen.columns), presliding = std::ssize(chosen.presliding);
  setting.sign_width = own + 1;
  setting.rows.resize(taken.empty() ? 0 : taken.back().run.last,
                      own + 1 + (chosen.table.presliding ? presliding + 1 : 0));
  const auto take = [&](Eigen::Index to, const auto& column) {
    for (const auto& [from, run] : taken)
      setting.rows.col(to).segment(run.first, run.last - run.first) = column.segment(from, run.last - run.first);
  };
  for (Eigen::Index j = 0; j < own; ++j) take(j, table.columns.col(chosen.columns[static_cast<std::size_t>(j)]));
  take(own, table.target);
  if (chosen.table.presliding) {
    setting.presliding = presliding_columns(chosen.table);
    for (Eigen::Index j = 0; j < presliding; ++j)
      take(own + 1 + j, table.presliding->columns.col(chosen.presliding[static_cast<std::size_t>(j)]));
    take(own + 1 + presliding, table.presliding->target);
  }
  for (const TakenRun& one : taken) setting.runs.push_back(one.run);
  std::vector<Eigen::Index> of_record(table.records, 0);
  for (const Run& run : setting.runs) of_record[run.record] += run.last - run.first;
  std::vector<Eigen::VectorXd> products;
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
