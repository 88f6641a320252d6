#include "host/text/toml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

// The reader asserts what it then checks itself: a header such as "[.x]" would end the program where asserts are on,
// and let the optimiser leave out the check where they are off. Without either it is an error with a line. Every source
// that includes the reader has these lines: of functions that several compile, the linker takes one.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

namespace flexspline::text {
namespace {

// The reader counts columns in code points; texts are cut in bytes.
class Offsets {
 public:
  explicit Offsets(std::string_view text) : text_(text) {
    line_starts_.push_back(text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') line_starts_.push_back(i + 1);
  }

  std::size_t at(toml::source_position position) const {
    if (position.line == 0) return 0;
    std::size_t offset = line_starts_[std::min<std::size_t>(position.line, line_starts_.size()) - 1];
    for (std::size_t column = 1; column < position.column && offset < text_.size(); ++column) {
      ++offset;
      while (offset < text_.size() && (static_cast<unsigned char>(text_[offset]) & 0xC0U) == 0x80U) ++offset;
    }
    return offset;
  }

  Span span(const toml::source_region& region) const { return {at(region.begin), at(region.end)}; }

 private:
  std::string_view text_;
  std::vector<std::size_t> line_starts_;
};

Node convert(const toml::node& from, const Offsets& offsets, std::string_view text) {
  Node node;
  node.span = offsets.span(from.source());
  node.line = std::max<std::size_t>(from.source().begin.line, 1);
  if (const toml::table* table = from.as_table()) {
    node.kind = NodeKind::table;
    node.is_inline = table->is_inline();
    bool child_has_the_same_header = false;
    for (auto&& [key, value] : *table) {
      Entry entry{std::string(key.str()), offsets.span(key.source()), key.source().begin.line,
                  convert(value, offsets, text)};
      const Node& first =
          entry.value.kind == NodeKind::array && !entry.value.items.empty() ? entry.value.items.front() : entry.value;
      child_has_the_same_header |= first.kind == NodeKind::table && first.span.begin == node.span.begin;
      node.entries.push_back(std::move(entry));
    }
    std::ranges::sort(node.entries, {}, [](const Entry& entry) { return entry.key_span.begin; });
    node.has_header =
        !node.is_inline && node.span.begin < text.size() && text[node.span.begin] == '[' && !child_has_the_same_header;
  } else if (const toml::array* array = from.as_array()) {
    node.kind = NodeKind::array;
    for (const toml::node& item : *array) node.items.push_back(convert(item, offsets, text));
  } else if (const auto* string = from.as_string()) {
    node.kind = NodeKind::text;
    node.text = string->get();
  } else if (const auto* floating = from.as_floating_point()) {
    node.kind = NodeKind::number;
    node.number = floating->get();
  } else if (const auto* integer = from.as_integer()) {
    node.kind = NodeKind::number;
    node.number = static_cast<double>(integer->get());
  } else if (const auto* boolean = from.as_boolean()) {
    node.kind = NodeKind::boolean;
    node.boolean = boolean->get();
  }
  return node;
}

// Behind the text in quotes that begins at `at`; one on a single line ends with the line at the latest.
std::size_t end_of_quotes(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool is_long = text.substr(at, 3) == std::string(3, quote);
  const std::string_view end = text.substr(at, is_long ? 3 : 1);
  for (at += end.size(); at < text.size(); ++at) {
    if (quote == '"' && text[at] == '\\') {
      ++at;
    } else if (text.substr(at, end.size()) == end) {
      at += end.size();
      // Up to two more belong to the text.
      for (int more = 0; is_long && more < 2 && at < text.size() && text[at] == quote; ++more) ++at;
      return at;
    } else if (!is_long && text[at] == '\n') {
      return at;
    }
  }
  return text.size();
}

bool is_ascii(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80U; });
}

// Finds what the reader does not survive in all its builds.
class Guard {
 public:
  explicit Guard(std::string_view text) : text_(text) {}

