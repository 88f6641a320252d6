#include "host/output/report/trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace flexspline::report {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint16_t kNoCode = 65535;
constexpr double kLargestCode = 65534.0;

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - k);
    std::uint32_t word = 0;
    for (std::size_t b = 0; b < 3; ++b) word = word << 8U | (b < left ? bytes[k + b] : 0U);
    for (std::size_t c = 0; c < 4; ++c) text += c <= left ? kLetters[word >> (18U - 6U * c) & 63U] : '=';
  }
  return text;
}

}  // namespace

Thinning::Thinning(const std::vector<data::Segment>& segments, std::size_t wanted) {
  std::size_t samples = 0;
  for (const data::Segment& s : segments) samples += s.last - s.first;
  const std::size_t per_bucket = samples <= wanted ? 1 : (2 * samples + wanted - 1) / std::max<std::size_t>(2, wanted);
  for (const data::Segment& s : segments) {
    if (!buckets_.empty()) buckets_.push_back({s.first, s.first});
    for (std::size_t k = s.first; k < s.last; k += per_bucket)
      buckets_.push_back({k, std::min(k + per_bucket, s.last)});
  }
}

std::vector<double> Thinning::times(std::span<const double> time_s) const {
  std::vector<double> times;
  for (const Bucket& b : buckets_) {
    times.push_back(time_s[b.first]);
    if (b.last > b.first + 1) times.push_back(time_s[b.last - 1]);
  }
  return times;
}

std::vector<double> Thinning::values(std::span<const double> signal, std::span<const std::uint8_t> valid) const {
  std::vector<double> values;
  for (const Bucket& b : buckets_) {
    std::size_t least = b.last, largest = b.last;
    for (std::size_t k = b.first; k < b.last; ++k) {
      if ((!valid.empty() && !valid[k]) || !std::isfinite(signal[k])) continue;
      if (least == b.last || signal[k] < signal[least]) least = k;
      if (largest == b.last || signal[k] > signal[largest]) largest = k;
    }
    const bool any = least < b.last;
    values.push_back(any ? signal[std::min(least, largest)] : kNone);
    if (b.last > b.first + 1) values.push_back(any ? signal[std::max(least, largest)] : kNone);
  }
  return values;
}

nlohmann::json packed(std::span<const double> values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double v : values)
    if (std::isfinite(v)) {
      low = std::min(low, v);
      high = std::max(high, v);
    }
  const double offset = low <= high ? low : 0.0;
  const double scale = high > low ? (high - low) / kLargestCode : 1.0;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(2 * values.size());
  for (const double v : values) {
    const auto code = std::isfinite(v) ? static_cast<std::uint16_t>(std::lround((v - offset) / scale)) : kNoCode;
    bytes.push_back(static_cast<std::uint8_t>(code & 0xFFU));
    bytes.push_back(static_cast<std::uint8_t>(code >> 8U));
  }
  return {{"offset", offset}, {"scale", scale}, {"count", values.size()}, {"codes", base64(bytes)}};
}

}  // namespace flexspline::report
