#include "hil/twin/factory_block.hpp"

#include <algorithm>
#include <span>
#include <string>

#include "hil/board/controller.hpp"
#include "hil/board/drive_setup.hpp"
#include "shared/model/block.hpp"

namespace flexspline::twin {

namespace {

// The block of the drive's parameters has no names.
void set_name(std::span<std::uint8_t> block, std::size_t at, const std::string& name) {
  constexpr std::size_t kMost = sizeof(model::Name) - 1;
  std::copy_n(name.begin(), std::min(name.size(), kMost), block.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace

std::vector<std::uint8_t> factory_block(const plant::Drive& drive) {
  return factory_block(drive, board::setup_of(drive));
}

std::vector<std::uint8_t> factory_block(const plant::Drive& drive, const control::DriveSetup<double>& setup) {
  const board::Block made(board::parameters_of(drive, setup), board::constants_of(drive, setup.tick_hz));
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(made.bytes().data());
  std::vector<std::uint8_t> block(bytes, bytes + made.bytes().size());
  set_name(block, model::detail::kBlockStart, drive.name);
  set_name(block, model::detail::kBlockStart + sizeof(model::Name), "as made");
  const auto checked = std::span<std::uint8_t>(block).first(block.size() - model::detail::kChecksum);
  model::Writer end(std::span<std::uint8_t>(block).last(model::detail::kChecksum));
  end.put(model::crc32(checked));
  return block;
}

}  // namespace flexspline::twin
