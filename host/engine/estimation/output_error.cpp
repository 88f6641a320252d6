#include "host/engine/estimation/output_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "host/engine/estimation/free_motion.hpp"
#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/minimise.hpp"
#include "host/engine/estimation/variable_projection.hpp"
#include "host/physics/simulation/initial_motion.hpp"

namespace flexspline::estimation {
namespace {

constexpr double kFar = 100.0;          // standard errors of least squares
constexpr double kShownAtLeast = 1e-6;  // of the error's size, by a step of one standard error
// Steps with one Jacobian, and the number of Jacobians.
constexpr int kIterations = 12;
constexpr int kRounds = 3;
constexpr double kConverged = 0.1;  // in standard errors: slopes found before such a move serve after it
// A step too short for slopes by differences: what is left of the search is rounding and standstills that come and go.
constexpr double kLeastMove = 0.01;
constexpr double kStep_s = 1.0 / 4000.0;  // of the integration
// A velocity that shapes friction: least squares cannot find one below the speeds that its mask leaves, but a free run
// passes through all speeds.
constexpr double kBelowTheMask = 0.02;  // of the slowest rows' speed
constexpr double kEndOfRange = 0.005;   // of a range
constexpr int kStarts = 4;              // over the range, where least squares found no start

// A free parameter, moved in units of its standard error from least squares.
struct Free {
  ParameterRef ref;
  std::size_t fit = 0;
  Eigen::Index at = 0;  // in the covariance of the fit
  double start = 0.0;
  double unit = 0.0;
  double low = 0.0, high = 0.0;
  bool nonlinear = false;
  bool without_start = false;  // least squares stopped at the end of its range

  // Where `value` is at an end of the range.
  bool at_an_end(double value) const {
    const double share = std::log(std::max(value, 1e-300) / low) / std::log(high / low);
    return nonlinear && low > 0.0 && (share < kEndOfRange || share > 1.0 - kEndOfRange);
  }
  double in_units(double value) const { return (value - start) / unit; }
};

// The initial velocity of a record. The first sample is noisy, so it is estimated with the parameters.
struct StartVelocity {
  std::size_t record = 0;
  double velocity = 0.0;  // as measured
  double unit = 0.0;
};

// What is compared in a record.
enum class Signal { velocity, position, torque };
struct Part {
  std::size_t record = 0;
  Signal signal{};
  RowRange range;
  double weight = 1.0;
};

double signal_of(const Record& record, std::size_t sample, Signal signal) {
  const auto& in = record.inputs;
  return signal == Signal::velocity   ? in.velocity_at(sample)
         : signal == Signal::position ? in.angle_at(sample)
                                      : in.torque_at(sample);
}

class OutputError {
 public:
  explicit OutputError(Identification& identification) : all_(identification) {
    for (std::size_t b = 0; b < all_.fits.size(); ++b) {
      const BalanceFit& fit = all_.fits[b];
      for (std::size_t j = 0; j < fit.linear.size() + fit.nonlinear.size(); ++j)
        add(b, j < fit.linear.size() ? fit.linear[j] : fit.nonlinear[j - fit.linear.size()],
            static_cast<Eigen::Index>(j), j >= fit.linear.size());
    }
    const FreeMotion motion = run_free({});
    usable_ = motion.simulated;
    Eigen::Index rows = 0;
    for (std::size_t i = 0; i < all_.prepared.records.size(); ++i) {
      const Record& record = all_.prepared.records[i];
      if (!motion.simulated[i] || record.at_rest || !record.has_motor_motion) continue;
      take(i, record.locked ? Signal::position : Signal::velocity, rows);
      if (all_.prepared.output_signals.torque && record.experiment->has(data::Column::torque))
        take(i, Signal::torque, rows);
    }
    rows_ = rows;
    const Eigen::VectorXd error = errors(motion);
    add_starts(error);
    std::vector<RowRange> ranges;
    for (const Part& part : parts_) ranges.push_back(part.range);
    const Eigen::VectorXd weights = by_signal(error);
    for (Part& part : parts_) part.weight = weights[part.range.first];
  }

  bool empty() const { return rows_ == 0 || free_.empty(); }
  Eigen::Index rows() const { return rows_; }
  std::vector<Free>& free() { return free_; }
  const std::vector<StartVelocity>& starts() const { return starts_; }
  std::size_t unknowns() const { return free_.size() + starts_.size(); }
  const std::vector<Part>& parts() const { return parts_; }
  const std::vector<std::uint8_t>& usable() const { return usable_; }

