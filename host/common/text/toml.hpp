// A TOML text as a tree that knows where in the text each key and value is, so that values can be replaced there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace flexspline::text {

// Half-open range of bytes of the text.
struct Span {
  std::size_t begin = 0;
  std::size_t end = 0;
};

enum class NodeKind : std::uint8_t { table, array, text, number, boolean, other };

struct Entry;

struct Node {
  NodeKind kind = NodeKind::other;
  Span span;                   // value; of a table with a header the header, of one made by dotted keys its first key
  std::size_t line = 1;        // where the span begins, from 1
  bool is_inline = false;      // table in braces
  bool has_header = false;     // table with a [header] or [[header]] of its own
  std::string text;            // kind text
  double number = 0.0;         // kind number: integers and floats, infinity and NaN included
  bool boolean = false;        // kind boolean
  std::vector<Entry> entries;  // kind table, in the order of the text
  std::vector<Node> items;     // kind array

  const Node* find(std::string_view key) const;    // nullptr: not there
  const Entry* entry(std::string_view key) const;  // nullptr: not there
  // "a table", "text", ...: for messages.
  std::string_view kind_name() const;
};

struct Entry {
  std::string key;
  Span key_span;  // of a dotted key the last part
  std::size_t line = 1;
  Node value;
};

// What makes a text no TOML; what() says it without the place. Whoever knows the file turns it into an error of his
// own.
class TomlError : public std::runtime_error {
 public:
  TomlError(std::size_t line, std::size_t column, const std::string& what, std::string remedy)
      : std::runtime_error(what), line_(line), column_(column), remedy_(std::move(remedy)) {}

  std::size_t line() const { return line_; }      // from 1
  std::size_t column() const { return column_; }  // from 1; 0 where the whole line is meant
  const std::string& remedy() const { return remedy_; }

 private:
  std::size_t line_;
  std::size_t column_;
  std::string remedy_;
};

// The root table. Throws TomlError.
Node parse_toml(std::string_view text);

}  // namespace flexspline::text
