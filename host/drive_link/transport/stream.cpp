// Messages over a line of bytes: serial port, socket or a process.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>

#include "host/drive_link/transport/link.hpp"
#include "shared/protocol/serial_frame.hpp"

namespace flexspline::transport {
namespace {

using Clock = std::chrono::steady_clock;

int left_ms(Clock::time_point end) {
  const auto left = std::chrono::duration_cast<Milliseconds>(end - Clock::now()).count();
  return left < 0 ? 0 : static_cast<int>(left);
}

class Stream : public Link {
 public:
  Stream(int fd, std::string name) : fd_(fd), name_(std::move(name)) {
    fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
    // A line whose other end is gone is an error of write(), not a reason to end.
    std::signal(SIGPIPE, SIG_IGN);
    // A message that was sent in part ends here.
    constexpr std::uint8_t kNothing = 0;
    write_all(&kNothing, 1);
  }
  ~Stream() override { close(fd_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  void send(const protocol::Message& m) override {
    const protocol::SerialFrame frame = protocol::serial_frame(m);
    write_all(frame.bytes.data(), frame.size);
  }
  std::optional<protocol::Message> receive(Milliseconds limit) override {
    const auto end = Clock::now() + limit;
    for (;;) {
      if (!arrived_.empty()) {
        const protocol::Message m = arrived_.front();
        arrived_.pop_front();
        return m;
      }
      read_some();
      if (!arrived_.empty()) continue;
      const int wait = left_ms(end);
      if (wait == 0) return {};
      pollfd one{fd_, POLLIN, 0};
      poll(&one, 1, wait);
    }
  }
  std::string name() const override { return name_; }

 private:
  [[noreturn]] void gone(const char* why) const {
    throw LinkError(fmt::format("{}: the drive is gone ({}); check cable and power, then try again", name_, why));
  }
  void read_some() {
    std::uint8_t bytes[4096];
    const ssize_t got = read(fd_, bytes, sizeof(bytes));
    if (got == 0) gone("the line was closed");
    if (got < 0) {
      if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return;
      gone(std::strerror(errno));
    }
    protocol::Message m;
    for (ssize_t i = 0; i < got; ++i)
      if (reader_.take(bytes[i], m)) arrived_.push_back(m);
  }
  void write_all(const std::uint8_t* bytes, std::size_t count) {
    const auto end = Clock::now() + std::chrono::seconds(1);
    while (count > 0) {
      const ssize_t sent = write(fd_, bytes, count);
      if (sent > 0) {
        bytes += sent;
        count -= static_cast<std::size_t>(sent);
        continue;
      }
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) gone(std::strerror(errno));
      const int wait = left_ms(end);
      if (wait == 0) gone("it takes no bytes");
      pollfd one{fd_, POLLOUT, 0};
      poll(&one, 1, wait);
    }
  }

  int fd_;
  std::string name_;
  protocol::SerialReader reader_;
  std::deque<protocol::Message> arrived_;
};

}  // namespace

std::unique_ptr<Link> stream_link(int fd, std::string name) {
  return std::make_unique<Stream>(fd, std::move(name));
}

}  // namespace flexspline::transport
