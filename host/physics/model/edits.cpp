#include "host/physics/model/edits.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexspline::model {
namespace {

constexpr std::string_view kBlank = " \t\r";

// Ends of everything in the text, headers too.
void collect_ends(const Node& node, std::vector<std::size_t>& ends) {
  if (node.kind != NodeKind::table || node.is_inline || node.has_header) ends.push_back(node.span.end);
  for (const Entry& entry : node.entries) collect_ends(entry.value, ends);
  for (const Node& item : node.items) collect_ends(item, ends);
}

struct Header {
  Span span;
  const Node* effect;
  bool is_history;
};

void collect_headers(const Node& node, const Node* effect, bool is_history, std::vector<Header>& headers) {
  if (node.has_header) headers.push_back({node.span, effect, is_history});
  for (const Entry& entry : node.entries) collect_headers(entry.value, effect, is_history, headers);
  for (const Node& item : node.items) collect_headers(item, effect, is_history, headers);
}

// The last byte of an entry that is in its table's own lines; 0 where it has headers of its own.
std::size_t own_end(const Node& node) {
  if (node.kind == NodeKind::array && !node.items.empty() && node.items.front().has_header) return 0;
  if (node.kind != NodeKind::table || node.is_inline) return node.span.end;
  if (node.has_header) return 0;
  std::size_t end = 0;
  for (const Entry& entry : node.entries) end = std::max(end, own_end(entry.value));
  return end;
}

}  // namespace

EditedDocument::EditedDocument(const std::string& text)
    : text_(text), root_(parse_document(text, "the model")), newline_("\n") {
  const std::size_t first = text.find('\n');
  if (first != std::string::npos && first > 0 && text[first - 1] == '\r') newline_ = "\r\n";
  find_sections();
}

std::size_t EditedDocument::line_begin(std::size_t position) const {
  // A byte order mark is no part of the first line.
  const std::size_t first = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  if (position <= first) return first;
  const std::size_t before = text_.rfind('\n', position - 1);
  return before == std::string::npos ? first : before + 1;
}

std::size_t EditedDocument::line_end(std::size_t position) const {
  const std::size_t end = text_.find('\n', position);
  return end == std::string::npos ? text_.size() : end + 1;
}

void EditedDocument::find_sections() {
  std::vector<Header> headers;
  std::vector<std::size_t> ends;
  collect_ends(root_, ends);
  for (const Entry& entry : root_.entries) {
    const bool is_effect = entry.key == "effect";
    if (entry.value.kind == NodeKind::array)
      for (const Node& item : entry.value.items)
        collect_headers(item, is_effect ? &item : nullptr, entry.key == "history", headers);
    else
      collect_headers(entry.value, nullptr, false, headers);
  }
  std::ranges::sort(headers, {}, [](const Header& header) { return header.span.begin; });
  std::ranges::sort(ends);

  const auto is_comment = [&](std::size_t line) {
    const std::size_t first = text_.find_first_not_of(kBlank, line);
    return first != std::string::npos && text_[first] == '#';
  };
  const auto is_empty = [&](std::size_t line) {
    const std::size_t first = text_.find_first_not_of(kBlank, line);
    return first == std::string::npos || text_[first] == '\n';
  };
  const auto content_end_before = [&](std::size_t position) {
    const auto after = std::ranges::lower_bound(ends, position);
    return after == ends.begin() ? std::size_t{0} : line_end(*std::prev(after));
  };
  for (const Header& header : headers) {
    Section section;
    section.effect = header.effect;
    section.is_history = header.is_history;
    section.header_end = line_end(header.span.end);
    section.cut_begin = line_begin(header.span.begin);
    // A line inside a text over several lines may look like a comment.
    const std::size_t content = content_end_before(header.span.begin);
    while (section.cut_begin > content && is_comment(line_begin(section.cut_begin - 1)))
      section.cut_begin = line_begin(section.cut_begin - 1);
    sections_.push_back(section);
  }
  for (std::size_t i = 0; i < sections_.size(); ++i) {
    Section& section = sections_[i];
    const bool is_last = i + 1 == sections_.size();
    const std::size_t limit = is_last ? text_.size() : sections_[i + 1].cut_begin;
    section.content_end = content_end_before(is_last ? text_.size() + 1 : headers[i + 1].span.begin);
    section.own_end = section.content_end;
    while (section.own_end < limit && is_comment(section.own_end)) section.own_end = line_end(section.own_end);
    section.cut_end = section.own_end;
    while (section.cut_end < limit && is_empty(section.cut_end)) section.cut_end = line_end(section.cut_end);
  }
}

