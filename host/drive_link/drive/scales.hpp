// From a drive's numbers to SI and back, by the bases in its active block.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host/drive_link/drive/session.hpp"
#include "shared/effects/effect.hpp"
#include "shared/model/block.hpp"

namespace flexspline::drive {

struct Scales {
  model::BlockHeader header;
  effects::DriveConstants<double> constants;

  // A channel's word in its unit (protocol::kChannelTexts). Whole turns and fractions of them are both in turns.
  double value(protocol::Channel channel, std::uint32_t word) const;
  // That unit, on a linear axis m, m/s and N in place of rad, rad/s and N m.
  std::string_view unit(protocol::Channel channel) const;
  std::int32_t per_unit(double value, double base) const;  // limited to two bases
  // Positions of both shafts for a turn: rad, m on a linear axis.
  double turn() const;
  bool is_linear() const { return header.axis == 1; }
};

// None where the bytes are no good block's beginning.
std::optional<Scales> scales_of(const Bytes& block);
// Of the drive's active block. Throws DriveError where it has none.
Scales scales_of(Session& session);

std::string text_of(const model::Name& name);

}  // namespace flexspline::drive
