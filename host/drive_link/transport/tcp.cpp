#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/drive_link/transport/link.hpp"

namespace flexspline::transport {

std::unique_ptr<Link> open_tcp(const std::string& whole) {
  const std::size_t slash = whole.find('/');
  const std::string address = whole.substr(0, slash);
  const std::string token = slash == std::string::npos ? "" : whole.substr(slash + 1);
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size())
    throw LinkError(
        fmt::format("tcp:{}: an address is HOST:PORT/TOKEN, as the twin prints it when it starts", address));
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int wrong = getaddrinfo(address.substr(0, colon).c_str(), address.substr(colon + 1).c_str(), &hints, &found);
  if (wrong != 0) throw LinkError(fmt::format("tcp:{}: {}; check the address", address, gai_strerror(wrong)));
  int fd = -1;
  int error = 0;
  for (const addrinfo* one = found; one != nullptr && fd < 0; one = one->ai_next) {
    fd = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
    if (fd >= 0 && connect(fd, one->ai_addr, one->ai_addrlen) == 0) break;
    error = errno;
    if (fd >= 0) close(fd);
    fd = -1;
  }
  freeaddrinfo(found);
  if (fd < 0)
    throw LinkError(fmt::format("tcp:{}: {}; is the twin running? flexspline-hil twin --serve PORT starts one", address,
                                std::strerror(error)));
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  const std::string hello = "flexspline " + token + "\n";
  if (token.empty() || ::send(fd, hello.data(), hello.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(hello.size())) {
    close(fd);
    throw LinkError(fmt::format(
        "tcp:{}: a twin takes only a host that knows its token; take the address as the twin prints it when it "
        "starts, tcp:HOST:PORT/TOKEN",
        address));
  }
  return stream_link(fd, "tcp:" + address);
}

}  // namespace flexspline::transport
