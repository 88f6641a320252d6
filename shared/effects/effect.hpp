// The interface of a physical effect. An effect is written once, as templates over a number system N; its header makes
// it available in every command, in the simulation, in the diagnosis and in the firmware.
//
// A number system is a set of types and functions, not one scalar; README.md says what it has to offer. On
// the host all types are one plain scalar. Effects use operators between coefficients and signals and take every other
// function from N; they never branch on a value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>

namespace flexspline::effects {

// The three torque balances; an effect adds a term to the right-hand side of its own.
enum class Balance : std::uint8_t { motor, transmission, load };

// shift: changes a signal before any other effect sees it; modulate: scales another effect; source: adds a torque.
enum class Phase : std::uint8_t { shift, modulate, source };

// linear: the torque is proportional to it (and to all parameters that are stated relative to it); nonlinear: searched
// for within bounds; given: stated by the user; grid: set from the range of the data where the model does not state it,
// and then known.
enum class Kind : std::uint8_t { linear, nonlinear, given, grid };

// From what the bounds of a nonlinear parameter are derived when data are available.
enum class Limit : std::uint8_t {
  stated,            // low and high below hold for any data
  scale,             // the same, for a positive scale: searched for by its ratio to them
  velocity,          // a motor velocity: above the mask's limit, below a quarter of the fast motion
  travel,            // a motor angle: above the filter's resolution, below the shortest stroke between reversals
  torsion,           // a torsion: from 0.3 % of the largest torsion to a third of it
  corner,            // a torsion at a corner: from 0.3 % of the largest to 1.5 times it
  span,              // the whole range of a torsion: from half the largest to 1.3 times it
  current,           // a current: from a quarter of the largest, or the median if that is larger, to the largest
  inverse_velocity,  // one over a motor velocity, from a thousandth of the fast motion's to that of the slowest visible
  inverse_travel,    // one over a motor angle: the inverse of travel
  inverse_torsion,   // one over a torsion: from half the largest torsion's to above the resolution's
  inverse_torque,    // one over a torque: from a hundredth of the largest torque's to thirty times it
};

// The signals that an effect reads, so that it is offered only where the data have them.
enum Signals : std::uint16_t {
  kMotorMotion = 1,
  kMotorAngle = 2,
  kOutputMotion = 4,
  kOutputAngle = 8,
  kTorsion = 16,
  kTorque = 32,
  kCurrent = 64,
  kTemperature = 128,
  kTorqueInput = 256,      // where effort is given as torque or force, not as current
  kBothDirections = 1024,  // motion both ways: with one direction it is only a part of that direction's friction
  kDirection = 2048,       // of the motor's velocity, or the state of presliding that is in its place
  kTorqueScale = 512,      // needs something that fixes the torque scale: a known parameter, or a loaded torque sensor
};

// A unit on a rotary axis and its counterpart on a linear one: N*m becomes N, kg*m^2 kg and rad m, without brackets
// about one unit: {"1/(N*m)", "1/N"}.
struct Unit {
  std::string_view rotary;
  std::string_view linear;
};

namespace units {
inline constexpr Unit kNone{"1", "1"};
inline constexpr Unit kInertia{"kg*m^2", "kg"};
inline constexpr Unit kTorque{"N*m", "N"};
inline constexpr Unit kViscous{"N*m*s/rad", "N*s/m"};
inline constexpr Unit kVelocity{"rad/s", "m/s"};
inline constexpr Unit kAngle{"rad", "m"};
inline constexpr Unit kStiffness{"N*m/rad", "N/m"};
inline constexpr Unit kCurrent{"A", "A"};
inline constexpr Unit kPerKelvin{"1/degC", "1/degC"};
inline constexpr Unit kPerAngle{"1/rad", "1/m"};
inline constexpr Unit kTime{"s", "s"};
}  // namespace units

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

struct ParameterInfo {
  std::string_view name{};
  std::string_view symbol{};  // its letter in `equation`; empty where that is its name
  Unit unit{};
  Kind kind = Kind::linear;
  double usual = 0.0;  // on a drive of the report's class (N = 100, 40 N m, 0.15 N m motor)
  double low = -kUnbounded;
  double high = kUnbounded;
  Limit limit = Limit::stated;
  // How a nonlinear parameter is searched for where its own value is a poor measure: as a ratio to another parameter
  // (so that the torque is proportional to that one), or as the root of a power. Limits and the bounds above then hold
  // for
  //   reduced = (value / value(per))^(1 / value(root_of)).
  std::string_view per{};
  std::string_view root_of{};
  double share_of_range = 1.0;  // of the largest torsion, for kind grid
  bool per_record = false;      // a constant of each recording; the model has their mean
};

struct Description {
  std::string_view name{};
  Balance balance = Balance::motor;
  Phase phase = Phase::source;
  unsigned reads = 0;  // Signals
  std::string_view equation{};
  std::string_view shows_over{};
  std::string_view source{};
  std::string_view explanation{};    // what it is, for a reader who does not know it
  std::string_view consequence{};    // its influence on the motion
  std::string_view causes{};         // usual causes
  std::string_view check{};          // what to check on the machine
  std::string_view confused_with{};  // effects that it is confused with, separated by commas
  std::string_view separated_by{};   // the experiment that distinguishes them
  std::string_view replaces{};       // effects that it replaces, separated by commas
  std::string_view modulates{};      // the effect that it scales and needs in the model
  // Laws that are different formulas for the same curve have the same name here: most data cannot distinguish them.
  std::string_view family{};
  std::string_view contains{};  // effects whose torque it can represent as a part of its own
  // Waves over the angle whose phase depends on the direction where effort and motion are apart in time, or behind
  // presliding: they leave a torque like this one. So it is no candidate where such a wave of its order is in the
  // model, or was chosen before it.
  std::string_view phase_error_of{};
  // The meaning of negative amplitudes, and their meaning over a wide range of velocity, as it is another law then.
  std::string_view negative_means{};
  std::string_view wide_negative_means{};
  std::string_view wide_negative_is{};
  // The friction of which it is half the difference between the directions, and the symbols of both: "Tvp,Tvn".
  std::string_view asymmetry_of{};
  std::string_view direction_symbols{};
  // A surface whose friction differs from run to run, as the grease changes: effects with the same name scale together.
  std::string_view surface{};
  // Other balances that it adds to (bits of `on`); its parameters are estimated on its own balance, or, where they are
  // not identifiable on that, on the motor balance.
  unsigned adds_to = 0;
  bool identified_on_motor = false;
  bool acts_last = false;  // a shift that acts after all others
  bool host_only = false;  // too large for a drive
  // Its law is stated in the model file with its parameters, so that each one there is an effect of its own.
  bool user_defined = false;
  // Its torque is a weight times a signal of motion. On a drive that costs less than to find out whether the model has
  // it, so it runs at every tick, with a weight of zero where it has not.
  bool runs_always = false;
};
constexpr unsigned on(Balance balance) {
  return 1U << static_cast<unsigned>(balance);
}

// Constants of the drive for derivations, and the bases of per-unit numbers (all one where numbers are SI).
template <class P>
struct DriveConstants {
  P gear_ratio{1.0};
  P torque_constant{1.0};  // N m/A; one where effort is given as torque
  P rated_velocity{1.0};   // rad/s, motor side
  P reference_temperature{30.0};
  P turn_angle_scale{1.0};    // radians of motor turn per unit of motor position: 2 pi / pitch on a linear axis
  P torque_base{1.0};         // motor balance, N m
  P output_torque_base{1.0};  // transmission and load balance, N m
  P velocity_base{1.0};
  P output_velocity_base{1.0};
  P acceleration_base{1.0};
  P output_acceleration_base{1.0};
  P angle_base{1.0};
  P torsion_base{1.0};
  P torsion_rate_base{1.0};
  P temperature_base{1.0};
  P current_base{1.0};
  P time_base{1.0};  // of Inputs::elapsed: one tick on a drive
};

// Signals common to all effects, computed once a tick. Direction is an input: regression passes a smooth sign, a
// simulator +1, -1 or 0 from its set-valued solve.
template <class N>
struct Inputs {
  typename N::Angle angle{};  // motor
  typename N::Value velocity{};
  typename N::Value speed{};  // magnitude of the velocity
  typename N::Value direction{};
  typename N::Value acceleration{};
  typename N::Angle output_angle{};
  typename N::Value output_velocity{};
  typename N::Value output_direction{};
  typename N::Value output_acceleration{};
  typename N::Value torsion{};  // q/N - qo, at the output
  typename N::Value torsion_rate{};
  typename N::Value torsion_direction{};
  typename N::Value torque{};  // through the flexspline, output side
  typename N::Value torque_magnitude{};
  typename N::Value current{};
  typename N::Value temperature{};
  typename N::Value viscous_scale{};  // one unless an effect modulates
  typename N::Value coulomb_scale{};
  typename N::Value elapsed{};  // since the previous inputs; one on a drive, whose time base is its tick
};

template <class N>
struct Torques {
  typename N::Sum motor{};
  typename N::Sum transmission{};
  typename N::Sum load{};
};

// An effect without memory: it depends on the present tick only.
struct Stateless {
  template <class N>
  struct State {};
  template <class N, class C>
  static constexpr void advance(State<N>&, const C&, const Inputs<N>&, const Inputs<N>&) {}
};

// An effect that builds up over the motor's travel since a reversal: Dahl's bristle, z' = (w - abs(w) z)/presliding.
// Its coefficients have `per_travel`. The law is rate independent, so it is advanced by travel, with the exact solution
// for one direction: an explicit step of its rate form diverges at rated speed.
struct DahlBristle {
  template <class N>
  struct State {
    typename N::State deflection{};  // share of the full torque that the bristles carry, -1 to 1
  };
  template <class N, class C>
  static void advance(State<N>& state, const C& c, const Inputs<N>& now, const Inputs<N>& before) {
    const typename N::Step travel = now.angle - before.angle;
    const auto decay = N::exp_negative(N::travel(c.per_travel, N::magnitude(travel)));
    state.deflection = N::relax(state.deflection, N::sign(travel), decay);
  }
};

// The effect with a number in the parameter block; each effect's header defines its own. A number used twice does not
// compile, and numbers are not reused.
template <std::size_t Id>
struct AtId {
  using Effect = void;
};
inline constexpr std::size_t kLastId = 63;

#define FLEXSPLINE_EFFECT(ID, TYPE) \
  template <>                       \
  struct AtId<ID> {                 \
    using Effect = TYPE;            \
  };                                \
  static_assert(ID <= kLastId)

}  // namespace flexspline::effects
