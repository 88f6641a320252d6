#include "host/engine/planning/design.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/common/algebra/decompositions.hpp"
#include "host/engine/planning/hypotheses.hpp"

namespace flexspline::planning {
namespace {

// Above this margin less effort for the operator counts more than more margin.
constexpr double kEnough = 10.0 * kDistinguished;
// A motion that improves the result by less than a fifth is not worth its time.
constexpr double kWorthwhile = 1.2;
// Of a value whose 95 % interval reaches zero.
constexpr double kMayBeZeroPercent = 100.0 / 1.96;
// Cost of one unit of effort for the operator, in seconds of recording.
constexpr double kTrouble_s = 15.0;

// Factors of one balance: of what was recorded, and of each motion.
struct Factors {
  Eigen::MatrixXd recorded;
  std::vector<Eigen::MatrixXd> motions;
  double noise = 1.0;
};

std::vector<Factors> factors_of(RehearsedMotions& rehearsed, const ColumnLayout& layout) {
  std::vector<Factors> all;
  for (const RehearsedMotions::BalanceData& side : rehearsed.balances()) {
    Factors f;
    f.noise = side.noise;
    if (side.recorded) {
      const auto parts = factors(*side.recorded, layout.over(*side.recorded));
      std::vector<const Eigen::MatrixXd*> list;
      for (const Eigen::MatrixXd& part : parts) list.push_back(&part);
      f.recorded = stacked_factor(list);
    }
    auto parts = factors(*side.planned, layout.over(*side.planned));
    for (std::size_t i = 0; i < parts.size(); ++i) parts[i] /= side.relative_noise[i];
    for (std::size_t m = 0; m < rehearsed.motions().size(); ++m) {
      std::vector<const Eigen::MatrixXd*> list;
      for (std::size_t r = 0; r < rehearsed.motions()[m].runs.size(); ++r)
        list.push_back(&parts[rehearsed.first_record(m) + r]);
      f.motions.push_back(stacked_factor(list));
    }
    all.push_back(std::move(f));
  }
  return all;
}

Eigen::MatrixXd with(const Factors& f, const std::vector<std::size_t>& chosen) {
  std::vector<const Eigen::MatrixXd*> list{&f.recorded};
  for (const std::size_t m : chosen) list.push_back(&f.motions[m]);
  return stacked_factor(list);
}

double expected_likelihood_ratio(const std::vector<Eigen::MatrixXd>& totals, const std::vector<Factors>& all,
                                 const EffectHypothesis& truth, const EffectHypothesis& other) {
  double least = 1e300;
  for (const Hypothesis& variant : other.variants) {
    double sum = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) sum += unexplained(totals[i], truth.truth, variant) / all[i].noise;
    least = std::min(least, sum);
  }
  return least;
}

Separation separation(const std::vector<Factors>& all, const std::vector<std::size_t>& chosen,
                      const EffectHypothesis& a, const EffectHypothesis& b) {
  std::vector<Eigen::MatrixXd> totals;
  for (const Factors& f : all) totals.push_back(with(f, chosen));
  return {expected_likelihood_ratio(totals, all, a, b), expected_likelihood_ratio(totals, all, b, a)};
}

// The worse of the two decides; identifying one of them is an intermediate step, where neither alone shows the other.
double progress(const Separation& s) {
  return s.worst() + 0.01 * std::min(std::max(s.of_first, s.of_second), kEnough);
}

double duration(const Motion& motion) {
  double sum = 0.0;
  for (const Run& run : motion.runs) sum += run.duration_s;
  return sum;
}

Design begin(const PlanRequest& request, const RehearsedMotions& rehearsed) {
  Design design;
  design.axis = rehearsed.model().drive.axis;
  design.effort_is_current = request.sensors.current;
  design.plan.model = rehearsed.model().name;
  design.plan.sample_s = request.sample_s;
  design.plan.limits = request.setting.limits;
  if (rehearsed.identified()) design.warnings = rehearsed.identified()->warnings;
  return design;
}

void take(const RehearsedMotions& rehearsed, const std::vector<std::size_t>& chosen, Design& design) {
  for (const std::size_t m : chosen)
    for (std::size_t r = 0; r < rehearsed.motions()[m].runs.size(); ++r) {
      design.plan.runs.push_back(rehearsed.motions()[m].runs[r]);
      design.peaks.push_back(rehearsed.peak(m, r));
    }
}

// Motions that may still be taken.
std::vector<std::size_t> open_motions(const RehearsedMotions& rehearsed, const std::vector<std::size_t>& chosen,
                                      const PlanRequest& request) {
  double left = request.setting.limits.duration_s;
  for (const std::size_t m : chosen) left -= duration(rehearsed.motions()[m]);
  std::vector<std::size_t> open;
  for (std::size_t m = 0; m < rehearsed.motions().size(); ++m)
    if (std::find(chosen.begin(), chosen.end(), m) == chosen.end() && duration(rehearsed.motions()[m]) <= left)
      open.push_back(m);
  return open;
}

// One balance's information on the parameters of the model, relative to their values.
class Parameters {
 public:
  Parameters(RehearsedMotions& rehearsed, const Hypothesis& model) : model_(&model) {
    for (std::size_t t = 0; t < model.terms.size(); ++t)
      for (std::size_t p = 0; p < model.terms[t].values.size(); ++p) {
        const estimation::Term& term = model.terms[t];
        if (!term.free_linear(p) && !term.free_nonlinear(p)) continue;
        const auto& info = term.entry->parameters[p];
        // A value of zero has no relative error; a tenth of the usual size is used instead.
        scale_.push_back(std::max({std::abs(term.values[p]), 0.1 * std::abs(info.usual), 1e-30}));
        const auto axis = rehearsed.model().drive.axis;
        list_.push_back({term.id,
                         std::string(info.name),
                         std::string(catalogue::unit_on(info.unit, axis)),
                         catalogue::natural(*term.entry, term.values)[p],
                         {},
                         {}});
      }
  }

