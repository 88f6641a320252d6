// Blocks of bytes that a recording holds compressed.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace flexspline::data {

// `size`: of what comes out, as the file states it. Throws DamagedFile.
std::string decompress_lz4(std::string_view bytes, std::size_t size);
std::string decompress_zstd(std::string_view bytes, std::size_t size);

}  // namespace flexspline::data
