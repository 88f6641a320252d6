#include "host/engine/estimation/smooth_curve.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include "host/common/algebra/decompositions.hpp"

namespace flexspline::estimation {
namespace {

// Smoothings that are tried are between these, over the size of the data's part of the normal equations.
constexpr double kLeast = 1e-7;
constexpr double kMost = 1e7;
// Directions of no length: points that no sample reaches.
constexpr double kNoLength = 1e-9;
// Ridge for directions that neither data nor smoothing determine, far below both.
constexpr double kRidge = 1e-10;

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Products of all columns: others, points, target, over the samples of one fold.
struct Products {
  Eigen::Index others = 0, points = 0;
  Vector size;  // of the other columns, which are scaled to one
  std::vector<Matrix> fold;
  Matrix all;
};

Products products_of(const CurveProblem& p) {
  Products result;
  result.others = p.others.cols();
  result.points = p.points.cols();
  result.size = (p.root_weights.asDiagonal() * p.others).colwise().norm().transpose();
  result.size = (result.size.array() > 0.0).select(result.size, 1.0);
  const Eigen::Index columns = result.others + result.points + 1;
  std::vector<std::vector<Eigen::Index>> rows(static_cast<std::size_t>(p.folds));
  for (Eigen::Index k = 0; k < p.target.size(); ++k)
    if (p.root_weights[k] > 0.0) rows[static_cast<std::size_t>(p.fold[static_cast<std::size_t>(k)])].push_back(k);
  result.all = Matrix::Zero(columns, columns);
  for (const auto& own : rows) {
    if (own.empty()) {  // a product over no samples divides by their number
      result.fold.emplace_back(Matrix::Zero(columns, columns));
      continue;
    }
    Matrix block(static_cast<Eigen::Index>(own.size()), columns);
    block << p.others(own, Eigen::all) * result.size.cwiseInverse().asDiagonal(), p.points(own, Eigen::all),
        p.target(own);
    block = p.root_weights(own).asDiagonal() * block;
    Matrix product = Matrix::Zero(columns, columns);
    product.selfadjointView<Eigen::Lower>().rankUpdate(block.transpose());
    result.fold.emplace_back(product.selfadjointView<Eigen::Lower>());
    result.all += result.fold.back();
  }
  return result;
}

// S with S' G S = 1 on the directions of G that have a length.
Matrix inverse_root(const Matrix& products) {
  if (products.size() == 0) return products;
  const auto [values, vectors] = algebra::eigenpairs(products);
  const double least = kNoLength * std::max(values.maxCoeff(), 1e-300);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (values[k] > least) kept.push_back(k);
  return vectors(Eigen::all, kept) * values(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

struct EffectiveParameters {
  Matrix basis;                       // the curve is basis * z
  std::vector<Eigen::Index> left_to;  // see Curve
};

// The curves that are orthogonal, in the data, to those that the other columns can represent.
EffectiveParameters freedom_of(const Products& g) {
  EffectiveParameters freedom;
  freedom.basis = Matrix::Identity(g.points, g.points);
  if (g.others == 0) return freedom;
  const Matrix others = g.all.topLeftCorner(g.others, g.others);
  const Matrix points = g.all.block(g.others, g.others, g.points, g.points);
  const Matrix cross = g.all.block(0, g.others, g.others, g.points);
  const Matrix root_others = inverse_root(others), root_points = inverse_root(points);
  if (root_others.cols() == 0 || root_points.cols() == 0) return freedom;
  const algebra::SingularValues svd = algebra::singular_values(root_others.transpose() * cross * root_points);
  Eigen::Index count = 0;
  while (count < svd.s.size() && svd.s[count] > kCollinear) ++count;
  if (count == 0) return freedom;
  const Matrix theirs = root_others * svd.u.leftCols(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    // Columns are of unit size, so what each has in common with the direction can be compared.
    Eigen::Index most = 0;
    (others * theirs.col(k)).cwiseAbs().maxCoeff(&most);
    freedom.left_to.push_back(most);
  }
  const Matrix constraint = points * (root_points * svd.v.leftCols(count));  // points x count
  const Matrix whole = algebra::orthogonal_of(constraint);
  freedom.basis = whole.rightCols(g.points - count);
  return freedom;
}

struct Solution {
  Vector beta;  // of the scaled columns
  Vector value;
};

// From the products of the samples that the fit sees.
class Solver {
 public:
  Solver(const Products& g, const EffectiveParameters& freedom, bool closed) : g_(g), freedom_(freedom) {
    const Matrix d = second_differences(g.points, closed);
    const Matrix roughness = d * freedom.basis;
    penalty_ = roughness.transpose() * roughness;
    size_ = std::max(g.all.block(g.others, g.others, g.points, g.points).trace(), 1e-300) /
            std::max(penalty_.trace(), 1e-300);
  }
  // Factor of the penalty at which it is as large as the data's part.
  double size() const { return size_; }

  algebra::SymmetricFactor factor(const Matrix& products, double smoothing) const {
    Matrix normal = projected(products);
    const Eigen::Index n = freedom_.basis.cols();
    normal.bottomRightCorner(n, n) += smoothing * penalty_;
    normal.diagonal().head(g_.others).array() += kRidge;
    normal.diagonal().tail(n).array() += kRidge * size_;
    return algebra::SymmetricFactor(normal);
  }
  Solution solve(const Matrix& products, double smoothing) const {
    Vector right(g_.others + freedom_.basis.cols());
    right << products.col(g_.others + g_.points).head(g_.others),
        freedom_.basis.transpose() * products.col(g_.others + g_.points).segment(g_.others, g_.points);
    const Vector z = factor(products, smoothing).solve(right);
    return {z.head(g_.others), freedom_.basis * z.tail(freedom_.basis.cols())};
  }
  Matrix projected(const Matrix& products) const {
    const Eigen::Index n = freedom_.basis.cols();
    Matrix normal(g_.others + n, g_.others + n);
    normal.topLeftCorner(g_.others, g_.others) = products.topLeftCorner(g_.others, g_.others);
    normal.topRightCorner(g_.others, n) = products.block(0, g_.others, g_.others, g_.points) * freedom_.basis;
    normal.bottomLeftCorner(n, g_.others) = normal.topRightCorner(g_.others, n).transpose();
    const Matrix of_points = products.block(g_.others, g_.others, g_.points, g_.points) * freedom_.basis;
    normal.bottomRightCorner(n, n) = freedom_.basis.transpose() * of_points;
    return normal;
  }

 private:
  const Products& g_;
  const EffectiveParameters& freedom_;
  Matrix penalty_;
  double size_ = 1.0;
};

// Squares of a solution over the samples of `products`.
double squares(const Products& g, const Matrix& products, const Solution& s) {
  Vector all(g.others + g.points + 1);
  all << s.beta, s.value, -1.0;
  return std::max(0.0, all.dot(products * all));
}

double left_out(const Products& g, const Solver& solver, double smoothing) {
  double sum = 0.0;
  for (const Matrix& fold : g.fold) sum += squares(g, fold, solver.solve(g.all - fold, smoothing));
  return sum;
}

double left_out_without(const Products& g) {
  double sum = 0.0;
  for (const Matrix& fold : g.fold) {
    const Matrix seen = g.all - fold;
    Solution s{Vector::Zero(g.others), Vector::Zero(g.points)};
    if (g.others > 0) {
      Matrix normal = seen.topLeftCorner(g.others, g.others);
      normal.diagonal().array() += kRidge;
      s.beta = algebra::SymmetricFactor(normal).solve(seen.col(g.others + g.points).head(g.others));
    }
    sum += squares(g, fold, s);
  }
  return sum;
}

Curve finish(const CurveProblem& p, const Products& g, const EffectiveParameters& freedom, const Solver& solver,
             double smoothing) {
  Curve curve;
  curve.smoothing = smoothing;
  curve.left_to = freedom.left_to;
  const Solution s = solver.solve(g.all, smoothing);
  curve.value = s.value;
  curve.beta = s.beta.cwiseQuotient(g.size);
  curve.residual = p.target - p.others * curve.beta - p.points * curve.value;
  curve.rows = static_cast<double>((p.root_weights.array() > 0.0).count());
  const Eigen::Index n = freedom.basis.cols(), all = g.others + n;
  const Matrix inverse = solver.factor(g.all, smoothing).solve(Matrix::Identity(all, all));
  curve.effective_degrees_of_freedom = (inverse * solver.projected(g.all)).diagonal().tail(n).sum();
  const double freedom_left =
      std::max(1.0, curve.rows - static_cast<double>(g.others) - curve.effective_degrees_of_freedom);
  const double noise = p.root_weights.cwiseProduct(curve.residual).squaredNorm() / freedom_left;
  curve.covariance = noise * freedom.basis * inverse.bottomRightCorner(n, n) * freedom.basis.transpose();
  curve.squares_without = left_out_without(g);
  curve.squares_with = left_out(g, solver, smoothing);
  return curve;
}

}  // namespace

Matrix second_differences(Eigen::Index points, bool closed) {
  const Eigen::Index rows = closed ? points : std::max<Eigen::Index>(points - 2, 0);
  Matrix d = Matrix::Zero(rows, points);
  if (points < 3) return d;
  for (Eigen::Index k = 0; k < rows; ++k) {
    d(k, k % points) += 1.0;
    d(k, (k + 1) % points) -= 2.0;
    d(k, (k + 2) % points) += 1.0;
  }
  return d;
}

Curve fit_curve_smoothed(const CurveProblem& problem, double smoothing) {
  const Products g = products_of(problem);
  const EffectiveParameters freedom = freedom_of(g);
  return finish(problem, g, freedom, Solver(g, freedom, problem.closed), smoothing);
}

Curve fit_curve(const CurveProblem& problem, int smoothings) {
  const Products g = products_of(problem);
  const EffectiveParameters freedom = freedom_of(g);
  const Solver solver(g, freedom, problem.closed);
  double best = solver.size(), least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < smoothings; ++k) {
    const double smoothing =
        solver.size() * kMost * std::pow(kLeast / kMost, static_cast<double>(k) / (smoothings - 1));
    const double now = left_out(g, solver, smoothing);
    // From smooth to rough: a rougher curve must predict strictly better.
    if (now < least * (1.0 - 1e-9)) {
      least = now;
      best = smoothing;
    }
  }
  return finish(problem, g, freedom, solver, best);
}

}  // namespace flexspline::estimation
