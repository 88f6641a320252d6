#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/output/answers/json.hpp"
#include "host/output/answers/measurement.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;

// What a plot can show; all lines of a long record would be megabytes.
constexpr std::size_t kRecordLines = 60;
constexpr std::size_t kPooledLines = 400;

json text_or_null(const std::string& text) {
  return text.empty() ? json(nullptr) : json(text);
}

const char* load_name(data::Load load) {
  return load == data::Load::free ? "free" : "locked";
}

json response_json(const measurement::FrequencyResponse& r, std::size_t most_lines) {
  json lines = json::array();
  for (const measurement::ResponseLine& line : measurement::thinned(r.lines, most_lines))
    lines.push_back({{"frequency_hz", json_number(line.frequency_hz)},
                     {"amplitude", json_number(std::abs(line.response))},
                     {"phase_deg", json_number(std::arg(line.response) * 180.0 / std::numbers::pi)},
                     {"coherence", json_number(line.coherence)},
                     {"band_percent", json_number(100.0 * line.band)},
                     {"trusted", line.trusted}});
  return {{"input", r.input},
          {"output", r.output},
          {"unit", r.unit},
          {"load", load_name(r.load)},
          {"average", r.by_periods ? "periods" : "welch"},
          {"resolution_hz", json_number(r.resolution_hz)},
          {"records", r.records},
          {"excited_lines", r.lines.size()},
          {"trusted_lines", r.trusted()},
          {"lines", std::move(lines)}};
}

json resonances_json(const measurement::ResonanceSearch& search) {
  json list = json::array();
  for (const measurement::Resonance& r : search.found)
    list.push_back({{"kind", r.anti ? "anti_resonance" : "resonance"},
                    {"frequency_hz", json_number(r.frequency_hz)},
                    {"frequency_std_hz", json_number(r.frequency_std_hz)},
                    {"damping", json_number(r.damping)},
                    {"damping_std", json_number(r.damping_std)},
                    {"damping_is_upper_limit", r.damping_is_upper_limit}});
  return list;
}

json noise_json(const measurement::NoiseLevel& n) {
  json bands = json::array();
  for (const measurement::NoiseBand& band : n.bands)
    bands.push_back({{"low_hz", json_number(band.low_hz)},
                     {"high_hz", json_number(band.high_hz)},
                     {"density", json_number(band.density)}});
  return {
      {"signal", n.signal},
      {"unit", n.unit},
      {"noise_rms", json_number(n.rms)},
      {"signal_rms", json_number(n.signal_rms)},
      {"noise_from", n.from},
      {"density_unit", n.unit.find_first_of("*/") == std::string::npos ? n.unit + "^2/Hz" : "(" + n.unit + ")^2/Hz"},
      {"bands", std::move(bands)}};
}

json level_json(const std::optional<measurement::DistortionLevel>& level) {
  if (!level) return nullptr;
  return {{"lines", level->lines},
          {"level_db", json_number(level->level_db)},
          {"noise_db", json_number(level->noise_db)},
          {"rms", json_number(level->rms)},
          {"p_value", json_number(level->p_value)},
          {"significant", level->significant}};
}

const char* excitation_name(measurement::Excitation excitation) {
  switch (excitation) {
    case measurement::Excitation::kOddMultisine:
      return "odd_multisine";
    case measurement::Excitation::kSine:
      return "sine";
    case measurement::Excitation::kOther:
      return "other";
  }
  return "";
}

json distortion_json(const measurement::Distortion& d) {
  return {{"input", d.input},
          {"output", d.output},
          {"unit", d.unit},
          {"excitation", excitation_name(d.excitation)},
          {"excited_lines", d.excited_lines},
          {"low_hz", d.excited_lines > 0 ? json_number(d.low_hz) : json(nullptr)},
          {"high_hz", d.excited_lines > 0 ? json_number(d.high_hz) : json(nullptr)},
          {"odd", level_json(d.odd)},
          {"odd_why_not", text_or_null(d.odd_why_not)},
          {"even", level_json(d.even)},
          {"even_why_not", text_or_null(d.even_why_not)}};
}

json period_json(const measurement::RecordMeasurement& r) {
  if (!r.period) return nullptr;
  return {{"period_s", json_number(r.period->exact_samples * r.sample_s)},
          {"samples", json_number(r.period->exact_samples)},
          {"periods", r.period->count},
          {"periods_left_out", r.period->left_out},
          {"found_in", r.period->from}};
}

}  // namespace

json measurement_json(const measurement::Measurement& found) {
  json experiments = json::array();
  for (const measurement::RecordMeasurement& r : found.records) {
    json responses = json::array(), noise = json::array(), distortion = json::array();
    for (const auto& response : r.responses) responses.push_back(response_json(response, kRecordLines));
    for (const auto& level : r.noise) noise.push_back(noise_json(level));
    for (const auto& d : r.distortion) distortion.push_back(distortion_json(d));
    experiments.push_back({{"name", r.name},
                           {"load", load_name(r.load)},
                           {"period", period_json(r)},
                           {"why_no_period", text_or_null(r.no_period)},
                           {"responses", std::move(responses)},
                           {"noise", std::move(noise)},
                           {"distortion", std::move(distortion)}});
  }
  json pooled = json::array();
  for (const measurement::PooledResponse& p : found.pooled) {
    json one = response_json(p.response, kPooledLines);
    one["resonances"] = resonances_json(p.resonances);
    const bool any = p.resonances.trusted_lines > 0;
    one["trusted_from_hz"] = any ? json_number(p.resonances.from_hz) : json(nullptr);
    one["trusted_to_hz"] = any ? json_number(p.resonances.to_hz) : json(nullptr);
    one["unexplained_extrema"] = p.resonances.unexplained;
    one["why_no_resonance"] = text_or_null(p.resonances.why_not);
    pooled.push_back(std::move(one));
  }
  return {{"format", "flexspline-measure/1"},
          {"experiments", std::move(experiments)},
          {"pooled", std::move(pooled)},
          {"notes", found.notes}};
}

}  // namespace flexspline::output
