// The signals of a record: what is kept and what is made of it gives the same, however it is asked for.
#include "host/engine/estimation/record_signals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "host/common/signals/differentiate.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"

namespace flexspline::estimation::estimation_record_signals_test {
namespace {

using Inputs = RecordSignals::Inputs;

RecordSignals two_segments(std::size_t samples) {
  RecordSignals s;
  s.resize(samples);
  s.segments = {{3, samples / 3}, {samples / 3 + 5, samples}};
  s.sample_s = 1e-3;
  s.gear_ratio = 100.0;
  s.velocity_noise = {0.3, 0.003, 0.002};
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    s.angle.push_back(5.0 * std::sin(3.0 * t));
    s.velocity.push_back(15.0 * std::cos(3.0 * t));
    s.output_angle.push_back(0.05 * std::sin(3.0 * t + 0.1));
    s.output_velocity.push_back(0.15 * std::cos(3.0 * t + 0.1));
    s.torque.push_back(4.0 * std::sin(t));
  }
  return s;
}

TEST(RecordSignals, AccelerationsAreSlopesOfTheVelocitiesWithinEachSegment) {
  const RecordSignals s = two_segments(1500);
  for (const data::Segment& segment : s.segments) {
    const auto part = [&](const std::vector<double>& x) {
      return signals::central_derivative(std::span(x).subspan(segment.first, segment.last - segment.first), s.sample_s);
    };
    const std::vector<double> motor = part(s.velocity), output = part(s.output_velocity);
    for (std::size_t k = segment.first; k < segment.last; ++k) {
      const Inputs in = s[k];
      ASSERT_EQ(in.acceleration, motor[k - segment.first]) << k;
      ASSERT_EQ(in.output_acceleration, output[k - segment.first]) << k;
    }
  }
}

TEST(RecordSignals, AreTheSameAloneInStretchesAndWithDirectionsThatAreKept) {
  RecordSignals s = two_segments(1500);
  const RecordSignals made = s;
  s.keep_directions();
  s.all().each_block([&](std::size_t first, std::span<const Inputs> block) {
    for (std::size_t k = 0; k < block.size(); ++k) {
      const Inputs alone = made[first + k];
      ASSERT_EQ(std::memcmp(&alone, &block[k], sizeof alone), 0) << first + k;
      ASSERT_EQ(alone.direction, std::tanh(s.velocity[first + k] / 0.3));
      ASSERT_EQ(alone.torsion, s.angle[first + k] / 100.0 - s.output_angle[first + k]);
    }
  });
}

TEST(RecordSignals, AnOutputThatIsNotMeasuredFollowsTheMotorOrIsLocked) {
  RecordSignals s = two_segments(600);
  s.output_angle.clear();
  s.output_velocity.clear();
  const Inputs follows = s[100];
  EXPECT_EQ(follows.output_angle, follows.angle / 100.0);
  EXPECT_EQ(follows.output_acceleration, follows.acceleration / 100.0);
  EXPECT_EQ(follows.torsion, 0.0);
  s.locked = true;
  const Inputs locked = s[100];
  EXPECT_EQ(locked.output_angle, 0.0);
  EXPECT_EQ(locked.output_acceleration, 0.0);
  EXPECT_EQ(locked.torsion, locked.angle / 100.0);
}

TEST(RecordSignals, EveryFewSamplesKeepTheDerivativesOfAll) {
  const RecordSignals s = two_segments(1500);
  const RecordSignals few = s.every(4);
  ASSERT_EQ(few.segments.size(), 2u);
  EXPECT_EQ(few.sample_s, 4e-3);
  std::size_t at = 0;
  for (const data::Segment& segment : s.segments)
    for (std::size_t k = segment.first; k < segment.last; k += 4, ++at) {
      Inputs expected = s[k];
      expected.elapsed = few.sample_s;
      const Inputs in = few[at];
      ASSERT_EQ(std::memcmp(&expected, &in, sizeof in), 0) << k;
    }
  EXPECT_EQ(few.size(), at);
}

// What an effect adds to a balance, of all signals, is the same where those that it does not state hold nothing.
void expect_reads_what_it_states(const catalogue::Entry& entry, const std::vector<double>& parameters) {
  constexpr std::size_t kSamples = 200;
  RecordSignals s = two_segments(kSamples);
  s.current = ScaledSignal(std::vector<double>(kSamples, 1.3));
  s.temperature.assign(kSamples, 41.0);
  for (const effects::Balance balance :
       {effects::Balance::motor, effects::Balance::transmission, effects::Balance::load}) {
    std::vector<Inputs> stated(kSamples);
    for (Inputs& in : stated)
      for (double *x = &in.angle, *end = x + sizeof(Inputs) / sizeof(double); x < end; ++x)
        *x = std::numeric_limits<double>::quiet_NaN();
    s.copy(0, stated, entry.info->reads);
    std::vector<double> of_stated(kSamples, 0.0), of_all(kSamples, 0.0);
    entry.real.torque_of_plain(parameters.data(), {}, balance, stated, of_stated.data());
    entry.real.torque_of_plain(parameters.data(), {}, balance, s.all(), of_all.data());
    for (std::size_t k = 0; k < kSamples; ++k)
      ASSERT_EQ(of_stated[k], of_all[k]) << entry.name() << " " << entry.label << ", sample " << k;
  }
}

TEST(RecordSignals, EffectsReadNoSignalThatTheyDoNotState) {
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (!entry.adds_torque()) continue;
    std::vector<double> parameters;
    for (const auto& p : entry.parameters) parameters.push_back(p.usual == 0.0 ? 0.5 : p.usual);
    expect_reads_what_it_states(entry, parameters);
  }
}

TEST(RecordSignals, TablesReadTheirVariableAndTheDirectionOfTheirBalance) {
  for (const effects::VariableInfo& variable : effects::kVariables)
    for (const char* balance : {"motor", "transmission", "load"})
      for (const bool times_direction : {false, true}) {
        model::Effect effect{"table_effect", "table", {}, model::Definition{}};
        effect.definition->variable = variable.name;
        effect.definition->balance = balance;
        effect.definition->times_direction = times_direction;
        const double turn = 2.0 * std::numbers::pi;
        effect.definition->table.at = {0.0, 0.25 * turn, 0.5 * turn, 0.75 * turn};
        effect.definition->table.value = {1.0, 2.0, 4.0, 3.0};
        expect_reads_what_it_states(catalogue::entry_of(effect), {});
      }
}

TEST(RecordSignals, FormulasReadWhatTheyName) {
  for (const char* formula : {"direction*abs(torsion)", "velocity*output_direction", "torsion_direction + temperature",
                              "sin(motor_angle)*current", "torque_magnitude*speed*sin(output_angle)"}) {
    model::Effect effect{"expression_effect", "formula", {}, model::Definition{}};
    effect.definition->balance = "motor";
    effect.definition->formula = formula;
    expect_reads_what_it_states(catalogue::entry_of(effect), {});
  }
}

}  // namespace
}  // namespace flexspline::estimation::estimation_record_signals_test
