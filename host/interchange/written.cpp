#include "host/interchange/written.hpp"

#include <fmt/format.h>

namespace flexspline::interchange {

Sheet*& sheet() {
  static thread_local Sheet* current = nullptr;
  return current;
}

std::string literal(double x) {
  std::string text = fmt::format("{}", x);
  // An integer would divide like one.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string Sheet::text(const Term& term) const {
  if (term.known()) return term.constant() < 0.0 ? "(" + literal(term.constant()) + ")" : literal(term.constant());
  const Line& line = lines_[static_cast<std::size_t>(term.line())];
  return line.is_input ? line.expression : fmt::format("t{}", term.line());
}

std::string Sheet::filled(const Line& line) const {
  std::string out;
  for (std::size_t k = 0; k < line.expression.size(); ++k) {
    const char c = line.expression[k];
    if (c == '%')
      out += text(line.operands[static_cast<std::size_t>(line.expression[++k] - '0')]);
    else
      out += c;
  }
  return out;
}

Term Sheet::input(std::string name) {
  lines_.push_back({std::move(name), {}, true});
  return Term::of_line(static_cast<int>(lines_.size()) - 1);
}

Term Sheet::line(const std::string& expression, const std::vector<Term>& operands) {
  Line line{expression, operands};
  const auto [at, is_new] = seen_.emplace(filled(line), static_cast<int>(lines_.size()));
  if (is_new) lines_.push_back(std::move(line));
  return Term::of_line(at->second);
}

std::string Sheet::array(const std::vector<double>& values) {
  arrays_.push_back(values);
  return fmt::format("@array{}", arrays_.size() - 1);
}

std::vector<bool> Sheet::needed(const std::vector<Term>& results) const {
  std::vector<bool> used(lines_.size(), false);
  for (const Term& r : results)
    if (!r.known()) used[static_cast<std::size_t>(r.line())] = true;
  for (std::size_t k = lines_.size(); k-- > 0;)
    if (used[k])
      for (const Term& operand : lines_[k].operands)
        if (!operand.known()) used[static_cast<std::size_t>(operand.line())] = true;
  return used;
}

std::string Sheet::statements(const std::vector<Term>& results) const {
  const std::vector<bool> used = needed(results);
  std::string out;
  for (std::size_t k = 0; k < lines_.size(); ++k)
    if (used[k] && !lines_[k].is_input) out += fmt::format("  const double t{} = {};\n", k, filled(lines_[k]));
  return out;
}

bool Sheet::calls(const std::string& function, const std::vector<Term>& results) const {
  const std::vector<bool> used = needed(results);
  for (std::size_t k = 0; k < lines_.size(); ++k)
    if (used[k] && lines_[k].expression.find(function + "(") != std::string::npos) return true;
  return false;
}

bool Sheet::uses(const Term& line, const std::vector<Term>& results) const {
  return !line.known() && needed(results)[static_cast<std::size_t>(line.line())];
}

namespace {
bool is(const Term& t, double x) {
  return t.known() && t.constant() == x;
}
}  // namespace

Term operator+(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() + b.constant();
  if (is(a, 0.0)) return b;
  if (is(b, 0.0)) return a;
  return sheet()->line("%0 + %1", {a, b});
}
Term operator-(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() - b.constant();
  if (is(b, 0.0)) return a;
  if (is(a, 0.0)) return -b;
  return sheet()->line("%0 - %1", {a, b});
}
Term operator*(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() * b.constant();
  if (is(a, 1.0)) return b;
  if (is(b, 1.0)) return a;
  // Nought times what is not finite is not nought, but no signal is that.
  if (is(a, 0.0) || is(b, 0.0)) return 0.0;
  return sheet()->line("%0 * %1", {a, b});
}
Term operator/(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() / b.constant();
  return sheet()->line("%0 / %1", {a, b});
}
Term operator-(const Term& a) {
  if (a.known()) return -a.constant();
  return sheet()->line("-%0", {a});
}

std::string Written::constants(const Term* values, int points) {
  std::vector<double> list;
  for (int k = 0; k < points; ++k) list.push_back(values[k].constant());
  return sheet()->array(list) + fmt::format(", {}", points);
}

}  // namespace flexspline::interchange
