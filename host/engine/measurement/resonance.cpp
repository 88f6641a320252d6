#include "host/engine/measurement/resonance.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::measurement {
namespace {

constexpr double kProminenceDb = 3.0;
constexpr std::size_t kFewestResonanceLines = 12;
constexpr double kFewestSpan = 1.5;    // highest over lowest frequency
constexpr double kFitSpan = 1.5;       // lines from the extremum divided by this to the extremum times this
constexpr std::size_t kFitLines = 10;  // at least
constexpr double kLargestShift = 0.25;
constexpr double kLargestDamping = 0.8;
constexpr double kLargestStd = 0.05;     // of the frequency
constexpr double kLargestMisfit = 0.25;  // RMS of the relative deviation of lines from the fit
// Without noise the weights are those of a relative error.
constexpr double kSmallestStd = 1e-5;

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

struct Root {
  double frequency = 0.0;  // undamped, over that of the extremum
  double damping = 0.0;
  double frequency_std = 0.0;
  double damping_std = 0.0;
};

// The complex root nearest to the extremum of sum_k c[k] s^k, with the covariance of c; nothing where all are real.
std::optional<Root> root_near(const Vector& c, const Matrix& covariance) {
  const Eigen::Index degree = c.size() - 1;
  if (!c.allFinite() || !(std::abs(c[degree]) > 1e-12 * c.cwiseAbs().maxCoeff())) return std::nullopt;
  Matrix companion = Matrix::Zero(degree, degree);
  companion.diagonal(-1).setOnes();
  companion.col(degree - 1) = -c.head(degree) / c[degree];
  const Eigen::VectorXcd roots = algebra::complex_eigenvalues(companion);
  std::complex<double> p;
  for (const std::complex<double> root : roots)
    if (root.imag() > 0.0 && (p == 0.0 || std::abs(std::abs(root) - 1.0) < std::abs(std::abs(p) - 1.0))) p = root;
  if (p == 0.0) return std::nullopt;
  Root r;
  r.frequency = std::abs(p);
  r.damping = -p.real() / r.frequency;
  // dp = -sum_k p^k dc[k] / (derivative at p).
  std::complex<double> slope, power = 1.0;
  for (Eigen::Index k = 1; k <= degree; ++k, power *= p) slope += static_cast<double>(k) * c[k] * power;
  Vector of_frequency(c.size()), of_damping(c.size());
  power = 1.0;
  for (Eigen::Index k = 0; k <= degree; ++k, power *= p) {
    const std::complex<double> dp = -power / slope;
    of_frequency[k] = (std::conj(p) * dp).real() / r.frequency;
    of_damping[k] = (-dp.real() - r.damping * of_frequency[k]) / r.frequency;
  }
  r.frequency_std = std::sqrt(std::max(0.0, of_frequency.dot(covariance * of_frequency)));
  r.damping_std = std::sqrt(std::max(0.0, of_damping.dot(covariance * of_damping)));
  return r;
}

// sum_k b[k] s^k / (sum_k a[k] s^k + s^order) of `zeros` and `poles` as its orders, about one extremum, in frequencies
// over that of the extremum.
class LocalFit {
 public:
  LocalFit(std::span<const ResponseLine> lines, double centre_hz, int zeros, int poles)
      : zeros_(zeros), poles_(poles), theta_(Vector::Zero(zeros + 1 + poles)) {
    for (const ResponseLine& line : lines) {
      s_.emplace_back(0.0, line.frequency_hz / centre_hz);
      g_.push_back(line.response);
      std_.push_back(std::max(line.std, kSmallestStd) * std::abs(line.response));
    }
    theta_[0] = theta_[zeros + 1] = 1.0;
    std::vector<std::complex<double>> instrument = g_;
    for (int iteration = 0; iteration < 30 && ok_; ++iteration) {
      solve(instrument);
      if (iteration >= 15)
        for (std::size_t k = 0; k < s_.size(); ++k) instrument[k] = model(k);
    }
  }

  bool ok() const { return ok_; }
  double chi2() const { return chi2_; }
  double misfit() const {
    double sum = 0.0;
    for (std::size_t k = 0; k < s_.size(); ++k) sum += std::norm(g_[k] - model(k)) / std::norm(g_[k]);
    return std::sqrt(sum / static_cast<double>(s_.size()));
  }
  double freedoms() const {
    return std::max(1.0, 2.0 * static_cast<double>(s_.size()) - static_cast<double>(theta_.size()));
  }

