#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "hil/usbip/bus.hpp"
#include "hil/usbip/connection.hpp"

namespace flexspline::usbip {

inline constexpr std::uint16_t kUsualPort = 3240;

/// Offers devices to USB/IP clients of this machine: `usbip attach -r 127.0.0.1 -b 1-1`. It listens on loopback only,
/// as the protocol has neither passwords nor encryption. One thread: all work is done in serve(), so the application of
/// a device runs between two calls:
///   while (...) { if (!server.serve(1)) drive.run_some_ticks(); drive.background(); device.poll(); }
class Server {
 public:
  static constexpr std::size_t kMostConnections = 16;

  /// Port 0: any that is free. Throws std::runtime_error where it cannot listen.
  explicit Server(std::uint16_t port = kUsualPort);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::uint16_t port() const { return port_; }

  /// See Bus: `device` has to live until it is unplugged or the server ends.
  void plug(std::string_view bus_id, BusDevice& device) { bus_.plug(bus_id, device); }
  /// Its client loses the connection, as a host notices an unplugged device.
  bool unplug(std::string_view bus_id);
  bool imported(std::string_view bus_id) const;
  std::size_t connections() const { return clients_.size(); }
  /// Clients that were disconnected because of invalid messages.
  std::uint64_t faults() const { return faults_; }
  /// How long a client may be idle before it has a device.
  void set_idle_limit(std::chrono::milliseconds limit) { idle_limit_ = limit; }

  /// Waits at most this time for work, and does it. Returns whether there was any.
  bool serve(int timeout_ms);

 private:
  struct Client {
    Client(int descriptor, Bus& bus) : socket(descriptor), talk(bus), since(std::chrono::steady_clock::now()) {}
    int socket;
    Connection talk;
    std::chrono::steady_clock::time_point since;
    bool broken = false;
  };
  void accept_client();
  bool read(Client& client);
  bool write(Client& client);
  void drop_finished();

  Bus bus_;
  std::vector<std::unique_ptr<Client>> clients_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::uint64_t faults_ = 0;
  std::chrono::milliseconds idle_limit_{5000};
};

}  // namespace flexspline::usbip
