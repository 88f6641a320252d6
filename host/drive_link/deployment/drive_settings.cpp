#include "host/drive_link/deployment/drive_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "host/common/text/toml.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/deployment/reachable_limits.hpp"
#include "host/drive_link/deployment/statics.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/control/reachable.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;
using text::Node;
using text::NodeKind;

constexpr double kMost = 1e12;
constexpr double kLeast = 1e-12;  // of what has to be above zero
// The motor may turn before the output's encoder has to show it: torsion swings by less than four of its bases, and a
// quarter of this has to be seen (shared/control/drive_parameters_setup.hpp).
constexpr double kTorsionsBeforeStuck = 8.0;
constexpr double kCountsBeforeStuck = 32.0;
// The motor's encoder: friction may hold half more than the model predicts, and a half of what the drive has may come
// of what is no friction. The time in which full torque turns a free shaft by a count passes so often first.
constexpr double kHeldBeforeStuck = 1.5, kTorqueBeforeStuck = 0.5, kMostTorqueChange = 1.85;
constexpr double kCountsTimesBeforeStuck = 16.0;
constexpr double kShownOfStop = 0.25;  // less than the rule of reachable limits allows

// The file's tables, whose keys are read one after another; an unread key is not a setting.
class Settings {
 public:
  Settings(const std::string& toml, std::string origin) : origin_(std::move(origin)) {
    try {
      root_ = text::parse_toml(toml);
    } catch (const text::TomlError& error) {
      throw PackError(fmt::format("{}:{}: {}; {}", origin_, error.line(), error.what(), error.remedy()));
    }
    const Node* format = root_.find("format");
    if (format == nullptr || format->text != kDriveFormat)
      fail(format == nullptr ? 1 : format->line, fmt::format("format has to be \"{}\"", kDriveFormat));
    taken_[""].insert("format");
  }
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw PackError(fmt::format("{}:{}: {}", origin_, line, what));
  }
  bool has(const std::string& table) const { return root_.find(table) != nullptr; }
  const Node* find(const std::string& table, const std::string& key, NodeKind kind, std::string_view expected) {
    taken_[""].insert(table);
    taken_[table].insert(key);
    const Node* of = root_.find(table);
    if (of == nullptr) return nullptr;
    if (of->kind != NodeKind::table) fail(of->line, fmt::format("{} has to be a table", table));
    const Node* found = of->find(key);
    if (found != nullptr && found->kind != kind)
      fail(found->line, fmt::format("[{}] {} has to be {}, not {}", table, key, expected, found->kind_name()));
    return found;
  }
  std::optional<double> number(const std::string& table, const std::string& key, double least = -kMost,
                               double most = kMost) {
    const Node* found = find(table, key, NodeKind::number, "a number");
    if (found == nullptr) return {};
    if (!(found->number >= least && found->number <= most))
      fail(found->line, fmt::format("[{}] {} is {:g}; it has to be {}", table, key, found->number,
                                    least == kLeast && most == kMost ? "above zero"
                                    : least == kLeast                ? fmt::format("above zero and at most {:g}", most)
                                                      : fmt::format("between {:g} and {:g}", least, most)));
    return found->number;
  }
  double positive(const std::string& table, const std::string& key, double otherwise, double most = kMost) {
    return number(table, key, kLeast, most).value_or(otherwise);
  }
  double needed(const std::string& table, const std::string& key, std::optional<double> otherwise, const char* why) {
    if (const auto found = number(table, key, kLeast)) return *found;
    if (otherwise && *otherwise > 0.0) return *otherwise;
    throw PackError(fmt::format("{}: {} is not known: {}; add it to [{}]", origin_, key, why, table));
  }
  std::uint32_t count(const std::string& table, const std::string& key, std::uint32_t otherwise, double least,
                      double most) {
    const auto x = number(table, key, least, most);
    if (x && *x != std::floor(*x))
      fail(root_.find(table)->find(key)->line, fmt::format("[{}] {} is {:g}, no whole number", table, key, *x));
    return x ? static_cast<std::uint32_t>(*x) : otherwise;
  }
  std::string word(const std::string& table, const std::string& key, std::string otherwise,
                   std::initializer_list<std::string_view> known) {
    const Node* found = find(table, key, NodeKind::text, "a text");
    if (found == nullptr) return otherwise;
    std::string all;
    for (const std::string_view one : known) {
      if (found->text == one) return found->text;
      all += (all.empty() ? "" : ", ") + std::string(one);
    }
    fail(found->line, fmt::format("[{}] {} is \"{}\"; there are {}", table, key, found->text, all));
  }
  // A setting differs from what the board states.
  [[noreturn]] void disagrees(const std::string& table, const std::string& key, double is, const char* unit,
                              const std::string& why) const {
    const Node* of = root_.find(table);
    const Node* found = of == nullptr ? nullptr : of->find(key);
    fail(found == nullptr ? 1 : found->line,
         fmt::format("[{}] {} is {:g} {}, but {}; leave it out, and what the board states is taken", table, key, is,
                     unit, why));
  }
  void require_no(const std::string& table, bool board_has_none) const {
    const Node* of = root_.find(table);
    if (of != nullptr && board_has_none)
      fail(of->line, fmt::format("[{}] is there, but the drive's board states that it has none; take it out", table));
  }
  // After all settings were taken.
  void done() const {
    for (const text::Entry& table : root_.entries) {
      const auto known = taken_.find(table.key);
      if (known == taken_.end() || table.key.empty()) {
        if (taken_.at("").contains(table.key)) continue;
        std::string all;
        for (const auto& [name, keys] : taken_)
          if (!name.empty()) all += (all.empty() ? "" : ", ") + name;
        fail(table.line, fmt::format("[{}] is not a table of settings; there are {}", table.key, all));
      }
      for (const text::Entry& entry : table.value.entries) {
        if (known->second.contains(entry.key)) continue;
        std::string all;
        for (const std::string& key : known->second) all += (all.empty() ? "" : ", ") + key;
        fail(entry.line, fmt::format("[{}] {} is not a setting; there are {}", table.key, entry.key, all));
      }
    }
  }

 private:
  std::string origin_;
  Node root_;
  std::map<std::string, std::set<std::string>> taken_;
};

