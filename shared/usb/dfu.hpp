// Device firmware update, DFU 1.1 (USB-IF, 5 August 2004): the run-time interface of an application (DfuRuntime), and
// the mode in which a boot loader receives and sends an image (DfuMode). States and transitions are those of its
// appendix A; numbers in comments are its sections.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/usb/chapter9.hpp"
#include "shared/usb/descriptors.hpp"

namespace flexspline::usb {

// 3, table 3.2.
enum class DfuRequest : std::uint8_t { detach, download, upload, get_status, clear_status, get_state, abort };
// 6.1.2.
enum class DfuState : std::uint8_t {
  app_idle,
  app_detach,
  idle,
  download_sync,
  download_busy,
  download_idle,
  manifest_sync,
  manifest,
  manifest_wait_reset,
  upload_idle,
  error,
};
enum class DfuStatus : std::uint8_t {
  ok,
  target,        // not for this device
  file,          // no image, or one that fails a check of its vendor
  write,         // memory cannot be written
  erase,         // erasing failed
  check_erased,  // not blank after it
  program,       // programming failed
  verify,        // memory does not read back as sent
  address,       // beyond the end, or not at the end of the previous block
  not_done,      // the host ends the download before the image is complete
  firmware,      // there is no complete image
  vendor,
  reset,  // an unexpected reset
  power_on,
  unknown,
  stalled,  // a request that the device does not support in this state
};

inline constexpr std::uint8_t kDfuDescriptorType = 0x21;
inline constexpr std::uint8_t kDfuDescriptorBytes = 9;
inline constexpr std::uint8_t kDfuCanDownload = 1, kDfuCanUpload = 2, kDfuOutlivesManifest = 4, kDfuWillDetach = 8;
inline constexpr std::uint8_t kDfuClass = 0xfe, kDfuSubclass = 1, kDfuRuntimeProtocol = 1, kDfuModeProtocol = 2;
inline constexpr std::size_t kDfuStatusBytes = 6;
// Longest block. A host may send shorter ones, of a multiple of four bytes.
inline constexpr std::size_t kDfuBlockBytes = 1024;
// How long a device has to be gone after DETACH.
inline constexpr std::uint16_t kDfuDetachMs = 1000;

// 4.1.3. The device detaches by itself, and answers requests for its state after an image was installed.
constexpr Bytes<kDfuDescriptorBytes> dfu_descriptor(bool can_upload) {
  constexpr std::uint16_t kVersion = 0x0110;
  constexpr std::uint8_t kAlways = kDfuCanDownload | kDfuOutlivesManifest | kDfuWillDetach;
  return {kDfuDescriptorBytes,
          kDfuDescriptorType,
          static_cast<std::uint8_t>(can_upload ? kAlways | kDfuCanUpload : kAlways),
          low(kDfuDetachMs),
          high(kDfuDetachMs),
          low(kDfuBlockBytes),
          high(kDfuBlockBytes),
          low(kVersion),
          high(kVersion)};
}
// 6.1.2: status, time to wait before the next request, state, a string.
constexpr Bytes<kDfuStatusBytes> dfu_status(DfuStatus status, std::uint32_t poll_ms, DfuState state) {
  return {static_cast<std::uint8_t>(status),
          low(poll_ms),
          high(poll_ms),
          low(poll_ms >> 16),
          static_cast<std::uint8_t>(state),
          0};
}

namespace detail {

// Common to both: an interface without endpoints.
template <std::uint8_t kProtocol, bool can_upload>
struct DfuInterface {
  static constexpr std::size_t kInterfaces = 1, kInEndpoints = 0, kOutEndpoints = 0;
  static constexpr auto dfu_descriptors(const Place& place) {
    return joined(interface_descriptor({.number = place.interface,
                                        .code = kDfuClass,
                                        .subclass = kDfuSubclass,
                                        .protocol = kProtocol,
                                        .string = place.string}),
                  dfu_descriptor(can_upload));
  }
  static Reply descriptor_reply(const Setup& setup) {
    static constexpr auto kDescriptor = dfu_descriptor(can_upload);
    return setup.value == kDfuDescriptorType << 8 ? reply_with(kDescriptor) : kRefused;
  }
  template <class Link>
  void start(Link&) {}
  void stop() {}
  template <class Link>
  void sent(Link&, std::size_t) {}
  template <class Link>
  void received(Link&, std::size_t, std::span<const std::uint8_t>) {}
  template <class Link>
  void resume(Link&, bool, std::size_t) {}
};

}  // namespace detail

// In the application: announces the boot loader and passes on requests for it. The application decides whether to
// accept, and starts the boot loader by itself (bitWillDetach): wants_loader() is true once the host has seen that its
// DETACH was accepted.
//
// The boot loader's own descriptor says whether it uploads.
class DfuRuntime : public detail::DfuInterface<kDfuRuntimeProtocol, false> {
 public:
  // Not while the drive is armed.
  void allow(bool allowed) { allowed_ = allowed; }
  bool wants_loader() const { return leaves_; }

