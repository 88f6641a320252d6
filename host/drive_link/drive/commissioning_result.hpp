// What a drive measured of its motor, from its message.
#pragma once

#include "shared/control/commissioning/settings.hpp"
#include "shared/protocol/commissioning_payloads.hpp"

namespace flexspline::drive {

inline control::commissioning::Result result_of(const protocol::CommissioningResult& from) {
  control::commissioning::Result r;
  r.gain = {from.gain[0], from.gain[1], from.gain[2]};
  r.offset = {from.offset[0], from.offset[1], from.offset[2]};
  r.resistance = from.resistance;
  r.inductance_d = from.inductance_d;
  r.inductance_q = from.inductance_q;
  r.flux = from.flux;
  r.lost_voltage = from.lost_voltage;
  r.pole_pairs = from.pole_pairs;
  r.reversed = from.reversed;
  r.offset_angle = from.offset_angle;
  r.lag = from.lag;
  return r;
}

}  // namespace flexspline::drive