  // Covariances are scaled by what is left over where that is more than noise.
  std::optional<Root> root(bool of_zeros) const {
    const double scale = std::max(1.0, chi2_ / freedoms());
    const Eigen::Index b = zeros_ + 1;
    if (of_zeros) return root_near(theta_.head(b), scale * covariance_.topLeftCorner(b, b));
    Vector a(poles_ + 1);
    a << theta_.tail(poles_), 1.0;
    Matrix covariance = Matrix::Zero(poles_ + 1, poles_ + 1);
    covariance.topLeftCorner(poles_, poles_) = scale * covariance_.bottomRightCorner(poles_, poles_);
    return root_near(a, covariance);
  }

 private:
  std::complex<double> polynomial(Eigen::Index first, int order, std::complex<double> s) const {
    std::complex<double> sum, power = 1.0;
    for (int c = 0; c < order; ++c, power *= s) sum += theta_[first + c] * power;
    return sum;
  }
  std::complex<double> denominator(std::size_t k) const {
    return polynomial(zeros_ + 1, poles_, s_[k]) + std::pow(s_[k], poles_);
  }
  std::complex<double> model(std::size_t k) const { return polynomial(0, zeros_ + 1, s_[k]) / denominator(k); }

  // B(s) - G (A(s) - s^order) = G s^order, weighted by the denominator of the iteration before.
  void solve(const std::vector<std::complex<double>>& instrument) {
    const Eigen::Index n = theta_.size();
    Matrix normal = Matrix::Zero(n, n), of_instruments = Matrix::Zero(n, n);
    Vector right = Vector::Zero(n);
    Eigen::VectorXcd row(n), z(n);
    for (std::size_t k = 0; k < s_.size(); ++k) {
      const double weight = 1.0 / (std_[k] * std::max(1e-9, std::abs(denominator(k))));
      const auto fill = [&](Eigen::VectorXcd& r, std::complex<double> g) {
        std::complex<double> power = weight;
        for (int c = 0; c <= zeros_; ++c, power *= s_[k]) r[c] = power;
        power = -g * weight;
        for (int c = 0; c < poles_; ++c, power *= s_[k]) r[zeros_ + 1 + c] = power;
      };
      fill(row, g_[k]);
      fill(z, instrument[k]);
      // Real and imaginary parts are equations of their own: the real part of the product with the conjugate.
      normal += (z.conjugate() * row.transpose()).real();
      of_instruments += (z.conjugate() * z.transpose()).real();
      right += (z.conjugate() * (weight * g_[k] * std::pow(s_[k], poles_))).real();
    }
    const Vector next = algebra::FullPivotLu(normal).solve(right);
    ok_ = next.allFinite();
    if (!ok_) return;
    theta_ = next;
    chi2_ = 0.0;
    for (std::size_t k = 0; k < s_.size(); ++k) chi2_ += std::norm((g_[k] - model(k)) / std_[k]);
    ok_ = std::isfinite(chi2_);
    covariance_ = algebra::LeastNormSolver(of_instruments).pseudo_inverse();
  }

