// What makes a ripple of a certain order: causes by how often they repeat in a turn of the motor, from the facts of the
// drive.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::catalogue {

struct OrderCause {
  std::string from;  // "6 x pole_pairs = 24"
  std::string_view cause;
  std::string_view check;      // on the machine
  std::string_view cure;       // what ends it
  std::string_view reference;  // where the order comes from
};

// All causes of this order on this drive; the effect decides between ripples of torque, ripples that grow with the load
// and errors of position. Empty for effects without an order, and where the turn of the motor is not known: with a gear
// ratio of one, positions and orders may be those of the joint, unless pole pairs or slots are stated.
std::vector<OrderCause> order_causes(const Entry& effect, double order, const model::Drive& drive);

// Which fact of the drive would tell more, as a sentence; empty where none would.
std::string order_hint(const Entry& effect, const model::Drive& drive);

// The orders that pole pairs and slots of the motor give, rising, each once.
std::vector<double> orders_of_motor(const Entry& effect, const model::Drive& drive);

// Orders below one, which repeat with the turn of the output behind a gear: rising, as they are written (six digits).
std::vector<double> orders_of_output(const Entry& effect, const model::Drive& drive);

}  // namespace flexspline::catalogue
