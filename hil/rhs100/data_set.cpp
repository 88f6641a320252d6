#include "hil/rhs100/data_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "hil/plant/text_lines.hpp"
#include "hil/plant/whole_file.hpp"
#include "hil/rhs100/models.hpp"
#include "hil/rhs100/readme.hpp"
#include "hil/thesis_models/published.hpp"

namespace flexspline::rhs100 {
namespace {

using plant::line;
using plant::real;
using plant::Text;

const char* load_of(const plant::ExperimentPlan& plan, const Set& set) {
  return set.sensors == Sensors::drive && plan.locked ? "locked" : "free";
}

Text csv(const Set& set, const Experiment& experiment, const plant::Record& record) {
  Text text;
  const plant::Drive& drive = experiment.drive;
  const bool gear = set.sensors == Sensors::drive;
  line(text, "# experiment: {}", record.name);
  line(text, "# load: {}", load_of(experiment.plan, set));
  line(text, "# role: {}", record.holdout ? "holdout" : "fit");
  line(text, "# gear_ratio: {}", set.gear_ratio);
  if (gear) {
    line(text, "# torque_constant_nm_a: {}", drive.torque_constant_nm_a);
    line(text, "# encoder_counts: {}", drive.sensors.motor_counts);
    line(text, "# output_encoder_counts: {}", drive.sensors.output_counts);
    line(text, "# motor_position_zero: absolute");
    line(text, "# output_position_zero: absolute");
    line(text, "# noise_std_motor_position_rad: {}", record.motor_position_noise_std);
    line(text, "# noise_std_output_position_rad: {}", record.output_position_noise_std);
    line(text, "# noise_std_torque_nm: {}", record.torque_noise_std);
  }
  line(text, "# current_hold: zoh");
  line(text, "# noise_std_current_a: {}", record.current_noise_std);
  line(text, "# noise_std_motor_velocity_rad_s: {}", record.tachometer_noise_std);
  line(text, "time_s,current_a,motor_velocity_rad_s{}{},{}",
       gear ? ",motor_position_rad,output_position_rad,torque_nm" : "", set.load_torque_nm ? ",load_torque_nm" : "",
       record.velocity_mode ? "velocity_command_rad_s" : "current_command_a");
  const auto out = std::back_inserter(text);
  for (std::size_t k = 0; k < record.time_s.size(); ++k) {
    fmt::format_to(out, "{:.9g},{:.7g},{:.7g}", record.time_s[k], record.current_a[k], record.motor_velocity_rad_s[k]);
    if (gear)
      fmt::format_to(out, ",{:.10g},{:.10g},{:.7g}", record.motor_position_rad[k], record.output_position_rad[k],
                     record.torque_nm[k]);
    if (set.load_torque_nm) fmt::format_to(out, ",{:.7g}", *set.load_torque_nm);
    fmt::format_to(out, ",{:.7g}\n", record.command[k]);
  }
  return text;
}

void list_experiments(Text& text, const Set& set, const std::string& folder) {
  for (const Experiment& e : set.experiments) {
    line(text, "\n[[experiment]]\nfile = \"{}{}.csv\"\nname = \"{}\"", folder, e.plan.name, e.plan.name);
    line(text, "load = \"{}\"\nrole = \"{}\"", load_of(e.plan, set), e.plan.holdout ? "holdout" : "fit");
  }
}

Text dataset_head(double gear_ratio) {
  Text text;
  line(text, "format = \"flexspline-dataset/1\"\n");
  line(text, "[drive]\naxis = \"rotary\"\ngear_ratio = {}", real(gear_ratio));
  return text;
}

Text truth(const Set& set, std::uint64_t seed) {
  Text text;
  line(text, "# The true parameters of each experiment, SI units. Not for use in an identification.");
  line(text, "seed = {}", seed);
  for (const Experiment& e : set.experiments) {
    line(text, "\n[[experiment]]\nname = \"{}\"", e.plan.name);
    line(text, "torque_constant_nm_a = {}", real(e.drive.torque_constant_nm_a));
    for (const plant::Effect& effect : e.drive.effects) {
      if (!effect.present || (set.sensors == Sensors::motor && effect.type == "linear_stiffness")) continue;
      for (const plant::Parameter& p : effect.parameters) line(text, "{}.{} = {}", effect.type, p.key, real(p.value));
    }
  }
  return text;
}

std::string_view view(const Text& text) {
  return {text.data(), text.size()};
}

void write_set(const Set& set, const std::filesystem::path& folder, std::uint64_t seed) {
  plant::make_folder(folder);
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t k = next++; k < set.experiments.size(); k = next++) {
      const Text text = csv(set, set.experiments[k], record(set, k, seed));
      plant::write_whole(folder / (set.experiments[k].plan.name + ".csv"), view(text));
    }
  };
  std::vector<std::future<void>> workers;
  for (unsigned i = 0; i < std::max(1U, std::thread::hardware_concurrency()); ++i)
    workers.push_back(std::async(std::launch::async, work));
  for (std::future<void>& worker : workers) worker.get();
  Text dataset = dataset_head(set.gear_ratio);
  list_experiments(dataset, set, "");
  plant::write_whole(folder / "base-model.toml", set.base_model);
  plant::write_whole(folder / "truth.toml", view(truth(set, seed)));
  plant::write_whole(folder / "dataset.toml", view(dataset));
}

bool asked_for(const Set& set, const std::vector<std::string>& parts) {
  return parts.empty() ||
         std::any_of(parts.begin(), parts.end(), [&](const std::string& part) { return set.name.starts_with(part); });
}

}  // namespace

std::size_t write_data_set(const std::filesystem::path& folder, const std::vector<std::string>& parts,
                           std::uint64_t seed) {
  const std::vector<Set> sets = all_sets();
  for (const std::string& part : parts) {
    if (std::any_of(sets.begin(), sets.end(), [&](const Set& set) { return set.name.starts_with(part); })) continue;
    std::string names;
    for (const Set& set : sets) names += (names.empty() ? "" : ", ") + set.name;
    throw std::invalid_argument(fmt::format("rhs-100 has no part \"{}\"; it has {}", part, names));
  }
  plant::make_folder(folder);
  std::size_t written = 0;
  Text all = dataset_head(report::published::kGearRatio);
  for (const Set& set : sets) {
    if (!asked_for(set, parts)) continue;
    write_set(set, folder / set.name, seed);
    written += set.experiments.size();
    // Table 6 has the experiments of table 4 again, with another spring.
    if (set.sensors == Sensors::drive && set.name != "table-6") list_experiments(all, set, set.name + "/");
  }
  plant::write_whole(folder / "README.md", readme(sets, seed));
  if (parts.empty()) {
    plant::write_whole(folder / "base-model.toml", drive_model());
    plant::write_whole(folder / "dataset.toml", view(all));
  }
  return written;
}

}  // namespace flexspline::rhs100
