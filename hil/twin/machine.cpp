#include "hil/twin/machine.hpp"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "hil/usbip/core_device.hpp"
#include "shared/usb/identity.hpp"

namespace flexspline::twin {
namespace {

using Dfu = Machine::Loader::Dfu;

// The boot loader's device on the bus; its memory is written between two packets.
using Connector = usbip::ResetNotingDevice<usbip::CoreDevice<usb::LoaderIdentity, Dfu>, true>;

bool is_blank(const ImageFlash& flash) {
  for (std::size_t s = 0; s < boot::kImageSectors; ++s)
    if (!std::ranges::all_of(flash.bytes(s), [](std::uint8_t byte) { return byte == 0xFF; })) return false;
  return true;
}

}  // namespace

Machine::Machine(const std::filesystem::path& file, bool as_made)
    : board_{.flash = ImageFlash(file)}, slots_(board_.flash, LoaderBoard::kName) {
  if (!as_made || !is_blank(board_.flash)) return;
  const std::vector<std::uint8_t> image = twin_image({});
  const std::span<const std::uint8_t> bytes(image);
  for (std::size_t at = 0; at < bytes.size(); at += 4) {
    model::Reader word(bytes.subspan(at, 4));
    board_.flash.program(static_cast<std::size_t>(boot::Slot::application), at / 4, word.take<std::uint32_t>());
  }
}

bool Machine::start() {
  loader_.emplace(board_);
  if (loader_->start() == boot::Start::none) return false;
  const auto image = slots_.image(boot::Slot::application);
  boot::ImageHeader header;
  if (boot::read_image(image, header) != boot::ImageFinding::none) return false;
  version_ = header.version;
  hangs_ = !runs_on_twin(image.subspan(boot::kHeaderBytes));
  return true;
}

void Machine::serve_loader(usbip::Server& bus, std::string_view bus_id, const std::string& serial,
                           const std::function<bool()>& over) {
  using Clock = std::chrono::steady_clock;
  Connector connector(serial);
  auto& dfu = connector.device.get<Dfu>();
  loader_->serve(dfu);
  bus.plug(bus_id, connector);
  connector.was_reset = false;
  const auto since = Clock::now();
  const auto now_ms = [&] {
    return static_cast<std::uint32_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - since).count());
  };
  while (!over() && !loader_->poll(dfu, std::exchange(connector.was_reset, false), now_ms())) bus.serve(5);
  bus.unplug(bus_id);
}

}  // namespace flexspline::twin
