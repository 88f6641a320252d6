// Access control of the workbench: which requests are accepted, and which files they may name. Pure functions of texts:
// no socket.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace flexspline::workbench {

// 32 hexadecimal digits from the system's source of randomness. Throws std::runtime_error where there is none.
std::string new_token();

// The parts of a request that are checked before anything else.
struct RequestOrigin {
  std::string_view host;    // header; empty: none
  std::string_view origin;  // header; empty: none
  std::string_view path;    // "/TOKEN/rest"
};

// Empty where the request may pass; else why not. Host must be this server by address or as localhost (another name
// that points here is an attack by DNS), an origin must be this server's, and the path must begin with the token.
std::string refusal(const RequestOrigin& request, std::string_view token, int port);

// The path behind "/TOKEN", beginning with a slash. Only of paths that pass.
std::string_view behind_token(std::string_view path);

// A name that is no plain file name, or has another ending than the workbench reads or writes.
class NameError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// `folder / name`, where `name` is a plain file name with this ending: no folder, no leading dot, no control
// character, at most 100 bytes, and nothing there that is a link. Throws NameError saying what is wrong.
std::filesystem::path inside(const std::filesystem::path& folder, std::string_view name, std::string_view ending);

}  // namespace flexspline::workbench
