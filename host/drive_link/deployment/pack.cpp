#include "host/drive_link/deployment/pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/drive_effects.hpp"
#include "host/drive_link/deployment/error_proof.hpp"
#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/drive_link/deployment/maker.hpp"
#include "host/drive_link/deployment/note.hpp"
#include "host/drive_link/deployment/sha256.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/fixed/system.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/observers/encoder_kalman.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;
using fixed::Fixed;
using fixed::OverflowLog;

constexpr std::array<double, 4> kTorqueScales = {1.0, 2.0, 4.0, 8.0};
constexpr double kLargestValue = 16.0;  // bases that a value can hold
// Limits in bases: those of torque and current are the ratings, so that they hold where nothing else is known.
constexpr double kOverspeed = 1.25;
constexpr double kDirectionBand = 1.0 / 200.0;
constexpr double kTorsionLimit = 2.0;

// Throws PackError naming all parameters that have no value.
void require_values(const catalogue::ResolvedModel& model) {
  std::vector<std::string> missing;
  for (const catalogue::ResolvedEffect& e : model.effects)
    for (const std::string& name : catalogue::missing_values(*e.effect)) missing.push_back(e.effect->id + "." + name);
  if (!missing.empty())
    throw PackError(fmt::format("the model has no value for {}; identify it first", output::listed(missing)));
}

model::Name name_of(const std::string& text) {
  model::Name name{};
  std::size_t bytes = std::min(text.size(), name.size() - 1);
  // No character is cut in two.
  while (bytes < text.size() && bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xC0U) == 0x80U) --bytes;
  for (std::size_t i = 0; i < bytes; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    name[i] = byte < 0x20 || byte == 0x7F ? ' ' : text[i];
  }
  return name;
}

// `rated`: torque at the output.
model::BlockHeader header_of(const model::Model& model, double rated, const DriveConstants<double>& d,
                             const PackOptions& options) {
  model::BlockHeader h;
  h.drive = name_of(options.drive);
  h.model = name_of(model.name);
  h.axis = model.drive.axis == data::Axis::linear ? 1 : 0;
  h.encoder_counts = static_cast<std::uint32_t>(std::llround(options.encoder_counts.value_or(0.0)));
  h.bases = in_block(d);
  const auto value = [](double x) { return fixed::Value(Fixed::value(std::clamp(x, 1e-6, 2.0))); };
  h.limits.torque = value(std::max(rated / d.gear_ratio, d.torque_constant * d.current_base) / d.torque_base);
  h.limits.load = value(rated / d.output_torque_base);
  h.limits.velocity = value(1.0);
  h.limits.overspeed = value(kOverspeed);
  h.limits.current = value(1.0);
  h.limits.torsion = value(kTorsionLimit);
  h.limits.direction_band = value(kDirectionBand);
  return h;
}

// Adds the encoder filter to the block; what its states stay below.
ProofPart add_encoder_filter(model::BlockWriter& writer, const DriveConstants<double>& d, const PackOptions& options) {
  using observers::EncoderKalman;
  const double corner = kTurn * options.filter_corner_hz;
  OverflowLog::clear();
  const auto c = EncoderKalman::derive<Fixed>(observers::setup_for_corner(*options.encoder_counts, corner, d), d);
  const auto bounds = observers::kalman_bounds(observers::kalman_gains(corner * d.time_base));
  if (OverflowLog::count() != 0 || !bounds.fit)
    throw PackError(fmt::format("the encoder filter does not fit: {}; choose another corner than {:g} Hz",
                                OverflowLog::count() != 0 ? OverflowLog::first() : "its states leave their range",
                                options.filter_corner_hz));
  writer.add(static_cast<std::uint16_t>(model::Section::encoder_filter), c);
  return {"encoder_filter", "impulse_response", bounds.velocity * d.velocity_base,
          d.turn_angle_scale == 1.0 ? "rad/s" : "m/s"};
}

// What the states of both encoders' filters stay below.
void prove_filters(const control::DriveSetup<double>& setup, const DriveConstants<double>& d, Packed& packed) {
  const auto filter = [&](const char* name, double corner, double period, double base) {
    const auto bounds = observers::kalman_bounds(observers::kalman_gains(corner * period));
    packed.proof.push_back(
        {name, "impulse_response", bounds.velocity * base, d.turn_angle_scale == 1.0 ? "rad/s" : "m/s"});
  };
  filter("encoder_filter", setup.motor_corner, d.time_base, d.velocity_base);
  if (setup.output_counts != 0)
    filter("output_filter", setup.output_corner, control::slow(d).time_base, d.output_velocity_base);
}

