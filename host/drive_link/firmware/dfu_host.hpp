// The host's half of DFU 1.1: a download with its polling, an upload, over any control pipe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "shared/usb/dfu.hpp"

namespace flexspline::dfu {

using Bytes = std::vector<std::uint8_t>;

// What a device refused, or that it is gone: where, what, what to do.
class DfuError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Control transfers with the DFU interface of one device.
class Pipe {
 public:
  virtual ~Pipe() = default;
  // Class requests to the interface. False: the device answered STALL. Throw DfuError where it is gone.
  virtual bool out(usb::DfuRequest request, std::uint16_t value, std::span<const std::uint8_t> data) = 0;
  virtual bool in(usb::DfuRequest request, std::uint16_t value, std::size_t length, Bytes& data) = 0;
  virtual void wait_ms(std::uint32_t time) = 0;
  // As a person knows the device.
  virtual std::string name() const = 0;
};

struct DeviceStatus {
  usb::DfuStatus status{};
  usb::DfuState state{};
  std::uint32_t poll_ms = 0;
};
// Throws DfuError where the device does not answer as it has to.
DeviceStatus get_status(Pipe& pipe);

// What a status means, and what to do.
std::string text_of(usb::DfuStatus status);

// Sends an image in blocks of `block_bytes` and has it installed. progress(bytes taken) may throw to cancel. Throws
// DfuError with the device's reason.
void download(Pipe& pipe, std::span<const std::uint8_t> image, std::size_t block_bytes,
              const std::function<void(std::size_t)>& progress);
// The first so many bytes of what is installed; less where there are less, none where the device has nothing.
Bytes upload(Pipe& pipe, std::size_t bytes, std::size_t block_bytes);
// Asks an application for its boot loader. False: it refuses, as one that is armed does.
bool detach(Pipe& pipe);

}  // namespace flexspline::dfu
