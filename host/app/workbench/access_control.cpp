#include "host/app/workbench/access_control.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace flexspline::workbench {
namespace {

constexpr std::size_t kTokenBytes = 16;
constexpr std::size_t kLongestName = 100;

// In constant time.
bool same(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    difference |= static_cast<unsigned>(static_cast<unsigned char>(a[k]) ^ static_cast<unsigned char>(b[k]));
  return difference == 0;
}

bool is_this_server(std::string_view host, int port) {
  return host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port);
}

}  // namespace

std::string new_token() {
  std::array<std::uint8_t, kTokenBytes> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error(
        "the system gives no random numbers, so access to the workbench cannot be limited to its user");
  std::string token;
  for (const std::uint8_t b : bytes) token += fmt::format("{:02x}", b);
  return token;
}

std::string refusal(const RequestOrigin& request, std::string_view token, int port) {
  if (!is_this_server(request.host, port)) return "this server is not known under that name";
  constexpr std::string_view kScheme = "http://";
  if (!request.origin.empty() &&
      !(request.origin.starts_with(kScheme) && is_this_server(request.origin.substr(kScheme.size()), port)))
    return "another page may not speak with the workbench";
  const std::string_view path = request.path;
  const std::size_t end = path.find('/', 1);
  if (!path.starts_with('/') || end == std::string_view::npos || token.empty() || !same(path.substr(1, end - 1), token))
    return "the token of the address is missing or wrong; open the address that flexspline workbench prints";
  return {};
}

std::string_view behind_token(std::string_view path) {
  return path.substr(path.find('/', 1));
}

std::filesystem::path inside(const std::filesystem::path& folder, std::string_view name, std::string_view ending) {
  const auto fail = [&](std::string_view what) {
    throw NameError(fmt::format("\"{}\" {}; a plain file name such as example{} is taken", name, what, ending));
  };
  if (name.size() > kLongestName) fail("is too long");
  if (name.find_first_of("/\\") != std::string_view::npos) fail("names a folder");
  if (name.starts_with('.')) fail("begins with a dot");
  if (std::any_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }))
    fail("has a control character");
  if (name.size() <= ending.size() || !name.ends_with(ending)) fail(fmt::format("does not end in {}", ending));
  std::filesystem::path path = folder / std::filesystem::path(std::string(name));
  std::error_code error;
  if (std::filesystem::is_symlink(path, error)) fail("is a link to somewhere else");
  return path;
}

}  // namespace flexspline::workbench
