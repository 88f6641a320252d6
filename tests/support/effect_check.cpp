// A first look at one effect, EFFECT_NAME, before everything is built with it: its header on every number system, and
// the proof of pack for this effect alone, at its usual size and far from it.
#include <algorithm>
#include <array>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/numbers/dual.hpp"
#include "host/common/numbers/real.hpp"
#include "host/drive_link/deployment/error_numbers.hpp"
#include "host/output/interchange/c_statements.hpp"
#include "host/physics/catalogue/coefficients.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/model/proof.hpp"

namespace flexspline {

thread_local std::string deployment::ProofFailure::reason_;

namespace {

// A drive of the size for which parameters have their usual values, at 16 kHz.
effects::DriveConstants<double> drive(double torque_scale) {
  effects::DriveConstants<double> d;
  d.gear_ratio = 100.0;
  d.torque_constant = 0.05;
  d.rated_velocity = d.velocity_base = 180.0;
  d.torque_base = 0.4 * torque_scale;
  d.output_torque_base = 40.0 * torque_scale;
  d.output_velocity_base = d.torsion_rate_base = 1.8;
  d.acceleration_base = 4000.0;
  d.output_acceleration_base = 40.0;
  d.angle_base = 6.283185307179586;
  d.torsion_base = 40.0 / 6300.0;
  d.temperature_base = 50.0;
  d.current_base = 8.0;
  d.time_base = 1.0 / 16000.0;
  return d;
}

// Everything that an effect does. It is compiled and not run.
template <class Effect, class N>
void compile() {
  using P = typename N::Parameter;
  const std::array<P, std::size(Effect::kParameters)> parameters{};
  const auto coefficients = catalogue::coefficients_of<Effect, N>(parameters.data(), effects::DriveConstants<P>{});
  typename Effect::template State<N> state{};
  effects::Inputs<N> in{};
  const effects::Inputs<N> before{};
  effects::Torques<N> out{};
  if constexpr (Effect::kInfo.phase == effects::Phase::shift) Effect::shift(coefficients, in);
  if constexpr (Effect::kInfo.phase == effects::Phase::modulate) Effect::modulate(coefficients, in);
  Effect::advance(state, coefficients, in, before);
  if constexpr (Effect::kInfo.phase == effects::Phase::source || Effect::kInfo.adds_to != 0)
    Effect::evaluate(state, coefficients, in, out);
}
template <class Effect, class... N>
void compile_on() {
  void (*volatile compiled[])() = {&compile<Effect, N>...};
  static_cast<void>(compiled);
}

// Empty: pack's proof holds, with the bases of torque as wide as pack makes them at most.
template <class Effect>
std::string refusal(const std::vector<double>& parameters) {
  std::string reason;
  for (const double scale : {1.0, 2.0, 4.0, 8.0}) {
    fixed::OverflowLog::clear();
    model::DriveModel<fixed::Intervals> model;
    model.template add<Effect>(catalogue::coefficients_of<Effect, fixed::Intervals>(parameters.data(), drive(scale)));
    reason = fixed::OverflowLog::first();
    if (!reason.empty()) continue;
    const model::Proof proof = model::prove(model);
    if (proof.holds) return {};
    reason = proof.reason;
  }
  return reason;
}

template <class Effect>
int prove() {
  const std::span<const effects::ParameterInfo> infos = Effect::kParameters;
  std::vector<double> usual;
  for (const effects::ParameterInfo& info : infos) usual.push_back(info.usual);
  if (const std::string reason = refusal<Effect>(usual); !reason.empty()) {
    std::printf("pack refuses it at its usual size: %s\n", reason.c_str());
    return 1;
  }
  std::puts("pack proves it at its usual size");
  // Here pack may refuse, if the header means no such drive.
  int refused = 0;
  for (std::size_t i = 0; i < infos.size(); ++i)
    for (const double factor : {0.1, 10.0}) {
      std::vector<double> changed = usual;
      changed[i] = std::clamp(factor * usual[i], infos[i].low, infos[i].high);
      const std::string reason = refusal<Effect>(changed);
      if (reason.empty()) continue;
      ++refused;
      std::printf("pack refuses it with %s = %g: %s\n", std::string(infos[i].name).c_str(), changed[i], reason.c_str());
    }
  if (refused == 0) std::puts("and with each parameter a tenth and ten times that, within its bounds");
  return 0;
}

int check() {
  int status = 2;
  effects::for_each_effect([&]<class Effect>(std::size_t) {
    if constexpr (Effect::kInfo.name == std::string_view(EFFECT_NAME)) {
      compile_on<Effect, numbers::Real, numbers::Dual, interchange::CNumbers>();
      std::puts("compiled for the host (Real, Dual, CNumbers)");
      status = 0;
      if constexpr (!Effect::kInfo.host_only) {
        compile_on<Effect, fixed::Fixed, fixed::Checked, fixed::Intervals, deployment::ErrorNumbers>();
        std::puts("compiled for a drive (Fixed, Checked, Intervals, ErrorNumbers)");
        status = prove<Effect>();
      }
    }
  });
  if (status == 2)
    std::fputs("no effect " EFFECT_NAME " in shared/effects/list.hpp; write its header and its line there first\n",
               stderr);
  return status;
}

}  // namespace
}  // namespace flexspline

int main() {
  return flexspline::check();
}
