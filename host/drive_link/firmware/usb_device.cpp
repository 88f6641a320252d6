#include "host/drive_link/firmware/usb_device.hpp"

#include <fmt/format.h>
#include <libusb-1.0/libusb.h>

#include <array>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "shared/usb/identity.hpp"

namespace flexspline::dfu {
namespace {

constexpr unsigned kTimeoutMs = 10'000;  // of one transfer: an erase may keep the processor from answering
constexpr const char* kRemedy =
    "your user may not open it: sudo cp 70-flexspline.rules /etc/udev/rules.d/ && sudo udevadm control --reload, then "
    "plug the drive in again (the file is in host/drive_link/drive)";

struct Exit {
  void operator()(libusb_context* context) const { libusb_exit(context); }
};
struct Close {
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
using Context = std::unique_ptr<libusb_context, Exit>;
using Handle = std::unique_ptr<libusb_device_handle, Close>;

// Each query of the bus has its own: a context learns of devices that come later from the udev daemon alone, which need
// not run.
Context new_context() {
  libusb_context* context = nullptr;
  if (const int error = libusb_init(&context); error != 0)
    throw DfuError(fmt::format("USB: libusb cannot be started ({})", libusb_error_name(error)));
  return Context(context);
}

std::string text_at(libusb_device_handle* handle, std::uint8_t index) {
  std::array<unsigned char, 128> text{};
  if (index == 0) return {};
  const int n = libusb_get_string_descriptor_ascii(handle, index, text.data(), static_cast<int>(text.size()));
  return n > 0 ? std::string(reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(n)) : std::string();
}

// Its DFU interface.
struct Place {
  bool found = false;
  int interface = 0;
  std::uint8_t string = 0;
  std::size_t block_bytes = 64;
};
Place dfu_place(libusb_device* device, bool is_loader) {
  Place place;
  libusb_config_descriptor* configuration = nullptr;
  if (libusb_get_active_config_descriptor(device, &configuration) != 0 &&
      libusb_get_config_descriptor(device, 0, &configuration) != 0)
    return place;
  const auto protocol = is_loader ? usb::kDfuModeProtocol : usb::kDfuRuntimeProtocol;
  for (int i = 0; i < configuration->bNumInterfaces && !place.found; ++i) {
    const libusb_interface& interface = configuration->interface[i];
    if (interface.num_altsetting < 1) continue;
    const libusb_interface_descriptor& d = interface.altsetting[0];
    if (d.bInterfaceClass != usb::kDfuClass || d.bInterfaceSubClass != usb::kDfuSubclass ||
        d.bInterfaceProtocol != protocol)
      continue;
    place = {true, d.bInterfaceNumber, d.iInterface, 64};
    if (d.extra_length >= usb::kDfuDescriptorBytes && d.extra[1] == usb::kDfuDescriptorType)
      place.block_bytes = static_cast<std::size_t>(d.extra[5] | d.extra[6] << 8);
  }
  libusb_free_config_descriptor(configuration);
  if (place.block_bytes == 0) place.block_bytes = 64;
  return place;
}

// Calls `use(device, descriptor, is a boot loader)` for each of ours.
void for_each_device(libusb_context* context,
                     const std::function<void(libusb_device*, const libusb_device_descriptor&, bool)>& use) {
  libusb_device** list = nullptr;
  const ssize_t count = libusb_get_device_list(context, &list);
  if (count < 0) throw DfuError(fmt::format("USB: {}; is /sys mounted?", libusb_error_name(static_cast<int>(count))));
  for (ssize_t i = 0; i < count; ++i) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(list[i], &descriptor) != 0) continue;
    const bool is_loader = descriptor.idProduct == usb::LoaderIdentity::kProductId;
    if (descriptor.idVendor == usb::FlexsplineIdentity::kVendorId &&
        (is_loader || descriptor.idProduct == usb::FlexsplineIdentity::kProductId))
      use(list[i], descriptor, is_loader);
  }
  libusb_free_device_list(list, 1);
}

class UsbPipe : public Pipe {
 public:
  UsbPipe(Context context, Handle handle, int interface, std::string name)
      : context_(std::move(context)), handle_(std::move(handle)), interface_(interface), name_(std::move(name)) {}
  ~UsbPipe() override { libusb_release_interface(handle_.get(), interface_); }
  UsbPipe(const UsbPipe&) = delete;
  UsbPipe& operator=(const UsbPipe&) = delete;

