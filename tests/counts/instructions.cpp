// Counts the instructions of a control tick, exactly: least and most of each part over motions of the whole envelope.
// Prints "part least most". With FLEXSPLINE_PEERS also of the same effects in floating point; with FLEXSPLINE_CYCLES no
// effect alone, and fewer ticks, for cycles.py.
#include "shared/control/loops.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block.hpp"
#include "shared/observers/encoder_kalman.hpp"
#include "tests/counts/bare.hpp"
#if defined(FLEXSPLINE_PEERS)
#include "tests/counts/peers.hpp"
#endif

namespace flexspline::counts {
namespace {

using control::Loops;
using effects::Inputs;
using effects::Torques;
using fixed::Fixed;
using observers::EncoderKalman;

constexpr std::uint8_t kBlock[] = {
#include <block.inc>
};
#if defined(FLEXSPLINE_CYCLES)  // each instruction is looked at, which takes its time
constexpr int kTicks = 80;
#else
constexpr int kTicks = 1500;
#endif
constexpr std::int32_t kOne = std::int32_t{1} << fixed::kValueBits;

template <class T>
void read(std::uint16_t kind, T& coefficients) {
  model::for_each_entry(kBlock, [&](std::uint16_t found, std::span<const std::uint8_t> bytes) {
    if (found == kind && model::read_fields(bytes, coefficients).fault != model::FieldFault::none) bare::stop(4);
  });
}

// Marsaglia's xorshift.
std::uint64_t random_state = 88172645463325252;
std::int32_t random_signal() {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 7;
  random_state ^= random_state << 17;
  const auto bits = static_cast<std::int32_t>(random_state >> 20);
  // Within two bases; now and then zero, an end, or hardly anything.
  switch (random_state & 31) {
    case 0:
      return 0;
    case 1:
      return 2 * kOne;
    case 2:
      return -2 * kOne;
    default:
      return (bits >> 3) >> ((random_state >> 5) & 15);
  }
}
std::int64_t angle = std::int64_t{5} << 32;
Inputs<Fixed> random_inputs() {
  Inputs<Fixed> in;
  angle += random_signal() >> 4;
  in.angle.raw = angle;
  in.output_angle.raw = angle >> 6;
  for (Fixed::Value* signal : {&in.velocity, &in.acceleration, &in.output_velocity, &in.output_acceleration,
                               &in.torsion, &in.torsion_rate, &in.torque, &in.current, &in.temperature})
    signal->raw = random_signal();
  const auto direction = [](Fixed::Value x) { return Fixed::Value{{x.raw > 0 ? kOne : x.raw < 0 ? -kOne : 0}}; };
  in.direction = direction(in.velocity);
  in.output_direction = direction(in.output_velocity);
  in.torsion_direction = direction(in.torsion_rate);
  return in;
}

volatile std::int64_t sink = 0;
std::uint32_t overhead = 0;

void say(const char* name, std::uint32_t least, std::uint32_t most) {
  bare::print(name);
  bare::print(" ");
  bare::print(least - overhead);
  bare::print(" ");
  bare::print(most - overhead);
  bare::print("\n");
}

// Runs `tick(inputs, command)` and says how many instructions it took; the call itself is not counted.
template <class Tick>
void measure(const char* name, Tick&& tick, bool say_it = true) {
  std::uint32_t least = ~std::uint32_t{0}, most = 0;
  for (int k = 0; k < kTicks; ++k) {
    const Inputs<Fixed> in = random_inputs();
    Loops::Command<Fixed> command;
    command.loop = control::Loop::position;
    command.position.raw = in.angle.raw + (random_signal() >> 4);
    command.velocity.raw = random_signal();
    const std::uint32_t before = bare::counted();
    tick(in, command);
    const std::uint32_t count = bare::counted() - before;
    // The first ticks only take note of where the drive stands.
    if (k < 2) continue;
    if (count < least) least = count;
    if (count > most) most = count;
  }
  if (say_it) {
    say(name, least, most);
  } else {
    overhead = least;
  }
}

template <class Effect, class Model>
void add(Model& model) {
  typename Effect::template Coefficients<Fixed> c{};
  read(static_cast<std::uint16_t>(Model::template number_of<Effect>()), c);
  while (model.template add<Effect>(c)) {
  }
}
template <class Model>
void fill(Model& model) {
  model.clear();
  model.for_each([&]<class Effect>(auto&) { add<Effect>(model); });
}

// One image with one effect, and one with none: what an effect adds to a tick.
template <class Image>
struct Lone {
  using Model = model::DriveModel<Fixed, Image>;
  static inline Model model{};
  [[gnu::noinline, gnu::flatten]] static void tick(const Inputs<Fixed>& in, Torques<Fixed>& out) {
    out = model.tick(in);
  }
  static void count(const char* name) {
    fill(model);
    Torques<Fixed> out;
    measure(name, [&](const Inputs<Fixed>& in, const Loops::Command<Fixed>&) { tick(in, out); });
    sink = out.motor.raw ^ out.transmission.raw ^ out.load.raw;
  }
};

// Direction-dependent viscous and Coulomb friction, Stribeck, load dependence, a spring with |v|^alpha damping, two
// orders of ripple, presliding.
using Six = model::TheseEffects<2, 3, 4, 5, 6, 8, 10, 11, 11, 14, 15>;

// By a name of its own, whose flash and stack are looked up.
model::DriveModel<Fixed, Six> six;
[[gnu::noinline, gnu::flatten]] void six_effects_tick(const Inputs<Fixed>& in, Torques<Fixed>& out) {
  out = six.tick(in);
}

struct Drive {
  EncoderKalman::Coefficients<Fixed> filter{};
  EncoderKalman::State<Fixed> filter_state{};
  model::DriveModel<Fixed, Six> model{};
  Loops::Coefficients<Fixed> loops{};
  Loops::State<Fixed> loops_state{};
};
Drive drive;

[[gnu::noinline, gnu::flatten]] void filter_tick(Drive& d, const Inputs<Fixed>& in) {
  sink = EncoderKalman::update<Fixed>(d.filter_state, d.filter, in.angle).velocity.raw;
}
[[gnu::noinline, gnu::flatten]] void loops_tick(Drive& d, const Inputs<Fixed>& in,
                                                const Loops::Command<Fixed>& command) {
  sink = Loops::update<Fixed>(d.loops_state, d.loops, command, in.angle, in.velocity).current.raw;
}
// Encoder, model, loops with their limits.
[[gnu::noinline, gnu::flatten]] void whole_tick(Drive& d, const Inputs<Fixed>& measured,
                                                const Loops::Command<Fixed>& set) {
  const auto estimate = EncoderKalman::update<Fixed>(d.filter_state, d.filter, measured.angle);
  Inputs<Fixed> in;
  in.angle.raw = measured.angle.raw;
  in.velocity.raw = estimate.velocity.raw;
  in.direction.raw = measured.direction.raw;
  in.torsion.raw = measured.torsion.raw;
  in.torsion_rate.raw = measured.torsion_rate.raw;
  in.torsion_direction.raw = measured.torsion_direction.raw;
  in.torque.raw = measured.torque.raw;
  Loops::Command<Fixed> command;
  command.loop = set.loop;
  command.position = set.position;
  command.velocity.raw = set.velocity.raw;
  command.torque = Fixed::narrow(d.model.tick(in).motor);
  sink = Loops::update<Fixed>(d.loops_state, d.loops, command, measured.angle, estimate.velocity).current.raw;
}

// Loops of a drive of the report's class, per unit, as integers: no floating point here.
template <class G>
G gain(std::int32_t mantissa, int exponent) {
  G g;
  g.mantissa = mantissa;
  g.exponent = static_cast<std::int8_t>(exponent);
  if (!fixed::derive_fields(g)) bare::stop(5);
  return g;
}
void set_loops(Loops::Coefficients<Fixed>& c) {
  constexpr std::int32_t kHalf = std::int32_t{3} << 28;
  c.position = gain<fixed::DistanceGain>(kHalf, 0);
  c.velocity = {gain<fixed::Gain>(kHalf, 4)};
  c.integral.raw = std::uint64_t{1} << 53;
  c.velocity_limit.raw = c.torque_limit.raw = c.current_limit.raw = kOne;
  c.largest_velocity.raw = c.largest_torque.raw = 2 * kOne;
  c.guard.torque_limit.raw = kOne;
  c.guard.overspeed.raw = kOne + kOne / 4;
  c.guard.largest_velocity.raw = 2 * c.guard.overspeed.raw;
  c.guard.slope = {gain<fixed::Gain>(kHalf, 2)};
  c.current = {gain<fixed::Gain>(kHalf, 1)};
}

#if defined(FLEXSPLINE_PEERS)
template <class T, class Functions>
struct Peer {
  static inline peers::Six<T, Functions> six{};
  [[gnu::noinline, gnu::flatten]] static void tick(const peers::Signals<T>& in, peers::Torques<T>& out) {
    out = six.tick(in);
  }
  static void count(const char* name) {
    const auto real = [](Fixed::Value x) { return static_cast<T>(x.raw) / static_cast<T>(kOne); };
    std::uint32_t least = ~std::uint32_t{0}, most = 0;
    for (int k = 0; k < kTicks; ++k) {
      const Inputs<Fixed> in = random_inputs();
      const peers::Signals<T> signals{static_cast<T>(in.angle.raw) / T(4294967296.0),
                                      real(in.velocity),
                                      real(in.direction),
                                      real(in.torque),
                                      real(in.torsion),
                                      real(in.torsion_rate),
                                      real(in.torsion_direction)};
      peers::Torques<T> out;
      const std::uint32_t before = bare::counted();
      tick(signals, out);
      const std::uint32_t count = bare::counted() - before;
      sink = static_cast<std::int64_t>(out.motor * T(1e6) + out.transmission);
      if (k < 2) continue;
      if (count < least) least = count;
      if (count > most) most = count;
    }
    say(name, least, most);
  }
};
#endif

[[gnu::noinline]] void nothing(const Inputs<Fixed>& in, Torques<Fixed>& out) {
  asm volatile("" : : "r"(&in), "r"(&out) : "memory");
}

}  // namespace
}  // namespace flexspline::counts

