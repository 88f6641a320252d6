#include "host/input/data/columns.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/common/text/nearest.hpp"
#include "host/input/data/units.hpp"

namespace flexspline::data {
namespace {

std::string quoted_list(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 40;  // a MAT file may hold hundreds
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i)
    text += (i == 0 ? "" : ", ") + fmt::format("\"{}\"", names[i]);
  return names.size() > kMost ? fmt::format("{} and {} more", text, names.size() - kMost) : text;
}

std::string near_column(std::string_view name) {
  std::vector<std::string_view> ours = {"time_s"};
  for (std::size_t i = 0; i < kColumns; ++i) ours.push_back(column_name(static_cast<Column>(i)));
  return text::nearest(name, ours);
}

class Planner {
 public:
  Planner(const Recording& recording, std::string file, const DatasetToml* toml, std::optional<std::size_t> element,
          Findings& findings)
      : recording_(recording), file_(std::move(file)), toml_(toml), element_(element), findings_(findings) {
    if (toml_ != nullptr) plan_.mapping_file = toml_->file.string();
  }

  std::optional<ColumnPlan> plan() {
    has_time_ = find_time();
    for (std::size_t i = 0; i < kColumns; ++i) find(static_cast<Column>(i));
    list_unused();
    if (has_time_ && plan_.columns.empty())
      findings_.add(Severity::error, "missing_column", file_, recording_.header_line(), "",
                    fmt::format("no column other than time is known; not used: {}", quoted_list(plan_.unused)),
                    "map them in dataset.toml: [columns.current_a] with source = \"NAME IN THE FILE\" and unit");
    if (!has_time_ || plan_.columns.empty()) return std::nullopt;
    return std::move(plan_);
  }

 private:
  const ColumnMapping* mapping_of(std::string_view ours) const {
    if (toml_ == nullptr) return nullptr;
    const auto at = toml_->columns.find(std::string(ours));
    return at == toml_->columns.end() ? nullptr : &at->second;
  }

  // Index of the file's column with this name.
  std::optional<std::size_t> column_index(std::string_view wanted) {
    const std::vector<std::string>& names = recording_.names();
    const std::string theirs = element_ ? name_of_element(names, wanted, *element_) : std::string(wanted);
    const auto at = std::find(names.begin(), names.end(), theirs);
    if (at == names.end()) return std::nullopt;
    if (std::find(at + 1, names.end(), theirs) != names.end())
      findings_.add(Severity::error, "header", file_, recording_.header_line(), theirs,
                    "this name is in the header twice", "rename one of the two");
    const std::size_t index = static_cast<std::size_t>(at - names.begin());
    const auto known = std::find(plan_.wanted.begin(), plan_.wanted.end(), index);
    if (known != plan_.wanted.end()) return static_cast<std::size_t>(known - plan_.wanted.begin());
    plan_.wanted.push_back(index);
    plan_.wanted_names.emplace_back(theirs);
    return plan_.wanted.size() - 1;
  }

  std::string near_first(std::string_view name) const {
    return quoted_list(text::nearest_first(name, recording_.names()));
  }

  // A unit in the file is used unless the user gives another one.
  void take_unit_of_file(std::size_t column_index, ColumnMapping& mapping) const {
    if (mapping.unit.empty() && mapping.scale == 1.0 && mapping.offset == 0.0)
      mapping.unit = recording_.unit(plan_.wanted[column_index]);
  }

  // There is an entry of this name, but it cannot be a column.
  bool is_no_column(const std::string& theirs, const std::string& ours) {
    const std::string why = recording_.why_not(theirs);
    if (why.empty()) return false;
    findings_.add(Severity::error, "mapping", file_, 0, ours, fmt::format("\"{}\" {}", theirs, why),
                  fmt::format("save it as a vector of real numbers, or map another to {}; those there are {}", ours,
                              near_first(theirs)));
    return true;
  }

  bool has_length_of_time(std::size_t column_index, const std::string& ours) {
    if (!has_time_) return true;
    const std::size_t length = recording_.length(plan_.wanted[column_index]);
    const std::size_t time = recording_.length(plan_.wanted[plan_.time_column]);
    if (length == time) return true;
    findings_.add(Severity::error, "mapping", file_, 0, ours,
                  fmt::format("\"{}\" has {} values, but the time \"{}\" has {}", plan_.wanted_names[column_index],
                              length, plan_.time.source, time),
                  "map the time that belongs to it, or bring all to one time in MATLAB: interp1(t, x, time_s)");
    plan_.wanted.pop_back();  // it is new there: what was wanted before has the length of time
    plan_.wanted_names.pop_back();
    return false;
  }

  bool find_time() {
    plan_.time.source = "time_s";
    if (const ColumnMapping* mapping = mapping_of("time_s")) plan_.time = *mapping;
    const std::optional<std::size_t> found = column_index(plan_.time.source);
    if (!found) {
      if (is_no_column(plan_.time.source, "time_s")) return false;
      findings_.add(Severity::error, "missing_column", file_, recording_.header_line(), "time_s",
                    fmt::format("there is no column \"{}\" among {}", plan_.time.source, near_first(plan_.time.source)),
                    "name the column of time time_s, or map it in dataset.toml: [columns.time_s] with source and unit");
      return false;
    }
    plan_.time_column = *found;
    take_unit_of_file(*found, plan_.time);
    return true;
  }