std::optional<double> parameter(const catalogue::ResolvedModel& model, const char* effect, const char* name) {
  for (const catalogue::ResolvedEffect& e : model.effects)
    if (e.effect->type == effect)
      for (const model::Parameter& p : e.effect->parameters)
        if (p.name == name) return p.value;
  return {};
}

// The largest slope of what the transmission carries without memory, within a torsion; zero without such effects.
double largest_stiffness(const catalogue::ResolvedModel& model, double torsion) {
  constexpr int kSteps = 400;
  const Springs springs(model);
  double steepest = 0.0;
  for (int k = -kSteps; k < kSteps; ++k)
    steepest =
        std::max(steepest, (springs.torque_at(torsion * (k + 1) / kSteps) - springs.torque_at(torsion * k / kSteps)) /
                               (torsion / kSteps));
  return steepest;
}

// What the settings take from the model.
struct ModelFacts {
  std::optional<double> inertia, output_inertia, damping_torque, damping_exponent;
  double stiffness = 0.0;         // the largest within the base of torsion, N m/rad
  double held_by_friction = 0.0;  // torque_held_by_friction
};
ModelFacts facts_of(const catalogue::ResolvedModel& model, const DriveConstants<double>& d) {
  return {parameter(model, "inertia", "inertia"),           parameter(model, "output_inertia", "inertia"),
          parameter(model, "structural_damping", "torque"), parameter(model, "structural_damping", "exponent"),
          largest_stiffness(model, d.torsion_base),         torque_held_by_friction(model)};
}

// Of the board, where it states it: the settings have to agree with it.
double of_board(Settings& s, const std::string& table, const std::string& key, const char* unit, double stated,
                double otherwise) {
  constexpr double kSame = 1.0 / 300.0;
  const double is = s.positive(table, key, stated > 0.0 ? stated : otherwise);
  if (stated > 0.0 && std::abs(is - stated) > kSame * stated)
    s.disagrees(table, key, is, unit, fmt::format("the drive's board states {:g} {}", stated, unit));
  return is;
}

