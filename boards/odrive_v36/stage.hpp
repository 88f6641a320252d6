// Numbers of the ODrive v3.6 (56 V) with a motor that nothing is known of. A unit test makes them from ohms and volts
// with host/drive_link/deployment: two shunts of 0.5 milliohm with amplifiers of 40 on 3.3 V, a divider by 19 at the
// bus, a thermistor of 10 kiloohm above 3.3, a brake resistor of 2 ohm; 20 kHz at 168 MHz, 240 ns dead time.
#pragma once

#include "firmware/three_phase.hpp"

namespace flexspline::odrive_v36 {

inline constexpr std::uint32_t kCurrentFullScaleMa = 82'500, kBusFullScaleMv = 62'700, kMostCurrentMa = 40'000;

inline constexpr firmware::StageParts kParts{
    .brake = true, .driver_fault = true, .thermistor = true, .bootstrap = true};

inline constexpr control::protection::ThermistorSettings kThermistor{
    .celsius = {-32640, -4758, -3211, -2213, -1453, -829,  -292,  184,   614,   1009,  1377,  1723,  2051,
                2363,   2663,  2953,  3233,  3506,  3773,  4034,  4291,  4545,  4795,  5043,  5289,  5535,
                5779,   6024,  6269,  6515,  6763,  7013,  7265,  7520,  7779,  8042,  8310,  8583,  8863,
                9149,   9444,  9748,  10062, 10387, 10726, 11079, 11448, 11837, 12248, 12683, 13149, 13648,
                14189,  14779, 15429, 16154, 16974, 17919, 19034, 20390, 22114, 24462, 28055, 32640, 32640},
    .least = 430,
    .most = 30'238,
    .opens_upwards = false,
    .limit = 12'800,    // 100 degrees Celsius
    .restart = 11'520,  // 90
};

// The axis of a motor of 0.3 ohm and 0.3 mH: the drive cannot be armed before its own was measured.
inline constexpr control::foc::AxisSettings kAxis{1546874780,  977692254,  52980682,   1086324727, 132663084,
                                                  -2120641500, 1611943798, 1766625812, 832218608};

constexpr firmware::ThreePhaseSettings stage_settings(std::uint32_t encoder_counts) {
  firmware::ThreePhaseSettings s;
  // The circle of the voltage leaves the sampling window free: two sensors cannot do without one of them.
  s.foc = {{{4096, 4096, 4096}, {}, true},
           {kAxis, kAxis, 6304686, 1157911625, 4194304, 8},
           {80229989, 11940009, 1342, 72089600, 16800},
           4481284};
  s.limits.peak_square = s.limits.continuous_square = s.limits.start_square = 252413138;  // 40 A
  s.limits.voltage_share = INT32_MAX;
  s.offsets = {3277, 1638};                                              // a tenth of full scale, a twentieth
  s.least_bus = 6271;                                                    // 12 V
  s.most_bus = 29'266;                                                   // 56 V
  s.most_phase = 91'105'367;                                             // 56 A
  s.protection.chopper = {26'653, 4815, 29'491, 3277525160444, 35'791};  // from 51 V on, all of it at 54; 300 J, 50 W
  s.protection.thermistor = kThermistor;
  s.protection.winding = {4648233, 26030105, 2104328, 2};
  s.protection.bootstrap_periods = 40;  // 2 ms
  s.pole_pairs = 0;
  s.encoder_counts = encoder_counts;
  s.set_point = 1986;  // 40 A
  s.reading = 1 << 20;
  s.test_modulation = {79886392, 11596412, 0, 0, 16800};
  s.timer_counts = 4200;
  s.pwm_hz = 20'000;
  s.current_full_scale_ma = kCurrentFullScaleMa;
  s.bus_full_scale_mv = kBusFullScaleMv;
  return s;
}

}  // namespace flexspline::odrive_v36
