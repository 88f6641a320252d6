// The six effects as one would write them by hand in floating point: the drive's integers are compared with them.
// `Library` takes functions of the C library in the type at hand; `Careful` is single precision with polynomials, no
// division and no branch beyond what the equations need.
#pragma once

#include <cmath>
#include <cstdint>

namespace flexspline::peers {

template <class T>
struct Signals {
  T turns = 0, velocity = 0, direction = 0, torque = 0, torsion = 0, rate = 0, rate_direction = 0;
};
template <class T>
struct Torques {
  T motor = 0, transmission = 0;
};

template <class T>
struct Library {
  static T exp(T x) { return std::exp(x); }
  static T pow(T x, T e) { return std::pow(x, e); }
  static T sine(T turns) { return std::sin(T(6.283185307179586) * turns); }
};
struct Careful {
  static float power_of_two(float x) {
    const float whole = static_cast<float>(static_cast<std::int32_t>(x + (x < 0.0F ? -0.5F : 0.5F)));
    const float r = x - whole;
    const float p =
        1.0F + r * (0.69314718F + r * (0.24022650F + r * (0.05550411F + r * (0.00961813F + r * 0.00133336F))));
    const auto exponent = static_cast<std::int32_t>(whole);
    return exponent < -126 ? 0.0F : p * __builtin_bit_cast(float, (exponent + 127) << 23);
  }
  static float exp(float x) { return power_of_two(1.44269504F * x); }
  static float pow(float x, float e) {
    if (x == 0.0F) return 0.0F;
    const auto bits = __builtin_bit_cast(std::uint32_t, x);
    const std::int32_t up = (bits & 0x7FFFFF) > 0x3504F3 ? 1 : 0;
    const std::int32_t exponent = static_cast<std::int32_t>(bits >> 23) - 127 + up;
    const float m = __builtin_bit_cast(float, (bits & 0x7FFFFF) | (static_cast<std::uint32_t>(127 - up) << 23)) - 1.0F;
    const float log =
        m * (1.44269504F +
             m * (-0.72134752F +
                  m * (0.48089835F + m * (-0.36067376F +
                                          m * (0.28853901F + m * (-0.2404492F + m * (0.2060993F - m * 0.1803369F)))))));
    return power_of_two(e * (static_cast<float>(exponent) + log));
  }
  static float sine(float turns) {
    float t = turns - static_cast<float>(static_cast<std::int32_t>(turns + (turns < 0.0F ? -0.5F : 0.5F)));
    if (t > 0.25F) t = 0.5F - t;
    if (t < -0.25F) t = -0.5F - t;
    const float s = t * t;
    return t * (6.2831853F + s * (-41.341702F + s * (81.605249F + s * (-76.705859F + s * 42.058693F))));
  }
};

template <class T, class Functions>
struct Six {
  T viscous = T(0.14), viscous_asymmetry = T(0.01), coulomb = T(0.09), coulomb_asymmetry = T(0.01);
  T stribeck_positive = T(0.024), stribeck_negative = T(0.024), per_stribeck = T(66.7);
  T load = T(0.024), stiffness = T(0.98), damping = T(1.4), exponent = T(0.5);
  T order[2] = {T(2), T(2)}, amplitude[2] = {T(0.008), T(0.008)}, phase[2] = {T(0.25), T(0.25)};
  T presliding = T(125), bristles = T(0.09), deflection = 0, before = 0;

  Torques<T> tick(const Signals<T>& in) {
    const T speed = std::abs(in.velocity);
    const T bell = per_stribeck * in.velocity;
    T motor = viscous * in.velocity + viscous_asymmetry * speed + coulomb * in.direction +
              coulomb_asymmetry * in.direction * in.direction;
    motor += (in.direction > 0 ? stribeck_positive : stribeck_negative) * in.direction * Functions::exp(-bell * bell);
    motor += load * std::abs(in.torque) * in.direction;
    for (int k = 0; k < 2; ++k) motor += amplitude[k] * Functions::sine(order[k] * in.turns + phase[k]);
    const T travel = in.turns - before;
    before = in.turns;
    const T target = travel > 0 ? T(1) : travel < 0 ? T(-1) : T(0);
    deflection = target + (deflection - target) * Functions::exp(-presliding * std::abs(travel));
    motor += bristles * deflection;
    return {motor, stiffness * in.torsion + damping * Functions::pow(std::abs(in.rate), exponent) * in.rate_direction};
  }
};

}  // namespace flexspline::peers
