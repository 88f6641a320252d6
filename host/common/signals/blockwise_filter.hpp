#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "host/common/signals/butterworth.hpp"

namespace flexspline::signals {

/// Who makes columns that are to be filtered and takes them filtered, some samples at a time.
class BlockProcessor {
 public:
  virtual ~BlockProcessor() = default;
  /// Writes the samples from `first` on; blocks follow one another.
  virtual void fill(std::size_t first, Eigen::Ref<Eigen::MatrixXd> columns) = 0;
  /// The same samples filtered; blocks follow one another, and are not those of `fill`.
  virtual void take(std::size_t first, const Eigen::Ref<const Eigen::MatrixXd>& columns) = 0;
};

/// Filters columns as ZeroPhaseFilter::apply_columns does, up to rounding, without having them in memory as a whole:
/// what is worked on stays in the processor's cache. The backward pass begins each block as far behind it as its
/// state takes to decay below rounding.
void filter_blockwise(const ZeroPhaseFilter& filter, std::size_t samples, Eigen::Index columns, BlockProcessor& work);

/// Samples of a block. Signals that are not much longer are filtered at once.
std::size_t block_size_of(const ZeroPhaseFilter& filter);

}  // namespace flexspline::signals