  std::size_t size() const { return list_.size(); }
  std::vector<Precision> list() const { return list_; }

  // X'X/noise over all balances, for relative parameters, with the delay of each balance projected out.
  Eigen::MatrixXd information(const std::vector<Factors>& all, const std::vector<std::size_t>& chosen) const {
    const auto n = static_cast<Eigen::Index>(size());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
    for (const Factors& f : all) {
      const Eigen::MatrixXd R = with(f, chosen);
      if (R.rows() == 0) continue;
      Eigen::MatrixXd X(R.rows(), n);
      for (Eigen::Index j = 0; j < n; ++j)
        X.col(j) = scale_[static_cast<std::size_t>(j)] *
                   R.col(static_cast<Eigen::Index>(model_->columns[static_cast<std::size_t>(j)]));
      Eigen::VectorXd delay = R.col(static_cast<Eigen::Index>(model_->columns.back()));
      if (delay.norm() > 0.0) {
        delay.normalize();
        X -= delay * (delay.transpose() * X).eval();
      }
      sum += X.transpose() * X / f.noise;
    }
    return sum;
  }

  // Relative standard deviation of each, in percent; none where it is above `kLost`.
  static std::vector<std::optional<double>> percent(const Eigen::MatrixXd& information) {
    constexpr double kLost = 1e4;
    // A prior far below any information that is required keeps undetermined parameters finite.
    const Eigen::Index n = information.rows();
    const Eigen::MatrixXd covariance = algebra::SymmetricFactor(information + 1e-8 * Eigen::MatrixXd::Identity(n, n))
                                           .solve(Eigen::MatrixXd::Identity(n, n));
    std::vector<std::optional<double>> list;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double value = 100.0 * std::sqrt(std::max(0.0, covariance(j, j)));
      list.push_back(value < kLost ? std::optional(value) : std::nullopt);
    }
    return list;
  }

 private:
  const Hypothesis* model_;
  std::vector<double> scale_;
  std::vector<Precision> list_;
};

// Without an exponent, which is hard to read as a share.
std::string percent_text(double percent) {
  return percent < 100.0 ? fmt::format("{:.2g}", percent) : fmt::format("{:.0f}", percent);
}

// Says which parameters stay less precise than is required.
void note_imprecise(Design& design) {
  std::string open;
  for (const Precision& p : design.parameters)
    if (!p.precise())
      open += fmt::format("{}{}.{}{}", open.empty() ? "" : ", ", p.id, p.parameter,
                          p.percent_after ? fmt::format(" ({} %{})", percent_text(*p.percent_after),
                                                        *p.percent_after > kMayBeZeroPercent ? ": may be zero" : "")
                                          : " (unknown)");
  if (open.empty()) return;
  design.plan.notes.push_back(fmt::format("{} Relative standard deviations of {:g} % or more: {}.",
                                          design.plan.runs.empty()
                                              ? "No motion within these limits adds enough to what is known."
                                              : "With these motions not all parameters are known well.",
                                          kPrecisePercent, open));
}

double log_determinant(const Eigen::MatrixXd& information) {
  // A prior of ten times the value prevents that parameters that no motion shows dominate the choice.
  const Eigen::Index n = information.rows();
  return algebra::eigenvalues(information + 0.01 * Eigen::MatrixXd::Identity(n, n)).array().max(1e-12).log().sum();
}

}  // namespace

