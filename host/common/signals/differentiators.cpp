#include "host/common/signals/differentiators.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "host/common/signals/differentiate.hpp"

namespace flexspline::signals {
namespace {

using std::numbers::pi;

constexpr std::string_view kPlain = "section 1.3.4";
constexpr std::string_view kFiltered = "eq. 22, 24";

constexpr DifferentiatorInfo kTable[] = {
    {Differentiator::backward, "backward", AnalogFilter::none, Discretisation::backward, kPlain,
     "Difference to the sample before: late by half a sample, and all noise of the position over the sample time.",
     false, true},
    {Differentiator::bilinear, "bilinear", AnalogFilter::none, Discretisation::bilinear, "eq. 20",
     "No delay, but gain that grows without bound towards half the sample rate, where it rings for ever.", false, true},
    {Differentiator::bilinear_prewarped, "bilinear-prewarped", AnalogFilter::none, Discretisation::bilinear_prewarped,
     "eq. 20, warped", "As bilinear, with the gain exact at the cut-off instead of at standstill.", true, true},
    {Differentiator::impulse_invariant, "impulse-invariant", AnalogFilter::none, Discretisation::impulse_invariant,
     kPlain,
     "Inverse of the sampled impulse response of an integrator: without a filter the same as the backward difference.",
     false, true},
    {Differentiator::matched, "matched", AnalogFilter::none, Discretisation::matched, kPlain,
     "The zero at standstill and nothing else to match: without a filter the same as the backward difference.", false,
     true},
    {Differentiator::h1_backward, "h1-backward", AnalogFilter::h1, Discretisation::backward, kFiltered,
     "Butterworth poles of second order; the backward rule damps them more than they should be.", true, true},
    {Differentiator::h1_bilinear, "h1-bilinear", AnalogFilter::h1, Discretisation::bilinear, "eq. 20, 22, 24",
     "Butterworth poles of second order: late by sqrt(2) / w0.", true, true},
    {Differentiator::h1_bilinear_prewarped, "h1-bilinear-prewarped", AnalogFilter::h1,
     Discretisation::bilinear_prewarped, "eq. 20, 22, 24", "As h1-bilinear, exact at the cut-off.", true, true},
    {Differentiator::h1_impulse_invariant, "h1-impulse-invariant", AnalogFilter::h1, Discretisation::impulse_invariant,
     kFiltered, "Sampled impulse response: aliasing turns a constant position into a velocity. No acceleration.", true,
     false},
    {Differentiator::h1_matched, "h1-matched", AnalogFilter::h1, Discretisation::matched, kFiltered,
     "Butterworth poles of second order where they are, exact at standstill.", true, true},
    {Differentiator::h2_backward, "h2-backward", AnalogFilter::h2, Discretisation::backward, kFiltered,
     "Two real poles; the backward rule moves them a little lower.", true, true},
    {Differentiator::h2_bilinear, "h2-bilinear", AnalogFilter::h2, Discretisation::bilinear, "eq. 20, 22 to 24",
     "Two real poles: late by 2 / w0, and no overshoot.", true, true},
    {Differentiator::h2_bilinear_prewarped, "h2-bilinear-prewarped", AnalogFilter::h2,
     Discretisation::bilinear_prewarped, "eq. 20, 22 to 24", "As h2-bilinear, exact at the cut-off.", true, true},
    {Differentiator::h2_impulse_invariant, "h2-impulse-invariant", AnalogFilter::h2, Discretisation::impulse_invariant,
     kFiltered, "Sampled impulse response: aliasing turns a constant position into a velocity. No acceleration.", true,
     false},
    {Differentiator::h2_matched, "h2-matched", AnalogFilter::h2, Discretisation::matched, kFiltered,
     "Two real poles where they are, exact at standstill.", true, true},
    {Differentiator::butterworth, "butterworth", AnalogFilter::butterworth, Discretisation::forward_backward, kPlain,
     "Butterworth of order five, forward and backward, then central differences: no delay, and no use in real time.",
     true, true},
};

// Coefficients of (1 - q)^m (1 + q)^n.
std::vector<double> edge_zeros(int m, int n) {
  std::vector<double> p{1.0};
  const auto times = [&](double root) {
    p.push_back(0.0);
    for (std::size_t k = p.size() - 1; k > 0; --k) p[k] += root * p[k - 1];
  };
  for (int k = 0; k < m; ++k) times(-1.0);
  for (int k = 0; k < n; ++k) times(1.0);
  return p;
}

double damping_of(AnalogFilter filter) {
  return filter == AnalogFilter::h1 ? 0.5 * std::numbers::sqrt2 : 1.0;
}

// Slope of a polynomial at q = 1, and its value there.
double sum_of(const std::array<double, 3>& p) {
  return p[0] + p[1] + p[2];
}
double slope_of(const std::array<double, 3>& p) {
  return p[1] + 2.0 * p[2];
}

}  // namespace

std::span<const DifferentiatorInfo> differentiators() {
  return kTable;
}

const DifferentiatorInfo& info_of(Differentiator which) {
  return kTable[static_cast<std::size_t>(which)];
}

std::optional<Differentiator> differentiator_from_name(std::string_view name) {
  for (const DifferentiatorInfo& info : kTable)
    if (info.name == name) return info.which;
  return std::nullopt;
}

DifferentiatingFilter::DifferentiatingFilter(Differentiator which, double cutoff_hz, double sample_s)
    : info_(&info_of(which)), cutoff_hz_(cutoff_hz), sample_s_(sample_s) {
  if (!(sample_s > 0.0) || !std::isfinite(sample_s))
    throw std::invalid_argument(
        fmt::format("derivative: sample time {} s is not positive; check the time column", sample_s));
  if (info_->uses_cutoff && !(cutoff_hz > 0.0 && cutoff_hz * sample_s < 0.5))
    throw std::invalid_argument(
        fmt::format("derivative {}: cut-off {} Hz is not between 0 and half the sample rate ({} Hz); choose a lower "
                    "cut-off",
                    info_->name, cutoff_hz, 0.5 / sample_s));
  if (info_->filter == AnalogFilter::butterworth) {
    zero_phase_.emplace(ZeroPhaseFilter::kDefaultOrder, cutoff_hz, 1.0 / sample_s);
    return;
  }
  for (int order = 0; order <= 2; ++order)
    if (order < 2 || info_->gives_acceleration) rationals_[static_cast<std::size_t>(order)] = designed(order);
}

// s = scale (1 - q), or scale (1 - q) / (1 + q), in polynomials of s with the lowest power first.
DifferentiatingFilter::Rational DifferentiatingFilter::substituted(std::span<const double> numerator,
                                                                   std::span<const double> denominator, double scale,
                                                                   bool bilinear) {
  const int degree = static_cast<int>(std::max(numerator.size(), denominator.size())) - 1;
  const auto in_q = [&](std::span<const double> p) {
    std::array<double, 3> result{};
    double power = 1.0;
    for (int j = 0; j < static_cast<int>(p.size()); ++j, power *= scale) {
      const std::vector<double> zeros = edge_zeros(j, bilinear ? degree - j : 0);
      for (std::size_t k = 0; k < zeros.size(); ++k) result[k] += p[static_cast<std::size_t>(j)] * power * zeros[k];
    }
    return result;
  };
  Rational g{in_q(numerator), in_q(denominator)};
  const double first = g.a[0];
  for (double& x : g.b) x /= first;
  for (double& x : g.a) x /= first;
  return g;
}

DifferentiatingFilter::Rational DifferentiatingFilter::designed(int order) const {
  const double T = sample_s_, w0 = 2.0 * pi * cutoff_hz_;
  const bool plain = info_->filter == AnalogFilter::none;
  const double zeta = damping_of(info_->filter);
  std::vector<double> numerator(static_cast<std::size_t>(order) + 1, 0.0);
  numerator.back() = plain ? 1.0 : w0 * w0;
  const std::vector<double> denominator = plain ? std::vector{1.0} : std::vector{w0 * w0, 2.0 * zeta * w0, 1.0};

  Discretisation how = info_->discretisation;
  if (plain && (how == Discretisation::impulse_invariant || how == Discretisation::matched))
    how = Discretisation::backward;
  switch (how) {
    case Discretisation::backward:
      return substituted(numerator, denominator, 1.0 / T, false);
    case Discretisation::bilinear:
      return substituted(numerator, denominator, 2.0 / T, true);
    case Discretisation::bilinear_prewarped:
      return substituted(numerator, denominator, w0 / std::tan(0.5 * w0 * T), true);
    case Discretisation::impulse_invariant:
    case Discretisation::matched:
    case Discretisation::forward_backward:
      break;
  }
  // Poles at exp((-zeta +- j sqrt(1 - zeta^2)) w0 T).
  const double r = std::exp(-zeta * w0 * T), swing = std::sqrt(std::max(0.0, 1.0 - zeta * zeta)) * w0 * T;
  const double re = r * std::cos(swing);
  Rational g;
  g.a = {1.0, -2.0 * re, r * r};
  if (how == Discretisation::matched) {
    const std::vector<double> zeros = edge_zeros(order, 2 - order);
    const double gain = sum_of(g.a) * std::pow(T, -order) * std::pow(2.0, order - 2);
    for (std::size_t k = 0; k < zeros.size(); ++k) g.b[k] = gain * zeros[k];
    return g;
  }
  // Impulse responses times T: of H, w0^2 exp(-zeta w0 t) sin(wd t) / wd, with t in place of the quotient where both
  // poles are real; of s H its derivative, half of whose jump at the start counts.
  const double sine_over_wd = swing > 0.0 ? r * std::sin(swing) / (swing / T) : r * T;
  if (order == 0) {
    g.b = {0.0, T * w0 * w0 * sine_over_wd, 0.0};
  } else {
    const double scale = T * w0 * w0;
    g.b = {scale, scale * (-re - zeta * w0 * sine_over_wd), 0.0};
    for (std::size_t k = 0; k < 3; ++k) g.b[k] -= 0.5 * scale * g.a[k];
  }
  return g;
}

const DifferentiatingFilter::Rational& DifferentiatingFilter::rational(int order) const {
  return rationals_[static_cast<std::size_t>(order)];
}

std::vector<double> DifferentiatingFilter::applied(const Rational& g, std::span<const double> signal) const {
  const std::size_t n = signal.size();
  std::vector<double> result(n);
  if (n == 0) return result;
  // The line through the first two samples has a response in closed form; what is left starts from zero.
  const double step = n > 1 ? signal[1] - signal[0] : 0.0;
  const double gain = sum_of(g.b) / sum_of(g.a);
  const double lag = (slope_of(g.b) - gain * slope_of(g.a)) / sum_of(g.a);
  double s1 = 0.0, s2 = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const auto at = static_cast<double>(k);
    const double x = (signal[k] - signal[0]) - at * step;
    const double y = g.b[0] * x + s1;
    s1 = g.b[1] * x - g.a[1] * y + s2;
    s2 = g.b[2] * x - g.a[2] * y;
    result[k] = y + gain * (signal[0] + at * step) - lag * step;
  }
  return result;
}

