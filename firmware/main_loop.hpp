// The main loop of a drive: its links to hosts, and the background work of application and service.
#pragma once

#include <concepts>
#include <tuple>

namespace flexspline::firmware {

// A way to the drive: a serial line, USB, a fieldbus. poll() handles what arrived and sends what waits; true while a
// host is there that has the drive for itself.
template <class T>
concept Link = requires(T& link) {
  { link.poll() } -> std::same_as<bool>;
};

template <class Application, class Service, Link... Links>
class MainLoop {
 public:
  MainLoop(Application& application, Service& service, Links&... links)
      : application_(application), service_(service), links_(links...) {}

  // One pass, from main() alone. Links are asked in the order of the list; those after one that has a host are passed
  // over.
  void poll() {
    std::apply([](auto&... link) { static_cast<void>((link.poll() || ...)); }, links_);
    application_.background();
    service_.background();
  }

 private:
  Application& application_;
  Service& service_;
  std::tuple<Links&...> links_;
};

}  // namespace flexspline::firmware
