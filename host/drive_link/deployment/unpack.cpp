#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/fold.hpp"
#include "host/drive_link/deployment/note.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/catalogue/user_defined_effect.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/fixed/system.hpp"
#include "shared/model/block_texts.hpp"

namespace flexspline::deployment {
namespace {

using fixed::Fixed;

template <class G>
double floating(const G& g) {
  return std::ldexp(g.mantissa, g.exponent - fixed::kMantissaBits);
}
void describe(const fixed::Gain& g, std::vector<Coefficient>& out) {
  out.push_back({"gain", floating(g)});
}
void describe(const fixed::Weight& x, std::vector<Coefficient>& out) {
  out.push_back({"torque", std::ldexp(x.raw, -fixed::kValueBits)});
}
void describe(const fixed::Harmonic& h, std::vector<Coefficient>& out) {
  out.push_back({"order", std::ldexp(static_cast<double>(h.order), -fixed::kOrderBits)});
  out.push_back({"amplitude", std::ldexp(h.amplitude, -fixed::kValueBits)});
  out.push_back({"phase_turns", std::ldexp(h.phase, -32)});
}
void describe(const fixed::StepGain& g, std::vector<Coefficient>& out) {
  out.push_back({"gain_per_turn", floating(g)});
}
void describe(const fixed::RatioGain& g, std::vector<Coefficient>& out) {
  out.push_back({"ratio", floating(g)});
}
[[maybe_unused]] void describe(const fixed::DistanceGain& g, std::vector<Coefficient>& out) {
  out.push_back({"gain_per_turn", floating(g)});
}
void describe(const fixed::Value& x, std::vector<Coefficient>& out) {
  out.push_back({"value", std::ldexp(x.raw, -fixed::kValueBits)});
}
void describe(const fixed::Exponent& x, std::vector<Coefficient>& out) {
  out.push_back({"exponent", std::ldexp(x.raw, -fixed::kExponentBits)});
}
void describe(const fixed::Order& x, std::vector<Coefficient>& out) {
  out.push_back({"order", std::ldexp(static_cast<double>(x.raw), -fixed::kOrderBits)});
}
[[maybe_unused]] void describe(const fixed::Share& x, std::vector<Coefficient>& out) {
  out.push_back({"share", std::ldexp(static_cast<double>(x.raw), -fixed::kShareBits)});
}
template <class T, std::size_t Size>
void describe(const std::array<T, Size>& all, std::vector<Coefficient>& out) {
  for (const T& x : all) describe(x, out);
}

void describe(bool x, std::vector<Coefficient>& out) {
  out.push_back({"flag", x ? 1.0 : 0.0});
}
void describe(effects::Variable x, std::vector<Coefficient>& out) {
  out.push_back({"variable", static_cast<double>(x)});
}
void describe(effects::Balance x, std::vector<Coefficient>& out) {
  out.push_back({"balance", static_cast<double>(x)});
}
void describe(std::int16_t x, std::vector<Coefficient>& out) {
  out.push_back({"number", static_cast<double>(x)});
}

// Lists the fields of coefficients in the order of the block; of a table only the points that it has.
struct Describer {
  std::vector<Coefficient>& out;
  template <class T>
  void operator()(T& x) {
    describe(x, out);
  }
  template <class Words>
  void points(std::int16_t& count, Words& words) {
    describe(count, out);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) describe(words[i], out);
  }
};

template <class T>
void describe_all(T coefficients, std::vector<Coefficient>& out) {
  Describer describer{out};
  coefficients.fields(describer);
}

std::string text_of(const model::Name& name) {
  return {name.begin(), std::find(name.begin(), name.end(), '\0')};
}

[[noreturn]] void refuse(const model::BlockVerdict& v) {
  std::string where;
  if (v.entry >= 0) where = fmt::format(" (entry {}", v.entry);
  if (v.entry >= 0 && v.kind != 0) {
    where += fmt::format(" of kind {}", v.kind);
    for (const catalogue::Entry& entry : catalogue::all())
      if (entry.id == v.kind) where += fmt::format(", {}", entry.name());
  }
  if (v.field >= 0) where += fmt::format("{}field {}", where.empty() ? " (" : ", ", v.field);
  if (!where.empty()) where += ")";
  throw PackError(
      fmt::format("this is not a good parameter block: {}{}; pack the model again", model::text_of(v.fault), where));
}

// Whether the effects' coefficients are, to the bit, what the note's parameters give.
bool follows(std::span<const std::uint8_t> block, const Note& note, const model::BlockHeader& header) {
  std::vector<std::uint8_t> bytes(model::kLargestBlock);
  model::BlockWriter writer(bytes);
  writer.begin(header);
  write_effects(writer, note.effects, from_block(header.bases));
  bytes.resize(writer.end());
  std::vector<std::span<const std::uint8_t>> ours, theirs;
  const auto collect = [](std::span<const std::uint8_t> of, auto& into) {
    model::for_each_entry(of, [&](std::uint16_t kind, std::span<const std::uint8_t> entry) {
      if (kind < 0x100) into.push_back(entry);
    });
  };
  collect(bytes, ours);
  collect(block, theirs);
  return std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end(),
                    [](const auto& a, const auto& b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); });
}

