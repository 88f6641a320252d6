// A three-phase power stage as the drive's amplifier. The application hands one current to its board and gets one
// back, as from a servo amplifier; a board with three half bridges hands both to this class. Its two sides:
//   command(), current()   with the tick of the motion loops: the set point of the current in q, its limits
//   update()               once a PWM period, in the highest interrupt: field-oriented control, or commissioning
// The tick is slower than the PWM and is interrupted by it. Set points are single words, each valid by itself; d is
// other than zero in field weakening alone.
#pragma once

#include <atomic>
#include <cstdint>

#include "firmware/board.hpp"
#include "firmware/stage_protection.hpp"
#include "shared/control/commissioning/commissioning.hpp"
#include "shared/control/foc/current_limits.hpp"
#include "shared/control/foc/field_oriented.hpp"
#include "shared/control/motor_settings.hpp"

namespace flexspline::firmware {

struct ThreePhaseSettings {
  control::foc::Settings foc;
  control::foc::LimitSettings limits;
  control::foc::OffsetCalibration::Limits offsets;
  std::int32_t least_bus = 0;           // 2^-15 of full scale
  std::int32_t most_bus = INT16_MAX;    // likewise
  std::int32_t most_phase = INT32_MAX;  // current of a phase, 2^-27 of its base
  std::int32_t most_sum = INT32_MAX;    // of the three, likewise
  ProtectionSettings protection;
  // Electrical angle = +-pole_pairs encoder + offset_angle, as commissioning finds it. Zero: it was never done.
  std::int32_t pole_pairs = 1;
  bool reversed = false;
  std::uint32_t offset_angle = 0;    // 2^-32 turns
  std::uint32_t encoder_counts = 1;  // a turn
  std::int32_t set_point = 0;        // full scale of the command over the current's base, 2^-12; at most two
  std::int32_t reading = 0;          // the current's base over full scale of the reading, 2^-20
  // For commissioning, and for the host that makes its numbers.
  control::foc::ModulationSettings test_modulation;  // without dead-time compensation
  std::int32_t timer_counts = 0;                     // on-time of a duty of one
  std::uint32_t pwm_hz = 0;
  std::uint32_t current_full_scale_ma = 0;
  std::uint32_t bus_full_scale_mv = 0;
};

template <StageParts kParts>
class ThreePhaseStageOf {
 public:
  // One PWM period, sampled in the middle of the low sides' time.
  struct Inputs {
    control::foc::Phases readings;  // 2^-15 of full scale
    std::int32_t bus = 0;           // likewise
    std::uint32_t counter = 0;      // of the encoder, as Readings::motor_counter
    // Of the parts that the board has.
    bool driver_fault = false;
    std::int32_t temperature = 1 << 14;  // of the thermistor's divider, 2^-15
  };
  struct Outputs : control::commissioning::Outputs {
    std::int32_t brake = 0;      // share of the period for the brake resistor, 2^-15; on or off, whether it is enabled
    bool clears_driver = false;  // the driver's reset line
  };

  void begin(const ThreePhaseSettings& settings) {
    *this = {};
    s_ = made_ = settings;
    per_count_ = static_cast<std::uint32_t>((std::uint64_t{1} << 32) / s_.encoder_counts);
  }
  const ThreePhaseSettings& settings() const { return s_; }

  // The tick's side.

  void command(const Actuation& actuation) {
    const control::foc::RotorVector wanted = {0, signed_by_encoder(actuation.current * s_.set_point)};
    const control::foc::Limits l =
        control::foc::limit_currents(limits_, s_.limits, wanted, {out_.measured.d, out_.measured.q}, out_.wanted,
                                     out_.most, s_.foc.current.voltage_exponent);
    set_point_.d = l.set_point.d;
    set_point_.q = l.set_point.q;
    commanded_ = actuation.enabled;
  }
  // In q, a share of full scale of the reading, 2^-15.
  std::int16_t current() const {
    const std::int32_t reading = fixed::multiply_high(signed_by_encoder(out_.measured.q), s_.reading);
    return static_cast<std::int16_t>(fixed::limited<std::int32_t>(reading, -INT16_MAX, INT16_MAX));
  }
  // It is commanded on and stays off.
  bool tripped() const { return commanded_ && fault_ != StageFault::none; }
  StageFault fault() const { return fault_; }

