// The contents of a parameter block in addition to the model: the sections, the place of each in DriveSettings, the
// bounds of each field, and the checks. The host, a drive that receives a block and a drive that starts use the same
// validator. Integers only; the use of the stack does not grow with the block.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "shared/control/drive_parameters.hpp"
#include "shared/control/hardware.hpp"
#include "shared/control/motor_settings.hpp"
#include "shared/control/reachable.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block.hpp"

namespace flexspline::control {

namespace detail {
using Numbers = fixed::Fixed;
using Settings = DriveSettings<Numbers>;
using model::Section;

struct SectionValues;
using MotorCheck = bool (*)(model::FieldReader&, SectionValues&);

// Checks across sections: which ones are required, and whether signals can reach their limits.
struct SectionValues {
  GeneralSettings general{};
  Limited limited{};
  Stated stated{};
  std::uint32_t motor_counts = 0;
  std::uint32_t output_counts = 0;
  StoredZero zero{};
  std::uint32_t motor_counts_of_stage = 0;  // zero: the block has no motor section
  MotorCheck check_motor = nullptr;         // none: what is in that section is passed over
};
// What a drive without a three-phase stage has no code for.
inline bool check_motor(model::FieldReader& reader, SectionValues& values) {
  MotorSettings motor;
  motor.fields(reader);
  values.motor_counts_of_stage = motor.encoder_counts;
  return reader.verdict().fault == model::FieldFault::none && agrees(motor);
}

template <class Base, class Derived>
constexpr auto& base_of(Derived& settings) {
  return static_cast<std::conditional_t<std::is_const_v<Derived>, const Base, Base>&>(settings);
}

// One struct for each section: its data, their place in the settings, and the check of several fields. `agrees` also
// keeps what is compared with other sections.
template <Section kSection, class T>
struct SectionOf {
  static constexpr Section kKind = kSection;
  using Data = T;
  static bool agrees(const T&, SectionValues&) { return true; }
};

struct GeneralSection : SectionOf<Section::general, GeneralSettings> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings); }
  static bool agrees(const Data& c, SectionValues& values) {
    values.general = c;
    return true;
  }
};
// per_count is 2^56 over the counts, rounded.
inline bool encoder_agrees(const observers::EncoderAngle::Coefficients& c) {
  if ((c.per_count >> 32) * c.counts > (std::uint64_t{1} << 24)) return false;  // the product below would not fit
  const auto off = static_cast<std::int64_t>(c.per_count * c.counts - (std::uint64_t{1} << 56));
  return fixed::size_of(off) <= c.counts / 2 + 1;
}
struct MotorEncoderSection : SectionOf<Section::motor_encoder, observers::EncoderAngle::Coefficients> {
  static constexpr auto& data(auto& settings) { return settings.motor_encoder; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.motor_counts = c.counts;
    return encoder_agrees(c);
  }
};
struct OutputEncoderSection : SectionOf<Section::output_encoder, observers::EncoderAngle::Coefficients> {
  static constexpr auto& data(auto& settings) { return settings.output_encoder; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.output_counts = c.counts;
    return encoder_agrees(c);
  }
};
struct EncoderFilterSection : SectionOf<Section::encoder_filter, observers::EncoderKalman::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.motor_motion; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.limited.acceleration_scale = c.acceleration_scale;
    return true;
  }
};
struct OutputFilterSection : SectionOf<Section::output_filter, observers::EncoderKalman::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.output_motion; }
};
struct DisturbanceSection : SectionOf<Section::disturbance, observers::DisturbanceObserver::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.disturbance; }
};
struct TorsionSection : SectionOf<Section::torsion, TorsionSettings<Numbers>> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings); }
};
struct RippleSection : SectionOf<Section::torque_ripple_filter, observers::RippleFilter::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.ripple; }
};
struct SensorSection : SectionOf<Section::sensors, SensorSettings<Numbers>> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings); }
  static bool agrees(const Data& c, SectionValues& values) {
    values.limited.current = values.stated.current = c.current;
    values.stated.torque = c.torque;
    values.limited.temperature = values.stated.temperature = c.temperature;
    values.stated.amplifier = c.amplifier;
    return is_scale(c.current) && is_scale(c.torque) && is_scale(c.temperature);
  }
  // A missing sensor has zeros.
  static bool is_scale(const AnalogScale<Numbers>& scale) {
    return scale.lowest < scale.highest || (scale.gain.mantissa == 0 && scale.lowest == scale.highest);
  }
};
struct LoopsSection : SectionOf<Section::loops, Loops::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.loops; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.limited.velocity_limit = c.velocity_limit;
    values.limited.torque_limit = c.torque_limit;
    values.limited.current_limit = c.current_limit;
    return c.velocity_limit < c.guard.overspeed;
  }
};
struct TrajectorySection : SectionOf<Section::trajectory, SetPointSettings<Numbers>> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings); }
  // The stopping distance, at most v (v/A + 5) + 4 A, fits.
  static bool agrees(const Data& set_points, SectionValues&) {
    const auto& c = set_points.trajectory;
    // The largest velocity in whole multiples of A.
    const std::int64_t steps = Trajectory::moving(c, 0, c.velocity).steps;
    constexpr int kMost = Trajectory::kMostDistanceBits;
    const auto v = static_cast<std::uint64_t>(c.velocity), n = static_cast<std::uint64_t>(steps) + 5;
    if (std::countl_zero(v) + std::countl_zero(n) < 127 - kMost) return false;
    return c.lowest <= c.highest && v * n + 4 * static_cast<std::uint64_t>(c.change) < (std::uint64_t{1} << kMost);
  }
};
struct FeedforwardSection : SectionOf<Section::feedforward, Feedforward::Coefficients<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.feedforward; }
};
struct ExcitationSection : SectionOf<Section::excitation, Excitation::Waveform<Numbers>> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings.excitation); }
  static bool agrees(const Data& c, SectionValues&) { return Excitation::is_valid<Numbers>(c); }
};
// Up to kMostLines lines, one after the other.
struct ExcitationLinesSection : SectionOf<Section::excitation_lines, Excitation::DriveLine<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.excitation.lines; }
};
struct SafetySection : SectionOf<Section::safety, SafetyLimits<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.safety; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.limited.safety = c;
    return true;
  }
};
struct FollowingSection : SectionOf<Section::following, FollowingLimits<Numbers>> {
  static constexpr auto& data(auto& settings) { return settings.following; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.limited.following_velocity = c.velocity;
    return true;
  }
};
struct RateSection : SectionOf<Section::rates, RateSettings> {
  static constexpr auto& data(auto& settings) { return base_of<Data>(settings); }
};
struct ResidualMapSection : SectionOf<Section::residual_map, ResidualMap::Coefficients> {
  static constexpr auto& data(auto& settings) { return settings.residual_map; }
  static bool agrees(const Data& c, SectionValues&) {
    for (std::size_t i = 1; i < c.edges.size(); ++i)
      if (c.edges[i] <= c.edges[i - 1]) return false;
    return true;
  }
};

