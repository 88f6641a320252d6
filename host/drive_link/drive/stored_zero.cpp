#include "host/drive_link/drive/stored_zero.hpp"

#include <span>

#include "host/drive_link/drive/block_sections.hpp"

namespace flexspline::drive {
namespace {

constexpr auto kZeroKind = static_cast<std::uint16_t>(model::Section::stored_zero);

}  // namespace

control::StoredZero stored_zero_of(const Bytes& block) {
  control::StoredZero zero;
  if (block.empty()) return zero;
  model::for_each_entry(block, [&](std::uint16_t kind, std::span<const std::uint8_t> bytes) {
    if (kind != kZeroKind) return;
    model::FieldReader reader(bytes);
    zero.fields(reader);
  });
  return zero;
}

Bytes with_stored_zero(const Bytes& block, const control::StoredZero& zero) {
  return with_section(block, model::Section::stored_zero, zero != control::StoredZero{} ? &zero : nullptr);
}

Bytes keeping_stored_zero(const Bytes& block, const Bytes& active) {
  control::StoredZero zero = stored_zero_of(active);
  if (stored_zero_of(block) != control::StoredZero{}) return block;
  if (zero.motor.counts != encoder_counts_in(block, model::Section::motor_encoder)) zero.motor = {};
  if (zero.output.counts != encoder_counts_in(block, model::Section::output_encoder)) zero.output = {};
  return zero == control::StoredZero{} ? block : with_stored_zero(block, zero);
}

void store_zero(Session& session, std::int64_t position) {
  const control::StoredZero zero = session.reference().zero;
  if (zero == control::StoredZero{})
    session.fail(
        "its encoders show nothing that could be stored: a zero needs an absolute encoder, or an index pulse that the "
        "motor has passed since the power came");
  const Bytes active = session.read_block(protocol::Which::active);
  if (active.empty()) session.fail("it has no parameter block that could keep a zero");
  session.write_block(with_stored_zero(active, zero));
  const protocol::Reference known = session.reference();
  if (!known.knows_turn || !known.knows_output) session.home(position);
}

}  // namespace flexspline::drive