control::AnalogSetup<double> analog(Settings& s, const std::string& table, const std::string& unit, double full_scale,
                                    double stated, double stated_at_zero = 0.0) {
  control::AnalogSetup<double> a;
  a.full_scale = of_board(s, table, "full_scale_" + unit, unit.c_str(), stated, full_scale);
  const std::string zero = "at_zero_" + unit;
  a.at_zero = s.number(table, zero).value_or(stated_at_zero);
  if (stated > 0.0 && std::abs(a.at_zero - stated_at_zero) > 1e-3 * stated)
    s.disagrees(table, zero, a.at_zero, unit.c_str(), fmt::format("the drive's board states {:g}", stated_at_zero));
  a.lowest_share = s.number(table, "lowest_share", -1.0, 1.0).value_or(a.lowest_share);
  a.highest_share = s.number(table, "highest_share", -1.0, 1.0).value_or(a.highest_share);
  return a;
}

control::ExcitationSetup<double> excitation(Settings& s, const DriveConstants<double>& d, bool& of_torque,
                                            double torque_limit, double velocity_limit, double overspeed) {
  const std::string t = "excitation";
  if (!s.has(t)) return {};
  of_torque = s.word(t, "of", "torque", {"torque", "velocity"}) == "torque";
  const double most = of_torque ? torque_limit : velocity_limit;
  control::ExcitationSetup<double> e;
  e.amplitude = s.positive(t, "amplitude", 0.5 * most, most);
  e.offset = s.number(t, "offset", -most, most).value_or(0.0);
  e.frequency_hz = s.positive(t, "frequency_hz", 1.0);
  e.end_frequency_hz = s.number(t, "end_frequency_hz", 0.0).value_or(-1.0);
  e.negative_per_positive = s.positive(t, "negative_per_positive", e.negative_per_positive);
  const auto in_ticks = [&](const char* key, double otherwise) {
    return static_cast<std::uint32_t>(std::lround(s.number(t, key, 0.0, 3600.0).value_or(otherwise) / d.time_base));
  };
  e.ticks = in_ticks("duration_s", 10.0);
  e.fade_ticks = in_ticks("fade_s", 0.5);
  e.limit = s.positive(t, "limit", most, most);
  e.slope_limit = s.positive(t, "slope_limit", 1000.0 * most);
  if (of_torque) {
    e.velocity_limit = velocity_limit;
    e.overspeed = overspeed;
  }
  const std::string shape = s.word(
      t, "shape", "sine",
      {"sine", "inverted_sine", "composite", "multi_sine", "asymmetric_sine", "square", "saw_tooth", "triangle"});
  control::MultiSine lines;
  lines.seed = s.count(t, "seed", 1, 0, 4e9);
  lines.first = static_cast<std::uint16_t>(s.count(t, "first_harmonic", 1, 1, 1000));
  lines.last = static_cast<std::uint16_t>(s.count(t, "last_harmonic", 31, 1, 1000));
  if (shape == "sine") return control::sine(e);
  if (shape == "inverted_sine") return control::inverted_sine(e);
  if (shape == "composite") return control::composite(e);
  if (shape == "multi_sine") return control::multi_sine(e, lines);
  e.shape = shape == "asymmetric_sine" ? control::Shape::asymmetric_sine
            : shape == "square"        ? control::Shape::square
            : shape == "saw_tooth"     ? control::Shape::saw_tooth
                                       : control::Shape::triangle;
  return e;
}

double in_units(double thousandths) {
  return 1e-3 * thousandths;
}

// What the other settings follow from.
struct Basis {
  double current = 0.0;
  double torque = 0.0;
  double velocity = 0.0;
  double overspeed = 0.0;
  double most_torque = 0.0;  // of torque and current limit
  double inertia = 0.0;
  double stiffness = 0.0;
};

Basis basis_of(Settings& s, const ModelFacts& model, const DriveConstants<double>& d,
               const control::Hardware& hardware) {
  Basis b;
  const double most_a = in_units(hardware.most_current_ma);
  b.current = s.positive("limits", "current_a", most_a > 0.0 ? std::min(d.current_base, most_a) : d.current_base,
                         2.0 * d.current_base);
  if (most_a > 0.0 && b.current > 1.003 * most_a)
    s.disagrees("limits", "current_a", b.current, "A", fmt::format("the drive's board gives at most {:g} A", most_a));
  b.torque = s.positive("limits", "torque_nm", b.current * d.torque_constant, 2.0 * d.torque_base);
  b.velocity = s.positive("limits", "velocity_rad_s", d.velocity_base, 2.0 * d.velocity_base);
  b.overspeed = s.positive("limits", "overspeed_rad_s", 1.15 * b.velocity, 2.0 * d.velocity_base);
  b.most_torque = std::min(b.torque, b.current * d.torque_constant);
  b.inertia = s.needed("motor", "inertia_kg_m2", model.inertia, "the model has no value for inertia");
  return b;
}