  // The motor that commissioning found; without pole pairs, or with another encoder than the board's, that with which
  // the stage began. While the drive is not armed, and from background work. The interrupt may meanwhile calibrate the
  // zeros of the current sensors, with old and new gains: so they are measured again.
  void use(const control::MotorSettings& motor) {
    const bool is_found = motor.pole_pairs > 0 && motor.encoder_counts == made_.encoder_counts;
    s_.foc.sensors.gain = is_found ? motor.gain : made_.foc.sensors.gain;
    s_.foc.current = is_found ? motor.current : made_.foc.current;
    s_.foc.circle = is_found ? motor.circle : made_.foc.circle;
    s_.reversed = is_found ? motor.reversed : made_.reversed;
    s_.offset_angle = is_found ? motor.offset_angle : made_.offset_angle;
    s_.pole_pairs = is_found ? static_cast<std::int32_t>(motor.pole_pairs) : made_.pole_pairs;
    // After the gains, also for the compiler.
    std::atomic_signal_fence(std::memory_order_seq_cst);
    has_offsets_ = false;
  }
  bool is_commissioned() const { return s_.pole_pairs > 0; }
  bool is_sampled() const { return began_; }
  std::int32_t bus() const { return bus_; }

  // Takes the place of current control until it is done. The caller has the drive disarmed.
  void commission(const control::commissioning::Settings& settings) {
    commissioning_.begin(settings);
    commissioning_fault_ = StageFault::none;
    // The interrupt must not see it before it has begun.
    std::atomic_signal_fence(std::memory_order_seq_cst);
    commissions_ = true;
  }
  // From the next period on all switches are open.
  void stop_commissioning() { commissions_ = false; }
  // What of the stage ended it. The bus is too high where the rotor, which it turned, gave back more energy than the
  // bus could take.
  StageFault commissioning_fault() const { return commissioning_fault_; }
  bool commissions() const { return commissions_; }
  const control::commissioning::Commissioning& commissioning() const { return commissioning_; }

  // The interrupt's side.

  Outputs update(const Inputs& in) {
    follow(in.counter);
    bus_ = in.bus;
    const StageFault cause = protection_.update(s_.protection, in.driver_fault, in.temperature);
    Outputs out;
    static_cast<control::commissioning::Outputs&>(out) = commissions_ ? measure(in, cause) : run(in, cause);
    if (!out.enabled) protection_.discharge();
    out.brake = protection_.brake(s_.protection, in.bus);
    out.clears_driver = protection_.clears_driver(commanded_ || commissions_, in.driver_fault);
    return out;
  }

 private:
  static constexpr int kFilterBits = 4;  // of the speed: periods
  using Switches = control::commissioning::Outputs;