  // Puts positions (in units from the start) into the terms and the first velocities.
  void set(const double* x) {
    for (std::size_t i = 0; i < starts_.size(); ++i)
      initial_[starts_[i].record] = starts_[i].velocity + x[free_.size() + i] * starts_[i].unit;
    for (std::size_t j = 0; j < free_.size(); ++j)
      all_.terms[free_[j].ref.term].values[free_[j].ref.parameter] = free_[j].start + x[j] * free_[j].unit;
  }
  // Weighted errors of the terms at their present values, zero in records other than those of `only` (empty: all).
  // Empty where a record that could be simulated no longer can.
  Eigen::VectorXd weighted(const std::vector<std::uint8_t>& only = {}) {
    const std::vector<std::uint8_t>& run = only.empty() ? usable_ : only;
    const FreeMotion motion = run_free(run);
    if (motion.simulated != run) return {};
    Eigen::VectorXd e = errors(motion);
    for (const Part& part : parts_) e.segment(part.range.first, part.range.size()) *= part.weight;
    return e;
  }
  // Records whose free run depends on a parameter: the load's parameters do not act where the load is locked.
  std::vector<std::uint8_t> moved_by(const Free& free) const {
    const catalogue::Entry& entry = *all_.terms[free.ref.term].entry;
    const bool load_alone = entry.info->phase == effects::Phase::source && !entry.adds_to(Balance::motor) &&
                            !entry.adds_to(Balance::transmission);
    std::vector<std::uint8_t> records = usable_;
    for (std::size_t i = 0; i < records.size(); ++i)
      if (load_alone && all_.prepared.records[i].locked) records[i] = 0;
    return records;
  }

 private:
  FreeMotion run_free(const std::vector<std::uint8_t>& only) const {
    FreeMotionOptions how;
    how.initial_velocity = initial_;
    how.only = only;
    how.step_s = kStep_s;
    return free_motion(all_, how);
  }
  void add(std::size_t b, ParameterRef ref, Eigen::Index at, bool nonlinear_ref) {
    const BalanceFit& fit = all_.fits[b];
    if (fit.root_tolerance[at] < kUndetermined) return;
    const Term& term = all_.terms[ref.term];
    const auto& info = term.entry->parameters[ref.parameter];
    Free f{ref, b, at, term.values[ref.parameter], 0.0, info.low, info.high, nonlinear_ref, false};
    const double variance = fit.covariance(at, at);
    f.unit = std::isfinite(variance) && variance > 0.0 ? std::sqrt(variance) : 0.01 * std::abs(f.start);
    f.unit = std::max(f.unit, 1e-4 * std::abs(f.start));
    if (nonlinear_ref) {
      const ParameterRange range = parameter_range(all_.data[b], term, ref.parameter);
      f.low = range.low;
      f.high = range.high;
      f.without_start = range.logarithmic && f.at_an_end(f.start);
      if (info.limit == effects::Limit::velocity) f.low = std::max(info.low, kBelowTheMask * range.low);
      f.unit = std::min(f.unit, 0.1 * (range.high - range.low));
    }
    if (f.unit > 0.0) free_.push_back(f);
  }
  // In moving records of one piece; a locked motor hardly moves at its start.
  void add_starts(const Eigen::VectorXd& error) {
    initial_.assign(all_.prepared.records.size(), std::nullopt);
    for (const Part& part : parts_) {
      const Record& record = all_.prepared.records[part.record];
      if (part.signal != Signal::velocity || record.segments.size() != 1) continue;
      const auto measured = simulation::initial_motion(*record.experiment, record.experiment->segments.front(),
                                                       data::Column::motor_position, data::Column::motor_velocity);
      const Eigen::Index n = part.range.size();
      const double unit = error.segment(part.range.first, n).norm() / std::sqrt(static_cast<double>(n));
      if (measured && unit > 0.0) starts_.push_back({part.record, measured->velocity, unit});
    }
  }
  void take(std::size_t record, Signal signal, Eigen::Index& rows) {
    const auto n = static_cast<Eigen::Index>(samples(record).size());
    if (n == 0) return;
    parts_.push_back({record, signal, {parts_.size(), rows, rows + n}, 1.0});
    rows += n;
  }
  // Every decimated sample counts: the free run is compared at reversals too.
  std::vector<std::size_t> samples(std::size_t record) const {
    const Record& r = all_.prepared.records[record];
    std::vector<std::size_t> result;
    for (const data::Segment& s : r.segments)
      for (std::size_t k = s.first; k < s.last; k += r.decimation)
        if (r.experiment->masked.empty() || !r.experiment->masked[k]) result.push_back(k);
    return result;
  }
  Eigen::VectorXd errors(const FreeMotion& motion) const {
    Eigen::VectorXd e = Eigen::VectorXd::Zero(rows_);
    for (const Part& part : parts_) {
      if (!motion.simulated[part.record]) continue;
      Eigen::Index row = part.range.first;
      for (const std::size_t k : samples(part.record))
        e[row++] = signal_of(all_.prepared.records[part.record], k, part.signal) -
                   signal_of(motion.prepared.records[part.record], k, part.signal);
    }
    return e;
  }
  // Weights of the records of one signal among themselves.
  Eigen::VectorXd by_signal(const Eigen::VectorXd& error) const {
    Eigen::VectorXd weights(error.size());
    for (const Signal signal : {Signal::velocity, Signal::position, Signal::torque}) {
      std::vector<RowRange> ranges;
      for (const Part& part : parts_)
        if (part.signal == signal) ranges.push_back(part.range);
      if (ranges.empty()) continue;
      const Eigen::VectorXd some = root_record_weights(ranges, error);
      for (const RowRange& range : ranges)
        weights.segment(range.first, range.size()) = some.segment(range.first, range.size());
    }
    return weights;
  }

