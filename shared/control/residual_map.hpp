// The errors of a model, recorded on the drive: the residual (measured motor torque less the model's) over velocity and
// motor angle. Integers, both on the host and on the drive. 3848 bytes.
//
// A bin is one word: count (12 bits), sum (22) and sum of squares (30) of residuals of 10 bits. These cannot overflow
// before the count is full, 4094; then all three are halved, so that older samples lose weight after some thousand new
// ones, and mean and variance stay.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "shared/control/limits.hpp"
#include "shared/effects/effect.hpp"
#include "shared/fixed/bits.hpp"
#include "shared/fixed/coefficients.hpp"
#include "shared/fixed/types.hpp"

namespace flexspline::control {

// In the units of the motor.
template <class P>
struct ResidualMapSetup {
  P standstill_velocity{};  // rad/s: below it the direction of friction is undefined; it has a bin of its own
  P largest_velocity{};     // rad/s: from here on all is one bin
  P largest_residual{};     // N m, limited to it; a unit of the map is a part in 511
};

class ResidualMap {
 public:
  static constexpr std::size_t kEdges = 7;  // per direction, geometric from standstill to the largest velocity
  static constexpr std::size_t kVelocityBins = 2 * kEdges + 1;
  static constexpr int kAngleBits = 5;
  static constexpr std::size_t kAngleBins = std::size_t{1} << kAngleBits;
  static constexpr std::int64_t kLargest = 511;
  static constexpr std::uint32_t kMostCount = 4094;
  static constexpr std::uint32_t kEveryTicks = 8;  // interval at which a drive adds a residual

  struct Coefficients {
    std::array<std::int32_t, kEdges> edges{};  // raw values of velocity, rising
    std::int64_t scale = 0;                    // units per base, 2^-27
    template <class Codec>
    constexpr void fields(Codec& c) {
      for (std::int32_t& edge : edges) c.positive(edge);
      c.factor(scale);
    }
  };
  struct Bin {
    std::uint32_t count = 0;
    std::int32_t sum = 0;  // in units
    std::uint32_t squares = 0;
  };

  // Host only; N is any number system, for its power.
  template <class N, class P>
  static Coefficients derive(const ResidualMapSetup<P>& s, const effects::DriveConstants<P>& d) {
    require(s.standstill_velocity > P(0.0) && s.standstill_velocity < s.largest_velocity,
            "velocities of a residual map have to rise from above zero");
    require(s.largest_residual > P(0.0), "the largest residual of a map has to be positive");
    Coefficients c;
    const P ratio = s.largest_velocity / s.standstill_velocity;
    for (std::size_t i = 0; i < kEdges; ++i) {
      const P part = P(static_cast<double>(i)) / P(static_cast<double>(kEdges - 1));
      c.edges[i] = fixed::make_value(s.standstill_velocity * N::power(ratio, part) / d.velocity_base).raw;
    }
    c.scale = fixed::nearest(static_cast<double>(P(kLargest * 1.0) * d.torque_base / s.largest_residual) * 0x1p27,
                             0x1p50, "the largest residual of a map is too small for its base");
    return c;
  }

  // One residual.
  constexpr void add(const Coefficients& c, fixed::Value velocity, fixed::Angle angle, fixed::Value residual) {
    const std::int64_t units = units_of(c, residual);
    std::uint64_t& word = words_[index(velocity_bin(c, velocity), angle_bin(angle))];
    Bin bin = unpacked(word);
    if (bin.count == kMostCount) bin = halved(bin);
    word = packed({bin.count + 1, static_cast<std::int32_t>(bin.sum + units),
                   static_cast<std::uint32_t>(bin.squares + static_cast<std::uint64_t>(units * units))});
    ++version_;
  }
  constexpr void reset() {
    words_ = {};
    ++version_;
  }

  // Reads a bin while the tick may interrupt: twice, until both agree, as a processor of 32 bits reads a word of 64
  // bits in two steps. False after `kTries`, and then `bin` is not set: the tick wrote the same bin each time.
  bool read(std::size_t velocity_bin, std::size_t angle_bin, Bin& bin) const {
    constexpr int kTries = 8;
    const volatile std::uint64_t& word = words_[index(velocity_bin, angle_bin)];
    for (int i = 0; i < kTries; ++i) {
      const std::uint64_t first = word, second = word;
      if (first != second) continue;
      bin = unpacked(first);
      return true;
    }
    return false;
  }
  // Changes with every tick and reset: if it is the same before and after a copy of the whole map, the copy is
  // consistent.
  std::uint32_t version() const {
    const volatile std::uint32_t& now = version_;
    return now;
  }

  // -kEdges to kEdges as 0 to kVelocityBins - 1; kEdges is standstill.
  static constexpr std::size_t velocity_bin(const Coefficients& c, fixed::Value velocity) {
    const std::int64_t size = velocity.raw < 0 ? -std::int64_t{velocity.raw} : velocity.raw;
    std::size_t above = 0;
    for (const std::int32_t edge : c.edges) above += size >= edge ? 1 : 0;
    return velocity.raw < 0 ? kEdges - above : kEdges + above;
  }
  static constexpr std::size_t angle_bin(fixed::Angle angle) {
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(angle.raw)) >> (fixed::kAngleBits - kAngleBits);
  }
  // The residual as the map counts it, limited.
  static constexpr std::int64_t units_of(const Coefficients& c, fixed::Value residual) {
    // Limited before and after, so that the product of 50 and 32 bits fits.
    const std::int64_t units = fixed::multiply_round(residual.raw, c.scale, 2 * fixed::kValueBits);
    return fixed::limited(units, -kLargest, kLargest);
  }

 private:
  static constexpr int kSquareBits = 30;
  static constexpr int kSumBits = 22;

  static constexpr std::size_t index(std::size_t velocity_bin, std::size_t angle_bin) {
    return velocity_bin * kAngleBins + angle_bin;
  }
  static constexpr Bin unpacked(std::uint64_t word) {
    const auto sum = static_cast<std::uint32_t>(word >> kSquareBits) & ((std::uint32_t{1} << kSumBits) - 1);
    const auto shifted = static_cast<std::int32_t>(sum << (32 - kSumBits));
    return {static_cast<std::uint32_t>(word >> (kSquareBits + kSumBits)), shifted >> (32 - kSumBits),
            static_cast<std::uint32_t>(word) & ((std::uint32_t{1} << kSquareBits) - 1)};
  }
  static constexpr std::uint64_t packed(const Bin& bin) {
    const auto sum = static_cast<std::uint32_t>(bin.sum) & ((std::uint32_t{1} << kSumBits) - 1);
    return (std::uint64_t{bin.count} << (kSquareBits + kSumBits)) | (std::uint64_t{sum} << kSquareBits) | bin.squares;
  }
  static constexpr Bin halved(const Bin& bin) {
    // Rounds half to even, so that repeated halving has no bias.
    const std::int32_t half = (bin.sum + ((bin.sum >> 1) & 1)) >> 1;
    return {bin.count / 2, half, bin.squares / 2};
  }

  std::array<std::uint64_t, kVelocityBins * kAngleBins> words_{};
  std::uint32_t version_ = 0;
};
static_assert(sizeof(ResidualMap) <= 4096);

}  // namespace flexspline::control
