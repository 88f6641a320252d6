#include "host/data/dataset_toml.hpp"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <cctype>
#include <cmath>
#include <fstream>

namespace flexspline::data {
namespace {

constexpr std::string_view kFormat = "flexspline-dataset/1";

class Reader {
 public:
  Reader(std::filesystem::path path, Findings& findings) : findings_(findings) { toml_.file = std::move(path); }

  DatasetToml read() {
    const toml::table root = parse();
    check_format(root);
    for (const auto& [key, node] : root) {
      if (key == "format") continue;
      if (key == "drive")
        each(node, "[drive]", [&](std::string_view k, const toml::node& v) { drive(k, v); });
      else if (key == "columns")
        each(node, "[columns]", [&](std::string_view k, const toml::node& v) { column(k, v); });
      else if (key == "experiment")
        experiments(node);
      else
        unknown(node, std::string(key.str()), nearest(key.str(), {"format", "drive", "columns", "experiment"}));
    }
    return std::move(toml_);
  }

 private:
  std::string file() const { return toml_.file.string(); }
  static std::size_t line(const toml::node& node) { return node.source().begin.line; }

  // toml++ 3.3 asserts, in builds with assertions, on a header that begins with no key, "[.a]": a user's mistake.
  void refuse_headers_without_a_key() {
    std::ifstream stream(toml_.file);
    std::string text;
    for (std::size_t number = 1; std::getline(stream, text); ++number) {
      const std::size_t bracket = text.find_first_not_of(" \t\xEF\xBB\xBF");
      if (bracket == std::string::npos || text[bracket] != '[') continue;
      const std::size_t key = text.find_first_not_of(" \t", bracket + (text.compare(bracket, 2, "[[") == 0 ? 2 : 1));
      const bool starts_key =
          key != std::string::npos && (std::isalnum(static_cast<unsigned char>(text[key])) != 0 ||
                                       std::string_view("_-\"']").find(text[key]) != std::string_view::npos);
      if (!starts_key)
        findings_.fail("format", file(), number, fmt::format("no valid TOML: no name follows the bracket in {}", text),
                       "mend this line");
    }
  }

  toml::table parse() {
    refuse_headers_without_a_key();
    try {
      return toml::parse_file(toml_.file.string());
    } catch (const toml::parse_error& error) {
      const auto at = error.source().begin;
      findings_.fail(at.line > 0 ? "format" : "file", file(), at.line,
                     at.line > 0 ? fmt::format("no valid TOML at column {}: {}", at.column, error.description())
                                 : "cannot read this file",
                     at.line > 0 ? "mend this line" : "check the path and the permissions");
    }
  }

  void check_format(const toml::table& root) {
    const toml::node* node = root.get("format");
    if (node == nullptr) {
      findings_.add(Severity::warning, "unknown_key", file(), 1, "", "the file does not say its format",
                    fmt::format("write format = \"{}\" as its first line", kFormat));
      return;
    }
    const std::string format = node->value_or(std::string{});
    if (format == kFormat) return;
    findings_.fail("format", file(), line(*node),
                   fmt::format("the format is \"{}\", this tool reads \"{}\"", format, kFormat),
                   format.starts_with("flexspline-model/") ? "this is a model: give it as --model"
                   : format.starts_with("flexspline-dataset/")
                       ? "use a tool that knows this format, or write it anew with `flexspline new`"
                       : "give a data set");
  }

  void unknown(const toml::node& node, const std::string& key, const std::string& near) {
    findings_.add(Severity::warning, "unknown_key", file(), line(node), "",
                  fmt::format("the key {} is not known here and is ignored", key),
                  near.empty() ? "take it out" : fmt::format("did you mean {}?", near));
  }

  void wrong_type(const toml::node& node, std::string_view key, std::string_view expected) {
    findings_.add(Severity::error, "key", file(), line(node), "", fmt::format("{} must be {}", key, expected),
                  "see the format of dataset.toml");
  }

  template <typename Visit>
  void each(const toml::node& node, std::string_view what, Visit visit) {
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      wrong_type(node, what, "a table");
      return;
    }
    for (const auto& [key, value] : *table) visit(key.str(), value);
  }

  std::optional<double> number(std::string_view key, const toml::node& node) {
    const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
    if (value && std::isfinite(*value)) return value;
    wrong_type(node, key, "a number");
    return std::nullopt;
  }

  std::string text(std::string_view key, const toml::node& node) {
    const std::optional<std::string> value = node.value_exact<std::string>();
    if (!value) wrong_type(node, key, "text in quotes");
    return value.value_or(std::string{});
  }

