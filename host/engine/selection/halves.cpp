#include "host/engine/selection/halves.hpp"

#include <algorithm>
#include <numeric>

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

std::vector<HalfPair> halves_of(const Setting& setting, const std::vector<double>& weights,
                                std::span<const std::vector<std::uint8_t>> in,
                                const FrictionRandomEffects& differences) {
  Eigen::MatrixXd choices(std::ssize(setting.blocks), std::ssize(in));
  for (std::size_t i = 0; i < in.size(); ++i)
    for (std::size_t b = 0; b < in[i].size(); ++b)
      choices(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(i)) = in[i][b];
  std::vector<HalfPair> pairs(in.size());
  const auto add = [&](const Eigen::VectorXd& products, HalfData& half) {
    add_products(products_of(setting, products, Direction::sign), differences, half.sign);
    if (setting.presliding.empty()) return;
    add_products(products_of(setting, products, Direction::presliding), differences, half.presliding);
  };
  // Friction that differs is eliminated from each record alone, so that records are added one after the other.
  for (const BlockRange& blocks : blocks_by_record(setting)) {
    const auto first = static_cast<Eigen::Index>(blocks.first), count = static_cast<Eigen::Index>(blocks.last) - first;
    const double weight = weights[blocks.record];
    const Eigen::VectorXd whole = weight * setting.products.middleCols(first, count).rowwise().sum();
    const Eigen::MatrixXd taken =
        setting.products.middleCols(first, count) * (weight * choices.middleRows(first, count));
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      add(taken.col(static_cast<Eigen::Index>(i)), pairs[i][0]);
      add(whole - taken.col(static_cast<Eigen::Index>(i)), pairs[i][1]);
    }
  }
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (std::size_t b = 0; b < setting.blocks.size(); ++b)
      pairs[i][in[i][b] != 0 ? 0 : 1].rows += setting.blocks[b].rows;
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
