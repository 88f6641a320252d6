// The image of a board with three half bridges, wired to a simulated motor with its power stage: compare values of TIM1
// to legs, phase currents and bus voltage to the converters, the rotor to an encoder. The host is on the serial line.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "hil/motor/power_stage.hpp"
#include "hil/motor/shaft.hpp"
#include "shared/protocol/commissioning_payloads.hpp"
#include "shared/protocol/payloads.hpp"
#include "shared/protocol/serial_frame.hpp"
#include "tests/board/chip.hpp"

namespace flexspline::tests {

// How a board is wired, from its own papers and not from its driver.
struct StageWiring {
  std::string image;
  WrittenFlash written;
  std::array<std::uint32_t, 3> channels{1, 2, 3};  // TIM1's, of the legs
  std::array<std::uint32_t, 3> currents{};         // converter inputs of the legs' shunts
  std::array<bool, 3> has_shunt{true, true, true};
  double full_scale_a = 0.0;  // of half the converter's range
  double zero_share = 0.0;    // of an amplifier at no current
  bool currents_fall = false;
  std::uint32_t bus = 0;
  double bus_full_scale_v = 0.0;
  std::uint32_t temperature = 0;
  double temperature_share = 0.25;  // of the converter's range
  std::uint32_t counts = 4096;
};

class StageBench {
 public:
  StageBench(const StageWiring& w, const motor::MotorParameters& motor, const motor::InverterParameters& inverter,
             const motor::ShaftParameters& shaft = {}, const motor::WiringParameters& wires = {})
      : wiring(w),
        chip(w.image, w.written),
        power(motor, inverter, {.full_scale_a = w.full_scale_a}, motor::Fidelity::averaged, wires),
        rotor(shaft, motor.pole_pairs) {
    chip.senses = [this] { sense(); };
    chip.converter.later = [this] { put(wiring.bus, sample_.bus_v / wiring.bus_full_scale_v * 4095.0); };
  }
  void come_up() {
    ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
    ASSERT_EQ(chip.periods(300), Stop::waits) << chip.machine.where();
    ASSERT_EQ(ask(protocol::Kind::identify, protocol::Hello{}).code, 0) << "identify";
  }
  // A request over the serial line, a byte a period each way.
  template <class Payload>
  protocol::Message ask(protocol::Kind kind, const Payload& payload) {
    const auto frame = protocol::serial_frame(protocol::request(kind, ++number_, payload));
    chip.usart2.to_chip.insert(chip.usart2.to_chip.end(), frame.content().begin(), frame.content().end());
    chip.usart2.from_chip.clear();
    protocol::SerialReader reader;
    protocol::Message m;
    std::size_t read = 0;
    for (int k = 0; k < 2000; ++k) {
      EXPECT_EQ(chip.period(), Stop::waits) << chip.machine.where();
      while (read < chip.usart2.from_chip.size())
        if (reader.take(chip.usart2.from_chip[read++], m) && m.is_answer()) return m;
    }
    ADD_FAILURE() << "no answer";
    return m;
  }
  template <class Payload>
  Payload get(protocol::Kind kind) {
    Payload payload;
    EXPECT_EQ(protocol::take_payload(ask(kind, protocol::Empty{}).content(), payload), protocol::Code::done);
    return payload;
  }
  protocol::Status status() { return get<protocol::Status>(protocol::Kind::status); }
  protocol::Refusal command(const protocol::Command& c) {
    protocol::CommandAnswer answer;
    EXPECT_EQ(protocol::take_payload(ask(protocol::Kind::command, c).content(), answer), protocol::Code::done);
    return answer.refusal;
  }
  bool is_on() const { return chip.tim1.outputs_on() && driver_is_on(); }
  motor::Triple duties() const {
    motor::Triple d{};
    for (std::size_t leg = 0; leg < 3; ++leg) d[leg] = chip.tim1.duty_of(wiring.channels[leg]);
    return d;
  }
  // Of the stack, bytes that were never used.
  std::uint32_t unused_stack() const {
    constexpr std::uint32_t kPaint = 0xA5A5A5A5;
    const std::uint32_t bottom = chip.machine.symbol("stack_bottom"), top = chip.machine.symbol("stack_top");
    std::uint32_t at = bottom;
    while (at < top && chip.machine.word(at) == kPaint) at += 4;
    return at - bottom;
  }
  const motor::Sample& sample() const { return sample_; }
  void expect_no_violation() const {
    for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
  }

  StageWiring wiring;
  Chip chip;
  motor::PowerStage power;
  motor::Shaft rotor;
  std::function<bool()> driver_is_on = [] { return true; };
  std::function<void(std::uint32_t)> encoder = [this](std::uint32_t counts) { chip.tim2.move_to(counts); };
  std::function<void()> observes;  // each period, with its sample

 private:
  void put(std::uint32_t input, double raw) {
    chip.converter.inputs[input] =
        static_cast<std::uint32_t>(std::clamp(std::lround(raw + noise_(random_)), 0L, 4095L));
  }
  // From one bottom of the timer to the next. The sample is of its middle, with the compare values that were taken over
  // at its begin.
  void sense() {
    const double period_s = power.period_s(), begin = rotor.turns();
    if (is_on()) {
      sample_ = power.run(duties(), rotor.electrical());
    } else {
      power.rest(rotor.electrical());
      sample_ = {{}, {}, power.bus_v(), power.motor().torque_nm(rotor.electrical().angle)};
    }
    rotor.step(sample_.torque_nm, period_s);
    encoder(static_cast<std::uint32_t>(std::llround((begin + rotor.turns()) / 2.0 * wiring.counts)));
    for (std::size_t leg = 0; leg < 3; ++leg) {
      if (!wiring.has_shunt[leg]) continue;
      const double share = sample_.seen_a[leg] / wiring.full_scale_a;
      put(wiring.currents[leg], (1.0 + wiring.zero_share + (wiring.currents_fall ? -share : share)) * 2047.5);
    }
    put(wiring.temperature, wiring.temperature_share * 4095.0);
    if (observes) observes();
  }

  motor::Sample sample_;
  std::uint8_t number_ = 0;
  std::mt19937 random_{5};
  std::normal_distribution<double> noise_{0.0, 0.7};
};

}  // namespace flexspline::tests