std::vector<std::string> EditedDocument::effect_ids() const {
  std::vector<std::string> ids;
  if (const Node* effects = root_.find("effect")) {
    for (const Node& effect : effects->items) {
      const Node* id = effect.find("id");
      const Node* type = effect.find("type");
      ids.push_back(id ? id->text : type ? type->text : std::string());
    }
  }
  return ids;
}

const Node* EditedDocument::effect(std::string_view id) const {
  const std::vector<std::string> ids = effect_ids();
  const auto found = std::ranges::find(ids, id);
  return found == ids.end() ? nullptr : &root_.find("effect")->items[static_cast<std::size_t>(found - ids.begin())];
}

std::size_t EditedDocument::history_count() const {
  const Node* history = root_.find("history");
  return history ? history->items.size() : 0;
}

std::size_t EditedDocument::end_of_root() const {
  return sections_.empty() ? text_.size() : sections_.front().cut_begin;
}

std::size_t EditedDocument::end_of_effects() const {
  for (std::size_t i = sections_.size(); i-- > 0;)
    if (sections_[i].effect) return sections_[i].own_end;
  for (const Section& section : sections_)
    if (section.is_history) return section.cut_begin;
  return text_.size();
}

std::size_t EditedDocument::end_of_effect(const Node& effect) const {
  for (std::size_t i = sections_.size(); i-- > 0;)
    if (sections_[i].effect == &effect) return sections_[i].own_end;
  return text_.size();
}

std::size_t EditedDocument::end_of_history() const {
  for (std::size_t i = sections_.size(); i-- > 0;)
    if (sections_[i].is_history) return sections_[i].own_end;
  return text_.size();
}

void Edits::replace(Span span, std::string text) {
  edits_.push_back({span, std::move(text)});
}

void Edits::cut_effect(std::string_view id) {
  const Node* effect = document_.effect(id);
  const std::string& text = document_.text();
  const std::vector<Section>& sections = document_.sections();
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (sections[i].effect != effect) continue;
    std::size_t begin = sections[i].cut_begin;
    std::size_t end = sections[i].cut_end;
    if (i + 1 < sections.size() && sections[i + 1].effect == effect) end = sections[i + 1].cut_begin;
    // Nothing follows: the empty lines above have nothing left to set apart.
    if (end == text.size()) {
      const std::size_t last = begin == 0 ? std::string::npos : text.find_last_not_of(" \t\r\n", begin - 1);
      if (last != std::string::npos) begin = std::min(begin, document_.line_end(last));
    }
    edits_.push_back({{begin, end}, {}});
  }
}

void Edits::remove_entry(const Node& table, std::string_view key) {
  const auto at = std::ranges::find(table.entries, key, &Entry::key);
  if (table.is_inline) {
    Span span{at->key_span.begin, at->value.span.end};
    if (at != table.entries.begin())
      span.begin = std::prev(at)->value.span.end;
    else if (std::next(at) != table.entries.end())
      span.end = std::next(at)->key_span.begin;
    edits_.push_back({span, {}});
    return;
  }
  edits_.push_back({{document_.line_begin(at->key_span.begin), document_.line_end(at->value.span.end)}, {}});
}

