#include "hil/twin/link_fault.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>

namespace flexspline::twin {

void LinkFault::read_file() {
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
  write_state();
}

void LinkFault::count() {
  if (!left_ || --*left_ > 0) return;
  left_.reset();
  plugged_ = false;
  write_state();
}

// Replaced as a whole, as it may be read at any time.
void LinkFault::write_state() {
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
