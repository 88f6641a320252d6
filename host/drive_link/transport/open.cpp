#include "host/drive_link/transport/link.hpp"

namespace flexspline::transport {
namespace {

// What follows `prefix`, if the text begins so.
std::optional<std::string> behind(const std::string& text, const std::string& prefix) {
  if (!text.starts_with(prefix)) return {};
  return text.substr(prefix.size());
}

}  // namespace

std::unique_ptr<Link> open_link(const std::string& drive) {
  if (drive == "twin" || drive == kThreePhaseTwin) return open_twin(drive == kThreePhaseTwin);
  if (const auto port = behind(drive, "serial:")) return open_serial(*port);
  if (const auto address = behind(drive, "tcp:")) return open_tcp(*address);
  if (const auto serial = behind(drive, "hid:")) return open_hid(*serial);
  return open_hid(drive);
}

std::vector<Found> find_drives() {
  return find_hid();
}

}  // namespace flexspline::transport
