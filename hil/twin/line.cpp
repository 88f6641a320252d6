#include "hil/twin/line.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace flexspline::twin {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}
std::string drawn_token() {
  std::uint8_t bytes[16];
  if (getrandom(bytes, sizeof(bytes), 0) != static_cast<ssize_t>(sizeof(bytes))) fail("no random bytes for a token");
  std::string token;
  for (const std::uint8_t byte : bytes)
    for (const int digit : {byte >> 4, byte & 15}) token += "0123456789abcdef"[digit];
  return token;
}
void make_nonblocking(int fd) {
  fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  fcntl(fd, F_SETFD, FD_CLOEXEC);
}

}  // namespace

Line Line::listening(int port, const std::string& given) {
  Line line;
  line.listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (line.listener_ < 0) fail("no socket");
  const int on = 1;
  setsockopt(line.listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (bind(line.listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0 ||
      listen(line.listener_, 1) != 0)
    fail("cannot listen at 127.0.0.1:" + std::to_string(port) + "; take another port, or 0 for any");
  socklen_t size = sizeof(address);
  getsockname(line.listener_, reinterpret_cast<sockaddr*>(&address), &size);
  const std::string token = given.empty() ? drawn_token() : given;
  line.name_ = "tcp:127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/" + token;
  line.hello_ = "flexspline " + token + "\n";
  make_nonblocking(line.listener_);
  return line;
}

Line Line::terminal() {
  Line line;
  line.host_ = posix_openpt(O_RDWR | O_NOCTTY);
  if (line.host_ < 0 || grantpt(line.host_) != 0 || unlockpt(line.host_) != 0) fail("no pseudo terminal");
  const std::string path = ptsname(line.host_);
  line.keeps_open_ = open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (line.keeps_open_ < 0) fail(path);
  termios settings{};
  tcgetattr(line.keeps_open_, &settings);
  cfmakeraw(&settings);
  tcsetattr(line.keeps_open_, TCSANOW, &settings);
  make_nonblocking(line.host_);
  line.name_ = "serial:" + path;
  line.is_terminal_ = true;
  return line;
}

Line Line::inherited(int fd) {
  Line line;
  line.host_ = fd;
  make_nonblocking(fd);
  line.name_ = "twin";
  return line;
}

Line::Line(Line&& other) noexcept
    : name_(std::move(other.name_)),
      listener_(std::exchange(other.listener_, -1)),
      host_(std::exchange(other.host_, -1)),
      unidentified_(std::exchange(other.unidentified_, -1)),
      hello_(std::move(other.hello_)),
      keeps_open_(std::exchange(other.keeps_open_, -1)),
      is_terminal_(other.is_terminal_) {}

Line::~Line() {
  for (const int fd : {listener_, host_, unidentified_, keeps_open_})
    if (fd >= 0) close(fd);
}

bool Line::transfer(int wait_ms) {
  pollfd all[3] = {{listener_, POLLIN, 0},
                   {host_, static_cast<short>(out_.empty() ? POLLIN : POLLIN | POLLOUT), 0},
                   {unidentified_, POLLIN, 0}};
  poll(all, 3, wait_ms);
  if (unidentified_ >= 0 && all[2].revents != 0) read_token();
  if (listener_ >= 0 && (all[0].revents & POLLIN) != 0) accept_host();
  if (!plugged_ && is_terminal_) tcflush(keeps_open_, TCIOFLUSH);
  if (host_ >= 0) read_bytes();
  if (host_ >= 0) write_bytes();
  return std::exchange(changed_, false);
}

void Line::accept_host() {
  const int host = accept(listener_, nullptr, nullptr);
  if (host < 0) return;
  close_unidentified();
  if (!plugged_) {
    close(host);
    return;
  }
  unidentified_ = host;
  make_nonblocking(unidentified_);
  const int on = 1, bytes = 4096;
  setsockopt(unidentified_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  setsockopt(unidentified_, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
  read_token();
}

// Byte by byte: the bytes after the token belong to the host. A host with the right token replaces a connected one,
// which may have died without closing its connection.
void Line::read_token() {
  char byte = 0;
  for (;;) {
    const ssize_t got = read(unidentified_, &byte, 1);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (got <= 0 || byte != hello_[received_.size()]) return close_unidentified();
    received_ += byte;
    if (received_.size() < hello_.size()) continue;
    lose_host();
    host_ = std::exchange(unidentified_, -1);
    received_.clear();
    return;
  }
}

void Line::close_unidentified() {
  if (unidentified_ >= 0) close(unidentified_);
  unidentified_ = -1;
  received_.clear();
}

void Line::read_bytes() {
  std::uint8_t bytes[1024];
  for (;;) {
    const ssize_t got = read(host_, bytes, sizeof(bytes));
    if (got > 0) {
      protocol::Message m;
      for (ssize_t i = 0; i < got; ++i)
        if (plugged_ && reader_.take(bytes[i], m)) arrived_.push_back(m);
      continue;
    }
    const bool waits = got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
    if (!waits && !is_terminal_) lose_host();
    return;
  }
}

void Line::write_bytes() {
  while (!out_.empty()) {
    const ssize_t sent =
        is_terminal_ ? write(host_, out_.data(), out_.size()) : ::send(host_, out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      out_.erase(out_.begin(), out_.begin() + sent);
      continue;
    }
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR && !is_terminal_) lose_host();
    return;
  }
}

// Both ends of a terminal stay open: bytes are lost in between, as on an unplugged serial line.
void Line::plug(bool in) {
  if (in == std::exchange(plugged_, in)) return;
  close_unidentified();
  if (!is_terminal_) return lose_host();
  changed_ = true;
  reader_.restart();
  arrived_.clear();
  out_.clear();
}

void Line::lose_host() {
  if (host_ < 0) return;
  close(host_);
  host_ = -1;
  ended_ = listener_ < 0;
  changed_ = true;
  reader_.restart();
  arrived_.clear();
  out_.clear();
}

void Line::send(const protocol::Message& m) {
  if (!has_host()) return;
  const protocol::SerialFrame frame = protocol::serial_frame(m);
  out_.insert(out_.end(), frame.bytes.begin(), frame.bytes.begin() + static_cast<std::ptrdiff_t>(frame.size));
}

}  // namespace flexspline::twin
