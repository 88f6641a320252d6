#include "host/app/project/base_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "host/common/signals/differentiate.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::project {
namespace {

using data::Column;
using data::Dataset;
using data::Experiment;

// Two digits: a guess does not pretend to be more.
double rounded(double value) {
  if (!(std::abs(value) > 0.0) || !std::isfinite(value)) return value;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - 1.0);
  return std::strtod(fmt::format("{:.6g}", std::round(value / unit) * unit).c_str(), nullptr);
}

// Nearly the largest magnitude: one wild sample in a thousand is left out.
double largest(std::vector<double> magnitudes) {
  if (magnitudes.empty()) return 0.0;
  const auto at = magnitudes.begin() + static_cast<std::ptrdiff_t>((magnitudes.size() - 1) * 999 / 1000);
  std::nth_element(magnitudes.begin(), at, magnitudes.end());
  return *at;
}

double largest_of(const Dataset& dataset, Column column) {
  double result = 0.0;
  for (const Experiment& e : dataset.experiments) {
    std::vector<double> magnitudes = e[column];
    for (double& x : magnitudes) x = std::abs(x);
    result = std::max(result, largest(std::move(magnitudes)));
  }
  return result;
}

double largest_speed(const Dataset& dataset) {
  double result = largest_of(dataset, Column::motor_velocity);
  if (result > 0.0) return result;
  for (const Experiment& e : dataset.experiments) {
    if (!e.has(Column::motor_position)) continue;
    // Over ten samples, so that the encoder's resolution does not count as speed.
    const std::vector<double>& p = e[Column::motor_position];
    const std::size_t span = std::min<std::size_t>(10, p.size() - 1);
    std::vector<double> speeds;
    for (const data::Segment& s : e.segments)
      for (std::size_t k = s.first + span; k < s.last && span > 0; ++k)
        speeds.push_back(std::abs(p[k] - p[k - span]) / (static_cast<double>(span) * e.sample_s));
    result = std::max(result, largest(std::move(speeds)));
  }
  return result;
}

bool has_together(const Dataset& dataset, std::initializer_list<std::initializer_list<Column>> any_of_each,
                  bool locked_stands_for_output = false) {
  return std::any_of(dataset.experiments.begin(), dataset.experiments.end(), [&](const Experiment& e) {
    return std::all_of(any_of_each.begin(), any_of_each.end(), [&](const auto& group) {
      return std::any_of(group.begin(), group.end(), [&](Column c) {
        return e.has(c) || (locked_stands_for_output && c == Column::output_position && e.load == data::Load::locked);
      });
    });
  });
}

bool output_moves(const Dataset& dataset) {
  return std::any_of(dataset.experiments.begin(), dataset.experiments.end(), [](const Experiment& e) {
    return e.load == data::Load::free && e.has(Column::torque) &&
           (e.has(Column::output_position) || e.has(Column::output_velocity));
  });
}

class Builder {
 public:
  Builder(const Dataset& dataset, const std::string& name) : dataset_(dataset) {
    result_.model.name = name;
    result_.model.drive.axis = dataset.drive.axis.value_or(data::Axis::rotary);
  }

  BaseModel build() {
    drive();
    motor();
    transmission();
    load();
    return std::move(result_);
  }

 private:
  void add(std::initializer_list<const char*> effects) {
    for (const char* name : effects)
      if (const catalogue::Entry* entry = catalogue::find(name))
        result_.model.effects.push_back(catalogue::blank_effect(*entry, result_.model.drive.axis));
  }

  void print(const char* balance, bool possible, const std::string& text) {
    result_.reasons.push_back(fmt::format("{} balance: {}{}", balance, possible ? "" : "not possible, ", text));
  }

  void guess(model::Quantity& quantity, double value, const char* source) {
    if (!(value > 0.0)) return;
    quantity.value = rounded(value);
    quantity.source = source;
  }

  void drive() {
    model::Drive& drive = result_.model.drive;
    const auto know = [](model::Quantity& quantity, const std::optional<double>& fact) {
      if (!fact) return;
      quantity.value = fact;
      quantity.source = "data set";
    };
    know(drive.gear_ratio, dataset_.drive.gear_ratio);
    know(drive.torque_constant_nm_a, dataset_.drive.torque_constant_nm_a);
    know(drive.pitch_m, dataset_.drive.pitch_m);
    guess(drive.rated_current_a, largest_of(dataset_, Column::current), "guess: largest in the data");
    guess(drive.rated_velocity_rad_s, largest_speed(dataset_), "guess: largest in the data");
    guess(drive.rated_torque_nm, largest_torque(), "guess: largest in the data");
    double sum = 0.0, count = 0.0;
    for (const Experiment& e : dataset_.experiments)
      for (const double t : e[Column::temperature]) sum += t, count += 1.0;
    if (count > 0.0 && sum > 0.0) guess(drive.temperature_reference_c, sum / count, "guess: mean of the data");
  }

  double largest_torque() const {
    const double measured = largest_of(dataset_, Column::torque);
    if (measured > 0.0) return measured;
    const double ratio = dataset_.drive.gear_ratio.value_or(1.0);
    const double motor = largest_of(dataset_, Column::motor_torque);
    if (motor > 0.0) return ratio * motor;
    return dataset_.drive.torque_constant_nm_a
               ? ratio * *dataset_.drive.torque_constant_nm_a * largest_of(dataset_, Column::current)
               : 0.0;
  }

  void motor() {
    const bool current = has_together(dataset_, {{Column::current}, {Column::motor_position, Column::motor_velocity}});
    const bool torque =
        has_together(dataset_, {{Column::motor_torque}, {Column::motor_position, Column::motor_velocity}});
    if (!current && !torque) {
      print("motor", false, "needs current_a or motor_torque_nm together with motor_position_rad");
      return;
    }
    add({"inertia", "viscous_friction", "coulomb_friction", current ? "current_offset" : "torque_bias"});
    print("motor", true,
          fmt::format("inertia, viscous_friction, coulomb_friction, {}", current ? "current_offset" : "torque_bias"));
  }

  void transmission() {
    const bool there =
        has_together(dataset_, {{Column::torque}, {Column::motor_position}, {Column::output_position}}, true);
    if (there) add({"linear_stiffness", "structural_damping"});
    print("transmission", there,
          there ? "linear_stiffness, structural_damping"
                : "needs torque_nm with motor_position_rad, and output_position_rad or a locked load");
  }

  void load() {
    const bool there = output_moves(dataset_);
    if (there) add({"output_inertia", "output_viscous_friction", "output_coulomb_friction"});
    print("load", there,
          there ? "output_inertia, output_viscous_friction, output_coulomb_friction"
                : "needs torque_nm and output_position_rad with a free load");
  }

  const Dataset& dataset_;
  BaseModel result_;
};

}  // namespace

BaseModel base_model(const Dataset& dataset, const std::string& name) {
  return Builder(dataset, name).build();
}

}  // namespace flexspline::project