void take_encoders(Settings& s, control::DriveSetup<double>& setup, std::optional<double> encoder_counts,
                   const std::string& origin) {
  const auto given_counts = s.count("motor_encoder", "counts", 0, 4, observers::EncoderAngle::kMostCounts);
  if (given_counts == 0 && !encoder_counts)
    throw PackError(
        fmt::format("{}: the counts of the motor's encoder are not known; add counts to [motor_encoder]", origin));
  if (given_counts != 0 && encoder_counts && *encoder_counts != given_counts)
    throw PackError(fmt::format("{}: [motor_encoder] counts is {}, --encoder-counts {:g}; give one of them", origin,
                                given_counts, *encoder_counts));
  setup.motor_counts = given_counts != 0 ? given_counts : static_cast<std::uint32_t>(*encoder_counts);
  setup.motor_corner = kTurn * s.positive("motor_encoder", "corner_hz", 150.0);
  if (s.has("output_encoder")) {
    setup.output_counts = s.count("output_encoder", "counts", 0, 4, observers::EncoderAngle::kMostCounts);
    if (setup.output_counts == 0) throw PackError(fmt::format("{}: [output_encoder] needs counts", origin));
    setup.output_corner = kTurn * s.positive("output_encoder", "corner_hz", 50.0);
  }
}

void take_torsion_estimate(Settings& s, control::DriveSetup<double>& setup, const Basis& b, const ModelFacts& model,
                           const DriveConstants<double>& d) {
  const char* const why = "the output has no encoder, and without one its motion is estimated";
  setup.torsion = {.inertia = b.inertia,
                   .output_inertia = s.needed("load", "inertia_kg_m2", model.output_inertia, why),
                   .stiffness = s.needed("load", "stiffness_nm_rad", b.stiffness, why),
                   .torque_noise = s.positive("load", "torque_noise_nm", 0.05 * b.most_torque),
                   .load_walk = s.positive("load", "walk_nm_sqrt_s", 0.025 * d.output_torque_base),
                   .velocity_noise = s.positive("load", "velocity_noise_rad_s", 1.5e-3 * d.velocity_base)};
}

void take_loops(Settings& s, control::DriveSetup<double>& setup, const Basis& b) {
  const double loop_hz = s.positive("velocity_loop", "bandwidth_hz", 50.0);
  const double velocity_gain = s.positive("velocity_loop", "gain_nm_s_rad", b.inertia * kTurn * loop_hz);
  const double position_hz = s.positive("position_loop", "bandwidth_hz", 10.0);
  setup.loops = {.position_gain = kTurn * position_hz,
                 .velocity_gain = velocity_gain,
                 .integral_gain =
                     s.number("velocity_loop", "integral_nm_rad", 0.0).value_or(velocity_gain * kTurn * loop_hz / 5.0),
                 .velocity_limit = b.velocity,
                 .overspeed = b.overspeed,
                 .torque_limit = b.torque,
                 .current_limit = b.current};
}

void take_trajectory(Settings& s, control::DriveSetup<double>& setup, const Basis& b, const DriveConstants<double>& d) {
  setup.trajectory.velocity_limit = b.velocity;
  setup.trajectory.acceleration_limit =
      s.positive("limits", "acceleration_rad_s2", std::min(0.5 * b.most_torque / b.inertia, 1.9 * d.acceleration_base));
  const auto turns = [&](const char* key, std::int64_t otherwise) {
    const auto x = s.number("limits", key, -kMost, kMost);
    if (!x) return otherwise;
    return static_cast<std::int64_t>(std::clamp(std::ldexp(*x / d.angle_base, 32), -0x1p62, 0x1p62));
  };
  setup.trajectory.lowest = turns("lowest_rad", setup.trajectory.lowest);
  setup.trajectory.highest = turns("highest_rad", setup.trajectory.highest);
}

