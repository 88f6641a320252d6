#include "host/engine/selection/halves.hpp"

#include <algorithm>
#include <numeric>
#include <optional>

namespace flexspline::selection {

std::vector<double> record_weights(const RegressorTable& table, const Setting& setting) {
  std::vector<double> weights(table.records, 0.0), rows(table.records, 0.0);
  std::vector<Eigen::MatrixXd> products(table.records);
  for (const BlockRange& blocks : blocks_by_record(setting)) {
    products[blocks.record] = products_of(setting, blocks, Direction::sign);
    for (std::size_t b = blocks.first; b < blocks.last; ++b) rows[blocks.record] += setting.blocks[b].rows;
  }
  for (std::size_t r = 0; r < table.records; ++r) weights[r] = rows[r] > 0.0 ? 1.0 : 0.0;
  for (int round = 0; round < 3; ++round) {
    HalfData all;
    for (std::size_t r = 0; r < table.records; ++r) {
      if (rows[r] == 0.0) continue;
      if (all.sign.size() == 0) all.sign = Eigen::MatrixXd::Zero(products[r].rows(), products[r].cols());
      all.sign += weights[r] * products[r];
    }
    const TermFit fitted = fit_terms(table, {}, all, all);
    std::vector<double> found;
    for (std::size_t r = 0; r < table.records; ++r) {
      if (rows[r] == 0.0) continue;
      weights[r] = rows[r] / std::max(squares_left(products[r], fitted.columns, fitted.theta), 1e-300);
      found.push_back(weights[r]);
    }
    std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2), found.end());
    const double most = 10.0 * found[found.size() / 2];
    for (double& w : weights) w = std::min(w, most);
  }
  return weights;
}

namespace {

void add_products(Eigen::MatrixXd&& products, const FrictionRandomEffects& differences, Eigen::MatrixXd& sum) {
  eliminate_friction_effects(products, differences);
  if (sum.size() == 0)
    sum = std::move(products);
  else
    sum += products;
}

}  // namespace

HalfData sum_of(const Setting& setting, const std::vector<double>& weights, const FrictionRandomEffects& differences) {
  HalfData all;
  for (const BlockRange& blocks : blocks_by_record(setting)) {
    const double weight = weights[blocks.record];
    add_products(weight * products_of(setting, blocks, Direction::sign), differences, all.sign);
    if (setting.presliding.empty()) continue;
    add_products(weight * products_of(setting, blocks, Direction::presliding), differences, all.presliding);
  }
  for (const Block& block : setting.blocks) all.rows += block.rows;
  return all;
}

namespace {

// By record, the products of the samples that are taken with the columns that differ between records: of each column,
// the products with all columns in one column for each choice of blocks, and in the last one those of all blocks.
using ProductsAlong = std::vector<std::vector<Eigen::MatrixXd>>;
ProductsAlong products_along(const Setting& setting, const Eigen::MatrixXd& choices,
                             const std::vector<Eigen::Index>& columns) {
  const Eigen::Index width = setting.rows.cols();
  ProductsAlong along;
  for (const BlockRange& blocks : blocks_by_record(setting)) {
    const auto first = static_cast<Eigen::Index>(blocks.first), count = static_cast<Eigen::Index>(blocks.last) - first;
    along.emplace_back();
    for (const Eigen::Index column : columns) {
      std::vector<Eigen::Index> places;
      for (Eigen::Index j = 0; j < width; ++j) places.push_back(place_in_triangle(column, j, width));
      const Eigen::MatrixXd own = setting.products(places, Eigen::seqN(first, count));
      along.back().push_back(own * choices.middleRows(first, count));
    }
  }
  return along;
}

// The products X'X of half the data: of the blocks that a choice takes, or of the others. Friction that differs is
// eliminated from each record i alone, which takes off a matrix of low rank: X'X - sum_i F_i F_i', with the factor F_i
// of eliminated_factor().
class HalfProducts {
 public:
  HalfProducts(const Setting& setting, const Eigen::MatrixXd& choices, const FrictionRandomEffects& differences,
               Direction direction)
      : setting_(setting), differences_(differences), direction_(direction), places_(places(setting, direction)) {
    std::vector<Eigen::Index> columns;
    for (const Eigen::Index place : columns_that_differ(differences))
      columns.push_back(places_[static_cast<std::size_t>(place)]);
    if (!columns.empty()) along_ = products_along(setting, choices, columns);
  }

