#include "host/physics/model/units.hpp"

#include <array>
#include <cctype>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "host/common/text/unit_signs.hpp"

namespace flexspline::model {
namespace {

using Powers = std::map<std::string, int>;

// What a run of letters is split into; prefixed units only where the whole run is one, so that "Nms" is N*m*s.
constexpr std::array<std::string_view, 8> kSymbols = {"degC", "rad", "kg", "N", "m", "s", "A", "K"};
constexpr std::array<std::string_view, 13> kWholeRecord = {"mm", "um", "ms", "us",  "mN",  "kN",  "mA",
                                                           "g",  "J",  "V",  "deg", "rpm", "degF"};

class UnitReader {
 public:
  explicit UnitReader(std::string_view text) : text_(plain(text)) {}

  std::optional<Powers> read() {
    if (text_.empty() || text_ == "-") return Powers{};
    if (!product(1) || position_ != text_.size()) return std::nullopt;
    // A coefficient per kelvin is one per degree Celsius.
    if (const auto kelvin = powers_.find("K"); kelvin != powers_.end() && kelvin->second < 0) {
      powers_["degC"] += kelvin->second;
      powers_.erase("K");
    }
    std::erase_if(powers_, [](const auto& power) { return power.second == 0; });
    return powers_;
  }

 private:
  // Spaces that only surround the text go.
  static std::string plain(std::string_view text) {
    const std::string result = text::unit_in_ascii(text);
    const std::size_t first = result.find_first_not_of(" \t");
    if (first == std::string::npos) return {};
    return result.substr(first, result.find_last_not_of(" \t") - first + 1);
  }

  bool at_end() const { return position_ >= text_.size(); }
  char peek() const { return at_end() ? '\0' : text_[position_]; }
  void skip_spaces() {
    while (peek() == ' ' || peek() == '\t') ++position_;
  }

  // factor { ("*" | "." | " " | "/") factor }: a division holds for its one factor, as in N*m/rad*s = N*m*s/rad.
  bool product(int sign) {
    skip_spaces();
    if (!factor(sign)) return false;
    for (;;) {
      skip_spaces();
      const char next = peek();
      if (at_end() || next == ')') return true;
      int factor_sign = sign;
      if (next == '*' || next == '.') {
        ++position_;
      } else if (next == '/') {
        ++position_;
        factor_sign = -sign;
      }
      skip_spaces();
      if (!factor(factor_sign)) return false;
    }
  }

  bool factor(int sign) {
    if (peek() == '(') {
      if (++depth_ > 8) return false;
      ++position_;
      if (!product(sign) || peek() != ')') return false;
      ++position_;
      --depth_;
      return true;
    }
    if (peek() == '1') {
      ++position_;
      return true;
    }
    std::string letters;
    while (std::isalpha(static_cast<unsigned char>(peek())) != 0) letters += text_[position_++];
    if (letters.empty()) return false;
    const int power = exponent();
    if (power == 0) return false;
    for (const std::string_view whole : kWholeRecord)
      if (letters == whole) return add(whole, sign * power);
    std::string_view rest = letters;
    while (!rest.empty()) {
      std::string_view symbol;
      for (const std::string_view candidate : kSymbols) {
        if (!rest.starts_with(candidate)) continue;
        symbol = candidate;
        break;
      }
      if (symbol.empty()) return false;
      rest.remove_prefix(symbol.size());
      add(symbol, rest.empty() ? sign * power : sign);
    }
    return true;
  }

  // "^2", "^-1", "**2", "2" or nothing; 0 where it cannot be read.
  int exponent() {
    bool marked = false;
    if (peek() == '^') {
      ++position_;
      marked = true;
    } else if (text_.compare(position_, 2, "**") == 0) {
      position_ += 2;
      marked = true;
    }
    int sign = 1;
    if (peek() == '-') {
      sign = -1;
      ++position_;
      if (peek() == '^') ++position_;  // a raised minus and a raised digit
      marked = true;
    }
    if (peek() >= '1' && peek() <= '9') return sign * (text_[position_++] - '0');
    return marked ? 0 : 1;
  }

  bool add(std::string_view symbol, int power) {
    powers_[std::string(symbol)] += power;
    return true;
  }

  std::string text_;
  std::size_t position_ = 0;
  int depth_ = 0;
  Powers powers_;
};

}  // namespace

bool same_unit(std::string_view a, std::string_view b) {
  if (a == b) return true;
  const std::optional<Powers> powers_a = UnitReader(a).read();
  const std::optional<Powers> powers_b = UnitReader(b).read();
  return powers_a && powers_b && *powers_a == *powers_b;
}

bool is_dimensionless(std::string_view unit) {
  return same_unit(unit, "-");
}

}  // namespace flexspline::model
