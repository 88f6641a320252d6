#include "tests/worlds/friction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace flexspline::worlds {
namespace {

// Elements of a Maxwell-slip body: lengths relative to the whole, and their shares of the torque.
constexpr std::array<double, 6> kElementLengths = {0.1, 0.25, 0.5, 0.9, 1.5, 2.5};
constexpr std::array<double, 6> kElementShares = {0.12, 0.2, 0.24, 0.2, 0.14, 0.1};
constexpr double kSetValuedShare = 0.35;

}  // namespace

std::string_view name_of(PreslidingLaw law) {
  switch (law) {
    case PreslidingLaw::dahl:
      return "dahl";
    case PreslidingLaw::lugre:
      return "lugre";
    case PreslidingLaw::elastoplastic:
      return "elastoplastic";
    case PreslidingLaw::maxwell_slip:
      return "maxwell_slip";
    case PreslidingLaw::set_valued_and_bristles:
      break;
  }
  return "set_valued_and_bristles";
}

Presliding::Presliding(PreslidingLaw law, double length) : law_(law), length_(length) {
  if (law == PreslidingLaw::maxwell_slip || law == PreslidingLaw::set_valued_and_bristles) {
    for (const double relative : kElementLengths) lengths_.push_back(relative * length);
    shares_.assign(kElementShares.begin(), kElementShares.end());
    if (law == PreslidingLaw::set_valued_and_bristles) set_valued_share_ = kSetValuedShare;
  } else {
    lengths_ = {length};
    shares_ = {1.0};
  }
  loads_.assign(lengths_.size(), 0.0);
}

void Presliding::advance(double step, double level, double stretch) {
  const double direction = step > 0.0 ? 1.0 : -1.0;
  const double travel = std::abs(step) / stretch;
  if (law_ == PreslidingLaw::lugre) {
    // The state is a torque: where the level changes with the speed, it follows over the presliding length.
    const double before = loads_[0] * level_;
    level_ = level;
    loads_[0] = direction - (direction - before / level) * std::exp(-travel / length_);
    return;
  }
  if (law_ == PreslidingLaw::dahl) {
    loads_[0] = direction - (direction - loads_[0]) * std::exp(-travel / length_);
    return;
  }
  for (std::size_t k = 0; k < loads_.size(); ++k)
    loads_[k] = std::clamp(loads_[k] + direction * travel / lengths_[k], -1.0, 1.0);
}

double Presliding::load() const {
  double sum = 0.0;
  for (std::size_t k = 0; k < loads_.size(); ++k) sum += shares_[k] * loads_[k];
  return sum;
}

double Presliding::torque(double level) const {
  return (1.0 - set_valued_share_) * level * load();
}

double after_set_valued_friction(double free, double stop) {
  return free > stop ? free - stop : free < -stop ? free + stop : 0.0;
}

}  // namespace flexspline::worlds
