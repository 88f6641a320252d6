#include "tests/worlds/write.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace flexspline::worlds {
namespace {

constexpr double kFine_s = 1.0 / 8000.0;
constexpr double kNoiseMemory_s = 0.02;
constexpr double kReference_c = 30.0;

void save(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("could not write " + file.string());
}

double interpolated(const Motion& m, const std::vector<double>& column, double time_s) {
  const double at = std::clamp((time_s - m.start_s) / m.step_s, 0.0, static_cast<double>(m.size() - 2));
  const auto k = static_cast<std::size_t>(at);
  const double part = at - static_cast<double>(k);
  return (1.0 - part) * column[k] + part * column[k + 1];
}

double held(const Motion& m, const std::vector<double>& column, double time_s) {
  const double at = std::clamp((time_s - m.start_s) / m.step_s, 0.0, static_cast<double>(m.size() - 1));
  return column[static_cast<std::size_t>(at)];
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double rounded(double value, double step) {
  return step > 0.0 ? step * std::round(value / step) : value;
}

std::vector<double> lagged(const Motion& m, double lag_s) {
  std::vector<double> out = m.velocity;
  if (lag_s <= m.step_s) return out;
  for (std::size_t k = 1; k < out.size(); ++k) out[k] = out[k - 1] + m.step_s / lag_s * (m.velocity[k] - out[k - 1]);
  return out;
}

// A user does not map a velocity column that is not the derivative of the position, be it in one record only.
bool usable(const Motion& m, const std::vector<double>& column) {
  double product = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < m.size(); ++k) {
    product += column[k] * m.velocity[k];
    squares += m.velocity[k] * m.velocity[k];
  }
  return squares > 0.0 && std::abs(product / squares - 1.0) < 0.03;
}

struct Scales {
  double angle = 1.0, effort = 1.0;  // of the file's columns against the motor's angle and current
  const char *position, *velocity, *effort_name;
};

Scales scales_of(const Twin& twin) {
  const double n = twin.joint.gear_ratio;
  if (twin.units == Units::motor) return {1.0, 1.0, "motor_position_rad", "motor_velocity_rad_s", "current_a"};
  if (twin.units == Units::scaled_joint)
    return {1.0 / n, 1.0, "joint_position_rad", "joint_velocity_rad_s", "current_a"};
  return {1.0 / n, n * twin.joint.torque_constant, "joint_position_rad", "joint_velocity_rad_s", "joint_effort_nm"};
}

// Scales of the effort's and the torque's ranges, the same for all records of a joint.
struct Ranges {
  double effort_rms = 0.0, effort_peak = 0.0, torque_rms = 0.0;
};

Ranges ranges_of(const Motion& m) {
  Ranges r{rms(m.current), 0.0, rms(m.load_torque)};
  for (const double i : m.current) r.effort_peak = std::max(r.effort_peak, std::abs(i));
  return r;
}

std::string csv_of(const Twin& twin, const Record& record, const Motion& m, const Ranges& ranges, bool with_velocity) {
  const Sensors& s = twin.sensors;
  const Scales scale = scales_of(twin);
  Random random(record.conditions.seed ^ 0xABCDEF1234567ull);
  const double sample = 1.0 / s.sample_hz;
  ColouredNoise coloured(std::exp(-sample / kNoiseMemory_s)), torque_coloured(std::exp(-sample / kNoiseMemory_s));
  const bool joint_side = twin.units != Units::motor;
  const double angle_step = kTurn / std::exp2(s.encoder_bits) * (joint_side ? twin.joint.gear_ratio : 1.0);
  const double effort_step = 2.0 * ranges.effort_peak / std::exp2(s.effort_bits);
  const double torque_step = 2.0 * twin.joint.rated_torque / std::exp2(s.effort_bits + 2.0);
  const double torque_zero = 0.3 * s.torque_noise * ranges.torque_rms * random.normal();
  const std::vector<double> velocity = lagged(m, s.velocity_lag_s);
  const std::vector<double> angle = joint_side ? m.output_angle : m.angle;
  const double to_motor = joint_side ? twin.joint.gear_ratio : 1.0;

  std::string text = fmt::format("time_s,{}", scale.position);
  if (with_velocity) text += fmt::format(",{}", scale.velocity);
  text += fmt::format(",{}", scale.effort_name);
  if (s.torque_column) text += ",torque_nm";
  if (s.temperature_column) text += ",temperature_c";
  text += '\n';
  const auto samples = static_cast<std::size_t>(record.trajectory.duration_s() * s.sample_hz);
  for (std::size_t k = 0; k < samples; ++k) {
    const double even = static_cast<double>(k) * sample, uneven = even + s.jitter * sample * random.uniform(-1.0, 1.0);
    const double stamp = k == 0 ? 0.0 : uneven, at = s.stamps_are_true ? stamp : even;
    const double noise = s.effort_noise * ranges.effort_rms * (s.coloured ? coloured.next(random) : random.normal());
    const double current = held(m, m.current, at + s.effort_lag_samples * sample) + s.current_offset + noise;
    const double position = rounded(to_motor * interpolated(m, angle, at), angle_step);
    text += fmt::format("{:.6f},{:.9g}", stamp, scale.angle * position);
    if (with_velocity) text += fmt::format(",{:.6g}", scale.angle * interpolated(m, velocity, at));
    text += fmt::format(",{:.6g}", scale.effort * rounded(current, effort_step));
    if (s.torque_column) {
      const double more =
          s.torque_noise * ranges.torque_rms * (s.coloured ? torque_coloured.next(random) : random.normal());
      const double torque = s.torque_gain * interpolated(m, m.load_torque, at) + torque_zero + more;
      text += fmt::format(",{:.6g}", rounded(torque, torque_step));
    }
    if (s.temperature_column)
      text += fmt::format(",{:.2f}", kReference_c + held(m, m.temperature, at) + 0.05 * random.normal());
    text += '\n';
  }
  return text;
}

std::string dataset_toml(const Twin& twin, const std::vector<const Record*>& records, const char* role,
                         bool with_velocity) {
  const Scales scale = scales_of(twin);
  const double n = twin.joint.gear_ratio;
  std::string text = "format = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"rotary\"\n";
  text += fmt::format("gear_ratio = {:g}\n", twin.units == Units::joint ? 1.0 : n);
  if (twin.units != Units::joint) text += fmt::format("torque_constant_nm_a = {:.6g}\n", twin.joint.torque_constant);
  text += "current_hold = \"none\"\nmotor_position_zero = \"absolute\"\n";
  if (twin.units != Units::motor) {
    const double turns = twin.units == Units::joint ? 1.0 : n;
    text += fmt::format("\n[columns.motor_position_rad]\nsource = \"{}\"\nscale = {:g}\n", scale.position, turns);
    if (with_velocity)
      text += fmt::format("\n[columns.motor_velocity_rad_s]\nsource = \"{}\"\nscale = {:g}\n", scale.velocity, turns);
  }
  if (twin.units == Units::joint)
    text += fmt::format("\n[columns.motor_torque_nm]\nsource = \"{}\"\nscale = 1\n", scale.effort_name);
  for (const Record* r : records)
    text += fmt::format("\n[[experiment]]\nfile = \"{0}.csv\"\nname = \"{0}\"\nrole = \"{1}\"\n", r->name, role);
  return text;
}

std::string model_toml(const Twin& twin) {
  const Joint& j = twin.joint;
  const bool at_joint = twin.units == Units::joint;
  std::string text =
      fmt::format("format = \"flexspline-model/1\"\nname = \"twin-{}\"\n\n[drive]\naxis = \"rotary\"\n", twin.seed);
  text += fmt::format("gear_ratio = {:g}\n", at_joint ? 1.0 : j.gear_ratio);
  if (!at_joint) text += fmt::format("torque_constant_nm_a = {:.6g}\n", j.torque_constant);
  text += fmt::format("rated_velocity_rad_s = {:.4g}\n", 1.8 * (at_joint ? 1.0 : j.gear_ratio));
  text += fmt::format("rated_torque_nm = {:.4g}\n", j.rated_torque);
  if (twin.sensors.temperature_column) text += fmt::format("temperature_reference_c = {:g}\n", kReference_c);
  std::vector<std::string> effects = {"inertia", "viscous_friction", "coulomb_friction"};
  if (twin.offset_in_base) effects.push_back(at_joint ? "torque_bias" : "current_offset");
  if (twin.gravity_in_base) effects.push_back("gravity");
  for (const std::string& e : effects) text += fmt::format("\n[[effect]]\ntype = \"{}\"\n", e);
  return text;
}

const char* name_of(SecondStructure second) {
  switch (second) {
    case SecondStructure::bump_over_angle:
      return "bump_over_angle";
    case SecondStructure::creep:
      return "creep";
    case SecondStructure::neighbour_vibration:
      return "neighbour_vibration";
    case SecondStructure::friction_that_lags:
      return "friction_that_lags";
    case SecondStructure::wave_over_travel:
      return "wave_over_travel";
    case SecondStructure::none:
      break;
  }
  return "none";
}

// A difference of the directions that the draw happens to hold in these records: an asymmetry that data do show.
bool directions_differ(const Twin& twin) {
  double sum = 0.0, squares = 0.0;
  const auto n = static_cast<double>(twin.fit.size());
  for (const Record& r : twin.fit) {
    const double d = r.conditions.friction_forward - r.conditions.friction_backward;
    sum += d / n;
    squares += d * d / n;
  }
  const double spread = n > 1.0 ? std::sqrt(std::max(0.0, squares - sum * sum) / (n - 1.0)) : 0.0;
  return std::abs(sum) > std::max(0.01, 2.0 * spread);
}

nlohmann::ordered_json also_true(const Twin& twin, const Shares& shares) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto add = [&](std::vector<const char*> effects, double share, const char* why) {
    for (const char* e : effects) list.push_back({{"effect", e}, {"share", share}, {"why", why}});
  };
  add({"dahl_friction", "lugre_friction"}, shares.presliding, "presliding is in every twin and not in the base model");
  if (directions_differ(twin))
    add({"coulomb_asymmetry", "current_offset", "torque_bias", "viscous_asymmetry"}, shares.directions,
        "friction of the two directions differs in these records as drawn");
  if (twin.joint.elastic)
    add({"elastic_load", "linear_stiffness", "output_inertia"}, shares.elastic, "the load is elastic");
  if (std::abs(twin.sensors.effort_lag_samples) > 0.3)
    add({"current_delay"}, 0.0, "the effort's time base is off by some samples");
  // A model in joint units has the joint's turns for the motor's: a wave over the joint's travel is a ripple there.
  if (twin.joint.second == SecondStructure::wave_over_travel && twin.units == Units::joint) {
    add({"torque_ripple"}, shares.second, "a wave over the joint's travel repeats with its turns");
    list.back()["order"] = twin.joint.second_width;
  }
  return list;
}

