#include "hil/usbip/bus.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace flexspline::usbip {
namespace {

std::uint16_t number(std::string_view text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : std::uint16_t{0};
}

}  // namespace

void Bus::plug(std::string_view bus_id, BusDevice& device) {
  const std::size_t dash = std::min(bus_id.find('-'), bus_id.size());
  const std::uint16_t bus = number(bus_id.substr(0, dash));
  const std::uint16_t port = dash < bus_id.size() ? number(bus_id.substr(dash + 1)) : std::uint16_t{0};
  const std::string id(bus_id);
  if (bus == 0 || port == 0 || port > 127)
    throw std::invalid_argument("'" + id + "' is not a bus id; write bus and port, such as 1-1");
  if (find(id)) throw std::invalid_argument("bus id " + id + " is in use; unplug that device first");
  auto slot = std::make_shared<Slot>(id, bus, port, device);
  if (!slot->host.enumerate())
    throw std::invalid_argument("the device for bus id " + id + " does not answer a host's first requests");
  slot->host.release();
  slots_.push_back(std::move(slot));
}

bool Bus::unplug(std::string_view bus_id) {
  const auto found = std::find_if(slots_.begin(), slots_.end(), [&](const auto& s) { return s->bus_id == bus_id; });
  if (found == slots_.end()) return false;
  (*found)->plugged = false;
  (*found)->host.release();
  slots_.erase(found);
  return true;
}

std::shared_ptr<Slot> Bus::find(std::string_view bus_id) const {
  for (const auto& slot : slots_)
    if (slot->bus_id == bus_id) return slot;
  return nullptr;
}

}  // namespace flexspline::usbip
