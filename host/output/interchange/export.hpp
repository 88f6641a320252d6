// A model for other tools: a C header, tables, and what physics engines know of a joint.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/physics/model/model.hpp"

namespace flexspline::interchange {

// The model cannot be written in this format; the message states why and what to do.
class ExportError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A header of C99 with all the model's effects, those with memory too. All parameters must have values.
// `source` is named in it. The numbers are those of `double` on the host, to rounding.
std::string c_header(const model::Model& model, const std::string& source);

// Tables by file name: parameters.csv, friction.csv (the motor's friction at constant speed, by direction),
// stiffness.csv (the transmission's torque, loading and unloading), and for each effect that depends on one signal
// alone its curve. Files that a model has nothing for are left out.
std::vector<std::pair<std::string, std::string>> csv_tables(const model::Model& model);

// What a physics engine knows of a joint, at the output side: the linear law (Coulomb and viscous) that is nearest
// to the model's friction between a hundredth of the rated velocity and all of it.
struct Joint {
  double armature = 0.0;         // inertia of the motor seen from the output, kg m^2
  double damping = 0.0;          // N m s/rad
  double friction = 0.0;         // N m
  double friction_error = 0.0;   // RMS of what the line leaves of the model's friction, N m
  double stiffness = 0.0;        // N m/rad of the transmission, by the secant at half the rated torque; zero: rigid
  double stiffness_error = 0.0;  // largest difference of the secant at the rated torque, as a share of it
  double link_damping = 0.0;     // of the transmission, N m s/rad
  double output_inertia = 0.0;   // that the model has on the load balance, kg m^2
  double gear_ratio = 1.0;
  double torque_limit = 0.0;          // rated, at the output; zero: not known
  double velocity_limit = 0.0;        // rated, at the output
  std::vector<std::string> left_out;  // effects of which a joint knows nothing
};
// Throws ExportError where the rated velocity is not known, or the rated torque of a stiffness that depends on it.
Joint joint_of(const model::Model& model);
// A model of MuJoCo: two hinges in a row, the motor's (armature, friction) and the transmission's (stiffness).
std::string mujoco(const model::Model& model, const std::string& source);
// The same as a robot of two joints, with transmission and the tags that Gazebo and Drake read.
std::string urdf(const model::Model& model, const std::string& source);

// Letters, digits and underscores.
std::string c_name(std::string_view name);

}  // namespace flexspline::interchange
