#include "hil/usbip/connection.hpp"

#include <algorithm>
#include <bitset>
#include <utility>

namespace flexspline::usbip {
namespace {

constexpr std::uint32_t kFullSpeed = 2;
constexpr std::int32_t kNotIsochronous = -1;

// usbip_usb_device of the protocol, 312 bytes.
void put_device(Buffer& to, const Slot& slot) {
  const DeviceInfo& info = slot.host.info();
  put_text(to, "/sys/devices/flexspline/usb" + std::to_string(slot.bus) + "/" + slot.bus_id, 256);
  put_text(to, slot.bus_id, kBusIdBytes);
  put32(to, slot.bus);
  put32(to, slot.number);
  put32(to, kFullSpeed);
  put16(to, info.vendor);
  put16(to, info.product);
  put16(to, info.release);
  for (const std::uint8_t code : info.code) put8(to, code);
  put8(to, info.configuration);
  put8(to, info.configurations);
  put8(to, static_cast<std::uint8_t>(info.interfaces.size()));
}

}  // namespace

Connection::~Connection() {
  if (!slot_) return;
  slot_->imported = false;
  if (slot_->plugged) slot_->host.release();
}

void Connection::fail(std::string why) {
  fault_ = std::move(why);
  finished_ = true;
}

void Connection::input_ended() {
  // A client with a device that ends its stream has released it; one that requested the list still reads it.
  if (!input_.empty()) fail("the stream ended within a message");
  finished_ = true;
}

void Connection::take(std::span<const std::uint8_t> bytes) {
  input_.insert(input_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  while (!finished()) {
    const auto left = std::span<const std::uint8_t>(input_).subspan(at);
    const std::size_t used = slot_ ? take_command(left) : take_operation(left);
    if (used == 0) break;
    at += used;
  }
  input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(at));
}

// Both return the number of bytes that they used, zero where more are needed first.
std::size_t Connection::take_operation(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kOperationBytes) return 0;
  const OperationHead head = read_operation(bytes.first<kOperationBytes>());
  if (head.version != kVersion) return fail("not USB/IP 1.1.1"), 0;
  if (head.code == static_cast<std::uint16_t>(Operation::request_list)) {
    list();
    return kOperationBytes;
  }
  if (head.code != static_cast<std::uint16_t>(Operation::request_import)) return fail("not an operation of USB/IP"), 0;
  if (bytes.size() < kOperationBytes + kBusIdBytes) return 0;
  import(read_bus_id(bytes.subspan<kOperationBytes, kBusIdBytes>()));
  return kOperationBytes + kBusIdBytes;
}

void Connection::list() {
  put_operation(output_, Operation::reply_list, 0);
  put32(output_, static_cast<std::uint32_t>(bus_.slots().size()));
  for (const auto& slot : bus_.slots()) {
    put_device(output_, *slot);
    for (const auto& codes : slot->host.info().interfaces) {
      for (const std::uint8_t code : codes) put8(output_, code);
      put8(output_, 0);
    }
  }
  finished_ = true;
}

void Connection::import(const std::string& bus_id) {
  const std::shared_ptr<Slot> slot = bus_.find(bus_id);
  ImportStatus status = ImportStatus::ok;
  if (!slot) {
    status = ImportStatus::no_device;
  } else if (slot->imported) {
    status = ImportStatus::busy;
  } else if (!slot->host.enumerate()) {
    status = ImportStatus::not_available;
  }
  put_operation(output_, Operation::reply_import, static_cast<std::uint32_t>(status));
  if (status != ImportStatus::ok) {
    finished_ = true;
    return;
  }
  put_device(output_, *slot);
  slot->imported = true;
  slot_ = slot;
}

std::size_t Connection::take_command(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kCommandBytes) return 0;
  const CommandHead head = read_command(bytes.first<kCommandBytes>());
  if (head.command == static_cast<std::uint32_t>(Command::unlink)) {
    unlink(head);
    return kCommandBytes;
  }
  if (head.command != static_cast<std::uint32_t>(Command::submit)) return fail("not a command of USB/IP"), 0;
  if (head.device != slot_->device_id()) return fail("a transfer for a device that was not imported"), 0;
  if (head.direction > 1 || head.endpoint > 15) return fail("a transfer for no endpoint"), 0;
  if (head.length < 0 || head.length > kLongestTransfer) return fail("a transfer that is too long"), 0;
  if (head.isochronous_packets != 0 && head.isochronous_packets != kNotIsochronous)
    return fail("an isochronous transfer"), 0;
  const std::size_t data = head.direction == 0 ? static_cast<std::size_t>(head.length) : 0;
  if (bytes.size() < kCommandBytes + data) return 0;
  submit(head, bytes.subspan(kCommandBytes, data));
  return kCommandBytes + data;
}

