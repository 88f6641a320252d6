#include "hil/twin/factory_block.hpp"

#include "hil/board/brain.hpp"
#include "hil/board/drive_setup.hpp"

namespace flexspline::twin {

std::vector<std::uint8_t> factory_block(const plant::Drive& drive) {
  const effects::DriveConstants<double> d = board::constants_of(drive);
  const board::Block block(board::parameters_of(drive, board::setup_of(drive, d)), d);
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(block.bytes().data());
  return {bytes, bytes + block.bytes().size()};
}

}  // namespace flexspline::twin