model::Model model_from(const Note& note, const model::BlockHeader& header) {
  model::Model m;
  m.name = text_of(header.model);
  m.drive = note.drive;
  for (const EffectValues& e : note.effects) {
    if (e.number == table_number()) {
      try {
        m.effects.push_back({std::string(catalogue::kTableEffect), e.id, {}, definition_of(e.parameters)});
      } catch (const std::invalid_argument& error) {
        throw PackError(fmt::format("the block's note on {} cannot be read: {}", e.id, error.what()));
      }
      continue;
    }
    const auto all = catalogue::all();
    const auto entry = std::find_if(all.begin(), all.end(), [&](const auto& x) { return x.id == e.number; });
    if (entry == all.end() || entry->parameters.size() != e.parameters.size())
      throw PackError(fmt::format("the block's effect {} has other parameters than this version knows", e.id));
    model::Effect effect = catalogue::blank_effect(*entry, note.drive.axis);
    effect.id = e.id;
    for (std::size_t p = 0; p < e.parameters.size(); ++p) {
      effect.parameters[p].value = e.parameters[p];
      effect.parameters[p].fixed = true;  // as stated, so that it is written to its last digit
    }
    m.effects.push_back(std::move(effect));
  }
  return m;
}

}  // namespace

Unpacked unpack(std::span<const std::uint8_t> block) {
  Unpacked unpacked;
  const auto model = std::make_unique<model::DriveModel<Fixed>>();
  if (const auto v = control::load(block, *model); !v.good()) refuse(v);
  unpacked.header = model::header_of(block);
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t>) {
    if (kind >= 0x100 && kind < model::kFirstNote) unpacked.sections.push_back(kind);
  });
  const auto tick_hz = static_cast<std::uint32_t>(std::lround(1.0 / from_block(unpacked.header.bases).time_base));
  if (const auto v = control::check_for_drive(block, tick_hz); !v.good()) {
    unpacked.refusal = model::text_of(v.fault);
  } else {
    const auto parameters = std::make_unique<control::DriveParameters<Fixed>>();
    control::load_for_drive(block, *parameters);
    unpacked.settings = described(*parameters, from_block(unpacked.header.bases));
  }
  model->for_each([&]<class Effect>(const auto& places) {
    for (std::size_t i = 0; i < places.count; ++i) {
      UnpackedEffect effect{std::string(Effect::kInfo.name), {}};
      describe_all(places.coefficients[i], effect.coefficients);
      unpacked.effects.push_back(std::move(effect));
    }
  });
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != model::kParametersNote) return;
    const Note note = read_note(bytes);
    unpacked.model = model_from(note, unpacked.header);
    unpacked.coefficients_follow = follows(block, note, unpacked.header);
  });
  return unpacked;
}

}  // namespace flexspline::deployment
