#include "hil/board/controller.hpp"

#include <cmath>
#include <cstring>
#include <stdexcept>

namespace flexspline::board {

namespace {

model::Number number_of(double x) {
  model::Number n;
  n.mantissa = static_cast<std::int32_t>(std::lround(std::ldexp(std::frexp(x, &n.exponent), fixed::kMantissaBits)));
  return n;
}
model::BlockHeader header_of(const firmware::Parameters& p, const effects::DriveConstants<double>& d) {
  model::BlockHeader h;
  h.encoder_counts = p.motor_encoder.counts;
  h.bases = {.gear_ratio = number_of(d.gear_ratio),
             .torque_constant = number_of(d.torque_constant),
             .rated_velocity = number_of(d.rated_velocity),
             .reference_temperature = number_of(d.reference_temperature),
             .turn_angle_scale = number_of(d.turn_angle_scale),
             .torque = number_of(d.torque_base),
             .output_torque = number_of(d.output_torque_base),
             .velocity = number_of(d.velocity_base),
             .output_velocity = number_of(d.output_velocity_base),
             .acceleration = number_of(d.acceleration_base),
             .output_acceleration = number_of(d.output_acceleration_base),
             .angle = number_of(d.angle_base),
             .torsion = number_of(d.torsion_base),
             .torsion_rate = number_of(d.torsion_rate_base),
             .others = {number_of(d.temperature_base), number_of(d.current_base), number_of(d.time_base)}};
  const fixed::Value one{std::int32_t{1} << fixed::kValueBits}, more{one.raw + one.raw / 4};
  h.limits = {one, one, one, more, one, one, one};
  return h;
}

// Flattened into one function, so that values between the parts of a tick stay in registers.
[[gnu::flatten]] firmware::CoSimulationOutput control_tick(firmware::Application<SoftwareBoard>& application,
                                                           const firmware::CoSimulationInput& input) {
  return firmware::co_simulate(application, input, [] { return std::uint32_t{0}; });
}

}  // namespace

Block::Block(std::span<const std::uint8_t> packed) : words_((packed.size() + 7) / 8), size_(packed.size()) {
  if (size_ > 0) std::memcpy(words_.data(), packed.data(), size_);
}

Block::Block(const firmware::Parameters& parameters, const effects::DriveConstants<double>& d)
    : words_(model::kLargestBlock / 8) {
  model::BlockWriter writer({reinterpret_cast<std::uint8_t*>(words_.data()), model::kLargestBlock});
  writer.begin(header_of(parameters, d));
  parameters.model.for_each([&]<class Effect>(const auto& places) {
    for (std::size_t i = 0; i < places.count; ++i)
      writer.add(static_cast<std::uint16_t>(decltype(firmware::Parameters::model)::number_of<Effect>()),
                 places.coefficients[i]);
  });
  control::add_settings(writer, parameters);
  size_ = writer.end();
  if (size_ == 0) throw std::runtime_error("the parameters do not fit into a block");
  words_.resize((size_ + 7) / 8);
}

void SoftwareController::start(const Block& block, const firmware::TelemetrySetup& telemetry,
                               firmware::ResetCause cause) {
  flash_ = block;
  telemetry_ = telemetry;
  const std::uint32_t tick_hz = board_.tick_hz;
  board_ = {};
  board_.tick_hz = tick_hz;
  board_.cause = cause;
  board_.hardware_stated = hardware_;
  board_.stage = stage_;
  application_ = std::make_unique<firmware::Application<SoftwareBoard>>(board_);
  application_->telemetry().configure(telemetry_);
  if (!flash_.empty()) application_->boot_with(flash_.bytes());
}

firmware::CoSimulationOutput SoftwareController::tick(const firmware::CoSimulationInput& input) {
  board_.readings = &input.readings;
  board_.overrun = input.overrun;
  firmware::CoSimulationOutput output =
      tick_hangs_ ? firmware::CoSimulationOutput{} : control_tick(*application_, input);
  output.actuation = board_.actuation;
  if (!background_hangs_) application_->background();
  if (++board_.ticks_since_fed > firmware::kWatchdogTicks) {
    ++resets_;
    const Block kept = flash_;
    start(kept, telemetry_, firmware::ResetCause::watchdog);
    output = {};
  }
  return output;
}

}  // namespace flexspline::board