  // For the device core.

  static constexpr std::size_t kControlBytes = kDfuStatusBytes;
  static constexpr std::array<std::string_view, 1> kStrings{"firmware update"};
  static constexpr auto descriptors(Place place) { return dfu_descriptors(place); }
  template <class Link>
  void poll(Link&) {}
  // A.2.1 and A.2.2.
  Reply control_in(const Setup& setup, std::span<std::uint8_t> room) {
    if (setup.kind() == RequestKind::standard) return descriptor_reply(setup);
    if (setup.kind() != RequestKind::of_class) return kRefused;
    const DfuState state = leaves_ ? DfuState::app_detach : DfuState::app_idle;
    switch (static_cast<DfuRequest>(setup.request)) {
      case DfuRequest::get_status:
        if (setup.value != 0 || setup.length != kDfuStatusBytes) return kRefused;
        return filled(room, dfu_status(DfuStatus::ok, 0, state));
      case DfuRequest::get_state:
        if (setup.value != 0 || setup.length != 1) return kRefused;
        return filled(room, Bytes<1>{static_cast<std::uint8_t>(state)});
      default:
        return kRefused;
    }
  }
  bool control_out(const Setup& setup, std::span<const std::uint8_t> data) {
    return is_detach(setup) && data.empty() && allowed_;
  }
  void control_done(const Setup& setup) { leaves_ = leaves_ || (is_detach(setup) && allowed_); }

 private:
  static bool is_detach(const Setup& setup) {
    return setup.kind() == RequestKind::of_class && !setup.to_host() &&
           setup.request == static_cast<std::uint8_t>(DfuRequest::detach);
  }
  template <std::size_t n>
  static Reply filled(std::span<std::uint8_t> room, const Bytes<n>& bytes) {
    for (std::size_t i = 0; i < n; ++i) room[i] = bytes[i];
    return reply_with(room.first(n));
  }
  bool allowed_ = false;
  bool leaves_ = false;
};

// The memory of images.
template <class M>
concept DfuMemory = requires(M memory, std::span<const std::uint8_t> block, std::size_t at) {
  { M::kName } -> std::convertible_to<std::string_view>;   // name of the memory, for the user
  { M::kCanUpload } -> std::convertible_to<bool>;          // whether a host may read the installed image
  { memory.write(at, block) } -> std::same_as<DfuStatus>;  // from the start on, one block after the other
  { memory.write_ms(at) } -> std::same_as<std::uint32_t>;  // its longest time
  { memory.has_all() } -> std::same_as<bool>;              // whether the image is complete
  { memory.install() } -> std::same_as<DfuStatus>;         // checks the whole image and requests its installation
  { memory.install_ms() } -> std::same_as<std::uint32_t>;  // its longest time
  memory.abort();                                          // the download is cancelled
  { memory.read() } -> std::same_as<std::span<const std::uint8_t>>;  // the installed image; empty: there is none
};

// In the boot loader. poll() works on the memory, between two requests.
template <DfuMemory Memory>
class DfuMode : public detail::DfuInterface<kDfuModeProtocol, Memory::kCanUpload> {
  using Interface = detail::DfuInterface<kDfuModeProtocol, Memory::kCanUpload>;

