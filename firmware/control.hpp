// The control tick: estimates from the sensors (observe), and the current for the demand (update).
#pragma once

#include <cstdint>

#include "firmware/board.hpp"
#include "firmware/messages.hpp"
#include "shared/control/drive_parameters.hpp"
#include "shared/control/hardware.hpp"
#include "shared/control/reachable.hpp"

namespace flexspline::firmware {

using Parameters = control::DriveParameters<N>;

// The demand, as the host sent it.
struct Demand {
  Mode mode = Mode::boot;
  bool compensate = false;
  bool stream = false;
  N::Angle position{};
  N::Value velocity{};
  N::Value acceleration{};
  N::Value current{};
};

// What does not run at every tick, as bits: slow tasks, and those that feed no loop, at every eighth, each at a
// different one; the lead of the feedforward at the ticks between them. So all ticks take about the same time.
enum SlowTask : std::uint32_t {
  kRippleTaken = 1U << 1,
  kRippleLearnt = 1U << 3,
  kTemperatureAndGear = 1U << 7,
  kResidualMap = 1U << 5,
  // Those that a block can have at every tick.
  kOutputVelocity = 1U << 7 | 1U << 8,
  kDisturbance = 1U << 5 | 1U << 9,
  kLead = 1U << 0 | 1U << 2 | 1U << 4 | 1U << 6 | 1U << 10,
};
inline constexpr std::uint32_t kSlowTicks = control::kSlowTicks, kEveryTick = 1U << 8 | 1U << 9 | 1U << 10;
static_assert(control::ResidualMap::kEveryTicks == kSlowTicks && control::Feedforward::kLeadTicks == 2);

struct Estimate {
  N::Angle angle{};  // of the motor
  N::Value velocity{};
  N::Value acceleration{};
  N::Angle output_angle{};  // of the output: measured, or estimated without an encoder there
  N::Value output_velocity{};
  N::Value torsion{};  // estimated without an encoder at the output, otherwise zero
  N::Value torque{};   // through the flexspline, without the sensor's ripple
  N::Value current{};
  N::Value temperature{};
  N::Value shown_current{};  // the full range of the sensor, for limits; a model's input ends at two bases
  N::Value shown_temperature{};
  N::Value disturbance{};
  std::int32_t moved = 0;  // counts of the motor's encoder since the previous tick
};

struct Output {
  N::Angle position{};  // the set point, within its limits
  N::Value velocity{};
  N::Value acceleration{};
  N::Value feedforward{};
  N::Value torque{};
  N::Value current{};
  N::Step lag{};     // mode position: the set point of the loop, less where the shaft is
  N::Value error{};  // of the velocity loop, where it is closed
  bool limited = false;
  bool at_rest = false;   // modes velocity and stop: the set point is zero and so is the shaft's velocity
  bool finished = false;  // the excitation is over
};

class Control {
 public:
  // A writer has to make sure that no tick reads them meanwhile, and has to call restart() afterwards.
  Parameters& parameters() { return p_; }
  const Parameters& parameters() const { return p_; }

  // After the parameters changed: all states at rest, only the angles of the shafts are kept. An encoder with another
  // number of counts per turn restarts. True where one did, or has another zero.
  [[gnu::noinline]] bool restart() {
    const bool restarted =
        motor_counts_ != p_.motor_encoder.counts || output_counts_ != p_.output_encoder.counts || zero_ != p_.zero;
    if (motor_counts_ != p_.motor_encoder.counts) motor_encoder_ = {};
    if (output_counts_ != p_.output_encoder.counts) output_encoder_ = {};
    motor_counts_ = p_.motor_encoder.counts;
    output_counts_ = p_.output_encoder.counts;
    zero_ = p_.zero;
    every_tick_ = p_.has_slow_rates ? 0 : kEveryTick;
    lowest_ = p_.trajectory.lowest;
    highest_ = p_.trajectory.highest;
    disturbance_ = {};
    forget_motion();
    off();
    know(knows_turn_, knows_output_);
    return restarted;
  }
  // The amplifier is off: the states of the loops are reset.
  void off() {
    loops_ = {};
    excitation_ = {};
    nominal_ = {};
    compensates_ = false;
  }