struct StoredZeroSection : SectionOf<Section::stored_zero, StoredZero> {
  static constexpr auto& data(auto& settings) { return settings.zero; }
  static bool agrees(const Data& c, SectionValues& values) {
    values.zero = c;
    return true;
  }
};
// Not among the settings of the tick: the three-phase stage, where a board has one, reads it from the block.
struct MotorSection : SectionOf<Section::motor, MotorSettings> {};
// Of other counts a turn: the encoder is another one.
constexpr bool zero_agrees(const StoredZero::Place& zero, std::uint32_t counts) {
  return zero.counts == 0 ? zero == StoredZero::Place{} : zero.counts == counts && zero.reading < counts;
}
// A counter that begins at its angle at power-on has no reading that could be stored.
constexpr bool zero_agrees(const StoredZero::Place& zero, SensorKind encoder) {
  if (zero.counts == 0 || encoder == SensorKind::not_stated) return true;
  return zero.kind == static_cast<std::uint32_t>(encoder) &&
         (encoder == SensorKind::absolute || encoder == SensorKind::indexed);
}

// In the order in which they are written.
using Sections =
    std::tuple<GeneralSection, MotorEncoderSection, OutputEncoderSection, EncoderFilterSection, OutputFilterSection,
               DisturbanceSection, TorsionSection, RippleSection, SensorSection, LoopsSection, TrajectorySection,
               FeedforwardSection, ExcitationSection, ExcitationLinesSection, SafetySection, FollowingSection,
               ResidualMapSection, StoredZeroSection, RateSection, MotorSection>;
template <std::size_t I, class Visit>
constexpr void visit_section(Visit& visit) {
  visit(std::tuple_element_t<I, Sections>{});
}
template <class Visit, std::size_t... I>
constexpr void visit_sections(Visit& visit, std::index_sequence<I...>) {
  (visit_section<I>(visit), ...);
}
inline constexpr std::size_t kSectionCount = std::tuple_size_v<Sections>;
static_assert(kSectionCount <= 32);
// Calls visit(Section{}) for each.
template <class Visit>
constexpr void for_each_section(Visit&& visit) {
  visit_sections(visit, std::make_index_sequence<kSectionCount>{});
}

