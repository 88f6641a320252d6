#include "tests/soak/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "host/physics/catalogue/catalogue.hpp"
#include "tests/soak/campaign.hpp"
#include "tests/support/campaign_statistics.hpp"

namespace flexspline::soak {
namespace {

// Sets with nothing hidden that may get a name: one in this many; the limit is set for a third of that.
constexpr double kFalseAlarmTarget = 1.0 / 300.0;
constexpr double kCalibratedFor = 1.0 / 1000.0;

using tests::exact_interval;
using tests::Interval;
using tests::threshold_from;
using Selection = std::vector<const Outcome*>;

Selection select(const std::vector<Outcome>& all, const std::function<bool(const Outcome&)>& which) {
  Selection some;
  for (const Outcome& o : all)
    if (which(o)) some.push_back(&o);
  return some;
}

std::size_t count_right(const Selection& some) {
  return static_cast<std::size_t>(std::count_if(some.begin(), some.end(), [](const Outcome* o) { return o->right; }));
}

std::string share(std::size_t count, std::size_t total) {
  if (total == 0) return "-";
  const Interval i = exact_interval(count, total);
  return fmt::format("{} of {} ({:.1f} %; {:.1f} to {:.1f})", count, total,
                     100.0 * static_cast<double>(count) / static_cast<double>(total), 100.0 * i.low, 100.0 * i.high);
}

bool single(const Outcome& o) {
  return !o.what.hidden.empty() && o.what.hidden.find('+') == std::string::npos;
}

// Of an effect of the catalogue; the plant knows others.
bool listed(const Outcome& o) {
  return catalogue::find(o.what.hidden.substr(0, o.what.hidden.find_first_of(":+"))) != nullptr;
}

double quantile(std::vector<double> x, double at) {
  if (x.empty()) return 0.0;
  std::sort(x.begin(), x.end());
  return x[static_cast<std::size_t>(at * static_cast<double>(x.size() - 1))];
}

std::string false_alarms(const std::vector<Outcome>& all) {
  std::string text =
      "## Nothing hidden\n\n| friction from run to run | noise | false names | largest score |\n| --- | --- | --- | "
      "--- |\n";
  const auto row = [&](const std::string& friction, const std::string& noise, const Selection& some) {
    double largest = -1e9;
    for (const Outcome* o : some) largest = std::max(largest, o->best_score);
    if (!some.empty())
      text += fmt::format("| {} | {} | {} | {:.1f} |\n", friction, noise,
                          share(some.size() - count_right(some), some.size()), largest);
  };
  for (const double variation : {0.0, 0.03})
    for (const double correlation : {0.0, 0.9})
      row(variation > 0.0 ? "3 %" : "none", correlation > 0.0 ? "coloured (AR(1) of 0.9)" : "white",
          select(all, [&](const Outcome& o) {
            return o.what.hidden.empty() && o.what.friction_variation == variation &&
                   o.what.noise_correlation == correlation;
          }));
  row("all", "all", select(all, [](const Outcome& o) { return o.what.hidden.empty(); }));
  return text + "\nIn brackets: share, and its exact (Clopper and Pearson) 95 % interval.\n\n";
}

std::string power(const std::vector<Outcome>& all) {
  std::string text =
      "## One effect hidden\n\nBy the RMS of the effect's torque orthogonal to the rest of the model, over that of the "
      "noise.\n\n| missing over noise | named right, friction constant | named right, friction 3 % from run to run "
      "| in a group that cannot be distinguished | a wrong name |\n| --- | --- | --- | --- | --- |\n";
  constexpr double kEdges[] = {0.0, 0.025, 0.05, 0.1, 0.25, 1.0, 1e9};
  for (std::size_t k = std::size(kEdges) - 1; k-- > 0;) {
    const auto in = [&](const Outcome& o) {
      return single(o) && listed(o) && o.missing_over_noise >= kEdges[k] && o.missing_over_noise < kEdges[k + 1];
    };
    const Selection constant = select(all, [&](const Outcome& o) { return in(o) && o.what.friction_variation == 0.0; });
    const Selection varies = select(all, [&](const Outcome& o) { return in(o) && o.what.friction_variation > 0.0; });
    const Selection both = select(all, in);
    const auto wrong = static_cast<std::size_t>(
        std::count_if(both.begin(), both.end(), [](const Outcome* o) { return !o->found_all && o->named != "-"; }));
    if (both.empty()) continue;
    const auto grouped = static_cast<std::size_t>(
        std::count_if(both.begin(), both.end(), [](const Outcome* o) { return !o->right && o->found_all; }));
    text += fmt::format("| {} | {} | {} | {} | {} |\n",
                        kEdges[k + 1] > 1e8 ? fmt::format("{:g} and more", kEdges[k])
                                            : fmt::format("{:g} to {:g}", kEdges[k], kEdges[k + 1]),
                        share(count_right(constant), constant.size()), share(count_right(varies), varies.size()),
                        share(grouped, both.size()), share(wrong, both.size()));
  }
  const Selection one_name = select(all, [](const Outcome& o) {
    return single(o) && listed(o) && o.named != "-" && o.named.find('+') == std::string::npos;
  });
  return text +
         fmt::format("\nRight when one effect was named: {}.\n\n", share(count_right(one_name), one_name.size()));
}

// The answers for drives of one effect and size: how many were named right, then wrong names and verdicts, after their
// number if above one.
std::string named(const Selection& some) {
  std::map<std::string, std::size_t> names;
  for (const Outcome* o : some)
    if (!o->right)
      ++names[o->named != "-"                     ? o->named
              : o->verdict == "at_noise_floor"    ? "nothing"
              : o->verdict == "unknown_structure" ? "unknown"
                                                  : o->verdict];
  const std::size_t right = count_right(some);
  std::string list = right > 0 ? fmt::format("{} right", right) : "";
  for (const auto& [name, count] : names)
    list += fmt::format("{}{}{}", list.empty() ? "" : ", ", count > 1 ? fmt::format("{} ", count) : "", name);
  return list;
}

// Effects that were named right on all drives: by the smallest size tried, their names with the number of drives.
std::string always_right(const std::map<std::string, Selection>& by_effect) {
  std::map<double, std::string, std::greater<>> by_smallest;
  for (const auto& [hidden, some] : by_effect) {
    if (count_right(some) != some.size()) continue;
    double smallest = kScales[0];
    for (const Outcome* o : some) smallest = std::min(smallest, o->what.scale);
    std::string& list = by_smallest[smallest];
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", hidden, some.size());
  }
  std::string text;
  for (const auto& [smallest, list] : by_smallest)
    text += fmt::format("Right on all drives, {}: {}.\n\n",
                        smallest < kScales[0] ? fmt::format("from {:g} to {:g}", kScales[0], smallest)
                                              : fmt::format("tried at {:g} only", smallest),
                        list);
  return text;
}

std::string confusion(const std::vector<Outcome>& all) {
  std::map<std::string, Selection> by_effect;
  for (const Outcome& o : all)
    if (!o.what.hidden.empty()) by_effect[o.what.hidden].push_back(&o);
  std::string text =
      "## What was named\n\nBy size over the usual one, with the number of drives; "
      "*nothing*: the error was taken for noise.\n\n" +
      always_right(by_effect) + "Others, at the sizes at which not all drives were named right:\n\n";
  for (const auto& [hidden, some] : by_effect) {
    if (count_right(some) == some.size()) continue;
    std::string sizes;
    for (const double scale : kScales) {
      Selection of_size;
      std::copy_if(some.begin(), some.end(), std::back_inserter(of_size),
                   [&](const Outcome* o) { return o->what.scale == scale; });
      if (count_right(of_size) < of_size.size())
        sizes += fmt::format("{}{:g}: {}", sizes.empty() ? "" : "; ", scale, named(of_size));
    }
    text += fmt::format("- {}, {}\n", hidden, sizes);
  }
  return text + "\n";
}

std::string after_adding(const std::vector<Outcome>& all) {
  std::string text =
      "## After adding the true effect\n\n| friction from run to run | hold-out error over the floor: median, 95 % of "
      "drives | "
      "error of parameters | of nonlinear parameters | intervals of 95 % that hold the truth |\n| --- | --- | --- | "
      "--- | --- |\n";
  for (const double variation : {0.0, 0.03}) {
    std::vector<double> holdout, linear, nonlinear;
    std::size_t covered = 0, intervals = 0;
    for (const Outcome* o : select(all, [&](const Outcome& c) {
           return single(c) && listed(c) && c.right && c.what.friction_variation == variation;
         })) {
      if (o->holdout_over_floor) holdout.push_back(*o->holdout_over_floor);
      for (const Recovered& r : o->recovered) {
        if (o->missing_over_noise >= 0.25) (r.nonlinear ? nonlinear : linear).push_back(std::abs(r.error));
        covered += r.covered ? 1 : 0;
        ++intervals;
      }
    }
    text += fmt::format("| {} | {:.3f}, {:.3f} | {:.2f} %, {:.2f} % | {:.2f} %, {:.2f} % | {} |\n",
                        variation > 0.0 ? "3 %" : "none", quantile(holdout, 0.5), quantile(holdout, 0.95),
                        100.0 * quantile(linear, 0.5), 100.0 * quantile(linear, 0.95), 100.0 * quantile(nonlinear, 0.5),
                        100.0 * quantile(nonlinear, 0.95), share(covered, intervals));
  }
  return text +
         "\nOf drives that were named right; errors where the effect is a quarter of the noise or more. Weights of a "
         "Prandtl-Ishlinskii operator are not compared, as its points depend on the data. The floor is the residual "
         "of the true model with nominal parameters: where friction differs between runs it contains those "
         "deviations.\n\n";
}

std::string others(const std::vector<Outcome>& all) {
  const Selection pairs = select(all, [](const Outcome& o) { return o.what.hidden.find('+') != std::string::npos; });
  const Selection unknown = select(all, [](const Outcome& o) { return !o.what.hidden.empty() && !listed(o); });
  return fmt::format(
      "## Two effects hidden\n\nBoth found, and nothing else, by adding what is named until nothing is: {}.\n\n"
      "## An effect that is in no catalogue\n\nFlagged as unknown or as leaving structure: {}.\n\n",
      share(count_right(pairs), pairs.size()), share(count_right(unknown), unknown.size()));
}

}  // namespace

std::string page_of(const std::vector<Outcome>& all, const std::string& version) {
  std::uint64_t low = ~0ULL, high = 0;
  double seconds = 0.0;
  for (const Outcome& o : all) {
    low = std::min(low, o.what.seed);
    high = std::max(high, o.what.seed);
    seconds += o.seconds;
  }
  std::string text = fmt::format(
      "# Campaign: what the diagnosis names\n\nWritten by `./dev soak MINUTES diagnose`, not by hand; version {}: {} "
      "simulated drives, seeds {} to {} (test seeds start at {}; those that set the limits end at {}), {:.1f} s for "
      "each diagnosis.\n\n",
      version, all.size(), low, high, kFirstTestSeed, kLastTuningSeed,
      all.empty() ? 0.0 : seconds / static_cast<double>(all.size()));
  return text + false_alarms(all) + power(all) + after_adding(all) + others(all) + confusion(all) +
         fmt::format(
             "Targets: false names in at most {:.2f} % of the sets with nothing hidden; named right 100 % from a "
             "quarter "
             "of the noise on and 95 % from a tenth; right when named 99 %; hold-out within 1.05 of the floor; "
             "parameters within 2 %, nonlinear ones within 5 %; intervals that hold the truth in 90 to 98 %; both of "
             "two "
             "effects in 97 %; 90 % of unknown ones flagged.\n",
             100.0 * kFalseAlarmTarget);
}

std::string threshold_header(const std::vector<Outcome>& all, const std::string& version) {
  std::vector<double> scores;
  std::map<std::string, std::vector<double>> by_kind;
  std::uint64_t low = ~0ULL, high = 0;
  for (const Outcome& o : all) {
    if (!o.what.hidden.empty()) continue;
    scores.push_back(o.best_score);
    by_kind[fmt::format("friction {:g} %, noise correlation {:g}", 100.0 * o.what.friction_variation,
                        o.what.noise_correlation)]
        .push_back(o.best_score);
    low = std::min(low, o.what.seed);
    high = std::max(high, o.what.seed);
  }
  std::string kinds;
  for (const auto& [kind, some] : by_kind)
    kinds += fmt::format("//   {}: {} sets, largest score {:.1f}\n", kind, some.size(), quantile(some, 1.0));
  return fmt::format(
      "// Made by `./dev soak MINUTES calibrate`; not written by hand. The score of sets with nothing hidden: the best "
      "of all\n// candidates that are admissible.\n#pragma once\n\nnamespace "
      "flexspline::selection {{\n\n// From {} sets of the demo's drive and its experiments, seeds {} to {}, version "
      "{}:\n{}"
      "// Quantiles of the score: 50 % {:.1f}, 90 % {:.1f}, 99 % {:.1f}. One set in {:.0f} passes the limit, by an "
      "exponential\n// tail above the 90 % quantile whose scale is taken at its upper 95 % bound.\ninline constexpr "
      "double "
      "kNamedScore = {:.1f};\n\n}}  // namespace flexspline::selection\n",
      scores.size(), low, high, version, kinds, quantile(scores, 0.5), quantile(scores, 0.9), quantile(scores, 0.99),
      1.0 / kCalibratedFor, threshold_from(scores, kCalibratedFor));
}

}  // namespace flexspline::soak