  // Angles of the shafts. Not for an armed tick.

  // Which angles are known: that of the motor within its turn, and that of the output. Effects and limits of position
  // that need an unknown angle are left out.
  [[gnu::noinline]] void know(bool turn, bool output) {
    constexpr std::int64_t kNoLimit = std::int64_t{1} << 62;
    knows_turn_ = turn;
    knows_output_ = output;
    p_.model.note_effects(turn, output);
    p_.trajectory.lowest = output ? lowest_ : -kNoLimit;
    p_.trajectory.highest = output ? highest_ : kNoLimit;
  }
  // The motor is at this angle, and the output at the corresponding one.
  [[gnu::noinline]] void set_angle(N::Angle motor) {
    observers::EncoderAngle::set(motor_encoder_, p_.motor_encoder, motor);
    if (p_.has_output_encoder) observers::EncoderAngle::set(output_encoder_, p_.output_encoder, output_of(motor));
    forget_motion();
    off();
  }
  // The output's angle is known within a turn, which is taken as the one around its zero. From it follows how many
  // turns the motor is from its zero, and also its angle within a turn where that is not known. Torsion is far less
  // than half a turn of the motor.
  [[gnu::noinline]] void take_output(bool keeps_rest) {
    const auto shown =
        static_cast<std::uint64_t>(observers::EncoderAngle::angle(output_encoder_, p_.output_encoder).raw);
    const N::Angle output{static_cast<std::int32_t>(static_cast<std::uint32_t>(shown))};
    observers::EncoderAngle::set(output_encoder_, p_.output_encoder, output);
    constexpr int kBits = 56;
    std::int64_t low = -(std::int64_t{1} << kBits), high = std::int64_t{1} << kBits;
    for (int halving = 0; halving <= kBits; ++halving) {
      const std::int64_t middle = low + (high - low) / 2;
      (output_of(N::Angle{middle}).raw <= output.raw ? low : high) = middle;
    }
    if (keeps_rest) {
      const std::int64_t now = observers::EncoderAngle::angle(motor_encoder_, p_.motor_encoder).raw;
      constexpr std::int64_t kHalf = std::int64_t{1} << (fixed::kAngleBits - 1);
      low = now + ((low - now + kHalf) >> fixed::kAngleBits << fixed::kAngleBits);
    }
    observers::EncoderAngle::set(motor_encoder_, p_.motor_encoder, N::Angle{low});
    forget_motion();
    off();
  }
  // The encoders' own angles, from the zeros of their shafts.
  [[gnu::noinline]] void take_absolute(bool motor, bool output) {
    using observers::EncoderAngle;
    if (p_.zero.motor.reading == 0 && p_.zero.output.reading == 0) return;
    if (motor)
      EncoderAngle::take_reading(motor_encoder_, p_.motor_encoder, motor_encoder_.before - p_.zero.motor.reading);
    if (output)
      EncoderAngle::take_reading(output_encoder_, p_.output_encoder, output_encoder_.before - p_.zero.output.reading);
    forget_motion();
    off();
  }
  // What the encoders show at the zeros of their shafts, with the angles as they are now. `origin`: of the motor's
  // counter; that of an absolute encoder is zero.
  [[gnu::noinline]] control::StoredZero zero_now(control::SensorKind motor, control::SensorKind output,
                                                 std::uint32_t origin) const {
    using control::SensorKind, observers::EncoderAngle;
    control::StoredZero zero;
    if (motor == SensorKind::absolute || motor == SensorKind::indexed)
      zero.motor = {p_.motor_encoder.counts, EncoderAngle::zero_of(motor_encoder_, p_.motor_encoder, origin),
                    static_cast<std::uint32_t>(motor)};
    if (output == SensorKind::absolute && p_.has_output_encoder)
      zero.output = {p_.output_encoder.counts, EncoderAngle::zero_of(output_encoder_, p_.output_encoder, 0),
                     static_cast<std::uint32_t>(output)};
    return zero;
  }
  // The motor's encoder had its index pulse at that count.
  [[gnu::noinline]] void take_index(std::uint32_t counter) {
    observers::EncoderAngle::set_whole_at(motor_encoder_, p_.motor_encoder, counter + p_.zero.motor.reading);
    forget_motion();
    off();
  }
  // Counts from the counters as they are, as at the start.
  void begin_encoders() { motor_encoder_ = output_encoder_ = {}; }
  // Called after one of these, for the same tick.
  void show_angles(Estimate& e) const {
    e.angle = observers::EncoderAngle::angle(motor_encoder_, p_.motor_encoder);
    if (p_.has_output_encoder) e.output_angle = observers::EncoderAngle::angle(output_encoder_, p_.output_encoder);
  }

