#include "host/app/closed_loop/plant_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <string_view>

namespace flexspline::closed_loop {
namespace {

double quantity(const deployment::Unpacked& block, std::string_view name) {
  for (const deployment::NamedQuantity& q : block.settings)
    if (q.name == name) return q.value;
  throw deployment::PackError(fmt::format("the block does not state {}; pack it with --drive", name));
}

double known(const model::Quantity& q, const char* name) {
  if (!q.value) throw std::runtime_error(fmt::format("the model has no {} in [drive]; state it", name));
  return *q.value;
}

}  // namespace

TwinHardware twin_hardware_of(const deployment::Unpacked& block) {
  TwinHardware hardware;
  hardware.motor_counts = static_cast<int>(quantity(block, "motor_encoder_counts"));
  if (const double counts = quantity(block, "output_encoder_counts"); counts > 0.0)
    hardware.output_counts = static_cast<int>(counts);
  hardware.current_limit_a = quantity(block, "current_limit");
  return hardware;
}

std::string plant_text(const model::Model& model, const TwinHardware& hardware) {
  if (model.drive.axis != data::Axis::rotary) throw std::runtime_error("the twin has no linear axis");
  const double reference_c = model.drive.temperature_reference_c.value.value_or(30.0);
  std::string text = fmt::format(
      "format = \"flexspline-plant/1\"\nname = \"model\"\n[drive]\ngear_ratio = {:.17g}\ntorque_constant_nm_a = "
      "{:.17g}\n"
      "rated_current_a = {:.17g}\nrated_velocity_rad_s = {:.17g}\nrated_torque_nm = {:.17g}\n"
      "temperature_reference_c = {:.17g}\ncurrent_limit_a = {:.17g}\n",
      known(model.drive.gear_ratio, "gear_ratio"), known(model.drive.torque_constant_nm_a, "torque_constant_nm_a"),
      known(model.drive.rated_current_a, "rated_current_a"),
      known(model.drive.rated_velocity_rad_s, "rated_velocity_rad_s"),
      known(model.drive.rated_torque_nm, "rated_torque_nm"), reference_c, hardware.current_limit_a);
  // Usual sensors: a model does not say how noisy a drive's are.
  text +=
      "[sensors.current]\nnoise_share = 0.005\nnoise_floor = 1e-3\n[sensors.torque]\nnoise_share = 0.01\n"
      "noise_floor = 5e-3\n[sensors.temperature]\nnoise_floor = 0.05\n";
  text += fmt::format("[sensors.motor_encoder]\ncounts = {}\n[sensors.output_encoder]\ncounts = {}\n",
                      hardware.motor_counts, hardware.output_counts);
  for (const model::Effect& effect : model.effects) {
    if (effect.definition) throw std::runtime_error(fmt::format("the twin cannot simulate {}", effect.id));
    text += fmt::format("[[effect]]\ntype = \"{}\"\npresent = true\n[effect.parameters]\n", effect.type);
    for (const model::Parameter& p : effect.parameters) {
      if (!p.value) throw std::runtime_error(fmt::format("{}.{} has no value; identify it first", effect.id, p.name));
      text += fmt::format("{} = {{ value = {:.17g}, unit = \"{}\" }}\n", p.name, *p.value, p.unit);
    }
  }
  return text;
}

std::string settings_like(const deployment::Unpacked& block, const TwinHardware& hardware) {
  return fmt::format(
      "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = {}\n[output_encoder]\ncounts = {}\n[torque_sensor]\n"
      "[limits]\ncurrent_a = {:.9e}\n[velocity_loop]\ngain_nm_s_rad = {:.9e}\nintegral_nm_rad = {:.9e}\n"
      "[position_loop]\nbandwidth_hz = {:.9e}\n[feedforward]\ndirection_band_rad_s = {:.9e}\n",
      hardware.motor_counts, hardware.output_counts, hardware.current_limit_a, quantity(block, "velocity_gain"),
      quantity(block, "integral_gain"), quantity(block, "position_gain") * 0.5 / std::numbers::pi,
      quantity(block, "direction_band"));
}

}  // namespace flexspline::closed_loop
