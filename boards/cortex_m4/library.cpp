// What a compiler takes for granted, for an image without a C library.
#include <cstddef>
#include <cstdint>

namespace {
using Word [[gnu::may_alias, gnu::aligned(1)]] = std::uint32_t;
}  // namespace

extern "C" {
// Copies words where both ends allow it. The library's functions take 500 bytes of flash, for copies longer than any
// here.
[[gnu::used, gnu::optimize("no-tree-loop-distribute-patterns")]] void* memcpy(void* to, const void* from,
                                                                              std::size_t count) {
  auto* t = static_cast<unsigned char*>(to);
  const auto* f = static_cast<const unsigned char*>(from);
  // Cortex-M4 reads and writes words at any address.
  for (; count >= 4; count -= 4, t += 4, f += 4) *reinterpret_cast<Word*>(t) = *reinterpret_cast<const Word*>(f);
  for (; count > 0; --count) *t++ = *f++;
  return to;
}
[[gnu::used, gnu::optimize("no-tree-loop-distribute-patterns")]] void* memset(void* to, int value, std::size_t count) {
  auto* t = static_cast<unsigned char*>(to);
  const std::uint32_t word = 0x01010101U * static_cast<unsigned char>(value);
  for (; count >= 4; count -= 4, t += 4) *reinterpret_cast<Word*>(t) = word;
  for (; count > 0; --count) *t++ = static_cast<unsigned char>(value);
  return to;
}
// No object is ever destroyed.
int __aeabi_atexit(void*, void (*)(void*), void*) {
  return 0;
}
void* __dso_handle = nullptr;
}
