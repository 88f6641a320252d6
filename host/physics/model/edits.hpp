// A model file as text with the places where something may be changed, and the changes.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/physics/model/document.hpp"

namespace flexspline::model {

// A header with the lines that follow it, up to the next one.
struct Section {
  std::size_t cut_begin = 0;     // where the comments directly above it begin
  std::size_t header_end = 0;    // behind the line of the header
  std::size_t content_end = 0;   // behind the line of its last value
  std::size_t own_end = 0;       // behind the comments that follow without an empty line between
  std::size_t cut_end = 0;       // behind the empty lines after that
  const Node* effect = nullptr;  // to which it belongs
  bool is_history = false;
};

// Positions are those of the text that it was made from, and stay valid as long as both.
class EditedDocument {
 public:
  explicit EditedDocument(const std::string& text);
  EditedDocument(const EditedDocument&) = delete;
  EditedDocument& operator=(const EditedDocument&) = delete;

  const std::string& text() const { return text_; }
  std::string_view text(Span span) const { return std::string_view(text_).substr(span.begin, span.end - span.begin); }
  std::string_view newline() const { return newline_; }
  const Node& root() const { return root_; }
  const std::vector<Section>& sections() const { return sections_; }

  std::vector<std::string> effect_ids() const;
  const Node* effect(std::string_view id) const;  // nullptr: not there
  std::size_t history_count() const;

  // Where a table is inserted that is to follow those of its kind.
  std::size_t end_of_root() const;
  std::size_t end_of_effects() const;
  std::size_t end_of_history() const;
  std::size_t end_of_effect(const Node& effect) const;  // of one

  std::size_t line_begin(std::size_t position) const;
  std::size_t line_end(std::size_t position) const;  // behind its newline

 private:
  void find_sections();

  const std::string& text_;
  Node root_;
  std::string_view newline_;
  std::vector<Section> sections_;
};

// Collected changes. Of two that touch the same bytes the later one is left out, for the next round to make.
class Edits {
 public:
  explicit Edits(const EditedDocument& document) : document_(document) {}

  bool empty() const { return edits_.empty(); }
  void replace(Span span, std::string text);
  void cut_effect(std::string_view id);
  void remove_entry(const Node& table, std::string_view key);
  // After the keys that come before it in `order`, or after all where it is not in it; the order of the others stays.
  void insert_entry(const Node& table, std::string_view key, std::string_view text,
                    std::span<const std::string_view> order);
  // The same below [effect.parameters], which is made where it is not there.
  void insert_parameter(const Node& effect, std::string_view key, std::string_view text,
                        std::span<const std::string_view> order);
  // Whole tables, each ended by an empty line, at one of the ends of the document.
  void insert_blocks(std::size_t position, std::string blocks);

  std::string apply();

 private:
  struct Edit {
    Span span;
    std::string text;
  };

  void insert_line(std::size_t position, std::string_view line);

  const EditedDocument& document_;
  std::vector<Edit> edits_;
};

}  // namespace flexspline::model
