// The boot loader for any board: starts the application, or receives a new one over USB. boards/stm32f4/loader.hpp
// uses it.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/boot/slots.hpp"
#include "shared/usb/dfu.hpp"

namespace flexspline::firmware {

// What the boot loader needs from a board.
template <class B>
concept LoaderBoard = requires(B board) {
  { B::kName } -> std::convertible_to<std::string_view>;  // which images are made for; at most fifteen letters
  // A storage::FlashPort of boot::kImageSectors sectors, the last of which may be as short as boot::kCounterBytes; each
  // may consist of several sectors of the memory. It feeds a running watchdog.
  typename B::Slots;
  // Which images may run (shared/boot/image.hpp), and whether a host may read the one that does.
  typename B::Trust;
  { B::kCanUpload } -> std::convertible_to<bool>;
  { board.slots() } -> std::same_as<typename B::Slots&>;
  // Longest times: to erase a slot, to write a block of DFU, to check an image.
  { B::kEraseMs } -> std::convertible_to<std::uint32_t>;
  { B::kBlockMs } -> std::convertible_to<std::uint32_t>;
  { B::kCheckMs } -> std::convertible_to<std::uint32_t>;
  // The application requested the boot loader before the reset, or somebody holds a button. Reading clears the request.
  { board.takes_loader_request() } -> std::same_as<bool>;
};

// An image on its way by DFU.
template <LoaderBoard B>
class UpdateMemory {
 public:
  using Slots = boot::Slots<typename B::Slots, typename B::Trust>;
  static constexpr std::string_view kName = B::kName;
  static constexpr bool kCanUpload = B::kCanUpload;

  explicit UpdateMemory(Slots& slots) : slots_(slots) {}

  usb::DfuStatus write(std::size_t at, std::span<const std::uint8_t> block) {
    if (at == 0) {
      // Data that are not an image for this board do not overwrite the image that was downloaded before.
      if (block.size() >= boot::kHeaderBytes) {
        const auto finding = slots_.check_start(block);
        if (finding != boot::ImageFinding::none) return status_of(finding);
      }
      if (const auto error = slots_.begin(); error != boot::SlotError::none) return status_of(error);
    }
    return at == slots_.staged() ? status_of(slots_.write(block)) : usb::DfuStatus::address;
  }
  std::uint32_t write_ms(std::size_t at) const { return at == 0 ? B::kEraseMs + B::kBlockMs : B::kBlockMs; }
  bool has_all() const { return slots_.has_all(); }
  usb::DfuStatus install() { return status_of(slots_.finish()); }
  std::uint32_t install_ms() const { return B::kCheckMs; }
  void abort() { slots_.abort(); }
  std::span<const std::uint8_t> read() const { return slots_.image(boot::Slot::application); }

 private:
  usb::DfuStatus status_of(boot::ImageFinding finding) const {
    switch (finding) {
      case boot::ImageFinding::none:
        return usb::DfuStatus::ok;
      case boot::ImageFinding::wrong_board:
        return usb::DfuStatus::target;
      case boot::ImageFinding::incomplete:
        return usb::DfuStatus::not_done;
      case boot::ImageFinding::damaged:
        return usb::DfuStatus::verify;
      default:
        return usb::DfuStatus::file;
    }
  }
  usb::DfuStatus status_of(boot::SlotError error) const {
    switch (error) {
      case boot::SlotError::none:
        return usb::DfuStatus::ok;
      case boot::SlotError::erase:
        return usb::DfuStatus::erase;
      case boot::SlotError::not_blank:
        return usb::DfuStatus::check_erased;
      case boot::SlotError::program:
        return usb::DfuStatus::program;
      case boot::SlotError::out_of_order:
      case boot::SlotError::too_long:
        return usb::DfuStatus::address;
      case boot::SlotError::image:
        return status_of(slots_.finding());
    }
    return usb::DfuStatus::unknown;
  }
  Slots& slots_;
};

template <LoaderBoard B>
class BootLoader {
 public:
  using Memory = UpdateMemory<B>;
  using Slots = typename Memory::Slots;
  using Dfu = usb::DfuMode<Memory>;

  explicit BootLoader(B& board) : slots_(board.slots(), B::kName), memory_(slots_), board_(board) {}
  BootLoader(const BootLoader&) = delete;

  // Once, after reset: finishes an update that was begun and returns what to start; `none`: open the bus and call
  // poll().
  boot::Start start() {
    if (!board_.takes_loader_request()) return slots_.resume();
    slots_.keep_counter();
    return boot::Start::none;
  }

  // The device's class, before the bus is opened.
  void serve(Dfu& dfu) { dfu.use(memory_); }
  // Call repeatedly, after the device's poll(). `was_reset`: the bus was reset since the last call. True: disconnect
  // from the bus and reset the processor. It waits a while first, so that the host's program can finish.
  bool poll(const Dfu& dfu, bool was_reset, std::uint32_t now_ms) {
    if (was_reset && dfu.was_used() && can_start()) return true;
    if (!dfu.installed()) {
      waits_ = false;
      return false;
    }
    if (!waits_) since_ms_ = now_ms;
    waits_ = true;
    return now_ms - since_ms_ >= (dfu.install_reported() ? kLeaveMs : kLeaveUnreportedMs);
  }
  const Slots& slots() const { return slots_; }

 private:
  static constexpr std::uint32_t kLeaveMs = 500, kLeaveUnreportedMs = 10'000;
  bool can_start() const {
    return !slots_.image_to_run(boot::Slot::application).empty() || !slots_.image_to_run(boot::Slot::old).empty() ||
           !slots_.image_to_run(boot::Slot::download).empty();
  }

  Slots slots_;
  Memory memory_;
  B& board_;
  std::uint32_t since_ms_ = 0;
  bool waits_ = false;
};

}  // namespace flexspline::firmware