struct ScaledModel {
  DriveConstants<double> drive;
  Bounds bounds;
};
// Widens the bases of torque until the proof holds.
ScaledModel proven(const std::vector<EffectValues>& effects, const DriveConstants<double>& bases, Packed& packed) {
  std::string reason;
  for (const double scale : kTorqueScales) {
    ScaledModel tried{widened(bases, scale), {}};
    try {
      tried.bounds = prove(effects, tried.drive);
    } catch (const PackError& error) {
      reason = error.what();
      continue;
    }
    packed.torque_scale = scale;
    if (tried.bounds.holds) return tried;
    reason = tried.bounds.reason;
  }
  throw PackError(reason + fmt::format(" (with torques up to {:g} times the rated one); check its parameters against "
                                       "the ratings in [drive]",
                                       kLargestValue * kTorqueScales.back()));
}

std::array<double, 3> torque_bases(const DriveConstants<double>& d) {
  return {d.torque_base, d.output_torque_base, d.output_torque_base};
}

void prove_parts(const std::vector<EffectValues>& effects, const ScaledModel& tried, const std::string& unit,
                 Packed& packed) {
  const auto bases = torque_bases(tried.drive);
  const auto entries = catalogue::all();
  for (std::size_t k = 0; k < effects.size(); ++k) {
    const EffectValues& e = effects[k];
    const auto entry = std::find_if(entries.begin(), entries.end(), [&](const auto& x) { return x.id == e.number; });
    double most = 0.0;
    for (std::size_t b = 0; b < bases.size(); ++b) most = std::max(most, tried.bounds.alone[k][b] * bases[b]);
    packed.proof.push_back({e.id, entry != entries.end() && entry->has_state ? "invariant" : "interval", most, unit});
  }
  for (std::size_t b = 0; b < bases.size(); ++b)
    packed.proof.push_back({fmt::format("{}_balance", kBalances[b]), "range", tried.bounds.torque[b] * bases[b], unit});
}

// What an error means on each balance: at the motor, rated torque is that of the output over the gear ratio.
struct Scale {
  std::array<double, 3> bases;
  std::array<double, 3> rated;
  std::string unit;
  // The balance on which an error in bases is the largest share of rated torque, that share, and it in N m.
  struct Worst {
    std::size_t balance = 0;
    double share = 0.0;
    double torque = 0.0;
  };
  Worst worst(const std::array<double, 3>& error) const {
    Worst all;
    for (std::size_t b = 0; b < bases.size(); ++b)
      if (const double share = error[b] * bases[b] / rated[b]; share >= all.share)
        all = {b, share, error[b] * bases[b]};
    return all;
  }
};

void measure_error(const Difference& d, const PackOptions& options, const Scale& scale,
                   const std::array<double, 3>& folding_error, Packed& packed) {
  if (!d.finding.empty() || !d.within)
    throw PackError(fmt::format("the proof does not hold on a sample: {}",
                                d.finding.empty() ? "a torque is beyond its bound" : d.finding));
  for (std::size_t b = 0; b < scale.bases.size(); ++b) {
    const double error = d.worst[b] * scale.bases[b] + folding_error[b];
    packed.proof.push_back({fmt::format("{}_balance", kBalances[b]), "measured_error", error, scale.unit});
    if (error / scale.rated[b] < packed.max_error_share_of_rated) continue;
    packed.max_error_share_of_rated = error / scale.rated[b];
    packed.max_error_nm = error;
    packed.worst_balance = kBalances[b];
  }
  if (packed.max_error_share_of_rated > options.bound)
    throw BoundError(fmt::format(
        "the block is off by {:.2g} of rated torque on the {} balance, more than {:.2g}; the "
        "model's torques are far above the ratings in [drive], effects were folded into tables, or --bound is "
        "too small",
        packed.max_error_share_of_rated, packed.worst_balance, options.bound));
}