  void check() {
    at_ = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    bool line_begins = true;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '[' && line_begins && open_.empty()) require_name_in_header();
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (c == '"' || c == '\'') {
        skip_quotes();
      } else {
        skip(c);
      }
      line_begins = c == '\n' || (line_begins && (c == ' ' || c == '\t'));
    }
  }

 private:
  std::size_t line() const { return 1 + static_cast<std::size_t>(std::ranges::count(text_.substr(0, at_), '\n')); }

  void skip(char c) {
    if (static_cast<unsigned char>(c) >= 0x80U) fail_not_ascii();
    if (static_cast<unsigned char>(c) < 0x20U && c != '\n' && c != '\r' && c != '\t')
      throw TomlError(line(), 0, "a control character is outside quotes", "remove it");
    if (c == '[' || c == '{') open_ += c;
    if (c == (in('[') ? ']' : '}') && !open_.empty()) open_.pop_back();
    if (c == '\n' || c == ',' || c == '[' || c == '{') key_done_ = in('[');
    const bool begins_value = c == '=' && !key_done_;
    if (c == '=') key_done_ = true;
    value_at_ = begins_value ? at_ + 1 : value_at_;
    ++at_;
  }
  bool in(char bracket) const { return !open_.empty() && open_.back() == bracket; }

  // TOML knows letters beyond ASCII only in quotes and comments. The reader reports it, but not for all of them: for
  // those from U+00A1 up to some hundred its behaviour is undefined, also where it looks ahead from a number into
  // quotes that follow without a space, or with no more than a name and an equals sign between them.
  void skip_quotes() {
    const std::size_t end = end_of_quotes(text_, at_);
    const bool is_separate =
        at_ == 0 || at_ == value_at_ || std::string_view(" \t\n,[{").find(text_[at_ - 1]) != std::string_view::npos;
    if (!is_separate && !is_ascii(text_.substr(at_, end - at_))) fail_not_ascii();
    at_ = end;
  }

  [[noreturn]] void fail_not_ascii() const {
    throw TomlError(line(), 0, "a letter or sign that is not ASCII is outside quotes",
                    "correct it, or put the whole text in quotes");
  }

  // The reader asserts on a header that begins with no key.
  void require_name_in_header() const {
    std::string_view header = text_.substr(at_, text_.find('\n', at_) - at_);
    if (header.ends_with('\r')) header.remove_suffix(1);
    const std::size_t key = header.find_first_not_of(" \t", header.starts_with("[[") ? 2 : 1);
    const auto begins_key = [](char c) {
      return static_cast<unsigned char>(c) >= 0x80U || std::isalnum(static_cast<unsigned char>(c)) != 0 ||
             std::string_view("_-\"']").find(c) != std::string_view::npos;
    };
    if (key == std::string_view::npos || !begins_key(header[key]))
      throw TomlError(line(), 0, fmt::format("no name follows the bracket in {}", header),
                      "correct the line: the name of the table is between the brackets");
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string open_;          // brackets and braces
  bool key_done_ = false;     // an equals sign more in this entry begins no value; in an array none does
  std::size_t value_at_ = 0;  // right after the equals sign that does
};

}  // namespace

const Entry* Node::entry(std::string_view key) const {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry;
  return nullptr;
}

const Node* Node::find(std::string_view key) const {
  const Entry* found = entry(key);
  return found ? &found->value : nullptr;
}

std::string_view Node::kind_name() const {
  switch (kind) {
    case NodeKind::table:
      return "a table";
    case NodeKind::array:
      return "an array";
    case NodeKind::text:
      return "text";
    case NodeKind::number:
      return "a number";
    case NodeKind::boolean:
      return "true or false";
    case NodeKind::other:
      break;
  }
  return "a date or time";
}

Node parse_toml(std::string_view text) {
  Guard(text).check();
  try {
    const toml::table root = toml::parse(text);
    Node node = convert(root, Offsets(text), text);
    node.has_header = false;  // where a file begins with a header the root begins there too
    return node;
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw TomlError(std::max<std::size_t>(at.line, 1), at.column, std::string(error.description()),
                    "correct the line (numbers have a decimal point, text is in quotes, a key is used once in its "
                    "table, the file is UTF-8)");
  }
}

}  // namespace flexspline::text
