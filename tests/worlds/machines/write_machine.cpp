#include "tests/worlds/machines/write_machine.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/worlds/machines/draw.hpp"
#include "tests/worlds/machines/hidden.hpp"
#include "tests/worlds/machines/imperfections.hpp"

namespace flexspline::worlds::machines {
namespace {

using Json = nlohmann::ordered_json;

void save(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("could not write " + file.string());
}

std::string csv_of(const Machine& m, const Run& run) {
  const Sensors& s = m.sensors;
  const Measured& seen = run.measured;
  const double effort = s.effort_is_torque ? m.plant.electric.torque_constant_nm_a : 1.0;
  std::string text = fmt::format("time_s,{},motor_position_rad", s.effort_is_torque ? "motor_torque_nm" : "current_a");
  if (s.velocity_in_rpm) text += ",motor_speed_rpm";
  if (s.output_encoder) text += ",output_position_rad";
  if (s.torque) text += ",torque_nm";
  if (s.load_torque) text += ",load_torque_nm";
  if (s.temperature) text += ",temperature_c";
  text += '\n';
  const auto out = std::back_inserter(text);
  for (std::size_t k = 0; k < run.log.size(); ++k) {
    fmt::format_to(out, "{:.6f},{:.5g},{:.9f}", run.record->stamp_s[k], effort * seen.current_a[k], seen.angle_rad[k]);
    if (s.velocity_in_rpm) fmt::format_to(out, ",{:.1f}", seen.velocity_rpm[k]);
    if (s.output_encoder) fmt::format_to(out, ",{:.8f}", seen.output_angle_rad[k]);
    if (s.torque) fmt::format_to(out, ",{:.2f}", seen.torque_nm[k]);
    if (s.load_torque) fmt::format_to(out, ",{:.2f}", seen.load_torque_nm[k]);
    if (s.temperature) fmt::format_to(out, ",{:.1f}", seen.temperature_c[k]);
    text += '\n';
  }
  return text;
}

std::string dataset_toml(const Machine& m, const std::vector<Record>& records, const char* role) {
  const Sensors& s = m.sensors;
  std::string text = "format = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"rotary\"\n";
  text += fmt::format("gear_ratio = {:g}\n", m.plant.gear.ratio);
  if (!s.effort_is_torque)
    text += fmt::format("torque_constant_nm_a = {:.6g}\n", m.plant.electric.torque_constant_nm_a);
  text += fmt::format("encoder_counts = {:.0f}\n", s.encoder_counts);
  if (s.output_encoder) text += fmt::format("output_encoder_counts = {:.0f}\n", s.output_encoder_counts);
  if (s.velocity_in_rpm) text += "\n[columns.motor_velocity_rad_s]\nsource = \"motor_speed_rpm\"\nunit = \"rpm\"\n";
  for (const Record& r : records)
    text += fmt::format("\n[[experiment]]\nfile = \"{0}.csv\"\nname = \"{0}\"\nrole = \"{1}\"\n", r.name, role);
  return text;
}

std::string model_toml(const Machine& m) {
  const bool current = !m.sensors.effort_is_torque;
  std::string text = fmt::format("format = \"flexspline-model/1\"\nname = \"{}-{}\"\n\n[drive]\naxis = \"rotary\"\n",
                                 name_of(m.kind), m.seed);
  text += fmt::format("gear_ratio = {:g}\n", m.plant.gear.ratio);
  if (current)
    text += fmt::format("torque_constant_nm_a = {{ value = {:.6g}, source = \"data sheet\" }}\n",
                        m.plant.electric.torque_constant_nm_a);
  text += fmt::format("rated_velocity_rad_s = {:.4g}\n", 1.1 * m.limits.velocity_rad_s);
  if (current) text += fmt::format("rated_current_a = {:.4g}\n", m.rated_current_a);
  if (m.sensors.temperature)
    text += fmt::format("temperature_reference_c = {:.1f}\n", m.plant.friction.reference_temperature_c);
  std::vector<std::string> effects = {"inertia", "viscous_friction"};
  effects.emplace_back(m.presliding == Presliding::known ? "dahl_friction" : "coulomb_friction");
  if (m.base.torque_offset) effects.emplace_back("torque_offset");
  if (m.base.stiffness) effects.emplace_back("linear_stiffness");
  if (m.base.load) effects.insert(effects.end(), {"output_inertia", "output_viscous_friction"});
  if (m.base.gravity) effects.emplace_back("gravity");
  for (const std::string& e : effects) text += fmt::format("\n[[effect]]\ntype = \"{}\"\n", e);
  return text;
}

Json hidden_of(const Machine& m, const Account& account) {
  Json list = Json::array();
  if (!m.hidden) return list;
  const HiddenEffect& h = *m.hidden;
  Json one = {{"effect", h.effect}};
  one["order"] = h.order > 0.0 ? Json(h.order) : Json(nullptr);
  one["accepted"] = h.accepted;
  one["balance"] = name_of(account.balance);
  one["excess"] = account.excess;
  one["excess_wanted"] = h.wanted_excess;
  one["error_with_nm"] = account.error_with_nm;
  one["error_floor_nm"] = account.error_floor_nm;
  one["size"] = h.size;
  list.push_back(one);
  return list;
}

Json also_true(const Account& account) {
  Json list = Json::array();
  for (const Imperfection& i : account.imperfections)
    for (const CatalogueName& name : i.names) {
      if (i.excess < kTrueFrom) continue;
      Json one = {{"effect", name.effect}, {"excess", i.excess}, {"why", i.what}};
      if (name.order > 0.0) one["order"] = name.order;
      list.push_back(one);
    }
  return list;
}

Json records_of(const std::vector<Run>& runs) {
  Json list = Json::array();
  for (const Run& run : runs) {
    const Record& r = *run.record;
    list.push_back({{"name", r.name},
                    {"duration_s", static_cast<double>(r.inputs.angle_rad.size()) / kControlRate_hz},
                    {"start_temperature_c", r.start_temperature_c},
                    {"viscous_factor", r.inputs.viscous_factor},
                    {"coulomb_factor", r.inputs.coulomb_factor},
                    {"tracking_error", tracking_error(r, run.log)}});
  }
  return list;
}

Json plant_of(const Machine& m) {
  const Plant& p = m.plant;
  return {{"gear_ratio", p.gear.ratio},
          {"torque_constant_nm_a", p.electric.torque_constant_nm_a},
          {"rotor_inertia_kgm2", p.rotor_inertia_kgm2},
          {"load_inertia_kgm2", p.load.inertia_kgm2},
          {"stiffness_nm_rad", p.gear.stiffness_nm_rad},
          {"coulomb_nm", p.friction.coulomb_nm},
          {"viscous_nms_rad", p.friction.viscous_nms_rad},
          {"presliding", name_of(m.presliding)},
          {"presliding_rad", p.friction.presliding_rad},
          {"encoder_eccentricity_rad", p.encoder.eccentricity_rad},
          {"output_eccentricity_rad", m.sensors.output_eccentricity_rad},
          {"sample_hz", m.sensors.sample_hz},
          {"jitter", m.sensors.jitter},
          {"stamps_are_true", m.sensors.stamps_are_true},
          {"delay_s", p.electric.delay_s},
          {"bandwidth_hz", p.controller.bandwidth_rad_s / kTurn_rad}};
}

}  // namespace

Machine machine_of(std::uint64_t seed, Kind kind, bool stress) {
  constexpr int kDraws = 20;
  for (int draw = 0; draw < kDraws; ++draw) {
    Machine m = draw_machine(seed, draw, kind, stress);
    if (tune_controller(m) && fit_size(m)) return m;
  }
  throw std::runtime_error(fmt::format("seed {}: no controller holds any of {} machines", seed, kDraws));
}

void write_machine(const Machine& machine, const std::filesystem::path& folder) {
  const std::vector<Run> fit = run_all(machine, machine.fit), holdout = run_all(machine, machine.holdout);
  for (const auto& [runs, records, role] :
       {std::tuple{&fit, &machine.fit, "fit"}, std::tuple{&holdout, &machine.holdout, "holdout"}}) {
    std::filesystem::create_directories(folder / role);
    for (const Run& run : *runs) save(folder / role / (run.record->name + ".csv"), csv_of(machine, run));
    save(folder / role / "dataset.toml", dataset_toml(machine, *records, role));
  }
  save(folder / "model.toml", model_toml(machine));

  const Account account = account_of(machine, fit);
  Json truth = {{"format", "flexspline-machine/1"}, {"seed", machine.seed}, {"kind", name_of(machine.kind)}};
  truth["stress"] = machine.stress;
  truth["drawn_again"] = machine.draw;
  truth["hidden"] = hidden_of(machine, account);
  truth["also_true_from"] = kTrueFrom;
  truth["also_true"] = also_true(account);
  truth["base_error_rms_nm"] = account.base_error_nm;
  for (const Imperfection& i : account.imperfections) truth["imperfections"][i.what] = i.excess;
  truth["plant"] = plant_of(machine);
  truth["records"] = records_of(fit);
  for (const Json& held_out : records_of(holdout)) truth["records"].push_back(held_out);
  save(folder / "truth.json", truth.dump(2) + "\n");
}

}  // namespace flexspline::worlds::machines
