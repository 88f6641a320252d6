// How the columns of a balance are computed along its records and filtered, for the sources of RegressorEvaluator.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "host/common/signals/blockwise_filter.hpp"
#include "host/engine/estimation/regressor_evaluator.hpp"

namespace flexspline::estimation {

// A column along a record, on its way through the filter.
struct ColumnLane {
  const Record* record;
  const RowRange* range;
  std::size_t column;
  std::vector<double> whole;  // of what cannot be computed block by block
  std::size_t next = 0;       // sample that is taken next
};

// Where a column is to be written: samples from `first` on, whose signals are `inputs` where it reads any.
struct ColumnBlock {
  std::size_t first;
  std::span<const effects::Inputs<Real>> inputs;
  std::span<double> signal;
};

// Makes columns and takes them filtered, some samples at a time. `Fill` has
//   unsigned reads(column): signals that it needs, of effects::Signals; kWholeRecord: it writes the whole record at
//   once; void operator()(range, column, block).
constexpr unsigned kWholeRecord = ~0U;
template <class Fill>
struct BlockwiseColumns final : signals::BlockProcessor {
  BlockwiseColumns(Fill& how, std::vector<ColumnLane> of) : fill_column(how), lanes(std::move(of)) {
    for (ColumnLane& lane : lanes)
      if (fill_column.reads(lane.column) == kWholeRecord) {
        lane.whole.assign(lane.record->inputs.size(), 0.0);
        fill_column(*lane.range, lane.column, ColumnBlock{0, {}, lane.whole});
      }
  }

  void fill(std::size_t first, Eigen::Ref<Eigen::MatrixXd> columns) override {
    const auto count = static_cast<std::size_t>(columns.rows());
    for (std::size_t l = 0; l < lanes.size();) {
      // Columns of one record share its signals.
      std::size_t end = l;
      unsigned reads = 0;
      for (; end < lanes.size() && lanes[end].record == lanes[l].record; ++end)
        if (lanes[end].whole.empty()) reads |= fill_column.reads(lanes[end].column);
      for (std::size_t from = 0; from < count; from += inputs.size()) {
        const std::size_t many = std::min(inputs.size(), count - from), at = offset + first + from;
        const std::span<effects::Inputs<Real>> part = std::span(inputs).first(many);
        if (reads != 0) lanes[l].record->inputs.copy(at, part, reads);
        for (std::size_t j = l; j < end; ++j) {
          const std::span<double> to(columns.col(static_cast<Eigen::Index>(j)).data() + from, many);
          if (!lanes[j].whole.empty()) {
            std::copy_n(lanes[j].whole.begin() + static_cast<std::ptrdiff_t>(at), many, to.begin());
            continue;
          }
          std::fill(to.begin(), to.end(), 0.0);
          fill_column(*lanes[j].range, lanes[j].column, ColumnBlock{at, part, to});
        }
      }
      l = end;
    }
  }

  void take(std::size_t first, const Eigen::Ref<const Eigen::MatrixXd>& columns) override {
    const std::size_t from = offset + first, last = from + static_cast<std::size_t>(columns.rows());
    for (std::size_t j = 0; j < lanes.size(); ++j) {
      ColumnLane& lane = lanes[j];
      const std::vector<std::size_t>& samples = lane.record->rows[index(balance)].samples;
      const double* signal = columns.col(static_cast<Eigen::Index>(j)).data();
      double* to = rows->col(static_cast<Eigen::Index>(lane.column)).data() + lane.range->first;
      for (; lane.next < samples.size() && samples[lane.next] < last; ++lane.next)
        to[lane.next] = signal[samples[lane.next] - from];
    }
  }