 public:
  // Before the first request; it has to outlive this.
  void use(Memory& memory) { memory_ = &memory; }
  // An image was installed; the host has been informed.
  bool installed() const { return installed_; }
  bool install_reported() const { return install_reported_; }
  // A host has sent a request since the device started: a bus reset after that ends DFU mode (A.2.3 on).
  bool was_used() const { return was_used_; }
  DfuState state() const { return state_; }
  DfuStatus status() const { return status_; }

  // For the device core.

  static constexpr std::size_t kControlBytes = kDfuBlockBytes;
  static constexpr std::array<std::string_view, 1> kStrings{Memory::kName};
  static constexpr auto descriptors(Place place) { return Interface::dfu_descriptors(place); }
  // The bus was reset or the device configured again: a running transfer is cancelled.
  void stop() {
    if (state_ == DfuState::idle || state_ == DfuState::error) return;
    memory_->abort();
    state_ = DfuState::idle;
    work_ = Work::none;
  }
  template <class Link>
  void poll(Link&) {
    if (state_ == DfuState::download_busy) {
      finish(memory_->write(at_, std::span<const std::uint8_t>(block_).first(count_)), DfuState::download_sync);
      at_ += count_;
    } else if (state_ == DfuState::manifest) {
      finish(memory_->install(), DfuState::manifest_sync);
      installed_ = state_ == DfuState::manifest_sync;
    }
  }
  Reply control_in(const Setup& setup, std::span<std::uint8_t> room) {
    if (setup.kind() == RequestKind::standard) return Interface::descriptor_reply(setup);
    if (setup.kind() != RequestKind::of_class) return kRefused;
    was_used_ = true;
    switch (static_cast<DfuRequest>(setup.request)) {
      case DfuRequest::get_status:
        if (setup.value != 0 || setup.length != kDfuStatusBytes || state_ == DfuState::download_busy ||
            state_ == DfuState::manifest)
          return refused();
        return status_reply(room);
      case DfuRequest::get_state:
        if (setup.value != 0 || setup.length != 1 || state_ == DfuState::download_busy || state_ == DfuState::manifest)
          return refused();
        room[0] = static_cast<std::uint8_t>(state_);
        return reply_with(room.first(1));
      case DfuRequest::upload:
        return Memory::kCanUpload ? upload(setup) : refused();
      default:
        return refused();
    }
  }
  bool control_out(const Setup& setup, std::span<const std::uint8_t> data) {
    if (setup.kind() != RequestKind::of_class) return false;
    was_used_ = true;
    switch (static_cast<DfuRequest>(setup.request)) {
      case DfuRequest::download:
        return download(setup, data);
      case DfuRequest::abort:
        if (!data.empty() || !can_abort()) return refuse(DfuStatus::stalled);
        memory_->abort();
        state_ = DfuState::idle;
        work_ = Work::none;
        return true;
      case DfuRequest::clear_status:
        if (!data.empty() || state_ != DfuState::error) return refuse(DfuStatus::stalled);
        status_ = DfuStatus::ok;
        state_ = DfuState::idle;
        return true;
      default:
        return refuse(DfuStatus::stalled);
    }
  }
  // The work that a status announced begins once the host has received it.
  void control_done(const Setup& setup) {
    if (setup.kind() != RequestKind::of_class || setup.request != static_cast<std::uint8_t>(DfuRequest::get_status))
      return;
    if (state_ == DfuState::download_sync && work_ == Work::announced) state_ = DfuState::download_busy;
    if (state_ == DfuState::manifest_sync && work_ == Work::announced) state_ = DfuState::manifest;
    if (state_ == DfuState::idle && installed_) install_reported_ = true;
  }

 private:
  enum class Work : std::uint8_t { none, waiting, announced };

