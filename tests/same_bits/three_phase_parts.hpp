// The three-phase path: field-oriented control and the limits of its current under the worst inputs; the whole power
// stage with its protections, and commissioning, in closed loop with a motor in integers. Hashes of all that they give.
#pragma once

#include "firmware/three_phase.hpp"
#include "tests/counts/current_loop_example.hpp"
#include "tests/same_bits/drive_parts.hpp"
#include "tests/same_bits/integer_motor.hpp"

namespace flexspline::same_bits {

inline std::uint64_t hash_of_field_oriented(int periods) {
  foc::State state;
  foc::LimitState limits;
  foc::Outputs out;
  return hash_over(periods, [&](int k, Random& random, Hash& hash) {
    foc::Inputs in;
    in.readings.a = random.signal() >> 16;
    in.readings.b = random.signal() >> 16;
    in.readings.c = random.signal() >> 16;
    in.bus = static_cast<std::int32_t>(random.next() >> 49);
    in.angle = static_cast<std::uint32_t>(random.signal());
    in.step = random.signal();
    in.set_point.d = random.signal();
    in.set_point.q = random.signal();
    if (k % 512 == 0) foc::reset(state);
    foc::update(state, counts::kExampleSettings, in, out);
    take_all(hash, out.counts.a, out.counts.b, out.counts.c, out.measured.d, out.measured.q, out.wanted.d, out.wanted.q,
             out.most, state.unmeasured);
    const foc::Limits l =
        foc::limit_currents(limits, counts::kExampleLimits, in.set_point, out.measured, out.wanted, out.most, 8);
    take_all(hash, l.set_point.d, l.set_point.q, l.current, static_cast<std::int64_t>(l.by_heat));
  });
}

inline firmware::ThreePhaseSettings stage_settings() {
  firmware::ThreePhaseSettings s;
  s.foc = counts::kExampleSettings;
  s.limits = counts::kExampleLimits;
  s.offsets = {3276, 1638};
  s.least_bus = 13'107;
  s.most_bus = 30'583;
  s.most_phase = 10 * (std::int32_t{1} << 27) / 16;
  s.most_sum = (std::int32_t{1} << 27) / 16;
  auto& t = s.protection.thermistor;
  for (std::size_t k = 0; k < t.celsius.size(); ++k)
    t.celsius[k] = static_cast<std::int16_t>((200 - 4 * static_cast<int>(k)) << control::protection::kCelsiusBits);
  t.least = 800;
  t.most = 32'000;
  t.limit = 100 << control::protection::kCelsiusBits;
  t.restart = 90 << control::protection::kCelsiusBits;
  s.protection.chopper = {27'000, 3'000, 29'491, std::int64_t{1} << 36, 1'000'000};
  s.protection.winding = {3'000'000, 20'000'000, 25'000'000};
  s.protection.bootstrap_periods = 40;
  s.pole_pairs = IntegerMotor::kPolePairs;
  s.encoder_counts = 10'000;
  s.set_point = 2'000;
  s.reading = 1 << 20;
  s.test_modulation = {128'849'019, 30'064'771, 0, 0, 8'400};
  s.timer_counts = IntegerMotor::kTimerCounts;
  s.pwm_hz = 40'000;
  return s;
}

// A stage with its motor, one PWM period at a time.
class StageBench {
 public:
  StageBench() { stage.begin(stage_settings()); }
  firmware::ThreePhaseStage stage;
  IntegerMotor motor;
  bool driver_fault = false;
  std::int32_t temperature = 16'000;

  void period(Random& random, Hash& hash) {
    motor.step(out_.counts, out_.enabled);
    const auto counter = static_cast<std::uint32_t>((motor.angle() >> 8) * 10'000 >> 24);
    out_ = stage.update({motor.readings(random), motor.bus, counter, driver_fault, temperature});
    take_all(hash, out_.counts.a, out_.counts.b, out_.counts.c, static_cast<std::int64_t>(out_.enabled), out_.brake,
             static_cast<std::int64_t>(out_.clears_driver), static_cast<std::int64_t>(stage.fault()),
             static_cast<std::int64_t>(stage.current()), motor.angle());
    if (out_.clears_driver) driver_fault = false;
  }

 private:
  firmware::ThreePhaseStage::Outputs out_;
};

// One at a time: small machines have no memory for two.
inline StageBench& new_bench() {
  static StageBench bench;
  bench = {};
  return bench;
}

// Set points that change, a bus that rises and falls, faults now and then; off and on again between them.
inline std::uint64_t hash_of_stage(int periods) {
  StageBench& bench = new_bench();
  std::int16_t wanted = 0;
  int trouble = 0;
  return hash_over(periods, [&](int k, Random& random, Hash& hash) {
    const std::uint64_t bits = random.next();
    if (k % 400 == 0) wanted = static_cast<std::int16_t>(static_cast<std::int64_t>(bits) >> 49);
    if (k % 4'000 == 3'000) trouble = static_cast<int>(bits % 8);
    if (k % 4'000 == 0) trouble = 0;
    bench.motor.bus = IntegerMotor::kBus + static_cast<std::int32_t>(bits % 200);
    if (trouble == 1) bench.motor.bus = 9'000;
    if (trouble == 2) bench.motor.bus = 27'000 + static_cast<std::int32_t>(bits % 4'000);
    if (trouble == 3 && k % 4'000 == 3'000) bench.driver_fault = true;
    bench.motor.has_sensor_b = trouble != 7;
    bench.temperature = trouble == 4 ? 3'000 : trouble == 5 ? 32'700 : trouble == 6 ? 100 : 16'000;
    // The set point comes with the ticks, half as often.
    const int phase = k % 4'000;
    if (k % 2 == 0) bench.stage.command({wanted, phase >= 1'200 && phase < 3'800});
    bench.period(random, hash);
  });
}

inline control::commissioning::Settings commissioning_settings() {
  control::commissioning::Settings s;
  const firmware::ThreePhaseSettings stage = stage_settings();
  s.sensors.gain = {4096, 4096, 4096};
  s.modulation = stage.test_modulation;
  s.offsets = stage.offsets;
  s.timer_counts = stage.timer_counts;
  s.least_bus = 19'000;
  s.current = 1 << 25;
  s.most_current = 3 << 24;
  s.most_voltage = 49'000'000;
  s.voltage_ramp = 30'000;
  s.slow_step = 1'073'741;
  s.fast_step = 6'442'450;
  s.most_shaft_step = 4'294'967;
  s.step_ramp = 800;
  s.most_travel = 40 << 16;
  s.most_periods = 2'000'000;
  return s;
}

struct Commissioned {
  std::uint64_t hash = 0;
  control::commissioning::Result result;
  std::int32_t periods = 0;
  bool is_done = false;
};
inline Commissioned commission() {
  StageBench& bench = new_bench();
  Commissioned c;
  Hash hash;
  Random random;
  bench.stage.commission(commissioning_settings());
  while (bench.stage.commissions()) bench.period(random, hash);
  const auto& r = bench.stage.commissioning().result();
  take_all(hash, static_cast<std::int64_t>(r.fault), r.gain.a, r.gain.b, r.gain.c, r.offset.a, r.offset.b, r.offset.c,
           r.resistance, r.inductance_d, r.inductance_q, r.flux, r.lost_voltage, r.pole_pairs,
           static_cast<std::int64_t>(r.reversed), std::int64_t{r.offset_angle}, r.lag);
  c.hash = hash.value();
  c.result = r;
  c.periods = bench.stage.commissioning().periods();
  c.is_done = bench.stage.commissioning().done();
  return c;
}

// Calls print(name, hash) for each part. False where commissioning does not find this motor: then little of it ran.
template <class Print>
bool run_three_phase(int periods, Print&& print) {
  print("field_oriented_control", hash_of_field_oriented(periods));
  print("three_phase_stage", hash_of_stage(periods));
  const Commissioned c = commission();
  print("commissioning", c.hash);
  return c.is_done && c.result.fault == control::commissioning::Fault::none &&
         c.result.pole_pairs == IntegerMotor::kPolePairs;
}

}  // namespace flexspline::same_bits
