// The hashes of a few adversarial ticks, on a bare machine, with coefficients from a parameter block (block.inc,
// written by tests/same_bits/adversarial.cpp).
#include "shared/model/block.hpp"
#include "tests/counts/bare.hpp"
#include "tests/same_bits/adversarial.hpp"
#include "tests/same_bits/drive_parts.hpp"
#include "tests/same_bits/three_phase_parts.hpp"

namespace flexspline {
namespace {

constexpr std::uint8_t kBlock[] = {
#include <block.inc>
};

template <class T>
T read(std::uint16_t kind) {
  T coefficients{};
  model::for_each_entry(kBlock, [&](std::uint16_t found, std::span<const std::uint8_t> bytes) {
    if (found == kind && model::read_fields(bytes, coefficients).fault != model::FieldFault::none) bare::stop(4);
  });
  return coefficients;
}
struct FromBlock {
  template <class Effect>
  static auto effect() {
    constexpr auto kNumber = static_cast<std::uint16_t>(model::DriveModel<fixed::Fixed>::number_of<Effect>());
    return read<typename Effect::template Coefficients<fixed::Fixed>>(kNumber);
  }
  static auto encoder_filter() {
    return read<observers::EncoderKalman::Coefficients<fixed::Fixed>>(
        static_cast<std::uint16_t>(model::Section::encoder_filter));
  }
  static auto ripple_filter() {
    return read<observers::RippleFilter::Coefficients<fixed::Fixed>>(
        static_cast<std::uint16_t>(model::Section::torque_ripple_filter));
  }
};

}  // namespace
}  // namespace flexspline

int main() {
  using namespace flexspline;
  using Model = model::DriveModel<fixed::Fixed>;
  static same_bits::Settings settings;
  control::detail::SectionReader sections(&settings);
  if (!model::read_block<Model>(kBlock, nullptr, sections).good()) {
    bare::print("no good block");
    return 4;
  }
  const auto print = [](std::string_view name, std::uint64_t hash) {
    // A catalogue's names end with a zero.
    bare::print(name.data());
    bare::print(" ");
    bare::print_hex(hash);
    bare::print("\n");
  };
  same_bits::run<FromBlock>(200, 2'000, print);
  same_bits::run_parts<FromBlock>(settings, 200, print);
  return same_bits::run_three_phase(20'000, print) ? 0 : 5;
}
