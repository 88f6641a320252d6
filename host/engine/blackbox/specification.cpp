#include "host/engine/blackbox/specification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace flexspline::blackbox {
namespace {

constexpr int kHighestOrder = 200;
constexpr int kLongestDelay = 100;
constexpr double kAsGood = 1.02;
constexpr std::size_t kMostFolds = 5;
constexpr std::size_t kParts = 3;  // of a single record

[[noreturn]] void refuse(std::string_view text, std::string_view why) {
  throw std::invalid_argument(fmt::format(
      "{} is not a black box: {}; write fir:N, arx:NA,NB,NK, fir:auto or arx:auto, as in fir:20 or arx:4,4,1", text,
      why));
}

std::vector<int> numbers_of(std::string_view text, std::string_view list) {
  std::vector<int> numbers;
  for (;;) {
    const std::size_t comma = list.find(',');
    const std::string_view word = list.substr(0, comma);
    int number = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (word.empty() || error != std::errc{} || stop != word.data() + word.size())
      refuse(text, word.empty() ? "an order is missing" : fmt::format("\"{}\" is not a whole number", word));
    numbers.push_back(number);
    if (comma == std::string_view::npos) return numbers;
    list.remove_prefix(comma + 1);
  }
}

std::vector<Orders> candidates(Family family) {
  std::vector<Orders> all;
  if (family == Family::fir) {
    for (const int n : {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128}) all.push_back({0, n, 1, true});
  } else {
    for (int n = 1; n <= 10; ++n)
      for (const int nk : {1, 2, 3}) all.push_back({n, n, nk, true});
  }
  return all;
}

// Folds of the cross-validation: experiments in turn, or thirds of a single one.
std::vector<std::vector<Record>> folds_of(const std::vector<Record>& records) {
  std::set<std::size_t> experiments;
  for (const Record& r : records) experiments.insert(r.experiment);
  std::vector<std::vector<Record>> folds;
  if (experiments.size() > 1) {
    folds.resize(std::min(kMostFolds, experiments.size()));
    for (const Record& r : records) {
      const auto place = std::distance(experiments.begin(), experiments.find(r.experiment));
      folds[static_cast<std::size_t>(place) % folds.size()].push_back(r);
    }
    return folds;
  }
  folds.resize(kParts);
  for (const Record& r : records)
    for (std::size_t part = 0; part < kParts; ++part) {
      const auto from = static_cast<std::ptrdiff_t>(r.output.size() * part / kParts);
      const auto to = static_cast<std::ptrdiff_t>(r.output.size() * (part + 1) / kParts);
      Record cut;
      cut.experiment = r.experiment;
      cut.output.assign(r.output.begin() + from, r.output.begin() + to);
      for (const std::vector<double>& u : r.inputs) cut.inputs.emplace_back(u.begin() + from, u.begin() + to);
      if (!r.scored.empty()) cut.scored.assign(r.scored.begin() + from, r.scored.begin() + to);
      folds[part].push_back(std::move(cut));
    }
  return folds;
}

double held_out_rms_of(const std::vector<std::vector<Record>>& folds, const Orders& orders) {
  Errors errors;
  for (std::size_t out = 0; out < folds.size(); ++out) {
    std::vector<Record> rest;
    for (std::size_t f = 0; f < folds.size(); ++f)
      if (f != out) rest.insert(rest.end(), folds[f].begin(), folds[f].end());
    try {
      const LinearModel model = fit(rest, orders);
      if (!model.stable()) return std::numeric_limits<double>::infinity();
      errors.add(errors_of(model, folds[out]));
    } catch (const std::invalid_argument&) {
      return std::numeric_limits<double>::infinity();
    }
  }
  const double rms = errors.rms();
  return std::isnan(rms) ? std::numeric_limits<double>::infinity() : rms;
}

}  // namespace

Specification parse_specification(std::string_view text) {
  const std::size_t colon = text.find(':');
  const std::string_view family = text.substr(0, colon);
  Specification result;
  result.text = text;
  if (family == "arx")
    result.family = Family::arx;
  else if (family != "fir")
    refuse(text, fmt::format("\"{}\" is neither fir nor arx", family));
  if (colon == std::string_view::npos) refuse(text, "its orders are missing");
  const std::string_view list = text.substr(colon + 1);
  if (list == "auto") return result;

  const std::vector<int> numbers = numbers_of(text, list);
  const std::size_t orders = result.family == Family::fir ? 1 : 2;
  if (numbers.size() < orders || numbers.size() > orders + 1)
    refuse(text, result.family == Family::fir ? "a FIR has an order and may have a delay"
                                              : "an ARX has two orders and may have a delay");
  Orders o;
  o.na = result.family == Family::fir ? 0 : numbers[0];
  o.nb = numbers[orders - 1];
  o.nk = numbers.size() > orders ? numbers[orders] : 1;
  if (result.family == Family::arx && (o.na < 1 || o.na > kHighestOrder))
    refuse(text, fmt::format("NA is {}, not within 1..{}", o.na, kHighestOrder));
  if (o.nb < 1 || o.nb > kHighestOrder)
    refuse(text,
           fmt::format("{} is {}, not within 1..{}", result.family == Family::fir ? "N" : "NB", o.nb, kHighestOrder));
  if (o.nk < 1 || o.nk > kLongestDelay) refuse(text, fmt::format("NK is {}, not within 1..{}", o.nk, kLongestDelay));
  result.orders = o;
  return result;
}

std::string text_of(const Orders& o) {
  if (o.na == 0) return o.nk == 1 ? fmt::format("fir:{}", o.nb) : fmt::format("fir:{},{}", o.nb, o.nk);
  return fmt::format("arx:{},{},{}", o.na, o.nb, o.nk);
}

double held_out_rms(const std::vector<Record>& records, const Orders& orders) {
  return held_out_rms_of(folds_of(records), orders);
}

Orders choose_orders(const std::vector<Record>& records, Family family) {
  if (records.empty()) throw std::invalid_argument("black box: there is no record to fit");
  const std::size_t inputs = records[0].inputs.size();
  const std::vector<std::vector<Record>> folds = folds_of(records);
  const std::vector<Orders> all = candidates(family);
  std::vector<double> rms;
  for (const Orders& o : all) rms.push_back(held_out_rms_of(folds, o));
  auto chosen = static_cast<std::size_t>(std::min_element(rms.begin(), rms.end()) - rms.begin());
  const double best = rms[chosen];
  if (!std::isfinite(best))
    throw std::invalid_argument(
        "no order gives a stable model on data left out; give orders, or longer records that move");
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (rms[k] > kAsGood * best) continue;
    if (all[k].parameters(inputs) < all[chosen].parameters(inputs) ||
        (all[k].parameters(inputs) == all[chosen].parameters(inputs) && rms[k] < rms[chosen]))
      chosen = k;
  }
  return all[chosen];
}

}  // namespace flexspline::blackbox
