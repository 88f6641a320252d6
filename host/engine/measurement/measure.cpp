#include "host/engine/measurement/measure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "host/common/signals/cutoff.hpp"
#include "host/common/signals/fft.hpp"

namespace flexspline::measurement {
namespace {

using data::Experiment;

// Periods with fewer excited lines than this show nothing between them that Welch's average over all records does not.
constexpr std::size_t kMultisineLines = 8;
// Half-overlapping windows: at least eight averages a record.
constexpr double kWindowsARecord = 4.5;
constexpr double kFinestResolutionHz = 0.05;
constexpr std::size_t kSmallestWindow = 64;
// Records much shorter than the longest do not make the window short for all.
constexpr double kShortShare = 0.25;

constexpr const char* kWhatToRecord =
    "an odd random-phase multisine as set point of the current (or of the velocity): odd lines of its period alone, "
    "about every fourth of them left out at random, a whole number of samples in the period, six periods or more, and "
    "a mean velocity that keeps the drive from sticking";

std::size_t longest_of(const Experiment& e) {
  std::size_t longest = 0;
  for (const data::Segment& s : e.segments) longest = std::max(longest, s.last - s.first);
  return longest;
}

// One window for all records of a sample rate, so that they can be pooled.
std::size_t common_window(const std::vector<const Experiment*>& experiments, double sample_s) {
  std::size_t longest = 0;
  const auto alike = [&](const Experiment& e) { return std::abs(e.sample_s - sample_s) < 1e-3 * sample_s; };
  for (const Experiment* e : experiments)
    if (alike(*e)) longest = std::max(longest, longest_of(*e));
  std::size_t shortest = longest;
  for (const Experiment* e : experiments)
    if (const std::size_t n = longest_of(*e);
        alike(*e) && static_cast<double>(n) > kShortShare * static_cast<double>(longest))
      shortest = std::min(shortest, n);
  const double samples =
      std::min(static_cast<double>(shortest) / kWindowsARecord, 1.0 / (kFinestResolutionHz * sample_s));
  return signals::fast_fft_size(std::max(kSmallestWindow, static_cast<std::size_t>(samples)));
}

std::string unit_over(const std::string& output, const std::string& input) {
  const auto bracketed = [](const std::string& unit) {
    return unit.find_first_of("*/") == std::string::npos ? unit : "(" + unit + ")";
  };
  return bracketed(output) + "/" + bracketed(input);
}

// Speeds of either sign reach a twentieth of the largest.
bool reverses(const Experiment& e, const data::DriveFacts& drive) {
  const std::vector<Channel> responses = responses_of(e, drive);
  if (responses.empty() || responses.front().name.find("velocity") == std::string::npos) return false;
  const auto [low, high] = std::minmax_element(responses.front().values.begin(), responses.front().values.end());
  return *low<-0.05 * *high&& * high> - 0.05 * *low;
}

bool has_set_point(const Experiment& e) {
  return e.has(data::Column::current_command) || e.has(data::Column::velocity_command) ||
         e.has(data::Column::position_command);
}

// A line of the output's distortion, taken for as large at excited lines as at the larger kind of the others.
Spectra with_distortion(Spectra spectra, const Distortion& distortion, const Channel& output, double sample_s) {
  if (distortion.excitation != Excitation::kOddMultisine) return spectra;
  double power = 0.0;
  for (const auto& level : {distortion.odd, distortion.even})
    if (level && level->significant)
      power = std::max(power, level->rms * level->rms / static_cast<double>(level->lines));
  for (std::size_t k = 0; k < spectra.frequency_hz.size(); ++k)
    spectra.distortion[k] = spectra.averages[k] * power / spectra.resolution_hz /
                            std::norm(output.correction(spectra.frequency_hz[k], sample_s));
  return spectra;
}

// Upper end of the band in which the effort drives the motion, by the power that is coherent.
double coherent_to_hz(const Experiment& e, const Channel& input, const Channel& output) {
  double highest = 0.0;
  for (const data::Segment& s : e.segments) {
    const auto part = [&](const Channel& c) { return std::span(c.values).subspan(s.first, s.last - s.first); };
    highest = std::max(highest, signals::choose_cutoff(part(input), part(output), 1.0 / e.sample_s).coherent_to_hz);
  }
  return highest;
}

// Pools are distinguished by load, output, kind of average, lines of the period and sample rate.
using PoolKey = std::tuple<int, std::string, std::string, bool, std::size_t, long>;
struct Pool {
  Channel input, output;  // without values: units and corrections
  data::Load load = data::Load::free;
  double sample_s = 0.0;
  std::size_t records = 0;
  Spectra spectra;
};

FrequencyResponse response_from(const Spectra& spectra, const Channel& input, const Channel& output, data::Load load,
                                double sample_s, std::size_t records) {
  FrequencyResponse r;
  r.input = input.name;
  r.output = output.name;
  r.unit = unit_over(output.unit, input.unit);
  r.load = load;
  r.by_periods = spectra.by_periods;
  r.resolution_hz = spectra.resolution_hz;
  r.records = records;
  r.lines = response_of(spectra, input, output, sample_s);
  return r;
}

class Measuring {
 public:
  Measuring(const data::Dataset& dataset, std::optional<double> period_s) : dataset_(dataset), period_s_(period_s) {
    for (const Experiment& e : dataset.experiments) experiments_.push_back(&e);
  }

