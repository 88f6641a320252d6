// Presliding that halves of the data choose although the encoder hardly resolves its travel.
#include <gtest/gtest.h>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/resampling.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/swinging_axis.hpp"

namespace flexspline::selection::unresolved_presliding_test {
namespace {

// Terms that subsamples found, or left open, that are presliding.
std::vector<Resampling::FoundTerm> presliding_of(const std::vector<Resampling::FoundTerm>& terms) {
  std::vector<Resampling::FoundTerm> all;
  for (const Resampling::FoundTerm& term : terms)
    if (!term.group.empty() && term.group.front().effect == "dahl_friction") all.push_back(term);
  return all;
}

TEST(UnresolvedPresliding, ThatSubsamplesChooseWithATravelOfAFewEncoderStepsIsLeftOpenAsTheAxisMayStick) {
  const data::Dataset dataset = tests::swinging_axis(0.005, 0.0015);
  const auto fitted = estimation::identify(dataset, tests::plain_model(), {});
  const std::vector<const data::Experiment*> all = {&dataset.experiments[0], &dataset.experiments[1]};
  const Resampling hidden = resample(all, fitted->model.drive, fitted->terms);
  EXPECT_TRUE(presliding_of(hidden.found).empty());
  const auto open = presliding_of(hidden.undecided);
  ASSERT_EQ(open.size(), 1u);
  EXPECT_TRUE(open.front().may_be_sticking);
}

}  // namespace
}  // namespace flexspline::selection::unresolved_presliding_test
