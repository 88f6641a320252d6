// Sections of a parameter block that belong to the drive, not to the model: read, and put into another block.
#pragma once

#include <cstdint>
#include <span>

#include "host/drive_link/drive/session.hpp"
#include "shared/control/drive_block.hpp"

namespace flexspline::drive {

/// Counts a turn of the encoder in this section of a block; 0 where the block has none.
inline std::uint32_t encoder_counts_in(const Bytes& block, model::Section section) {
  std::uint32_t counts = 0;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != static_cast<std::uint16_t>(section)) return;
    model::FieldReader reader(bytes);
    observers::EncoderAngle::Coefficients c;
    c.fields(reader);
    counts = c.counts;
  });
  return counts;
}

/// The block with this content as that section, in place of the one that it had; without one where `content` is null.
template <class Content>
Bytes with_section(const Bytes& block, model::Section section, const Content* content) {
  constexpr std::size_t kMostBytes = 256;  // of a section
  const auto replaced = static_cast<std::uint16_t>(section);
  Bytes out(block.size() + kMostBytes);
  model::BlockWriter writer(out);
  writer.begin(model::header_of(block));
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != replaced) writer.add_bytes(kind, bytes);
  });
  if (content != nullptr) writer.add(replaced, *content);
  out.resize(writer.end());
  return out;
}

}  // namespace flexspline::drive
