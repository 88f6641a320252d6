// Measures a motor and its sensors before anything is known of them: a state of the drive with limits of its own, run
// once a PWM period in place of field-oriented control. The steps are in the order of `Step`; each stands on those
// before it:
//   bus, offsets                     all low sides on
//   short to ground                  all legs from low to half, at no voltage between them
//   resistance                       two direct currents along each phase: R, gains of the sensors, wiring
//   first inductance                 an injected voltage along phase a: gains of a slow current loop
//   pole pairs, forward, backward    a current vector that turns slowly: pole pairs, direction and angle of the encoder
//   inductances                      the injected voltage in the rotor's axes and between them
//   flux                             the voltage that the rotor induces, faster, both ways, at both signs of the
//   current
#pragma once

#include <cstdint>

#include "shared/control/commissioning/flux.hpp"
#include "shared/control/commissioning/injection.hpp"
#include "shared/control/commissioning/resistance.hpp"
#include "shared/control/commissioning/rotation.hpp"

namespace flexspline::control::commissioning {

class Commissioning {
 public:
  constexpr void begin(const Settings& settings) {
    *this = {};
    c_.settings = settings;
    c_.sensors = settings.sensors;
    c_.sensors.offset = {};
    output_.begin(settings);
  }
  constexpr Step step() const {
    if (step_ == Step::inductances && rotation_.stands()) return Step::does_it_turn;
    return step_ == Step::pole_pairs ? rotation_.step() : step_ == Step::flux_forward ? flux_.step() : step_;
  }
  constexpr bool done() const { return step_ == Step::done; }
  // Once it is done; valid without a fault.
  constexpr const Result& result() const { return c_.result; }
  constexpr std::int32_t periods() const { return periods_; }

  constexpr Outputs update(const Inputs& in) {
    if (done()) return {};
    readings_ = in.readings;
    c_.now = output_.sample(c_.sensors, in);
    if (periods_ == 0) c_.now.moved = 0;
    check_limits();
    if (c_.result.fault == Fault::none) {
      const Outputs out = {run(), true};
      if (c_.result.fault == Fault::none && !done()) return out;
    }
    step_ = Step::done;
    return {};
  }

 private:
  static constexpr std::int32_t kSumPeriods = 4;  // in a row
  static constexpr int kGroundBits = 10;          // periods from low to half
  static constexpr std::int32_t kStillPeriods = 2048;
  static constexpr std::int32_t kWholeGain = 4096;  // of an exact sensor

