#include "host/output/answers/measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "host/output/answers/text.hpp"

namespace flexspline::output {
namespace {

using measurement::Measurement;

constexpr std::size_t kTableLines = 14;
constexpr double kManyRecords = 3;

std::string frequency_text(double hz, double std_hz) {
  if (std_hz < 1e-5 * hz) return fmt::format("{:.6g} Hz", hz);
  // Two digits of the uncertainty.
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(std_hz))), 0, 6);
  return fmt::format("{:.{}f} ± {:.{}f} Hz", hz, decimals, std_hz, decimals);
}

std::string resonance_text(const measurement::Resonance& r) {
  std::string text = fmt::format("{} at {}", r.anti ? "anti-resonance" : "resonance",
                                 frequency_text(r.frequency_hz, r.frequency_std_hz));
  if (r.damping_is_upper_limit) return text + fmt::format(", damping at most {:.2g}", r.damping);
  return text + fmt::format(", damping {:.2g} ± {:.1g}", r.damping, r.damping_std);
}

std::string resonances_text(const measurement::ResonanceSearch& search) {
  if (!search.why_not.empty()) return fmt::format("Resonances were not determined: {}.", search.why_not);
  const std::string unexplained =
      search.unexplained == 0
          ? ""
          : fmt::format(" {} more of its maxima and minima are no pole or zero: noise, or no linear response.",
                        search.unexplained);
  if (search.found.empty())
    return fmt::format("No resonance seen from {:.3g} to {:.4g} Hz ({} trusted lines).{}", search.from_hz, search.to_hz,
                       search.trusted_lines, unexplained);
  std::vector<std::string> each;
  for (const measurement::Resonance& r : search.found) each.push_back(resonance_text(r));
  std::string text =
      listed(each) + fmt::format("; none else from {:.3g} to {:.4g} Hz.", search.from_hz, search.to_hz) + unexplained;
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

void add_line(std::string& text, const std::string& line) {
  text += line + "\n";
}

void add_responses(std::string& text, const Measurement& found) {
  add_line(text, "Frequency response");
  if (std::all_of(found.pooled.begin(), found.pooled.end(),
                  [](const measurement::PooledResponse& p) { return p.response.lines.empty(); }))
    add_line(text, "  none: no line of effort and motion is excited above what leaks from others\n");
  for (const measurement::PooledResponse& p : found.pooled) {
    const measurement::FrequencyResponse& r = p.response;
    if (r.lines.empty()) continue;
    add_line(text, wrapped(fmt::format("{} to {}, load {}, {}: averaged {}, a line every {:.3g} Hz", r.input, r.output,
                                       r.load == data::Load::free ? "free" : "locked",
                                       r.records == 1 ? "one record" : fmt::format("{} records together", r.records),
                                       r.by_periods ? "over periods" : "by Welch's method", r.resolution_hz)));
    Table table({"Hz", r.unit, "deg", "coherence", "± %", ""}, "rrrrrl");
    for (const measurement::ResponseLine& line : measurement::thinned(r.lines, kTableLines))
      table.row({fmt::format("{:.4g}", line.frequency_hz), number(std::abs(line.response)),
                 fmt::format("{:.1f}", std::arg(line.response) * 180.0 / std::numbers::pi),
                 fmt::format("{:.4f}", line.coherence),
                 line.band < 0.1    ? fmt::format("{:.2g}", 100.0 * line.band)
                 : line.band < 10.0 ? fmt::format("{:.0f}", 100.0 * line.band)
                                    : ">1000",
                 line.trusted ? "trusted" : ""});
    add_line(text, table.text(4));
    add_line(text, wrapped(resonances_text(p.resonances), 4));
    text += "\n";
  }
}

void add_noise(std::string& text, const Measurement& found) {
  struct Of {
    std::string unit;
    std::vector<double> rms;
  };
  std::vector<std::string> order;
  std::map<std::string, Of> by_signal;
  std::size_t periods = 0, rest = 0;
  for (const measurement::RecordMeasurement& r : found.records) {
    for (const measurement::NoiseLevel& n : r.noise) {
      const auto [at, is_new] = by_signal.try_emplace(n.signal, Of{n.unit, {}});
      if (is_new) order.push_back(n.signal);
      at->second.rms.push_back(n.rms);
    }
    if (!r.noise.empty()) ++(r.noise.front().from == "periods" ? periods : rest);
  }
  add_line(text, "Noise floor of the signals");
  if (order.empty()) add_line(text, "  not known");
  if (!order.empty()) {
    std::vector<std::string> from;
    if (periods > 0)
      from.push_back(fmt::format("from period to period in {} of {} records", periods, found.records.size()));
    if (rest > 0) from.push_back(fmt::format("at rest in {} of {}", rest, found.records.size()));
    add_line(text, wrapped(listed(from) + "; RMS without any filter"));
    Table table({"signal", "median", "lowest", "highest", "unit"}, "lrrrl");
    for (const std::string& signal : order) {
      Of& of = by_signal[signal];
      std::sort(of.rms.begin(), of.rms.end());
      table.row({signal, number(of.rms[of.rms.size() / 2]), number(of.rms.front()), number(of.rms.back()), of.unit});
    }
    add_line(text, table.text(4));
  }
  for (const measurement::RecordMeasurement& r : found.records)
    if (!r.no_noise.empty()) add_line(text, wrapped(fmt::format("{}: not known; {}.", r.name, r.no_noise), 2, 2));
  text += "\n";
}

std::string level_text(const std::optional<measurement::DistortionLevel>& level) {
  if (!level) return "-";
  if (!level->significant) return "none";
  return fmt::format("{:.1f} dB", level->level_db);
}

struct Strongest {
  const measurement::DistortionLevel* level = nullptr;
  std::string where;

  void offer(const std::optional<measurement::DistortionLevel>& other, const std::string& name,
             const std::string& signal) {
    if (!other || !other->significant || (level != nullptr && level->level_db >= other->level_db)) return;
    level = &*other;
    where = fmt::format("{} of {}", signal, name);
  }
};

void add_distortion(std::string& text, const Measurement& found) {
  add_line(text, "Nonlinear distortion");
  Table table({"experiment", "signal", "excited", "odd", "even", "noise"}, "lllrrr");
  Strongest odd, even;
  std::map<std::string, std::size_t> reasons;
  const bool many = static_cast<double>(found.records.size()) > kManyRecords;
  bool hides = false, tested = false;
  for (const measurement::RecordMeasurement& r : found.records) {
    bool first = true;
    for (const measurement::Distortion& d : r.distortion) {
      if (!d.odd && !d.even) {
        if (first) ++reasons[d.odd_why_not];
        first = false;
        continue;
      }
      tested = true;
      odd.offer(d.odd, r.name, d.output);
      even.offer(d.even, r.name, d.output);
      if (first || !many) {
        const auto& any = d.even ? d.even : d.odd;
        table.row({r.name, d.output,
                   d.excitation == measurement::Excitation::kSine
                       ? fmt::format("{:.3g} Hz", d.low_hz)
                       : fmt::format("{} odd lines, {:.3g} to {:.3g} Hz", d.excited_lines, d.low_hz, d.high_hz),
                   level_text(d.odd), level_text(d.even),
                   any->noise_db > -200.0 ? fmt::format("{:.1f} dB", any->noise_db) : "none"});
      } else {
        hides = true;
      }
      if (first && d.odd.has_value() != d.even.has_value()) ++reasons[d.odd ? d.even_why_not : d.odd_why_not];
      first = false;
    }
  }
  if (!tested && reasons.empty()) add_line(text, "  not known: no record repeats itself");
  if (!table.empty()) {
    add_line(text, table.text(4));
    if (hides) add_line(text, "    Other signals are in the JSON answer.");
  }
  const auto print = [&](const Strongest& s, const char* kind, const char* causes) {
    if (s.level != nullptr)
      add_line(text, wrapped(fmt::format("{} nonlinear distortion at {:.0f} dB ({}): {}.", kind, s.level->level_db,
                                         s.where, causes)));
  };
  print(odd, "Odd", "dry friction, backlash, cubic stiffness, saturation, whatever is the same in both directions");
  print(even, "Even", "asymmetry, such as friction that differs by direction, gravity, or a mean motion with friction");
  if (tested && odd.level == nullptr && even.level == nullptr)
    add_line(text, "  None is above the noise: at this amplitude the drive is linear as far as can be seen.");
  for (const auto& [reason, count] : reasons)
    add_line(text, wrapped(fmt::format("Not determined in {} of {} records: {}.", count, found.records.size(), reason),
                           2, 2));
  text += "\n";
}

}  // namespace

std::string measurement_text(const Measurement& found) {
  std::string text;
  add_responses(text, found);
  add_noise(text, found);
  add_distortion(text, found);
  if (!found.notes.empty()) {
    add_line(text, "What these data do not show");
    for (const std::string& note : found.notes) add_line(text, wrapped(note, 2, 2));
  }
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

}  // namespace flexspline::output