nlohmann::ordered_json truth_of(const Twin& twin, const Shares& shares, const Ranges& ranges) {
  using Json = nlohmann::ordered_json;
  const Joint& j = twin.joint;
  const Sensors& s = twin.sensors;
  Json hidden = Json::array();
  for (const HiddenEffect& h : twin.hidden) {
    Json one = {{"effect", h.effect}};
    one["order"] = h.order ? Json(h.order) : Json(nullptr);
    one["accepted"] = h.accepted;
    one["share"] = h.share;
    one["share_behind_presliding"] = h.share_behind_presliding;
    one["share_wanted"] = h.wanted_share;
    one["size"] = h.size;
    hidden.push_back(one);
  }
  Json second = nullptr;
  if (j.second != SecondStructure::none)
    second = {{"kind", name_of(j.second)}, {"share", shares.second}, {"size", j.second_size}};
  const double effort_to_torque = j.torque_constant;
  Json presliding = {{"law", name_of(j.law)},
                     {"length_rad", j.presliding_length},
                     {"grows_with_load", j.presliding_growth},
                     {"share", shares.presliding}};
  Json dirt = {{"units", twin.units == Units::motor   ? "motor"
                         : twin.units == Units::joint ? "joint"
                                                      : "scaled_joint"},
               {"motion", name_of(twin.motion)},
               {"records", twin.fit.size()},
               {"duration_s", twin.fit.front().trajectory.duration_s()},
               {"same_trajectory", twin.same_trajectory},
               {"sample_hz", s.sample_hz},
               {"jitter", s.jitter},
               {"stamps_are_true", s.stamps_are_true},
               {"effort_noise", s.effort_noise},
               {"effort_noise_is_coloured", s.coloured},
               {"effort_bits", s.effort_bits},
               {"encoder_bits", s.encoder_bits},
               {"velocity_column", s.velocity_column},
               {"velocity_lag_s", s.velocity_lag_s},
               {"torque_column", s.torque_column},
               {"torque_noise", s.torque_noise},
               {"temperature_column", s.temperature_column},
               {"effort_lag_samples", s.effort_lag_samples},
               {"friction_difference", twin.friction_difference},
               {"friction_difference_share", shares.directions},
               {"coloured_friction_nm", twin.fit.front().conditions.coloured_friction},
               {"viscous_drift", twin.fit.front().conditions.viscous_drift},
               {"pulses", twin.fit.front().conditions.pulses_s.size()},
               {"external_torque_nm", twin.fit.front().conditions.external_torque},
               {"gravity_in_base", twin.gravity_in_base},
               {"offset_in_base", twin.offset_in_base},
               {"elastic", j.elastic.has_value()},
               {"elastic_share", shares.elastic}};
  Json truth = {{"format", "flexspline-robot-twin/1"}, {"seed", twin.seed}, {"family", twin.family}};
  truth["hidden"] = hidden;
  truth["also_true"] = also_true(twin, shares);
  truth["second_structure"] = second;
  truth["presliding"] = presliding;
  truth["base_error_rms_nm"] = shares.error;
  truth["effort_noise_rms_nm"] = s.effort_noise * ranges.effort_rms * effort_to_torque;
  truth["plant"] = {{"gear_ratio", j.gear_ratio},
                    {"rated_torque_nm", j.rated_torque},
                    {"torque_constant_nm_a", j.torque_constant},
                    {"motor_inertia", j.motor_inertia},
                    {"load_inertia", j.load_inertia},
                    {"coulomb", j.coulomb},
                    {"viscous", j.viscous}};
  truth["dirt"] = dirt;
  return truth;
}

}  // namespace