  // Cold: not a part of the current loop's code, and made for size.
  [[gnu::cold, gnu::noinline]] Switches measure(const Inputs& in, StageFault cause) {
    // The bus first: a driver may trip by it.
    commissioning_fault_ = in.bus > s_.most_bus ? StageFault::bus_high : cause;
    commissions_ = commissioning_fault_ == StageFault::none;
    if (!commissions_) return {};
    heat(in.readings);
    if (!protection_.charge(s_.protection)) return {{}, true};
    const Switches out = commissioning_.update({in.readings, in.bus, angle_});
    commissions_ = !commissioning_.done();
    return commissions_ ? out : Switches{};
  }
  // For the thermal limit in command(): the magnitude of the current, all of it in d, of which the application sees
  // nothing.
  void heat(const control::foc::Phases& readings) {
    const auto i = control::foc::clarke(control::foc::phase_currents(s_.foc.sensors, readings, 0));
    out_.measured = {control::foc::detail::current_of(control::foc::detail::square_of(i.alpha) +
                                                      control::foc::detail::square_of(i.beta)),
                     0};
  }
  // Once it runs it goes on until it is switched off: offsets are measured without current.
  Switches run(const Inputs& in, StageFault cause) {
    if (!commanded_ && latched_) {
      latched_ = false;
      fault_ = StageFault::none;
    }
    if (commanded_) check(in, cause);
    if (!commanded_ || latched_ || !(runs_ || has_offsets_)) return off(in.readings);
    if (!runs_) {
      control::foc::reset(state_);
      winding_.reset();
      runs_ = true;
    }
    if (!protection_.charge(s_.protection)) return {{}, true};
    const control::foc::Phases phases = control::foc::phase_currents(s_.foc.sensors, in.readings, state_.unmeasured);
    const control::foc::Inputs inputs = {
        in.readings, in.bus, electrical(angle_) + s_.offset_angle,
        static_cast<std::int32_t>(electrical(static_cast<std::uint32_t>(speed_ >> kFilterBits))), set_point_};
    control::foc::update(state_, s_.foc, inputs, out_);
    const auto found = winding_.update(s_.protection.winding, s_.foc, state_, inputs, out_, phases);
    if (found == control::protection::WindingFault::none) return {out_.counts, true};
    latch(found == control::protection::WindingFault::phase_lost ? StageFault::phase_lost
                                                                 : StageFault::voltage_residual);
    return off(in.readings);
  }
  std::uint32_t electrical(std::uint32_t angle) const {
    const std::uint32_t turned = angle * static_cast<std::uint32_t>(s_.pole_pairs);
    return s_.reversed ? 0 - turned : turned;
  }
  // A current in q accelerates towards growing electrical angles, one of the application towards growing counts.
  std::int32_t signed_by_encoder(std::int32_t current) const { return s_.reversed ? -current : current; }
  void follow(std::uint32_t counter) {
    if (!began_) {
      before_ = counter;
      position_ = counter % s_.encoder_counts;
      began_ = true;
    }
    const auto moved = static_cast<std::int32_t>(counter - before_);
    before_ = counter;
    // Less than a turn a period.
    const auto counts = static_cast<std::int32_t>(s_.encoder_counts);
    std::int32_t now = static_cast<std::int32_t>(position_) + fixed::limited(moved, -counts, counts);
    if (now < 0) now += counts;
    if (now >= counts) now -= counts;
    position_ = static_cast<std::uint32_t>(now);
    angle_ = position_ * per_count_;
    speed_ += std::int64_t{moved} * per_count_ - (speed_ >> kFilterBits);
  }
  void latch(StageFault fault) {
    if (latched_) return;
    latched_ = true;
    fault_ = fault;
  }
  void check(const Inputs& in, StageFault cause) {
    if (runs_) check_currents(in.readings);
    if (in.bus < s_.least_bus) latch(StageFault::bus_low);
    if (in.bus > s_.most_bus) latch(StageFault::bus_high);
    if (cause != StageFault::none) latch(cause);
  }
  void check_currents(const control::foc::Phases& readings) {
    const control::foc::Phases p = control::foc::phase_currents(s_.foc.sensors, readings, state_.unmeasured);
    if (control::commissioning::largest_size(p) > s_.most_phase) latch(StageFault::overcurrent);
    // The current of a phase that is not sampled follows from the others: their sum says nothing.
    if (state_.unmeasured != 0) return;
    const bool adds_up = control::commissioning::size(p.a + p.b + p.c) <= s_.most_sum;
    sum_periods_ = adds_up ? 0 : sum_periods_ + 1;
    if (sum_periods_ >= kSumPeriods) latch(StageFault::current_sum);
  }
  Switches off(const control::foc::Phases& readings) {
    sum_periods_ = 0;
    runs_ = false;
    out_.measured = {};
    out_.wanted = {};
    calibration_.add(readings);
    if (!calibration_.done()) return {};
    const auto result = calibration_.result(s_.foc.sensors, s_.offsets);
    has_offsets_ = result.fault == control::foc::OffsetFault::none;
    if (has_offsets_) s_.foc.sensors.offset = result.offset;
    if (!latched_) fault_ = has_offsets_ ? StageFault::none : StageFault::sensor_zero;
    calibration_ = {};
    return {};
  }

  ThreePhaseSettings s_;
  ThreePhaseSettings made_;  // as it began
  control::foc::State state_;
  control::foc::Outputs out_;
  control::foc::LimitState limits_;
  control::foc::RotorVector set_point_;
  control::foc::OffsetCalibration calibration_;
  StageFault fault_ = StageFault::none;
  bool latched_ = false;  // a fault of a stage that ran
  std::uint32_t sum_periods_ = 0;
  bool commanded_ = false;
  bool has_offsets_ = false;
  bool runs_ = false;
  bool commissions_ = false;
  bool began_ = false;
  std::int32_t bus_ = 0;
  std::uint32_t per_count_ = 0;
  std::uint32_t before_ = 0;
  std::uint32_t position_ = 0;  // counts within a turn
  std::uint32_t angle_ = 0;     // of the encoder, 2^-32 turns
  std::int64_t speed_ = 0;      // 2^-36 turns a period
  StageProtection<kParts> protection_;
  control::protection::WindingWatch winding_;
  StageFault commissioning_fault_ = StageFault::none;
  control::commissioning::Commissioning commissioning_;
};
// With all parts, as the twin's board has them.
using ThreePhaseStage = ThreePhaseStageOf<kAllStageParts>;

}  // namespace flexspline::firmware
