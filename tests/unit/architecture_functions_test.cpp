// No function is longer than a page: one does what its name says, and a part of it that has a name is a function.
#include <gtest/gtest.h>

#include "tests/unit/architecture_source.hpp"

namespace flexspline::architecture_functions_test {
namespace {

constexpr long kMostLines = 60;

struct Function {
  long line = 0;
  long lines = 0;
};

// Lines of the preprocessor blanked.
std::string without_preprocessor(std::string code) {
  bool blanks = false;
  for (std::size_t start = 0; start < code.size();) {
    const std::size_t end = std::min(code.find('\n', start), code.size());
    const std::size_t first = code.find_first_not_of(" \t", start);
    blanks = blanks || (first < end && code[first] == '#');
    const bool goes_on = end > start && code[end - 1] == '\\';
    if (blanks) std::fill(code.begin() + static_cast<long>(start), code.begin() + static_cast<long>(end), ' ');
    blanks = blanks && goes_on;
    start = end + 1;
  }
  return code;
}

bool has_word(std::string_view text, std::string_view word) {
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string_view::npos; at += word.size()) {
    const bool begins = at == 0 || !architecture::is_word(text[at - 1]);
    const bool ends = at + word.size() == text.size() || !architecture::is_word(text[at + word.size()]);
    if (begins && ends) return true;
  }
  return false;
}

// Whether a brace behind this text opens the body of a function: it has parameters, and they come after the last word
// that begins a type or a scope.
bool opens_function(std::string_view head) {
  const std::size_t parenthesis = head.find('(');
  if (parenthesis == std::string_view::npos || head.find_last_not_of(" \n\t") == std::string_view::npos) return false;
  const std::string_view tail = head.substr(0, head.find_last_not_of(" \n\t") + 1);
  if (tail.ends_with('=')) return false;
  for (const std::string_view word : {"namespace", "enum"})
    if (has_word(head.substr(0, parenthesis), word)) return false;
  return true;
}

// Functions of a file's code, by their braces; lambdas and local classes are part of theirs.
class FunctionFinder {
 public:
  explicit FunctionFinder(std::string_view text) : code_(without_preprocessor(architecture::code_only(text))) {}

  std::vector<Function> find() {
    for (const char c : code_) {
      if (c == '\n') ++line_;
      if (c == '(') ++parentheses_;
      if (c == ')') --parentheses_;
      if (c == '{')
        open();
      else if (c == '}')
        close();
      else if (c == ';' && parentheses_ == 0)
        begin_head();
      else
        extend_head(c);
    }
    return found_;
  }

 private:
  struct Block {
    bool is_function;
    long line;
    int parentheses;
  };

  void begin_head() {
    head_.clear();
    after_initialiser_ = 0;
  }

  void extend_head(char c) {
    const bool is_blank = c == ' ' || c == '\n' || c == '\t';
    if (head_.empty() && is_blank) return;
    if (head_.empty()) head_line_ = line_;
    head_ += c;
  }

  void open() {
    const bool inside = std::any_of(blocks_.begin(), blocks_.end(), [](const Block& b) { return b.is_function; });
    // What stood before was the initialiser of a member, in braces.
    const bool goes_on = after_initialiser_ != 0 && (head_.empty() || head_.front() == ',');
    const bool is_function = !inside && parentheses_ == 0 && (goes_on || opens_function(head_));
    blocks_.push_back({is_function, goes_on ? after_initialiser_ : head_line_, parentheses_});
    begin_head();
    parentheses_ = 0;
  }

  void close() {
    begin_head();
    if (blocks_.empty()) return;
    const Block block = blocks_.back();
    blocks_.pop_back();
    parentheses_ = block.parentheses;
    if (!block.is_function) return;
    found_.push_back({block.line, line_ - block.line + 1});
    after_initialiser_ = block.line;
  }

  const std::string code_;
  std::vector<Function> found_;
  std::vector<Block> blocks_;
  std::string head_;
  long line_ = 1, head_line_ = 1;
  long after_initialiser_ = 0;
  int parentheses_ = 0;
};

std::vector<Function> functions_of(std::string_view text) {
  return FunctionFinder(text).find();
}

// "path:line: a function of N lines".
std::string too_long(const std::vector<architecture::SourceFile>& files) {
  std::string all;
  for (const architecture::SourceFile& file : files) {
    if (file.path.starts_with("tests/") || !(file.path.ends_with(".cpp") || file.path.ends_with(".hpp"))) continue;
    for (const Function& f : functions_of(file.text))
      if (f.lines > kMostLines)
        all += "\n  " + file.path + ":" + std::to_string(f.line) + ": a function of " + std::to_string(f.lines) +
               " lines; cut it along what it does";
  }
  return all;
}

std::string body(long lines) {
  std::string text = "{\n";
  for (long k = 2; k < lines; ++k) text += "  step();\n";
  return text + "}\n";
}

TEST(ArchitectureFunctions, AreAtMostAPageLong) {
  EXPECT_EQ(too_long(architecture::project_files()), "");
}

TEST(ArchitectureFunctions, ALongOneIsFoundWithItsLine) {
  EXPECT_EQ(too_long({{"host/a.cpp", "int a;\nvoid f(int x) " + body(kMostLines + 1)}}),
            "\n  host/a.cpp:2: a function of 61 lines; cut it along what it does");
  EXPECT_EQ(too_long({{"host/a.cpp", "void f(int x) " + body(kMostLines)}}), "");
}

TEST(ArchitectureFunctions, AreFoundInClassesNamespacesAndBehindInitialisers) {
  const std::string in_class = "namespace a {\nclass B : C {\n void f() const noexcept " + body(70) + "};\n}\n";
  EXPECT_EQ(functions_of(in_class).size(), 1u);
  EXPECT_EQ(functions_of(in_class).front().lines, 70);
  const auto behind = functions_of("A::A(int x)\n    : b_{x}, c_{x} " + body(70));
  EXPECT_EQ(behind.back().lines, 71);
  EXPECT_EQ(functions_of("template <class T>\nauto g(T x) -> int " + body(5)).front().lines, 6);
}

TEST(ArchitectureFunctions, TablesClassesAndTextsAreNone) {
  EXPECT_TRUE(functions_of("constexpr int kTable[] = " + body(70)).empty());
  EXPECT_TRUE(functions_of("constexpr auto kTable = std::to_array<Entry>({{1, 2},\n{3, 4}});\n").empty());
  EXPECT_TRUE(functions_of("struct A {\n  int b = 0;\n};\nenum class C { d };\n").empty());
  EXPECT_TRUE(functions_of("const char* a = \"void f() {\";\n// void g() {\n").empty());
}

TEST(ArchitectureFunctions, LambdasArePartOfTheirs) {
  const auto found = functions_of("void f() {\n  const auto g = [&](int x) {\n    return x;\n  };\n}\n");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().lines, 5);
}

}  // namespace
}  // namespace flexspline::architecture_functions_test