  // `sums`: products of all columns by choice of blocks, in the last column those of all blocks.
  Eigen::MatrixXd of(const Eigen::MatrixXd& sums, Eigen::Index choice, bool first_half) const {
    const auto half = [&](const Eigen::MatrixXd& by_choice) -> Eigen::VectorXd {
      if (first_half) return by_choice.col(choice);
      return by_choice.rightCols<1>() - by_choice.col(choice);
    };
    Eigen::MatrixXd products = products_of(setting_, half(sums), direction_);
    if (along_.empty()) return products;
    const auto many = static_cast<Eigen::Index>(along_.front().size());
    Eigen::MatrixXd factors(products.rows(), many * std::ssize(along_));
    for (std::size_t record = 0; record < along_.size(); ++record) {
      Eigen::MatrixXd along(products.rows(), many);
      for (Eigen::Index j = 0; j < many; ++j) along.col(j) = half(along_[record][static_cast<std::size_t>(j)])(places_);
      factors.middleCols(static_cast<Eigen::Index>(record) * many, many) = eliminated_factor(along, differences_);
    }
    products.noalias() -= factors * factors.transpose();
    return products;
  }

 private:
  static std::vector<Eigen::Index> places(const Setting& setting, Direction direction) {
    if (direction == Direction::presliding) return setting.presliding;
    std::vector<Eigen::Index> all(static_cast<std::size_t>(setting.sign_width));
    std::iota(all.begin(), all.end(), Eigen::Index{0});
    return all;
  }

  const Setting& setting_;
  const FrictionRandomEffects& differences_;
  Direction direction_;
  std::vector<Eigen::Index> places_;  // columns of the setting, by place of the direction
  ProductsAlong along_;
};

}  // namespace

std::vector<HalfPair> halves_of(const Setting& setting, const std::vector<double>& weights,
                                std::span<const std::vector<std::uint8_t>> in,
                                const FrictionRandomEffects& differences) {
  const auto pairs_count = std::ssize(in);
  Eigen::MatrixXd choices(std::ssize(setting.blocks), pairs_count + 1);
  for (std::size_t b = 0; b < setting.blocks.size(); ++b) {
    const double weight = weights[setting.blocks[b].record];
    const auto row = static_cast<Eigen::Index>(b);
    for (std::size_t i = 0; i < in.size(); ++i)
      choices(row, static_cast<Eigen::Index>(i)) = in[i][b] != 0 ? weight : 0.0;
    choices(row, pairs_count) = weight;
  }
  const Eigen::MatrixXd sums = setting.products * choices;
  const HalfProducts sign(setting, choices, differences, Direction::sign);
  std::optional<HalfProducts> presliding;
  if (!setting.presliding.empty()) presliding.emplace(setting, choices, differences, Direction::presliding);
  std::vector<HalfPair> pairs(in.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const bool taken : {true, false}) {
      HalfData& half = pairs[i][taken ? 0 : 1];
      half.sign = sign.of(sums, static_cast<Eigen::Index>(i), taken);
      if (presliding) half.presliding = presliding->of(sums, static_cast<Eigen::Index>(i), taken);
    }
    for (std::size_t b = 0; b < setting.blocks.size(); ++b)
      pairs[i][in[i][b] != 0 ? 0 : 1].rows += setting.blocks[b].rows;
  }
  return pairs;
}

std::vector<std::uint8_t> half_of_blocks(const Setting& setting, std::mt19937_64& chance) {
  std::vector<std::uint8_t> in(setting.blocks.size(), 0);
  for (std::size_t first = 0; first < in.size();) {
    std::size_t last = first;
    while (last < in.size() && setting.blocks[last].record == setting.blocks[first].record) ++last;
    std::vector<std::size_t> order(last - first);
    std::iota(order.begin(), order.end(), first);
    std::shuffle(order.begin(), order.end(), chance);
    const bool more = (chance() & 1U) != 0;
    const std::size_t half = (order.size() + (more ? 1 : 0)) / 2;
    for (std::size_t k = 0; k < half; ++k) in[order[k]] = 1;
    first = last;
  }
  return in;
}

std::vector<std::uint8_t> half_of_records(const Setting& setting, std::mt19937_64& chance) {
  std::vector<std::size_t> present;
  for (const Block& b : setting.blocks)
    if (present.empty() || present.back() != b.record) present.push_back(b.record);
  std::shuffle(present.begin(), present.end(), chance);
  present.resize(present.size() / 2);
  std::vector<std::uint8_t> in(setting.blocks.size());
  for (std::size_t b = 0; b < in.size(); ++b)
    in[b] = std::find(present.begin(), present.end(), setting.blocks[b].record) != present.end() ? 1 : 0;
  return in;
}

}  // namespace flexspline::selection
