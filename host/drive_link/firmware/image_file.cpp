#include "host/drive_link/firmware/image_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <iterator>
#include <span>

#include "shared/usb/identity.hpp"

namespace flexspline::firmware_files {
namespace {

constexpr std::size_t kSuffixBytes = 16;
// No microcontroller of this kind has more; a wrong path may name anything.
constexpr std::size_t kLongest = 4'000'000;

// The checksum of a DFU file is that of Ethernet without the last inversion.
std::uint32_t suffix_crc(std::span<const std::uint8_t> bytes) {
  return ~model::crc32(bytes);
}

// Takes a DFU suffix off, if there is one.
void take_suffix(Bytes& bytes, const std::string& origin) {
  if (bytes.size() < kSuffixBytes) return;
  const std::span suffix = std::span(bytes).last(kSuffixBytes);
  if (suffix[8] != 'U' || suffix[9] != 'F' || suffix[10] != 'D' || suffix[11] != kSuffixBytes) return;
  model::Reader r(suffix.last(4));
  if (r.take<std::uint32_t>() != suffix_crc(std::span(bytes).first(bytes.size() - 4)))
    throw ImageError(fmt::format("{}: its DFU suffix has a wrong checksum (CRC); fetch or make it again", origin));
  bytes.resize(bytes.size() - kSuffixBytes);
}

}  // namespace

Image parse_image(Bytes bytes, const std::string& origin) {
  if (bytes.empty()) throw ImageError(fmt::format("{}: the file is empty", origin));
  take_suffix(bytes, origin);
  Image image{std::move(bytes), {}};
  const auto refuse = [&](const std::string& why) { throw ImageError(origin + ": " + why); };
  switch (boot::read_image(image.bytes, image.header)) {
    case boot::ImageFinding::none:
      break;
    case boot::ImageFinding::no_image:
      refuse("is not a firmware image; flexspline image makes one of a program (BIN file)");
      break;
    case boot::ImageFinding::unknown_format:
      refuse("is an image of a newer format; take a newer flexspline");
      break;
    case boot::ImageFinding::incomplete:
      if (image.bytes.size() < boot::kHeaderBytes)
        refuse(fmt::format("is truncated: it has {} bytes, its header alone {}; fetch or make it again",
                           image.bytes.size(), boot::kHeaderBytes));
      refuse(fmt::format("is truncated: it has {} bytes, and its header states {}; fetch or make it again",
                         image.bytes.size(), image.header.whole_bytes()));
      break;
    case boot::ImageFinding::damaged_header:
      refuse("is damaged: the checksum of its header is wrong; fetch or make it again");
      break;
    default:
      refuse("is damaged: the checksum (CRC-32) of its program is wrong; fetch or make it again");
  }
  if (image.bytes.size() != image.header.whole_bytes())
    refuse(fmt::format("has {} bytes behind the {} that its header states; is it two files in one?",
                       image.bytes.size() - image.header.whole_bytes(), image.header.whole_bytes()));
  return image;
}

Image load_image(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path))
    throw ImageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  Bytes bytes(kLongest + 1);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  if (bytes.size() > kLongest) throw ImageError(fmt::format("{}: is too long for a firmware image", path.string()));
  return parse_image(std::move(bytes), path.string());
}

Bytes make_image(const Bytes& program, const std::string& board, boot::Version version) {
  if (program.empty()) throw ImageError("the program is empty");
  if (program.size() > kLongest) throw ImageError("the program is too long; is it a BIN file, and no ELF file?");
  if (program.size() >= 4 && program[0] == 0x7F && program[1] == 'E' && program[2] == 'L' && program[3] == 'F')
    throw ImageError("the program is an ELF file; make a BIN file of it: arm-none-eabi-objcopy -O binary IN OUT");
  if (board.empty() || board.size() >= boot::kBoardBytes)
    throw ImageError(fmt::format("'{}' is no name of a board: 1 to {} letters", board, boot::kBoardBytes - 1));
  boot::ImageHeader header;
  header.bytes = static_cast<std::uint32_t>(program.size());
  header.crc = model::crc32(program);
  header.board = boot::board_bytes(board);
  header.version = version;
  Bytes image(boot::kHeaderBytes + program.size());
  boot::write_header(std::span(image).first<boot::kHeaderBytes>(), header);
  std::copy(program.begin(), program.end(), image.begin() + static_cast<std::ptrdiff_t>(boot::kHeaderBytes));
  return image;
}

Bytes with_dfu_suffix(Bytes image) {
  constexpr auto kVendor = usb::FlexsplineIdentity::kVendorId;
  // Any release, and any product of ours: the application and the boot loader have different ones.
  for (const int byte : {0xFF, 0xFF, 0xFF, 0xFF, kVendor & 0xFF, kVendor >> 8, 0x00, 0x01, int{'U'}, int{'F'}, int{'D'},
                         static_cast<int>(kSuffixBytes)})
    image.push_back(static_cast<std::uint8_t>(byte));
  const std::uint32_t crc = suffix_crc(image);
  for (int shift = 0; shift < 32; shift += 8) image.push_back(static_cast<std::uint8_t>(crc >> shift));
  return image;
}

std::string text_of(boot::Version version) {
  return fmt::format("{}.{}", version.major, version.minor);
}

boot::Version version_of(const std::string& text) {
  const std::size_t point = std::min(text.find('.'), text.size());
  const auto part = [&](std::size_t from, std::size_t to) -> int {
    int value = -1;
    const auto [end, error] = std::from_chars(text.data() + from, text.data() + to, value);
    return error == std::errc() && end == text.data() + to && value >= 0 && value <= 255 ? value : -1;
  };
  const int major = part(0, point);
  const int minor = point < text.size() ? part(point + 1, text.size()) : -1;
  if (major < 0 || minor < 0)
    throw ImageError(fmt::format("'{}' is no version; write two numbers up to 255, as 1.2", text));
  return {static_cast<std::uint8_t>(major), static_cast<std::uint8_t>(minor)};
}

}  // namespace flexspline::firmware_files
