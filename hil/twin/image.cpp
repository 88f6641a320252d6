#include "hil/twin/image.hpp"

#include <algorithm>

namespace flexspline::twin {
namespace {

constexpr std::string_view kRuns = "twin application\n";
constexpr std::string_view kHangs = "twin application that hangs\n";

}  // namespace

std::vector<std::uint8_t> twin_image(boot::Version version, std::size_t payload_bytes, bool hangs) {
  std::vector<std::uint8_t> image(boot::kHeaderBytes + std::max<std::size_t>(payload_bytes, 64));
  const std::span payload = std::span(image).subspan(boot::kHeaderBytes);
  // Data that differ for another order of blocks.
  std::uint32_t noise = 1 + version.major * 256U + version.minor;
  for (std::uint8_t& byte : payload) {
    noise = noise * 1'664'525U + 1'013'904'223U;
    byte = static_cast<std::uint8_t>(noise >> 24);
  }
  const std::string_view text = hangs ? kHangs : kRuns;
  std::copy(text.begin(), text.end(), payload.begin());
  boot::ImageHeader header;
  header.bytes = static_cast<std::uint32_t>(payload.size());
  header.crc = model::crc32(payload);
  header.board = boot::board_bytes(kBoardName);
  header.version = version;
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
  return image;
}

bool runs_on_twin(std::span<const std::uint8_t> payload) {
  return payload.size() >= kRuns.size() && std::equal(kRuns.begin(), kRuns.end(), payload.begin());
}

}  // namespace flexspline::twin
