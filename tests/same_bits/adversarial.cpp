// Prints the hashes of a million ticks, to be compared between compilers and levels of optimisation. `few`: those of
// few ticks, as machines in QEMU give them. `block`: the coefficients as a parameter block, a C++ array, for those
// machines, which then need no floating point. `drawn SEED BLOCKS`: a thousand ticks of all effects with each of so
// many blocks of drawn coefficients.
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "shared/model/block.hpp"
#include "tests/same_bits/adversarial.hpp"
#include "tests/same_bits/drive_parts.hpp"
#include "tests/same_bits/three_phase_parts.hpp"

namespace {

using namespace flexspline;

void print_block() {
  static std::uint8_t bytes[model::kLargestBlock];
  model::BlockWriter writer(bytes);
  model::BlockHeader header;
  const auto one = [](model::Number& n) { n = {std::int32_t{1} << fixed::kMantissaBits, 0}; };
  const auto one_base = [](fixed::Value& x) { x.raw = std::int32_t{1} << fixed::kValueBits; };
  header.bases.fields(one);
  header.limits.fields(one_base);
  header.limits.overspeed.raw = std::int32_t{3} << (fixed::kValueBits - 1);
  writer.begin(header);
  effects::for_each_effect([&]<class Effect>(std::size_t number) {
    if constexpr (!Effect::kInfo.host_only)
      writer.add(static_cast<std::uint16_t>(number), same_bits::Derived::effect<Effect>());
  });
  control::add_settings(writer, same_bits::settings());
  const std::size_t size = writer.end();
  for (std::size_t i = 0; i < size; ++i) std::printf("%u,%s", bytes[i], i % 20 == 19 ? "\n" : "");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "block") {
    print_block();
    return 0;
  }
  if (what == "drawn" && argc == 4) {
    same_bits::Drawn::random.skip(std::strtoul(argv[2], nullptr, 10));
    std::printf("%016llx\n", static_cast<unsigned long long>(same_bits::hash_of_drawn_blocks(
                                 static_cast<int>(std::strtol(argv[3], nullptr, 10)), 1'000)));
    return 0;
  }
  const bool few = what == "few";
  const int many = few ? 2'000 : 1'000'000;
  const auto print = [](std::string_view name, std::uint64_t hash) {
    std::printf("%.*s %016llx\n", static_cast<int>(name.size()), name.data(), static_cast<unsigned long long>(hash));
  };
  same_bits::run<same_bits::Derived>(few ? 200 : 20'000, many, print);
  same_bits::run_parts<same_bits::Derived>(same_bits::settings(), many / 10, print);
  if (!same_bits::run_three_phase(few ? 20'000 : many / 2, print)) {
    std::fprintf(stderr, "commissioning does not find the motor in integers\n");
    return 1;
  }
  if (!few) print("drawn_blocks", same_bits::hash_of_drawn_blocks(100, many / 1'000));
  if (fixed::OverflowLog::count() != 0) {
    std::fprintf(stderr, "%s\n", std::string(fixed::OverflowLog::first()).c_str());
    return 1;
  }
}