int main() {
  using namespace flexspline;
  using namespace flexspline::counts;
  bare::start_counter();
  Torques<Fixed> out;
  measure(
      "", [&](const Inputs<Fixed>& in, const Loops::Command<Fixed>&) { nothing(in, out); }, false);
#if !defined(FLEXSPLINE_CYCLES)
  Lone<model::TheseEffects<>>::count("no_effect");
  effects::for_each_effect([]<class Effect>(std::size_t) {
    constexpr std::size_t kNumber = model::DriveModel<Fixed>::number_of<Effect>();
    if constexpr (!Effect::kInfo.host_only) Lone<model::TheseEffects<kNumber>>::count(Effect::kInfo.name.data());
  });
#endif
  fill(six);
  measure("six_effects", [&](const Inputs<Fixed>& in, const Loops::Command<Fixed>&) { six_effects_tick(in, out); });
  sink = out.motor.raw ^ out.transmission.raw;
  fill(drive.model);
  read(static_cast<std::uint16_t>(model::Section::encoder_filter), drive.filter);
  set_loops(drive.loops);
  measure("encoder_filter", [](const auto& in, const auto&) { filter_tick(drive, in); });
  measure("loops", [](const auto& in, const auto& command) { loops_tick(drive, in, command); });
  measure("whole_tick", [](const auto& in, const auto& command) { whole_tick(drive, in, command); });
#if defined(FLEXSPLINE_PEERS)
  Peer<float, peers::Careful>::count("six_in_careful_float");
  Peer<float, peers::Library<float>>::count("six_in_float_with_libm");
  Peer<double, peers::Library<double>>::count("six_in_double");
#endif
  return 0;
}
