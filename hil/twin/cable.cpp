#include "hil/twin/cable.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>

namespace flexspline::twin {

void Cable::look() {
  if (file_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_at_ < std::chrono::milliseconds(5)) return;
  looked_at_ = now;
  std::ifstream file(file_);
  std::string line;
  if (!std::getline(file, line) || line == seen_) return;
  std::istringstream words(line);
  std::string word;
  std::uint64_t messages = 0;
  if (!(words >> word) || (word != "in" && word != "out")) return;
  seen_ = line;
  left_.reset();
  if (word == "out" && words >> messages && messages > 0) {
    left_ = messages;
    plugged_ = true;
  } else {
    plugged_ = word == "in";
  }
  say();
}

void Cable::count() {
  if (!left_ || --*left_ > 0) return;
  left_.reset();
  plugged_ = false;
  say();
}

// Whole or not at all, as it is read while it is written.
void Cable::say() {
  const std::string state = file_ + ".state", fresh = state + ".new";
  {
    std::ofstream out(fresh);
    out << (plugged_ ? "in" : "out");
    if (left_) out << ' ' << *left_;
    out << '\n';
  }
  std::rename(fresh.c_str(), state.c_str());
}

}  // namespace flexspline::twin
