#include "host/deployment/trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/deployment/pack.hpp"
#include "host/deployment/samples.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/model/proof.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;
using fixed::Checked;
using fixed::Findings;
using fixed::Fixed;
using fixed::Intervals;
using numbers::Real;

// Where a law is infinitely steep at rest an error means: no rate of torsion within this many units gives that torque.
constexpr double kUnitsOfRate = 3.0;

template <class N>
void add(model::DriveModel<N>& model, const EffectValues& e, const DriveConstants<double>& drive) {
  effects::for_each_effect([&]<class Effect>(std::size_t number) {
    if constexpr (!Effect::kInfo.host_only) {
      if (number != e.number) return;
      Findings::clear();
      const bool placed = model.template add<Effect>(Effect::template derive<N>(e.parameters.data(), drive));
      if (Findings::count() != 0) throw PackError(fmt::format("{} does not fit: {}", e.id, Findings::first()));
      if (!placed)
        throw PackError(
            fmt::format("{} does not fit: a drive has no place for more of its kind; take some out of "
                        "the model",
                        e.id));
    }
  });
}
template <class N>
std::unique_ptr<model::DriveModel<N>> model_of(const std::vector<EffectValues>& effects,
                                               const DriveConstants<double>& drive) {
  auto model = std::make_unique<model::DriveModel<N>>();
  for (const EffectValues& e : effects) add(*model, e, drive);
  return model;
}

template <class To, class From>
effects::Inputs<To> copied(const effects::Inputs<From>& in) {
  effects::Inputs<To> out{};
  out.angle = in.angle;
  out.output_angle = in.output_angle;
  const auto take = [](auto& to, const auto& from) { to.raw = from.raw; };
  take(out.velocity, in.velocity);
  take(out.direction, in.direction);
  take(out.acceleration, in.acceleration);
  take(out.output_velocity, in.output_velocity);
  take(out.output_direction, in.output_direction);
  take(out.output_acceleration, in.output_acceleration);
  take(out.torsion, in.torsion);
  take(out.torsion_rate, in.torsion_rate);
  take(out.torsion_direction, in.torsion_direction);
  take(out.torque, in.torque);
  take(out.current, in.current);
  take(out.temperature, in.temperature);
  return out;
}

double real(std::int64_t sum) {
  return std::ldexp(static_cast<double>(sum), -fixed::kSumBits);
}
std::array<double, 3> bases_of(const effects::Torques<Real>& t) {
  return {t.motor, t.transmission, t.load};
}
std::array<double, 3> bases_of(const effects::Torques<Checked>& t) {
  return {real(t.motor.raw), real(t.transmission.raw), real(t.load.raw)};
}
double most(const Intervals::Sum& s) {
  return std::max(std::abs(real(s.low)), std::abs(real(s.high)));
}

}  // namespace

Bounds prove(const std::vector<EffectValues>& effects, const DriveConstants<double>& drive) {
  const model::Proof proof = model::prove(*model_of<Intervals>(effects, drive));
  return {proof.holds,
          std::string(proof.reason),
          {most(proof.torques.motor), most(proof.torques.transmission), most(proof.torques.load)}};
}

Difference compare(const std::vector<EffectValues>& effects, const DriveConstants<double>& drive, const Bounds& bounds,
                   std::size_t samples, std::uint64_t seed) {
  const auto drives = model_of<Checked>(effects, drive);
  DriveConstants<double> si_angle = drive;
  si_angle.angle_base = 1.0;
  const auto exact = model_of<Real>(effects, si_angle);
  // No law with memory reads the rate, so that models at the ends of its resolution stay beside the others.
  const auto slower = std::make_unique<model::DriveModel<Real>>(*exact);
  const auto faster = std::make_unique<model::DriveModel<Real>>(*exact);
  Samples motion(drive, seed);
  Findings::clear();
  Difference d;
  for (std::size_t k = 0; k < samples; ++k) {
    const effects::Inputs<Fixed> in = motion.next();
    const auto given = bases_of(drives->tick(copied<Checked>(in)));
    effects::Inputs<Real> plain = in_double(in, drive);
    const auto middle = bases_of(exact->tick(plain));
    plain.torsion_rate -= std::ldexp(kUnitsOfRate, -fixed::kValueBits);
    const auto low = bases_of(slower->tick(plain));
    plain.torsion_rate += std::ldexp(2.0 * kUnitsOfRate, -fixed::kValueBits);
    const auto high = bases_of(faster->tick(plain));
    for (std::size_t b = 0; b < kBalances.size(); ++b) {
      const auto [least, greatest] = std::minmax({middle[b], low[b], high[b]});
      d.worst[b] = std::max({d.worst[b], least - given[b], given[b] - greatest});
      d.largest[b] = std::max(d.largest[b], std::abs(middle[b]));
      d.within = d.within && std::abs(given[b]) <= bounds.torque[b];
    }
  }
  d.finding = std::string(Findings::first());
  return d;
}

void write_effects(model::BlockWriter& writer, const std::vector<EffectValues>& effects,
                   const DriveConstants<double>& drive) {
  for (const EffectValues& e : effects)
    effects::for_each_effect([&]<class Effect>(std::size_t number) {
      if constexpr (!Effect::kInfo.host_only)
        if (number == e.number)
          writer.add(static_cast<std::uint16_t>(number), Effect::template derive<Fixed>(e.parameters.data(), drive));
    });
}

}  // namespace flexspline::deployment
