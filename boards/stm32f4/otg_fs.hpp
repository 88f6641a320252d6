// The USB controller OTG_FS as a full-speed device, for the device core (shared/usb/port.hpp). Without DMA and without
// interrupts: poll() in background work takes received packets; until then the controller answers NAK (RM0090, 34).
//
// One packet at a time on each endpoint, as the device core needs it. The FIFO's 320 words: 96 to receive, 32 to 64 for
// each endpoint to the host.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "boards/stm32f4/registers.hpp"
#include "shared/usb/port.hpp"

namespace flexspline::stm32f4 {

// PA9 senses the power of the bus, unless a board has another use for that pin and says so.
template <class Description>
constexpr bool senses_usb_power() {
  if constexpr (requires { Description::kSensesUsbPower; }) {
    return Description::kSensesUsbPower;
  } else {
    return true;
  }
}

class OtgFs {
 public:
  static constexpr bool kAddressBeforeStatus = true;
  static constexpr std::uint8_t kEndpoints = 4;  // of each direction, with endpoint 0

  // Connects to the bus (pulls D+ up) while it is powered; a board that does not sense its power connects always, and
  // does not see that it was unplugged. False: the controller does not answer.
  bool start(std::uint32_t core_hz, bool senses_power = true) {
    switch_clock_on(kOtgFs);
    hardware(kUsbSetup) = kInternalPhy;
    if (!wait_for(kReset, kBusIdle, kBusIdle, kTries)) return false;
    set_bits(kReset, 1);  // the core itself
    if (!wait_for(kReset, 1, 0, kTries)) return false;
    hardware(kPhy) = (1U << 16) | (senses_power ? 1U << 19 : 1U << 21);  // power; sensing of the bus's for a device
    // Turnaround time for a bus clock above 32 MHz; forced device mode, which takes 25 ms.
    hardware(kUsbSetup) = kInternalPhy | (6U << 10) | (1U << 30);
    cortex_m4::spend_cycles(core_hz / 1000 * 25);
    hardware(kPowerGating) = 0;
    set_bits(kDeviceControl, kDisconnect);
    hardware(kDevice) = 3;  // full speed, internal PHY
    hardware(kReceiveFifo) = kReceiveWords;
    std::uint32_t at = kReceiveWords;
    for (std::uint8_t i = 0; i < kEndpoints; ++i) {
      const std::uint32_t words = i < 2 ? 32 : 64;
      hardware(i == 0 ? kSendFifo0 : kSendFifo1 + 4U * (i - 1)) = at | (words << 16);
      at += words;
    }
    flush_sending(kAllFifos);
    flush_receiving();
    hardware(kEvents) = 0xBFFFFFFF;
    clear_bits(kDeviceControl, kDisconnect);
    return true;
  }

  // Disconnects from the bus: the host sees an unplugged device.
  void stop() { set_bits(kDeviceControl, kDisconnect); }

  // Background work: passes events and packets to the device core, which calls back into this class.
  template <class Core>
  void poll(Core& core) {
    const std::uint32_t events = hardware(kEvents);
    if ((events & kOtgEvent) != 0) {
      const std::uint32_t what = hardware(kOtgEvents);
      hardware(kOtgEvents) = what;
      if ((what & kSessionEnd) != 0) {  // unplugged
        forget_all();
        core.reset();
      }
    }
    if ((events & kBusReset) != 0) {
      hardware(kEvents) = kBusReset | kEnumerated;
      bus_reset();
      core.reset();
      was_reset_ = true;
      return;
    }
    if ((events & kSuspended) != 0) hardware(kEvents) = kSuspended;  // the drive has its own power
    drain();
    // What ended before a SETUP belongs to the transfer before it.
    for (std::uint8_t i = 0; i < kEndpoints; ++i) {
      const std::uint32_t done = in(i) + kFlags;
      if ((hardware(done) & kTransferred) == 0) continue;
      hardware(done) = kTransferred;
      if (sending_[i]) {
        sending_[i] = false;
        core.sent(i);
      }
    }
    for (std::uint8_t i = 0; i < kEndpoints; ++i) {
      Packet& p = packets_[i];
      if (!p.whole) continue;
      p.whole = false;
      hardware(out(i) + kFlags) = kTransferred;
      core.received(i, std::span<const std::uint8_t>(p.bytes).first(p.size));
    }
    if (setup_came_) {
      setup_came_ = false;
      hardware(out(0) + kFlags) = kSetupDone;
      disable_in(0);
      prepare_setup();
      core.setup(setup_);
    }
  }

  // Whether the bus was reset since the last call.
  bool was_reset() {
    const bool was = was_reset_;
    was_reset_ = false;
    return was;
  }

  // Of the port (shared/usb/port.hpp).

