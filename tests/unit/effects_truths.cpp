#include "tests/unit/effects_truths.hpp"

namespace flexspline::tests {
namespace {

Truth each(std::function<double(const Values& p, const Instant& x)> term) {
  return [term](const Values& p, const Record& record) {
    Values result;
    for (const Instant& x : record) result.push_back(term(p, x));
    return result;
  };
}

// z' = w (1 - s(w) sigma z / Ts) by Runge and Kutta over the travel, in many steps a sample.
Values dahl_truth(const Values& p, const Record& record) {
  const double torque = p[0];
  const double sigma = p[0] / p[1];
  double z = 0.0;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const double travel = k == 0 ? 0.0 : record[k].q - record[k - 1].q;
    const int steps = 20 + static_cast<int>(40.0 * std::abs(travel) / p[1]);
    const double h = travel / steps;
    const auto slope = [&](double at) { return 1.0 - s(travel) * sigma * at / torque; };
    for (int n = 0; n < steps; ++n) {
      const double k1 = slope(z);
      const double k2 = slope(z + 0.5 * h * k1);
      const double k3 = slope(z + 0.5 * h * k2);
      const double k4 = slope(z + h * k3);
      z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    result.push_back(sigma * z);
  }
  return result;
}

// The solution of z' = slope(z) along a path from `from` to `to`, by Runge and Kutta in steps of at most `longest`.
// `slope(z, x, s)` is by the path's variable x, s the direction.
template <class Slope>
double along_path(double z, double from, double to, double longest, Slope slope) {
  const int steps = 1 + static_cast<int>(std::abs(to - from) / longest);
  const double h = (to - from) / steps;
  const double direction = s(h);
  for (int n = 0; n < steps; ++n) {
    const double x = from + n * h;
    const double k1 = slope(z, x, direction);
    const double k2 = slope(z + 0.5 * h * k1, x + 0.5 * h, direction);
    const double k3 = slope(z + 0.5 * h * k2, x + 0.5 * h, direction);
    const double k4 = slope(z + h * k3, x + h, direction);
    z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return z;
}

// A law of the torsion with one state: dT/dx = slope(T, x, s, sample).
Values hysteresis(const Record& record, double longest,
                  const std::function<double(double, double, double, const Instant&)>& slope) {
  double state = 0.0;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    // Between two samples other signals stand at their mean.
    Instant mean = record[k];
    if (k > 0) mean.T = 0.5 * (std::abs(record[k].T) + std::abs(record[k - 1].T));
    if (k > 0)
      state = along_path(state, record[k - 1].dq, record[k].dq, longest,
                         [&](double z, double x, double sign) { return slope(z, x, sign, mean); });
    result.push_back(state);
  }
  return result;
}

Values dahl_hysteresis_truth(const Values& p, double exponent, const Record& record) {
  return hysteresis(record, 0.002 * p[0] / p[1], [&](double T, double, double sign, const Instant&) {
    const double left = 1.0 - T / p[0] * sign;
    return p[1] * std::pow(std::abs(left), exponent) * s(left);
  });
}

// g is that of the speed at the end of each sample, as speeds in this record jump.
Values lugre_truth(const Values& p, const Record& record) {
  const auto g = [&](const Instant& x) { return p[0] + (p[1] - p[0]) * std::exp(-(x.w / p[2]) * (x.w / p[2])); };
  double z = 0.0;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const Instant& x = record[k];
    if (k > 0)
      z = along_path(z, record[k - 1].q, x.q, 0.02 * p[0] / p[3],
                     [&](double at, double, double sign) { return 1.0 - sign * p[3] * at / g(x); });
    result.push_back(p[3] * z + p[4] * (x.w - p[3] * std::abs(x.w) * z / g(x)));
  }
  return result;
}

// The all-pass 2/(1 + s d/2) - 1 for a current that is straight between samples: Km (i - its output).
Values delay_truth(const Values& p, const Record& record) {
  double low_pass = record[0].i;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (k > 0)
      low_pass = along_path(low_pass, 0.0, kSample, 0.01 * p[0], [&](double at, double t, double) {
        const double current = record[k - 1].i + (record[k].i - record[k - 1].i) * t / kSample;
        return 2.0 / p[0] * (current - at);
      });
    result.push_back(kTorqueConstant * (record[k].i - (2.0 * low_pass - record[k].i)));
  }
  return result;
}

// Masing's rule for a loop whose virgin curve f is odd: T = f(x1) + 2 f((x2 - x1)/2) + 2 f((x3 - x2)/2) + ... over the
// turning points that are not yet forgotten. A branch that reaches as far as the one before forgets both.
Values masing(const Record& record, const std::function<double(double)>& virgin) {
  Values points = {0.0};
  Values result;
  for (const Instant& sample : record) {
    const double x = sample.dq;
    if (points.size() > 1 && (x - points.back()) * (points.back() - points[points.size() - 2]) >= 0.0)
      points.pop_back();
    points.push_back(x);
    for (bool forgets = true; forgets && points.size() > 2;) {
      const std::size_t n = points.size();
      const double branch = std::abs(points[n - 1] - points[n - 2]);
      const double before = (n == 3 ? 2.0 : 1.0) * std::abs(points[n - 2] - points[n - 3]);
      forgets = branch >= before;
      if (!forgets) break;
      // The virgin curve begins at zero, which is no turning point.
      points.erase(points.end() - (n == 3 ? 2 : 3), points.end() - 1);
    }
    double torque = 0.0;
    for (std::size_t n = 1; n < points.size(); ++n) {
      const double branch = points[n] - points[n - 1];
      torque += s(branch) * (n == 1 ? virgin(std::abs(branch)) : 2.0 * virgin(0.5 * std::abs(branch)));
    }
    result.push_back(torque);
  }
  return result;
}