Design discriminate(const PlanRequest& request, std::string_view first, std::string_view second) {
  RehearsedMotions rehearsed(request, {first, second});
  if (request.progress) request.progress("comparing the effects on all motions");
  ColumnLayout layout;
  // An effect that the model has already is one of the two that may be missing.
  const Terms base = without(without(rehearsed.terms(), first), second);
  const EffectHypothesis a = effect_hypothesis(rehearsed, layout, base, first),
                         b = effect_hypothesis(rehearsed, layout, base, second);
  Design design = begin(request, rehearsed);
  design.plan.separate = {a.label, b.label};
  const std::vector<Factors> all = factors_of(rehearsed, layout);
  std::vector<std::size_t> chosen;
  if (rehearsed.identified()) design.before = separation(all, {}, a, b);
  design.after = design.before.value_or(Separation{});
  while (chosen.size() < request.most_motions && design.after->worst() < kEnough) {
    std::optional<std::size_t> best;
    double most = -1e300;
    Separation reached;
    for (const std::size_t m : open_motions(rehearsed, chosen, request)) {
      std::vector<std::size_t> more = chosen;
      more.push_back(m);
      const Separation s = separation(all, more, a, b);
      if (progress(s) < kWorthwhile * std::max(progress(*design.after), 1e-3)) continue;
      // Above the required margin, the motion with the least effort for the operator is chosen.
      const double merit = std::log(std::min(progress(s), kEnough)) - 0.3 * rehearsed.motions()[m].operator_effort +
                           0.01 * std::log(progress(s));
      if (merit > most) {
        most = merit;
        best = m;
        reached = s;
      }
    }
    if (!best) break;
    chosen.push_back(*best);
    design.after = reached;
  }
  const auto size = [](const EffectHypothesis& c) {
    return fmt::format("{} {}", c.label,
                       c.seen ? "as large as the data show it"
                              : "at the largest size that these data would not show, at most its usual one");
  };
  if (design.after->worst() < kDistinguished) {
    design.plan.notes.push_back(
        fmt::format("No motion within these limits distinguishes {} from {} (expected margin {:.3g}; {:.0f} would be "
                    "needed): report both as alternatives.",
                    a.label, b.label, design.after->worst(), kDistinguished));
    return design;
  }
  take(rehearsed, chosen, design);
  design.plan.notes.push_back(
      fmt::format("Expected margin of the true effect over the other: {:.3g}{}, with {} and {}.", design.after->worst(),
                  design.before ? fmt::format(" (so far {:.3g})", design.before->worst()) : "", size(a), size(b)));
  return design;
}

Design d_optimal(const PlanRequest& request) {
  RehearsedMotions rehearsed(request);
  if (request.progress) request.progress("choosing motions");
  ColumnLayout layout;
  const Hypothesis model = layout.add(rehearsed.terms());
  const Parameters parameters(rehearsed, model);
  Design design = begin(request, rehearsed);
  const std::vector<Factors> all = factors_of(rehearsed, layout);
  design.parameters = parameters.list();
  std::vector<std::size_t> chosen;
  Eigen::MatrixXd information = parameters.information(all, {});
  if (rehearsed.identified()) {
    const auto before = Parameters::percent(information);
    for (std::size_t j = 0; j < before.size(); ++j) design.parameters[j].percent_before = before[j];
  }
  const auto precise = [&] {
    const auto now = Parameters::percent(information);
    return std::all_of(now.begin(), now.end(), [](const auto& p) { return p && *p < kPrecisePercent; });
  };
  while (chosen.size() < request.most_motions && !precise()) {
    const double now = log_determinant(information);
    std::optional<std::size_t> best;
    double most = 0.0;
    for (const std::size_t m : open_motions(rehearsed, chosen, request)) {
      std::vector<std::size_t> more = chosen;
      more.push_back(m);
      const double gain = log_determinant(parameters.information(all, more)) - now;
      // A motion must raise the determinant of the information by at least a factor e; then the gain per time
      // decides.
      const Motion& motion = rehearsed.motions()[m];
      const double merit = gain > 1.0 ? gain / (duration(motion) + kTrouble_s * motion.operator_effort) : 0.0;
      if (merit > most) {
        most = merit;
        best = m;
      }
    }
    if (!best) break;
    chosen.push_back(*best);
    information = parameters.information(all, chosen);
  }
  const auto after = Parameters::percent(information);
  for (std::size_t j = 0; j < after.size(); ++j) design.parameters[j].percent_after = after[j];
  take(rehearsed, chosen, design);
  note_imprecise(design);
  return design;
}

}  // namespace flexspline::planning