void write_case(const Twin& twin, const Shares& shares, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "fit");
  std::filesystem::create_directories(folder / "holdout");
  std::vector<const Record*> records;
  for (const Record& r : twin.fit) records.push_back(&r);
  records.push_back(&twin.holdout);
  std::vector<Motion> motions;
  bool with_velocity = twin.sensors.velocity_column;
  for (const Record* r : records) {
    motions.push_back(simulate(twin.joint, r->conditions, twin.controller, r->trajectory, kFine_s));
    with_velocity = with_velocity && usable(motions.back(), lagged(motions.back(), twin.sensors.velocity_lag_s));
  }
  const Ranges ranges = ranges_of(motions.front());
  for (std::size_t i = 0; i < records.size(); ++i)
    save(folder / (records[i] == &twin.holdout ? "holdout" : "fit") / (records[i]->name + ".csv"),
         csv_of(twin, *records[i], motions[i], ranges, with_velocity));
  records.pop_back();
  save(folder / "fit" / "dataset.toml", dataset_toml(twin, records, "fit", with_velocity));
  save(folder / "holdout" / "dataset.toml", dataset_toml(twin, {&twin.holdout}, "holdout", with_velocity));
  save(folder / "model.toml", model_toml(twin));
  save(folder / "truth.json", truth_of(twin, shares, ranges).dump(2) + "\n");
}

}  // namespace flexspline::worlds
