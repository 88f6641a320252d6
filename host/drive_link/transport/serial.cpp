#include <fcntl.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "host/drive_link/transport/link.hpp"

namespace flexspline::transport {

std::unique_ptr<Link> open_serial(const std::string& port) {
  const int fd = open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    const char* remedy = errno == EACCES   ? "your user may not open it: join the group that owns it (sudo usermod -aG "
                                             "dialout $USER) and log in again"
                         : errno == ENOENT ? "there is no such port; `ls /dev/serial/by-id` lists those that there are"
                         : errno == EBUSY  ? "another program has it open; close that one"
                                           : "check the port";
    throw LinkError(fmt::format("serial:{}: {}; {}", port, std::strerror(errno), remedy));
  }
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) {
    close(fd);
    throw LinkError(fmt::format("serial:{}: is no serial port", port));
  }
  // 8N1 without any flow control, at the speed of the boards' lines; a drive's own port over USB takes no notice of it.
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  cfsetspeed(&settings, B115200);
  if (tcsetattr(fd, TCSANOW, &settings) != 0) {
    close(fd);
    throw LinkError(fmt::format("serial:{}: does not take 115200 bauds: {}", port, std::strerror(errno)));
  }
  ioctl(fd, TIOCEXCL);
  tcflush(fd, TCIOFLUSH);
  return stream_link(fd, "serial:" + port);
}

}  // namespace flexspline::transport
