// Drives on USB, by hidapi. The program is linked to one of its back ends, hidraw (Debian's default here) or libusb;
// both behave the same, except for a device without permission.
#include <fmt/format.h>
#include <hidapi/hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <span>
#include <string>
#include <thread>

#include "host/drive_link/transport/link.hpp"
#include "shared/usb/identity.hpp"

namespace flexspline::transport {
namespace {

using Identity = usb::FlexsplineIdentity;
constexpr const char* kNotAllowed =
    "your user may not open it: sudo cp 70-flexspline.rules /etc/udev/rules.d/ && sudo udevadm control --reload, then "
    "plug the drive in again (the file is in host/drive_link/drive)";

// What may help where a drive that is there cannot be opened. hidapi does not report why; root is allowed everything.
const char* remedy() {
  return geteuid() == 0 ? "plug it in again, and end other programs that use it" : kNotAllowed;
}

std::string narrow(const wchar_t* text) {
  std::string out;
  for (; text != nullptr && *text != L'\0'; ++text) out += *text > 0 && *text < 128 ? static_cast<char>(*text) : '?';
  return out;
}

// As --drive takes it. A user who may not open a drive may not read its serial number either, with libusb.
std::string drive_named(const std::string& serial) {
  return serial.empty() ? "USB" : "hid:" + serial;
}

// hidapi's own state, which has to be there as long as a device is open.
void start() {
  if (hid_init() != 0) throw LinkError("USB: hidapi cannot be started; is /sys mounted?");
}

class Hid : public Link {
 public:
  Hid(hid_device* device, std::string serial) : device_(device), serial_(std::move(serial)) {}
  ~Hid() override { hid_close(device_); }
  Hid(const Hid&) = delete;
  Hid& operator=(const Hid&) = delete;

  void send(const protocol::Message& m) override {
    // The first byte is the number of the report; drives have none.
    std::array<std::uint8_t, protocol::kReportBytes + 1> bytes{};
    const protocol::Report report = protocol::encode(m);
    std::copy(report.begin(), report.end(), bytes.begin() + 1);
    if (hid_write(device_, bytes.data(), bytes.size()) < 0) gone();
  }
  std::optional<protocol::Message> receive(Milliseconds limit) override {
    protocol::Report report{};
    const int got = hid_read_timeout(device_, report.data(), report.size(), static_cast<int>(limit.count()));
    if (got < 0) gone();
    protocol::Message m;
    if (got == 0 || !protocol::decode(std::span(report).first(static_cast<std::size_t>(got)), m)) return {};
    return m;
  }
  std::string name() const override { return "hid:" + serial_; }

 private:
  [[noreturn]] void gone() const {
    // The libusb back end before hidapi 0.14 knows no reasons.
    std::string why = narrow(hid_error(device_));
    if (why.empty() || why.find("not implemented") != std::string::npos) why = "USB lost it";
    throw LinkError(fmt::format("{}: the drive is gone ({}); plug it in again and try again", name(), why));
  }
  hid_device* device_;
  std::string serial_;
};

// A plug that is pulled during the search leaves a device that hides its serial number and cannot be opened; for a
// moment it is listed still. A machine that has much to do takes its time.
bool is_there(const std::string& path) {
  constexpr std::chrono::milliseconds kStep{100};
  constexpr int kSteps = 10;
  bool found = true;
  for (int k = 0; k < kSteps && found; ++k) {
    std::this_thread::sleep_for(kStep);
    hid_device_info* all = hid_enumerate(Identity::kVendorId, Identity::kProductId);
    found = false;
    for (const hid_device_info* one = all; one != nullptr; one = one->next) found = found || path == one->path;
    hid_free_enumeration(all);
  }
  return found;
}

}  // namespace

std::vector<Found> find_hid() {
  start();
  std::vector<Found> found;
  hid_device_info* all = hid_enumerate(Identity::kVendorId, Identity::kProductId);
  for (const hid_device_info* one = all; one != nullptr; one = one->next) {
    const std::string serial = narrow(one->serial_number);
    Found drive{drive_named(serial), narrow(one->product_string) + " on USB, " + one->path, true, {}};
    if (hid_device* device = hid_open_path(one->path)) {
      hid_close(device);
    } else {
      drive.usable = false;
      drive.problem = is_there(one->path) ? remedy() : "it is gone; plug it in again";
    }
    found.push_back(std::move(drive));
  }
  hid_free_enumeration(all);
  return found;
}

std::unique_ptr<Link> open_hid(const std::string& serial) {
  start();
  hid_device_info* all = hid_enumerate(Identity::kVendorId, Identity::kProductId);
  std::string path, its_serial, others;
  std::size_t count = 0;
  std::string hidden;  // where a drive is that hides its serial number
  for (const hid_device_info* one = all; one != nullptr; one = one->next) {
    const std::string this_serial = narrow(one->serial_number);
    if (this_serial.empty()) hidden = one->path;
    others += (others.empty() ? "" : ", ") + this_serial;
    if (!serial.empty() && this_serial != serial) continue;
    path = one->path;
    its_serial = this_serial;
    ++count;
  }
  hid_free_enumeration(all);
  if (count == 0 && !hidden.empty() && !is_there(hidden))
    throw LinkError(fmt::format("{}: the drive is gone; plug it in again and try again", drive_named(serial)));
  if (count == 0 && !hidden.empty())
    throw LinkError(fmt::format("hid:{}: a drive on USB does not send its serial number; {}", serial, remedy()));
  if (count == 0) {
    const std::string there = others.empty() ? "no drive is on USB" : "those on USB are " + others;
    throw LinkError(
        fmt::format("{}: {}; check cable and power, or use --drive twin without hardware", drive_named(serial), there));
  }
  if (count > 1)
    throw LinkError(fmt::format("USB: there is more than one drive ({}); choose one: --drive SERIAL", others));
  hid_device* device = hid_open_path(path.c_str());
  if (device == nullptr && !is_there(path))
    throw LinkError(fmt::format("{}: the drive is gone; plug it in again and try again", drive_named(its_serial)));
  if (device == nullptr)
    throw LinkError(fmt::format("{}: {} cannot be opened; {}", drive_named(its_serial), path, remedy()));
  return std::make_unique<Hid>(device, its_serial);
}

}  // namespace flexspline::transport