Derivatives DifferentiatingFilter::apply(std::span<const double> position) const {
  Derivatives d;
  if (zero_phase_) {
    d.position = zero_phase_->apply(position);
    d.velocity = central_derivative(d.position, sample_s_);
    d.acceleration = central_derivative(d.velocity, sample_s_);
    return d;
  }
  d.position = applied(rational(0), position);
  d.velocity = applied(rational(1), position);
  if (info_->gives_acceleration) d.acceleration = applied(rational(2), position);
  return d;
}

std::complex<double> DifferentiatingFilter::response(int order, double frequency_hz) const {
  if (order < 0 || order > 2 || (order == 2 && !info_->gives_acceleration))
    throw std::invalid_argument(fmt::format("derivative {}: it gives no derivative of order {}", info_->name, order));
  const double phase = 2.0 * pi * frequency_hz * sample_s_;
  if (zero_phase_)
    return zero_phase_->gain(frequency_hz) *
           std::pow(std::complex<double>(0.0, std::sin(phase) / sample_s_), static_cast<double>(order));
  const std::complex<double> q = std::polar(1.0, -phase);
  const auto at = [&](const std::array<double, 3>& p) { return p[0] + q * (p[1] + q * p[2]); };
  return at(rational(order).b) / at(rational(order).a);
}