  // Writes the estimates from the sensors into `e`. Fields of sensors that the drive does not have stay as they are;
  // those of slow signals change every eighth tick.
  void observe(const Readings& readings, std::uint32_t due, Estimate& e) {
    e.moved = observers::EncoderAngle::moved(motor_encoder_, readings.motor_counter);
    e.angle = observers::EncoderAngle::update(motor_encoder_, p_.motor_encoder, readings.motor_counter);
    const auto motor = observers::EncoderKalman::update<N>(motor_motion_, p_.motor_motion, e.angle);
    e.velocity = motor.velocity;
    e.acceleration = motor.acceleration;
    if (p_.has_output_encoder) {
      e.output_angle = observers::EncoderAngle::update(output_encoder_, p_.output_encoder, readings.output_counter);
      if ((due & kOutputVelocity) != 0)
        e.output_velocity =
            observers::EncoderKalman::update<N>(output_motion_, p_.output_motion, e.output_angle).velocity;
    }
    e.shown_current = control::shown(p_.current, readings.current);
    e.current = N::clamp(e.shown_current, two_bases());
    const N::Value applied = N::scaled(p_.torque_of_current, e.current);
    if (!p_.has_output_encoder) estimate_output(applied, e);
    if ((due & kTemperatureAndGear) != 0) {
      e.shown_temperature = control::shown(p_.temperature, readings.temperature);
      e.temperature = N::clamp(e.shown_temperature, two_bases());
    }
    if (p_.has_torque_sensor) observe_torque(control::shown(p_.torque, readings.torque, 2), due, e);
    if ((due & kDisturbance) != 0)
      e.disturbance =
          observers::DisturbanceObserver::update<N>(disturbance_, p_.disturbance, applied, nominal_.torque,
                                                    N::clamp(e.acceleration - nominal_.acceleration, two_bases()));
  }

  // The slow tasks of a tick.
  std::uint32_t due_at(std::uint32_t tick) const { return 1U << tick % kSlowTicks | every_tick_; }

  // Enters an armed mode at the shaft's present angle and velocity. The torque continues without a jump, except into a
  // mode whose set point is a torque: the integral of the velocity loop is set again, as the feedforward begins or
  // ends.
  [[gnu::noinline]] void start(const Demand& demand, const Estimate& e) {
    const bool goes_on =
        uses_trajectory(last_mode_) && uses_trajectory(demand.mode) && loops_.loop != control::Loop::off;
    if (!goes_on) {
      trajectory_ = control::Trajectory::moving<N>(p_.trajectory, e.angle.raw,
                                                   control::Trajectory::speed_of<N>(p_.trajectory, e.velocity));
    }
    if (demand.mode == Mode::excitation) control::Excitation::start<N>(excitation_, p_.excitation);
    loops_.loop = control::Loop::off;
    feedforward_ = {};
    nominal_ = {};
    torsion_ = {};
    p_.model.reset();
    last_mode_ = demand.mode;
    streams_ = false;
    take(demand);
  }

  // A new set point within the mode.
  void take(const Demand& demand) {
    if (demand.mode != Mode::position) return;
    if (demand.stream) {
      stream_ = control::Stream::at<N>(p_.stream, p_.trajectory, demand.position, demand.velocity, demand.acceleration);
    } else if (streams_) {
      trajectory_ = control::Trajectory::moving<N>(p_.trajectory, stream_.position, stream_.velocity);
    }
    streams_ = demand.stream;
  }

  // Between two set points of a stream the drive extrapolates.
  bool streams_in_motion() const { return streams_ && (stream_.velocity != 0 || stream_.change != 0); }

