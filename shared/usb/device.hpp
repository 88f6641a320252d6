// The device core: control transfers of endpoint 0 and the requests of USB 2.0, chapter 9, for one configuration made
// of any number of classes: `Device<FlexsplineIdentity, Port, Hid, ...>`, with the other classes of a board after Hid.
//
// Not thread safe: the port's calls, poll() and the application's use of a class come from one context.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "shared/usb/chapter9.hpp"
#include "shared/usb/descriptors.hpp"
#include "shared/usb/port.hpp"

namespace flexspline::usb {

// The access of a class to its endpoints, numbered from zero within the class. False: the endpoint is halted.
template <Port P>
class Link {
 public:
  Link(P& port, Place place, const std::uint32_t& halted) : port_(port), place_(place), halted_(halted) {}
  bool send(std::size_t i, std::span<const std::uint8_t> packet) {
    const auto number = static_cast<std::uint8_t>(place_.in + i);
    if ((halted_ >> (16 + number) & 1) != 0) return false;
    port_.send(number, packet);
    return true;
  }
  bool receive(std::size_t i) {
    const auto number = static_cast<std::uint8_t>(place_.out + i);
    if ((halted_ >> number & 1) != 0) return false;
    port_.receive(number);
    return true;
  }

 private:
  P& port_;
  Place place_;
  const std::uint32_t& halted_;
};

// The functions of a class that the core calls in addition to InterfaceClass (descriptors.hpp).
template <class C, class P>
concept ClassHooks = requires(C c, Link<P> link, const Setup& setup, std::span<std::uint8_t> room,
                              std::span<const std::uint8_t> data, std::size_t i, bool to_host) {
  c.start(link);    // configured: endpoints are open and have no transfer
  c.stop();         // no longer configured
  c.poll(link);     // sends and receives as far as possible
  c.sent(link, i);  // the host took the packet of endpoint i
  c.received(link, i, data);
  c.resume(link, to_host, i);  // transfers of an endpoint are cancelled: start again
  // Requests to its interfaces, GET_DESCRIPTOR among them. `room` holds kControlBytes, for generated data.
  { c.control_in(setup, room) } -> std::same_as<Reply>;
  { c.control_out(setup, data) } -> std::same_as<bool>;
  // Optional: kAlternates with set_alternate(number) and alternate(), of a class without endpoints; and
  // control_done(setup), when the host has seen the end of a request.
};

// Alternate settings with endpoints of their own are not supported.
template <class C>
constexpr bool alternates_have_no_endpoints() {
  if constexpr (requires { C::kAlternates; }) return C::kInEndpoints + C::kOutEndpoints == 0;
  return true;
}

// `I` is an identity (identity.hpp).
template <class I, Port P, InterfaceClass... C>
class Device {
  static_assert((ClassHooks<C, P> && ...));
  static_assert((alternates_have_no_endpoints<C>() && ...));
  using Parts = Composition<C...>;

 public:
  static constexpr Bytes<18> kDevice = device_descriptor<I>();
  static constexpr auto kConfiguration = [] {
    auto bytes = Parts::kConfiguration;
    if (kCanWake<P>) bytes[7] |= kAttributeRemoteWakeup;
    return bytes;
  }();
  static_assert(check_configuration(kConfiguration) == DescriptorFinding::none);
  static_assert(kDevice[0] == kDevice.size());
  static constexpr std::size_t kLongestString = 31;
  static_assert(I::kManufacturer.size() <= kLongestString && I::kProduct.size() <= kLongestString);

  // `serial` has to outlive the device; only its first 31 characters are shown.
  Device(P& port, std::string_view serial) : port_(port), serial_(shown(serial)) {}

  template <class Class>
  Class& get() {
    return std::get<Class>(classes_);
  }
  bool configured() const { return configured_; }
  std::uint8_t address() const { return address_; }

  // The bus is suspended: nothing is sent, and waiting transfers continue afterwards. Address and configuration stay.
  bool is_suspended() const { return suspended_; }
  // Wakes a sleeping host that has allowed it; false otherwise.
  bool wake_host() {
    if constexpr (kCanWake<P>) {
      if (suspended_ && may_wake_) {
        port_.wake();
        return true;
      }
    }
    return false;
  }

  // Background: sends the data that the application gave its classes.
  void poll() {
    if (!configured_ || suspended_) return;
    for_each_class([&](auto& c, std::size_t i) {
      Link<P> link(port_, Parts::kPlaces[i], halted_);
      c.poll(link);
    });
  }