  Identification& all_;
  std::vector<Free> free_;
  std::vector<StartVelocity> starts_;
  std::vector<std::optional<double>> initial_;  // velocities, by record
  std::vector<Part> parts_;
  std::vector<std::uint8_t> usable_;
  Eigen::Index rows_ = 0;
};

// Slopes of the weighted errors by a step of `step` units each, from both sides. An initial velocity acts on its own
// record alone, so all of them are changed in one run.
Eigen::MatrixXd slopes(OutputError& problem, const std::vector<double>& x,
                       const std::function<void(std::string_view)>& progress) {
  constexpr double kStep = 0.05;
  const std::size_t parameters = problem.free().size();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(problem.rows(), static_cast<Eigen::Index>(x.size()));
  const auto slope = [&](std::size_t first, std::size_t last,
                         const std::vector<std::uint8_t>& records) -> Eigen::VectorXd {
    std::vector<double> moved = x;
    Eigen::VectorXd both[2];
    for (const int side : {0, 1}) {
      for (std::size_t j = first; j < last; ++j) moved[j] = x[j] + (side == 0 ? kStep : -kStep);
      problem.set(moved.data());
      both[side] = problem.weighted(records);
      if (both[side].size() == 0) return Eigen::VectorXd::Zero(problem.rows());
    }
    return (both[0] - both[1]) / (2.0 * kStep);
  };
  for (std::size_t j = 0; j < parameters; ++j) {
    progress(fmt::format("fitting the free run: slopes by parameter {} of {}", j + 1, parameters));
    J.col(static_cast<Eigen::Index>(j)) = slope(j, j + 1, problem.moved_by(problem.free()[j]));
  }
  if (!problem.starts().empty()) {
    const Eigen::VectorXd all = slope(parameters, x.size(), problem.usable());
    for (std::size_t i = 0; i < problem.starts().size(); ++i)
      for (const Part& part : problem.parts())
        if (part.record == problem.starts()[i].record)
          J.col(static_cast<Eigen::Index>(parameters + i)).segment(part.range.first, part.range.size()) =
              all.segment(part.range.first, part.range.size());
  }
  problem.set(x.data());
  return J;
}

// (J'J)^-1 s^2, corrected for the autocorrelation of the errors, into the covariances of the fits.
void take_covariance(Identification& identification, OutputError& problem, const Eigen::MatrixXd& J) {
  const Eigen::VectorXd e = problem.weighted();
  const LinearFit joint = least_squares(J, e, Eigen::VectorXd::Ones(e.size()));
  std::vector<RowRange> ranges;
  for (const Part& part : problem.parts()) ranges.push_back(part.range);
  const double time = autocorrelation_time(ranges, e);
  const double freedom = std::max(1.0, static_cast<double>(e.size() - J.cols()));
  std::vector<Eigen::Index> identified;
  for (Eigen::Index j = 0; j < J.cols(); ++j)
    if (std::isfinite(joint.unit_covariance(j, j))) identified.push_back(j);
  Eigen::MatrixXd covariance = joint.unit_covariance;
  const Eigen::MatrixXd unit = joint.unit_covariance(identified, identified);
  covariance(identified, identified) =
      unit * newey_west(ranges, J(Eigen::all, identified), e, newey_west_lags(time, e.size())) * unit *
      (static_cast<double>(e.size()) / freedom);
  const std::vector<Free>& free = problem.free();
  std::string unseen;
  for (std::size_t i = 0; i < free.size(); ++i) {
    BalanceFit& fit = identification.fits[free[i].fit];
    const auto a = static_cast<Eigen::Index>(i);
    if (J.col(a).norm() < kShownAtLeast * e.norm()) {
      const Term& term = identification.terms[free[i].ref.term];
      unseen += (unseen.empty() ? "" : ", ") +
                fmt::format("{}.{}", term.id, term.entry->parameters[free[i].ref.parameter].name);
      continue;
    }
    for (std::size_t j = 0; j < free.size(); ++j) {
      if (free[j].fit != free[i].fit) continue;
      fit.covariance(free[i].at, free[j].at) =
          covariance(a, static_cast<Eigen::Index>(j)) * free[i].unit * free[j].unit;
    }
    fit.autocorrelation_time = time;
  }
  if (!unseen.empty())
    identification.warnings.push_back(fmt::format("the free run does not show {}: as least squares found it", unseen));
}

// Errors and their slopes for the search. Slopes cost two free runs a parameter and hardly change on the way: they are
// computed once, corrected by what each step shows (Broyden 1965), and computed again only where that led far.
class BroydenErrors {
 public:
  BroydenErrors(OutputError& problem, const std::function<void(std::string_view)>& progress)
      : problem_(problem), progress_(progress) {}

