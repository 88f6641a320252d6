#include "host/input/data/experiment_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>

#include "host/common/signals/quantum.hpp"
#include "host/input/data/checks.hpp"
#include "host/input/data/record_time.hpp"
#include "host/input/data/time_base.hpp"

namespace flexspline::data {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class ExperimentReader {
 public:
  ExperimentReader(const Table& table, const ColumnPlan& plan, Experiment& experiment, Findings& findings)
      : table_(table), plan_(plan), experiment_(experiment), findings_(findings), file_(experiment.file.string()) {}

  bool read(const TimeBounds& bounds, Axis axis) {
    const std::optional<Conversion> time = time_conversion(plan_, findings_);
    if (table_.rows() == 0)
      return fail("too_few_samples", 0, "", "the file has a header but no data", "record again, or leave it out");
    if (table_.mixed_decimals_line > 0)
      return fail("text_in_number", table_.mixed_decimals_line, "",
                  "decimal commas and decimal points are in the same file",
                  "write all numbers one way, and without separators of thousands");
    if (!time) return false;
    select(bounds, *time);
    if (table_.time_stamps)
      findings_.add(Severity::note, "time_stamps", file_, 0, plan_.wanted_names[plan_.time_column],
                    "dates and times were read as seconds since the first", "");
    if (!remove_bad_rows() || !order_rows() || !time_increases()) return false;
    if (rows_.size() < kMinimumSamples) return fail_too_few(bounds);
    // The time is taken before there are columns, so that both arrays are not in memory at the same time.
    take_time();
    const TimeBase base = time_base(experiment_.time_s);
    for (const PlannedColumn& planned : plan_.columns) convert(planned, axis);
    return set_time_base(base, axis);
  }

 private:
  bool fail(std::string kind, std::size_t line, std::string column, std::string what, std::string remedy) {
    findings_.add(Severity::error, std::move(kind), file_, line, std::move(column), std::move(what), std::move(remedy));
    return false;
  }

  bool fail_too_few(const TimeBounds& bounds) {
    const std::string range =
        bounds.from_s || bounds.to_s
            ? fmt::format(" from {} to {} s (the file's time goes from {:.15g} to {:.15g} s)",
                          bounds.from_s ? fmt::format("{}", *bounds.from_s) : "its start",
                          bounds.to_s ? fmt::format("{}", *bounds.to_s) : "its end", file_begin_, file_end_)
            : "";
    return fail("too_few_samples", 0, "",
                fmt::format("\"{}\" has {} samples{}; {} are needed at least", experiment_.name, rows_.size(), range,
                            kMinimumSamples),
                "record longer, or correct from_s and to_s");
  }

  // Rows whose time is in the part; a row without a time belongs where the row before it does.
  void select(const TimeBounds& bounds, const Conversion& conversion) {
    const std::vector<double>& theirs = table_.columns[plan_.time_column];
    const double from = bounds.from_s.value_or(-kInfinity);
    const double to = bounds.to_s.value_or(kInfinity);
    time_.resize(theirs.size());
    selected_.assign(theirs.size(), 0);
    file_begin_ = kInfinity;
    file_end_ = -kInfinity;
    bool inside = !bounds.from_s;
    for (std::size_t row = 0; row < theirs.size(); ++row) {
      time_[row] = conversion(theirs[row]);
      if (!std::isnan(time_[row])) {
        inside = time_[row] >= from && time_[row] < to;
        file_begin_ = std::min(file_begin_, time_[row]);
        file_end_ = std::max(file_end_, time_[row]);
      }
      selected_[row] = inside ? 1 : 0;
    }
  }

