#include "host/drive_link/firmware/update.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "host/drive_link/drive/session.hpp"
#include "host/drive_link/firmware/dfu_host.hpp"
#include "host/drive_link/firmware/usb_device.hpp"
#include "host/drive_link/transport/link.hpp"

namespace flexspline::firmware_files {
namespace {

using Clock = std::chrono::steady_clock;
using dfu::DfuError;

constexpr auto kPatience = std::chrono::seconds(60);  // until a device is back, whoever has to plug it in
// New firmware confirms itself after two seconds with a host (firmware/OPERATION.md).
constexpr auto kTrial = std::chrono::seconds(4);
constexpr auto kBetweenLooks = std::chrono::milliseconds(250);

boot::Version version_of(const drive::Session& session) {
  return {session.identity().firmware[0], session.identity().firmware[1]};
}

// Calls `check` until it returns true. False where time ran out.
template <class Check>
bool wait_until(Check check) {
  const auto end = Clock::now() + kPatience;
  while (!check()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(kBetweenLooks);
  }
  return true;
}

bool is_there(const std::string& serial, bool is_loader) {
  const auto all = dfu::find_devices();
  return std::any_of(all.begin(), all.end(), [&](const dfu::Device& d) {
    return d.serial == serial && d.is_loader == is_loader && d.problem.empty();
  });
}

std::optional<boot::Version> installed_version(const std::string& serial) {
  const dfu::OpenDevice loader = dfu::open_device(serial, true);
  const Bytes start = dfu::upload(*loader.pipe, boot::kHeaderBytes, loader.block_bytes);
  boot::ImageHeader header;
  if (boot::read_header(start, header) != boot::ImageFinding::none) return {};
  return header.version;
}

// The drive's version once it answers; none where it does not come back.
std::optional<boot::Version> running_version(const std::string& serial) {
  std::optional<boot::Version> version;
  wait_until([&] {
    try {
      version = version_of(drive::Session(transport::open_link("hid:" + serial)));
    } catch (const std::exception&) {
      // Not there yet, or just starting.
    }
    return version.has_value();
  });
  return version;
}

}  // namespace

std::optional<boot::Version> version_after_trial(const std::function<std::optional<boot::Version>()>& look,
                                                 const std::function<void()>& wait) {
  if (!look()) return {};
  wait();
  return look();
}

Target find_target(const std::string& drive) {
  for (const char* other : {"tcp:", "serial:"})
    if (drive.starts_with(other))
      throw ImageError(fmt::format("{}: firmware goes over USB alone; connect the drive by USB", drive));
  if (drive == "twin" || drive == transport::kThreePhaseTwin)
    throw ImageError(
        "twin: firmware goes over USB alone; start flexspline twin --usbip 3240, attach it (usbip), and leave --drive "
        "away");
  const std::string serial = drive.starts_with("hid:") ? drive.substr(4) : drive;
  std::vector<dfu::Device> matching;
  std::string others;
  for (const dfu::Device& device : dfu::find_devices()) {
    others += (others.empty() ? "" : ", ") + (device.serial.empty() ? "one without a name" : device.serial);
    if (serial.empty() || device.serial == serial || device.serial.empty()) matching.push_back(device);
  }
  const std::string wanted = serial.empty() ? "USB" : serial;
  if (matching.empty())
    throw DfuError(fmt::format(
        "{}: {}; check cable and power", wanted,
        others.empty() ? "neither a drive nor a boot loader is there" : "is not on USB; those that are: " + others));
  if (matching.size() > 1)
    throw DfuError(fmt::format("USB: there is more than one drive ({}); choose one: --drive SERIAL", others));
  const dfu::Device& device = matching.front();
  if (!device.problem.empty())
    throw DfuError(fmt::format("{}: {}", device.serial.empty() ? wanted : device.serial, device.problem));
  Target target{device.serial, device.board, device.is_loader, {}};
  if (device.is_loader) {
    target.version = installed_version(device.serial);
  } else {
    const drive::Session session(transport::open_link("hid:" + device.serial));
    target.board = session.board();
    target.version = version_of(session);
  }
  return target;
}

void require_fit(const Image& image, const Target& target, bool allow_older) {
  if (image.board() != target.board)
    throw ImageError(fmt::format("the image is for board {}, drive {} is a {}; take the image for {}", image.board(),
                                 target.serial, target.board, target.board));
  if (target.version && image.header.version < *target.version && !allow_older)
    throw ImageError(
        fmt::format("the image is of version {}, drive {} has the newer {}; --older flashes it nevertheless",
                    text_of(image.header.version), target.serial, text_of(*target.version)));
}

boot::Version update(const Image& image, const Target& target,
                     const std::function<void(const std::string&)>& progress) {
  if (!target.is_loader) {
    progress("asking the drive for its boot loader");
    if (!dfu::detach(*dfu::open_device(target.serial, false).pipe))
      throw DfuError(
          fmt::format("drive {}: it does not go to its boot loader while it is armed; disarm it, or end the "
                      "program that moves it",
                      target.serial));
    progress("waiting for the boot loader");
    if (!wait_until([&] { return is_there(target.serial, true); }))
      throw DfuError(
          fmt::format("drive {}: its boot loader did not appear within {} s; the firmware is what it was: "
                      "switch the drive off and on (over USB/IP, attach it again) and try again",
                      target.serial, kPatience.count()));
  }
  {
    const dfu::OpenDevice loader = dfu::open_device(target.serial, true);
    dfu::download(*loader.pipe, image.bytes, loader.block_bytes, [&](std::size_t sent) {
      progress(
          fmt::format("sending: {} of {} bytes ({} %)", sent, image.bytes.size(), 100 * sent / image.bytes.size()));
    });
  }
  progress("waiting for the drive to start it");
  const auto version = version_after_trial([&] { return running_version(target.serial); },
                                           [&] {
                                             progress("waiting for the end of its trial");
                                             std::this_thread::sleep_for(kTrial);
                                           });
  if (!version)
    throw DfuError(
        fmt::format("drive {}: the image arrived whole, but the drive did not come back within {} s; switch "
                    "it off and on (over USB/IP, attach it again) and check with flexspline drives",
                    target.serial, kPatience.count()));
  return *version;
}

}  // namespace flexspline::firmware_files