void take_feedforward(Settings& s, control::DriveSetup<double>& setup, const Basis& b, const ModelFacts& model,
                      const DriveConstants<double>& d) {
  setup.feedforward = {
      .direction_band = s.positive("feedforward", "direction_band_rad_s", 1e-4 * d.velocity_base),
      .torque_limit = 1.9 * d.torque_base,
      .load_limit = 1.9 * d.output_torque_base,
      .stiffness = b.stiffness,
      .torsion_limit = 1.9 * d.torsion_base,
      .torsion_rate_limit = s.positive("feedforward", "torsion_rate_limit_rad_s", 0.5 * d.velocity_base / d.gear_ratio,
                                       2.0 * d.velocity_base / d.gear_ratio),
      .output_zero_turns = s.number("feedforward", "output_zero_turns").value_or(0.0)};
  if (model.damping_torque && *model.damping_torque > 0.0) {
    setup.feedforward.damping_torque = *model.damping_torque;
    setup.feedforward.damping_exponent = model.damping_exponent.value_or(0.5);
  }
  setup.disturbance = {.inertia = b.inertia,
                       .time_constant_s = s.positive("disturbance", "time_constant_s", 0.01),
                       .limit = 1.9 * d.torque_base};
}

void take_analog_signals(Settings& s, control::DriveSetup<double>& setup, const Basis& b,
                         const DriveConstants<double>& d, const control::Hardware& hardware) {
  setup.current = analog(s, "current_sensor", "a", 2.0 * b.current, in_units(hardware.current_full_scale_ma));
  setup.temperature = analog(s, "temperature_sensor", "c", 200.0, in_units(hardware.temperature_full_scale_mc),
                             in_units(hardware.temperature_at_zero_mc));
  setup.has_torque_sensor = s.has("torque_sensor");
  if (setup.has_torque_sensor) {
    setup.torque =
        analog(s, "torque_sensor", "nm", 3.0 * d.output_torque_base, in_units(hardware.torque_full_scale_mnm));
    setup.ripple = {.order = s.positive("torque_sensor", "ripple_order", 2.0),
                    .memory = s.positive("torque_sensor", "ripple_memory_rad", kTurn * 20.0),
                    .largest_ripple = s.positive("torque_sensor", "largest_ripple_nm", 0.05 * d.output_torque_base)};
  }
  setup.amplifier_full_scale =
      of_board(s, "amplifier", "full_scale_a", "A", in_units(hardware.amplifier_full_scale_ma), 1.25 * b.current);
}

// Encoders that stopped counting.
void take_stuck_encoder_faults(Settings& s, control::DriveSetup<double>& setup, const Basis& b, double held_by_friction,
                               const DriveConstants<double>& d) {
  control::SafetySetup<double>& f = setup.safety;
  f.stuck_torque =
      s.positive("faults", "stuck_torque_nm",
                 std::min(std::max(kHeldBeforeStuck * held_by_friction, kTorqueBeforeStuck * b.most_torque),
                          kMostTorqueChange * b.most_torque));
  // A coarse encoder needs longer to show that the shaft follows its torque.
  const double a_count_s = std::sqrt(2.0 * b.inertia * d.angle_base / setup.motor_counts / b.most_torque);
  f.stuck_s = s.positive("faults", "stuck_s", std::clamp(kCountsTimesBeforeStuck * a_count_s, f.stuck_s, 3.0), 3.0);
  const double by_counts = setup.output_counts != 0 ? kCountsBeforeStuck * d.angle_base / setup.output_counts : 0.0;
  f.output_stuck = s.positive("faults", "output_stuck_rad", std::max(kTorsionsBeforeStuck * d.torsion_base, by_counts),
                              100.0 * d.angle_base);
}

