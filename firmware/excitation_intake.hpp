// Receives an excitation from a host, checks each number and writes it into the application's parameters in place. Its
// number of ticks stays zero until it is complete.
#pragma once

#include <array>
#include <cstdint>

#include "firmware/messages.hpp"
#include "shared/control/excitation.hpp"
#include "shared/fixed/derived_fields.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::firmware {

class ExcitationIntake {
 public:
  // Serves a request of the kinds `excitation` to `excitation_use`.
  template <class Application>
  protocol::Code take(Application& application, const protocol::Message& m) {
    using protocol::Kind;
    switch (m.request()) {
      case Kind::excitation:
        return begin(application, m);
      case Kind::excitation_guard:
        return guard(application, m);
      case Kind::excitation_lines:
        return lines(application, m);
      default:
        return use(application, m);
    }
  }

 private:
  using Code = protocol::Code;

  template <class Application, class Edit>
  static Code edit(Application& application, Edit&& change) {
    if (application.edit_excitation(change)) return Code::done;
    const auto& status = application.status();
    return is_armed(status.mode) ? Code::armed : status.has_parameters ? Code::busy : Code::no_parameters;
  }
  static bool is_limit(std::int32_t raw) { return raw > 0 && raw <= (std::int32_t{2} << fixed::kValueBits); }
  static bool is_signal(std::int32_t raw) { return raw > INT32_MIN && (raw == 0 || is_limit(raw) || is_limit(-raw)); }
  // Only the normalised form is accepted, so that each number has one representation.
  static bool make_gain(std::int32_t mantissa, std::int32_t exponent, N::Gain& gain) {
    const std::uint64_t size = fixed::size_of(mantissa);
    const bool normal = mantissa == 0 ? exponent == 0
                                      : size >= (std::uint64_t{1} << (fixed::kMantissaBits - 1)) &&
                                            size <= (std::uint64_t{1} << fixed::kMantissaBits) &&
                                            exponent >= N::Gain::kLeastExponent && exponent <= N::Gain::kMostExponent;
    if (!normal) return false;
    gain = {};
    gain.mantissa = mantissa;
    gain.exponent = static_cast<std::int8_t>(exponent);
    return fixed::derive_fields(gain);
  }

  template <class Application>
  Code begin(Application& application, const protocol::Message& m) {
    protocol::Excitation e;
    if (const Code code = protocol::take_payload(m.content(), e); code != Code::done) return code;
    constexpr std::int64_t kLargestRate = std::int64_t{4} << fixed::kStateBits;
    const bool fits = e.ticks > 0 && e.fade_ticks <= e.ticks / 2 && is_signal(e.positive) && is_signal(e.negative) &&
                      is_signal(e.offset) && is_limit(e.limit) && e.rate > 0 && e.rate <= kLargestRate &&
                      (e.shape != control::Shape::lines || e.line_count > 0);
    if (!fits) return Code::wrong_value;
    ticks_ = 0;
    return edit(application, [&](auto& c, bool& is_torque) {
      is_torque = e.is_torque;
      c.shape = e.shape;
      c.guarded = false;
      c.line_count = e.line_count;
      c.step = e.step;
      c.step_change = e.step_change;
      c.ticks = 0;
      c.fade_ticks = e.fade_ticks;
      c.fade_step = e.fade_ticks > 1 ? fixed::detail::divided(~std::uint64_t{0}, e.fade_ticks) : 0;
      c.positive = N::Value{{e.positive}};
      c.negative = N::Value{{e.negative}};
      c.offset = N::Value{{e.offset}};
      c.limiter.limit = N::Value{{e.limit}};
      c.limiter.rate = N::State{{e.rate}};
      c.lines = {};
      ticks_ = e.ticks;
    });
  }
  template <class Application>
  Code guard(Application& application, const protocol::Message& m) {
    protocol::ExcitationGuard g;
    if (const Code code = protocol::take_payload(m.content(), g); code != Code::done) return code;
    N::Gain slope{};
    if (!is_limit(g.torque_limit) || !is_limit(g.overspeed) || g.largest_velocity <= 0 || g.slope_mantissa <= 0 ||
        !make_gain(g.slope_mantissa, g.slope_exponent, slope))
      return Code::wrong_value;
    return edit(application, [&](auto& c, bool&) {
      c.guarded = true;
      c.guard.torque_limit = N::Value{{g.torque_limit}};
      c.guard.overspeed = N::Value{{g.overspeed}};
      c.guard.largest_velocity = N::Value{{g.largest_velocity}};
      c.guard.slope = slope;
    });
  }
  template <class Application>
  Code lines(Application& application, const protocol::Message& m) {
    protocol::ExcitationLines all;
    if (const Code code = protocol::take_payload(m.content(), all); code != Code::done) return code;
    constexpr std::int32_t kMostExponent = 2;  // a line is within four bases, so that the sum of all fits
    std::array<N::Gain, protocol::kLinesAMessage> gains{};
    if (all.first + all.count > static_cast<int>(control::kMostLines)) return Code::wrong_value;
    for (std::size_t i = 0; i < all.count; ++i) {
      const protocol::ExcitationLine& line = all.lines[i];
      if (line.harmonic == 0 || line.exponent > kMostExponent || !make_gain(line.mantissa, line.exponent, gains[i]))
        return Code::wrong_value;
    }
    return edit(application, [&](auto& c, bool&) {
      for (std::size_t i = 0; i < all.count; ++i)
        c.lines[all.first + i] = {all.lines[i].harmonic, all.lines[i].phase, gains[i]};
    });
  }
  template <class Application>
  Code use(Application& application, const protocol::Message& m) {
    if (m.length != 0) return Code::wrong_length;
    if (ticks_ == 0) return Code::not_begun;
    return edit(application, [&](auto& c, bool&) { c.ticks = ticks_; });
  }

  std::uint32_t ticks_ = 0;  // zero: no excitation is being received
};

}  // namespace flexspline::firmware
