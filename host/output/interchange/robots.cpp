#include <fmt/format.h>

#include "host/output/interchange/export.hpp"

namespace flexspline::interchange {
namespace {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

// A comment may hold no two hyphens in a row.
std::string comment_safe(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--")) text.replace(at, 2, "- ");
  return text;
}

std::string said_of(const model::Model& model, const Joint& joint, const std::string& source) {
  std::string left_out;
  for (const std::string& id : joint.left_out) left_out += (left_out.empty() ? "" : ", ") + id;
  const bool linear = model.drive.axis == data::Axis::linear;
  std::string text = fmt::format(
      "Model \"{}\", written by flexspline export from {}. All at the output side, in SI.\n     Friction is "
      "the linear law nearest to the model's friction over speed; it leaves {:.3g} {} RMS.",
      model.name, source, joint.friction_error, linear ? "N" : "N m");
  if (joint.stiffness > 0.0)
    text +=
        joint.torque_limit > 0.0
            ? fmt::format(
                  "\n     Stiffness is the secant at half the rated torque; at the rated torque it is {:.2g} % off.",
                  100.0 * joint.stiffness_error)
            : "\n     Stiffness is the same at every torque.";
  if (!left_out.empty()) text += "\n     A joint knows nothing of: " + left_out + ".";
  return comment_safe(text);
}

// Links need some mass for an engine to start; it is small compared with any arm.
constexpr const char* kSmallMass = "0.001";
constexpr const char* kSmallInertia = "1e-06";

struct Inertial {
  std::string mass = kSmallMass;
  std::string inertia = kSmallInertia;
};

// Of the link: on a linear axis the model's inertia is a mass, and the mass resists the motion.
Inertial inertial_of(const Joint& joint, bool linear) {
  Inertial link;
  if (!(joint.output_inertia > 0.0)) return link;
  const std::string value = fmt::format("{:.9g}", joint.output_inertia);
  link.mass = linear ? value : "1";
  if (!linear) link.inertia = value;
  return link;
}

std::string urdf_link(const std::string& name, const std::string& which, const std::string& mass,
                      const std::string& inertia) {
  return fmt::format(
      R"(  <link name="{}_{}">
    <inertial>
      <mass value="{}"/>
      <inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/>
    </inertial>
  </link>
)",
      name, which, mass, inertia, inertia, inertia);
}

// The gear's spring, between rotor and link.
std::string urdf_spring(const Joint& joint, const std::string& name, const char* type, const std::string& limit) {
  return fmt::format(
      R"(  <joint name="{0}_flexspline" type="{1}">
    <parent link="{0}_rotor"/>
    <child link="{0}_link"/>
    <axis xyz="0 0 1"/>
    <dynamics damping="{2:.9g}" friction="0"/>
{3}  </joint>
  <gazebo reference="{0}_flexspline">
    <springStiffness>{4:.9g}</springStiffness>
    <springReference>0</springReference>
  </gazebo>
)",
      name, type, joint.link_damping, limit, joint.stiffness);
}

std::string urdf_transmission(const Joint& joint, const std::string& name) {
  return fmt::format(
      R"(  <transmission name="{0}_transmission">
    <type>transmission_interface/SimpleTransmission</type>
    <joint name="{0}_motor">
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint>
    <actuator name="{0}_actuator">
      <mechanicalReduction>{1:.9g}</mechanicalReduction>
    </actuator>
    <drake:rotor_inertia xmlns:drake="http://drake.mit.edu" value="{2:.9g}"/>
    <drake:gear_ratio xmlns:drake="http://drake.mit.edu" value="{1:.9g}"/>
  </transmission>
</robot>
)",
      name, joint.gear_ratio, joint.armature / (joint.gear_ratio * joint.gear_ratio));
}

}  // namespace