  Fill& fill_column;
  std::vector<ColumnLane> lanes;
  std::vector<effects::Inputs<Real>> inputs = std::vector<effects::Inputs<Real>>(catalogue::PlainInputs::kBlock);
  std::size_t offset = 0;  // of the segment
  Eigen::MatrixXd* rows = nullptr;
  Balance balance{};
};

// What writes a column at once, from the record alone.
template <class Work>
struct WholeRecord {
  Work work;
  unsigned reads(std::size_t) const { return kWholeRecord; }
  void operator()(const RowRange& range, std::size_t column, const ColumnBlock& block) {
    work(range, column, block.signal);
  }
};
template <class Work>
WholeRecord(Work) -> WholeRecord<Work>;

inline void RegressorEvaluator::filter(const RowRange& range, Eigen::Ref<Eigen::MatrixXd> signals) const {
  const auto at = static_cast<std::size_t>(&range - ranges_.data());
  for (const data::Segment& s : prepared_->records[range.record].segments)
    filters_[at].apply_columns_in_place(
        signals.middleRows(static_cast<Eigen::Index>(s.first), static_cast<Eigen::Index>(s.last - s.first)));
}

inline bool RegressorEvaluator::have_equal_filters(const RowRange& a, const RowRange& b) const {
  const Record &first = prepared_->records[a.record], &second = prepared_->records[b.record];
  return first.sample_s == second.sample_s && first.segments.size() == 1 && second.segments.size() == 1 &&
         first.inputs.size() == second.inputs.size() && first.segments[0].first == second.segments[0].first &&
         first.segments[0].last == second.segments[0].last;
}

inline void RegressorEvaluator::take_rows(const RowRange& range, const double* signal,
                                          Eigen::Ref<Eigen::VectorXd> rows) const {
  const auto& samples = prepared_->records[range.record].rows[index(balance_)].samples;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const double* at = signal + samples[k];
    const double x = beyond_.empty() ? 0.0 : beyond_[static_cast<std::size_t>(range.first) + k];
    // A cubic through four samples; the filter leaves nothing that it could not follow.
    rows[static_cast<Eigen::Index>(k)] =
        x == 0.0 ? *at
                 : at[-1] * (x * (1.0 - x) * (x - 2.0) / 6.0) + at[0] * ((x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0) +
                       at[1] * ((x + 1.0) * x * (2.0 - x) / 2.0) + at[2] * ((x + 1.0) * x * (x - 1.0) / 6.0);
  }
}

template <class Fill>
Eigen::MatrixXd RegressorEvaluator::filtered_columns(std::size_t columns, Fill fill) const {
  // Some at a time: more would not stay in the processor's cache. Records with equal filters are filtered together.
  constexpr std::size_t kTogether = 8;
  constexpr std::size_t kBlocksAtOnce = 8;  // a cache further out still holds these
  Eigen::MatrixXd rows(ranges_.empty() ? 0 : ranges_.back().last, static_cast<Eigen::Index>(columns));
  for (std::size_t first = 0; first < columns; first += kTogether) {
    const std::size_t many = std::min(kTogether, columns - first);
    for (std::size_t i = 0; i < ranges_.size();) {
      const std::size_t samples = prepared_->records[ranges_[i].record].inputs.size();
      // Points between samples need samples on both sides of them.
      const bool at_once = !beyond_.empty() || samples <= kBlocksAtOnce * signals::block_size_of(filters_[i]);
      std::size_t end = i + 1;
      while (end < ranges_.size() && (end - i + 1) * many <= kTogether && have_equal_filters(ranges_[i], ranges_[end]))
        ++end;
      std::vector<ColumnLane> lanes;
      for (std::size_t range = i; range < end; ++range)
        for (std::size_t j = 0; j < many; ++j)
          lanes.push_back({&prepared_->records[ranges_[range].record], &ranges_[range], first + j, {}, 0});
      BlockwiseColumns<Fill> work(fill, std::move(lanes));
      if (at_once) {
        Eigen::MatrixXd all =
            Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(samples), static_cast<Eigen::Index>(work.lanes.size()));
        work.fill(0, all);
        filter(ranges_[i], all);
        Eigen::Index at = 0;
        for (const ColumnLane& lane : work.lanes)
          take_rows(*lane.range, all.col(at++).data(),
                    rows.col(static_cast<Eigen::Index>(lane.column)).segment(lane.range->first, lane.range->size()));
      } else {
        work.rows = &rows;
        work.balance = balance_;
        for (const data::Segment& s : prepared_->records[ranges_[i].record].segments) {
          work.offset = s.first;
          signals::filter_blockwise(filters_[i], s.last - s.first, static_cast<Eigen::Index>(work.lanes.size()), work);
        }
      }
      i = end;
    }
  }
  return rows;
}

}  // namespace flexspline::estimation