// The proof of the error, by parts, with the measured error of each.
void prove_errors(const DriveEffects& run, const ScaledModel& tried, const Difference& measured,
                  const PackOptions& options, const Scale& scale, Packed& packed) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  ErrorProof proof = prove_error(run.effects, tried.drive);
  for (ErrorPart& part : proof.parts)
    for (const DriveEffects::Folded& fold : run.folded)
      if (fold.id == part.id)
        part.unproven = "it was folded into a table, and what that is off between its points is measured";
  std::string why;
  for (std::size_t e = 0; e < proof.parts.size(); ++e) {
    const ErrorPart& part = proof.parts[e];
    const auto worst = scale.worst(part.bound);
    const bool proven = part.unproven.empty();
    packed.proof.push_back({part.id, "error", proven ? worst.torque : kNone, scale.unit, proven ? worst.share : kNone,
                            scale.worst(measured.parts[e]).torque, part.unproven});
    if (!proven && why.empty()) why = fmt::format("{}: {}", part.id, part.unproven);
  }
  packed.error_is_proven = why.empty();
  for (std::size_t b = 0; b < scale.bases.size(); ++b) {
    const double bound = why.empty() ? proof.sum[b] * scale.bases[b] : kNone;
    packed.proof.push_back({fmt::format("{}_balance", kBalances[b]), "error", bound, scale.unit, bound / scale.rated[b],
                            measured.worst[b] * scale.bases[b], why});
  }
  packed.error_bound_share_of_rated = why.empty() ? scale.worst(proof.sum).share : kNone;
  if (!why.empty() && !options.measured)
    throw UnprovenError(
        fmt::format("how far the drive is from double cannot be proven for {}; give --measured to go by the "
                    "largest error along {} samples, {:.2g} of rated torque, or take it out of the model",
                    why, options.samples, packed.max_error_share_of_rated));
}

}  // namespace

Packed pack(const model::Model& model, const PackOptions& options) {
  if (!(options.tick_hz >= 1.0 && options.tick_hz <= 1e6))
    throw PackError(fmt::format("a tick of {:g} Hz is not between 1 Hz and 1 MHz", options.tick_hz));
  if (options.encoder_counts && !(*options.encoder_counts >= 4.0 && *options.encoder_counts <= 0x1p30))
    throw PackError("encoder counts are not between 4 and 2^30 a turn");
  const catalogue::ResolvedModel resolved = model;
  require_values(resolved);
  const DriveConstants<double> bases = bases_of(resolved, 1.0 / options.tick_hz);
  const DriveEffects run = drive_effects(resolved, options.image, bases);
  const std::vector<EffectValues>& effects = run.effects;
  const std::string unit = model.drive.axis == data::Axis::linear ? "N" : "N*m";
  Packed packed;
  const ScaledModel tried = proven(effects, bases, packed);
  prove_parts(effects, tried, unit, packed);
  for (const DriveEffects::Folded& fold : run.folded)
    packed.proof.push_back({fold.id, "interpolation", fold.error, unit});
  const double rated = rated_output_torque(model.drive);
  const Scale scale{torque_bases(tried.drive), {rated / tried.drive.gear_ratio, rated, rated}, unit};
  const Difference measured = compare(effects, tried.drive, tried.bounds, options.samples, options.seed);
  measure_error(measured, options, scale, run.folding_error, packed);
  prove_errors(run, tried, measured, options, scale, packed);

  packed.bytes.resize(model::kLargestBlock);
  model::BlockHeader header = header_of(model, rated, tried.drive, options);
  std::optional<control::DriveSetup<double>> setup;
  if (options.settings) {
    setup = parse_drive_setup(*options.settings, options.settings_origin, resolved, tried.drive, options.encoder_counts,
                              options.hardware);
    header.encoder_counts = setup->motor_counts;
  }
  model::BlockWriter writer(packed.bytes);
  writer.begin(header);
  write_effects(writer, effects, tried.drive);
  if (setup) {
    control::add_settings(writer, settings_of(*setup, tried.drive, options.settings_origin));
    prove_filters(*setup, tried.drive, packed);
  } else if (options.encoder_counts) {
    packed.proof.push_back(add_encoder_filter(writer, tried.drive, options));
  }
  writer.add_bytes(model::kParametersNote, note_of(model.drive, effects));
  writer.add_bytes(kMakerNote, maker_note());
  const std::size_t size = writer.end();
  if (size == 0) throw PackError(fmt::format("the block is larger than {} bytes", model::kLargestBlock));
  packed.bytes.resize(size);
  packed.sha256 = sha256(packed.bytes);
  // What is handed out was read by what the drive reads it with.
  static_cast<void>(unpack(packed.bytes));
  return packed;
}

}  // namespace flexspline::deployment
