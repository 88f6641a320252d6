#include "host/output/interchange/c_statements.hpp"

#include <fmt/format.h>

namespace flexspline::interchange {

CStatements*& c_statements() {
  static thread_local CStatements* current = nullptr;
  return current;
}

std::string literal(double x) {
  std::string text = fmt::format("{}", x);
  // An integer would divide like one.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string CStatements::text(const Term& term) const {
  if (term.known()) return term.constant() < 0.0 ? "(" + literal(term.constant()) + ")" : literal(term.constant());
  const Line& line = lines_[static_cast<std::size_t>(term.line())];
  return line.is_input ? line.expression : fmt::format("t{}", term.line());
}

std::string CStatements::filled(const Line& line) const {
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

Term CStatements::input(std::string name) {
  lines_.push_back({std::move(name), {}, true});
  return Term::of_line(static_cast<int>(lines_.size()) - 1);
}

Term CStatements::line(const std::string& expression, const std::vector<Term>& operands) {
  Line line{expression, operands};
  const auto [at, is_new] = seen_.emplace(filled(line), static_cast<int>(lines_.size()));
  if (is_new) lines_.push_back(std::move(line));
  return Term::of_line(at->second);
}

std::string CStatements::array(const std::vector<double>& values) {
  arrays_.push_back(values);
  return fmt::format("@array{}", arrays_.size() - 1);
}

std::vector<bool> CStatements::needed(const std::vector<Term>& results) const {
  std::vector<bool> used(lines_.size(), false);
  for (const Term& r : results)
    if (!r.known()) used[static_cast<std::size_t>(r.line())] = true;
  for (std::size_t k = lines_.size(); k-- > 0;)
    if (used[k])
      for (const Term& operand : lines_[k].operands)
        if (!operand.known()) used[static_cast<std::size_t>(operand.line())] = true;
  return used;
}

std::string CStatements::statements(const std::vector<Term>& results) const {
  const std::vector<bool> used = needed(results);
  std::string out;
  for (std::size_t k = 0; k < lines_.size(); ++k)
    if (used[k] && !lines_[k].is_input) out += fmt::format("  const double t{} = {};\n", k, filled(lines_[k]));
  return out;
}

bool CStatements::calls(const std::string& function, const std::vector<Term>& results) const {
  const std::vector<bool> used = needed(results);
  for (std::size_t k = 0; k < lines_.size(); ++k)
    if (used[k] && lines_[k].expression.find(function + "(") != std::string::npos) return true;
  return false;
}

bool CStatements::uses(const Term& line, const std::vector<Term>& results) const {
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
  return c_statements()->line("%0 + %1", {a, b});
}
Term operator-(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() - b.constant();
  if (is(b, 0.0)) return a;
  if (is(a, 0.0)) return -b;
  return c_statements()->line("%0 - %1", {a, b});
}
Term operator*(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() * b.constant();
  if (is(a, 1.0)) return b;
  if (is(b, 1.0)) return a;
  // Zero times what is not finite is not zero, but no signal is that.
  if (is(a, 0.0) || is(b, 0.0)) return 0.0;
  return c_statements()->line("%0 * %1", {a, b});
}
Term operator/(const Term& a, const Term& b) {
  if (a.known() && b.known()) return a.constant() / b.constant();
  return c_statements()->line("%0 / %1", {a, b});
}
Term operator-(const Term& a) {
  if (a.known()) return -a.constant();
  return c_statements()->line("-%0", {a});
}

std::string CNumbers::constants(const Term* values, int points) {
  std::vector<double> list;
  for (int k = 0; k < points; ++k) list.push_back(values[k].constant());
  return c_statements()->array(list) + fmt::format(", {}", points);
}

}  // namespace flexspline::interchange