std::string mujoco(const model::Model& model, const std::string& source) {
  const Joint joint = joint_of(model);
  const std::string name = c_name(model.name);
  const bool linear = model.drive.axis == data::Axis::linear;
  const char* const type = linear ? "slide" : "hinge";
  const bool elastic = joint.stiffness > 0.0;
  const auto [mass, inertia] = inertial_of(joint, linear);
  const std::string link =
      fmt::format(R"(<inertial pos="0 0 0" mass="{}" diaginertia="{} {} {}"/>)", mass, inertia, inertia, inertia);
  std::string bodies;
  if (elastic)
    bodies = fmt::format(
        R"(      <inertial pos="0 0 0" mass="{}" diaginertia="{} {} {}"/>
      <body name="{}_link">
        <joint name="{}_flexspline" type="{}" axis="0 0 1" stiffness="{:.9g}" damping="{:.9g}"/>
        {}
      </body>
)",
        kSmallMass, kSmallInertia, kSmallInertia, kSmallInertia, name, name, type, joint.stiffness, joint.link_damping,
        link);
  else
    bodies = "      " + link + "\n";
  std::string limits;
  if (joint.torque_limit > 0.0)
    limits = fmt::format(R"( ctrllimited="true" ctrlrange="{0:.9g} {1:.9g}")", -joint.torque_limit / joint.gear_ratio,
                         joint.torque_limit / joint.gear_ratio);
  return fmt::format(
      R"(<mujoco model="{name}">
  <!-- {said} -->
  <compiler angle="radian"/>
  <worldbody>
    <body name="{name}_rotor">
      <joint name="{name}_motor" type="{type}" axis="0 0 1" armature="{armature:.9g}" damping="{damping:.9g}" frictionloss="{friction:.9g}"/>
{bodies}    </body>
  </worldbody>
  <actuator>
    <!-- Control is the motor's torque. -->
    <motor name="{name}_torque" joint="{name}_motor" gear="{ratio:.9g}"{limits}/>
  </actuator>
</mujoco>
)",
      fmt::arg("name", name), fmt::arg("said", escaped(said_of(model, joint, source))), fmt::arg("type", type),
      fmt::arg("armature", joint.armature), fmt::arg("damping", joint.damping), fmt::arg("friction", joint.friction),
      fmt::arg("bodies", bodies), fmt::arg("ratio", joint.gear_ratio), fmt::arg("limits", limits));
}

std::string urdf(const model::Model& model, const std::string& source) {
  const Joint joint = joint_of(model);
  const std::string name = c_name(model.name);
  const bool linear = model.drive.axis == data::Axis::linear;
  const bool elastic = joint.stiffness > 0.0;
  const auto [mass, inertia] = inertial_of(joint, linear);
  const std::string limit =
      joint.torque_limit > 0.0
          ? fmt::format("    <limit lower=\"-1e9\" upper=\"1e9\" effort=\"{:.9g}\" velocity=\"{:.9g}\"/>\n",
                        joint.torque_limit, joint.velocity_limit)
          : std::string();
  // A sliding joint without limits is not allowed.
  const char* const type = linear ? "prismatic" : limit.empty() ? "continuous" : "revolute";
  if (linear && limit.empty())
    throw ExportError("a sliding joint of URDF needs its largest force; add rated_torque_nm to the model's [drive]");
  std::string text = fmt::format("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n  <!-- {} -->\n", name,
                                 escaped(said_of(model, joint, source)));
  text += fmt::format("  <link name=\"{}_base\"/>\n", name);
  if (elastic) text += urdf_link(name, "rotor", kSmallMass, kSmallInertia);
  text += urdf_link(name, "link", mass, inertia);
  text += fmt::format(
      R"(  <joint name="{name}_motor" type="{type}">
    <parent link="{name}_base"/>
    <child link="{name}_{child}"/>
    <axis xyz="0 0 1"/>
    <dynamics damping="{damping:.9g}" friction="{friction:.9g}"/>
{limit}  </joint>
)",
      fmt::arg("name", name), fmt::arg("type", type), fmt::arg("child", elastic ? "rotor" : "link"),
      fmt::arg("damping", joint.damping), fmt::arg("friction", joint.friction), fmt::arg("limit", limit));
  if (elastic) text += urdf_spring(joint, name, type, limit);
  return text + urdf_transmission(joint, name);
}

}  // namespace flexspline::interchange
