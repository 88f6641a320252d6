// The position of a shaft from the counter of its encoder: the counter wraps, and its counts need not divide 2^32, so
// turns and the counts within a turn are integers, and no count is lost. Integers on the host and on the drive.
#pragma once

#include <cstdint>

#include "shared/fixed/bits.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::observers {

struct EncoderAngle {
  static constexpr std::uint32_t kMostCounts = std::uint32_t{1} << 24;
  struct Coefficients {
    std::uint32_t counts = 0;     // per turn
    std::uint64_t per_count = 0;  // 2^-56 turns: as 2^-32 it would drift within a turn
    template <class Codec>
    constexpr void fields(Codec& c) {
      c.counts(counts), c.share(per_count);
    }
  };
  struct State {
    std::uint32_t before = 0;  // the counter's last reading
    std::int32_t turns = 0;    // wraps, as an angle does
    std::uint32_t rest = 0;    // counts, below those of a turn
    bool started = false;
  };

  // Host only.
  static Coefficients derive(std::uint32_t counts_per_turn) {
    if (counts_per_turn < 4 || counts_per_turn > kMostCounts) {
      fixed::OverflowLog::note("an encoder has between 4 and 2^24 counts a turn");
      return {};
    }
    return {counts_per_turn, ((std::uint64_t{1} << 56) + counts_per_turn / 2) / counts_per_turn};
  }
  // One tick: takes the counter and returns the shaft's angle in 2^-32 turns, exact to a unit. The first call takes the
  // counter as it is, so that an absolute encoder stays absolute. More than a turn in one tick gives a wrong angle.
  static constexpr fixed::Angle update(State& s, const Coefficients& c, std::uint32_t counter) {
    const auto moved = static_cast<std::int32_t>(s.started ? counter - s.before : counter);
    s.before = counter;
    if (!s.started) {
      s.started = true;
      take_reading(s, c, counter);
      return angle(s, c);
    }
    // Below 2^25, and nearly always within the same turn.
    s.rest += static_cast<std::uint32_t>(fixed::limited_to(moved, static_cast<std::int32_t>(c.counts)));
    if (s.rest >= c.counts) [[unlikely]] {
      const bool back = static_cast<std::int32_t>(s.rest) < 0;
      s.rest += back ? c.counts : 0 - c.counts;
      s.turns = static_cast<std::int32_t>(static_cast<std::uint32_t>(s.turns) + (back ? UINT32_MAX : 1));
    }
    return angle(s, c);
  }
  // The shaft is at this many counts from its zero.
  static constexpr void take_reading(State& s, const Coefficients& c, std::uint32_t reading) {
    const auto shown = static_cast<std::int32_t>(reading), counts = static_cast<std::int32_t>(c.counts);
    s.turns = shown / counts - (shown % counts < 0 ? 1 : 0);
    s.rest = static_cast<std::uint32_t>(shown % counts + (shown % counts < 0 ? counts : 0));
  }
  // What the counter, less `origin`, would show at the shaft's zero, within a turn.
  static constexpr std::uint32_t zero_of(const State& s, const Coefficients& c, std::uint32_t origin) {
    State there;
    take_reading(there, c, s.before - origin - s.rest);
    return there.rest;
  }
  // Sets the present angle, to the nearest count, independent of what was counted before.
  static constexpr void set(State& s, const Coefficients& c, fixed::Angle angle) {
    const auto bits = static_cast<std::uint64_t>(angle.raw);
    const std::uint64_t of_a_turn = bits & 0xFFFFFFFFU;
    const std::uint64_t rest = (of_a_turn * c.counts + 0x80000000U) >> 32;
    const std::uint32_t carry = rest >= c.counts ? 1 : 0;
    s.rest = carry != 0 ? 0 : static_cast<std::uint32_t>(rest);
    s.turns = static_cast<std::int32_t>(static_cast<std::uint32_t>(bits >> 32) + carry);
  }
  // The angle at the counter value `counter`, less than a turn ago, becomes the nearest whole number of turns.
  static constexpr void set_whole_at(State& s, const Coefficients& c, std::uint32_t counter) {
    const auto counts = static_cast<std::int32_t>(c.counts);
    std::int32_t there = (static_cast<std::int32_t>(s.rest) - static_cast<std::int32_t>(s.before - counter)) % counts;
    if (there > counts / 2) there -= counts;
    if (there <= -counts / 2) there += counts;
    std::int32_t rest = static_cast<std::int32_t>(s.rest) - there, turns = 0;
    if (rest < 0) rest += counts, turns = -1;
    if (rest >= counts) rest -= counts, turns = 1;
    s.rest = static_cast<std::uint32_t>(rest);
    s.turns = static_cast<std::int32_t>(static_cast<std::uint32_t>(s.turns) + static_cast<std::uint32_t>(turns));
  }
  // By how much the counter moved since the last update, in counts.
  static constexpr std::int32_t moved(const State& s, std::uint32_t counter) {
    return s.started ? static_cast<std::int32_t>(counter - s.before) : 0;
  }

  // The shaft's angle.
  static constexpr fixed::Angle angle(const State& s, const Coefficients& c) {
    const std::uint64_t part = (s.rest * c.per_count + (std::uint64_t{1} << 23)) >> 24;
    const auto whole = static_cast<std::uint64_t>(static_cast<std::uint32_t>(s.turns)) << 32;
    return {static_cast<std::int64_t>(whole + part)};
  }
};

}  // namespace flexspline::observers