double DifferentiatingFilter::gain_error(int order, double frequency_hz) const {
  return std::abs(response(order, frequency_hz)) / std::pow(2.0 * pi * frequency_hz, order) - 1.0;
}

double DifferentiatingFilter::group_delay_samples(int order, double frequency_hz) const {
  (void)response(order, frequency_hz);
  if (zero_phase_) return 0.0;
  const std::complex<double> q = std::polar(1.0, -2.0 * pi * frequency_hz * sample_s_);
  // -d arg p / d(w T) of a polynomial in q = exp(-j w T).
  const auto delay = [&](const std::array<double, 3>& p) {
    return ((q * (p[1] + 2.0 * q * p[2])) / (p[0] + q * (p[1] + q * p[2]))).real();
  };
  return delay(rational(order).b) - delay(rational(order).a);
}

double DifferentiatingFilter::noise_gain(int order) const {
  (void)response(order, 0.0);
  const auto length_of = [](const std::vector<double>& x) {
    double sum = 0.0;
    for (const double v : x) sum += v * v;
    return std::sqrt(sum);
  };
  if (zero_phase_) {
    const std::size_t half = 4 * zero_phase_->settling_samples() + 8;
    std::vector<double> impulse(2 * half + 1, 0.0);
    impulse[half] = 1.0;
    const Derivatives d = apply(impulse);
    return length_of(order == 0 ? d.position : order == 1 ? d.velocity : d.acceleration);
  }
  const bool rings =
      info_->filter == AnalogFilter::none && (info_->discretisation == Discretisation::bilinear ||
                                              info_->discretisation == Discretisation::bilinear_prewarped);
  if (order > 0 && rings) return std::numeric_limits<double>::infinity();
  // Energy of the impulse response: autocovariance of a second-order recursion at lag zero, from its three equations.
  const Rational& g = rational(order);
  const double a1 = g.a[1], a2 = g.a[2];
  const double g0 = g.b[0], g1 = g.b[1] - a1 * g0, g2 = g.b[2] - a1 * g1 - a2 * g0;
  // r0 + a1 r1 + a2 r2 = c0 and so on, with r the autocorrelation of the response and c its cross-correlation with b.
  const double c0 = g.b[0] * g0 + g.b[1] * g1 + g.b[2] * g2, c1 = g.b[1] * g0 + g.b[2] * g1, c2 = g.b[2] * g0;
  // r1 = (c1 - a1 r0) / (1 + a2); r2 = c2 - a1 r1 - a2 r0.
  const double r1_constant = c1 / (1.0 + a2), r1_slope = -a1 / (1.0 + a2);
  const double constant = a1 * r1_constant + a2 * (c2 - a1 * r1_constant);
  const double slope = 1.0 + a1 * r1_slope + a2 * (-a1 * r1_slope - a2);
  return std::sqrt((c0 - constant) / slope);
}

}  // namespace flexspline::signals
