#include "host/input/data/dataset_toml.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "host/common/text/nearest.hpp"
#include "host/common/text/toml.hpp"

namespace flexspline::data {
namespace {

using text::Node;
using text::NodeKind;

constexpr std::string_view kFormat = "flexspline-dataset/1";

// The same file without "..", for messages; as it was where a symbolic link makes that another file.
std::filesystem::path without_dots(std::filesystem::path path) {
  std::error_code failed;
  std::filesystem::path shorter = path.lexically_normal();
  return std::filesystem::equivalent(shorter, path, failed) ? shorter : path;
}

class Reader {
 public:
  Reader(std::filesystem::path path, Findings& findings) : findings_(findings) { toml_.file = std::move(path); }

  DatasetToml read() {
    const Node root = parse();
    check_format(root);
    for (const auto& entry : root.entries) {
      const std::string& key = entry.key;
      const Node& node = entry.value;
      if (key == "format") continue;
      if (key == "drive")
        each(node, "[drive]", [&](std::string_view k, const Node& v) { drive(k, v); });
      else if (key == "columns")
        each(node, "[columns]", [&](std::string_view k, const Node& v) { column(k, v); });
      else if (key == "experiment")
        experiments(node);
      else if (key == "tolerate")
        tolerate(node);
      else
        unknown(node, key, text::nearest(key, {"format", "tolerate", "drive", "columns", "experiment"}));
    }
    return std::move(toml_);
  }

 private:
  std::string file() const { return toml_.file.string(); }

  Node parse() {
    std::ifstream stream(toml_.file, std::ios::binary);
    std::ostringstream content;
    if (stream.peek() != std::ifstream::traits_type::eof()) content << stream.rdbuf();
    if (!stream.is_open() || stream.bad())
      findings_.fail("file", file(), 0, "cannot read this file", "check the path and the permissions");
    try {
      return text::parse_toml(content.view());
    } catch (const text::TomlError& error) {
      const std::string where = error.column() > 0 ? fmt::format(" at column {}", error.column()) : std::string();
      findings_.fail("format", file(), error.line(), fmt::format("no valid TOML{}: {}", where, error.what()),
                     "correct this line");
    }
  }

  void check_format(const Node& root) {
    const Node* node = root.find("format");
    if (node == nullptr) {
      findings_.add(Severity::warning, "unknown_key", file(), 1, "", "the file does not state its format",
                    fmt::format("write format = \"{}\" as its first line", kFormat));
      return;
    }
    const std::string format = node->text;
    if (format == kFormat) return;
    findings_.fail("format", file(), node->line,
                   fmt::format("the format is \"{}\", this tool reads \"{}\"", format, kFormat),
                   format.starts_with("flexspline-model/") ? "this is a model: give it as --model"
                   : format.starts_with("flexspline-dataset/")
                       ? "use a tool that knows this format, or write it again with `flexspline new`"
                       : "give a data set");
  }

  void unknown(const Node& node, const std::string& key, const std::string& near) {
    findings_.add(Severity::warning, "unknown_key", file(), node.line, "",
                  fmt::format("the key {} is not known here and is ignored", key),
                  near.empty() ? "take it out" : fmt::format("did you mean {}?", near));
  }

  void wrong_type(const Node& node, std::string_view key, std::string_view expected) {
    findings_.add(Severity::error, "key", file(), node.line, "", fmt::format("{} must be {}", key, expected),
                  "see the format of dataset.toml");
  }

  template <typename Visit>
  void each(const Node& node, std::string_view what, Visit visit) {
    if (node.kind != NodeKind::table) {
      wrong_type(node, what, "a table");
      return;
    }
    for (const auto& entry : node.entries) visit(entry.key, entry.value);
  }

  std::optional<double> number(std::string_view key, const Node& node) {
    if (node.kind == NodeKind::number && std::isfinite(node.number)) return node.number;
    wrong_type(node, key, "a number");
    return std::nullopt;
  }

  std::string text(std::string_view key, const Node& node) {
    if (node.kind != NodeKind::text) wrong_type(node, key, "text in quotes");
    return node.text;
  }

