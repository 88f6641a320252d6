// Formulas that users write: refused with a reason, or evaluated along a record, each time to the same numbers, of
// which none is infinite or none.
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/formula.hpp"
#include "shared/effects/variables.hpp"
#include "tests/fuzz/bytes.hpp"
#include "tests/fuzz/readers.hpp"

namespace {

using namespace flexspline;
using tests::require;
using Inputs = effects::Inputs<numbers::Real>;

// What formulas are made of, so that a byte is a word.
constexpr auto kWords = std::to_array<std::string_view>({"a",           "b",
                                                         "velocity",    "speed",
                                                         "direction",   "motor_angle",
                                                         "torsion",     "load",
                                                         "temperature", "output_velocity",
                                                         "pi",          "0",
                                                         "1",           "2.5",
                                                         "1e-3",        "1e308",
                                                         "0x1F",        "+",
                                                         "-",           "*",
                                                         "/",           "^",
                                                         "(",           ")",
                                                         ",",           "?",
                                                         ":",           "<",
                                                         ">",           "<=",
                                                         ">=",          "==",
                                                         "!=",          "&&",
                                                         "||",          "=",
                                                         "sin(",        "cos(",
                                                         "tan(",        "tanh(",
                                                         "exp(",        "ln(",
                                                         "log(",        "sqrt(",
                                                         "abs(",        "sign(",
                                                         "min(",        "max(",
                                                         "rint(",       "atan2(",
                                                         "sum(",        "avg(",
                                                         "asin(",       "acosh(",
                                                         " ",           "\n",
                                                         "\"x\"",       "_e",
                                                         "_pi",         "!",
                                                         "%",           "#",
                                                         "[",           "]"});

std::string in_words(tests::FuzzBytes in) {
  std::string text;
  while (!in.empty()) text += kWords[in.next() % kWords.size()];
  return text;
}

std::vector<Inputs> some_motion() {
  std::vector<Inputs> inputs(5);
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const double x = 0.7 * static_cast<double>(k) - 1.3;
    inputs[k].velocity = 40.0 * x;
    inputs[k].speed = std::abs(40.0 * x);
    inputs[k].direction = x < 0.0 ? -1.0 : 1.0;
    inputs[k].angle = 5.0 * x;
    inputs[k].torsion = 1e-3 * x;
    inputs[k].output_velocity = 0.4 * x;
  }
  return inputs;
}

// The sums' bits; empty where a sample gives no number.
std::vector<std::uint64_t> along(catalogue::Formula& formula, const std::vector<Inputs>& inputs) {
  const std::array<double, 2> parameters = {0.5, -3.0};
  std::vector<double> torque(inputs.size(), 0.25);
  try {
    formula.add(parameters, 1.0, inputs, torque.data());
  } catch (const catalogue::FormulaError& error) {
    require(*error.what() != '\0' && !error.remedy().empty(), "a refusal without a reason");
    return {};
  }
  std::vector<std::uint64_t> bits;
  for (const double t : torque) {
    require(std::isfinite(t), "a torque is no number");
    bits.push_back(std::bit_cast<std::uint64_t>(t));
  }
  return bits;
}

}  // namespace

// The first byte: a text as it is, or words; and whether both parameters are declared.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  static const std::vector<Inputs> motion = some_motion();
  const std::string text = (bytes[0] & 1) != 0 ? in_words({bytes + 1, size - 1})
                                               : std::string(reinterpret_cast<const char*>(bytes) + 1, size - 1);
  std::vector<std::string> parameters;
  if ((bytes[0] & 2) == 0) parameters = {"a", "b"};
  if ((bytes[0] & 6) == 2 && text.find('a') != std::string::npos) parameters = {"a"};
  try {
    catalogue::Formula formula(text, parameters);
    // A parameter more than it was told of is never read.
    const auto once = along(formula, motion);
    require(along(formula, motion) == once, "the same record gives other numbers");
    catalogue::Formula again(text, parameters);
    require(along(again, motion) == once, "the same formula gives other numbers");
    require(again.reads() == formula.reads() && again.signals() == formula.signals(), "it reads other signals");
  } catch (const catalogue::FormulaError& error) {
    require(*error.what() != '\0' && !error.remedy().empty(), "a refusal without a reason");
  }
  return 0;
}
