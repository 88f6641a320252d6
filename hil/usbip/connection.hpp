#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>

#include "hil/usbip/bus.hpp"
#include "hil/usbip/wire.hpp"

namespace flexspline::usbip {

/// The protocol with one client, bytes in, bytes out, without a socket. For any input of a client, memory is bounded
/// and invalid messages end the connection.
class Connection {
 public:
  static constexpr std::int32_t kLongestTransfer = 65'536;
  static constexpr std::size_t kMostPending = 128;
  static constexpr std::size_t kMostOutput = 1U << 20;

  explicit Connection(Bus& bus) : bus_(bus) {}
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Bytes from the client, in pieces of any length.
  void take(std::span<const std::uint8_t> bytes);
  /// Continues transfers that had to wait for the device. Returns whether one of them ended.
  bool advance();
  /// Bytes to send; the sender removes those that it has sent.
  Buffer& output() { return output_; }
  /// Whether it accepts input: not while the client does not read.
  bool wants_input() const { return !finished() && output_.size() < kMostOutput; }
  /// No more input is read; close it once the output is sent.
  bool finished() const { return finished_ || (slot_ && !slot_->plugged); }
  /// The client's sending side ended.
  void input_ended();
  bool attached() const { return slot_ != nullptr; }
  /// Why it was ended, empty without an error of the client.
  const std::string& fault() const { return fault_; }

 private:
  struct Transfer {
    std::uint32_t sequence = 0;
    std::uint8_t endpoint = 0;
    bool to_host = false;
    std::uint32_t flags = 0;
    std::size_t length = 0;  // to the host
    Buffer data;
    std::size_t packets = 0;  // sent
  };

  std::size_t take_operation(std::span<const std::uint8_t> bytes);
  std::size_t take_command(std::span<const std::uint8_t> bytes);
  void list();
  void import(const std::string& bus_id);
  void submit(const CommandHead& head, std::span<const std::uint8_t> data);
  void control(const CommandHead& head, std::span<const std::uint8_t> data);
  void unlink(const CommandHead& head);
  bool try_transfer(Transfer& transfer);
  void end_transfer(std::uint32_t sequence, Status status, std::size_t actual, const Buffer& data);
  void fail(std::string why);

  Bus& bus_;
  std::shared_ptr<Slot> slot_;
  Buffer input_;
  Buffer output_;
  std::deque<Transfer> pending_;
  bool finished_ = false;
  std::string fault_;
};

}  // namespace flexspline::usbip
