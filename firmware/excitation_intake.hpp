// Receives an excitation from a host, checks each number and writes it into the application's parameters in place. Its
// number of ticks stays zero until it is complete.
#pragma once

#include <array>
#include <cstdint>

#include "firmware/messages.hpp"
#include "shared/control/excitation.hpp"
#include "shared/fixed/derived_fields.hpp"
#include "shared/model/fields.hpp"
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
  using Waveform = control::Excitation::Waveform<N>;

  template <class Application, class Edit>
  static Code edit(Application& application, Edit&& change) {
    if (application.edit_excitation(change)) return Code::done;
    const auto& status = application.status();
    return is_live(status.mode) ? Code::armed : status.has_parameters ? Code::busy : Code::no_parameters;
  }
  // Only the normalised form is accepted, so that each number has one representation.
  static bool make_gain(std::int32_t mantissa, std::int32_t exponent, N::Gain& gain) {
    if (!model::detail::normal(mantissa, exponent, N::Gain::kLeastExponent, N::Gain::kMostExponent)) return false;
    gain = {};
    gain.mantissa = mantissa;
    gain.exponent = static_cast<std::int8_t>(exponent);
    return fixed::derive_fields(gain);
  }

  template <class Application>
  Code begin(Application& application, const protocol::Message& m) {
    protocol::Excitation e;
    if (const Code code = protocol::take_payload(m.content(), e); code != Code::done) return code;
    Waveform w;
    w.shape = e.shape;
    w.line_count = e.line_count;
    w.step = e.step;
    w.step_change = e.step_change;
    w.ticks = e.ticks;
    w.fade_ticks = e.fade_ticks;
    w.fade_step = e.fade_ticks > 1 ? fixed::detail::divided(~std::uint64_t{0}, e.fade_ticks) : 0;
    w.positive = N::Value{{e.positive}};
    w.negative = N::Value{{e.negative}};
    w.offset = N::Value{{e.offset}};
    w.limiter = {N::Value{{e.limit}}, N::State{{e.rate}}};
    if (w.ticks == 0 || !control::Excitation::is_valid<N>(w)) return Code::wrong_value;
    ticks_ = 0;
    return edit(application, [&](auto& c, bool& is_torque) {
      is_torque = e.is_torque;
      static_cast<Waveform&>(c) = w;
      c.ticks = 0;
      c.lines = {};
      ticks_ = e.ticks;
    });
  }
  template <class Application>
  Code guard(Application& application, const protocol::Message& m) {
    protocol::ExcitationGuard g;
    if (const Code code = protocol::take_payload(m.content(), g); code != Code::done) return code;
    control::SpeedGuard::Coefficients<N> guard{
        N::Value{{g.torque_limit}}, N::Value{{g.overspeed}}, N::Value{{g.largest_velocity}}, {}};
    if (!make_gain(g.slope_mantissa, g.slope_exponent, guard.slope) || !control::Excitation::is_valid_guard<N>(guard))
      return Code::wrong_value;
    return edit(application, [&](auto& c, bool&) {
      c.guarded = true;
      c.guard = guard;
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