  void find(Column column) {
    const std::string name(column_name(column));
    const ColumnMapping* mapping = mapping_of(name);
    PlannedColumn planned;
    planned.column = column;
    planned.mapped = mapping != nullptr;
    planned.mapping.source = name;
    if (mapping != nullptr) planned.mapping = *mapping;
    const std::optional<std::size_t> found = column_index(planned.mapping.source);
    if (!found) {
      if (is_no_column(planned.mapping.source, name)) return;
      if (mapping != nullptr)
        findings_.add(Severity::warning, "mapping", file_, recording_.header_line(), name,
                      fmt::format("the file has no column \"{}\" that it is mapped from, so it is not measured here",
                                  planned.mapping.source),
                      fmt::format("the columns are {}", near_first(planned.mapping.source)));
      return;
    }
    if (!has_length_of_time(*found, name)) return;
    planned.column_index = *found;
    take_unit_of_file(*found, planned.mapping);
    plan_.columns.push_back(planned);
  }

  void list_unused() {
    std::string nearly;
    for (std::size_t i = 0; i < recording_.names().size(); ++i) {
      const std::string& name = recording_.names()[i];
      if (name.empty() || std::find(plan_.wanted.begin(), plan_.wanted.end(), i) != plan_.wanted.end()) continue;
      plan_.unused.push_back(name);
      const std::string near = column_from_name(name) ? "" : near_column(name);
      if (!near.empty()) nearly += fmt::format("{}{} for {}", nearly.empty() ? "" : ", ", near, name);
    }
    if (plan_.unused.empty()) return;
    findings_.add(nearly.empty() ? Severity::note : Severity::warning, "unused_column", file_, recording_.header_line(),
                  "", fmt::format("not used: {}", quoted_list(plan_.unused)),
                  nearly.empty() ? "map those that matter in dataset.toml" : fmt::format("did you mean {}?", nearly));
  }

  const Recording& recording_;
  std::string file_;
  const DatasetToml* toml_;
  std::optional<std::size_t> element_;
  Findings& findings_;
  ColumnPlan plan_;
  bool has_time_ = false;
};

}  // namespace

std::optional<ColumnPlan> plan_columns(const Recording& recording, const std::filesystem::path& path,
                                       const DatasetToml* toml, std::optional<std::size_t> element,
                                       Findings& findings) {
  return Planner(recording, path.string(), toml, element, findings).plan();
}

namespace {

struct UnitUse {
  std::string_view ours;  // column name
  Quantity quantity;
  const ColumnMapping& mapping;
  std::string file;
};

std::nullopt_t refuse(const UnitUse& use, const std::string& what, Findings& findings) {
  findings.add(Severity::error, "mapping", use.file, use.mapping.line, std::string(use.ours), what,
               fmt::format("write one of {}; or leave unit out and let scale convert", known_units(use.quantity)));
  return std::nullopt;
}

// `per_count`: SI per encoder count, where the counts are known.
std::optional<Conversion> convert(const UnitUse& use, std::optional<double> per_count, std::string_view counts_key,
                                  Findings& findings) {
  const ColumnMapping& mapping = use.mapping;
  Conversion conversion{mapping.scale, mapping.offset};
  if (mapping.unit.empty()) return conversion;
  std::optional<Unit> unit = unit_from_text(mapping.unit);
  if (!unit) return refuse(use, fmt::format("the unit \"{}\" is not known", mapping.unit), findings);
  const bool counts = unit->quantity == Quantity::counts || unit->quantity == Quantity::counts_rate;
  const bool rate = use.quantity == Quantity::angular_velocity || use.quantity == Quantity::velocity;
  const bool position = use.quantity == Quantity::angle || use.quantity == Quantity::length;
  if (counts && (unit->quantity == Quantity::counts ? position : rate)) {
    if (!per_count) {
      findings.add(Severity::error, "mapping", use.file, mapping.line, std::string(use.ours),
                   fmt::format("its unit is {}, but {} is not given", mapping.unit, counts_key),
                   fmt::format("write {} = NUMBER under [drive]", counts_key));
      return std::nullopt;
    }
    unit->factor = *per_count;
  } else if (are_sisters(unit->quantity, use.quantity)) {
    if (mapping.scale == 1.0)
      findings.add(
          Severity::warning, "unit", use.file, mapping.line, std::string(use.ours),
          fmt::format("its unit is {}, but {} are meant here and scale is 1", mapping.unit, si_unit(use.quantity)),
          "write axis under [drive], or give the lever arm or pitch as scale");
  } else if (unit->quantity != use.quantity) {
    return refuse(use, fmt::format("the unit {} does not fit a column in {}", mapping.unit, si_unit(use.quantity)),
                  findings);
  }
  conversion.factor = mapping.scale * unit->factor;
  conversion.offset += mapping.scale * unit->offset;
  return conversion;
}

}  // namespace

std::optional<Conversion> conversion_of(const PlannedColumn& planned, const ColumnPlan& plan, Axis axis,
                                        const Experiment& experiment, Findings& findings) {
  const bool of_output = planned.column == Column::output_position || planned.column == Column::output_velocity;
  const std::optional<double>& counts = of_output ? experiment.output_encoder_counts : experiment.encoder_counts;
  return convert({column_name(planned.column), quantity_of(planned.column, axis), planned.mapping, plan.mapping_file},
                 encoder_step(counts, axis), of_output ? "output_encoder_counts" : "encoder_counts", findings);
}

std::optional<Conversion> time_conversion(const ColumnPlan& plan, Findings& findings) {
  return convert({"time_s", Quantity::time, plan.time, plan.mapping_file}, std::nullopt, "", findings);
}

}  // namespace flexspline::data
