// The hashes of a few adversarial ticks, on a bare machine.
#include "tests/counts/bare.hpp"
#include "tests/same_bits/adversarial.hpp"

int main() {
  using namespace flexspline;
  same_bits::run(200, 2'000, [](std::string_view name, std::uint64_t hash) {
    // A catalogue's names end with a nought.
    bare::print(name.data());
    bare::print(" ");
    bare::print_hex(hash);
    bare::print("\n");
  });
  return 0;
}
