// Round trips over HID: a request to the twin and its answer, compared with a device that sends each report back, both
// behind the same USB/IP server and asked by the same host; and with 64 bytes there and back over a bare socket, which
// is what the operating system takes of it. Wall time, as most of it is waiting for the other process. Usage:
// flexspline_round_trips_bench TWIN ECHO
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <thread>
#include <vector>

#include "shared/protocol/payloads.hpp"
#include "tests/bench/rows.hpp"
#include "tests/support/port_process.hpp"
#include "tests/support/usbip_link.hpp"

namespace flexspline {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kRounds = 9;
constexpr int kTrips = 1000;  // a round
constexpr transport::Milliseconds kLimit{5000};

// Round trips a second of each, medians of kRounds; by turns, so that what else the machine does hits all alike.
std::vector<double> rates(const std::vector<std::function<void()>>& trips) {
  std::vector<std::vector<double>> all(trips.size());
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t k = 0; k < trips.size(); ++k) {
      const auto begin = Clock::now();
      for (int i = 0; i < kTrips; ++i) trips[k]();
      all[k].push_back(kTrips / std::chrono::duration<double>(Clock::now() - begin).count());
    }
  std::vector<double> medians;
  for (std::vector<double>& one : all) {
    std::ranges::nth_element(one, one.begin() + kRounds / 2);
    medians.push_back(one[kRounds / 2]);
  }
  return medians;
}

// A request and what comes back for it. Throws std::runtime_error where that is another message.
void there_and_back(transport::Link& link, std::uint8_t& number, bool is_echo) {
  number = static_cast<std::uint8_t>(number % 255 + 1);
  const protocol::Message asked = protocol::request(protocol::Kind::identify, number, protocol::Hello{});
  link.send(asked);
  const auto back = link.receive(kLimit);
  if (!back || back->number != number || back->is_answer() == is_echo)
    throw std::runtime_error(link.name() + " gives another answer");
}

// 64 bytes there and back within this process, over a socket of its own.
class BareSocket {
 public:
  BareSocket() {
    const int listening = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    here_ = socket(AF_INET, SOCK_STREAM, 0);
    auto* at = reinterpret_cast<sockaddr*>(&address);
    if (bind(listening, at, size) != 0 || listen(listening, 1) != 0 || getsockname(listening, at, &size) != 0 ||
        connect(here_, at, size) != 0)
      throw std::runtime_error("no socket");
    there_ = accept(listening, nullptr, nullptr);
    close(listening);
    const int on = 1;
    for (const int end : {here_, there_}) setsockopt(end, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    echo_ = std::thread([end = there_] {
      std::array<char, 64> report;
      while (recv(end, report.data(), report.size(), MSG_WAITALL) == static_cast<ssize_t>(report.size()))
        if (::send(end, report.data(), report.size(), MSG_NOSIGNAL) < 0) return;
    });
  }
  ~BareSocket() {
    close(here_);
    echo_.join();
    close(there_);
  }
  BareSocket(const BareSocket&) = delete;
  BareSocket& operator=(const BareSocket&) = delete;
  void there_and_back() {
    std::array<char, 64> report{1, 2, 3};
    if (::send(here_, report.data(), report.size(), MSG_NOSIGNAL) < 0 ||
        recv(here_, report.data(), report.size(), MSG_WAITALL) != static_cast<ssize_t>(report.size()))
      throw std::runtime_error("the socket is gone");
  }

 private:
  int here_ = -1, there_ = -1;
  std::thread echo_;
};

void compare(const char* twin_program, const char* echo_program) {
  const tests::PortProcess twin(twin_program, {"twin", "--usbip", "0"}), echo(echo_program, {"1"});
  tests::UsbIpLink to_twin(twin.port()), to_echo(echo.port());
  BareSocket socket;
  std::uint8_t number = 0;
  const auto found = rates({[&] { there_and_back(to_twin, number, false); },
                            [&] { there_and_back(to_echo, number, true); }, [&] { socket.there_and_back(); }});
  fmt::print("round trips of 64 bytes, a second (medians of {} times {})\n", kRounds, kTrips);
  fmt::print("  the twin over HID (USB/IP)             {:9.0f}\n", found[0]);
  fmt::print("  a device that only sends back, alike   {:9.0f}   ratio {:.2f}\n", found[1], found[0] / found[1]);
  fmt::print("  a bare socket                          {:9.0f}   ratio {:.3f}\n", found[2], found[0] / found[2]);
  bench::row("round trips over HID, a second", "-", "-", found[0]);
  bench::row("round trips over HID", "a device that only sends reports back", "-", found[0] / found[1]);
  bench::row("round trips over HID", "64 bytes over a bare socket", "-", found[0] / found[2]);
}

}  // namespace
}  // namespace flexspline

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "flexspline_round_trips_bench TWIN ECHO\n");
    return 2;
  }
  try {
    flexspline::compare(argv[1], argv[2]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "round_trips_bench: {}\n", error.what());
    return 1;
  }
  return 0;
}
