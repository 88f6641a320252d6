#include "host/drive_link/deployment/fixed_point_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/drive_link/deployment/on_numbers.hpp"
#include "host/drive_link/deployment/samples.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/model/proof.hpp"

namespace flexspline::deployment {
namespace {

using effects::DriveConstants;
using fixed::Checked;
using fixed::Fixed;
using fixed::Intervals;
using fixed::OverflowLog;
using numbers::Real;

// Where a law is infinitely steep at rest an error means: no rate of torsion within this many units gives that torque.
constexpr double kUnitsOfRate = 3.0;

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
template <class N>
std::array<double, 3> torques_in_bases(const effects::Torques<N>& t) {
  const auto plain = [](const auto& sum) {
    if constexpr (std::is_same_v<N, Real>)
      return sum;
    else
      return real(sum.raw);
  };
  return {plain(t.motor), plain(t.transmission), plain(t.load)};
}
// One tick; what each effect added, in bases, and their sum at the end.
using Parts = std::vector<std::array<double, 3>>;
template <class N>
std::array<double, 3> tick(model::DriveModel<N>& model, const effects::Inputs<N>& in, VisitedEffects& visited,
                           Parts& parts) {
  visited.start();
  return torques_in_bases(
      model.tick_by_effect(in, [&]<class Effect>(auto& state, const auto& coefficients, const effects::Inputs<N>& now,
                                                 const effects::Inputs<N>& before, effects::Torques<N>& out) {
        effects::Torques<N> part{};
        model::DriveModel<N>::template run<Effect>(state, coefficients, now, before, part);
        parts[visited.next(model::DriveModel<N>::template number_of<Effect>())] = torques_in_bases(part);
        out.motor += part.motor;
        out.transmission += part.transmission;
        out.load += part.load;
      }));
}
double most(const Intervals::Sum& s) {
  return std::max(std::abs(real(s.low)), std::abs(real(s.high)));
}

}  // namespace

Bounds prove(const std::vector<EffectValues>& effects, const DriveConstants<double>& drive) {
  const auto torques = [](const model::Proof& proof) {
    return std::array{most(proof.torques.motor), most(proof.torques.transmission), most(proof.torques.load)};
  };
  const model::Proof all = model::prove(*model_of<Intervals>(effects, drive));
  Bounds bounds{all.holds, {}, torques(all), {}};
  if (!all.holds) bounds.reason = fmt::format("the proof fails: {}", all.reason);
  for (const EffectValues& e : effects) {
    const model::Proof alone = model::prove(*model_of<Intervals>({e}, drive));
    if (!all.holds && !alone.holds) bounds.reason = fmt::format("{} does not fit: {}", e.id, alone.reason);
    bounds.alone.push_back(torques(alone));
  }
  return bounds;
}

Difference compare(const std::vector<EffectValues>& effects, const DriveConstants<double>& drive, const Bounds& bounds,
                   std::size_t samples, std::uint64_t seed) {
  const auto drives = model_of<Checked>(effects, drive);
  DriveConstants<double> si_angle = drive;
  si_angle.angle_base = 1.0;
  const auto exact = model_of<Real>(effects, si_angle);
  // No law with memory reads the rate, so that models at the ends of its resolution stay with the others.
  const auto slower = std::make_unique<model::DriveModel<Real>>(*exact);
  const auto faster = std::make_unique<model::DriveModel<Real>>(*exact);
  Samples motion(drive, seed);
  OverflowLog::clear();
  Difference d;
  d.parts.assign(effects.size(), {});
  VisitedEffects visited(effects);
  // Of the drive, of double, and of double at both ends of the resolution.
  Parts given(effects.size()), middle = given, low = given, high = given;
  const auto off = [](double x, double a, double b, double c) {
    const auto [least, greatest] = std::minmax({a, b, c});
    return std::max(least - x, x - greatest);
  };
  for (std::size_t k = 0; k < samples; ++k) {
    const effects::Inputs<Fixed> in = motion.next();
    const auto sum = tick(*drives, copied<Checked>(in), visited, given);
    effects::Inputs<Real> plain = in_double(in, drive);
    const auto exactly = tick(*exact, plain, visited, middle);
    plain.torsion_rate -= std::ldexp(kUnitsOfRate, -fixed::kValueBits);
    const auto slow = tick(*slower, plain, visited, low);
    plain.torsion_rate += std::ldexp(2.0 * kUnitsOfRate, -fixed::kValueBits);
    const auto fast = tick(*faster, plain, visited, high);
    for (std::size_t b = 0; b < kBalances.size(); ++b) {
      d.worst[b] = std::max(d.worst[b], off(sum[b], exactly[b], slow[b], fast[b]));
      d.largest[b] = std::max(d.largest[b], std::abs(exactly[b]));
      d.within = d.within && std::abs(sum[b]) <= bounds.torque[b];
      for (std::size_t e = 0; e < effects.size(); ++e)
        d.parts[e][b] = std::max(d.parts[e][b], off(given[e][b], middle[e][b], low[e][b], high[e][b]));
    }
  }
  d.finding = std::string(OverflowLog::first());
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
