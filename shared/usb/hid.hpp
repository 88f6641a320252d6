// HID with vendor-defined reports of 64 bytes, one kind each way, on interrupt endpoints (HID 1.11). The protocol
// defines the meaning of the bytes. Reports wait in queues. One to the host whose queue is full is dropped and counted;
// from the host nothing is lost, as the endpoint answers NAK until there is room.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "shared/usb/chapter9.hpp"
#include "shared/usb/descriptors.hpp"

namespace flexspline::usb {

using Report = Bytes<kPacketBytes>;

// HID 1.11, 6.2.2: a collection of one input and one output of 64 bytes, on a vendor-defined page.
inline constexpr std::uint16_t kReportPage = 0xff00;
inline constexpr std::uint8_t kReportUsage = 0x01;
inline constexpr Bytes<25> kReportDescriptor = {
    0x06,
    low(kReportPage),
    high(kReportPage),  // usage page
    0x09,
    kReportUsage,  // usage
    0xa1,
    0x01,  // collection: application
    0x15,
    0x00,  //   logical minimum 0
    0x26,
    0xff,
    0x00,  //   logical maximum 255
    0x75,
    0x08,  //   report size 8 bits
    0x95,
    kPacketBytes,  //   report count
    0x09,
    0x02,  //   usage
    0x81,
    0x02,  // input: data, variable, absolute
    0x09,
    0x03,  //   usage
    0x91,
    0x02,  // output: the same; size and count stay in force
    0xc0,  // end
};

// Reports in the order of arrival. Not for two contexts at once.
template <std::size_t kReports>
class ReportQueue {
 public:
  std::size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  std::size_t room() const { return kReports - count_; }
  void clear() { count_ = 0; }
  // Fills a short report with zeros. Call it only if there is room.
  void push(std::span<const std::uint8_t> bytes) {
    Report& report = reports_[(first_ + count_++) % kReports];
    for (std::size_t i = 0; i < report.size(); ++i) report[i] = i < bytes.size() ? bytes[i] : std::uint8_t{0};
  }
  const Report& front() const { return reports_[first_]; }
  void pop() {
    first_ = (first_ + 1) % kReports;
    --count_;
  }

 private:
  std::array<Report, kReports> reports_{};
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

// With queues of this many reports to the host and from it.
template <std::size_t kToHostReports, std::size_t kFromHostReports>
class Hid {
  // One place is reserved for the packet that the endpoint may be receiving while another arrives by SET_REPORT.
  static_assert(kToHostReports >= 1 && kFromHostReports >= 2);

 public:
  // For the application.

  // False where the queue is full, which counts as dropped, or no host has configured the device, which does not. The
  // report is sent by the next Device::poll().
  bool send(const Report& report) {
    if (!running_) return false;
    if (to_host_.room() == 0) {
      ++dropped_to_host_;
      return false;
    }
    to_host_.push(report);
    return true;
  }
  // Places left: a frequent sender leaves some for answers.
  std::size_t room() const { return running_ ? to_host_.room() : 0; }
  // The oldest report from the host; false where there is none.
  bool receive(Report& report) {
    if (from_host_.empty()) return false;
    report = from_host_.front();
    from_host_.pop();
    return true;
  }
  // Since power on.
  std::uint32_t dropped_to_host() const { return dropped_to_host_; }
  std::uint32_t dropped_from_host() const {
    return dropped_from_host_;
  }  // SET_REPORT refused because the queue was full

  // For the device core (descriptors.hpp, device.hpp).

  static constexpr std::size_t kInterfaces = 1, kInEndpoints = 1, kOutEndpoints = 1;
  static constexpr std::size_t kControlBytes = kPacketBytes;
  static constexpr std::array<std::string_view, 0> kStrings{};
  static constexpr std::uint8_t kIntervalMs = 1;

  static constexpr Bytes<9> hid_descriptor() {
    return {9,
            kHidDescriptor,
            0x11,
            0x01,
            0,
            1,
            kReportDescriptorType,
            low(kReportDescriptor.size()),
            high(kReportDescriptor.size())};
  }
  static constexpr auto descriptors(Place place) {
    const EndpointSetup in{static_cast<std::uint8_t>(place.in | kToHost), TransferType::interrupt, kPacketBytes};
    const EndpointSetup out{place.out, TransferType::interrupt, kPacketBytes};
    return joined(interface_descriptor({.number = place.interface, .endpoints = 2, .code = 3}), hid_descriptor(),
                  endpoint_descriptor(in, kIntervalMs), endpoint_descriptor(out, kIntervalMs));
  }