  const Eigen::MatrixXd& slope() const { return J_; }
  void compute_slopes(const std::vector<double>& at) { J_ = slopes(problem_, at, progress_); }

  bool operator()(const std::vector<double>& at, Eigen::VectorXd& errors, Eigen::MatrixXd* slope) {
    if (at != seen_at_) {
      problem_.set(at.data());
      progress_(fmt::format("fitting the free run: step {}", ++runs_));
      Eigen::VectorXd now = problem_.weighted();
      if (now.size() == 0) return false;
      if (J_.size() > 0) correct(at, now);
      seen_at_ = at;
      seen_ = std::move(now);
    }
    errors = seen_;
    if (!slope) return true;
    if (J_.size() == 0) compute_slopes(at);
    *slope = J_;
    return true;
  }

 private:
  void correct(const std::vector<double>& at, const Eigen::VectorXd& now) {
    Eigen::VectorXd step(J_.cols());
    for (Eigen::Index j = 0; j < step.size(); ++j)
      step[j] = at[static_cast<std::size_t>(j)] - seen_at_[static_cast<std::size_t>(j)];
    if (step.norm() <= kLeastMove) return;
    const Eigen::VectorXd unforeseen = now - seen_ - J_ * step;
    J_ += unforeseen * (step / step.squaredNorm()).transpose();
  }