consteval std::uint32_t bits_of(std::initializer_list<Section> sections) {
  std::uint32_t bits = 0, bit = 1;
  for_each_section([&]<class S>(S) {
    for (const Section section : sections)
      if (S::kKind == section) bits |= bit;
    bit <<= 1;
  });
  return bits;
}
inline constexpr std::uint32_t kAlways =
    bits_of({Section::general, Section::motor_encoder, Section::encoder_filter, Section::disturbance, Section::sensors,
             Section::loops, Section::trajectory, Section::feedforward, Section::safety, Section::residual_map});
inline constexpr std::uint32_t kWithOutputEncoder = bits_of({Section::output_encoder, Section::output_filter});
inline constexpr std::uint32_t kWithoutOutputEncoder = bits_of({Section::torsion});
inline constexpr std::uint32_t kWithTorqueSensor = bits_of({Section::torque_ripple_filter});

// Reads sections into the settings, or checks them alone where there are none.
class SectionReader {
 public:
  explicit SectionReader(Settings* settings, MotorCheck motor = nullptr) : settings_(settings) {
    values.check_motor = motor;
  }
  model::BlockVerdict take(std::uint32_t kind, std::span<const std::uint8_t> bytes) {
    std::uint32_t bit = 1;
    for (const Known& section : kKnown) {
      if (static_cast<std::uint32_t>(section.kind) != kind) {
        bit <<= 1;
        continue;
      }
      if ((seen & bit) != 0) return {model::BlockFault::too_often};
      seen |= bit;
      model::FieldReader reader(bytes);
      const bool agrees = section.take(reader, settings_, values);
      const model::FieldVerdict v = reader.verdict();
      if (v.fault == model::FieldFault::none && !agrees) return {model::BlockFault::unlike_coefficients};
      return model::detail::verdict_of(v);
    }
    return {model::BlockFault::unknown_entry};
  }

  std::uint32_t seen = 0;  // sections that were found, by their place
  SectionValues values;

 private:
  struct Known {
    Section kind;
    bool (*take)(model::FieldReader&, Settings*, SectionValues&);
  };
  template <class S>
  static bool take_one(model::FieldReader& reader, Settings* settings, SectionValues& values) {
    typename S::Data checked{};
    auto& data = settings != nullptr ? S::data(*settings) : checked;
    data.fields(reader);
    return reader.verdict().fault == model::FieldFault::none && S::agrees(data, values);
  }
  static bool take_motor(model::FieldReader& reader, Settings*, SectionValues& values) {
    if (values.check_motor != nullptr) return values.check_motor(reader, values);
    reader.skip();
    return true;
  }
  static bool take_lines(model::FieldReader& reader, Settings* settings, SectionValues&) {
    for (std::size_t i = 0; i < kMostLines && (i == 0 || reader.left() > 0) && reader.good(); ++i) {
      ExcitationLinesSection::Data line;
      line.fields(reader);
      if (settings != nullptr) settings->excitation.lines[i] = line;
    }
    return true;
  }
  static constexpr auto kKnown = [] {
    std::array<Known, kSectionCount> known{};
    std::size_t i = 0;
    for_each_section([&]<class S>(S) {
      if constexpr (std::is_same_v<S, ExcitationLinesSection>) {
        known[i++] = {S::kKind, &take_lines};
      } else if constexpr (std::is_same_v<S, MotorSection>) {
        known[i++] = {S::kKind, &take_motor};
      } else {
        known[i++] = {S::kKind, &take_one<S>};
      }
    });
    return known;
  }();

  Settings* settings_;
};
}  // namespace detail

// Checks a block for a simulation on the host: valid without the drive's sections as well. Fills a model, if there is
// one.
template <class Model>
model::BlockVerdict load(std::span<const std::uint8_t> block, Model& model) {
  detail::SectionReader sections(nullptr, &detail::check_motor);
  model.clear();
  const model::BlockVerdict verdict = model::read_block(block, &model, sections);
  model.note_effects();
  return verdict;
}

// For a drive with a three-phase stage, and for hosts. A drive without one passes over the motor's section.
using MotorCheck = detail::MotorCheck;
inline constexpr MotorCheck kChecksMotor = &detail::check_motor, kHasNoStage = nullptr;

