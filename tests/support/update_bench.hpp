// Images and slots for tests of updates: a board's memory whose power can be cut, and what a start finds in it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "shared/boot/slots.hpp"
#include "tests/support/flash_model.hpp"

namespace flexspline::tests {

inline constexpr std::size_t kSlotBytes = 768;
inline constexpr std::string_view kTestBoard = "bench";
using SlotCells = FlashCells<kSlotBytes, boot::kImageSectors>;
using SlotFlash = FlashModel<kSlotBytes, boot::kImageSectors>;
using TestSlots = boot::Slots<SlotFlash>;

// An image that names itself by its version; its content follows from that.
inline std::vector<std::uint8_t> image_named(std::uint8_t name, std::size_t payload = 42,
                                             std::string_view board = kTestBoard, std::uint16_t counter = 0) {
  std::vector<std::uint8_t> image(boot::kHeaderBytes + payload);
  for (std::size_t i = 0; i < payload; ++i) image[boot::kHeaderBytes + i] = static_cast<std::uint8_t>(name + i * i);
  boot::ImageHeader header;
  header.bytes = static_cast<std::uint32_t>(payload);
  header.crc = model::crc32(std::span(image).subspan(boot::kHeaderBytes));
  header.board = boot::board_bytes(board);
  header.version = {name, 0};
  header.security_counter = counter;
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
  return image;
}

template <class Slots>
bool download(Slots& slots, const std::vector<std::uint8_t>& image, std::size_t chunk = 256) {
  if (slots.begin() != boot::SlotError::none) return false;
  for (std::size_t at = 0; at < image.size(); at += chunk) {
    const std::size_t n = image.size() - at < chunk ? image.size() - at : chunk;
    if (slots.write(std::span(image).subspan(at, n)) != boot::SlotError::none) return false;
  }
  return slots.has_all() && slots.finish() == boot::SlotError::none;
}

}  // namespace flexspline::tests
