#include "host/common/signals/blockwise_filter.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "host/common/signals/cascade.hpp"

namespace flexspline::signals {
namespace {

// The signal's end, continued by its point reflection: the forward pass goes on over it, the backward pass begins
// there.
template <int Order, class V>
void turn_round(Cascade<Order, V>& forward, Cascade<Order, V>& backward, const Columns<V>& raw, const Columns<V>& tail,
                std::size_t pad, const V& origin) {
  V back;
  raw.load(pad, back);
  in_blocks(forward, pad, [&](auto& c, std::size_t i) {
    V v;
    raw.load(pad - 1 - i, v);
    v = (back - v) + (back - origin);
    c.step(v);
    tail.store(i, v);
  });
  begin_backward(backward, tail, 0, pad);
}

// Both passes over columns that are never in memory as a whole. `x` holds a block and what the backward pass needs
// behind it to forget where it began.
template <int Order>
void filter_blocks(const Sections& sections, std::size_t n, std::size_t pad, std::size_t block, std::size_t warm,
                   Eigen::Index columns, BlockProcessor& work) {
  using V = Lanes4;
  constexpr std::size_t kWide = kLanes<V>;
  using Cascades = std::vector<Cascade<Order, V>>;
  const std::size_t groups = (static_cast<std::size_t>(columns) + kWide - 1) / kWide;
  const auto all = static_cast<Eigen::Index>(kWide * groups);
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(block + warm), all);
  // The last samples as they came, and their continuation.
  Eigen::MatrixXd last = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pad + 1), all);
  Eigen::MatrixXd after = last;
  const auto lanes = [](Eigen::MatrixXd& m, std::size_t group) {
    Columns<V> columns_of;
    for (std::size_t l = 0; l < kWide; ++l)
      columns_of.data[l] = m.col(static_cast<Eigen::Index>(kWide * group + l)).data();
    return columns_of;
  };
  Cascades forward(groups, Cascade<Order, V>(sections.a1, sections.a2, sections.gain));
  std::vector<V> origins(groups);
  std::size_t have = 0;
  for (std::size_t first = 0;; first += block) {
    const std::size_t end = std::min(n, first + block + warm);
    const std::size_t from = have - first, to = end - first;
    work.fill(have, x.block(static_cast<Eigen::Index>(from), 0, static_cast<Eigen::Index>(to - from), columns));
    for (std::size_t k = std::max(have, n - 1 - pad); k < end; ++k)
      last.row(static_cast<Eigen::Index>(k - (n - 1 - pad))) = x.row(static_cast<Eigen::Index>(k - first));
    for (std::size_t g = 0; g < groups; ++g) {
      const Columns<V> part = lanes(x, g), tail = lanes(after, g);
      V& origin = origins[g];
      if (have == 0) {
        part.load(0, origin);
        begin_forward(forward[g], part, pad, origin);
      }
      pass_forward(forward[g], part, from, to, origin);
      Cascade<Order, V> backward(sections.a1, sections.a2, sections.gain);
      std::size_t kept = to;
      if (end == n) {
        turn_round(forward[g], backward, lanes(last, g), tail, pad, origin);
      } else {
        kept = block;
        begin_backward(backward, part, kept, to);
      }
      pass_backward(backward, part, kept, origin);
    }
    work.take(first, x.block(0, 0, static_cast<Eigen::Index>(end == n ? to : block), columns));
    if (end == n) return;
    const auto moved = static_cast<Eigen::Index>(warm);
    for (auto column : x.colwise()) std::copy_n(column.data() + block, moved, column.data());
    have = end;
  }
}

template <int... Less>
void dispatch_order(int order, const Sections& sections, std::size_t n, std::size_t pad, std::size_t block,
                    std::size_t warm, Eigen::Index columns, BlockProcessor& work, std::integer_sequence<int, Less...>) {
  ((order == Less + 1 ? filter_blocks<Less + 1>(sections, n, pad, block, warm, columns, work) : void()), ...);
}

// In pads, over each of which the filter's state decays to a millionth: after three, only rounding is left of it.
constexpr std::size_t kForgotten = 3;

}  // namespace

std::size_t block_size_of(const ZeroPhaseFilter& filter) {
  constexpr std::size_t kSamples = 4096;  // of eight columns, stay in the processor's cache
  return std::max(kSamples, 4 * kForgotten * filter.pad_length());
}

void filter_blockwise(const ZeroPhaseFilter& filter, std::size_t samples, Eigen::Index columns, BlockProcessor& work) {
  const std::size_t block = block_size_of(filter), pad = filter.pad_length();
  if (samples <= block + kForgotten * pad) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(samples), columns);
    work.fill(0, all);
    filter.apply_columns_in_place(all);
    work.take(0, all);
    return;
  }
  dispatch_order(filter.order(), sections_of(filter.order(), filter.cutoff_hz(), filter.sample_hz()), samples, pad,
                 block, kForgotten * pad, columns, work, std::make_integer_sequence<int, ZeroPhaseFilter::kMaxOrder>{});
}

}  // namespace flexspline::signals