  // The residual of the motor's torque with the model of the previous tick, where there was one: off() and other modes
  // have none.
  bool has_residual() const { return compensates_; }
  N::Value residual() const { return disturbance_.residual; }

  // One armed tick: sets every field of `out`.
  void update(const Demand& demand, const Estimate& e, std::uint32_t due, Output& out) {
    clear(out);
    control::Loops::Command<N> command;
    switch (demand.mode) {
      case Mode::current:
        command.loop = control::Loop::torque;
        command.torque = N::scaled(p_.torque_of_current, N::clamp(demand.current, p_.loops.current_limit));
        break;
      case Mode::velocity:
      case Mode::stop:
        follow_velocity(demand.mode == Mode::stop ? N::Value{} : demand.velocity, e, out);
        command = {control::Loop::velocity, {}, out.velocity, {}};
        break;
      case Mode::position:
        follow_position(demand, out);
        command = {control::Loop::position, out.position, out.velocity, {}};
        break;
      case Mode::excitation:
        command = excite(e, out);
        break;
      default:
        off();
        out = {};
        return;
    }
    nominal_ = {};
    compensates_ = demand.compensate && uses_trajectory(demand.mode);
    if (compensates_) compensate(e, due, out, command);
    if (demand.mode == Mode::position) out.lag = command.position - e.angle;
    const auto loops = control::Loops::update<N>(loops_, p_.loops, command, e.angle, e.velocity);
    out.torque = loops.torque;
    out.current = loops.current;
    out.error = loops.error;
    out.limited = loops.limited;
    out.at_rest = out.velocity == N::Value{} && N::magnitude(e.velocity) <= p_.safety.standstill;
  }

 private:
  N::Angle output_of(N::Angle motor) const {
    return N::times_order(motor + p_.feedforward.to_output_zero, p_.feedforward.output_angle);
  }
  void forget_motion() {
    motor_motion_ = output_motion_ = {};
    torsion_ = {};
    ripple_ = {};
    torque_ripple_ = {};
  }
  static constexpr bool uses_trajectory(Mode mode) {
    return mode == Mode::velocity || mode == Mode::position || mode == Mode::stop;
  }
  static constexpr N::Value two_bases() { return N::one() + N::one(); }
  // The ripple that is taken out from the second to the ninth tick after the torque was stored is the one at the
  // eighth.
  void observe_torque(N::Value torque, std::uint32_t due, Estimate& e) {
    if ((due & kRippleTaken) != 0) {
      ripple_angle_ = ripple_.started ? e.angle + (e.angle - ripple_.before) : e.angle;
      observers::RippleFilter::take<N>(ripple_, p_.ripple, e.angle, torque);
    }
    if ((due & kRippleLearnt) != 0 && ripple_.started) {
      observers::RippleFilter::learn<N>(ripple_, p_.ripple);
      torque_ripple_ = observers::RippleFilter::ripple_at<N>(ripple_, p_.ripple, ripple_angle_);
    }
    e.torque = torque - torque_ripple_;
  }
  // The observer estimates how the drive differs from its nominal motion. Without a model friction would count as
  // torsion, and around a reversal it does: a stiff gear is the better estimate then.
  void estimate_output(N::Value applied, Estimate& e) {
    const N::Value rest = p_.safety.standstill;
    const bool forward = nominal_.velocity > rest && e.velocity > rest;
    const bool backward = nominal_.velocity < -rest && e.velocity < -rest;
    const auto difference = observers::TorsionObserver::update<N>(
        torsion_, p_.torsion, N::clamp(applied - nominal_.torque, two_bases()),
        N::clamp(e.velocity - nominal_.velocity, two_bases()), forward || backward);
    e.torsion = nominal_.torsion + difference.torsion;
    e.output_velocity = N::scaled(p_.output_of_velocity, nominal_.velocity) + difference.output_velocity;
    e.output_angle = N::times_order(e.angle, p_.output_angle) + N::distance(p_.torsion_turns, -e.torsion);
  }
  // The set point starts from where the shaft is at each tick, so that limits of position hold for the shaft.
  void follow_velocity(N::Value velocity, const Estimate& e, Output& out) {
    constexpr std::int64_t kFar = std::int64_t{4096} << fixed::kAngleBits;
    trajectory_.position = e.angle.raw;
    const N::Angle target = e.angle + N::Step{velocity.raw < 0 ? -kFar : kFar};
    set(control::Trajectory::update<N>(trajectory_, p_.trajectory, target.raw,
                                       control::Trajectory::speed_of<N>(p_.trajectory, N::magnitude(velocity))),
        out);
  }
  void follow_position(const Demand& demand, Output& out) {
    if (streams_) return set(control::Stream::update<N>(stream_, p_.trajectory), out);
    constexpr std::int64_t kAsFastAsAllowed = std::int64_t{1} << 62;
    const bool any = demand.velocity == N::Value{};
    set(control::Trajectory::update<N>(
            trajectory_, p_.trajectory, demand.position.raw,
            any ? kAsFastAsAllowed : control::Trajectory::speed_of<N>(p_.trajectory, N::magnitude(demand.velocity))),
        out);
  }
  // Field by field: of those that follow anyway nothing is left of it, and the rest is a few stores.
  static void clear(Output& out) {
    out.position = {};
    out.velocity = out.acceleration = out.feedforward = {};
    out.lag = {};
    out.finished = false;
  }
  static void set(const control::Trajectory::SetPoint<N>& point, Output& out) {
    out.position = point.position;
    out.velocity = point.velocity;
    out.acceleration = point.acceleration;
  }
  [[gnu::noinline]] control::Loops::Command<N> excite(const Estimate& e, Output& out) {
    const auto set_point = control::Excitation::update<N>(excitation_, p_.excitation, e.velocity);
    out.finished = control::Excitation::finished<N>(excitation_);
    if (p_.excites_torque) return {control::Loop::torque, {}, {}, set_point};
    out.velocity = set_point;
    return {control::Loop::velocity, {}, set_point, {}};
  }
  void compensate(const Estimate& e, std::uint32_t due, Output& out, control::Loops::Command<N>& command) {
    const auto forward = control::Feedforward::update<N>(feedforward_, p_.feedforward, p_.model,
                                                         {out.position, out.velocity, out.acceleration},
                                                         {e.angle, e.temperature, {}}, (due & kLead) != 0);
    out.feedforward = forward.torque;
    nominal_ = {forward.torque, out.velocity + forward.velocity, out.acceleration, feedforward_.torsion};
    command.torque = forward.torque;
    command.position = command.position + forward.lead;
    command.velocity = command.velocity + forward.velocity;
  }