  // The port's calls (port.hpp).
  void reset() {
    configure(false);
    address_ = 0;
    stage_ = Stage::idle;
    suspended_ = may_wake_ = false;
  }
  void suspended() { suspended_ = true; }
  void resumed() { suspended_ = false; }
  void setup(std::span<const std::uint8_t, Setup::kBytes> bytes) {
    setup_ = Setup::of(bytes);
    stage_ = Stage::idle;
    if (setup_.to_host()) {
      const Reply reply = answer();
      if (!reply.accepted) return refuse();
      if (setup_.length == 0) return begin_status_in();
      begin_data_in(reply.data);
    } else if (setup_.length == 0) {
      finish_out({});
    } else if (setup_.length > buffer_.size()) {
      refuse();
    } else {
      stage_ = Stage::data_out;
      got_ = 0;
      port_.receive(0);
    }
  }
  void received(std::uint8_t number, std::span<const std::uint8_t> packet) {
    if (number == 0) return received_control(packet);
    if (!configured_) return;
    for_each_class([&](auto& c, std::size_t i) {
      const Place place = Parts::kPlaces[i];
      const std::size_t at = static_cast<std::size_t>(number) - place.out;
      if (number < place.out || at >= c.kOutEndpoints) return;
      Link<P> link(port_, place, halted_);
      c.received(link, at, packet);
    });
  }
  void sent(std::uint8_t number) {
    if (number == 0) return sent_control();
    if (!configured_) return;
    for_each_class([&](auto& c, std::size_t i) {
      const Place place = Parts::kPlaces[i];
      const std::size_t at = static_cast<std::size_t>(number) - place.in;
      if (number < place.in || at >= c.kInEndpoints) return;
      Link<P> link(port_, place, halted_);
      c.sent(link, at);
    });
  }

 private:
  enum class Stage : std::uint8_t { idle, data_in, data_out, status_in, status_out };
  // A string descriptor or the data of a class.
  static constexpr std::size_t kBufferBytes = [] {
    std::size_t most = 2 + 2 * kLongestString;
    ((most = most < C::kControlBytes ? std::size_t{C::kControlBytes} : most), ...);
    return most;
  }();

