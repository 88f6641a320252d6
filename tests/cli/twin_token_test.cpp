// Who reaches a twin's port is not yet its host: a web page can, and so can another user of the machine.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::twin_token_test {
namespace {

// What comes back to these bytes until the other end closes the line, or half a second.
std::string answered(int port, const std::string& bytes, bool& closed) {
  const int line = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (connect(line, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    throw std::runtime_error("the twin does not listen");
  timeval wait{0, 500'000};
  setsockopt(line, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait));
  send(line, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  std::string got;
  char part[256];
  for (;;) {
    const ssize_t n = recv(line, part, sizeof(part), 0);
    closed = n == 0 || (n < 0 && errno == ECONNRESET);
    if (n <= 0) break;
    got.append(part, static_cast<std::size_t>(n));
  }
  close(line);
  return got;
}
// `identify`, as a frame of the serial line.
const std::string kIdentify("\x00\x05\x01\x01\x02\x00\x03\x01\x02", 9);

TEST(TwinToken, APostFromAWebPageAndAWrongTokenAreClosedAndDisturbNoHost) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0"});
  const std::string name = twin.name();
  const std::size_t colon = name.rfind(':'), slash = name.find('/');
  ASSERT_NE(slash, std::string::npos) << name;
  EXPECT_EQ(name.size() - slash - 1, 32U);
  const int port = std::stoi(name.substr(colon + 1, slash - colon - 1));
  for (const std::string& bytes : {"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n" + kIdentify,
                                   kIdentify, "flexspline 00000000000000000000000000000000\n" + kIdentify}) {
    bool closed = false;
    EXPECT_EQ(answered(port, bytes, closed), "");
    EXPECT_TRUE(closed);
  }
  const Answer without = shell.run("flexspline backup --out b.block --drive " + name.substr(0, slash));
  EXPECT_EQ(without.code, 2);
  EXPECT_TRUE(contains(without.err, "token")) << without.err;
  shell.must("flexspline backup --out b.block --drive " + name);
}

}  // namespace
}  // namespace flexspline::cli_test::twin_token_test
