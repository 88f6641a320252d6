// Numbers of the X-NUCLEO-IHM08M1 with a motor that nothing is known of. A unit test makes them from ohms and volts
// with host/drive_link/deployment: three shunts of 10 milliohm with amplifiers of 5.182 on 3.3 V, a divider of 169
// and 9.31 kiloohm at the bus, a thermistor of 10 kiloohm above 4.7; 20 kHz at 160 MHz, 500 ns dead time.
#pragma once

#include "firmware/three_phase.hpp"

namespace flexspline::nucleo_ihm08m1 {

inline constexpr std::uint32_t kCurrentFullScaleMa = 31'842, kBusFullScaleMv = 63'203, kMostCurrentMa = 15'000;

inline constexpr firmware::StageParts kParts{.driver_fault = true, .thermistor = true, .bootstrap = true};

inline constexpr control::protection::ThermistorSettings kThermistor{
    .celsius = {-32640, -5475, -4002, -3054, -2333, -1741, -1233, -783,  -376,  -3,    345,   671,   980,
                1275,   1558,  1830,  2095,  2351,  2602,  2848,  3090,  3327,  3563,  3795,  4027,  4257,
                4486,   4716,  4945,  5176,  5408,  5641,  5877,  6116,  6358,  6604,  6854,  7109,  7370,
                7637,   7912,  8195,  8488,  8791,  9106,  9434,  9778,  10139, 10520, 10924, 11356, 11819,
                12319,  12865, 13465, 14135, 14891, 15761, 16785, 18030, 19608, 21750, 25014, 31439, 32640},
    .least = 609,
    .most = 30'950,
    .opens_upwards = false,
    .limit = 11'520,    // 90 degrees Celsius
    .restart = 10'240,  // 80
};

// The axis of a motor of 0.3 ohm and 0.3 mH: the drive cannot be armed before its own was measured.
inline constexpr control::foc::AxisSettings kAxis{1184571806,  748700990,  40571754,   831889989, 173238277,
                                                  -2120641500, 1611943798, 1766625812, 637299614};

constexpr firmware::ThreePhaseSettings stage_settings(std::uint32_t encoder_counts) {
  firmware::ThreePhaseSettings s;
  s.foc = {{{4096, 4096, 4096}, {}, false},
           {kAxis, kAxis, 12509021, 1157911625, 8388608, 7},
           {97352592, 17895697, 2796, 55647928, 16000},
           9524891};
  s.limits.peak_square = s.limits.continuous_square = s.limits.start_square = 238276774;  // 15 A
  s.limits.voltage_share = INT32_MAX;
  s.offsets = {3277, 1638};   // a tenth of full scale, a twentieth
  s.least_bus = 5185;         // 10 V
  s.most_bus = 25'923;        // 50 V
  s.most_phase = 88'517'439;  // 21 A
  s.most_sum = 8'388'608;     // 2 A
  s.protection.thermistor = kThermistor;
  s.protection.winding = {4516196, 25290697, 4349128, 2};
  s.protection.bootstrap_periods = 40;  // 2 ms
  s.pole_pairs = 0;
  s.encoder_counts = encoder_counts;
  s.set_point = 1930;  // 15 A
  s.reading = 1 << 20;
  s.test_modulation = {96636764, 17179869, 0, 0, 16000};
  s.timer_counts = 4000;
  s.pwm_hz = 20'000;
  s.current_full_scale_ma = kCurrentFullScaleMa;
  s.bus_full_scale_mv = kBusFullScaleMv;
  return s;
}

}  // namespace flexspline::nucleo_ihm08m1