  // Bad cells and rows in the part become findings; where they are tolerated the rows are cut out.
  bool remove_bad_rows() {
    struct First {
      const BadCell* cell;
      std::size_t count;
    };
    std::map<std::pair<std::size_t, bool>, First> cells;  // by column, text or not
    std::vector<std::size_t> empty(plan_.wanted.size(), 0);
    for (const BadCell& cell : table_.bad_cells)
      if (cell.kind == BadCell::Kind::empty) ++empty[cell.column];
    for (std::size_t i = 0; i < empty.size(); ++i)
      if (empty[i] + table_.bad_rows.size() >= table_.rows() && empty[i] > 0) empty_columns_.push_back(i);
    std::vector<std::uint8_t> keep = selected_;
    for (const BadCell& cell : table_.bad_cells) {
      if (selected_[cell.row] == 0 || is_empty(cell.column)) continue;
      keep[cell.row] = 0;
      const auto [at, first] = cells.try_emplace({cell.column, cell.kind == BadCell::Kind::text}, First{&cell, 0});
      ++at->second.count;
    }
    bool usable = true;
    for (const std::size_t column : empty_columns_)
      findings_.add(Severity::note, "empty_column", file_, 0, plan_.wanted_names[column],
                    "it is empty throughout and counts as not measured", "");
    for (const auto& [key, first] : cells) usable = report(*first.cell, first.count) && usable;
    usable = report_bad_rows(keep) && usable;
    rows_.reserve(static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 1)));
    for (std::size_t row = 0; row < keep.size(); ++row)
      if (keep[row] != 0) rows_.push_back(static_cast<std::uint32_t>(row));
    return usable;
  }

  bool is_empty(std::size_t column_index) const {
    return std::find(empty_columns_.begin(), empty_columns_.end(), column_index) != empty_columns_.end();
  }

  bool report(const BadCell& cell, std::size_t count) {
    const std::size_t line = table_.line(cell.row);
    const std::string& column = plan_.wanted_names[cell.column];
    const std::string more = count > 1 ? fmt::format(", and {} more in this column", count - 1) : "";
    if (cell.kind == BadCell::Kind::text) {
      std::string remedy = "write a number, or take the line out";
      if (cell.row == 0) remedy = "a line of units or a second header must go, or begin with #";
      if (cell.text.find(',') != std::string::npos) remedy = "write numbers without separators of thousands";
      return fail("text_in_number", line, column, fmt::format("\"{}\" is not a number{}", cell.text, more), remedy);
    }
    const bool tolerated = findings_.tolerates("not_finite");
    findings_.add(Severity::error, "not_finite", file_, line, column,
                  table_.place(cell.row) + (cell.kind == BadCell::Kind::empty
                                                ? fmt::format("the value is missing{}", more)
                                                : fmt::format("\"{}\" is not a finite number{}", cell.text, more)),
                  tolerated ? "the samples were cut out as gaps"
                            : "find out why the logger wrote it; --tolerate not_finite cuts such samples out as gaps");
    return tolerated;
  }

  bool report_bad_rows(std::vector<std::uint8_t>& keep) {
    const BadRow* first = nullptr;
    std::size_t count = 0;
    for (const BadRow& row : table_.bad_rows) {
      if (selected_[row.row] == 0) continue;
      keep[row.row] = 0;
      if (first == nullptr) first = &row;
      ++count;
    }
    if (first == nullptr) return true;
    const bool tolerated = findings_.tolerates("row_length");
    findings_.add(Severity::error, "row_length", file_, table_.line(first->row), "",
                  fmt::format("the line has {} fields, the header another number{}", first->fields,
                              count > 1 ? fmt::format(", as have {} more lines", count - 1) : ""),
                  tolerated ? "the lines were cut out"
                            : "complete the line or take it out (decimal commas need semicolons between the columns); "
                              "--tolerate row_length cuts such lines out");
    return tolerated;
  }

  // Lines that a logger wrote twice, or a network brought in another order: where that is tolerated they are used once
  // and in the order of time. Rows that are further apart are another recording, and `time_increases` says so.
  bool order_rows() {
    if (!findings_.tolerates("time_not_increasing")) return true;
    constexpr std::size_t kFurthest = 10;
    std::vector<std::size_t> order(rows_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return time_[rows_[a]] < time_[rows_[b]]; });
    std::vector<std::uint32_t> sorted;
    std::size_t moved = 0, repeated = 0, first = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::uint32_t row = rows_[order[i]];
      if (std::max(order[i], i) - std::min(order[i], i) > kFurthest) return true;
      if (!sorted.empty() && time_[sorted.back()] == time_[row] && is_repeated(sorted.back(), row)) {
        ++repeated;
      } else {
        if (!sorted.empty() && row < sorted.back()) ++moved;
        sorted.push_back(row);
      }
      if (first == 0 && repeated + moved > 0) first = row;
    }
    if (moved + repeated == 0) return true;
    rows_ = std::move(sorted);
    findings_.add(
        Severity::error, "time_not_increasing", file_, table_.line(first), plan_.wanted_names[plan_.time_column],
        fmt::format("{}{} lines repeat the one before and {} are out of order", table_.place(first), repeated, moved),
        "they were used once, in the order of time");
    return true;
  }

  bool is_repeated(std::uint32_t a, std::uint32_t b) const {
    return std::all_of(table_.columns.begin(), table_.columns.end(), [&](const std::vector<double>& column) {
      return column[a] == column[b] || (std::isnan(column[a]) && std::isnan(column[b]));
    });
  }

  bool time_increases() {
    for (std::size_t i = 1; i < rows_.size(); ++i) {
      const double before = time_[rows_[i - 1]];
      const double now = time_[rows_[i]];
      if (now > before) continue;
      const bool tolerated = findings_.tolerates("time_not_increasing");
      const std::string repeated = tolerated
                                       ? "; these lines differ, so they are not one line written twice"
                                       : "; --tolerate time_not_increasing uses lines that are repeated exactly once";
      const std::string swapped = tolerated ? "" : "; --tolerate time_not_increasing sorts lines that are swapped";
      // It cannot be tolerated here, as the order of the samples is unknown.
      findings_.fail_later(
          "time_not_increasing", file_, table_.line(rows_[i]), plan_.wanted_names[plan_.time_column],
          fmt::format("{}the time {:.15g} s comes after {:.15g} s", table_.place(rows_[i]), now, before),
          now == before ? "log time with more digits, or take repeated lines out" + repeated
                        : "if recordings follow each other in this file, split it" + swapped);
      return false;
    }
    return true;
  }

  void convert(const PlannedColumn& planned, Axis axis) {
    const std::optional<Conversion> conversion = conversion_of(planned, plan_, axis, experiment_, findings_);
    if (!conversion || is_empty(planned.column_index)) return;
    const std::vector<double>& theirs = table_.columns[planned.column_index];
    std::vector<double>& ours = experiment_[planned.column];
    ours.reserve(rows_.size());
    std::vector<double> as_read;
    as_read.reserve(rows_.size());
    for (const std::size_t row : rows_) as_read.push_back(theirs[row]);
    experiment_.steps_as_read[static_cast<std::size_t>(planned.column)] =
        std::abs(conversion->factor) * signals::quantum_of(as_read).value_or(0.0);
    for (const double value : as_read) ours.push_back((*conversion)(value));
  }

  void take_time() {
    // In place where rows are in order: long recordings need the memory of the other array.
    if (!std::is_sorted(rows_.begin(), rows_.end())) {
      std::vector<double> ordered;
      ordered.reserve(rows_.size());
      for (const std::uint32_t row : rows_) ordered.push_back(time_[row]);
      time_ = std::move(ordered);
    } else {
      for (std::size_t i = 0; i < rows_.size(); ++i) time_[i] = time_[rows_[i]];
      time_.resize(rows_.size());
    }
    experiment_.time_s = std::move(time_);
  }

  bool set_time_base(const TimeBase& base, Axis axis) {
    experiment_.masked.assign(rows_.size(), 0);
    experiment_.sample_s = base.sample_s;
    experiment_.segments = base.segments;

    if (base.jitter > kJitterShare) {
      const bool tolerated = findings_.tolerates("jitter");
      findings_.add(
          Severity::error, "jitter", file_, 0, "time_s", jitter_text(base),
          tolerated
              ? "resampled nevertheless"
              : "log with a fixed sample rate; --tolerate jitter resamples, and new --tolerate jitter keeps it in "
                "dataset.toml");
      if (!tolerated) return false;
    } else if (base.jitter_max >= kUniformShare) {
      findings_.add(Severity::warning, "jitter", file_, 0, "time_s", jitter_text(base) + "; resampled evenly",
                    "log with a fixed sample rate where you can");
    }
    report_gaps(base);
    check_wrapped_positions(experiment_, axis, findings_);
    check_clipping(experiment_, findings_);
    // After resampling no value is a whole number.
    check_whole_numbers(experiment_, findings_);
    if (!base.uniform()) resample(experiment_, base);
    return drop_short_segments();
  }

  std::string jitter_text(const TimeBase& base) const {
    return fmt::format(
        "in \"{}\" 99 of 100 steps of time differ from {:.6g} s by at most {:.2g} %, the worst by {:.2g} %",
        experiment_.name, base.sample_s, std::max(0.01, 100.0 * base.jitter), 100.0 * base.jitter_max);
  }

  void report_gaps(const TimeBase& base) {
    if (base.segments.size() > 1)
      findings_.add(Severity::warning, "gap", file_, 0, "time_s",
                    fmt::format("\"{}\" has {} gaps, the longest of {:.4g} s at {}: {} segments", experiment_.name,
                                base.segments.size() - 1, base.longest_gap_s,
                                time_text(experiment_, base.longest_gap_at_s), base.segments.size()),
                    "nothing is filtered across them; find out why samples are lost");
    if (base.lost_samples > 0)
      findings_.add(Severity::warning, "gap", file_, 0, "time_s",
                    fmt::format("in \"{}\" {} samples are missing in places of one or two; they were interpolated",
                                experiment_.name, base.lost_samples),
                    "find out why samples are lost");
  }

  bool drop_short_segments() {
    std::vector<Segment> kept;
    std::size_t dropped = 0;
    for (const Segment& s : experiment_.segments) {
      if (s.last - s.first >= kMinimumSegment) {
        kept.push_back(s);
        continue;
      }
      ++dropped;
      for (std::size_t k = s.first; k < s.last; ++k) experiment_.masked[k] = 1;
    }
    experiment_.segments = kept;
    if (kept.empty())
      return fail("too_few_samples", 0, "",
                  fmt::format("\"{}\" has no {} samples without a gap", experiment_.name, kMinimumSegment),
                  "record without losing samples");
    if (dropped > 0)
      findings_.add(Severity::warning, "gap", file_, 0, "time_s",
                    fmt::format("in \"{}\" {} segments have fewer than {} samples; they are masked", experiment_.name,
                                dropped, kMinimumSegment),
                    "record without losing samples");
    return true;
  }

  const Table& table_;
  const ColumnPlan& plan_;
  Experiment& experiment_;
  Findings& findings_;
  std::string file_;
  std::vector<double> time_;
  std::vector<std::uint8_t> selected_;
  std::vector<std::uint32_t> rows_;  // those taken; as many as Table::lines can number
  std::vector<std::size_t> empty_columns_;
  double file_begin_ = 0.0;
  double file_end_ = 0.0;
};

}  // namespace

bool read_experiment(const Table& table, const ColumnPlan& plan, const TimeBounds& bounds, Axis axis,
                     Experiment& experiment, Findings& findings) {
  return ExperimentReader(table, plan, experiment, findings).read(bounds, axis);
}

}  // namespace flexspline::data
