// The current loop of shared/control/foc as one would write it by hand in single precision: the same equations with SI
// units, no division but the one by the bus voltage. What the drive's integers are measured beside; a unit test shows
// that both give the same on-times.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tests/counts/peers.hpp"

namespace flexspline::peers {

struct FloatSetup {
  double resistance_ohm = 0, inductance_d_h = 0, inductance_q_h = 0, flux_vs = 0;
  double current_full_scale_a = 0, bus_full_scale_v = 0, pwm_hz = 0, timer_counts = 0;
  double lost = 0, zone_a = 0, pulse = 0, window = 0;  // shares of a period
  double bandwidth_hz = 0, proportional = 0, integral = 0, extrapolated = 0;
};

class FloatCurrentLoop {
 public:
  struct Inputs {
    std::int32_t a = 0, b = 0, c = 0, bus = 0;  // 2^-15 of full scale
    std::uint32_t angle = 0;                    // 2^-32 turns
    std::int32_t step = 0;
    float d = 0, q = 0;  // set point, A
  };
  struct Outputs {
    std::int32_t a = 0, b = 0, c = 0;
    float d = 0, q = 0, wanted_d = 0, wanted_q = 0, most = 0;
  };

  explicit FloatCurrentLoop(const FloatSetup& s) : d_(s, s.inductance_d_h), q_(s, s.inductance_q_h) {
    gain_ = static_cast<float>(s.current_full_scale_a / 32768.0);
    bus_gain_ = static_cast<float>(s.bus_full_scale_v / 32768.0);
    least_bus_ = static_cast<float>(s.bus_full_scale_v / 8.0);
    circle_ = static_cast<float>((1.0 - s.pulse) / std::sqrt(3.0));
    flux_ = static_cast<float>(s.flux_vs);
    pull_ = static_cast<float>(1.0 - std::exp(-kTurn * s.bandwidth_hz / s.pwm_hz));
    speed_ = static_cast<float>(kTurn * s.pwm_hz / 4294967296.0);
    integral_limit_ = static_cast<float>(s.bus_full_scale_v);
    counts_ = static_cast<float>(s.timer_counts);
    lost_ = static_cast<float>(s.lost);
    per_zone_ = static_cast<float>(1.0 / s.zone_a);
    pulse_ = static_cast<float>(s.pulse);
    window_ = static_cast<float>(s.window);
  }

  void tick(const Inputs& in, Outputs& out) {
    float a = static_cast<float>(in.a) * gain_, b = static_cast<float>(in.b) * gain_,
          c = static_cast<float>(in.c) * gain_;
    if (unmeasured_ == 3) c = -a - b;
    if (unmeasured_ == 1) a = -b - c;
    if (unmeasured_ == 2) b = -a - c;
    const float alpha = (2.0F * a - b - c) * 0.33333333F, beta = (b - c) * 0.57735027F;
    const float turns = static_cast<float>(static_cast<std::int32_t>(in.angle)) * 2.3283064e-10F;
    const float sine = Careful::sine(turns), cosine = Careful::sine(turns + 0.25F);
    const float i_d = alpha * cosine + beta * sine, i_q = beta * cosine - alpha * sine;
    const float step = static_cast<float>(in.step);
    float bus = static_cast<float>(in.bus) * bus_gain_;
    if (bus < least_bus_) bus = least_bus_;
    const float most = bus * circle_;
    d_.plan(pull_, in.d, i_d);
    q_.plan(pull_, in.q, i_q);
    const float w = step * speed_;
    const float want_d = d_.voltage - w * q_.inductance * q_.next;
    const float want_q = q_.voltage + w * (d_.inductance * d_.next + flux_);
    const float u_d = want_d < -most ? -most : want_d > most ? most : want_d;
    const float most_q = root(most * most - u_d * u_d);
    const float u_q = want_q < -most_q ? -most_q : want_q > most_q ? most_q : want_q;
    d_.advance(u_d - want_d, integral_limit_);
    q_.advance(u_q - want_q, integral_limit_);

    const float x = step * 1.4629181e-9F, square = x * x;
    const float s = x * (1.0F + square * (-0.16666667F + square * 0.0083333333F));
    const float k = 1.0F + square * (-0.5F + square * 0.041666667F);
    const float ahead_cosine = cosine * k - sine * s, ahead_sine = sine * k + cosine * s;
    const float per_bus = 1.0F / bus;
    const float v_alpha = (u_d * ahead_cosine - u_q * ahead_sine) * per_bus;
    const float v_beta = (u_d * ahead_sine + u_q * ahead_cosine) * per_bus;
    const float n_alpha = d_.next * ahead_cosine - q_.next * ahead_sine;
    const float n_beta = d_.next * ahead_sine + q_.next * ahead_cosine;
    modulate(v_alpha, v_beta, n_alpha, n_beta, out);
    out.d = i_d;
    out.q = i_q;
    out.wanted_d = want_d;
    out.wanted_q = want_q;
    out.most = most;
  }