  int zeros_, poles_;
  std::vector<std::complex<double>> s_, g_;
  std::vector<double> std_;
  Vector theta_;
  Matrix covariance_;
  double chi2_ = 0.0;
  bool ok_ = true;
};

// Of the orders that may do, the one with the smallest information criterion (Schwarz), in units of what the largest
// model that can be fitted leaves over.
std::optional<Root> fitted_root(std::span<const ResponseLine> lines, double centre_hz, bool of_zeros) {
  constexpr std::pair<int, int> kOrders[] = {{2, 2}, {2, 3}, {3, 3}, {4, 4}};
  std::vector<LocalFit> fits;
  double scale = 0.0;
  for (const auto& [zeros, poles] : kOrders) {
    if (2 * lines.size() < 2 * static_cast<std::size_t>(zeros + poles + 1)) continue;
    LocalFit fit(lines, centre_hz, zeros, poles);
    if (!fit.ok()) continue;
    const double left = std::max(1.0, fit.chi2() / fit.freedoms());
    scale = fits.empty() ? left : std::min(scale, left);
    fits.push_back(std::move(fit));
  }
  const LocalFit* best = nullptr;
  double lowest = 0.0;
  const double rows = 2.0 * static_cast<double>(lines.size());
  for (const LocalFit& fit : fits) {
    const double criterion = fit.chi2() / scale + (rows - fit.freedoms()) * std::log(rows);
    if (best == nullptr || criterion < lowest) {
      best = &fit;
      lowest = criterion;
    }
  }
  return best == nullptr || best->misfit() > kLargestMisfit ? std::nullopt : best->root(of_zeros);
}

// By how much a maximum is above the higher one of the lowest points that lead to higher ground, in dB.
double prominence(const std::vector<double>& x, std::size_t at) {
  double left = x[at], right = x[at];
  for (std::size_t k = at; k-- > 0 && x[k] <= x[at];) left = std::min(left, x[k]);
  for (std::size_t k = at + 1; k < x.size() && x[k] <= x[at]; ++k) right = std::min(right, x[k]);
  return x[at] - std::max(left, right);
}

// Nothing where no pole or zero that is broad enough to be distinguished from a single line explains the extremum.
std::optional<Resonance> resonance_at(std::span<const ResponseLine> lines, std::size_t at, bool anti,
                                      double resolution_hz, bool windowed) {
  const double centre = lines[at].frequency_hz;
  std::size_t first = at, last = at + 1;
  while (first > 0 && (lines[first - 1].frequency_hz > centre / kFitSpan || at - first < kFitLines / 2)) --first;
  while (last < lines.size() && (lines[last].frequency_hz < centre * kFitSpan || last - first < kFitLines)) ++last;

  const std::optional<Root> q = fitted_root(lines.subspan(first, last - first), centre, anti);
  if (!q || std::abs(q->frequency - 1.0) > kLargestShift || q->damping > kLargestDamping) return std::nullopt;
  Resonance r;
  r.anti = anti;
  r.frequency_hz = q->frequency * centre;
  r.frequency_std_hz = q->frequency_std * centre;
  r.damping = std::max(0.0, q->damping);
  r.damping_std = q->damping_std;
  const double width_hz = 2.0 * r.damping * r.frequency_hz;
  r.damping_is_upper_limit = windowed && width_hz < 2.0 * resolution_hz;
  // A drive's poles are damped; its zeros may be beyond the axis by a delay or by noise.
  const bool damped = anti ? q->damping > -3.0 * q->damping_std - 0.02 : q->damping > 2.0 * q->damping_std;
  const bool broad = width_hz > (windowed ? 0.5 : anti ? -1.0 : 0.1) * resolution_hz;
  const bool sure = r.frequency_std_hz < kLargestStd * r.frequency_hz;
  return damped && broad && sure ? std::optional(r) : std::nullopt;
}

}  // namespace

ResonanceSearch find_resonances(std::span<const ResponseLine> response, double resolution_hz, bool windowed) {
  std::vector<ResponseLine> lines;
  for (const ResponseLine& line : response)
    if (line.trusted) lines.push_back(line);
  ResonanceSearch search;
  search.trusted_lines = lines.size();
  if (!lines.empty()) {
    search.from_hz = lines.front().frequency_hz;
    search.to_hz = lines.back().frequency_hz;
  }
  if (lines.size() < kFewestResonanceLines || search.to_hz < kFewestSpan * search.from_hz) {
    const std::string count = lines.size() == 1 ? "one line" : fmt::format("{} lines", lines.size());
    search.why_not = lines.empty() ? "no line of the response can be trusted"
                                   : fmt::format(
                                         "only {} of the response can be trusted, from {:.3g} to {:.3g} Hz: "
                                         "too few for a resonance to show",
                                         count, search.from_hz, search.to_hz);
    return search;
  }
  std::vector<double> up(lines.size()), down(lines.size());
  for (std::size_t k = 0; k < lines.size(); ++k) {
    up[k] = 20.0 * std::log10(std::abs(lines[k].response));
    down[k] = -up[k];
  }
  for (const bool anti : {false, true}) {
    const std::vector<double>& x = anti ? down : up;
    for (std::size_t k = 1; k + 1 < x.size(); ++k) {
      if (x[k] < x[k - 1] || x[k] <= x[k + 1]) continue;
      const double uncertain = 20.0 * std::log10(1.0 + lines[k].band);
      if (!(prominence(x, k) > kProminenceDb + 2.0 * uncertain)) continue;
      const auto r = resonance_at(lines, k, anti, resolution_hz, windowed);
      const auto same = [&](const Resonance& other) {
        return other.anti == anti && std::abs(other.frequency_hz - r->frequency_hz) <
                                         resolution_hz + 2.0 * (other.frequency_std_hz + r->frequency_std_hz);
      };
      if (!r)
        ++search.unexplained;
      else if (std::none_of(search.found.begin(), search.found.end(), same))
        search.found.push_back(*r);
    }
  }
  std::sort(search.found.begin(), search.found.end(),
            [](const Resonance& a, const Resonance& b) { return a.frequency_hz < b.frequency_hz; });
  return search;
}

}  // namespace flexspline::measurement
