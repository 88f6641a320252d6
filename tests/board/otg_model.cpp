#include "tests/board/otg_model.hpp"

#include <algorithm>
#include <string>

namespace flexspline::tests {
namespace {

// Bits of an endpoint's control register.
constexpr std::uint32_t kActive = 1U << 15, kNakHolds = 1U << 17, kStall = 1U << 21, kClearNak = 1U << 26,
                        kSetNak = 1U << 27, kData0 = 1U << 28, kData1 = 1U << 29, kDisable = 1U << 30,
                        kEnable = 1U << 31;
constexpr std::uint32_t kTransferred = 1, kDisabled = 2, kSetupDone = 8;
enum Came : std::uint32_t { kGlobalNak = 1, kData = 2, kDataDone = 3, kSetupStage = 4, kSetup = 6 };

std::uint32_t packets(std::uint32_t size) {
  return size >> 19 & 0x3FF;
}

}  // namespace

std::uint32_t OtgModel::read(std::uint32_t offset) {
  switch (offset) {
    case 0x004:
      return otg_events_;
    case 0x00C:
      return setup_;
    case 0x010:
      return 1U << 31;  // idle; resets and flushes end at once
    case 0x014: {
      const bool nak_taken = global_nak_ && std::none_of(received_.begin(), received_.end(), [](const Entry& e) {
                               return (e.status >> 17 & 15) == kGlobalNak;
                             });
      return events_ | (received_.empty() ? 0U : 1U << 4) | (nak_taken ? 1U << 7 : 0U);
    }
    case 0x020:
      return pop();
    case 0x024:
      return receive_words_;
    case 0x038:
      return phy_;
    case 0x800:
      return device_;
    case 0x804:
      return device_control_;
    default:
      break;
  }
  if (offset >= 0x1000 && offset < 0x2000 + 0x1000 * (kEndpoints - 1)) {
    if (opened_.empty()) {
      machine_.violation("an empty receive FIFO is read");
      return 0;
    }
    const std::uint32_t word = opened_.front();
    opened_.pop_front();
    return word;
  }
  const bool to_host = offset >= 0x900 && offset < 0x900 + 0x20 * kEndpoints;
  if (to_host || (offset >= 0xB00 && offset < 0xB00 + 0x20 * kEndpoints)) {
    const Endpoint& e = (to_host ? in_ : out_)[(offset & 0xFF) >> 5];
    switch (offset & 0x1F) {
      case 0x00:
        return e.control;
      case 0x08:
        return e.flags;
      case 0x10:
        return e.size;
      case 0x18:
        return space((offset & 0xFF) >> 5);
      default:
        break;
    }
  }
  return 0;
}

void OtgModel::write(std::uint32_t offset, std::uint32_t value) {
  switch (offset) {
    case 0x004:
      otg_events_ &= ~value;
      if (otg_events_ == 0) events_ &= ~(1U << 2);
      return;
    case 0x00C:
      setup_ = value;
      return;
    case 0x010:
      if ((value & 1) != 0) setup_ = phy_ = 0;
      if ((value & (1U << 4)) != 0) {
        received_.clear();
        opened_.clear();
      }
      if ((value & (1U << 5)) != 0)
        for (std::size_t i = 0; i < kEndpoints; ++i)
          if ((value >> 6 & 31) == i || (value >> 6 & 31) == 16) in_[i].words.clear();
      return;
    case 0x014:
      events_ &= ~value | (1U << 2);
      return;
    case 0x024:
      receive_words_ = value;
      return;
    case 0x028:
      fifos_[0] = value;
      return;
    case 0x038:
      phy_ = value;
      return;
    case 0x800:
      device_ = value;
      return;
    case 0x804:
      if ((value & (1U << 9)) != 0) {
        global_nak_ = true;
        push(kGlobalNak << 17, {});
      }
      if ((value & (1U << 10)) != 0) global_nak_ = false;
      device_control_ = value & ~0x780U;
      check_fifos();
      return;
    case 0xE00:
      return;
    default:
      break;
  }
  if (offset >= 0x104 && offset < 0x104 + 4 * (kEndpoints - 1)) {
    fifos_[(offset - 0x100) / 4] = value;
  } else if (offset >= 0x1000 && offset < 0x1000 + 0x1000 * kEndpoints) {
    const std::size_t number = (offset >> 12) - 1;
    Endpoint& e = in_[number];
    if ((e.control & kEnable) == 0) machine_.violation("data for an endpoint that is not enabled");
    if (space(number) == 0) machine_.violation("a transmit FIFO runs over");
    e.words.push_back(value);
  } else if (offset >= 0x900 && offset < 0x900 + 0x20 * kEndpoints) {
    write_endpoint(in_[(offset & 0xFF) >> 5], (offset & 0xFF) >> 5, true, offset & 0x1F, value);
  } else if (offset >= 0xB00 && offset < 0xB00 + 0x20 * kEndpoints) {
    write_endpoint(out_[(offset & 0xFF) >> 5], (offset & 0xFF) >> 5, false, offset & 0x1F, value);
  } else {
    machine_.violation("a register of the USB controller that is not modelled: " + std::to_string(offset));
  }
}

void OtgModel::write_endpoint(Endpoint& e, std::size_t number, bool in, std::uint32_t offset, std::uint32_t value) {
  if (offset == 0x08) {
    e.flags &= ~value;
  } else if (offset == 0x10) {
    if ((e.control & kEnable) != 0) machine_.violation("the size of a transfer is written while it goes on");
    e.size = value;
  } else if (offset == 0x00) {
    const std::uint32_t before = e.control;
    const std::uint32_t kept = before & (kNakHolds | kEnable);
    e.control = (value & 0x03EF87FF) | kept;
    if ((value & kSetNak) != 0) e.control |= kNakHolds;
    if ((value & kClearNak) != 0) e.control &= ~kNakHolds;
    if ((value & kData0) != 0) e.data1 = false;
    if ((value & kData1) != 0) e.data1 = true;
    if ((value & kDisable) != 0) {
      if (!in && number == 0) machine_.violation("endpoint 0 OUT cannot be disabled");
      if ((before & kEnable) == 0) machine_.violation("an endpoint is disabled that was not enabled");
      if (in && (e.control & kNakHolds) == 0) machine_.violation("an IN endpoint is disabled without NAK");
      if (!in && (read(0x014) & (1U << 7)) == 0)
        machine_.violation("an OUT endpoint is disabled without the global NAK");
      e.control &= ~kEnable;
      e.flags |= kDisabled;
    } else if ((value & kEnable) != 0 && (before & kEnable) == 0) {
      if (in && !e.words.empty()) machine_.violation("a packet begins behind an old one in its FIFO");
      if (packets(e.size) != 1) machine_.violation("an endpoint is enabled for no packet");
      if (!active(e, number)) machine_.violation("an endpoint is enabled that is not active");
      e.control |= kEnable;
    }
  } else {
    machine_.violation("a register of an endpoint that is not modelled");
  }
}

void OtgModel::push(std::uint32_t status, std::span<const std::uint8_t> bytes) {
  Entry entry{status | static_cast<std::uint32_t>(bytes.size() << 4)};
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 4 && i + k < bytes.size(); ++k) word |= std::uint32_t{bytes[i + k]} << (8 * k);
    entry.words.push_back(word);
  }
  received_.push_back(entry);
}
std::uint32_t OtgModel::pop() {
  if (!opened_.empty()) machine_.violation("an entry is popped before the words of the one before were read");
  if (received_.empty()) {
    machine_.violation("an empty receive FIFO is popped");
    return 0;
  }
  const Entry entry = received_.front();
  received_.pop_front();
  opened_.assign(entry.words.begin(), entry.words.end());
  Endpoint& e = out_[entry.status & 3];
  const std::uint32_t came = entry.status >> 17 & 15;
  if (came == kDataDone || came == kSetupStage) {
    e.control &= ~kEnable;
    e.flags |= came == kDataDone ? kTransferred : kSetupDone;
  }
  return entry.status;
}

