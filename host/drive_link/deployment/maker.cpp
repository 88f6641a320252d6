#include "host/drive_link/deployment/maker.hpp"

#include "host/common/text/build_identity.hpp"
#include "shared/model/block.hpp"

namespace flexspline::deployment {

std::vector<std::uint8_t> maker_note() {
  const std::string& name = text::tool_name();
  return {name.begin(), name.end()};
}

std::string maker_of(std::span<const std::uint8_t> block) {
  std::string maker;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind == kMakerNote) maker.assign(bytes.begin(), bytes.end());
  });
  return maker;
}

}  // namespace flexspline::deployment
