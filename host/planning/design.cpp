#include "host/planning/design.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "host/planning/hypotheses.hpp"

namespace flexspline::planning {
namespace {

// More than that margin need not be bought with trouble.
constexpr double kEnough = 10.0 * kTold;
// A motion that does not better the answer by a fifth is not worth its time.
constexpr double kWorthwhile = 1.2;
// Parameters are known well enough then.
constexpr double kPrecisePercent = 1.0;
// What a unit of trouble costs, in seconds of recording.
constexpr double kTrouble_s = 15.0;

// Factors of one balance: of what was recorded, and of each motion.
struct Factors {
  Eigen::MatrixXd recorded;
  std::vector<Eigen::MatrixXd> motions;
  double noise = 1.0;
};

std::vector<Factors> factors_of(Bench& bench, const Layout& layout) {
  std::vector<Factors> all;
  for (const Bench::Side& side : bench.sides()) {
    Factors f;
    f.noise = side.noise;
    if (side.recorded) {
      const auto parts = factors(*side.recorded, layout.over(*side.recorded));
      std::vector<const Eigen::MatrixXd*> list;
      for (const Eigen::MatrixXd& part : parts) list.push_back(&part);
      f.recorded = together(list);
    }
    auto parts = factors(*side.planned, layout.over(*side.planned));
    for (std::size_t i = 0; i < parts.size(); ++i) parts[i] /= side.louder[i];
    for (std::size_t m = 0; m < bench.motions().size(); ++m) {
      std::vector<const Eigen::MatrixXd*> list;
      for (std::size_t r = 0; r < bench.motions()[m].runs.size(); ++r)
        list.push_back(&parts[bench.first_record(m) + r]);
      f.motions.push_back(together(list));
    }
    all.push_back(std::move(f));
  }
  return all;
}

Eigen::MatrixXd with(const Factors& f, const std::vector<std::size_t>& chosen) {
  std::vector<const Eigen::MatrixXd*> list{&f.recorded};
  for (const std::size_t m : chosen) list.push_back(&f.motions[m]);
  return together(list);
}

double beats(const std::vector<Eigen::MatrixXd>& totals, const std::vector<Factors>& all, const Contender& truth,
             const Contender& other) {
  double least = 1e300;
  for (const Hypothesis& variant : other.variants) {
    double sum = 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) sum += unexplained(totals[i], truth.truth, variant) / all[i].noise;
    least = std::min(least, sum);
  }
  return least;
}

Separation separation(const std::vector<Factors>& all, const std::vector<std::size_t>& chosen, const Contender& a,
                      const Contender& b) {
  std::vector<Eigen::MatrixXd> totals;
  for (const Factors& f : all) totals.push_back(with(f, chosen));
  return {beats(totals, all, a, b), beats(totals, all, b, a)};
}

// The worse of the two decides; that one of them is told is a step on the way, where neither alone shows the other.
double progress(const Separation& s) {
  return s.worst() + 0.01 * std::min(std::max(s.of_first, s.of_second), kEnough);
}

double duration(const Motion& motion) {
  double sum = 0.0;
  for (const Run& run : motion.runs) sum += run.duration_s;
  return sum;
}

Design begin(const Question& question, const Bench& bench) {
  Design design;
  design.plan.model = bench.model().name;
  design.plan.sample_s = question.sample_s;
  design.plan.limits = question.setting.limits;
  if (bench.identified()) design.warnings = bench.identified()->warnings;
  return design;
}

void take(const Bench& bench, const std::vector<std::size_t>& chosen, Design& design) {
  for (const std::size_t m : chosen)
    for (std::size_t r = 0; r < bench.motions()[m].runs.size(); ++r) {
      design.plan.runs.push_back(bench.motions()[m].runs[r]);
      design.peaks.push_back(bench.peak(m, r));
    }
}

// Motions that may still be taken.
std::vector<std::size_t> open_motions(const Bench& bench, const std::vector<std::size_t>& chosen,
                                      const Question& question) {
  double left = question.setting.limits.duration_s;
  for (const std::size_t m : chosen) left -= duration(bench.motions()[m]);
  std::vector<std::size_t> open;
  for (std::size_t m = 0; m < bench.motions().size(); ++m)
    if (std::find(chosen.begin(), chosen.end(), m) == chosen.end() && duration(bench.motions()[m]) <= left)
      open.push_back(m);
  return open;
}

// One balance's information on the parameters of the model, relative to their values.
class Parameters {
 public:
  Parameters(Bench& bench, const Hypothesis& model) : model_(&model) {
    for (std::size_t t = 0; t < model.terms.size(); ++t)
      for (std::size_t p = 0; p < model.terms[t].values.size(); ++p) {
        const estimation::Term& term = model.terms[t];
        if (!term.free_linear(p) && !term.free_shape(p)) continue;
        const auto& info = term.entry->parameters[p];
        // What is nought has no relative error; a tenth of the usual size stands in for its value.
        scale_.push_back(std::max({std::abs(term.values[p]), 0.1 * std::abs(info.usual), 1e-30}));
        const auto axis = bench.model().drive.axis;
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

  // X'X/noise over all balances, each parameter in parts of its value, with the delay of each balance projected out.
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
    // What nothing determines keeps a prior of a thousandth of what would count.
    const Eigen::Index n = information.rows();
    const Eigen::MatrixXd covariance =
        (information + 1e-8 * Eigen::MatrixXd::Identity(n, n)).ldlt().solve(Eigen::MatrixXd::Identity(n, n));
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

double log_determinant(const Eigen::MatrixXd& information) {
  // A prior of ten times the value keeps what no motion shows from ruling the choice.
  const Eigen::Index n = information.rows();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information + 0.01 * Eigen::MatrixXd::Identity(n, n),
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues().array().max(1e-12).log().sum();
}

}  // namespace

Design separate(const Question& question, std::string_view first, std::string_view second) {
  Bench bench(question);
  if (question.progress) question.progress("comparing the effects on all motions");
  Layout layout;
  // An effect that the model has already is one of the two that may be missing.
  const Terms base = without(without(bench.terms(), first), second);
  const Contender a = contender(bench, layout, base, first), b = contender(bench, layout, base, second);
  Design design = begin(question, bench);
  design.plan.separate = {a.label, b.label};
  const std::vector<Factors> all = factors_of(bench, layout);
  std::vector<std::size_t> chosen;
  if (bench.identified()) design.before = separation(all, {}, a, b);
  design.after = design.before.value_or(Separation{});
  while (chosen.size() < question.most_motions && design.after->worst() < kEnough) {
    std::optional<std::size_t> best;
    double most = -1e300;
    Separation reached;
    for (const std::size_t m : open_motions(bench, chosen, question)) {
      std::vector<std::size_t> more = chosen;
      more.push_back(m);
      const Separation s = separation(all, more, a, b);
      if (progress(s) < kWorthwhile * std::max(progress(*design.after), 1e-3)) continue;
      // Beyond what is enough, the least trouble wins.
      const double merit =
          std::log(std::min(progress(s), kEnough)) - 0.3 * bench.motions()[m].trouble + 0.01 * std::log(progress(s));
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
  const auto size = [](const Contender& c) {
    return fmt::format(
        "{} {}", c.label,
        c.seen ? "as large as the data show it" : "as large as it can be unseen, at most of its usual size");
  };
  if (design.after->worst() < kTold) {
    design.plan.notes.push_back(fmt::format(
        "No motion within these limits tells {} from {} (expected margin {:.3g}; {:.0f} would be needed): name them "
        "together.",
        a.label, b.label, design.after->worst(), kTold));
    return design;
  }
  take(bench, chosen, design);
  design.plan.notes.push_back(
      fmt::format("Expected margin of the true effect over the other: {:.3g}{}, with {} and {}.", design.after->worst(),
                  design.before ? fmt::format(" (so far {:.3g})", design.before->worst()) : "", size(a), size(b)));
  return design;
}

Design excite(const Question& question) {
  Bench bench(question);
  if (question.progress) question.progress("choosing motions");
  Layout layout;
  const Hypothesis model = layout.add(bench.terms());
  const Parameters parameters(bench, model);
  Design design = begin(question, bench);
  const std::vector<Factors> all = factors_of(bench, layout);
  design.parameters = parameters.list();
  std::vector<std::size_t> chosen;
  Eigen::MatrixXd information = parameters.information(all, {});
  if (bench.identified()) {
    const auto before = Parameters::percent(information);
    for (std::size_t j = 0; j < before.size(); ++j) design.parameters[j].percent_before = before[j];
  }
  const auto precise = [&] {
    const auto now = Parameters::percent(information);
    return std::all_of(now.begin(), now.end(), [](const auto& p) { return p && *p < kPrecisePercent; });
  };
  while (chosen.size() < question.most_motions && !precise()) {
    const double now = log_determinant(information);
    std::optional<std::size_t> best;
    double most = 0.0;
    for (const std::size_t m : open_motions(bench, chosen, question)) {
      std::vector<std::size_t> more = chosen;
      more.push_back(m);
      const double gain = log_determinant(parameters.information(all, more)) - now;
      // A factor e in the volume of what is possible is the least that counts; then it is what the time brings.
      const Motion& motion = bench.motions()[m];
      const double merit = gain > 1.0 ? gain / (duration(motion) + kTrouble_s * motion.trouble) : 0.0;
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
  take(bench, chosen, design);
  return design;
}

}  // namespace flexspline::planning
