#pragma once

#include <cstdint>

#include "hil/motor/power_stage.hpp"
#include "hil/plant/normal.hpp"

namespace flexspline::motor {

/// A sample as the converter's numbers: shares of full scale in 2^-15, in steps of its bits.
struct Readings {
  std::array<std::int32_t, 3> current{};
  std::int32_t bus = 0;
};

class Shunts {
 public:
  Shunts(const SensorParameters& parameters, std::uint64_t seed) : p_(parameters), normal_(seed) {}
  Readings read(const Sample& sample);

 private:
  std::int32_t share(double x, std::int32_t least) const;

  SensorParameters p_;
  plant::Normal normal_;
};

}  // namespace flexspline::motor
