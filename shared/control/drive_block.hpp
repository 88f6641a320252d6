// What a drive needs of a parameter block beside its model: the sections, where each goes in DriveSettings, the bounds
// of each field, and the checks that one validator makes for the host, for a drive that is sent a block, and for a
// drive that starts. Integers only; nothing is kept on the stack that grows with the block.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "shared/control/drive_parameters.hpp"
#include "shared/control/hardware.hpp"
#include "shared/control/reachable.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block_places.hpp"

namespace flexspline::control {

namespace detail {
using Numbers = fixed::Fixed;
using Settings = DriveSettings<Numbers>;
using model::Field;
using model::Row;

// The row of a struct with narrower bounds than its types have: as many bytes at the same places, else it is refused to
// compile.
template <class T>
consteval Row row_for(const Row& row) {
  if (model::size_in_memory(row) != sizeof(T)) __builtin_abort();
  return row;
}

// As DriveSettings begins.
struct General {
  std::uint32_t tick_hz = 0;
  bool has_output_encoder = false;
  bool has_torque_sensor = false;
  bool excites_torque = false;
};
inline constexpr Row kGeneral = row_for<General>(Row{}.add(Field::tick_rate).add(Field::flag, 3));
inline constexpr Row kEncoder =
    row_for<observers::EncoderAngle::Coefficients>(Row{}.add(Field::counts).add(Field::share));
inline constexpr Row kEncoderFilter = model::row_of<observers::EncoderKalman::Coefficients<Numbers>>();
inline constexpr Row kDisturbance = row_for<observers::DisturbanceObserver::Coefficients<Numbers>>(
    Row{}.add(Field::gain).add(Field::share).add(Field::limit));
inline constexpr Row kTorsion =
    model::row_of<observers::TorsionObserver::Coefficients<Numbers>>().add(Field::order).add(Field::gain, 2);
inline constexpr Row kRipple = row_for<observers::RippleFilter::Coefficients<Numbers>>(
    Row{}.add(Field::step_gain).add(Field::order).add(Field::limit).add(Field::unsigned_one, 2));
inline constexpr Row kAnalog =
    row_for<AnalogScale<Numbers>>(Row{}.add(Field::gain).add(Field::word).add(Field::share_of_converter, 2));
// Three analogue inputs, the torque of a current, the amplifier.
inline constexpr Row kSensors = Row{}.add(kAnalog).add(kAnalog).add(kAnalog).add(Field::gain, 2);
inline constexpr Row kGuard =
    row_for<SpeedGuard::Coefficients<Numbers>>(Row{}.add(Field::limit, 2).add(Field::positive).add(Field::gain));
inline constexpr Row kLoops = row_for<Loops::Coefficients<Numbers>>(Row{}
                                                                        .add(Field::distance_gain)
                                                                        .add(Field::gain)
                                                                        .add(Field::share)
                                                                        .add(Field::limit)
                                                                        .add(Field::positive)
                                                                        .add(Field::limit)
                                                                        .add(Field::positive)
                                                                        .add(kGuard)
                                                                        .add(Field::gain)
                                                                        .add(Field::limit));
// The trajectory and, behind it, the stream.
inline constexpr Row kTrajectory =
    Row{}.add(Field::position, 2).add(Field::speed, 2).add(Field::distance_gain, 2).add(Field::factor, 2);
inline constexpr Row kFeedforward = row_for<Feedforward::Coefficients<Numbers>>(Row{}
                                                                                    .add(Field::gain, 3)
                                                                                    .add(Field::order)
                                                                                    .add(Field::wide)
                                                                                    .add(Field::gain)
                                                                                    .add(Field::limit, 2)
                                                                                    .add(Field::flag)
                                                                                    .add(Field::gain)
                                                                                    .add(Field::word, 2)
                                                                                    .add(Field::flag)
                                                                                    .add(Field::ratio_gain)
                                                                                    .add(Field::word, 3)
                                                                                    .add(Field::gain)
                                                                                    .add(Field::step_gain));
// Its guard is nought where it is not guarded.
inline constexpr Row kExcitation = Row{}
                                       .add(Field::shape)
                                       .add(Field::flag)
                                       .add(Field::lines)
                                       .add(Field::wide, 2)
                                       .add(Field::ticks_or_none, 2)
                                       .add(Field::share)
                                       .add(Field::limit)
                                       .add(Field::wide)
                                       .add(Field::word, 6)
                                       .add(Field::gain);
static_assert(model::size_in_memory(kExcitation) ==
              model::detail::aligned(offsetof(Excitation::Coefficients<Numbers>, lines), 8));
// So far from one member to the next as rows say that go over several.
inline constexpr std::size_t kAmplifierAt = offsetof(Settings, amplifier) - offsetof(Settings, current);
static_assert(offsetof(Settings, amplifier) - offsetof(Settings, current) + sizeof(Numbers::Gain) ==
              model::size_in_memory(kSensors));
static_assert(offsetof(Settings, output_of_velocity) - offsetof(Settings, torsion) + sizeof(Numbers::Gain) ==
              model::size_in_memory(kTorsion));
static_assert(offsetof(Settings, stream) - offsetof(Settings, trajectory) + sizeof(Stream::Coefficients) ==
              model::size_in_memory(kTrajectory));
static_assert(offsetof(Settings, tick_hz) == 0 &&
              offsetof(Settings, excites_torque) == offsetof(General, excites_torque));
inline constexpr Row kLine =
    row_for<Excitation::DriveLine<Numbers>>(Row{}.add(Field::harmonics).add(Field::number).add(Field::gain));
inline constexpr Row kSafety = row_for<SafetyLimits<Numbers>>(
    Row{}.add(Field::positive, 7).add(Field::ticks, 3).add(Field::short_ticks, 2).add(Field::short_ticks_or_none));
inline constexpr Row kFollowing = row_for<FollowingLimits<Numbers>>(
    Row{}.add(Field::speed).add(Field::positive).add(Field::ticks_or_none, 2).add(Field::short_ticks));
inline constexpr Row kResidualMap =
    row_for<ResidualMap::Coefficients>(Row{}.add(Field::positive, 7).add(Field::factor));

// What fields cannot say each by itself.

// What sections have to do with one another: which others there have to be, and which limits what can reach.
struct Noted {
  General general{};
  Limited limited{};
  Stated stated{};
};
inline bool note_general(const void* section, void* context) {
  if (context != nullptr) static_cast<Noted*>(context)->general = *static_cast<const General*>(section);
  return true;
}
inline bool note_filter(const void* section, void* context) {
  const auto& c = *static_cast<const observers::EncoderKalman::Coefficients<Numbers>*>(section);
  if (context != nullptr) static_cast<Noted*>(context)->limited.acceleration_scale = c.acceleration_scale;
  return true;
}
inline bool note_safety(const void* section, void* context) {
  if (context != nullptr)
    static_cast<Noted*>(context)->limited.safety = *static_cast<const SafetyLimits<Numbers>*>(section);
  return true;
}
inline bool note_following(const void* section, void* context) {
  const auto& c = *static_cast<const FollowingLimits<Numbers>*>(section);
  if (context != nullptr) static_cast<Noted*>(context)->limited.following_velocity = c.velocity;
  return true;
}
// per_count is 2^56 over the counts, rounded.
inline bool encoder_agrees(const void* section, void*) {
  const auto& c = *static_cast<const observers::EncoderAngle::Coefficients*>(section);
  if ((c.per_count >> 32) * c.counts > (std::uint64_t{1} << 24)) return false;  // the product below would not fit
  const auto off = static_cast<std::int64_t>(c.per_count * c.counts - (std::uint64_t{1} << 56));
  return fixed::size_of(off) <= c.counts / 2 + 1;
}
inline bool sensors_agree(const void* section, void* context) {
  const auto* const scales = static_cast<const AnalogScale<Numbers>*>(section);
  if (context != nullptr) {
    auto& noted = *static_cast<Noted*>(context);
    noted.limited.current = noted.stated.current = scales[0];
    noted.stated.torque = scales[1];
    noted.limited.temperature = noted.stated.temperature = scales[2];
    noted.stated.amplifier =
        *reinterpret_cast<const Numbers::Gain*>(static_cast<const std::byte*>(section) + kAmplifierAt);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& scale = scales[i];
    const bool unused = scale.gain.mantissa == 0 && scale.lowest == scale.highest;
    if (scale.lowest >= scale.highest && !unused) return false;
  }
  return true;
}
inline bool loops_agree(const void* section, void* context) {
  const auto& c = *static_cast<const Loops::Coefficients<Numbers>*>(section);
  if (context != nullptr) {
    Limited& limited = static_cast<Noted*>(context)->limited;
    limited.velocity_limit = c.velocity_limit;
    limited.torque_limit = c.torque_limit;
    limited.current_limit = c.current_limit;
  }
  return c.velocity_limit < c.guard.overspeed;
}
// The room to stop in, at most v (v/A + 5) + 4 A, fits.
inline bool trajectory_agrees(const void* section, void*) {
  const auto& c = *static_cast<const Trajectory::Coefficients<Numbers>*>(section);
  // As many whole A as there are in the largest velocity.
  const std::int64_t steps = Trajectory::moving(c, 0, c.velocity).steps;
  constexpr int kMost = Trajectory::kMostDistanceBits;
  const auto v = static_cast<std::uint64_t>(c.velocity), n = static_cast<std::uint64_t>(steps) + 5;
  if (std::countl_zero(v) + std::countl_zero(n) < 127 - kMost) return false;
  return c.lowest <= c.highest && v * n + 4 * static_cast<std::uint64_t>(c.change) < (std::uint64_t{1} << kMost);
}
inline bool excitation_agrees(const void* section, void*) {
  const auto& c = *static_cast<const Excitation::Coefficients<Numbers>*>(section);
  const auto positive = [](Numbers::Value x) { return x > Numbers::Value{}; };
  const auto& g = c.guard;
  if (c.guarded && !(positive(g.torque_limit) && positive(g.overspeed) && positive(g.largest_velocity))) return false;
  return c.fade_ticks <= c.ticks / 2 && c.limiter.rate.raw > 0;
}
inline bool residual_map_agrees(const void* section, void*) {
  const auto& c = *static_cast<const ResidualMap::Coefficients*>(section);
  for (std::size_t i = 1; i < c.edges.size(); ++i)
    if (c.edges[i] <= c.edges[i - 1]) return false;
  return true;
}

struct SectionPlan {
  model::Section kind;
  std::size_t at;
  Row row;
  bool (*agrees)(const void* section, void* context);
  std::uint8_t times;
};
using model::Section;
inline constexpr SectionPlan kSections[] = {
    {Section::general, 0, kGeneral, &note_general, 1},
    {Section::motor_encoder, offsetof(Settings, motor_encoder), kEncoder, &encoder_agrees, 1},
    {Section::output_encoder, offsetof(Settings, output_encoder), kEncoder, &encoder_agrees, 1},
    {Section::encoder_filter, offsetof(Settings, motor_motion), kEncoderFilter, &note_filter, 1},
    {Section::output_filter, offsetof(Settings, output_motion), kEncoderFilter, nullptr, 1},
    {Section::disturbance, offsetof(Settings, disturbance), kDisturbance, nullptr, 1},
    {Section::torsion, offsetof(Settings, torsion), kTorsion, nullptr, 1},
    {Section::torque_ripple_filter, offsetof(Settings, ripple), kRipple, nullptr, 1},
    {Section::sensors, offsetof(Settings, current), kSensors, &sensors_agree, 1},
    {Section::loops, offsetof(Settings, loops), kLoops, &loops_agree, 1},
    {Section::trajectory, offsetof(Settings, trajectory), kTrajectory, &trajectory_agrees, 1},
    {Section::feedforward, offsetof(Settings, feedforward), kFeedforward, nullptr, 1},
    {Section::excitation, offsetof(Settings, excitation), kExcitation, &excitation_agrees, 1},
    {Section::excitation_lines, offsetof(Settings, excitation.lines), kLine, nullptr, kMostLines},
    {Section::safety, offsetof(Settings, safety), kSafety, &note_safety, 1},
    {Section::following, offsetof(Settings, following), kFollowing, &note_following, 1},
    {Section::residual_map, offsetof(Settings, residual_map), kResidualMap, &residual_map_agrees, 1},
};
inline constexpr std::size_t kSectionCount = std::size(kSections);

consteval std::uint32_t bits_of(std::initializer_list<Section> sections) {
  std::uint32_t bits = 0;
  for (const Section section : sections)
    for (std::size_t i = 0; i < kSectionCount; ++i)
      if (kSections[i].kind == section) bits |= std::uint32_t{1} << i;
  return bits;
}
inline constexpr std::uint32_t kAlways =
    bits_of({Section::general, Section::motor_encoder, Section::encoder_filter, Section::disturbance, Section::sensors,
             Section::loops, Section::trajectory, Section::feedforward, Section::safety, Section::residual_map});
inline constexpr std::uint32_t kWithOutputEncoder = bits_of({Section::output_encoder, Section::output_filter});
inline constexpr std::uint32_t kWithoutOutputEncoder = bits_of({Section::torsion});
inline constexpr std::uint32_t kWithTorqueSensor = bits_of({Section::torque_ripple_filter});

struct SectionTables {
  model::detail::Rows rows{};
  std::array<model::SectionPlace, kSectionCount> places{};
};
inline constexpr SectionTables kTables = [] {
  SectionTables tables;
  for (std::size_t i = 0; i < kSectionCount; ++i) {
    const SectionPlan& plan = kSections[i];
    tables.places[i] = {plan.agrees, static_cast<std::uint16_t>(plan.kind), static_cast<std::uint16_t>(plan.at),
                        tables.rows.place(plan.row), plan.times};
  }
  return tables;
}();
constexpr auto section_rows() {
  std::array<std::uint8_t, kTables.rows.size> rows{};
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = kTables.rows.bytes[i];
  return rows;
}
inline constexpr auto kSectionRows = section_rows();
inline constexpr auto kSectionPlaces = kTables.places;
}  // namespace detail

// Everything that a block can hold, for a model of an image.
template <class Model>
constexpr model::BlockPlaces block_places() {
  model::BlockPlaces places = model::places_of_model<Model>();
  places.sections = detail::kSectionPlaces;
  places.section_rows = detail::kSectionRows.data();
  return places;
}

// Checks a block as a host does that simulates with it: good without a section for a drive as well. Fills a model, if
// there is one.
template <class Model>
model::BlockVerdict load(std::span<const std::uint8_t> block, Model& model) {
  std::uint32_t seen = 0;
  model.clear();
  const model::BlockVerdict verdict =
      model::read_block<Model::kTables>(block, block_places<Model>(), model.memory(), nullptr, seen, nullptr);
  model.note_effects();
  return verdict;
}

// Checks all of a block for a drive of this tick rate and board, where it lies, in flash or in memory; nothing is
// written. A board that states nothing agrees with any block.
// The first fault found.
template <class Model = decltype(DriveParameters<fixed::Fixed>::model)>
model::BlockVerdict check_for_drive(std::span<const std::uint8_t> block, std::uint32_t tick_hz,
                                    const Hardware& hardware = {}) {
  std::uint32_t seen = 0;
  detail::Noted noted;
  const model::BlockVerdict v =
      model::read_block<Model::kTables>(block, block_places<Model>(), nullptr, nullptr, seen, &noted);
  if (!v.good()) return v;
  const detail::General& general = noted.general;
  std::uint32_t needed = detail::kAlways;
  needed |= general.has_output_encoder ? detail::kWithOutputEncoder : detail::kWithoutOutputEncoder;
  if (general.has_torque_sensor) needed |= detail::kWithTorqueSensor;
  if ((needed & ~seen) != 0) return {model::BlockFault::missing_section};
  if (general.tick_hz != tick_hz) return {model::BlockFault::other_tick_rate};
  if (unreachable(noted.limited) != Limit::none) return {model::BlockFault::unreachable_limit};
  Stated& stated = noted.stated;
  stated.current_limit = noted.limited.current_limit;
  stated.has_output_encoder = general.has_output_encoder;
  stated.has_torque_sensor = general.has_torque_sensor;
  stated.current_base = model::base_at(block, model::kCurrentBase);
  stated.torque_base = model::base_at(block, model::kOutputTorqueBase);
  stated.temperature_base = model::base_at(block, model::kTemperatureBase);
  if (disagreement(stated, hardware) != Disagreement::none) return {model::BlockFault::other_hardware};
  return {};
}
// Fills parameters from a block that was found good; the model stands at rest then.
template <class Parameters>
void load_for_drive(std::span<const std::uint8_t> block, Parameters& parameters) {
  using Settings = DriveSettings<fixed::Fixed>;
  using Model = decltype(Parameters::model);
  static_assert(std::is_trivially_copyable_v<Settings>);
  std::uint32_t seen = 0;
  // Sections that are not there are noughts.
  Settings* const settings = &parameters;
  std::memset(static_cast<void*>(settings), 0, sizeof(Settings));
  parameters.model.reset();
  model::read_block<Model::kTables>(block, block_places<Model>(), parameters.model.memory(), settings, seen, nullptr);
  parameters.model.note_effects();
}

// Host only: adds all sections that these settings need to a block.
inline void add_settings(model::BlockWriter& writer, const DriveSettings<fixed::Fixed>& settings) {
  std::uint32_t wanted = detail::kAlways;
  wanted |= settings.has_output_encoder ? detail::kWithOutputEncoder : detail::kWithoutOutputEncoder;
  if (settings.has_torque_sensor) wanted |= detail::kWithTorqueSensor;
  if (settings.following.ticks > 0) wanted |= detail::bits_of({model::Section::following});
  if (settings.excitation.ticks > 0) {
    wanted |= detail::bits_of({model::Section::excitation});
    if (settings.excitation.line_count > 0) wanted |= detail::bits_of({model::Section::excitation_lines});
  }
  for (std::size_t i = 0; i < detail::kSectionCount; ++i) {
    const model::SectionPlace& place = detail::kSectionPlaces[i];
    if ((wanted >> i & 1) == 0) continue;
    const int times = place.times == 1 ? 1 : settings.excitation.line_count;
    writer.add_row(place.kind, &detail::kSectionRows[place.row],
                   reinterpret_cast<const std::byte*>(&settings) + place.at, times);
  }
}

}  // namespace flexspline::control
