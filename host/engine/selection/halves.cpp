#include "host/engine/selection/halves.hpp"

#include <algorithm>
#include <numeric>

namespace flexspline::selection {

std::vector<double> record_weights(const RegressorTable& table, const Setting& setting) {
  std::vector<double> weights(table.records, 0.0), rows(table.records, 0.0);
  std::vector<Eigen::MatrixXd> products(table.records);
  for (const Block& b : setting.blocks) {
    auto& sum = products[b.record];
    if (sum.size() == 0) sum = Eigen::MatrixXd::Zero(b.products.rows(), b.products.cols());
    sum += b.products;
    rows[b.record] += b.rows;
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
      HalfData one{products[r], {}, rows[r]};
      double sum = products[r](products[r].rows() - 1, products[r].cols() - 1);
      const Eigen::Index y = products[r].cols() - 1;
      for (std::size_t i = 0; i < fitted.columns.size(); ++i) {
        double row = -2.0 * products[r](fitted.columns[i], y);
        for (std::size_t j = 0; j < fitted.columns.size(); ++j)
          row += products[r](fitted.columns[i], fitted.columns[j]) * fitted.theta[static_cast<Eigen::Index>(j)];
        sum += fitted.theta[static_cast<Eigen::Index>(i)] * row;
      }
      weights[r] = rows[r] / std::max(sum, 1e-300);
      found.push_back(weights[r]);
    }
    std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(found.size() / 2), found.end());
    const double most = 10.0 * found[found.size() / 2];
    for (double& w : weights) w = std::min(w, most);
  }
  return weights;
}

HalfData sum_of(const Setting& sign, const Setting* presliding, const std::vector<double>& weights,
                std::span<const std::uint8_t> in, std::uint8_t which, const FrictionRandomEffects& differences) {
  HalfData half;
  const Eigen::Index p = sign.rows.cols();
  half.sign = Eigen::MatrixXd::Zero(p, p);
  if (presliding) half.presliding = Eigen::MatrixXd::Zero(p, p);
  const bool differs = differences.any();
  const auto add = [&](const Setting& setting, Eigen::MatrixXd& to, bool count) {
    for (std::size_t first = 0; first < setting.blocks.size();) {
      std::size_t last = first;
      const std::size_t record = setting.blocks[first].record;
      Eigen::MatrixXd own;
      for (; last < setting.blocks.size() && setting.blocks[last].record == record; ++last) {
        if (!in.empty() && in[last] != which) continue;
        if (!differs) {
          to += weights[record] * setting.blocks[last].products;
        } else if (own.size() == 0) {
          own = setting.blocks[last].products;
        } else {
          own += setting.blocks[last].products;
        }
        if (count) half.rows += setting.blocks[last].rows;
      }
      if (own.size() > 0) {
        own *= weights[record];
        eliminate_friction_effects(own, differences);
        to += own;
      }
      first = last;
    }
  };
  add(sign, half.sign, true);
  if (presliding) add(*presliding, half.presliding, false);
  return half;
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
