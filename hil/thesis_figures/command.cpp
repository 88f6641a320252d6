#include "hil/thesis_figures/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <stdexcept>
#include <vector>

#include "hil/thesis_figures/figures.hpp"

namespace flexspline::thesis_figures {
namespace {

// A cell of a Markdown table.
std::string cell(std::string text) {
  std::replace(text.begin(), text.end(), '|', '/');
  return text;
}

const Figure& find(int number) {
  for (const Figure& f : figures())
    if (f.number == number) return f;
  throw std::invalid_argument(fmt::format("the report has no figure {}; it has 1 to {}", number, figures().size()));
}

// `firsts`: what a figure measures, with the first figure that does.
std::string made(const Figure& figure, const ReportOptions& options, std::map<std::string, int>& firsts) {
  const std::string name = fmt::format("figure-{:02}", figure.number);
  const std::filesystem::path folder = options.out;
  const Drawn drawn = figure.make(options.seed);
  write(folder / (name + ".svg"), svg(fmt::format("Figure {}: {}", figure.number, figure.title), drawn.panels));
  write(folder / (name + ".csv"), csv(drawn.panels));
  // The row has the title already.
  std::string ours = drawn.ours;
  if (ours.starts_with(figure.title + ": ")) ours.erase(0, figure.title.size() + 2);
  const int first = firsts.emplace(ours, figure.number).first->second;
  if (first != figure.number) ours = fmt::format("as figure {}", first);
  return fmt::format("| {} | [{}]({}.svg) | {} | {} |\n", figure.number, cell(figure.title), name, cell(figure.theirs),
                     cell(ours));
}

void write_all(const std::vector<const Figure*>& wanted, const ReportOptions& options) {
  std::filesystem::create_directories(options.out);
  std::string rows, rest;
  std::map<std::string, int> firsts;
  for (const Figure* figure : wanted) {
    if (figure->make)
      rows += made(*figure, options, firsts);
    else
      rest += fmt::format("{}{}", rest.empty() ? "" : ", ", figure->number);
  }
  std::string text = "| figure | what | the report says | ours |\n| --- | --- | --- | --- |\n" + rows;
  if (!rest.empty()) text += "\nNot made (`flexspline-hil report list` says why): " + rest + ".\n";
  write(std::filesystem::path(options.out) / "figures.md", text);
  fmt::print("{}\n", (std::filesystem::path(options.out) / "figures.md").string());
}

}  // namespace

void write_report(const ReportOptions& options) {
  if (options.what == "list") {
    for (const Figure& f : figures())
      fmt::print("{:>3}  {}{}\n", f.number, f.title, f.make ? "" : " (not made: " + f.why_not + ")");
    return;
  }
  std::vector<const Figure*> wanted;
  if (options.what == "all") {
    for (const Figure& f : figures()) wanted.push_back(&f);
  } else {
    int number = 0;
    const char* end = options.what.data() + options.what.size();
    const auto read = std::from_chars(options.what.data(), end, number);
    if (read.ec != std::errc{} || read.ptr != end)
      throw std::invalid_argument(options.what + ": give the number of a figure, all or list (tables: ./dev report)");
    const Figure& figure = find(number);
    if (!figure.make) throw std::invalid_argument(fmt::format("figure {} is not made: {}", number, figure.why_not));
    wanted.push_back(&figure);
  }
  if (options.out.empty()) throw std::invalid_argument("--out FOLDER is missing: where to write");
  write_all(wanted, options);
}

void write_models(const ReportOptions& options) {
  const std::map<std::string, std::vector<int>> groups{{"motor", {4, 6}},
                                                       {"saturation", {5}},
                                                       {"friction", {7, 8, 9, 10, 11, 19, 20}},
                                                       {"models", {12, 14, 15}},
                                                       {"all", {4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 15, 19, 20}}};
  const auto group = groups.find(options.what);
  if (group == groups.end())
    throw std::invalid_argument(options.what +
                                ": no such block; known are motor, saturation, friction, models and all");
  std::vector<const Figure*> wanted;
  for (const int number : group->second) wanted.push_back(&find(number));
  write_all(wanted, options);
}

}  // namespace flexspline::thesis_figures
