#include "host/output/answers/console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <utility>

#include "host/common/text/shortened.hpp"

namespace flexspline::output {
namespace {

// Whatever a message quotes, it stays one that can be read.
constexpr std::size_t kLongestMessage = 20000;

bool may_style(int descriptor) {
  if (::isatty(descriptor) == 0) return false;
  const char* no_colour = std::getenv("NO_COLOR");
  if (no_colour != nullptr && *no_colour != '\0') return false;
  const char* terminal = std::getenv("TERM");
  return terminal != nullptr && std::string_view(terminal) != "dumb";
}

}  // namespace

Console::Console(std::string command, bool quiet)
    : command_(std::move(command)),
      quiet_(quiet),
      colour_(may_style(STDOUT_FILENO)),
      shows_progress_(::isatty(STDERR_FILENO) != 0) {}

Console::~Console() {
  clear_progress();
}

void Console::line(std::string_view text) {
  if (quiet_) return;
  clear_progress();
  fmt::print("{}\n", text);
}

void Console::warn(std::string_view text) {
  error(fmt::format("warning: {}", text));
}

void Console::error(std::string_view text) {
  clear_progress();
  std::fflush(stdout);
  fmt::print(stderr, "flexspline{}{}: {}\n", command_.empty() ? "" : " ", command_,
             text::shortened(text, kLongestMessage));
}

void Console::progress(std::string_view stage) {
  if (!shows_progress_) return;
  fmt::print(stderr, "\r\x1b[K{} ...", stage);
  std::fflush(stderr);
  progress_open_ = true;
}

std::string Console::styled(std::string_view text, std::string_view code) const {
  return colour_ ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : std::string(text);
}

void Console::clear_progress() {
  if (!progress_open_) return;
  fmt::print(stderr, "\r\x1b[K");
  std::fflush(stderr);
  progress_open_ = false;
}

std::string unwritten() {
  std::cout.flush();
  errno = 0;
  const bool flushed = std::fflush(stdout) == 0;
  const int reason = errno;
  if (flushed && std::ferror(stdout) == 0 && std::cout.good()) return {};
  return reason != 0 ? std::strerror(reason) : "an earlier part of it was lost";
}

}  // namespace flexspline::output
