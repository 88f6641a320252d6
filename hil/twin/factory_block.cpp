#include "hil/twin/factory_block.hpp"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "hil/board/drive_setup.hpp"
#include "shared/fixed/coefficients.hpp"
#include "shared/model/block.hpp"

namespace flexspline::twin {
namespace {

model::Number number_of(double value) {
  if (value == 0.0) return {};
  int exponent = 0;
  const double mantissa = std::frexp(value, &exponent);
  return {static_cast<std::int32_t>(std::lround(std::ldexp(mantissa, fixed::kMantissaBits))), exponent};
}
model::Name name_of(const std::string& text) {
  model::Name name{};
  std::strncpy(name.data(), text.c_str(), name.size() - 1);
  return name;
}

}  // namespace

std::vector<std::uint8_t> factory_block(const plant::Drive& drive) {
  const effects::DriveConstants<double> d = board::constants_of(drive);
  const control::DriveSetup<double> setup = board::setup_of(drive, d);
  model::BlockHeader header;
  header.drive = name_of(drive.name);
  header.model = name_of("as made");
  header.encoder_counts = static_cast<std::uint32_t>(drive.sensors.motor_counts);
  model::Bases& b = header.bases;
  b = {number_of(d.gear_ratio),
       number_of(d.torque_constant),
       number_of(d.rated_velocity),
       number_of(d.reference_temperature),
       number_of(d.turn_angle_scale),
       number_of(d.torque_base),
       number_of(d.output_torque_base),
       number_of(d.velocity_base),
       number_of(d.output_velocity_base),
       number_of(d.acceleration_base),
       number_of(d.output_acceleration_base),
       number_of(d.angle_base),
       number_of(d.torsion_base),
       number_of(d.torsion_rate_base),
       {number_of(d.temperature_base), number_of(d.current_base), number_of(d.time_base)}};
  const auto limit = [](double per_unit) { return fixed::make_value(per_unit); };
  header.limits = {
      limit(setup.loops.torque_limit / d.torque_base),          limit(1.0),
      limit(setup.loops.velocity_limit / d.velocity_base),      limit(setup.loops.overspeed / d.velocity_base),
      limit(setup.loops.current_limit / d.current_base),        limit(1.0),
      limit(setup.feedforward.direction_band / d.velocity_base)};
  const firmware::Parameters parameters = board::parameters_of(drive, setup);
  std::vector<std::uint8_t> bytes(model::kLargestBlock);
  model::BlockWriter writer(bytes);
  writer.begin(header);
  parameters.model.for_each([&]<class Effect>(const auto& places) {
    using Model = decltype(firmware::Parameters::model);
    for (std::size_t i = 0; i < places.count; ++i)
      writer.add(static_cast<std::uint16_t>(Model::template number_of<Effect>()), places.coefficients[i]);
  });
  const std::size_t size = writer.end();
  if (size == 0) throw std::runtime_error("the drive's model is longer than any parameter block may be");
  bytes.resize(size);
  return bytes;
}

}  // namespace flexspline::twin