  void set_address(std::uint8_t address) { change_bits(kDevice, 0x7FU << 4, std::uint32_t{address} << 4); }
  void open(const usb::EndpointSetup& e) {
    const std::uint8_t number = e.address & usb::kEndpointNumber;
    if (number == 0 || number >= kEndpoints) return;
    const bool to_host = (e.address & usb::kToHost) != 0;
    if (to_host) {
      disable_in(number);
    } else {
      disable_out(number, 0);
    }
    const std::uint32_t common = e.packet_bytes | kActive | (static_cast<std::uint32_t>(e.type) << 18) | kData0 | kNak;
    hardware(to_host ? in(number) : out(number)) = common | (to_host ? std::uint32_t{number} << 22 : 0U);
  }
  void close(std::uint8_t address) {
    const std::uint8_t number = address & usb::kEndpointNumber;
    if (number == 0 || number >= kEndpoints) return;
    if ((address & usb::kToHost) != 0) {
      disable_in(number);
      clear_bits(in(number), kActive | kStall);
    } else {
      disable_out(number, 0);
      clear_bits(out(number), kActive | kStall);
    }
  }
  void send(std::uint8_t number, std::span<const std::uint8_t> packet) {
    if (number >= kEndpoints) return;
    const auto bytes = static_cast<std::uint32_t>(packet.size());
    hardware(in(number) + kSize) = kOnePacket | bytes;
    sending_[number] = true;
    set_bits(in(number), kEnable | kClearNak);
    for (std::uint32_t i = 0; i < bytes; i += 4) {
      std::uint32_t word = 0;
      for (std::uint32_t k = 0; k < 4 && i + k < bytes; ++k) word |= std::uint32_t{packet[i + k]} << (8 * k);
      hardware(fifo(number)) = word;
    }
  }
  void receive(std::uint8_t number) {
    if (number >= kEndpoints) return;
    hardware(out(number) + kSize) = kOnePacket | usb::kPacketBytes | (number == 0 ? kThreeSetups : 0U);
    set_bits(out(number), kEnable | kClearNak);
  }
  void stall(std::uint8_t address) {
    const std::uint8_t number = address & usb::kEndpointNumber;
    if (number >= kEndpoints) return;
    if ((address & usb::kToHost) != 0) {
      disable_in(number);
      set_bits(in(number), kStall);
    } else if (number == 0) {
      set_bits(out(0), kStall);  // ends with the next SETUP, which is accepted nevertheless
    } else {
      disable_out(number, kStall);
      set_bits(out(number), kStall);
    }
  }
  void unstall(std::uint8_t address) {
    const std::uint8_t number = address & usb::kEndpointNumber;
    if (number == 0 || number >= kEndpoints) return;
    if ((address & usb::kToHost) != 0) {
      disable_in(number);
      change_bits(in(number), kStall, kData0);
    } else {
      disable_out(number, 0);
      change_bits(out(number), kStall, kData0);
    }
  }

 private:
  static constexpr std::uint32_t kOtgEvents = kOtgFs + 0x004, kUsbSetup = kOtgFs + 0x00C, kReset = kOtgFs + 0x010,
                                 kEvents = kOtgFs + 0x014, kPop = kOtgFs + 0x020, kReceiveFifo = kOtgFs + 0x024,
                                 kSendFifo0 = kOtgFs + 0x028, kPhy = kOtgFs + 0x038, kSendFifo1 = kOtgFs + 0x104,
                                 kDevice = kOtgFs + 0x800, kDeviceControl = kOtgFs + 0x804,
                                 kPowerGating = kOtgFs + 0xE00;
  static constexpr std::uint32_t in(std::uint8_t number) { return kOtgFs + 0x900 + 0x20U * number; }
  static constexpr std::uint32_t out(std::uint8_t number) { return kOtgFs + 0xB00 + 0x20U * number; }
  static constexpr std::uint32_t fifo(std::uint8_t number) { return kOtgFs + 0x1000 + 0x1000U * number; }
  // From an endpoint's control register on.
  static constexpr std::uint32_t kFlags = 0x08, kSize = 0x10;

  static constexpr std::uint32_t kInternalPhy = 1U << 6, kBusIdle = 1U << 31;
  static constexpr std::uint32_t kOtgEvent = 1U << 2, kSomethingCame = 1U << 4, kGlobalNakHolds = 1U << 7,
                                 kSuspended = 1U << 11, kBusReset = 1U << 12, kEnumerated = 1U << 13;
  static constexpr std::uint32_t kSessionEnd = 1U << 2, kDisconnect = 1U << 1, kSetGlobalNak = 1U << 9,
                                 kClearGlobalNak = 1U << 10;
  static constexpr std::uint32_t kActive = 1U << 15, kStall = 1U << 21, kClearNak = 1U << 26, kNak = 1U << 27,
                                 kData0 = 1U << 28, kDisable = 1U << 30, kEnable = 1U << 31;
  static constexpr std::uint32_t kTransferred = 1U << 0, kDisabled = 1U << 1, kSetupDone = 1U << 3;
  static constexpr std::uint32_t kOnePacket = 1U << 19, kThreeSetups = 3U << 29;
  static constexpr std::uint32_t kReceiveWords = 96, kAllFifos = 0x10;
  static constexpr std::uint32_t kTries = 10'000;
  // GRXSTSP, packet status.
  enum class PacketStatus : std::uint8_t { global_nak = 1, data = 2, data_done = 3, setup_done = 4, setup = 6 };

