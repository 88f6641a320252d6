// Drives and boot loaders on USB, as far as firmware updates go, by libusb.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "host/drive_link/firmware/dfu_host.hpp"

namespace flexspline::dfu {

// A device with a DFU interface of ours.
struct Device {
  std::string serial;  // empty: it may not be opened
  bool is_loader = false;
  std::string board;    // of a boot loader; an application sends it by its own protocol
  std::string problem;  // why it cannot be used, and what to do
};
// Those on the bus now.
std::vector<Device> find_devices();

struct OpenDevice {
  std::unique_ptr<Pipe> pipe;
  std::size_t block_bytes = 0;  // that it takes at once
};
// The one of that serial number and kind. Throws DfuError where it is not there or cannot be opened.
OpenDevice open_device(const std::string& serial, bool is_loader);

}  // namespace flexspline::dfu
