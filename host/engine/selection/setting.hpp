// One setting of the regression: a bandwidth, and reversals kept or left out. Blocks of consecutive samples with their
// cross products, so that fits on any choice of blocks are algebra on small matrices.
#pragma once

#include <Eigen/Core>
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
  // Of each block, in a column, the products of [columns, target] with each other: sums over many choices of blocks are
  // then one product of matrices.
  Eigen::MatrixXd products;
  // The samples, filtered and masked, for residuals.
  Eigen::MatrixXd rows;  // [columns, target]
  std::vector<Run> runs;
};

// Samples left out at each end of a run, in periods of the cut-off, where the filter guesses what lies beyond; masked
// samples reach as far around a reversal.
inline constexpr double kFilterReach = 1.5;

// Blocks of one record: first, and one after the last.
struct BlockRange {
  std::size_t record = 0, first = 0, last = 0;
};
std::vector<BlockRange> blocks_by_record(const Setting& setting);
// Products of all samples of these blocks.
Eigen::MatrixXd products_of(const Setting& setting, const BlockRange& blocks);

// Of the records that are held out, or of all others.
Setting make_setting(const RegressorTable& table, double cutoff_hz, bool mask, bool held_out,
                     const SelectionPolicy& policy);

// Mean squared difference of a residual over one period of the cut-off, halved (semivariance): what changes within a
// period is noise or as quick as noise, what does not is structure.
double semivariance(const Setting& setting, const Eigen::VectorXd& residual);

}  // namespace flexspline::selection
