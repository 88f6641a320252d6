// How a command declares its options. CLI11 is behind it, in command_line.cpp alone.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace flexspline::cli {

// One option, to be described further. Each member returns the option itself.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option& required();
  // The placeholder of its value in --help: "FILE"; "" where the choices are listed.
  Option& value(std::string_view placeholder);
  // Its present value is shown as the default.
  Option& shows_default();
  Option& comma_separated();
  // One value each time the option is given; else it takes all up to the next option.
  Option& one_value_each_time();
  Option& number_of_values(int count);

  Option& positive();
  Option& not_negative();
  Option& existing_file();
  Option& within(int low, int high);
  Option& within(double low, double high);
  Option& one_of(const std::vector<std::string>& choices);
  Option& one_of_numbers(const std::vector<int>& choices);

  Option& excludes(const Option& other);
  Option& needs(const Option& other);

 private:
  CLI::Option* option_;
};

class Parser {
 public:
  explicit Parser(CLI::App& parser) : parser_(parser) {}

  // `name` without dashes: an argument by its place. `value` is written when the line is parsed. Of texts, paths,
  // numbers, and std::optional and std::vector of them; command_line.cpp lists the types.
  template <class Value>
  Option option(const char* name, Value& value, const std::string& help);
  Option flag(const char* name, bool& value, const std::string& help);

 private:
  CLI::App& parser_;
};

}  // namespace flexspline::cli
