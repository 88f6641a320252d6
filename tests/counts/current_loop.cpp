// Counts the instructions of field-oriented current control on a bare machine: readings of three phases to three
// on-times, with space-vector modulation, dead-time compensation, decoupling and the circle of the voltage. Prints
// "part least most" over inputs of the whole envelope, saturation among them. With FLEXSPLINE_PEERS the same loop in
// floating point.
#include "tests/counts/bare.hpp"
#include "tests/counts/current_loop_example.hpp"
#if defined(FLEXSPLINE_PEERS)
#include "tests/counts/float_current_loop.hpp"
#endif

namespace flexspline::counts {
namespace {

namespace foc = control::foc;

// One object, as a drive has them.
struct Loop {
  foc::Settings settings = kExampleSettings;
  foc::State state;
};
Loop loop;
foc::LimitSettings limit_settings = kExampleLimits;
foc::LimitState limit_state;

// Marsaglia's xorshift.
std::uint32_t random_state = 2463534242;
std::uint32_t random_word() {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 17;
  random_state ^= random_state << 5;
  return random_state;
}
foc::Inputs random_inputs() {
  const auto reading = [] { return static_cast<std::int32_t>(random_word()) >> (16 + (random_word() & 7)); };
  foc::Inputs in;
  in.readings.a = reading();
  in.readings.b = reading();
  in.readings.c = -in.readings.a - in.readings.b;
  in.bus = static_cast<std::int32_t>(20'000 + (random_word() >> 20));
  in.angle = random_word();
  in.step = static_cast<std::int32_t>(random_word()) >> 5;
  in.set_point = {static_cast<std::int32_t>(random_word()) >> 5, static_cast<std::int32_t>(random_word()) >> 5};
  return in;
}

[[gnu::noinline, gnu::flatten]] void current_loop_tick(Loop& loop, const foc::Inputs& in, foc::Outputs& out) {
  foc::update(loop.state, loop.settings, in, out);
}
[[gnu::noinline, gnu::flatten]] void current_limits_tick(const foc::Inputs& in, const foc::Outputs& out,
                                                         foc::Limits& limits) {
  limits = foc::limit_currents(limit_state, limit_settings, in.set_point, out.measured, out.wanted, out.most,
                               loop.settings.current.voltage_exponent);
}
[[gnu::noinline]] void nothing(const foc::Inputs& in, foc::Outputs& out) {
  asm volatile("" : : "r"(&in), "r"(&out) : "memory");
}

std::uint32_t overhead = 0;
volatile std::int32_t sink = 0;

#if defined(FLEXSPLINE_PEERS)
using Float = peers::FloatCurrentLoop;
Float::Inputs in_float(const foc::Inputs& in) {
  const auto ampere = [](std::int32_t x) { return static_cast<float>(x) * (40.0F / 134217728.0F); };
  return {in.readings.a, in.readings.b, in.readings.c,          in.bus,
          in.angle,      in.step,       ampere(in.set_point.d), ampere(in.set_point.q)};
}
// The numbers of the example.
Float float_loop({.resistance_ohm = 0.304,
                  .inductance_d_h = 0.3e-3,
                  .inductance_q_h = 0.3e-3,
                  .flux_vs = 0.006,
                  .current_full_scale_a = 40.0,
                  .bus_full_scale_v = 60.0,
                  .pwm_hz = 40e3,
                  .timer_counts = 2100.0,
                  .lost = 0.5e-6 * 40e3 * (1.0 + 1.6 / 48.0),
                  .zone_a = 0.144,
                  .pulse = 0.2e-6 * 40e3 + 0.020667,
                  .window = 2.5e-6 * 40e3 + 0.020667,
                  .bandwidth_hz = 1000.0,
                  .proportional = 0.85,
                  .integral = 0.3,
                  .extrapolated = 0.0});
Float::Inputs float_in;
Float::Outputs float_out;
[[gnu::noinline, gnu::flatten]] void float_tick(Float& loop, const Float::Inputs& in, Float::Outputs& out) {
  loop.tick(in, out);
}
#endif

template <class Tick>
void measure(const char* name, Tick&& tick) {
  std::uint32_t least = ~std::uint32_t{0}, most = 0;
  foc::Outputs out;
  for (int k = 0; k < 3000; ++k) {
    const foc::Inputs in = random_inputs();
#if defined(FLEXSPLINE_PEERS)
    float_in = in_float(in);
#endif
    const std::uint32_t before = bare::counted();
    tick(in, out);
    const std::uint32_t count = bare::counted() - before;
    if (count < least) least = count;
    if (count > most) most = count;
    sink = out.counts.a ^ out.wanted.q;
  }
  if (name == nullptr) {
    overhead = least;
    return;
  }
  bare::print(name);
  bare::print(" ");
  bare::print(least - overhead);
  bare::print(" ");
  bare::print(most - overhead);
  bare::print("\n");
}

}  // namespace
}  // namespace flexspline::counts

int main() {
  using namespace flexspline;
  using namespace flexspline::counts;
  bare::start_counter();
  // Else the compiler knows them, and computes what a drive cannot.
  asm volatile("" : "+m"(loop), "+m"(limit_settings));
  measure(nullptr, [](const auto& in, auto& out) { nothing(in, out); });
#if defined(FLEXSPLINE_PEERS)
  measure("current_loop_in_float", [](const auto&, auto&) { float_tick(float_loop, float_in, float_out); });
  sink = float_out.a;
  return 0;
#endif
  measure("current_loop", [](const auto& in, auto& out) { current_loop_tick(loop, in, out); });
  foc::Limits limits;
  measure("current_limits", [&](const auto& in, auto& out) { current_limits_tick(in, out, limits); });
  sink = limits.set_point.q;
  return 0;
}