void take_faults(Settings& s, control::DriveSetup<double>& setup, const Basis& b, const ModelFacts& model,
                 const DriveConstants<double>& d) {
  const double largest_acceleration = 15.0 * d.acceleration_base;
  control::SafetySetup<double>& f = setup.safety;
  f.overspeed = s.positive("faults", "overspeed_rad_s", 1.09 * b.overspeed, 15.0 * d.velocity_base);
  f.overcurrent = s.positive("faults", "overcurrent_a", 1.2 * b.current);
  f.overtemperature = s.positive("faults", "overtemperature_c", 80.0);
  // A slow filter of the encoder shows less of a count that stops.
  const double shown_acceleration = kShownOfStop * setup.motor_corner * f.overspeed;
  f.acceleration = s.positive("faults", "acceleration_rad_s2",
                              std::min({10.0 * b.most_torque / b.inertia, largest_acceleration, shown_acceleration}),
                              largest_acceleration);
  take_stuck_encoder_faults(s, setup, b, model.held_by_friction, d);
  f.current_mismatch = s.positive("faults", "current_mismatch_a", 0.2 * b.current);
  f.mismatch_s = s.positive("faults", "mismatch_s", f.mismatch_s, 3.0);
  f.torque_same_s = s.positive("faults", "torque_same_s", f.torque_same_s, 3.0);
  f.standstill = s.positive("faults", "standstill_rad_s", 5e-3 * d.velocity_base);
  f.host_s = s.positive("faults", "host_s", f.host_s, control::kLongestHostSeconds);
  f.stop_s = s.positive("faults", "stop_s", f.stop_s, control::kLongestStopSeconds);
  // Twice where the position loop asks for all of the velocity: it no longer follows but catches up.
  const double farthest = 30'000.0 * d.angle_base;
  f.following_error = s.positive("faults", "following_error_rad",
                                 std::min(2.0 * b.velocity / setup.loops.position_gain, farthest), farthest);
  f.following_velocity = s.positive("faults", "following_velocity_rad_s", 0.75 * b.velocity, 15.0 * d.velocity_base);
  f.following_s = s.positive("faults", "following_s", f.following_s, 3.0);
}

}  // namespace

control::DriveSetup<double> parse_drive_setup(const std::string& toml, const std::string& origin,
                                              const catalogue::ResolvedModel& resolved, const DriveConstants<double>& d,
                                              std::optional<double> encoder_counts, const control::Hardware& hardware) {
  Settings s(toml, origin);
  s.require_no("output_encoder", hardware.output_encoder == control::SensorKind::none);
  s.require_no("torque_sensor", hardware.torque_sensor == control::SensorKind::none);
  control::DriveSetup<double> setup;
  setup.tick_hz = static_cast<std::uint32_t>(std::lround(1.0 / d.time_base));
  const ModelFacts model = facts_of(resolved, d);
  Basis b = basis_of(s, model, d, hardware);
  take_encoders(s, setup, encoder_counts, origin);
  b.stiffness = s.positive("feedforward", "stiffness_nm_rad", model.stiffness);
  if (setup.output_counts == 0) take_torsion_estimate(s, setup, b, model, d);
  take_loops(s, setup, b);
  take_trajectory(s, setup, b, d);
  take_feedforward(s, setup, b, model, d);
  take_analog_signals(s, setup, b, d, hardware);
  setup.residual_map = {.standstill_velocity = s.positive("residual_map", "standstill_rad_s", 2.5e-3 * d.velocity_base),
                        .largest_velocity = s.positive("residual_map", "largest_rad_s", b.velocity),
                        .largest_residual = s.positive("residual_map", "largest_nm", 0.25 * b.most_torque)};
  take_faults(s, setup, b, model, d);
  setup.excitation = excitation(s, d, setup.excites_torque, b.most_torque, b.velocity, b.overspeed);
  s.done();
  return setup;
}

control::DriveSettings<fixed::Fixed> settings_of(const control::DriveSetup<double>& setup,
                                                 const DriveConstants<double>& d, const std::string& origin) {
  fixed::OverflowLog::clear();
  const control::DriveSettings<fixed::Fixed> settings = control::derive<fixed::Fixed>(setup, d);
  if (fixed::OverflowLog::count() != 0)
    throw PackError(
        fmt::format("{}: the settings do not fit a drive with these ratings: {}", origin, fixed::OverflowLog::first()));
  for (const auto& [counts, corner, period] :
       {std::tuple{setup.motor_counts, setup.motor_corner, d.time_base},
        std::tuple{setup.output_counts, setup.output_corner, control::slow(d).time_base}})
    if (counts != 0 && !observers::kalman_bounds(observers::kalman_gains(corner * period)).fit)
      throw PackError(
          fmt::format("{}: the states of an encoder's filter leave their range; choose another corner than "
                      "{:g} Hz",
                      origin, corner / kTurn));
  require_reachable(settings, d, origin);
  return settings;
}

}  // namespace flexspline::deployment
