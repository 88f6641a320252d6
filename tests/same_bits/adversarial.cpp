// Prints the hashes of a million ticks, to be compared between compilers and levels of optimisation; with an argument
// those of few ticks, as the machines in QEMU give them (tests/counts/same_bits.cpp).
#include "tests/same_bits/adversarial.hpp"

#include <cstdio>

int main(int argc, char**) {
  const bool few = argc > 1;
  flexspline::same_bits::run(few ? 200 : 20'000, few ? 2'000 : 1'000'000,
                             [](std::string_view name, std::uint64_t hash) {
                               std::printf("%.*s %016llx\n", static_cast<int>(name.size()), name.data(),
                                           static_cast<unsigned long long>(hash));
                             });
}