  template <class Link>
  void start(Link& link) {
    running_ = true;
    poll(link);
  }
  // A later host must not get the answers to another one.
  void stop() {
    running_ = sending_ = receiving_ = false;
    to_host_.clear();
    from_host_.clear();
  }
  template <class Link>
  void poll(Link& link) {
    if (!sending_ && !to_host_.empty()) sending_ = link.send(0, to_host_.front());
    if (!receiving_ && from_host_.room() > 0) receiving_ = link.receive(0);
  }
  template <class Link>
  void sent(Link& link, std::size_t) {
    // It stays in its queue until the host has received it, so that a halt loses nothing.
    if (!sending_) return;
    sending_ = false;
    to_host_.pop();
    poll(link);
  }
  template <class Link>
  void received(Link& link, std::size_t, std::span<const std::uint8_t> packet) {
    if (!receiving_) return;
    receiving_ = false;
    if (!packet.empty()) from_host_.push(packet);
    poll(link);
  }
  template <class Link>
  void resume(Link& link, bool to_host, std::size_t) {
    (to_host ? sending_ : receiving_) = false;
    poll(link);
  }

  Reply control_in(const Setup& setup, std::span<std::uint8_t> room) {
    if (setup.kind() == RequestKind::standard) {
      static constexpr Bytes<9> kHid = hid_descriptor();
      if (setup.value_low() != 0) return kRefused;
      if (setup.value_high() == kHidDescriptor) return reply_with(kHid);
      return setup.value_high() == kReportDescriptorType ? reply_with(kReportDescriptor) : kRefused;
    }
    if (setup.kind() != RequestKind::of_class) return kRefused;
    switch (static_cast<Request>(setup.request)) {
      case Request::get_report: {
        // The next report, which stays in its queue; zeros where none waits.
        if (setup.value != kInputReport) return kRefused;
        const std::span<std::uint8_t> bytes = room.first(kPacketBytes);
        for (std::size_t i = 0; i < bytes.size(); ++i)
          bytes[i] = to_host_.empty() ? std::uint8_t{0} : to_host_.front()[i];
        return reply_with(bytes);
      }
      case Request::get_idle:
        if (setup.value != 0) return kRefused;
        room[0] = 0;
        return reply_with(room.first(1));
      default:  // GET_PROTOCOL is for boot devices
        return kRefused;
    }
  }
  bool control_out(const Setup& setup, std::span<const std::uint8_t> data) {
    if (setup.kind() != RequestKind::of_class) return false;
    switch (static_cast<Request>(setup.request)) {
      case Request::set_report:
        if (setup.value != kOutputReport || data.empty()) return false;
        if (from_host_.room() <= (receiving_ ? 1U : 0U)) {
          ++dropped_from_host_;
          return false;
        }
        from_host_.push(data);
        return true;
      case Request::set_idle:
        // Reports are sent when there is data; an idle rate is refused.
        return setup.value == 0 && data.empty();
      case Request::set_protocol:
        return setup.value == 1 && data.empty();  // the report protocol, which is the only one
      default:
        return false;
    }
  }

 private:
  // HID 1.11, 7.1 and 7.2.
  enum class Request : std::uint8_t {
    get_report = 1,
    get_idle = 2,
    get_protocol = 3,
    set_report = 9,
    set_idle = 10,
    set_protocol = 11,
  };
  static constexpr std::uint8_t kHidDescriptor = 0x21, kReportDescriptorType = 0x22;
  static constexpr std::uint16_t kInputReport = 0x0100, kOutputReport = 0x0200;  // type and number of the report

  ReportQueue<kToHostReports> to_host_;
  ReportQueue<kFromHostReports> from_host_;
  bool running_ = false;
  bool sending_ = false;
  bool receiving_ = false;
  std::uint32_t dropped_to_host_ = 0;
  std::uint32_t dropped_from_host_ = 0;
};

}  // namespace flexspline::usb