Values plays_truth(const Values& p, const Record& record) {
  return masing(record, [&](double x) {
    double torque = 0.0;
    for (std::size_t j = 0; j < 8; ++j) torque += p[8 + j] * std::max(x - p[j], 0.0);
    return torque;
  });
}

// Each relay with its edges as many sharp relays side by side, which is what an edge stands for.
Values relays_truth(const Values& p, const Record& record) {
  constexpr int kFine = 100;
  const double edge = p[0] / 9.0;
  Values result(record.size(), 0.0);
  std::size_t at = 1;
  for (int j = 1; j <= 9; ++j)
    for (int k = 1; k <= j; ++k, ++at)
      for (int f = 0; f < kFine; ++f) {
        const double within = edge * (2.0 * (f + 0.5) / kFine - 1.0);
        const double high = edge * (2 * j - 9) + within, low = edge * (2 * k - 11) + within;
        double state = high + low > 0.0 ? -1.0 : 1.0;
        for (std::size_t n = 0; n < record.size(); ++n) {
          if (record[n].dq >= high) state = 1.0;
          if (record[n].dq <= low) state = -1.0;
          result[n] += p[at] * state / kFine;
        }
      }
  return result;
}

double piecewise_truth(const Values& p, double torsion) {
  const double size = std::abs(torsion);
  const double first = p[3] / p[0], second = first + (p[4] - p[3]) / p[1];
  const double torque = size < first    ? p[0] * size
                        : size < second ? p[3] + p[1] * (size - first)
                                        : p[4] + p[2] * (size - second);
  return s(torsion) * torque;
}

// Of the torque through the gear a share is lost, another one where the motor drives than where it is driven; z by its
// rate form over the travel.
Values loss_truth(const Values& p, const Record& record) {
  double z = 0.0;
  Values result;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const Instant& x = record[k];
    if (k > 0)
      z = along_path(z, record[k - 1].q, x.q, 0.01 * p[2],
                     [&](double at, double, double sign) { return (1.0 - sign * at) / p[2]; });
    const double mean = 0.5 * (p[0] + p[1]), more = 0.5 * (p[0] - p[1]);
    result.push_back((mean * std::abs(x.T) * z + more * x.T * z * z) / kGearRatio);
  }
  return result;
}

}  // namespace

