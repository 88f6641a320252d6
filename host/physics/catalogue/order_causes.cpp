#include "host/physics/catalogue/order_causes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

namespace flexspline::catalogue {
namespace {

// What an effect is able to show of a cause.
enum ShowsAs : unsigned {
  kTorque = 1,       // a torque at the motor that does not depend on the load
  kWithLoad = 2,     // one in proportion to the motor's torque, or to its current
  kPosition = 4,     // an angle between motor and output
  kFriction = 8,     // a torque against the motion that varies with the angle: friction, or what is in proportion to
                     // the current where friction alone asks for it
  kAnyTorque = 3,    // motion at one load does not distinguish these
  kEverything = 15,  // of the gear
};

enum Facts : unsigned { kNoFact = 0, kPolePairs = 1, kSlots = 2, kGear = 4, kOutputTurn = 8 };

struct MotorTurn {
  std::optional<long> pole_pairs;
  std::optional<long> slots;
  std::optional<double> gear_ratio;    // of a strain-wave gear
  std::optional<double> output_ratio;  // of any rotary gear: turns of the motor in a turn of the output
  bool is_known = false;
};

struct Row {
  unsigned shows_as;
  unsigned needs;  // Facts
  double (*order)(const MotorTurn&);
  std::string_view from;
  std::string_view cause;
  std::string_view check;
  std::string_view cure;
  std::string_view reference;
};

// Strain-wave gears of one stage with two lobes are made from 30:1 up. Less is another gear.
constexpr double kLeastStrainWaveRatio = 30.0;
// Stated orders are written with few digits. Below one the tolerance is relative.
constexpr double kTolerance = 1e-3;

constexpr std::string_view kMeasurementErrors =
    "Chung and Sul, Analysis and compensation of current measurement error in vector-controlled AC motor drives, IEEE "
    "Trans. Ind. Appl. 34(2), 1998";
constexpr std::string_view kImperfections =
    "Gasparin et al., Additional cogging torque components in permanent-magnet motors due to manufacturing "
    "imperfections, IEEE Trans. Magn. 45(3), 2009";
constexpr std::string_view kHarmonicDriveError =
    "Nye and Kraml, Harmonic drive gear error: characterization and compensation, Aerospace Mechanisms Symp., 1991; "
    "Tuttle and Seering, A nonlinear model of a harmonic drive gear transmission, IEEE Trans. Robot. Autom. 12(3), "
    "1996";
constexpr std::string_view kMeshReference = "Litvin and Fuentes, Gear Geometry and Applied Theory";

// Orders are per turn of the motor against its housing. The wave generator turns with the motor, so that its lobes pass
// a fixed spline exactly twice a turn. Teeth: a ratio N has 2N teeth on the spline that turns the output; the fixed
// spline has 2N + 2 where it is the circular one and 2N - 2 where it is the flexspline, and each of its teeth is passed
// once by each lobe.
constexpr Row kRows[] = {
    {kTorque | kPosition, kNoFact, [](const MotorTurn&) { return 1.0; }, "1 per motor turn",
     "the motor's encoder is eccentric: its disc or ring does not run true on the shaft",
     "Repeat at twice the speed: the false acceleration of an eccentric encoder grows with the square of the speed. "
     "Measure the runout of its disc or ring.",
     "Centre the disc or ring; or average two reading heads at opposite sides; or map the error and subtract it.",
     "derived: an angle error e sin(q) at constant speed w looks like an acceleration of amplitude e w^2"},
    {kEverything, kNoFact, [](const MotorTurn&) { return 1.0; }, "1 per motor turn",
     "the motor's shaft is bent, or a coupling, pulley or hub on it is eccentric or out of balance",
     "Measure the runout of the shaft with a dial gauge. Turn the axis so that the motor's shaft is vertical: what "
     "gravity does to an unbalance disappears.",
     "Align or replace the shaft, coupling or hub; balance the rotor.", "Genta, Dynamics of Rotating Systems"},
    {kEverything, kGear, [](const MotorTurn&) { return 2.0; }, "2 per motor turn, one for each lobe",
     "the wave generator: its two lobes, and misalignment of wave generator, Oldham coupling or circular spline",
     "Release the screws of the circular spline, turn the motor some turns, tighten them evenly and repeat: "
     "misalignment changes the ripple. Measure the concentricity and the squareness of the mounting.",
     "Align again by the gear maker's tolerances; what stays is the gear's own, and an effect of this order in the "
     "model compensates for it.",
     kHarmonicDriveError},
    {kEverything, kGear, [](const MotorTurn&) { return 4.0; }, "4 per motor turn, the second harmonic of two lobes",
     "the wave generator: the shape of its lobes, or a circular spline that its seat clamps out of round",
     "Measure the roundness of the circular spline's seat. Release its screws, tighten them evenly and repeat.",
     "Correct the seat or replace the wave generator; what stays is the gear's own, and the effect in the model "
     "compensates for it.",
     kHarmonicDriveError},
    {kTorque, kPolePairs, [](const MotorTurn& m) { return static_cast<double>(*m.pole_pairs); }, "1 x pole_pairs",
     "a current sensor has an offset: what looks like a constant current turns in the rotor's axes once per "
     "electrical turn",
     "Read the phase currents with the bridge off, cold and warm: they must be zero. The ripple does not change with "
     "the load, and the measured q current does not show it, as the current controller hides it.",
     "Calibrate the offset at every start, and again when warm.", kMeasurementErrors},
    {kWithLoad | kFriction, kPolePairs, [](const MotorTurn& m) { return 2.0 * static_cast<double>(*m.pole_pairs); },
     "2 x pole_pairs", "the gains of the current sensors differ: the currents have a part that turns backwards",
     "Repeat at twice the load: the ripple doubles. Send one current through two phases in series and compare the "
     "readings of their sensors.",
     "Calibrate the gains of the sensors against each other.", kMeasurementErrors},
    {kWithLoad | kFriction, kPolePairs, [](const MotorTurn& m) { return 2.0 * static_cast<double>(*m.pole_pairs); },
     "2 x pole_pairs", "the phases differ in resistance or inductance: a bad contact, or turns that are shorted",
     "Measure the resistance between each two of the three terminals, cold and warm: the three must agree.",
     "Repair the contact or the winding; a current controller of higher bandwidth reduces the ripple.",
     "Krause et al., Analysis of Electric Machinery and Drive Systems"},
    {kTorque, kPolePairs, [](const MotorTurn& m) { return 2.0 * static_cast<double>(*m.pole_pairs); },
     "the number of poles, 2 x pole_pairs",
     "cogging at one irregular place of the stator, which every pole passes: a stator out of round, or joints of its "
     "laminations",
     "Turn the shaft by hand or by another motor with the bridge off: the ripple stays.",
     "Relieve a housing that presses on the stator; map the torque and compensate for it.", kImperfections},
    {kTorque, kPolePairs, [](const MotorTurn& m) { return 6.0 * static_cast<double>(*m.pole_pairs); }, "6 x pole_pairs",
     "dead time of the inverter: its voltage error changes sign with each phase current, six times per electrical turn",
     "The ripple does not change with the load. The measured q current shows it, so that it is not dead time where the "
     "log's effort is that current. Change the dead time or its compensation: the ripple follows.",
     "Switch the dead-time compensation on and set it to the bridge's dead time; a current controller of higher "
     "bandwidth reduces the rest.",
     "Holmes and Lipo, Pulse Width Modulation for Power Converters"},
    {kWithLoad | kFriction, kPolePairs, [](const MotorTurn& m) { return 6.0 * static_cast<double>(*m.pole_pairs); },
     "6 x pole_pairs", "fifth and seventh harmonic of the motor's back-EMF",
     "Turn the shaft by another motor with the bridge off and record the voltage between two terminals over some "
     "turns: look for its fifth and seventh harmonic. The ripple grows in proportion to the current.",
     "Add a current that depends on the angle and cancels it, or compensate for the torque; else another motor.",
     "Jahns and Soong, Pulsating torque minimization techniques for permanent magnet AC motor drives, IEEE Trans. Ind. "
     "Electron. 43(2), 1996"},
    {kTorque, kSlots, [](const MotorTurn& m) { return static_cast<double>(*m.slots); }, "1 x motor_slots",
     "cogging by magnets that differ: every slot passes the same irregular magnet",
     "Turn the shaft by hand or by another motor with the bridge off: the ripple stays.",
     "Map the torque over the motor's angle and compensate for it; else another motor.", kImperfections},
    {kTorque, kPolePairs | kSlots,
     [](const MotorTurn& m) { return static_cast<double>(std::lcm(*m.slots, 2 * *m.pole_pairs)); },
     "least common multiple of motor_slots and 2 x pole_pairs",
     "cogging: the magnets pull at the teeth between the slots",
     "Turn the shaft by hand or by another motor with the bridge off: the ripple stays.",
     "Map the torque over the motor's angle and compensate for it; a motor with skewed slots or magnets has less.",
     "Hendershot and Miller, Design of Brushless Permanent-Magnet Machines"},
    {kFriction, kOutputTurn, [](const MotorTurn& m) { return 1.0 / *m.output_ratio; }, "1 per output turn",
     "the output: its bearing or seal is out of round or out of line, or a cable drags in a part of the turn",
     "Turn the output by hand, uncoupled from the motor, and look for the tight place; release the cables and repeat.",
     "Align or replace bearing and seal; lay the cables so that they do not drag.",
     "Armstrong-Helouvry, Control of Machines with Friction, 1991"},
    {kFriction, kOutputTurn, [](const MotorTurn& m) { return 2.0 / *m.output_ratio; }, "2 per output turn",
     "the output: its bearing or seal is pressed oval by its seat, or by screws that are not tightened evenly",
     "Release the screws of the output bearing, tighten them evenly and repeat: the two tight places change.",
     "Correct the roundness of the seat; tighten the screws crosswise to the stated torque.",
     "Armstrong-Helouvry, Control of Machines with Friction, 1991"},
    {kEverything, kGear, [](const MotorTurn& m) { return 2.0 * *m.gear_ratio + 2.0; }, "2 x gear_ratio + 2",
     "the mesh of the teeth, where the circular spline is fixed: the number of its teeth",
     "Repeat with more load: wear and wrong shapes of teeth show under load. Look at the teeth and at the grease.",
     "Run the gear in, renew the grease, or replace the gear.", kMeshReference},
    {kEverything, kGear, [](const MotorTurn& m) { return 2.0 * *m.gear_ratio - 2.0; }, "2 x gear_ratio - 2",
     "the mesh of the teeth, where the flexspline is fixed: the number of its teeth",
     "Repeat with more load: wear and wrong shapes of teeth show under load. Look at the teeth and at the grease.",
     "Run the gear in, renew the grease, or replace the gear.", kMeshReference},
};

// By what the catalogue says of the effect.
unsigned shows_as(const Entry& effect) {
  if (effect.count(Kind::given) == 0) return 0;
  if (effect.info->phase == Phase::shift) return kPosition;
  if (effect.info->phase != Phase::source || effect.info->balance != Balance::motor) return 0;
  // Of the causes those that rub, and those in proportion to the current: an offset and magnets make no friction.
  if ((effect.info->reads & effects::kBothDirections) != 0) return kFriction;
  return (effect.info->reads & effects::kTorque) != 0 ? kWithLoad : kAnyTorque;
}

std::optional<long> count_of(const model::Quantity& quantity) {
  if (!quantity.value) return std::nullopt;
  return std::lround(*quantity.value);
}

MotorTurn motor_turn_of(const model::Drive& drive) {
  MotorTurn turn;
  turn.pole_pairs = count_of(drive.pole_pairs);
  turn.slots = count_of(drive.motor_slots);
  const double ratio = drive.gear_ratio.value.value_or(1.0);
  const bool rotary = drive.axis == data::Axis::rotary;
  if (rotary && ratio >= kLeastStrainWaveRatio) turn.gear_ratio = ratio;
  if (rotary && ratio > 1.0) turn.output_ratio = ratio;
  // Positions with a ratio of one may be those of the joint; a motor whose poles or slots are stated has no gear then.
  const bool is_direct = drive.gear_ratio.value && (turn.pole_pairs || turn.slots);
  turn.is_known = rotary ? ratio != 1.0 || is_direct : drive.pitch_m.value.has_value();
  return turn;
}

bool has_facts(const Row& row, const MotorTurn& turn) {
  return ((row.needs & kPolePairs) == 0 || turn.pole_pairs) && ((row.needs & kSlots) == 0 || turn.slots) &&
         ((row.needs & kGear) == 0 || turn.gear_ratio) && ((row.needs & kOutputTurn) == 0 || turn.output_ratio);
}

// Of all rows that need one of these facts: rising, each once.
std::vector<double> orders_from(unsigned facts, const Entry& effect, const MotorTurn& turn) {
  std::vector<double> orders;
  if (!turn.is_known) return orders;
  for (const Row& row : kRows)
    if ((row.needs & facts) != 0 && (row.shows_as & shows_as(effect)) != 0 && has_facts(row, turn))
      orders.push_back(row.order(turn));
  std::sort(orders.begin(), orders.end());
  orders.erase(std::unique(orders.begin(), orders.end()), orders.end());
  return orders;
}

}  // namespace

std::vector<OrderCause> order_causes(const Entry& effect, double order, const model::Drive& drive) {
  const MotorTurn turn = motor_turn_of(drive);
  std::vector<OrderCause> causes;
  if (!turn.is_known) return causes;
  for (const Row& row : kRows) {
    if ((row.shows_as & shows_as(effect)) == 0 || !has_facts(row, turn)) continue;
    if (std::abs(row.order(turn) - order) > kTolerance * std::min(1.0, order)) continue;
    const bool of_facts = row.from.find(" x ") != std::string_view::npos;
    causes.push_back({of_facts ? fmt::format("{} = {:g}", row.from, order) : std::string(row.from), row.cause,
                      row.check, row.cure, row.reference});
  }
  return causes;
}

std::string order_hint(const Entry& effect, const model::Drive& drive) {
  const unsigned shows = shows_as(effect);
  if (shows == 0) return {};
  const MotorTurn turn = motor_turn_of(drive);
  if (!turn.is_known)
    return drive.axis == data::Axis::linear
               ? "What an order means is known per turn of the motor: state pitch_m in [drive] of the model."
           : drive.gear_ratio.value
               ? "The gear ratio is 1, so positions and orders may be those of the joint, and causes are known per "
                 "turn of the motor: state the gear's ratio, with motor positions, or pole_pairs of a motor without a "
                 "gear in [drive] of the model."
               : "What an order means is known per turn of the motor: state gear_ratio in [drive] of the model.";
  unsigned needed = 0;
  for (const Row& row : kRows)
    if ((row.shows_as & shows) != 0) needed |= row.needs;
  std::vector<std::string> missing;
  if ((needed & kPolePairs) != 0 && !turn.pole_pairs) missing.emplace_back("pole_pairs");
  if ((needed & kSlots) != 0 && !turn.slots) missing.emplace_back("motor_slots");
  if (missing.empty()) return {};
  return fmt::format(
      "State {} of the motor in [drive] of the model: from {} it can be decided whether the order is the motor's.",
      fmt::join(missing, " and "), missing.size() > 1 ? "they" : "it");
}

std::vector<double> orders_of_motor(const Entry& effect, const model::Drive& drive) {
  return orders_from(kPolePairs | kSlots, effect, motor_turn_of(drive));
}

std::vector<double> orders_of_output(const Entry& effect, const model::Drive& drive) {
  std::vector<double> orders = orders_from(kOutputTurn, effect, motor_turn_of(drive));
  for (double& order : orders) order = std::stod(fmt::format("{:g}", order));
  return orders;
}

}  // namespace flexspline::catalogue
