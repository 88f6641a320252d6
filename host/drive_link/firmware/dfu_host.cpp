#include "host/drive_link/firmware/dfu_host.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace flexspline::dfu {
namespace {

using usb::DfuRequest;
using usb::DfuState;
using usb::DfuStatus;

// A memory that needs longer for one block than that is broken.
constexpr std::uint32_t kMostMs = 60'000;

[[noreturn]] void fail(const Pipe& pipe, const std::string& what) {
  throw DfuError(pipe.name() + ": " + what);
}

// Brings the device to dfuIDLE, from any other state.
void make_idle(Pipe& pipe) {
  for (int i = 0; i < 4; ++i) {
    const DeviceStatus device = get_status(pipe);
    if (device.state == DfuState::idle) return;
    pipe.out(device.state == DfuState::error ? DfuRequest::clear_status : DfuRequest::abort, 0, {});
  }
  fail(pipe, "the boot loader does not become idle; switch the drive off and on");
}

// Polls until the device has finished, and returns its state.
DfuState wait_for_work(Pipe& pipe) {
  for (std::uint32_t waited = 0; waited <= kMostMs;) {
    const DeviceStatus device = get_status(pipe);
    if (device.status != DfuStatus::ok) fail(pipe, text_of(device.status));
    const bool works = device.state == DfuState::download_busy || device.state == DfuState::download_sync ||
                       device.state == DfuState::manifest || device.state == DfuState::manifest_sync;
    if (!works) return device.state;
    const std::uint32_t time = std::max<std::uint32_t>(device.poll_ms, 1);
    pipe.wait_ms(time);
    waited += time;
  }
  fail(pipe, "the boot loader is busy for a minute; switch the drive off and on and try again");
}

void send(Pipe& pipe, std::uint16_t number, std::span<const std::uint8_t> block) {
  if (pipe.out(DfuRequest::download, number, block)) return;
  const DeviceStatus device = get_status(pipe);
  fail(pipe, device.status == DfuStatus::ok ? "the boot loader refused a block" : text_of(device.status));
}

}  // namespace

DeviceStatus get_status(Pipe& pipe) {
  Bytes data;
  if (!pipe.in(DfuRequest::get_status, 0, usb::kDfuStatusBytes, data) || data.size() != usb::kDfuStatusBytes ||
      data[0] > static_cast<std::uint8_t>(DfuStatus::stalled) || data[4] > static_cast<std::uint8_t>(DfuState::error))
    fail(pipe, "it does not report its state; switch the drive off and on and try again");
  return {static_cast<DfuStatus>(data[0]), static_cast<DfuState>(data[4]),
          static_cast<std::uint32_t>(data[1] | data[2] << 8 | data[3] << 16)};
}

std::string text_of(usb::DfuStatus status) {
  switch (status) {
    case DfuStatus::ok:
      return "no error";
    case DfuStatus::target:
      return "the image is for another board (errTARGET); take the one for this board";
    case DfuStatus::file:
      return "it does not take this image (errFILE): it is no image that fits, is not signed with the key of this boot "
             "loader, or has a smaller security counter than one that ran; sign it with that key (flexspline sign)";
    case DfuStatus::erase:
    case DfuStatus::check_erased:
    case DfuStatus::write:
    case DfuStatus::program:
      return "its flash memory did not take what was written; try again, and if it stays so, it is worn out";
    case DfuStatus::verify:
      return "what arrived is not what was sent (errVERIFY); try again";
    case DfuStatus::not_done:
      return "the image ends before the length in its header (errNOTDONE); fetch or make it again";
    case DfuStatus::address:
      return "a block came out of its order (errADDRESS); try again";
    case DfuStatus::firmware:
      return "it holds no image that is whole (errFIRMWARE); flash one";
    default:
      return fmt::format("the boot loader refused (status {}); switch the drive off and on and try again",
                         static_cast<int>(status));
  }
}

void download(Pipe& pipe, std::span<const std::uint8_t> image, std::size_t block_bytes,
              const std::function<void(std::size_t)>& progress) {
  make_idle(pipe);
  std::uint16_t number = 0;
  for (std::size_t at = 0; at < image.size(); at += block_bytes) {
    const auto block = image.subspan(at, std::min(block_bytes, image.size() - at));
    send(pipe, number++, block);
    if (wait_for_work(pipe) != DfuState::download_idle) fail(pipe, "the boot loader lost its place; try again");
    if (progress) progress(at + block.size());
  }
  send(pipe, number, {});
  const DfuState end = wait_for_work(pipe);
  if (end != DfuState::idle && end != DfuState::manifest_wait_reset)
    fail(pipe, "the boot loader did not install the image; try again");
}

Bytes upload(Pipe& pipe, std::size_t bytes, std::size_t block_bytes) {
  make_idle(pipe);
  Bytes all;
  for (std::uint16_t number = 0; all.size() < bytes; ++number) {
    Bytes block;
    if (!pipe.in(DfuRequest::upload, number, block_bytes, block)) break;
    all.insert(all.end(), block.begin(), block.end());
    if (block.size() < block_bytes) break;
  }
  make_idle(pipe);
  if (all.size() > bytes) all.resize(bytes);
  return all;
}

bool detach(Pipe& pipe) {
  return pipe.out(DfuRequest::detach, usb::kDfuDetachMs, {});
}

}  // namespace flexspline::dfu