const std::map<std::string, Truth, std::less<>>& truths() {
  static const std::map<std::string, Truth, std::less<>> table = {
      {"inertia", each([](const Values& p, const Instant& x) { return p[0] * x.a; })},
      {"viscous_friction", each([](const Values& p, const Instant& x) { return p[0] * x.w; })},
      {"coulomb_friction", each([](const Values& p, const Instant& x) { return p[0] * s(x.w); })},
      {"viscous_asymmetry", each([](const Values& p, const Instant& x) { return p[0] * std::abs(x.w); })},
      {"coulomb_asymmetry", each([](const Values& p, const Instant& x) { return x.w != 0.0 ? p[0] : 0.0; })},
      {"stribeck_gaussian", each([](const Values& p, const Instant& x) {
         const double amplitude = x.w > 0.0 ? p[0] : p[1];
         return s(x.w) * amplitude * std::exp(-(x.w / p[2]) * (x.w / p[2]));
       })},
      {"power_law_friction", each([](const Values& p, const Instant& x) {
         return p[0] * std::pow(std::abs(x.w / kRatedVelocity), p[1]) * s(x.w);
       })},
      {"load_dependent_friction",
       each([](const Values& p, const Instant& x) { return p[0] * std::abs(x.T) / kGearRatio * s(x.w); })},
      {"load_dependent_stiction", each([](const Values& p, const Instant& x) {
         return p[0] * std::abs(x.T) / kGearRatio * s(x.w) / std::exp(std::pow(x.w / p[1], 2.0));
       })},
      {"driving_dependent_loss", loss_truth},
      // The factor on viscous friction; the term itself has a test of its own below.
      {"temperature_viscous",
       each([](const Values& p, const Instant& x) { return std::exp(-p[0] * (x.temp - kReferenceTemperature)); })},
      {"dahl_friction", dahl_truth},
      {"torque_ripple", each([](const Values& p, const Instant& x) {
         return p[1] * std::cos(p[0] * x.q) + p[2] * std::sin(p[0] * x.q);
       })},
      {"current_offset", each([](const Values& p, const Instant&) { return kTorqueConstant * p[0]; })},
      {"torque_bias", each([](const Values& p, const Instant&) { return p[0]; })},
      {"linear_stiffness", each([](const Values& p, const Instant& x) { return p[0] * x.dq; })},
      {"structural_damping",
       each([](const Values& p, const Instant& x) { return p[0] * std::pow(std::abs(x.v), p[1]) * s(x.v); })},
      // The torsion that is left for the spring.
      {"backlash",
       each([](const Values& p, const Instant& x) { return std::abs(x.dq) <= p[0] ? 0.0 : x.dq - s(x.dq) * p[0]; })},
      {"output_inertia", each([](const Values& p, const Instant& x) { return p[0] * x.ao; })},
      {"output_viscous_friction", each([](const Values& p, const Instant& x) { return p[0] * x.wo; })},
      {"output_coulomb_friction", each([](const Values& p, const Instant& x) { return p[0] * s(x.wo); })},
      {"gravity", each([](const Values& p, const Instant& x) {
         return std::hypot(p[0], p[1]) * std::sin(x.qo + std::atan2(p[0], p[1]));
       })},
      {"stribeck_hess_soom", each([](const Values& p, const Instant& x) {
         return s(x.w) * (x.w > 0.0 ? p[0] : p[1]) / (1.0 + (x.w / p[2]) * (x.w / p[2]));
       })},
      {"quadratic_drag", each([](const Values& p, const Instant& x) { return p[0] * x.w * std::abs(x.w); })},
      {"temperature_coulomb",
       each([](const Values& p, const Instant& x) { return std::exp(-p[0] * (x.temp - kReferenceTemperature)); })},
      {"lugre_friction", lugre_truth},
      {"load_scaled_ripple", each([](const Values& p, const Instant& x) {
         return x.T * (p[1] * std::cos(p[0] * x.q) + p[2] * std::sin(p[0] * x.q));
       })},
      {"angle_dependent_friction", each([](const Values& p, const Instant& x) {
         return s(x.w) * std::hypot(p[1], p[2]) * std::cos(p[0] * x.q - std::atan2(p[2], p[1]));
       })},
      {"torque_constant_error", each([](const Values& p, const Instant& x) { return -p[0] * kTorqueConstant * x.i; })},
      {"torque_constant_saturation",
       each([](const Values& p, const Instant& x) { return kTorqueConstant * p[0] * x.i * x.i * x.i; })},
      {"current_saturation", each([](const Values& p, const Instant& x) {
         return kTorqueConstant * (x.i - std::min(std::max(x.i, -p[0]), p[0]));
       })},
      {"current_delay", delay_truth},
      {"quadratic_stiffness", each([](const Values& p, const Instant& x) { return p[0] * x.dq * x.dq; })},
      {"cubic_stiffness", each([](const Values& p, const Instant& x) { return p[0] * x.dq * x.dq * x.dq; })},
      {"piecewise_stiffness", each([](const Values& p, const Instant& x) { return piecewise_truth(p, x.dq); })},
      {"dahl_hysteresis", [](const Values& p, const Record& r) { return dahl_hysteresis_truth(p, p[2], r); }},
      {"modified_dahl_hysteresis", [](const Values& p, const Record& r) { return dahl_hysteresis_truth(p, 2.0, r); }},
      {"duhem_hysteresis",
       [](const Values& p, const Record& r) {
         return hysteresis(r, 1e-6, [&](double T, double x, double sign, const Instant&) {
           return sign * p[0] * (p[2] + p[3] * x + p[4] * x * x + p[5] * x * x * x - T) + p[1];
         });
       }},
      {"bouc_wen_hysteresis",
       [](const Values& p, const Record& r) {
         Values z = hysteresis(r, 1e-6, [&](double at, double, double sign, const Instant&) {
           const double power = std::pow(std::abs(at), p[3]);
           return 1.0 - sign * p[1] * power * s(at) - p[2] * power;
         });
         for (double& at : z) at *= p[0];
         return z;
       }},
      {"prandtl_ishlinskii_hysteresis", plays_truth},
      {"preisach_hysteresis", relays_truth},
      {"torque_proportional_hysteresis",
       [](const Values& p, const Record& r) {
         return hysteresis(r, 1e-6, [&](double z, double, double sign, const Instant& x) {
           return p[2] * (1.0 - sign * z / (p[0] + p[1] * std::abs(x.T)));
         });
       }},
      // The torsion of the spring.
      {"kinematic_error", each([](const Values& p, const Instant& x) {
         return x.dq + p[1] * std::cos(p[0] * x.q) + p[2] * std::sin(p[0] * x.q);
       })},
      {"torque_offset", each([](const Values& p, const Instant&) { return p[0]; })},
      // Of a measured torque (1 + ratio) times the true one.
      {"torque_sensor_gain", each([](const Values& p, const Instant& x) { return x.T - x.T / (1.0 + p[0]); })},
      {"torque_sensor_ripple", each([](const Values& p, const Instant& x) {
         return p[1] * std::cos(p[0] * x.q) + p[2] * std::sin(p[0] * x.q);
       })},
      {"torsion_zero", each([](const Values& p, const Instant& x) { return x.dq + p[0]; })},
  };
  return table;
}

}  // namespace flexspline::tests
