#include "hil/twin/image.hpp"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "shared/boot/development_key.hpp"

namespace flexspline::twin {
namespace {

constexpr std::string_view kRuns = "twin application\n";
constexpr std::string_view kHangs = "twin application that hangs\n";

}  // namespace

std::vector<std::uint8_t> twin_image(const TwinImage& what) {
  std::vector<std::uint8_t> image(boot::kHeaderBytes + std::max<std::size_t>(what.bytes, 64));
  const std::span payload = std::span(image).subspan(boot::kHeaderBytes);
  // Data that differ for another order of blocks.
  std::uint32_t noise = 1 + what.version.major * 256U + what.version.minor;
  for (std::uint8_t& byte : payload) {
    noise = noise * 1'664'525U + 1'013'904'223U;
    byte = static_cast<std::uint8_t>(noise >> 24);
  }
  const std::string_view text = what.hangs ? kHangs : kRuns;
  std::copy(text.begin(), text.end(), payload.begin());
  boot::ImageHeader header;
  header.bytes = static_cast<std::uint32_t>(payload.size());
  header.crc = model::crc32(payload);
  header.board = boot::board_bytes(kBoardName);
  header.version = what.version;
  header.security_counter = what.security_counter;
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
  if (what.is_signed) sign_with_development_key(image);
  return image;
}

void sign_with_development_key(std::vector<std::uint8_t>& image) {
  boot::ImageHeader header;
  if (boot::read_image(image, header) != boot::ImageFinding::none || sodium_init() < 0)
    throw std::runtime_error("the image cannot be signed");
  header.signature_kind = boot::SignatureKind::ed25519;
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
  std::vector<std::uint8_t> message;
  boot::each_signed_part(
      image, [&](std::span<const std::uint8_t> part) { message.insert(message.end(), part.begin(), part.end()); });
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> secret{};
  ed25519::PublicKey key{};
  crypto_sign_seed_keypair(key.data(), secret.data(),
                           reinterpret_cast<const unsigned char*>(boot::kDevelopmentSecret.data()));
  crypto_sign_detached(header.signature.data(), nullptr, message.data(), message.size(), secret.data());
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
}

bool runs_on_twin(std::span<const std::uint8_t> payload) {
  return payload.size() >= kRuns.size() && std::equal(kRuns.begin(), kRuns.end(), payload.begin());
}

}  // namespace flexspline::twin