void OtgModel::check_fifos() {
  if ((device_control_ & 2) != 0 || fifos_are_good_) return;
  fifos_are_good_ = true;
  std::uint32_t at = receive_words_;
  // RM0090, 34.11.1: SETUPs 10, a packet and its status twice, one for each OUT endpoint that ends, one for the NAK.
  if (receive_words_ < 10 + 2 * (64 / 4 + 1) + 4 + 1) machine_.violation("the receive FIFO is too small");
  for (const std::uint32_t fifo : fifos_) {
    if ((fifo & 0xFFFF) != at || (fifo >> 16) < 16) machine_.violation("a transmit FIFO overlaps or is too small");
    at += fifo >> 16;
  }
  if (at > 320) machine_.violation("the FIFOs are larger than the memory");
}

bool OtgModel::attached() const {
  const bool device = (setup_ >> 30 & 1) != 0 && (phy_ >> 16 & 1) != 0 && (device_ & 3) == 3;
  const bool sees_power = plugged_ && ((phy_ >> 19 & 1) != 0 || (phy_ >> 21 & 1) != 0);
  return device && sees_power && (device_control_ & 2) == 0;
}
void OtgModel::plug(bool in) {
  if (plugged_ && !in) {
    otg_events_ |= 1U << 2;
    events_ |= 1U << 2;
  }
  plugged_ = in;
}
void OtgModel::bus_reset() {
  events_ |= (1U << 12) | (1U << 13);
  address_ = 0;
  for (std::size_t i = 0; i < kEndpoints; ++i) {
    for (Endpoint* e : {&in_[i], &out_[i]}) {
      e->control &= i == 0 ? ~(kEnable | kStall) : ~(kActive | kEnable | kStall);
      e->control |= kNakHolds;
    }
  }
}

