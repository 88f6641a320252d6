// A firmware image: a header of 512 bytes, then the program. README.md has the layout. All code that makes, sends,
// stores or starts an image uses these functions.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/boot/signature/ed25519.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::boot {

// The alignment that a Cortex-M needs for its vectors, which begin directly after it.
inline constexpr std::size_t kHeaderBytes = 512;
inline constexpr std::uint32_t kImageMagic = 0x4D495846;  // "FXIM"
inline constexpr std::uint16_t kImageFormat = 1;
inline constexpr std::size_t kBoardBytes = 16;  // its name, followed by at least one zero
// Where a header has its signature: README.md has the layout.
inline constexpr std::size_t kSignatureAt = 40, kHeaderCrcAt = kHeaderBytes - 4;
// Numbers, as headers have them; another way of signing gets another number.
enum class SignatureKind : std::uint32_t { none, ed25519 };

// As a drive reports it to hosts.
struct Version {
  std::uint8_t major = 0;
  std::uint8_t minor = 0;
  constexpr auto operator<=>(const Version&) const = default;
};

struct ImageHeader {
  std::uint32_t bytes = 0;  // after the header
  std::uint32_t crc = 0;    // CRC-32 of these
  std::array<std::uint8_t, kBoardBytes> board{};
  Version version{};
  SignatureKind signature_kind = SignatureKind::none;
  ed25519::Signature signature{};
  // Raised where an image closes a hole in security: a drive takes none with a smaller one than it has run.
  std::uint16_t security_counter = 0;

  constexpr std::size_t whole_bytes() const { return kHeaderBytes + bytes; }
  std::string_view board_name() const {
    std::size_t n = 0;
    while (n < kBoardBytes && board[n] != 0) ++n;
    return {reinterpret_cast<const char*>(board.data()), n};
  }
};

enum class ImageFinding : std::uint8_t {
  none,
  no_image,        // it does not begin with the magic number
  unknown_format,  // made by a newer tool
  damaged_header,
  incomplete,  // shorter than its header says
  too_long,    // longer than that, or than the slot
  damaged,     // the checksum differs
  wrong_board,
  not_signed,   // by the key that this boot loader has
  rolled_back,  // its security counter is smaller than that of an image which the drive has confirmed
};

// A longer name is not accepted: it has at most fifteen letters.
constexpr std::array<std::uint8_t, kBoardBytes> board_bytes(std::string_view name) {
  std::array<std::uint8_t, kBoardBytes> bytes{};
  for (std::size_t i = 0; i + 1 < kBoardBytes && i < name.size(); ++i) bytes[i] = static_cast<std::uint8_t>(name[i]);
  return bytes;
}

constexpr void write_header(std::span<std::uint8_t, kHeaderBytes> room, const ImageHeader& header) {
  for (std::uint8_t& byte : room) byte = 0;
  model::Writer w(room);
  w.put(kImageMagic);
  w.put(kImageFormat);
  w.put(static_cast<std::uint16_t>(kHeaderBytes));
  w.put(header.bytes);
  w.put(header.crc);
  for (const std::uint8_t byte : header.board) w.put(byte);
  w.put(header.version.major);
  w.put(header.version.minor);
  w.put(std::uint16_t{0});
  w.put(static_cast<std::uint32_t>(header.signature_kind));
  for (const std::uint8_t byte : header.signature) w.put(byte);
  w.put(header.security_counter);
  const std::uint32_t crc = model::crc32(room.first(kHeaderCrcAt));
  model::Writer end(room.subspan(kHeaderCrcAt));
  end.put(crc);
}

