// One setting of the regression: a bandwidth, and reversals kept or left out. Blocks of consecutive samples with their
// cross products, so that fits on any choice of blocks are algebra on small matrices.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "host/engine/selection/regressor_table.hpp"

namespace flexspline::selection {

// Samples of one record that follow each other.
struct Block {
  std::size_t record = 0;
  double rows = 0.0;
};

struct Setting {
  double cutoff_hz = 0.0;
  bool mask = false;
  std::vector<Block> blocks;
  // Of each block, in a column, the products of the columns of `rows` with each other, the lower triangle of their
  // symmetric matrix: sums over many choices of blocks are then one product of matrices.
  Eigen::MatrixXd products;
  // The samples, filtered and masked: [columns, target], and behind them [columns, target] of the state of presliding.
  Eigen::MatrixXd rows;
  Eigen::Index sign_width = 0;  // of the first
  // Columns of `rows` that a fit with the state of presliding uses in their places: those of the table, those of the
  // shape of presliding, the target. Empty: it does not compete.
  std::vector<Eigen::Index> presliding;
  std::vector<Run> runs;

  // What a fit uses in a place, its target in the last one.
  auto column(Eigen::Index place, Direction direction) const {
    return rows.col(direction == Direction::sign ? place : presliding[static_cast<std::size_t>(place)]);
  }
  auto target(Direction direction) const {
    return rows.col(direction == Direction::sign ? sign_width - 1 : presliding.back());
  }
};

// Place of the product of two columns in a lower triangle of so many columns, stored column by column.
inline Eigen::Index place_in_triangle(Eigen::Index a, Eigen::Index b, Eigen::Index columns) {
  const Eigen::Index column = std::min(a, b), row = std::max(a, b);
  return column * columns - column * (column - 1) / 2 + row - column;
}
Eigen::VectorXd lower_triangle(const Eigen::MatrixXd& symmetric);

// Blocks of one record: first, and one after the last.
struct BlockRange {
  std::size_t record = 0, first = 0, last = 0;
};
std::vector<BlockRange> blocks_by_record(const Setting& setting);
// Products of all samples of these blocks: of what a fit uses, by place.
Eigen::MatrixXd products_of(const Setting& setting, const BlockRange& blocks, Direction direction);
// The same of products of all columns, as a lower triangle.
Eigen::MatrixXd products_of(const Setting& setting, const Eigen::Ref<const Eigen::VectorXd>& all, Direction direction);

// Columns of a table at one bandwidth (filtered_table), of its records that are held out, or of all others.
Setting make_setting(const RegressorTable& table, const ChosenColumns& chosen, bool mask, bool held_out,
                     const SelectionPolicy& policy);

// Mean squared difference of a residual over one period of the cut-off, halved (semivariance): what changes within a
// period is noise or as quick as noise, what does not is structure.
double semivariance(const Setting& setting, const Eigen::VectorXd& residual);

}  // namespace flexspline::selection