Handshake OtgModel::setup(std::uint8_t to, std::span<const std::uint8_t> bytes) {
  if (!attached() || to != address()) return Handshake::silence;
  if ((out_[0].size >> 29 & 3) == 0) {
    machine_.violation("a SETUP comes that nothing was prepared for");
    return Handshake::silence;
  }
  for (Endpoint* e : {&in_[0], &out_[0]}) {
    e->control = (e->control & ~kStall) | kNakHolds;
    e->data1 = true;
  }
  push(kSetup << 17, bytes);
  push(kSetupStage << 17, {});
  return Handshake::ack;
}
Handshake OtgModel::in(std::uint8_t to, std::uint8_t endpoint, std::vector<std::uint8_t>& packet, bool& data1) {
  Endpoint& e = in_.at(endpoint);
  if (!attached() || to != address() || !active(e, endpoint)) return Handshake::silence;
  if ((e.control & kStall) != 0) return Handshake::stall;
  const std::uint32_t bytes = e.size & 0x7F;
  const bool whole = e.words.size() >= (bytes + 3) / 4;
  if ((e.control & kEnable) == 0 || (e.control & kNakHolds) != 0 || packets(e.size) == 0 || !whole)
    return Handshake::nak;
  if (e.words.size() != (bytes + 3) / 4) machine_.violation("more in a transmit FIFO than the packet has");
  packet.clear();
  for (std::uint32_t i = 0; i < bytes; ++i)
    packet.push_back(static_cast<std::uint8_t>(e.words[i / 4] >> (8 * (i % 4))));
  if (endpoint == 0 && bytes == 0) address_ = static_cast<std::uint8_t>(device_ >> 4 & 0x7F);
  e.words.clear();
  data1 = e.data1;
  e.data1 = !e.data1;
  e.size = 0;
  e.control &= ~kEnable;
  e.flags |= kTransferred;
  return Handshake::ack;
}
Handshake OtgModel::out(std::uint8_t to, std::uint8_t endpoint, std::span<const std::uint8_t> packet, bool data1) {
  Endpoint& e = out_.at(endpoint);
  if (!attached() || to != address() || !active(e, endpoint)) return Handshake::silence;
  if ((e.control & kStall) != 0) return Handshake::stall;
  if (global_nak_ || (e.control & kEnable) == 0 || (e.control & kNakHolds) != 0 || packets(e.size) == 0)
    return Handshake::nak;
  if (data1 != e.data1) return Handshake::ack;  // sent again, as its handshake was lost: taken and forgotten
  e.data1 = !e.data1;
  e.size &= 0x60000000;
  push((kData << 17) | endpoint, packet);
  push((kDataDone << 17) | endpoint, {});
  return Handshake::ack;
}

}  // namespace flexspline::tests