  Measurement run() {
    for (const Experiment* e : experiments_) add(*e);
    pool();
    advise();
    return std::move(answer_);
  }

 private:
  void add(const Experiment& e) {
    RecordMeasurement r;
    r.name = e.name;
    r.load = e.load;
    r.sample_s = e.sample_s;
    const auto masked = std::count_if(e.masked.begin(), e.masked.end(), [](std::uint8_t m) { return m != 0; });
    r.masked_percent = e.size() > 0 ? 100.0 * static_cast<double>(masked) / static_cast<double>(e.size()) : 0.0;
    const bool at_rest = is_at_rest(e);
    PeriodSearch search;
    if (at_rest)
      search.why_not = "nothing moves";
    else
      search = find_period(e, period_s_);
    r.period = search.period;
    r.no_period = search.why_not;
    add_noise(e, at_rest, r);
    if (!at_rest) add_responses(e, r);
    answer_.records.push_back(std::move(r));
  }

  void add_noise(const Experiment& e, bool at_rest, RecordMeasurement& r) const {
    if (!r.period && !at_rest) {
      r.no_noise = fmt::format("{}; repeat one period of the excitation six times or more", r.no_period);
      return;
    }
    for (const Channel& channel : measured_channels(e, dataset_.drive))
      r.noise.push_back(at_rest ? noise_at_rest(channel, e.segments, e.sample_s)
                                : noise_by_periods(channel, *r.period, e.sample_s));
  }

  void add_responses(const Experiment& e, RecordMeasurement& r) {
    const auto input = effort_of(e, dataset_.drive.axis.value_or(data::Axis::rotary));
    if (!input) return;
    ExcitedLines excited;
    if (r.period) excited = excited_lines(e, *r.period);
    const bool multisine = r.period && r.period->is_whole() && excited.lines.size() >= kMultisineLines;
    // Harmonics that the drive's friction makes of a set point's lines are coherent, too, and no linear response.
    WelchLimits limits;
    for (const std::size_t k : excited.lines) limits.near_hz.push_back(r.period->frequency_hz(k, e.sample_s));
    const std::size_t window = common_window(experiments_, e.sample_s);

    const std::vector<Channel> outputs = responses_of(e, dataset_.drive);
    if (!multisine && !outputs.empty()) limits.to_hz = coherent_to_hz(e, *input, outputs.front());
    for (const Channel& output : outputs) {
      if (r.period) r.distortion.push_back(distortion_of(*input, output, *r.period, e.sample_s, excited));
      std::optional<Spectra> spectra;
      if (multisine)
        spectra = with_distortion(spectra_by_periods(*input, output, *r.period, e.sample_s, excited),
                                  r.distortion.back(), output, e.sample_s);
      else
        spectra = spectra_by_welch(*input, output, e.segments, e.sample_s, window, limits);
      if (!spectra) continue;
      r.responses.push_back(response_from(*spectra, *input, output, e.load, e.sample_s, 1));
      keep(*spectra, *input, output, e);
    }
  }

  void keep(const Spectra& spectra, const Channel& input, const Channel& output, const Experiment& e) {
    const PoolKey key{static_cast<int>(e.load),
                      input.name + (input.held ? " held" : ""),
                      output.name,
                      spectra.by_periods,
                      spectra.frequency_hz.size(),
                      std::lround(1.0 / e.sample_s)};
    const auto [at, is_new] = pools_.try_emplace(key);
    Pool& pool = at->second;
    ++pool.records;
    if (!is_new) {
      pool.spectra.add(spectra);
      return;
    }
    const auto without_values = [](const Channel& c) { return Channel{c.name, c.unit, {}, c.held, c.differenced}; };
    pool.input = without_values(input);
    pool.output = without_values(output);
    pool.load = e.load;
    pool.sample_s = e.sample_s;
    pool.spectra = spectra;
  }