  void take(KeyMap& keys, std::string_view key, const toml::node& node) {
    KeyValue value;
    value.file = file();
    value.line = line(node);
    if (node.is_number()) {
      value.number = node.value<double>();
      value.text = fmt::format("{}", *value.number);
    } else if (node.is_string()) {
      value.text = node.value_or(std::string{});
    } else {
      wrong_type(node, key, "a number or text");
      return;
    }
    keys.insert_or_assign(std::string(key), value);
  }

  void drive(std::string_view key, const toml::node& node) {
    if (is_drive_key(key))
      take(toml_.drive, key, node);
    else if (is_experiment_key(key) && key != "experiment" && key != "replicate_of")
      take(toml_.defaults, key, node);
    else
      unknown(node, fmt::format("{} of [drive]", key), nearest_key(key));
  }

  void column(std::string_view name, const toml::node& node) {
    if (name != "time_s" && !column_from_name(name)) {
      std::vector<std::string_view> names = {"time_s"};
      for (std::size_t i = 0; i < kColumns; ++i) names.push_back(column_name(static_cast<Column>(i)));
      unknown(node, fmt::format("[columns.{}]", name), nearest(name, names));
      return;
    }
    ColumnMapping mapping;
    mapping.source = name;
    mapping.line = line(node);
    each(node, fmt::format("columns.{}", name), [&](std::string_view key, const toml::node& value) {
      if (key == "source")
        mapping.source = text(key, value);
      else if (key == "unit")
        mapping.unit = text(key, value);
      else if (key == "scale")
        mapping.scale = number(key, value).value_or(1.0);
      else if (key == "offset")
        mapping.offset = number(key, value).value_or(0.0);
      else
        unknown(value, fmt::format("{} of [columns.{}]", key, name),
                nearest(key, {"source", "unit", "scale", "offset"}));
    });
    if (mapping.scale == 0.0)
      findings_.add(Severity::error, "key", file(), mapping.line, std::string(name), "scale is zero",
                    "give the factor from their unit to ours, or leave scale out");
    toml_.columns.insert_or_assign(std::string(name), mapping);
  }

  void experiments(const toml::node& node) {
    const toml::array* array = node.as_array();
    if (array == nullptr) {
      wrong_type(node, "experiment", "a list of tables: write [[experiment]] with two brackets");
      return;
    }
    for (const toml::node& entry : *array) experiment(entry);
  }

  void experiment(const toml::node& node) {
    ExperimentEntry entry;
    entry.line = line(node);
    each(node, "[[experiment]]", [&](std::string_view key, const toml::node& value) {
      if (key == "file")
        entry.file = text(key, value);
      else if (key == "from_s")
        entry.from_s = number(key, value);
      else if (key == "to_s")
        entry.to_s = number(key, value);
      else if (key == "name")
        take(entry.keys, "experiment", value);
      else if (is_experiment_key(key))
        take(entry.keys, key, value);
      else if (is_drive_key(key))
        findings_.add(Severity::warning, "unknown_key", file(), line(value), "",
                      fmt::format("{} is a fact of the drive and is ignored here", key), "write it under [drive]");
      else
        unknown(value, fmt::format("{} of [[experiment]]", key), near_experiment_key(key));
    });
    if (entry.file.empty()) {
      findings_.add(Severity::error, "key", file(), entry.line, "", "this [[experiment]] names no file",
                    "write file = \"NAME.csv\"");
      return;
    }
    if (entry.file.is_relative()) entry.file = toml_.file.parent_path() / entry.file;
    if (entry.from_s && entry.to_s && !(*entry.from_s < *entry.to_s))
      findings_.add(Severity::error, "key", file(), entry.line, "",
                    fmt::format("from_s = {} is not before to_s = {}", *entry.from_s, *entry.to_s),
                    "give the start first; the end is not part of the experiment");
    toml_.experiments.push_back(std::move(entry));
  }

  static std::string near_experiment_key(std::string_view key) {
    const std::string near = nearest(key, {"file", "name", "from_s", "to_s", "role", "load"});
    return near.empty() ? nearest_key(key) : near;
  }

  Findings& findings_;
  DatasetToml toml_;
};

}  // namespace

DatasetToml read_dataset_toml(const std::filesystem::path& path, Findings& findings) {
  DatasetToml toml = Reader(path, findings).read();
  findings.throw_if_errors();  // what follows would only be complaints about the same lines
  return toml;
}

}  // namespace flexspline::data