  struct Packet {
    std::array<std::uint8_t, usb::kPacketBytes> bytes{};
    std::uint8_t size = 0;
    bool whole = false;
  };

  // 34.17.5, at the end of a bus reset: all packets are refused until the device core asks for some, only SETUP is
  // accepted.
  void bus_reset() {
    forget_all();
    change_bits(kDevice, 0x7FU << 4, 0);
    for (std::uint8_t i = 0; i < kEndpoints; ++i) set_bits(out(i), kNak);
    flush_sending(kAllFifos);
    flush_receiving();
    for (std::uint8_t i = 0; i < kEndpoints; ++i) hardware(in(i) + kFlags) = hardware(out(i) + kFlags) = 0xFF;
    clear_bits(in(0), 3);  // packets of 64 bytes
    prepare_setup();
  }
  void forget_all() {
    setup_came_ = false;
    for (Packet& p : packets_) p.whole = false;
    sending_ = {};
  }
  void prepare_setup() { hardware(out(0) + kSize) = kThreeSetups | kOnePacket | usb::kPacketBytes; }

  // Takes everything out of the receive FIFO, which holds at most 24 packets of any kind.
  void drain() {
    for (int i = 0; i < 64 && (hardware(kEvents) & kSomethingCame) != 0; ++i) take_entry();
  }
  void take_entry() {
    const std::uint32_t entry = hardware(kPop);
    const std::uint32_t number = entry & 15, bytes = (entry >> 4) & 0x7FF;
    switch (static_cast<PacketStatus>((entry >> 17) & 15)) {
      case PacketStatus::setup:
        read_fifo(setup_, bytes);
        break;
      case PacketStatus::setup_done:
        setup_came_ = true;
        break;
      case PacketStatus::data: {
        Packet& p = packets_[number % kEndpoints];
        read_fifo(p.bytes, bytes);
        p.size = static_cast<std::uint8_t>(bytes < p.bytes.size() ? bytes : p.bytes.size());
        break;
      }
      case PacketStatus::data_done:
        packets_[number % kEndpoints].whole = true;
        break;
      default:
        break;
    }
  }
  // Takes all words of the packet out of the FIFO and keeps those that have room.
  static void read_fifo(std::span<std::uint8_t> to, std::uint32_t bytes) {
    for (std::uint32_t i = 0; i < bytes; i += 4) {
      const std::uint32_t word = hardware(fifo(0));
      for (std::uint32_t k = 0; k < 4 && i + k < bytes && i + k < to.size(); ++k)
        to[i + k] = static_cast<std::uint8_t>(word >> (8 * k));
    }
  }

  static void flush_sending(std::uint32_t fifos) {
    hardware(kReset) = (1U << 5) | (fifos << 6);
    wait_for(kReset, 1U << 5, 0, kTries);
  }
  static void flush_receiving() {
    hardware(kReset) = 1U << 4;
    wait_for(kReset, 1U << 4, 0, kTries);
  }
  // 34.17.6, disabling: a waiting packet is removed.
  void disable_in(std::uint8_t number) {
    sending_[number] = false;
    if ((hardware(in(number)) & kEnable) != 0) {
      set_bits(in(number), kNak);
      set_bits(in(number), kDisable);
      wait_for(in(number) + kFlags, kDisabled, kDisabled, kTries);
      hardware(in(number) + kFlags) = kDisabled;
      flush_sending(number);
    }
    hardware(in(number) + kFlags) = kTransferred;
  }
  // The same for packets from the host: under a global NAK, which takes effect when its entry is out of the FIFO.
  void disable_out(std::uint8_t number, std::uint32_t with) {
    if ((hardware(out(number)) & kEnable) != 0) {
      set_bits(kDeviceControl, kSetGlobalNak);
      for (std::uint32_t i = 0; i < kTries && (hardware(kEvents) & kGlobalNakHolds) == 0; ++i) drain();
      // Unless the packet has just arrived.
      if ((hardware(out(number)) & kEnable) != 0) {
        set_bits(out(number), kDisable | kNak | with);
        wait_for(out(number) + kFlags, kDisabled, kDisabled, kTries);
        hardware(out(number) + kFlags) = kDisabled;
      }
      set_bits(kDeviceControl, kClearGlobalNak);
    }
    packets_[number].whole = false;
    hardware(out(number) + kFlags) = kTransferred;
  }

  std::array<Packet, kEndpoints> packets_{};
  std::array<bool, kEndpoints> sending_{};
  std::array<std::uint8_t, usb::Setup::kBytes> setup_{};
  bool setup_came_ = false;
  bool was_reset_ = false;
};
static_assert(usb::Port<OtgFs>);

}  // namespace flexspline::stm32f4
