// Decompositions of dense matrices of doubles, each compiled in one place: as templates they would be compiled again in
// every file that solves a system, and took a third of the time of the library's build. Golub and Van Loan, Matrix
// Computations, describe all of them.
#pragma once

#include <Eigen/Core>
#include <memory>

namespace flexspline::algebra {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// The square upper triangular R with R'R = A'A, by Householder reflections. A matrix with fewer rows than columns is
// filled up with zeros.
Matrix r_factor(Matrix a);

// Least squares of a matrix with at least as many rows as columns, all independent, by Householder reflections.
class HouseholderQr {
 public:
  explicit HouseholderQr(const Matrix& a);
  ~HouseholderQr();
  HouseholderQr(HouseholderQr&&) noexcept;
  HouseholderQr& operator=(HouseholderQr&&) noexcept;
  Matrix r() const;  // columns x columns, upper triangular
  Matrix solve(const Matrix& b) const;

 private:
  struct Factor;
  std::unique_ptr<const Factor> factor_;
};

// An orthogonal matrix whose first columns span those of A, which are independent: rows x rows.
Matrix orthogonal_of(const Matrix& a);

// x of A x = b by Cholesky's decomposition, A symmetric and positive definite. What comes of another A is not defined.
Matrix solve_positive(const Matrix& a, const Matrix& b);
Matrix inverse_of_positive(const Matrix& a);

// LU with full pivoting; solution and inverse of a singular matrix are not defined.
class FullPivotLu {
 public:
  explicit FullPivotLu(const Matrix& a);
  ~FullPivotLu();
  FullPivotLu(FullPivotLu&&) noexcept;
  FullPivotLu& operator=(FullPivotLu&&) noexcept;
  // An estimate of 1 / (norm of A times norm of its inverse).
  double reciprocal_condition() const;
  Matrix solve(const Matrix& b) const;
  Matrix inverse() const;

 private:
  struct Factor;
  std::unique_ptr<const Factor> factor_;
};
Matrix inverse_of(const Matrix& a);

// The least-squares solution of least norm, by a complete orthogonal decomposition, where A need not have full rank.
class LeastNormSolver {
 public:
  // `threshold`: pivots below that share of the largest count as zero; zero: the precision of doubles.
  explicit LeastNormSolver(const Matrix& a, double threshold = 0.0);
  ~LeastNormSolver();
  LeastNormSolver(LeastNormSolver&&) noexcept;
  LeastNormSolver& operator=(LeastNormSolver&&) noexcept;
  Eigen::Index rank() const;
  // The largest pivot over the smallest that counts.
  double pivot_ratio() const;
  Matrix solve(const Matrix& b) const;
  Matrix pseudo_inverse() const;

 private:
  struct Factor;
  std::unique_ptr<const Factor> factor_;
};

// The decomposition L D L' with pivots of a symmetric semidefinite matrix, to solve with several right-hand sides.
class SymmetricFactor {
 public:
  explicit SymmetricFactor(const Matrix& a);
  ~SymmetricFactor();
  SymmetricFactor(SymmetricFactor&&) noexcept;
  SymmetricFactor& operator=(SymmetricFactor&&) noexcept;
  Matrix solve(const Matrix& b) const;

 private:
  struct Factor;
  std::unique_ptr<const Factor> factor_;
};

// Of a symmetric matrix; values rise.
struct Eigenpairs {
  Vector values;
  Matrix vectors;
};
Eigenpairs eigenpairs(const Matrix& symmetric);
Vector eigenvalues(const Matrix& symmetric);
// Of a square matrix that need not be symmetric, in no order.
Eigen::VectorXcd complex_eigenvalues(const Matrix& a);

// A = u diag(s) v', as many columns as the smaller side of A; s falls (one-sided Jacobi).
struct SingularValues {
  Matrix u;
  Vector s;
  Matrix v;
};
SingularValues singular_values(const Matrix& a);

// Least squares by QR with column pivoting. It also takes a matrix without columns: a model without linear parameters,
// or data that determine none.
class PivotedQr {
 public:
  PivotedQr();
  // `threshold`: pivots below that share of the largest count as zero; zero: the precision of doubles.
  explicit PivotedQr(const Matrix& a, double threshold = 0.0);
  ~PivotedQr();
  PivotedQr(PivotedQr&&) noexcept;
  PivotedQr& operator=(PivotedQr&&) noexcept;

  // The least-squares solution; of a matrix without columns a matrix without rows.
  Matrix solve(const Matrix& b) const;
  // Orthonormal columns that span those of the matrix, as many as its rank.
  Matrix span() const;

 private:
  struct Factor;
  std::unique_ptr<const Factor> factor_;  // none where the matrix has no columns
  Eigen::Index rows_ = 0;
};

}  // namespace flexspline::algebra