  void pool() {
    for (const auto& [key, pool] : pools_) {
      PooledResponse pooled;
      pooled.response = response_from(pool.spectra, pool.input, pool.output, pool.load, pool.sample_s, pool.records);
      pooled.resonances =
          find_resonances(pooled.response.lines, pooled.response.resolution_hz, !pooled.response.by_periods);
      answer_.pooled.push_back(std::move(pooled));
    }
    // Velocity first, then the kind with most information.
    const auto place = [](const PooledResponse& p) {
      const std::string& name = p.response.output;
      return name.find("velocity") != std::string::npos ? 0 : name == "torque_nm" ? 1 : 2;
    };
    std::stable_sort(answer_.pooled.begin(), answer_.pooled.end(),
                     [&](const PooledResponse& a, const PooledResponse& b) {
                       return std::tuple(static_cast<int>(a.response.load), place(a), !a.response.by_periods) <
                              std::tuple(static_cast<int>(b.response.load), place(b), !b.response.by_periods);
                     });
  }

  void advise() {
    const auto any = [&](auto what) { return std::any_of(answer_.records.begin(), answer_.records.end(), what); };
    std::vector<std::string>& notes = answer_.notes;
    bool effort = false, response = false;
    for (const Experiment* e : experiments_) {
      effort = effort || effort_of(*e, data::Axis::rotary).has_value();
      response = response || !responses_of(*e, dataset_.drive).empty();
    }
    if (!effort)
      notes.push_back(
          "There is no frequency response without what drives the motor: record current_a or motor_torque_nm.");
    if (!response)
      notes.push_back(
          "There is no frequency response without what answers the current: record motor_position_rad or torque_nm.");
    const bool resonance_found = std::any_of(answer_.pooled.begin(), answer_.pooled.end(),
                                             [](const PooledResponse& p) { return p.resonances.why_not.empty(); });
    const auto is_determined = [](const Distortion& d) { return d.odd.has_value() || d.even.has_value(); };
    const bool distortion_found = any([&](const RecordMeasurement& r) {
      return std::any_of(r.distortion.begin(), r.distortion.end(), is_determined);
    });
    if (effort && response && !(resonance_found && distortion_found))
      notes.push_back(fmt::format("{} cannot be distinguished from these motions: record {}.",
                                  resonance_found    ? "Odd and even nonlinear distortion"
                                  : distortion_found ? "Whether there is a resonance"
                                                     : "Whether there is a resonance, and nonlinear distortion,",
                                  kWhatToRecord));
    if (!any([](const RecordMeasurement& r) { return !r.noise.empty(); }))
      notes.push_back(
          "The noise floor could not be found, as no record repeats itself: repeat one period of the excitation six "
          "times or more, or record a minute at rest for the sensors alone.");
    advise_on_reversals();
    advise_on_set_points();
    for (const RecordMeasurement& r : answer_.records)
      if (r.masked_percent > 5.0)
        notes.push_back(fmt::format(
            "{}: {:.0f} % of the samples are clipped or at standstill, and count here nevertheless; see flexspline "
            "check.",
            r.name, r.masked_percent));
  }

  void advise_on_reversals() {
    std::size_t reversing = 0;
    for (std::size_t k = 0; k < experiments_.size(); ++k) {
      const auto& responses = answer_.records[k].responses;
      if (experiments_[k]->load == data::Load::free && !responses.empty() && responses.front().trusted() > 0 &&
          reverses(*experiments_[k], dataset_.drive))
        ++reversing;
    }
    if (reversing > 0)
      answer_.notes.push_back(fmt::format(
          "In {} of {} records the free motor reverses: dry friction, where there is any, is part of the response "
          "then, which is not that of inertia and spring alone and changes with the amplitude; add a mean velocity "
          "that keeps one direction to see those.",
          reversing, answer_.records.size()));
  }

  void advise_on_set_points() {
    std::vector<std::string> blind;
    for (std::size_t k = 0; k < experiments_.size(); ++k) {
      const bool welch = std::any_of(answer_.records[k].responses.begin(), answer_.records[k].responses.end(),
                                     [](const FrequencyResponse& r) { return !r.by_periods && r.trusted() > 0; });
      if (welch && !answer_.records[k].period && !has_set_point(*experiments_[k]))
        blind.push_back(answer_.records[k].name);
    }
    if (!blind.empty())
      answer_.notes.push_back(
          fmt::format("{} of {} records ({}{}) neither repeat themselves nor have a set point: if a controller moved "
                      "the drive, its answer to friction counts there as excitation and falsifies the response; record "
                      "the set point.",
                      blind.size(), answer_.records.size(), blind.front(), blind.size() > 1 ? ", ..." : ""));
  }

  const data::Dataset& dataset_;
  std::optional<double> period_s_;
  std::vector<const Experiment*> experiments_;
  std::map<PoolKey, Pool> pools_;
  Measurement answer_;
};

}  // namespace

std::size_t FrequencyResponse::trusted() const {
  return static_cast<std::size_t>(
      std::count_if(lines.begin(), lines.end(), [](const ResponseLine& line) { return line.trusted; }));
}

Measurement measure(const data::Dataset& dataset, std::optional<double> period_s) {
  return Measuring(dataset, period_s).run();
}

}  // namespace flexspline::measurement