  bool out(usb::DfuRequest request, std::uint16_t value, std::span<const std::uint8_t> data) override {
    Bytes copy(data.begin(), data.end());
    return transfer(LIBUSB_ENDPOINT_OUT, request, value, copy) >= 0;
  }
  bool in(usb::DfuRequest request, std::uint16_t value, std::size_t length, Bytes& data) override {
    data.assign(length, 0);
    const int n = transfer(LIBUSB_ENDPOINT_IN, request, value, data);
    data.resize(n < 0 ? 0 : static_cast<std::size_t>(n));
    return n >= 0;
  }
  void wait_ms(std::uint32_t time) override { std::this_thread::sleep_for(std::chrono::milliseconds(time)); }
  std::string name() const override { return name_; }

 private:
  // Bytes that went, or below zero where the device answered STALL.
  int transfer(libusb_endpoint_direction direction, usb::DfuRequest request, std::uint16_t value, Bytes& data) {
    const auto type = static_cast<std::uint8_t>(static_cast<unsigned>(direction) | LIBUSB_REQUEST_TYPE_CLASS |
                                                LIBUSB_RECIPIENT_INTERFACE);
    const int n = libusb_control_transfer(handle_.get(), type, static_cast<std::uint8_t>(request), value,
                                          static_cast<std::uint16_t>(interface_), data.data(),
                                          static_cast<std::uint16_t>(data.size()), kTimeoutMs);
    if (n < 0 && n != LIBUSB_ERROR_PIPE)
      throw DfuError(
          fmt::format("{}: USB lost it ({}); plug it in again, or switch the drive off and on, and try again", name_,
                      libusb_error_name(n)));
    return n;
  }
  Context context_;
  Handle handle_;
  int interface_;
  std::string name_;
};

}  // namespace

std::vector<Device> find_devices() {
  const Context context = new_context();
  std::vector<Device> found;
  for_each_device(context.get(), [&](libusb_device* usb, const libusb_device_descriptor& descriptor, bool is_loader) {
    Device device;
    device.is_loader = is_loader;
    const Place place = dfu_place(usb, is_loader);
    libusb_device_handle* opened = nullptr;
    const int error = libusb_open(usb, &opened);
    const Handle handle(opened);
    if (error != 0) {
      device.problem = error == LIBUSB_ERROR_ACCESS ? kRemedy : "it is gone; plug it in again";
    } else {
      device.serial = text_at(opened, descriptor.iSerialNumber);
      if (is_loader) device.board = text_at(opened, place.string);
      if (!place.found)
        device.problem =
            "its firmware is too old to be updated over USB; flash it once over SWD, as the page of its board "
            "describes";
    }
    found.push_back(std::move(device));
  });
  return found;
}

OpenDevice open_device(const std::string& serial, bool is_loader) {
  Context context = new_context();
  const std::string name = (is_loader ? "boot loader of " : "drive ") + serial;
  Handle handle;
  Place place;
  std::string problem = "is not on USB; check cable and power";
  for_each_device(context.get(), [&](libusb_device* usb, const libusb_device_descriptor& descriptor, bool loader) {
    if (loader != is_loader || handle != nullptr) return;
    libusb_device_handle* opened = nullptr;
    const int error = libusb_open(usb, &opened);
    Handle candidate(opened);
    if (error == LIBUSB_ERROR_ACCESS) problem = std::string("cannot be opened; ") + kRemedy;
    if (error != 0 || text_at(opened, descriptor.iSerialNumber) != serial) return;
    place = dfu_place(usb, is_loader);
    if (place.found) handle = std::move(candidate);
  });
  if (handle == nullptr) throw DfuError(name + ": " + problem);
  if (const int error = libusb_claim_interface(handle.get(), place.interface); error != 0)
    throw DfuError(fmt::format("{}: is in use ({}); end the program that updates it, dfu-util perhaps", name,
                               libusb_error_name(error)));
  OpenDevice opened;
  opened.block_bytes = place.block_bytes;
  opened.pipe = std::make_unique<UsbPipe>(std::move(context), std::move(handle), place.interface, name);
  return opened;
}

}  // namespace flexspline::dfu