 private:
  static constexpr double kTurn = 6.283185307179586;
  struct Axis {
    Axis(const FloatSetup& s, double l) {
      const double less = 1.0 - std::exp(-s.resistance_ohm / (s.pwm_hz * l)), half = std::sqrt(1.0 - less);
      inductance = static_cast<float>(l);
      resistance = static_cast<float>(s.resistance_ohm);
      slope = static_cast<float>(s.resistance_ohm / less);
      per_slope = static_cast<float>(less / s.resistance_ohm);
      middle = static_cast<float>(1.0 / (1.0 + half));
      weight = static_cast<float>(half + s.extrapolated);
      proportional = static_cast<float>(s.proportional * half) * slope;
      integral_gain = static_cast<float>(s.integral) * slope;
      pending_gain =
          static_cast<float>(s.extrapolated * half + (1.0 - s.extrapolated) / (1.0 + half) * s.proportional * half);
    }
    void plan(float pull, float set_point, float measured) {
      error = weight * (expected - measured) - pending;
      pending = pending_gain * error;
      move = pull * (set_point - model);
      next = model + middle * move - error + pending;
      voltage = integral + proportional * error + slope * move + resistance * model;
    }
    void advance(float excess, float limit) {
      const float change = move + excess * per_slope;
      expected = model + middle * change;
      model += change;
      if (excess != 0.0F && (excess < 0.0F) != (error < 0.0F)) return;
      const float sum = integral + integral_gain * error;
      if (sum < limit && sum > -limit) integral = sum;
    }
    float inductance, resistance, slope, per_slope, weight, middle, proportional, integral_gain, pending_gain;
    float integral = 0, model = 0, expected = 0, pending = 0;
    float error = 0, move = 0, next = 0, voltage = 0;
  };
  // The processor's own instruction, without the C library's errno.
  static float root(float x) {
#if defined(__ARM_FP)
    asm("vsqrt.f32 %0, %1" : "=t"(x) : "t"(x));
    return x;
#else
    return std::sqrt(x);
#endif
  }
  std::int32_t count(float duty, float current) const {
    if (duty <= 0.0F) return 0;
    float share = current * per_zone_;
    share = share < -1.0F ? -1.0F : share > 1.0F ? 1.0F : share;
    duty += share * lost_;
    duty = duty < 0.0F ? 0.0F : duty > 1.0F ? 1.0F : duty;
    return static_cast<std::int32_t>(duty * counts_ + 0.5F);
  }
  void modulate(float alpha, float beta, float i_alpha, float i_beta, Outputs& out) {
    const float a = alpha, b = 0.8660254F * beta - 0.5F * alpha, c = -0.8660254F * beta - 0.5F * alpha;
    const float low = std::min(a, std::min(b, c)), high = std::max(a, std::max(b, c)), span = high - low;
    float least = 0.5F * (1.0F - span);
    if (least < window_) least = 1.0F - window_ - span;
    if (least < pulse_) least = 0.0F;
    const float shift = least - low;
    out.a = count(a + shift, i_alpha);
    out.b = count(b + shift, 0.8660254F * i_beta - 0.5F * i_alpha);
    out.c = count(c + shift, -0.8660254F * i_beta - 0.5F * i_alpha);
    unmeasured_ = 1.0F - span - least < window_ ? (high == a ? 1 : high == b ? 2 : 3) : 0;
  }

  Axis d_, q_;
  float gain_, bus_gain_, least_bus_, circle_, flux_, pull_, speed_, integral_limit_, counts_;
  float lost_, per_zone_, pulse_, window_;
  std::int32_t unmeasured_ = 0;
};

}  // namespace flexspline::peers
