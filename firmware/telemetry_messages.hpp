// Packs frames of telemetry into messages: as many as follow each other without a gap and fit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/telemetry.hpp"
#include "shared/protocol/payloads.hpp"

namespace flexspline::firmware {

class TelemetryMessages {
 public:
  // The longest time that a message waits to be filled.
  static constexpr std::uint32_t kMostWaitTicks = 200;

  // From background work. True: `m` is the next message to send. Frames that are not fetched stay in the application's
  // ring; a full ring drops and counts further ones.
  template <class Application>
  bool next(Application& application, protocol::Message& m) {
    constexpr std::size_t kHead = Application::Ring::kHeaderWords;
    const std::size_t most = protocol::frames_a_message(application.telemetry().setup().count);
    std::array<std::uint32_t, TelemetrySetup::kMost + kHead> words{};
    while (open_.code < most) {
      const std::span<const std::uint32_t> frame = application.telemetry().read(words);
      if (frame.empty()) break;
      if (open_.code > 0 && frame[0] != first_sequence_ + open_.code) {
        m = open_;
        begin(frame, frame.size() - kHead);
        return true;
      }
      if (open_.code == 0) {
        begin(frame, frame.size() - kHead);
      } else {
        add(frame.subspan(kHead));
      }
    }
    if (open_.code == 0) return false;
    if (open_.code < most && application.status().tick - first_tick_ < kMostWaitTicks) return false;
    m = open_;
    open_ = {};
    return true;
  }
  void restart() { open_ = {}; }

 private:
  void begin(std::span<const std::uint32_t> frame, std::size_t channels) {
    first_sequence_ = frame[0];
    first_tick_ = frame[1];
    open_ = {protocol::kFirstUnasked, static_cast<std::uint8_t>(channels), 0, 0, {}};
    add(frame);
  }
  void add(std::span<const std::uint32_t> words) {
    model::Writer w(std::span<std::uint8_t>(open_.payload).subspan(open_.length));
    for (const std::uint32_t word : words) w.put(word);
    open_.length = static_cast<std::uint8_t>(open_.length + w.size());
    ++open_.code;
  }

  protocol::Message open_{};
  std::uint32_t first_sequence_ = 0;
  std::uint32_t first_tick_ = 0;
};

}  // namespace flexspline::firmware
