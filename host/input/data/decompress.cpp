#include "host/input/data/decompress.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include "host/input/data/byte_reader.hpp"

namespace flexspline::data {
namespace {

// Both pack less well than this; a file that states more is an attack on the memory.
std::string room_for(std::string_view bytes, std::size_t size) {
  constexpr std::size_t kMostGrowth = 4096;
  if (size / kMostGrowth > bytes.size()) throw DamagedFile();
  return std::string(size, '\0');
}

}  // namespace

std::string decompress_lz4(std::string_view bytes, std::size_t size) {
  std::string whole = room_for(bytes, size);
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) throw DamagedFile();
  std::size_t from = 0, to = 0;
  bool good = true;
  while (good && from < bytes.size()) {
    std::size_t taken = bytes.size() - from, given = whole.size() - to;
    const std::size_t hint = LZ4F_decompress(context, whole.data() + to, &given, bytes.data() + from, &taken, nullptr);
    good = LZ4F_isError(hint) == 0 && (taken > 0 || given > 0);
    from += taken;
    to += given;
    if (hint == 0) break;
  }
  LZ4F_freeDecompressionContext(context);
  if (!good || to != size) throw DamagedFile();
  return whole;
}

std::string decompress_zstd(std::string_view bytes, std::size_t size) {
  std::string whole = room_for(bytes, size);
  const std::size_t got = ZSTD_decompress(whole.data(), whole.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(got) != 0 || got != size) throw DamagedFile();
  return whole;
}

}  // namespace flexspline::data
