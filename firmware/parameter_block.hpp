// The seam through which a drive gets its parameters: bytes that are looked at as a whole before any of them is used.
// The bytes are those of the drive's own struct behind a header; a block has to be aligned as a 64-bit word is, as it
// is in flash, so that it is checked where it lies and needs no second copy.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include "firmware/control.hpp"

namespace flexspline::firmware {

enum class BlockFinding : std::uint8_t {
  good,
  short_block,
  not_aligned,
  not_a_block,
  other_layout,
  damaged,
  other_tick_rate,
  encoder,
  limits,
  model,
  armed,  // good, but the drive is armed
};
constexpr std::string_view reason_of(BlockFinding finding) {
  switch (finding) {
    case BlockFinding::good:
      return "the block is good";
    case BlockFinding::short_block:
      return "the block ends before its parameters do";
    case BlockFinding::not_aligned:
      return "the block does not lie at a multiple of eight";
    case BlockFinding::not_a_block:
      return "these bytes are no parameter block";
    case BlockFinding::other_layout:
      return "the block was made for another version of the firmware";
    case BlockFinding::damaged:
      return "the block's checksum does not match its bytes";
    case BlockFinding::other_tick_rate:
      return "the block was made for another tick rate";
    case BlockFinding::encoder:
      return "the block's encoder counts are not between 4 and 2^24";
    case BlockFinding::limits:
      return "a limit of torque, current, velocity or time in the block is not positive";
    case BlockFinding::model:
      return "the block's model has an effect more often than there is room for";
    case BlockFinding::armed:
      return "parameters cannot change while the drive is armed; disarm it first";
  }
  return "";
}

// CRC-32 (ISO-HDLC), bit by bit: a block is looked at once, and a table would be a kilobyte.
constexpr std::uint32_t crc32(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320 : 0);
  }
  return ~crc;
}

struct BlockHeader {
  std::uint32_t magic = 0;
  std::uint32_t layout = 0;
  std::uint32_t bytes = 0;  // behind the header
  std::uint32_t crc = 0;    // of those
};
inline constexpr std::uint32_t kBlockMagic = 0x50535846;  // "FXSP"
// A change of any parameter's place is another layout, which the size nearly always shows too.
inline constexpr std::uint32_t kBlockLayout = 1;
inline constexpr std::size_t kBlockBytes = sizeof(BlockHeader) + sizeof(Parameters);
static_assert(std::is_trivially_copyable_v<Parameters> && sizeof(BlockHeader) % alignof(Parameters) == 0);
static_assert(std::endian::native == std::endian::little);

// Host only: the block of parameters. `out` has kBlockBytes.
inline void write_block(const Parameters& parameters, std::span<std::byte> out) {
  const auto body = out.subspan(sizeof(BlockHeader));
  std::memcpy(body.data(), &parameters, sizeof(Parameters));
  const BlockHeader header{kBlockMagic, kBlockLayout, sizeof(Parameters), crc32(body)};
  std::memcpy(out.data(), &header, sizeof(header));
}

namespace detail {
inline bool limits_hold(const Parameters& p) {
  const auto positive = [](N::Value x) { return x > N::Value{}; };
  const auto& s = p.safety;
  return positive(p.loops.torque_limit) && positive(p.loops.current_limit) && positive(p.loops.velocity_limit) &&
         positive(s.overspeed) && positive(s.overcurrent) && positive(s.acceleration) && positive(s.stuck_torque) &&
         positive(s.current_mismatch) && positive(s.standstill) && s.counts_a_tick > 0 && s.host_ticks > 0 &&
         s.stop_ticks > 0 && s.stuck_ticks > 0 && s.mismatch_ticks > 0 && p.trajectory.change > 0 &&
         p.trajectory.velocity > 0 && p.amplifier.limit > 0;
}
inline bool encoder_fits(const observers::EncoderAngle::Coefficients& c) {
  return c.counts >= 4 && c.counts <= observers::EncoderAngle::kMostCounts;
}
inline bool model_fits(const Parameters& p) {
  bool fits = true;
  // Visiting changes nothing.
  auto& model = const_cast<decltype(Parameters::model)&>(p.model);
  model.for_each([&]<class Effect>(const model::Places<Effect, N>& places) {
    fits = fits && places.count <= places.coefficients.size();
  });
  return fits;
}
}  // namespace detail

// The parameters in a block, which stay where they are.
inline const Parameters& parameters_in(std::span<const std::byte> block) {
  return *reinterpret_cast<const Parameters*>(block.data() + sizeof(BlockHeader));
}

inline BlockFinding check_block(std::span<const std::byte> block, std::uint32_t tick_hz) {
  if (block.size() < kBlockBytes) return BlockFinding::short_block;
  if (reinterpret_cast<std::uintptr_t>(block.data()) % alignof(Parameters) != 0) return BlockFinding::not_aligned;
  BlockHeader header;
  std::memcpy(&header, block.data(), sizeof(header));
  if (header.magic != kBlockMagic) return BlockFinding::not_a_block;
  if (header.layout != kBlockLayout || header.bytes != sizeof(Parameters)) return BlockFinding::other_layout;
  if (crc32(block.subspan(sizeof(header), sizeof(Parameters))) != header.crc) return BlockFinding::damaged;
  const Parameters& p = parameters_in(block);
  if (p.tick_hz != tick_hz) return BlockFinding::other_tick_rate;
  if (!detail::encoder_fits(p.motor_encoder) || (p.has_output_encoder && !detail::encoder_fits(p.output_encoder)))
    return BlockFinding::encoder;
  if (!detail::limits_hold(p)) return BlockFinding::limits;
  if (!detail::model_fits(p)) return BlockFinding::model;
  return BlockFinding::good;
}

}  // namespace flexspline::firmware