void Edits::insert_entry(const Node& table, std::string_view key, std::string_view text,
                         std::span<const std::string_view> order) {
  // The last entry that the key is to follow, among those in the table's own lines.
  const auto rank = [&](std::string_view name) { return std::ranges::find(order, name) - order.begin(); };
  const Entry* before = nullptr;
  const Entry* first = nullptr;
  for (const Entry& entry : table.entries) {
    if (own_end(entry.value) == 0) continue;
    if (!first) first = &entry;
    if (rank(entry.key) <= rank(key)) before = &entry;
  }
  const std::string line = fmt::format("{} = {}", key, text);
  if (table.is_inline) {
    if (before)
      edits_.push_back({{before->value.span.end, before->value.span.end}, ", " + line});
    else if (first)
      edits_.push_back({{first->key_span.begin, first->key_span.begin}, line + ", "});
    else
      edits_.push_back({table.span, "{ " + line + " }"});
    return;
  }
  // Behind the header where it is the first key, so that a comment above the next one stays above that.
  const Entry* neighbour = before || table.has_header ? before : first;
  if (neighbour) {
    // What is left of the neighbour's key: indentation, or the first parts of a dotted key.
    const std::size_t begin = document_.line_begin(neighbour->key_span.begin);
    const std::string_view prefix = document_.text({begin, neighbour->key_span.begin});
    insert_line(document_.line_end(own_end(neighbour->value)), std::string(prefix) + line);
    return;
  }
  const std::size_t begin = document_.line_begin(table.span.begin);
  const std::string_view indentation = document_.text({begin, table.span.begin});
  insert_line(document_.line_end(table.span.end), std::string(indentation) + line);
}

void Edits::insert_parameter(const Node& effect, std::string_view key, std::string_view text,
                             std::span<const std::string_view> order) {
  const Node* parameters = effect.find("parameters");
  if (parameters && (parameters->is_inline || parameters->has_header || own_end(*parameters) != 0)) {
    insert_entry(*parameters, key, text, order);
    return;
  }
  // No table yet, or only sub-tables of it: behind the effect's own lines, before any header below it.
  std::size_t end = effect.span.end;
  for (const Entry& entry : effect.entries) end = std::max(end, own_end(entry.value));
  insert_line(document_.line_end(end), fmt::format("[effect.parameters]{}{} = {}", document_.newline(), key, text));
}

void Edits::insert_line(std::size_t position, std::string_view line) {
  const std::string& text = document_.text();
  const bool on_a_line = position > 0 && text[position - 1] != '\n';  // the last line, without a newline
  edits_.push_back(
      {{position, position},
       fmt::format("{}{}{}", on_a_line ? document_.newline() : "", line, on_a_line ? "" : document_.newline())});
}

void Edits::insert_blocks(std::size_t position, std::string blocks) {
  const std::string& text = document_.text();
  const std::string newline(document_.newline());
  std::string before;
  if (position > 0 && text[position - 1] != '\n') before = newline;
  const std::size_t last_line = position == 0 ? 0 : document_.line_begin(position - 1);
  const bool is_separate = position == 0 || text.find_first_not_of(kBlank, last_line) == text.find('\n', last_line);
  if (!is_separate) before += newline;
  // An empty line ends the blocks; where one follows anyway, or nothing, it is one too many.
  const std::size_t next = text.find_first_not_of(kBlank, position);
  if (next == std::string::npos || text[next] == '\n') blocks.resize(blocks.size() - newline.size());
  edits_.push_back({{position, position}, before + blocks});
}

std::string Edits::apply() {
  std::ranges::stable_sort(edits_, {}, [](const Edit& edit) { return edit.span.begin; });
  const std::string& text = document_.text();
  std::string result;
  std::size_t done = 0;
  for (const Edit& edit : edits_) {
    if (edit.span.begin < done) continue;
    result.append(text, done, edit.span.begin - done);
    result += edit.text;
    done = edit.span.end;
  }
  result.append(text, done);
  return result;
}

}  // namespace flexspline::model