  void take(KeyMap& keys, std::string_view key, const Node& node) {
    KeyValue value;
    value.file = file();
    value.line = node.line;
    if (node.kind == NodeKind::number) {
      value.number = node.number;
      value.text = fmt::format("{}", *value.number);
    } else if (node.kind == NodeKind::text) {
      value.text = node.text;
    } else {
      wrong_type(node, key, "a number or text");
      return;
    }
    keys.insert_or_assign(std::string(key), value);
  }

  void drive(std::string_view key, const Node& node) {
    if (is_drive_key(key))
      take(toml_.drive, key, node);
    else if (is_experiment_key(key) && key != "experiment" && key != "replicate_of")
      take(toml_.defaults, key, node);
    else
      unknown(node, fmt::format("{} of [drive]", key), nearest_key(key));
  }

  void column(std::string_view name, const Node& node) {
    if (name != "time_s" && !column_from_name(name)) {
      std::vector<std::string_view> names = {"time_s"};
      for (std::size_t i = 0; i < kColumns; ++i) names.push_back(column_name(static_cast<Column>(i)));
      unknown(node, fmt::format("[columns.{}]", name), text::nearest(name, names));
      return;
    }
    ColumnMapping mapping;
    mapping.source = name;
    mapping.line = node.line;
    each(node, fmt::format("columns.{}", name), [&](std::string_view key, const Node& value) {
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
                text::nearest(key, {"source", "unit", "scale", "offset"}));
    });
    if (mapping.scale == 0.0)
      findings_.add(Severity::error, "key", file(), mapping.line, std::string(name), "scale is zero",
                    "give the factor from their unit to ours, or leave scale out");
    toml_.columns.insert_or_assign(std::string(name), mapping);
  }

  void tolerate(const Node& node) {
    if (node.kind != NodeKind::array) {
      wrong_type(node, "tolerate", "a list of kinds: tolerate = [\"jitter\"]");
      return;
    }
    for (const Node& kind : node.items)
      if (std::string name = text("tolerate", kind); !name.empty()) toml_.tolerate.push_back(std::move(name));
    findings_.check_kinds(toml_.tolerate, file(), node.line);
  }

  void experiments(const Node& node) {
    if (node.kind != NodeKind::array) {
      wrong_type(node, "experiment", "a list of tables: write [[experiment]] with two brackets");
      return;
    }
    for (const Node& entry : node.items) experiment(entry);
  }

  void experiment(const Node& node) {
    ExperimentEntry entry;
    entry.line = node.line;
    each(node, "[[experiment]]", [&](std::string_view key, const Node& value) {
      if (key == "file")
        entry.file = text(key, value);
      else if (key == "from_s")
        entry.from_s = number(key, value);
      else if (key == "to_s")
        entry.to_s = number(key, value);
      else if (key == "element")
        entry.element = element(value);
      else if (key == "name")
        take(entry.keys, "experiment", value);
      else if (is_experiment_key(key))
        take(entry.keys, key, value);
      else if (is_drive_key(key))
        findings_.add(Severity::warning, "unknown_key", file(), value.line, "",
                      fmt::format("{} is a fact of the drive and is ignored here", key), "write it under [drive]");
      else
        unknown(value, fmt::format("{} of [[experiment]]", key), near_experiment_key(key));
    });
    if (entry.file.empty()) {
      findings_.add(Severity::error, "key", file(), entry.line, "", "this [[experiment]] names no file",
                    "write file = \"NAME.csv\"");
      return;
    }
    if (entry.file.is_relative()) entry.file = without_dots(toml_.file.parent_path() / entry.file);
    if (entry.from_s && entry.to_s && !(*entry.from_s < *entry.to_s))
      findings_.add(Severity::error, "key", file(), entry.line, "",
                    fmt::format("from_s = {} is not before to_s = {}", *entry.from_s, *entry.to_s),
                    "give the start first; the end is not part of the experiment");
    toml_.experiments.push_back(std::move(entry));
  }

  std::optional<std::size_t> element(const Node& node) {
    const std::optional<double> value = number("element", node);
    if (value && *value >= 1.0 && *value < 1e6 && *value == std::floor(*value)) return static_cast<std::size_t>(*value);
    if (value) wrong_type(node, "element", "a whole number from 1 on");
    return std::nullopt;
  }

  static std::string near_experiment_key(std::string_view key) {
    const std::string near = text::nearest(key, {"file", "name", "from_s", "to_s", "element", "role", "load"});
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