  constexpr void check_limits() {
    const Settings& s = c_.settings;
    if (++periods_ > s.most_periods) c_.fail(Fault::too_long);
    if (c_.now.bus < s.least_bus) c_.fail(Fault::bus_too_low);
    travel_ += c_.now.moved;
    const std::int64_t travel = travel_ >> 16;
    if (travel > s.most_travel || travel < -s.most_travel) c_.fail(Fault::too_far);
    const foc::Phases& p = c_.now.phases;
    const std::int32_t most = largest_size(p), least = smallest_size(p);
    // With all low sides on a rotor that something turns is short-circuited. The zeros of the sensors are not known
    // yet.
    if (step_ <= Step::offsets && most > s.most_current + s.offsets.offset * kWholeGain)
      c_.fail(Fault::current_flows, largest_phase(p));
    if (step_ <= Step::short_to_ground) return;
    if (most > s.most_current) {
      // A voltage along a phase puts half of its current in each of the others.
      if (step_ == Step::resistance && 4 * least < most)
        c_.fail(Fault::phases_shorted, smallest_phase(p));
      else
        c_.fail(Fault::overcurrent, largest_phase(p));
    }
    const auto shown = [&](std::int32_t x, int phase) {
      if (size(x) > s.current / 16) shown_ |= 1U << phase;
    };
    shown(p.a, 0);
    shown(p.b, 1);
    shown(p.c, 2);
    const bool adds_up = c_.sensors.two || size(p.a + p.b + p.c) <= s.current / 4;
    sum_periods_ = adds_up ? 0 : sum_periods_ + 1;
    if (sum_periods_ < kSumPeriods) return;
    for (int phase = 0; phase < 3; ++phase)
      if ((shown_ & (1U << phase)) == 0) c_.fail(Fault::current_sum, phase + 1);
    c_.fail(Fault::gains_differ);
  }
  constexpr foc::Phases run() {
    switch (step_) {
      case Step::bus:
        step_ = Step::offsets;
        return output_.common(0);
      case Step::offsets:
        return offsets();
      case Step::short_to_ground:
        return ground();
      case Step::resistance:
        return resistance();
      case Step::first_inductance:
        return first_inductance();
      case Step::pole_pairs:
        return rotation();
      case Step::inductances:
        return inductances();
      case Step::flux_forward:
        return flux();
      default:
        return output_.common(0);
    }
  }
  constexpr foc::Phases offsets() {
    calibration_.add(readings_);
    if (!calibration_.done()) return output_.common(0);
    const foc::OffsetCalibration::Result r = calibration_.result(c_.sensors, c_.settings.offsets);
    if (r.fault == foc::OffsetFault::offset_too_large) c_.fail(Fault::offset_too_large, r.phase);
    if (r.fault == foc::OffsetFault::current_flows) c_.fail(Fault::current_flows, r.phase);
    c_.sensors.offset = r.offset;
    step_ = Step::short_to_ground;
    return output_.common(0);
  }
  constexpr foc::Phases ground() {
    if (largest_size(c_.now.phases) > c_.settings.current / 4)
      c_.fail(Fault::short_to_ground, largest_phase(c_.now.phases));
    if (++count_ == (2 << kGroundBits)) begin(Step::resistance);
    const std::int32_t up = count_ < (1 << kGroundBits) ? count_ : 1 << kGroundBits;
    return output_.common((output_.rest() * up) >> kGroundBits);
  }
  constexpr foc::Phases resistance() {
    const foc::StatorVector v = resistance_.update(c_);
    if (resistance_.done()) {
      resistance_.conclude(c_);
      begin(Step::first_inductance);
    }
    return output_.on_times(c_.settings, v, c_.now.bus);
  }
  // The voltage of the test current at rest goes up along phase a again.
  constexpr foc::Phases first_inductance() {
    constexpr std::int32_t kRise = 512;
    const std::int32_t whole = level();
    if (count_ < kRise + kStillPeriods) ++count_;
    const std::int32_t share = count_ < kRise ? count_ : kRise;
    std::int32_t added = 0;
    if (count_ == kRise + kStillPeriods)
      added = injection_.update(c_.settings, c_.now.voltage.alpha, c_.now.current.alpha);
    if (injection_.done()) {
      loop_.begin(c_.result.resistance, injection_.inductance(c_.result.resistance), {drop(), 0});
      rotation_.begin(0);
      begin(Step::pole_pairs);
    }
    const auto held = static_cast<std::int32_t>((std::int64_t{whole} * share) >> 9);
    return output_.on_times(c_.settings, {held + added, 0}, c_.now.bus);
  }
  constexpr std::int32_t drop() const { return scaled(c_.result.resistance, c_.settings.current, kSharesBits - 1); }
  constexpr std::int32_t level() const { return drop() + c_.result.lost_voltage + c_.result.lost_voltage / 3; }
  constexpr foc::Phases rotation() {
    const foc::Rotation at = foc::rotation(rotation_.vector().angle());
    const foc::RotorVector wanted = rotation_.wanted(c_);
    const foc::RotorVector v = loop_.update(wanted, in_axes(c_.now.current, at), c_.settings.most_voltage);
    rotation_.update(c_, in_axes(c_.motor_voltage(), at));
    if (rotation_.done() || rotation_.stands()) begin(Step::inductances);
    const foc::StatorVector u = compensated(v, wanted, foc::rotation(rotation_.vector().angle()));
    return output_.on_times(c_.settings, u, c_.now.bus);
  }
  // With what the legs lose at the currents that are wanted: else these stay at zero whenever they pass it, until the
  // loop has made up for the losses' change of sign.
  constexpr foc::StatorVector compensated(const foc::RotorVector& v, const foc::RotorVector& wanted,
                                          const foc::Rotation& at) const {
    const foc::StatorVector u = in_stator(v, at), lost = c_.lost(foc::inverse_clarke(in_stator(wanted, at)));
    return {u.alpha + lost.alpha, u.beta + lost.beta};
  }
  // The current along the rotor's own axis makes no torque. While the voltage is injected nothing else changes. Where
  // the encoder says nothing of that axis, it is along the vector that the rotor may have followed; half of the
  // current, as the flux of all of it is about in proportion to the inductance there.
  constexpr foc::Phases inductances() {
    const bool follows = !rotation_.stands();
    if (count_ == 0 || count_ == kStillPeriods) placed_ = rotor_axis();
    const foc::Rotation at = foc::rotation(placed_);
    if (count_ < 2 * kStillPeriods) {
      ++count_;
      const foc::RotorVector wanted = {follows ? c_.settings.current : c_.settings.current / 2, 0};
      held_ = compensated(loop_.update(wanted, in_axes(c_.now.current, at), c_.settings.most_voltage), wanted, at);
      return output_.on_times(c_.settings, held_, c_.now.bus);
    }
    // It may shake the rotor loose.
    if (!injection_.measures()) facing_ = rotor_axis();
    const foc::Rotation axis = foc::rotation(facing_ + static_cast<std::uint32_t>(axis_) * (1U << 29));
    const std::int32_t added =
        injection_.update(c_.settings, in_axes(c_.now.voltage, axis).d, in_axes(c_.now.current, axis).d);
    const foc::StatorVector more = in_stator({added, 0}, axis);
    if (injection_.done()) next_axis();
    return output_.on_times(c_.settings, {held_.alpha + more.alpha, held_.beta + more.beta}, c_.now.bus);
  }
  constexpr std::uint32_t rotor_axis() const {
    return rotation_.stands() ? rotation_.vector().angle() : rotor_angle(c_.result, c_.now.encoder);
  }
  constexpr void next_axis() {
    along_[axis_] = injection_.inductance(c_.result.resistance);
    injection_.begin();
    if (++axis_ < kAxes) return;
    const Inductances found = inductances_of(along_[0], along_[1], along_[2], 0);
    if (rotation_.stands()) return rotation_.conclude_turning(c_, found);
    c_.result.inductance_d = found.d;
    c_.result.inductance_q = found.q;
    c_.result.offset_angle += static_cast<std::uint32_t>(found.off);
    loop_.begin(c_.result.resistance, found.d < found.q ? found.d : found.q, {});
    flux_.begin(c_);
    begin(Step::flux_forward);
  }
  constexpr foc::Phases flux() {
    const std::uint32_t angle = rotor_angle(c_.result, c_.now.encoder);
    const foc::Rotation at = foc::rotation(angle);
    const foc::RotorVector current = in_axes(c_.now.current, at);
    const foc::RotorVector wanted = flux_.wanted(c_);
    const foc::RotorVector v = loop_.update(wanted, current, c_.settings.most_voltage);
    flux_.update(c_, current, in_axes(c_.motor_voltage(), at), v);
    if (flux_.done()) step_ = Step::done;
    const foc::StatorVector u = compensated(v, wanted, foc::rotation(angle + flux_.ahead(c_)));
    return output_.on_times(c_.settings, u, c_.now.bus);
  }
  constexpr void begin(Step step) {
    step_ = step;
    count_ = 0;
    injection_.begin();
  }

  Context c_;
  PowerOutput output_;
  Step step_ = Step::bus;
  std::int32_t periods_ = 0;
  std::int32_t count_ = 0;
  std::int32_t sum_periods_ = 0;
  std::uint32_t shown_ = 0;  // phases of which a sensor has shown current
  std::int64_t travel_ = 0;
  static constexpr int kAxes = 3;
  std::uint32_t placed_ = 0;  // of the current
  std::uint32_t facing_ = 0;  // of the rotor where the injection is measured
  int axis_ = 0;
  std::int32_t along_[kAxes]{};  // inductances
  foc::StatorVector held_;
  foc::Phases readings_;
  foc::OffsetCalibration calibration_;
  ResistanceTest resistance_;
  Injection injection_;
  SlowCurrentLoop loop_;
  RotationTest rotation_;
  FluxTest flux_;
};

}  // namespace flexspline::control::commissioning
