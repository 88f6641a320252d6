// A model of OTG_FS as a full-speed device, and the bus before it (RM0090, 34; USB 2.0, 8). Transactions are the
// host's: setup(), in() and out() each are one, with the handshake that the bus would see.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "tests/board/machine.hpp"

namespace flexspline::tests {

enum class Handshake { ack, nak, stall, silence };

class OtgModel : public Peripheral {
 public:
  explicit OtgModel(Machine& machine) : machine_(machine) {}

  std::uint32_t read(std::uint32_t offset) override;
  void write(std::uint32_t offset, std::uint32_t value) override;

  // The host's side.

  // Whether D+ is pulled up: a device is there.
  bool attached() const;
  void plug(bool in);
  void bus_reset();
  void suspend() { events_ |= 1U << 11; }
  void resume() { events_ |= 1U << 31; }
  Handshake setup(std::uint8_t address, std::span<const std::uint8_t> bytes);
  // `data1`: which of the two the packet carried.
  Handshake in(std::uint8_t address, std::uint8_t endpoint, std::vector<std::uint8_t>& packet, bool& data1);
  Handshake out(std::uint8_t address, std::uint8_t endpoint, std::span<const std::uint8_t> packet, bool data1);
  // A new address is written before the status stage of SET_ADDRESS and holds from its end on.
  std::uint8_t address() const { return address_; }

 private:
  static constexpr std::size_t kEndpoints = 4;
  struct Endpoint {
    std::uint32_t control = 0, size = 0, flags = 0;
    bool data1 = false;
    std::deque<std::uint32_t> words;  // to the host
  };
  struct Entry {
    std::uint32_t status = 0;
    std::vector<std::uint32_t> words{};
  };
  bool active(const Endpoint& e, std::size_t number) const { return number == 0 || (e.control >> 15 & 1) != 0; }
  void write_endpoint(Endpoint& e, std::size_t number, bool in, std::uint32_t offset, std::uint32_t value);
  void push(std::uint32_t status, std::span<const std::uint8_t> bytes);
  std::uint32_t pop();
  std::uint32_t depth(std::size_t fifo) const { return fifos_.at(fifo) >> 16; }
  std::uint32_t space(std::size_t fifo) const {
    return depth(fifo) - static_cast<std::uint32_t>(in_.at(fifo).words.size());
  }
  void check_fifos();

  Machine& machine_;
  std::uint32_t events_ = 0, otg_events_ = 0, setup_ = 0, phy_ = 0, device_ = 0, device_control_ = 2,
                receive_words_ = 0;
  std::uint8_t address_ = 0;
  bool plugged_ = false, global_nak_ = false, fifos_are_good_ = false;
  std::array<std::uint32_t, kEndpoints> fifos_{};
  std::array<Endpoint, kEndpoints> in_{}, out_{};
  std::deque<Entry> received_;
  std::deque<std::uint32_t> opened_;  // words of the entry that was popped last
};

}  // namespace flexspline::tests