  template <class Use>
  void for_each_class(Use use) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      (use(std::get<i>(classes_), i), ...);
    }
    (std::index_sequence_for<C...>{});
  }

  // Stages of a control transfer (USB 2.0, 8.5.3).

  void refuse() {
    stage_ = Stage::idle;
    port_.stall(0);
    port_.stall(kToHost);
  }
  void begin_status_in() {
    stage_ = Stage::status_in;
    if (P::kAddressBeforeStatus && is_set_address()) port_.set_address(setup_.value_low());
    port_.send(0, {});
  }
  void begin_data_in(std::span<const std::uint8_t> data) {
    // Data that are shorter than the host asked for end with a short packet, which may be an empty one.
    ends_empty_ = data.size() < setup_.length && data.size() % kPacketBytes == 0;
    left_ = data.size() < setup_.length ? data : data.first(setup_.length);
    stage_ = Stage::data_in;
    port_.receive(0);  // the host may end the transfer before it has all
    send_next();
  }
  void send_next() {
    const auto packet = left_.first(left_.size() < kPacketBytes ? left_.size() : kPacketBytes);
    left_ = left_.subspan(packet.size());
    if (packet.empty()) ends_empty_ = false;
    port_.send(0, packet);
  }
  void sent_control() {
    if (stage_ == Stage::data_in) {
      if (left_.empty() && !ends_empty_) {
        stage_ = Stage::status_out;
      } else {
        send_next();
      }
    } else if (stage_ == Stage::status_in) {
      if (is_set_address()) {
        address_ = setup_.value_low();
        if (!P::kAddressBeforeStatus) port_.set_address(address_);
      }
      done();
    }
  }
  void received_control(std::span<const std::uint8_t> packet) {
    if (stage_ == Stage::data_out) {
      if (packet.size() > setup_.length - got_) return refuse();
      for (const std::uint8_t byte : packet) buffer_[got_++] = byte;
      if (got_ == setup_.length) return finish_out(std::span(buffer_).first(got_));
      if (packet.size() < kPacketBytes) return refuse();  // less than promised
      port_.receive(0);
    } else if (stage_ == Stage::data_in || stage_ == Stage::status_out) {
      if (!packet.empty()) return refuse();
      done();
    }
  }
  void finish_out(std::span<const std::uint8_t> data) {
    if (!accept(data)) return refuse();
    begin_status_in();
  }
  void done() {
    stage_ = Stage::idle;
    if (setup_.kind() == RequestKind::standard || setup_.recipient() != Recipient::interface) return;
    for_class_of_interface([&](auto& c, std::size_t) {
      if constexpr (requires { c.control_done(setup_); }) c.control_done(setup_);
    });
  }

  // Requests.

  // Not substr(), which brings the library's exceptions into an image.
  static constexpr std::string_view shown(std::string_view text) {
    return {text.data(), text.size() < kLongestString ? text.size() : kLongestString};
  }
  bool is_set_address() const {
    return setup_.kind() == RequestKind::standard && setup_.recipient() == Recipient::device && !setup_.to_host() &&
           setup_.request == static_cast<std::uint8_t>(StandardRequest::set_address);
  }
  // Calls `use` for the class that has the interface of wIndex; false where there is none.
  template <class Use>
  bool for_class_of_interface(Use use) {
    bool found = false;
    for_each_class([&](auto& c, std::size_t i) {
      const Place place = Parts::kPlaces[i];
      if (setup_.index < place.interface || setup_.index >= place.interface + c.kInterfaces) return;
      found = true;
      use(c, i);
    });
    return found;
  }
  // The bit of an endpoint in halted_, zero where wIndex names none.
  std::uint32_t endpoint_bit() const {
    std::uint32_t bit = 0;
    for_each_endpoint(kConfiguration, [&](const EndpointSetup& e, std::uint8_t, std::uint8_t) {
      if (e.address == setup_.index) bit = bit_of(e.address);
    });
    return bit;
  }
  static constexpr std::uint32_t bit_of(std::uint8_t address) {
    return std::uint32_t{1} << ((address & kEndpointNumber) + ((address & kToHost) != 0 ? 16 : 0));
  }

  Reply answer() {
    if (setup_.recipient() == Recipient::interface) return answer_interface();
    if (setup_.kind() != RequestKind::standard) return kRefused;
    const auto request = static_cast<StandardRequest>(setup_.request);
    if (setup_.recipient() == Recipient::device) {
      if (request == StandardRequest::get_descriptor) return answer_descriptor();
      if (setup_.index != 0 || setup_.value != 0) return kRefused;
      if (request == StandardRequest::get_status && setup_.length == 2)
        return made(1 | (may_wake_ ? kStatusRemoteWakeup : 0), 0);  // self powered
      if (request == StandardRequest::get_configuration && setup_.length == 1 && address_ != 0)
        return made(configured_ ? 1 : 0);
    } else if (setup_.recipient() == Recipient::endpoint && request == StandardRequest::get_status &&
               setup_.value == 0 && setup_.length == 2) {
      if ((setup_.index & ~kToHost) == 0 && address_ != 0) return made(0, 0);
      if (const std::uint32_t bit = endpoint_bit(); configured_ && bit != 0) return made((halted_ & bit) != 0, 0);
    }
    return kRefused;
  }
  Reply answer_interface() {
    Reply reply = kRefused;
    if (!configured_) return reply;
    for_class_of_interface([&](auto& c, std::size_t) {
      const auto request = static_cast<StandardRequest>(setup_.request);
      if (setup_.kind() != RequestKind::standard || request == StandardRequest::get_descriptor) {
        reply = c.control_in(setup_, std::span(buffer_));
      } else if (request == StandardRequest::get_status && setup_.value == 0 && setup_.length == 2) {
        reply = made(0, 0);
      } else if (request == StandardRequest::get_interface && setup_.value == 0 && setup_.length == 1) {
        if constexpr (requires { c.alternate(); }) {
          reply = made(c.alternate());
        } else {
          reply = made(0);
        }
      }
    });
    return reply;
  }
  template <class... B>
  Reply made(B... bytes) {
    std::size_t n = 0;
    ((buffer_[n++] = static_cast<std::uint8_t>(bytes)), ...);
    return reply_with(std::span(buffer_).first(n));
  }
  Reply answer_descriptor() {
    const std::uint8_t index = setup_.value_low();
    switch (static_cast<DescriptorType>(setup_.value_high())) {
      case DescriptorType::device:
        return index == 0 && setup_.index == 0 ? reply_with(kDevice) : kRefused;
      case DescriptorType::configuration:
        return index == 0 && setup_.index == 0 ? reply_with(kConfiguration) : kRefused;
      case DescriptorType::string:
        return answer_string(index);
      default:  // a device qualifier is for devices with high speed
        return kRefused;
    }
  }
  Reply answer_string(std::uint8_t index) {
    constexpr auto kType = static_cast<std::uint8_t>(DescriptorType::string);
    if (index == 0) return setup_.index == 0 ? made(4, kType, low(kEnglish), high(kEnglish)) : kRefused;
    if (setup_.index != kEnglish) return kRefused;
    const std::string_view text = string(index);
    if (text.empty()) return kRefused;
    std::size_t n = 2;
    for (const char c : shown(text)) {
      const auto byte = static_cast<std::uint8_t>(c);
      buffer_[n++] = byte < 0x80 ? byte : std::uint8_t{'?'};  // ASCII, as UTF-16
      buffer_[n++] = 0;
    }
    buffer_[0] = low(n);
    buffer_[1] = kType;
    return reply_with(std::span(buffer_).first(n));
  }
  std::string_view string(std::uint8_t index) const {
    if (index == kManufacturerString) return I::kManufacturer;
    if (index == kProductString) return I::kProduct;
    if (index == kSerialString) return serial_;
    return Parts::class_string(index);
  }

  // A request without data, or data from the host.
  bool accept(std::span<const std::uint8_t> data) {
    const auto request = static_cast<StandardRequest>(setup_.request);
    if (setup_.kind() != RequestKind::standard) return accept_of_class(data);
    if (!data.empty()) return false;
    switch (setup_.recipient()) {
      case Recipient::device:
        if (setup_.index != 0) return false;
        if (request == StandardRequest::set_address) return setup_.value < 128 && !configured_;
        if (kCanWake<P> && setup_.value == kDeviceRemoteWakeup && address_ != 0 &&
            (request == StandardRequest::set_feature || request == StandardRequest::clear_feature)) {
          may_wake_ = request == StandardRequest::set_feature;
          return true;
        }
        if (request != StandardRequest::set_configuration || setup_.value > 1 || address_ == 0) return false;
        configure(setup_.value == 1);
        return true;
      case Recipient::interface:
        return request == StandardRequest::set_interface && configured_ && set_interface();
      case Recipient::endpoint:
        return setup_.value == kEndpointHalt && set_halt(request);
      default:
        return false;
    }
  }
  bool accept_of_class(std::span<const std::uint8_t> data) {
    bool accepted = false;
    if (!configured_ || setup_.recipient() != Recipient::interface) return false;
    for_class_of_interface([&](auto& c, std::size_t) { accepted = c.control_out(setup_, data); });
    return accepted;
  }
  bool set_interface() {
    bool accepted = false;
    for_class_of_interface([&](auto& c, std::size_t i) {
      if constexpr (requires { c.kAlternates; }) {
        accepted = setup_.value < c.kAlternates;
        if (accepted) c.set_alternate(setup_.value_low());
      } else if (setup_.value == 0) {
        accepted = true;
        c.stop();
        open_endpoints(i);
        Link<P> link(port_, Parts::kPlaces[i], halted_);
        c.start(link);
      }
    });
    return accepted;
  }
  bool set_halt(StandardRequest request) {
    if ((setup_.index & ~kToHost) == 0) return request == StandardRequest::clear_feature && address_ != 0;
    const std::uint32_t bit = endpoint_bit();
    if (!configured_ || bit == 0) return false;
    const std::uint8_t address = low(setup_.index);
    if (request == StandardRequest::set_feature) {
      halted_ |= bit;
      port_.stall(address);
      return true;
    }
    if (request != StandardRequest::clear_feature) return false;
    halted_ &= ~bit;
    port_.unstall(address);
    for_each_class([&](auto& c, std::size_t i) {
      const Place place = Parts::kPlaces[i];
      const bool to_host = (address & kToHost) != 0;
      const std::size_t first = to_host ? place.in : place.out, count = to_host ? c.kInEndpoints : c.kOutEndpoints;
      const std::size_t number = address & kEndpointNumber;
      if (number < first || number >= first + count) return;
      Link<P> link(port_, place, halted_);
      c.resume(link, to_host, number - first);
    });
    return true;
  }

  void open_endpoints(std::size_t of_class) {
    const Place place = Parts::kPlaces[of_class];
    const std::size_t end =
        of_class + 1 < Parts::kClasses ? Parts::kPlaces[of_class + 1].interface : Parts::kInterfaces;
    for_each_endpoint(kConfiguration, [&](const EndpointSetup& e, std::uint8_t interface, std::uint8_t) {
      if (interface < place.interface || interface >= end) return;
      halted_ &= ~bit_of(e.address);
      port_.open(e);
    });
  }
  void configure(bool on) {
    if (configured_) {
      for_each_class([](auto& c, std::size_t) { c.stop(); });
      for_each_endpoint(kConfiguration,
                        [&](const EndpointSetup& e, std::uint8_t, std::uint8_t) { port_.close(e.address); });
    }
    configured_ = on;
    if (!on) return;
    for_each_class([&](auto& c, std::size_t i) {
      open_endpoints(i);
      Link<P> link(port_, Parts::kPlaces[i], halted_);
      c.start(link);
    });
  }

  P& port_;
  std::string_view serial_;
  std::tuple<C...> classes_{};
  Setup setup_{};
  Stage stage_ = Stage::idle;
  bool configured_ = false;
  bool ends_empty_ = false;
  bool suspended_ = false;
  bool may_wake_ = false;
  std::uint8_t address_ = 0;
  std::uint32_t halted_ = 0;  // a bit for each endpoint number: OUT, and IN from bit 16 on
  std::size_t got_ = 0;
  std::span<const std::uint8_t> left_{};
  std::array<std::uint8_t, kBufferBytes> buffer_{};
};

}  // namespace flexspline::usb