  OutputError& problem_;
  const std::function<void(std::string_view)>& progress_;
  Eigen::MatrixXd J_;
  std::vector<double> seen_at_;
  Eigen::VectorXd seen_;
  int runs_ = 0;
};

// In units from the start. Bounds make every step of the solver a search: those out of reach are left out.
Minimisation search_of(OutputError& problem) {
  Minimisation how;
  for (const Free& f : problem.free()) {
    const double low = (f.low - f.start) / f.unit, high = (f.high - f.start) / f.unit;
    how.low.push_back(low > -kFar ? std::min(0.0, low) : -INFINITY);
    how.high.push_back(high < kFar ? std::max(0.0, high) : INFINITY);
  }
  how.iterations = kIterations;
  how.function_tolerance = 1e-5;  // a hundredth of a standard error
  how.parameter_tolerance = 1e-5;
  return how;
}

// Where a search ended.
struct End {
  std::vector<double> x;
  Eigen::MatrixXd slopes;
  double cost = INFINITY;
};

End search_from(OutputError& problem, std::vector<double> x, const std::function<void(std::string_view)>& progress) {
  End end;
  problem.set(x.data());
  if (problem.weighted().size() == 0) return end;  // no free run from there
  const Minimisation how = search_of(problem);
  BroydenErrors errors(problem, progress);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> before = x;
    end.cost = minimise(x, problem.rows(), std::ref(errors), how);
    double moved = 0.0;
    for (std::size_t j = 0; j < problem.free().size(); ++j) moved = std::max(moved, std::abs(x[j] - before[j]));
    if (round > 0 && moved < kConverged) break;
    problem.set(x.data());
    errors.compute_slopes(x);
  }
  end.x = std::move(x);
  end.slopes = errors.slope();
  return end;
}

// From least squares, and over the range of each nonlinear parameter for which that found no start: a free run has
// local minima. The least error comes first.
std::vector<End> searches(OutputError& problem, const std::function<void(std::string_view)>& progress) {
  std::vector<End> ends;
  const auto search = [&](std::vector<double> x) {
    End end = search_from(problem, std::move(x), progress);
    if (std::isfinite(end.cost)) ends.push_back(std::move(end));
  };
  search(std::vector<double>(problem.unknowns(), 0.0));
  for (std::size_t j = 0; j < problem.free().size(); ++j) {
    const Free& f = problem.free()[j];
    for (int k = 0; f.without_start && k < kStarts; ++k) {
      std::vector<double> x(problem.unknowns(), 0.0);
      x[j] = f.in_units(f.low * std::pow(f.high / f.low, (k + 0.5) / kStarts));
      search(std::move(x));
    }
  }
  std::ranges::sort(ends, {}, &End::cost);
  return ends;
}

// No interval for a nonlinear parameter that the free run does not determine, nor for the others of its effect, whose
// values depend on it: it ended at an end of its range, another value leaves an error that is not significantly larger,
// or least squares had no start for it. Then the error has several minima (a shaft that breaks away jumps), and an
// interval from the slopes at one of them is too short: on the slow saw-tooth of the report's table 1 it held the truth
// in none of three runs.
void mark_undetermined(Identification& identification, OutputError& problem, const std::vector<End>& ends) {
  constexpr double kChi2 = 3.84;  // 95 %, one parameter
  for (std::size_t j = 0; j < problem.free().size(); ++j) {
    const Free& f = problem.free()[j];
    if (!f.nonlinear) continue;
    BalanceFit& fit = identification.fits[f.fit];
    const Term& term = identification.terms[f.ref.term];
    const double value = f.start + ends.front().x[j] * f.unit;
    const double error = std::sqrt(fit.covariance(f.at, f.at));
    const double independent = static_cast<double>(problem.rows()) / std::max(1.0, fit.autocorrelation_time);
    std::string why = f.at_an_end(value) ? "the search ended at an end of its range" : "";
    for (const End& end : ends) {
      const double other = f.start + end.x[j] * f.unit;
      const bool as_good = independent * (end.cost / ends.front().cost - 1.0) < kChi2;
      if (why.empty() && as_good && std::abs(other - value) > 2.0 * error)
        why = fmt::format("{:.4g} and {:.4g} leave the same error", value, other);
    }
    const bool undetermined = !why.empty();
    if (!undetermined && f.without_start) {
      why = "several minima, no interval; searches from several starts ended, by increasing error, at";
      for (const End& end : ends) why += fmt::format(" {:.4g}", f.start + end.x[j] * f.unit);
    }
    if (why.empty()) continue;
    identification.warnings.push_back(fmt::format("{}.{}: {}{}", term.id, term.entry->parameters[f.ref.parameter].name,
                                                  undetermined ? "the free run does not determine it: " : "", why));
    if (undetermined) fit.root_tolerance[f.at] = 0.0;
    for (const Free& g : problem.free()) {
      if (g.fit != f.fit || g.ref.term != f.ref.term) continue;
      fit.covariance.row(g.at).setZero();
      fit.covariance.col(g.at).setZero();
      fit.covariance(g.at, g.at) = INFINITY;
    }
  }
}

}  // namespace

void refit_to_output(Identification& identification, const std::function<void(std::string_view)>& progress) {
  OutputError problem(identification);
  if (problem.empty()) {
    identification.warnings.push_back(
        "no record has a free run to fit to: the values are those of least squares. An inertia and the effects of the "
        "balances are needed for one");
    return;
  }
  const std::vector<End> ends = searches(problem, progress);
  if (ends.empty()) {
    identification.warnings.push_back("no free run starts from the values of least squares: they are kept");
    return;
  }
  const End& best = ends.front();
  problem.set(best.x.data());
  take_covariance(identification, problem, best.slopes);
  problem.set(best.x.data());
  mark_undetermined(identification, problem, ends);
  for (std::size_t b = 0; b < identification.fits.size(); ++b)
    identification.fits[b].residual = identification.data[b].residual(identification.terms);
  std::string without;
  for (std::size_t i = 0; i < problem.usable().size(); ++i)
    if (!problem.usable()[i]) without += (without.empty() ? "" : ", ") + identification.prepared.records[i].name;
  if (!without.empty())
    identification.warnings.push_back(fmt::format("no free run, and so no part in the fit, for {}", without));
}

}  // namespace flexspline::estimation
