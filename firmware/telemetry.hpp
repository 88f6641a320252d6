// Telemetry: the channels that the host subscribed to, in a ring between the control tick (writes) and background work
// (reads). A frame is
//   word 0  sequence number of the frame: one more for each that was due, written or not
//   word 1  tick
//   then    one word for each channel, in the order asked for
// A ring that is full drops the new frame and counts it: the tick never waits, and a gap in the sequence shows how many
// are missing.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "firmware/sequence_lock.hpp"
#include "shared/protocol/states.hpp"

namespace flexspline::firmware {

using protocol::Channel;
using protocol::kChannels;
using ChannelValues = std::array<std::uint32_t, kChannels>;

struct TelemetrySetup {
  static constexpr std::size_t kMost = 12;
  std::uint16_t every = 1;  // ticks
  std::uint8_t count = 0;   // zero: no telemetry
  std::array<Channel, kMost> channels{};
};

// The offset of a channel's word, in bytes: here one after the other.
struct ByNumber {
  static constexpr std::uint8_t of(Channel channel) { return static_cast<std::uint8_t>(channel) * 4U; }
};

// `kWords` a power of two. The signals of a tick are in a struct of the caller; Places has their offsets.
template <std::size_t kWords, class Places = ByNumber>
class Telemetry {
  static_assert(kWords >= 32 && (kWords & (kWords - 1)) == 0);

 public:
  static constexpr std::size_t kHeaderWords = 2;

  // Background: restarts with other channels; the ring is cleared, sequence and drops begin at zero.
  // Returns false, and changes nothing, for what cannot be recorded.
  bool configure(const TelemetrySetup& setup) {
    if (setup.count > TelemetrySetup::kMost || setup.every == 0) return false;
    for (std::size_t i = 0; i < setup.count; ++i)
      if (static_cast<std::size_t>(setup.channels[i]) >= kChannels) return false;
    // The tick interrupts background work, never the other way round: from here on it does not use the ring.
    running_.store(false);
    setup_ = setup;
    for (std::size_t i = 0; i < setup.count; ++i) places_[i] = Places::of(setup.channels[i]);
    written_.store(0);
    read_.store(0);
    sequence_ = 0;
    dropped_ = 0;
    until_next_ = 0;
    running_.store(setup.count > 0);
    return true;
  }
  const TelemetrySetup& setup() const { return setup_; }
  std::size_t frame_words() const { return setup_.count + kHeaderWords; }

  // Whether a frame is recorded at all.
  bool is_running() const { return running_.load(std::memory_order_relaxed); }
  // Tick: `signals` is the struct of the caller; its words are copied when a frame is due.
  template <class Signals>
  void record(std::uint32_t tick, const Signals& signals) {
    if (!is_running()) return;
    if (until_next_ > 0) {
      --until_next_;
      return;
    }
    until_next_ = setup_.every - 1U;
    const std::uint32_t sequence = sequence_++;
    const std::uint32_t at = written_.load(std::memory_order_relaxed);
    const auto words = static_cast<std::uint32_t>(frame_words());
    if (at - load_in_tick(read_) + words > kWords) {
      dropped_ = dropped_ + 1;
      return;
    }
    // Nearly all frames do not reach the end of the ring and need no check of each word.
    const std::uint32_t from = at & (kWords - 1);
    if (from + words <= kWords) {
      copy(tick, sequence, signals, [to = &ring_[from]](std::uint32_t i, std::uint32_t word) { to[i] = word; });
    } else {
      copy(tick, sequence, signals,
           [this, at](std::uint32_t i, std::uint32_t word) { ring_[(at + i) & (kWords - 1)] = word; });
    }
    store_in_tick(written_, at + words);
  }

  // Background: takes the oldest frame. Returns its words (the front of `frame`), none where there is no frame or it
  // would not fit.
  std::span<const std::uint32_t> read(std::span<std::uint32_t> frame) {
    const std::uint32_t at = read_.load(std::memory_order_relaxed);
    const std::size_t words = frame_words();
    if (written_.load(std::memory_order_acquire) == at || frame.size() < words) return {};
    for (std::size_t i = 0; i < words; ++i) frame[i] = ring_[(at + i) & (kWords - 1)];
    read_.store(at + static_cast<std::uint32_t>(words), std::memory_order_release);
    return frame.first(words);
  }
  // Frames that found the ring full, since configure().
  std::uint32_t dropped() const { return dropped_; }

 private:
  template <class Signals, class Put>
  void copy(std::uint32_t tick, std::uint32_t sequence, const Signals& signals, Put&& put) {
    put(0, sequence);
    put(1, tick);
    const auto* bytes = reinterpret_cast<const std::byte*>(&signals);
    const auto one = [&](std::uint32_t channel) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes + places_[channel], sizeof(word));
      put(kHeaderWords + channel, word);
    };
    // From the last one down, without a loop, which would take as many instructions for counting as for copying.
    static_assert(TelemetrySetup::kMost == 12);
    switch (setup_.count) {
      case 12:
        one(11);
        [[fallthrough]];
      case 11:
        one(10);
        [[fallthrough]];
      case 10:
        one(9);
        [[fallthrough]];
      case 9:
        one(8);
        [[fallthrough]];
      case 8:
        one(7);
        [[fallthrough]];
      case 7:
        one(6);
        [[fallthrough]];
      case 6:
        one(5);
        [[fallthrough]];
      case 5:
        one(4);
        [[fallthrough]];
      case 4:
        one(3);
        [[fallthrough]];
      case 3:
        one(2);
        [[fallthrough]];
      case 2:
        one(1);
        [[fallthrough]];
      case 1:
        one(0);
        [[fallthrough]];
      default:
        break;
    }
  }

  std::array<std::uint32_t, kWords> ring_{};
  std::atomic<std::uint32_t> written_{0};
  std::atomic<std::uint32_t> read_{0};
  std::atomic<bool> running_{false};
  TelemetrySetup setup_{.every = 0};
  std::array<std::uint8_t, TelemetrySetup::kMost> places_{};
  std::uint32_t sequence_ = 0;
  volatile std::uint32_t dropped_ = 0;
  std::uint32_t until_next_ = 0;
};

}  // namespace flexspline::firmware
