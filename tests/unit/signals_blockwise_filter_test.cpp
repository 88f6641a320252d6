// A filter over a long signal that is made and taken a block at a time, against the same filter over all of it at
// once.
#include "host/common/signals/blockwise_filter.hpp"

#include <gtest/gtest.h>

#include <random>

namespace flexspline::signals::signals_blockwise_filter_test {
namespace {

// Columns that exist as a whole, and where their filtered samples came to.
struct Whole final : BlockProcessor {
  explicit Whole(Eigen::MatrixXd x) : raw(std::move(x)), filtered(Eigen::MatrixXd::Zero(raw.rows(), raw.cols())) {}
  void fill(std::size_t first, Eigen::Ref<Eigen::MatrixXd> columns) override {
    EXPECT_EQ(first, asked);
    asked = first + static_cast<std::size_t>(columns.rows());
    columns = raw.middleRows(static_cast<Eigen::Index>(first), columns.rows());
  }
  void take(std::size_t first, const Eigen::Ref<const Eigen::MatrixXd>& columns) override {
    EXPECT_EQ(first, given);
    given = first + static_cast<std::size_t>(columns.rows());
    filtered.middleRows(static_cast<Eigen::Index>(first), columns.rows()) = columns;
  }
  Eigen::MatrixXd raw, filtered;
  std::size_t asked = 0, given = 0;
};

Eigen::MatrixXd noise_on_ramps(Eigen::Index samples, Eigen::Index columns) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 1.0);
  Eigen::MatrixXd x(samples, columns);
  for (Eigen::Index c = 0; c < columns; ++c)
    for (Eigen::Index k = 0; k < samples; ++k)
      x(k, c) = 40.0 * static_cast<double>(c) + 1e-4 * static_cast<double>(k) + noise(random);
  return x;
}

// `rounding` of the filter's own sections, which grows with the square of its slowness.
void expect_as_at_once(const ZeroPhaseFilter& filter, Eigen::Index samples, Eigen::Index columns,
                       double rounding = 1e-13) {
  Whole work(noise_on_ramps(samples, columns));
  filter_blockwise(filter, static_cast<std::size_t>(samples), columns, work);
  ASSERT_EQ(work.given, static_cast<std::size_t>(samples));
  const Eigen::MatrixXd expected = filter.apply_columns(work.raw);
  EXPECT_LT((work.filtered - expected).cwiseAbs().maxCoeff(), rounding * expected.cwiseAbs().maxCoeff())
      << samples << " samples, " << columns << " columns, order " << filter.order();
}

TEST(FilterBlockwise, GivesWhatTheFilterOverTheWholeSignalGives) {
  const ZeroPhaseFilter filter(5, 30.0, 1000.0);
  const auto block = static_cast<Eigen::Index>(block_size_of(filter));
  const auto behind = static_cast<Eigen::Index>(3 * filter.pad_length());
  for (const Eigen::Index samples : {Eigen::Index{40000}, block + behind + 1, 2 * block + behind, 2 * block + 1})
    for (const Eigen::Index columns : {1, 4, 7}) expect_as_at_once(filter, samples, columns);
}

TEST(FilterBlockwise, GivesTheSameOfShortSignalsSlowFiltersAndOtherOrders) {
  const ZeroPhaseFilter usual(5, 30.0, 1000.0), slow(5, 0.5, 1000.0), low(2, 20.0, 1000.0);
  for (const Eigen::Index samples : {Eigen::Index{1}, Eigen::Index{2}, Eigen::Index{500}})
    expect_as_at_once(usual, samples, 2);
  expect_as_at_once(slow, static_cast<Eigen::Index>(3 * block_size_of(slow)), 2, 1e-11);
  expect_as_at_once(low, 30000, 3);
}

}  // namespace
}  // namespace flexspline::signals::signals_blockwise_filter_test
