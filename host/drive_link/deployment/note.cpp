#include "host/drive_link/deployment/note.hpp"

#include <array>
#include <bit>
#include <limits>
#include <set>
#include <string>

#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/catalogue.hpp"
#include "shared/model/encoding.hpp"

namespace flexspline::deployment {
namespace {

constexpr std::size_t kMostBytes = 12288;
constexpr std::size_t kMostText = 64;

std::array<model::Quantity*, 7> quantities(model::Drive& d) {
  return {&d.gear_ratio,      &d.torque_constant_nm_a,    &d.rated_current_a, &d.rated_velocity_rad_s,
          &d.rated_torque_nm, &d.temperature_reference_c, &d.pitch_m};
}
void put(model::Writer& w, double x) {
  w.put(std::bit_cast<std::uint64_t>(x));
}
double take(model::Reader& r) {
  return std::bit_cast<double>(r.take<std::uint64_t>());
}

// At most `most` bytes of it; no character is cut in two.
std::string beginning_of(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0U) == 0x80U) --most;
  return text.substr(0, most);
}
// An id as the note holds it: long ones that begin alike get a number.
std::string stored_id(const std::string& id, std::set<std::string>& taken) {
  std::string stored = beginning_of(id, kMostText);
  for (int number = 2; !taken.insert(stored).second; ++number) {
    const std::string ending = "~" + std::to_string(number);
    stored = beginning_of(id, kMostText - ending.size()) + ending;
  }
  return stored;
}

}  // namespace

std::vector<std::uint8_t> note_of(const model::Drive& drive, const std::vector<EffectValues>& effects) {
  std::vector<std::uint8_t> bytes(kMostBytes);
  model::Writer w(bytes);
  model::Drive copy = drive;
  w.put(static_cast<std::uint32_t>(drive.axis == data::Axis::linear ? 1 : 0));
  for (const model::Quantity* q : quantities(copy)) put(w, q->value.value_or(std::numeric_limits<double>::quiet_NaN()));
  w.put(static_cast<std::uint32_t>(effects.size()));
  std::set<std::string> taken;
  for (const EffectValues& e : effects) {
    const std::string id = stored_id(e.id, taken);
    w.put(static_cast<std::uint16_t>(e.number));
    w.put(static_cast<std::uint16_t>(id.size()));
    for (const char c : id) w.put(static_cast<std::uint8_t>(c));
    w.put(static_cast<std::uint32_t>(e.parameters.size()));
    for (const double x : e.parameters) put(w, x);
  }
  if (!w.fits()) throw PackError("the model has too many parameters for a block");
  bytes.resize(w.size());
  return bytes;
}

Note read_note(std::span<const std::uint8_t> bytes) {
  const PackError wrong("the note on the model's parameters cannot be read: it was written by another version");
  model::Reader r(bytes);
  Note note;
  note.drive.axis = r.take<std::uint32_t>() == 1 ? data::Axis::linear : data::Axis::rotary;
  for (model::Quantity* q : quantities(note.drive))
    if (const double x = take(r); x == x) q->value = x;
  const auto count = r.take<std::uint32_t>();
  if (count > model::kMostEntries) throw wrong;
  for (std::uint32_t i = 0; i < count; ++i) {
    EffectValues e;
    e.number = r.take<std::uint16_t>();
    const auto text = r.take<std::uint16_t>();
    if (text > kMostText) throw wrong;
    for (std::uint16_t k = 0; k < text; ++k) e.id += static_cast<char>(r.take<std::uint8_t>());
    const auto parameters = r.take<std::uint32_t>();
    if (parameters > r.left() / sizeof(double)) throw wrong;
    for (std::uint32_t k = 0; k < parameters; ++k) e.parameters.push_back(take(r));
    note.effects.push_back(std::move(e));
  }
  if (!r.whole() || r.left() != 0) throw wrong;
  return note;
}

}  // namespace flexspline::deployment