// Checks a whole block for a drive of this tick rate and board, in place, in flash or in memory; nothing is written. A
// board that states nothing accepts any block. Returns the first fault.
template <class Model = decltype(DriveParameters<fixed::Fixed>::model)>
model::BlockVerdict check_for_drive(std::span<const std::uint8_t> block, std::uint32_t tick_hz,
                                    const Hardware& hardware = {}, MotorCheck motor = kChecksMotor) {
  detail::SectionReader sections(nullptr, motor);
  const model::BlockVerdict v = model::read_block<Model>(block, nullptr, sections);
  if (!v.good()) return v;
  detail::SectionValues& values = sections.values;
  const GeneralSettings& general = values.general;
  std::uint32_t needed = detail::kAlways;
  needed |= general.has_output_encoder ? detail::kWithOutputEncoder : detail::kWithoutOutputEncoder;
  if (general.has_torque_sensor) needed |= detail::kWithTorqueSensor;
  if ((needed & ~sections.seen) != 0) return {model::BlockFault::missing_section};
  if (general.tick_hz != tick_hz) return {model::BlockFault::other_tick_rate};
  values.limited.tick_hz = tick_hz;
  if (unreachable(values.limited) != Limit::none) return {model::BlockFault::unreachable_limit};
  if (values.motor_counts_of_stage != 0 && values.motor_counts_of_stage != values.motor_counts)
    return {model::BlockFault::unlike_coefficients};
  const StoredZero& zero = values.zero;
  if (!detail::zero_agrees(zero.motor, values.motor_counts) || !detail::zero_agrees(zero.output, values.output_counts))
    return {model::BlockFault::unlike_coefficients};
  if (!detail::zero_agrees(zero.motor, hardware.motor_encoder) ||
      !detail::zero_agrees(zero.output, hardware.output_encoder))
    return {model::BlockFault::other_hardware};
  Stated& stated = values.stated;
  stated.current_limit = values.limited.current_limit;
  stated.has_output_encoder = general.has_output_encoder;
  stated.has_torque_sensor = general.has_torque_sensor;
  stated.current_base = model::base_at(block, model::kCurrentBase);
  stated.torque_base = model::base_at(block, model::kOutputTorqueBase);
  stated.temperature_base = model::base_at(block, model::kTemperatureBase);
  if (disagreement(stated, hardware) != Disagreement::none) return {model::BlockFault::other_hardware};
  return {};
}
// The motor of a block that was found valid; without pole pairs where it has none.
inline MotorSettings motor_of(std::span<const std::uint8_t> block) {
  MotorSettings motor;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != static_cast<std::uint16_t>(model::Section::motor)) return;
    model::FieldReader reader(bytes);
    motor.fields(reader);
  });
  return motor;
}
// Fills parameters from a block that was found valid; the model is at rest afterwards.
template <class Parameters>
void load_for_drive(std::span<const std::uint8_t> block, Parameters& parameters) {
  // Missing sections are zeros, and there is no effect that the block does not have.
  detail::Settings& settings = parameters;
  static_assert(std::is_trivially_copyable_v<detail::Settings>);
  std::memset(static_cast<void*>(&settings), 0, sizeof(settings));
  parameters.model.clear();
  detail::SectionReader sections(&settings);
  model::read_block(block, &parameters.model, sections);
  parameters.model.note_effects();
}

// Host only: adds all sections that these settings need to a block.
inline void add_settings(model::BlockWriter& writer, const DriveSettings<fixed::Fixed>& settings) {
  std::uint32_t required = detail::kAlways;
  required |= settings.has_output_encoder ? detail::kWithOutputEncoder : detail::kWithoutOutputEncoder;
  if (settings.has_torque_sensor) required |= detail::kWithTorqueSensor;
  if (settings.following.ticks > 0) required |= detail::bits_of({model::Section::following});
  if (settings.zero != StoredZero{}) required |= detail::bits_of({model::Section::stored_zero});
  if (settings.has_slow_rates) required |= detail::bits_of({model::Section::rates});
  if (settings.excitation.ticks > 0) {
    required |= detail::bits_of({model::Section::excitation});
    if (settings.excitation.line_count > 0) required |= detail::bits_of({model::Section::excitation_lines});
  }
  std::uint32_t bit = 1;
  detail::for_each_section([&]<class S>(S) {
    const bool is_required = (required & bit) != 0;
    bit <<= 1;
    if (!is_required) return;
    const auto kind = static_cast<std::uint16_t>(S::kKind);
    if constexpr (std::is_same_v<S, detail::ExcitationLinesSection>) {
      writer.add(kind, std::span(S::data(settings)).first(settings.excitation.line_count));
    } else if constexpr (!std::is_same_v<S, detail::MotorSection>) {
      writer.add(kind, S::data(settings));
    }
  });
}

}  // namespace flexspline::control