  // A member, not a pointer: their address is known at compile time.
  Parameters p_{};
  observers::EncoderAngle::State motor_encoder_{};
  observers::EncoderAngle::State output_encoder_{};
  observers::EncoderKalman::State<N> motor_motion_{};
  observers::EncoderKalman::State<N> output_motion_{};
  observers::DisturbanceObserver::State<N> disturbance_{};
  observers::TorsionObserver::State<N> torsion_{};
  observers::RippleFilter::State<N> ripple_{};
  N::Angle ripple_angle_{};
  N::Value torque_ripple_{};
  control::Trajectory::State trajectory_{};
  control::Stream::State stream_{};
  control::Excitation::State<N> excitation_{};
  control::Feedforward::State<N> feedforward_{};
  control::Loops::State<N> loops_{};
  // The model's output of the previous tick, with compensation; otherwise rest without torque.
  struct Nominal {
    N::Value torque{};
    N::Value velocity{};
    N::Value acceleration{};
    N::Value torsion{};
  };
  Nominal nominal_{};
  // The parameters with which both encoders' angles were counted.
  std::uint32_t motor_counts_ = 0;
  std::uint32_t output_counts_ = 0;
  std::uint32_t every_tick_ = 0;  // slow tasks that the parameters have at every tick
  // Limits of position, as the parameters have them.
  std::int64_t lowest_ = 0;
  std::int64_t highest_ = 0;
  bool knows_turn_ = false;
  bool knows_output_ = false;
  Mode last_mode_ = Mode::boot;
  bool streams_ = false;
  bool compensates_ = false;
  control::StoredZero zero_{};  // that the parameters had at the last restart
};

}  // namespace flexspline::firmware
