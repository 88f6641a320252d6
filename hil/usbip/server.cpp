#include "hil/usbip/server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace flexspline::usbip {

Server::Server(std::uint16_t port) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  socklen_t size = sizeof(address);
  if (listener_ < 0 || bind(listener_, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      listen(listener_, 8) != 0 || getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const std::string reason = std::strerror(errno);
    if (listener_ >= 0) close(listener_);
    throw std::runtime_error("cannot listen on 127.0.0.1, port " + std::to_string(port) + ": " + reason +
                             "; give another port, or 0 for any");
  }
  port_ = ntohs(address.sin_port);
}

Server::~Server() {
  for (const auto& client : clients_) close(client->socket);
  close(listener_);
}

bool Server::unplug(std::string_view bus_id) {
  const bool was_there = bus_.unplug(bus_id);
  drop_finished();
  return was_there;
}

bool Server::imported(std::string_view bus_id) const {
  const auto slot = bus_.find(bus_id);
  return slot && slot->imported;
}

bool Server::serve(int timeout_ms) {
  bool any = false;
  // Data that the application has ready are sent first.
  for (const auto& client : clients_) {
    if (client->talk.advance()) any = true;
    if (write(*client)) any = true;
  }
  drop_finished();

  std::vector<pollfd> waiting{{listener_, POLLIN, 0}};
  for (const auto& client : clients_) {
    const bool reads = client->talk.wants_input(), writes = !client->talk.output().empty();
    waiting.push_back({client->socket, static_cast<short>((reads ? POLLIN : 0) | (writes ? POLLOUT : 0)), 0});
  }
  if (poll(waiting.data(), waiting.size(), any ? 0 : timeout_ms) <= 0) {
    drop_finished();
    return any;
  }
  for (std::size_t i = 0; i < clients_.size(); ++i) {
    Client& client = *clients_[i];
    const short events = waiting[i + 1].revents;
    if ((events & POLLIN) != 0) {
      any = read(client) || any;
    } else if ((events & (POLLHUP | POLLERR)) != 0) {
      client.broken = true;
    }
    client.talk.advance();
    if (write(client)) any = true;
  }
  if ((waiting[0].revents & POLLIN) != 0) {
    accept_client();
    any = true;
  }
  drop_finished();
  return any;
}

void Server::accept_client() {
  const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (descriptor < 0) return;
  if (clients_.size() >= kMostConnections) {
    close(descriptor);
    return;
  }
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  clients_.push_back(std::make_unique<Client>(descriptor, bus_));
}

bool Server::read(Client& client) {
  std::array<std::uint8_t, 16'384> bytes;
  const ssize_t n = recv(client.socket, bytes.data(), bytes.size(), 0);
  if (n > 0) {
    client.talk.take(std::span(bytes).first(static_cast<std::size_t>(n)));
  } else if (n == 0) {
    client.talk.input_ended();
  } else if (errno != EAGAIN && errno != EINTR) {
    client.broken = true;
  }
  return true;
}

bool Server::write(Client& client) {
  Buffer& output = client.talk.output();
  if (output.empty() || client.broken) return false;
  const ssize_t n = send(client.socket, output.data(), output.size(), MSG_NOSIGNAL);
  if (n > 0) {
    output.erase(output.begin(), output.begin() + n);
    return true;
  }
  if (n < 0 && errno != EAGAIN && errno != EINTR) client.broken = true;
  return false;
}

void Server::drop_finished() {
  const auto now = std::chrono::steady_clock::now();
  std::erase_if(clients_, [&](const std::unique_ptr<Client>& client) {
    const bool said_all = client->talk.finished() && (client->talk.output().empty() || client->talk.attached());
    const bool idle = !client->talk.attached() && now - client->since > idle_limit_;
    if (!client->broken && !said_all && !idle) return false;
    if (!client->talk.fault().empty() || idle) ++faults_;
    close(client->socket);
    return true;
  });
}

}  // namespace flexspline::usbip
