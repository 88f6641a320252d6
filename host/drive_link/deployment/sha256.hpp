// SHA-256 (FIPS 180-4), to name a block in logs and answers.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace flexspline::deployment {

// As 64 hexadecimal digits.
std::string sha256(std::span<const std::uint8_t> bytes);

}  // namespace flexspline::deployment