  bool can_abort() const {
    return state_ == DfuState::idle || state_ == DfuState::download_sync || state_ == DfuState::download_idle ||
           state_ == DfuState::manifest_sync || state_ == DfuState::upload_idle;
  }
  // Always false. In the error state the first error is kept.
  bool refuse(DfuStatus why) {
    if (state_ != DfuState::error) {
      if (state_ != DfuState::idle) memory_->abort();
      status_ = why;
      state_ = DfuState::error;
      work_ = Work::none;
    }
    return false;
  }
  Reply refused(DfuStatus why = DfuStatus::stalled) {
    refuse(why);
    return kRefused;
  }
  void finish(DfuStatus result, DfuState next) {
    work_ = Work::none;
    state_ = next;
    if (result != DfuStatus::ok) refuse(result);
  }

  Reply status_reply(std::span<std::uint8_t> room) {
    DfuState shown = state_;
    std::uint32_t poll_ms = 0;
    if (state_ == DfuState::download_sync) {
      if (work_ == Work::none) {
        state_ = shown = DfuState::download_idle;
      } else {
        work_ = Work::announced;
        shown = DfuState::download_busy;
        poll_ms = memory_->write_ms(at_);
      }
    } else if (state_ == DfuState::manifest_sync) {
      if (work_ == Work::none) {
        state_ = shown = DfuState::idle;
      } else {
        work_ = Work::announced;
        shown = DfuState::manifest;
        poll_ms = memory_->install_ms();
      }
    }
    const auto bytes = dfu_status(status_, poll_ms, shown);
    for (std::size_t i = 0; i < bytes.size(); ++i) room[i] = bytes[i];
    return reply_with(room.first(bytes.size()));
  }
  bool download(const Setup& setup, std::span<const std::uint8_t> data) {
    const bool begins = state_ == DfuState::idle;
    if (!begins && state_ != DfuState::download_idle) return refuse(DfuStatus::stalled);
    if (data.size() > kDfuBlockBytes) return refuse(DfuStatus::stalled);
    if (data.empty()) {
      if (begins) return refuse(DfuStatus::stalled);
      if (!memory_->has_all()) return refuse(DfuStatus::not_done);
      state_ = DfuState::manifest_sync;
      work_ = Work::waiting;
      return true;
    }
    if (begins) {
      at_ = 0;
      number_ = setup.value;
      installed_ = install_reported_ = false;
    }
    if (setup.value != number_) return refuse(DfuStatus::address);
    ++number_;
    for (std::size_t i = 0; i < data.size(); ++i) block_[i] = data[i];
    count_ = data.size();
    state_ = DfuState::download_sync;
    work_ = Work::waiting;
    return true;
  }
  // A block shorter than requested is the last one.
  Reply upload(const Setup& setup) {
    if (state_ != DfuState::idle && state_ != DfuState::upload_idle) return refused();
    if (setup.length > kDfuBlockBytes) return refused();
    const std::span<const std::uint8_t> all = memory_->read();
    if (all.empty()) return refused(DfuStatus::firmware);
    if (state_ == DfuState::idle) {
      at_ = 0;
      number_ = setup.value;
    }
    if (setup.value != number_ || at_ > all.size()) return refused(DfuStatus::address);
    ++number_;
    const std::size_t left = all.size() - at_;
    const auto block = all.subspan(at_, left < setup.length ? left : setup.length);
    at_ += block.size();
    state_ = block.size() < setup.length ? DfuState::idle : DfuState::upload_idle;
    return reply_with(block);
  }

  Memory* memory_ = nullptr;
  DfuState state_ = DfuState::idle;
  DfuStatus status_ = DfuStatus::ok;
  Work work_ = Work::none;
  bool installed_ = false;
  bool install_reported_ = false;
  bool was_used_ = false;
  std::uint16_t number_ = 0;  // of the next block
  std::size_t at_ = 0;
  std::size_t count_ = 0;
  std::array<std::uint8_t, kDfuBlockBytes> block_{};
};

}  // namespace flexspline::usb
