#include "host/drive_link/drive/scales.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/drive_link/deployment/bases.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::drive {

double Scales::value(protocol::Channel channel, std::uint32_t word) const {
  using protocol::Base;
  const double number = static_cast<std::int32_t>(word);
  const double part = std::ldexp(number, -fixed::kValueBits);
  switch (protocol::text_of(channel).base) {
    case Base::word:
      return word;
    case Base::turns:
      return number;
    case Base::fraction:
      return std::ldexp(static_cast<double>(word), -fixed::kAngleBits);
    case Base::velocity:
      return part * constants.velocity_base;
    case Base::acceleration:
      return part * constants.acceleration_base;
    case Base::output_velocity:
      return part * constants.output_velocity_base;
    case Base::torque:
      return part * constants.torque_base;
    case Base::output_torque:
      return part * constants.output_torque_base;
    case Base::current:
      return part * constants.current_base;
    case Base::temperature:
      return part * constants.temperature_base;
    case Base::torsion:
      return part * constants.torsion_base;
  }
  return 0.0;
}

std::string_view Scales::unit(protocol::Channel channel) const {
  constexpr std::pair<std::string_view, std::string_view> kLinear[] = {
      {"rad", "m"}, {"rad/s", "m/s"}, {"rad/s^2", "m/s^2"}, {"N*m", "N"}};
  const std::string_view rotary = protocol::text_of(channel).unit;
  for (const auto& [unit, linear] : kLinear)
    if (is_linear() && rotary == unit) return linear;
  return rotary;
}

std::int32_t Scales::per_unit(double value, double base) const {
  return static_cast<std::int32_t>(std::lround(std::ldexp(std::clamp(value / base, -1.99, 1.99), fixed::kValueBits)));
}

double Scales::turn() const {
  return kTurn / constants.turn_angle_scale;
}

std::optional<Scales> scales_of(const Bytes& block) {
  Scales scales;
  if (!model::check_start(block).good()) return {};
  scales.header = model::header_of(block);
  scales.constants = deployment::from_block(scales.header.bases);
  return scales;
}

Scales scales_of(Session& session) {
  const Bytes block = session.read_block(protocol::Which::active);
  if (block.empty()) session.fail("it has no parameters; flash a block first: flexspline flash --model MODEL");
  const auto scales = scales_of(block);
  if (!scales) session.fail("its active block is not one that this tool can read; bring the tool up to date");
  return *scales;
}

std::string text_of(const model::Name& name) {
  return {name.begin(), std::find(name.begin(), name.end(), '\0')};
}

}  // namespace flexspline::drive