void Connection::submit(const CommandHead& head, std::span<const std::uint8_t> data) {
  if (head.endpoint == 0) return control(head, data);
  if (pending_.size() >= kMostPending) return fail("too many transfers at once");
  Transfer transfer{.sequence = head.sequence,
                    .endpoint = static_cast<std::uint8_t>(head.endpoint),
                    .to_host = head.direction == 1,
                    .flags = head.flags,
                    .length = static_cast<std::size_t>(head.length),
                    .data = Buffer(data.begin(), data.end()),
                    .packets = 0};
  // Transfers of an endpoint keep their order.
  const bool waits = std::any_of(pending_.begin(), pending_.end(), [&](const Transfer& t) {
    return t.endpoint == transfer.endpoint && t.to_host == transfer.to_host;
  });
  if (waits || !try_transfer(transfer)) pending_.push_back(std::move(transfer));
}

void Connection::control(const CommandHead& head, std::span<const std::uint8_t> data) {
  const bool to_host = (head.setup[0] & 0x80) != 0;
  const std::size_t length = head.setup[6] | std::size_t{head.setup[7]} << 8;
  Buffer bytes(data.begin(), data.end());
  // A request without data may carry either direction.
  if (length != static_cast<std::size_t>(head.length) || (length != 0 && to_host != (head.direction == 1)))
    return end_transfer(head.sequence, Status::bad_request, 0, {});
  const Status status = slot_->host.control(head.setup, bytes);
  const bool is_short = to_host && bytes.size() < length && (head.flags & kShortIsAnError) != 0;
  if (status != Status::ok) return end_transfer(head.sequence, status, 0, {});
  end_transfer(head.sequence, is_short ? Status::too_short : status, bytes.size(), to_host ? bytes : Buffer{});
}

bool Connection::try_transfer(Transfer& t) {
  Status status = Status::ok;
  if (t.to_host) {
    if (slot_->host.in(t.endpoint, t.length, t.data, status) == HostController::Step::later) return false;
    if (status == Status::ok && t.data.size() < t.length && (t.flags & kShortIsAnError) != 0)
      status = Status::too_short;
    end_transfer(t.sequence, status, t.data.size(), t.data);
  } else {
    if (slot_->host.out(t.endpoint, t.data, (t.flags & kEndWithEmpty) != 0, t.packets, status) ==
        HostController::Step::later)
      return false;
    end_transfer(t.sequence, status, status == Status::ok ? t.data.size() : 0, {});
  }
  return true;
}

void Connection::end_transfer(std::uint32_t sequence, Status status, std::size_t actual, const Buffer& data) {
  put_submitted(output_, sequence, static_cast<std::int32_t>(status), actual);
  output_.insert(output_.end(), data.begin(), data.end());
}

void Connection::unlink(const CommandHead& head) {
  const auto found = std::find_if(pending_.begin(), pending_.end(),
                                  [&](const Transfer& t) { return t.sequence == head.unlink_sequence; });
  // Zero: it had ended before, and its result is being sent.
  const Status status = found == pending_.end() ? Status::ok : Status::unlinked;
  if (found != pending_.end()) pending_.erase(found);
  put_unlinked(output_, head.sequence, static_cast<std::int32_t>(status));
}

bool Connection::advance() {
  bool any = false;
  std::bitset<32> waits;
  for (auto t = pending_.begin(); t != pending_.end() && wants_input();) {
    const std::size_t endpoint = t->endpoint + (t->to_host ? 16U : 0U);
    if (!waits[endpoint] && try_transfer(*t)) {
      t = pending_.erase(t);
      any = true;
    } else {
      waits.set(endpoint);
      ++t;
    }
  }
  return any;
}

}  // namespace flexspline::usbip
