// A model's effects on any number system.
#pragma once

#include <fmt/format.h>

#include <memory>
#include <vector>

#include "host/drive_link/deployment/fixed_point_check.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "shared/effects/walk.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/model/drive_model.hpp"

namespace flexspline::deployment {

// Throws PackError where the effect does not fit.
template <class N>
void add(model::DriveModel<N>& model, const EffectValues& e, const effects::DriveConstants<double>& drive) {
  effects::for_each_effect([&]<class Effect>(std::size_t number) {
    if constexpr (!Effect::kInfo.host_only) {
      if (number != e.number) return;
      fixed::OverflowLog::clear();
      const bool placed = model.template add<Effect>(Effect::template derive<N>(e.parameters.data(), drive));
      if (fixed::OverflowLog::count() != 0)
        throw PackError(fmt::format("{} does not fit: {}", e.id, fixed::OverflowLog::first()));
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
                                               const effects::DriveConstants<double>& drive) {
  auto model = std::make_unique<model::DriveModel<N>>();
  for (const EffectValues& e : effects) add(*model, e, drive);
  return model;
}

// Which of the effects a tick is at, as it visits them by rising number, those of one number in their order.
class VisitedEffects {
 public:
  explicit VisitedEffects(const std::vector<EffectValues>& effects) : effects_(effects) {}
  void start() { before_.assign(effects::kLastId + 1, 0); }
  std::size_t next(std::size_t number) {
    std::size_t skip = before_[number]++;
    for (std::size_t i = 0; i < effects_.size(); ++i)
      if (effects_[i].number == number && skip-- == 0) return i;
    return effects_.size();
  }

 private:
  const std::vector<EffectValues>& effects_;
  std::vector<std::size_t> before_;
};

}  // namespace flexspline::deployment