// Reads the header only: the data after it may be missing. `header` is valid where the finding is none.
constexpr ImageFinding read_header(std::span<const std::uint8_t> bytes, ImageHeader& header) {
  model::Reader r(bytes);
  if (bytes.size() < 4 || r.take<std::uint32_t>() != kImageMagic) return ImageFinding::no_image;
  if (bytes.size() < kHeaderBytes) return ImageFinding::incomplete;
  model::Reader end(bytes.subspan(kHeaderCrcAt, 4));
  if (end.take<std::uint32_t>() != model::crc32(bytes.first(kHeaderCrcAt))) return ImageFinding::damaged_header;
  if (r.take<std::uint16_t>() != kImageFormat || r.take<std::uint16_t>() != kHeaderBytes)
    return ImageFinding::unknown_format;
  header.bytes = r.take<std::uint32_t>();
  header.crc = r.take<std::uint32_t>();
  for (std::uint8_t& byte : header.board) byte = r.take<std::uint8_t>();
  header.version.major = r.take<std::uint8_t>();
  header.version.minor = r.take<std::uint8_t>();
  r.skip(2);
  header.signature_kind = static_cast<SignatureKind>(r.take<std::uint32_t>());
  for (std::uint8_t& byte : header.signature) byte = r.take<std::uint8_t>();
  header.security_counter = r.take<std::uint16_t>();
  // So that no sum of lengths overflows.
  return header.bytes == 0 || header.bytes > 0x7FFFFFFF - kHeaderBytes ? ImageFinding::damaged_header
                                                                       : ImageFinding::none;
}

// The same, and whether it is for this board and fits the slot.
constexpr ImageFinding check_header(std::span<const std::uint8_t> bytes, std::string_view board, std::size_t room,
                                    ImageHeader& header) {
  const ImageFinding finding = read_header(bytes, header);
  if (finding != ImageFinding::none) return finding;
  if (header.board != board_bytes(board)) return ImageFinding::wrong_board;
  return header.whole_bytes() > room ? ImageFinding::too_long : ImageFinding::none;
}

// A whole image for any board at the start of `bytes`; the bytes after it are ignored.
constexpr ImageFinding read_image(std::span<const std::uint8_t> bytes, ImageHeader& header) {
  const ImageFinding finding = read_header(bytes, header);
  if (finding != ImageFinding::none) return finding;
  if (header.whole_bytes() > bytes.size()) return ImageFinding::incomplete;
  return model::crc32(bytes.subspan(kHeaderBytes, header.bytes)) == header.crc ? ImageFinding::none
                                                                               : ImageFinding::damaged;
}

// Calls take() with the parts of what is signed, one after the other: the whole image, with zeros for the signature and
// for the header's checksum, which covers it.
template <class Take>
constexpr void each_signed_part(std::span<const std::uint8_t> image, Take take) {
  constexpr std::array<std::uint8_t, ed25519::kSignatureBytes> kZeros{};
  constexpr std::size_t kBehind = kSignatureAt + ed25519::kSignatureBytes;
  take(image.first(kSignatureAt));
  take(std::span<const std::uint8_t>(kZeros));
  take(image.subspan(kBehind, kHeaderCrcAt - kBehind));
  take(std::span<const std::uint8_t>(kZeros).first(kHeaderBytes - kHeaderCrcAt));
  take(image.subspan(kHeaderBytes));
}

// Which images are taken and started, beyond their checksum. Those that this key has signed:
template <const ed25519::PublicKey& key>
struct SignedBy {
  static constexpr bool may_accept(const ImageHeader& header) {
    return header.signature_kind == SignatureKind::ed25519;
  }
  // `image` is whole, with nothing behind it, and has this header.
  static constexpr bool accepts(std::span<const std::uint8_t> image, const ImageHeader& header) {
    if (!may_accept(header)) return false;
    ed25519::Verification verification(key, header.signature);
    each_signed_part(image, [&](std::span<const std::uint8_t> part) { verification.add(part); });
    return verification.is_valid();
  }
};
// All, for what does not decide: the application reads its slots as well, to confirm itself.
struct AnySigner {
  static constexpr bool may_accept(const ImageHeader&) { return true; }
  static constexpr bool accepts(std::span<const std::uint8_t>, const ImageHeader&) { return true; }
};

}  // namespace flexspline::boot
