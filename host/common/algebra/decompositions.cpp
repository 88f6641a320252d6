#include "host/common/algebra/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <utility>

namespace flexspline::algebra {

Matrix r_factor(Matrix a) {
  const Eigen::Index rows = a.rows(), columns = a.cols();
  if (rows < columns) {
    a.conservativeResize(columns, Eigen::NoChange);
    a.bottomRows(columns - rows).setZero();
  }
  const Eigen::HouseholderQR<Matrix> qr(std::move(a));
  return qr.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
}

struct HouseholderQr::Factor {
  Eigen::HouseholderQR<Matrix> qr;
};
HouseholderQr::HouseholderQr(const Matrix& a)
    : factor_(std::make_unique<Factor>(Factor{Eigen::HouseholderQR<Matrix>(a)})) {}
HouseholderQr::~HouseholderQr() = default;
HouseholderQr::HouseholderQr(HouseholderQr&&) noexcept = default;
HouseholderQr& HouseholderQr::operator=(HouseholderQr&&) noexcept = default;
Matrix HouseholderQr::r() const {
  return factor_->qr.matrixQR().topRows(factor_->qr.cols()).triangularView<Eigen::Upper>();
}
Matrix HouseholderQr::solve(const Matrix& b) const {
  return factor_->qr.solve(b);
}

Matrix orthogonal_of(const Matrix& a) {
  return Eigen::HouseholderQR<Matrix>(a).householderQ();
}

Matrix solve_positive(const Matrix& a, const Matrix& b) {
  return a.llt().solve(b);
}
Matrix inverse_of_positive(const Matrix& a) {
  return solve_positive(a, Matrix::Identity(a.rows(), a.cols()));
}

struct FullPivotLu::Factor {
  Eigen::FullPivLU<Matrix> lu;
};
FullPivotLu::FullPivotLu(const Matrix& a) : factor_(std::make_unique<Factor>(Factor{Eigen::FullPivLU<Matrix>(a)})) {}
FullPivotLu::~FullPivotLu() = default;
FullPivotLu::FullPivotLu(FullPivotLu&&) noexcept = default;
FullPivotLu& FullPivotLu::operator=(FullPivotLu&&) noexcept = default;
double FullPivotLu::reciprocal_condition() const {
  return factor_->lu.rcond();
}
Matrix FullPivotLu::solve(const Matrix& b) const {
  return factor_->lu.solve(b);
}
Matrix FullPivotLu::inverse() const {
  return factor_->lu.inverse();
}
Matrix inverse_of(const Matrix& a) {
  return FullPivotLu(a).inverse();
}

struct LeastNormSolver::Factor {
  Eigen::CompleteOrthogonalDecomposition<Matrix> qtz;
};
LeastNormSolver::LeastNormSolver(const Matrix& a, double threshold) {
  auto factor = std::make_unique<Factor>();
  if (threshold > 0.0) factor->qtz.setThreshold(threshold);
  factor->qtz.compute(a);
  factor_ = std::move(factor);
}
LeastNormSolver::~LeastNormSolver() = default;
LeastNormSolver::LeastNormSolver(LeastNormSolver&&) noexcept = default;
LeastNormSolver& LeastNormSolver::operator=(LeastNormSolver&&) noexcept = default;
Eigen::Index LeastNormSolver::rank() const {
  return factor_->qtz.rank();
}
double LeastNormSolver::pivot_ratio() const {
  const auto& t = factor_->qtz.matrixT();
  return std::abs(t(0, 0)) / std::abs(t(rank() - 1, rank() - 1));
}
Matrix LeastNormSolver::solve(const Matrix& b) const {
  return factor_->qtz.solve(b);
}
Matrix LeastNormSolver::pseudo_inverse() const {
  return factor_->qtz.pseudoInverse();
}

struct SymmetricFactor::Factor {
  Eigen::LDLT<Matrix> ldlt;
};
SymmetricFactor::SymmetricFactor(const Matrix& a) : factor_(std::make_unique<Factor>(Factor{Eigen::LDLT<Matrix>(a)})) {}
SymmetricFactor::~SymmetricFactor() = default;
SymmetricFactor::SymmetricFactor(SymmetricFactor&&) noexcept = default;
SymmetricFactor& SymmetricFactor::operator=(SymmetricFactor&&) noexcept = default;
Matrix SymmetricFactor::solve(const Matrix& b) const {
  return factor_->ldlt.solve(b);
}

Eigenpairs eigenpairs(const Matrix& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}
Vector eigenvalues(const Matrix& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}
Eigen::VectorXcd complex_eigenvalues(const Matrix& a) {
  return Eigen::EigenSolver<Matrix>(a, false).eigenvalues();
}

SingularValues singular_values(const Matrix& a) {
  const Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

struct PivotedQr::Factor {
  Eigen::ColPivHouseholderQR<Matrix> qr;
};
PivotedQr::PivotedQr() = default;
PivotedQr::PivotedQr(const Matrix& a, double threshold) : rows_(a.rows()) {
  if (a.cols() == 0) return;
  auto factor = std::make_unique<Factor>();
  if (threshold > 0.0) factor->qr.setThreshold(threshold);
  factor->qr.compute(a);
  factor_ = std::move(factor);
}
PivotedQr::~PivotedQr() = default;
PivotedQr::PivotedQr(PivotedQr&&) noexcept = default;
PivotedQr& PivotedQr::operator=(PivotedQr&&) noexcept = default;
Matrix PivotedQr::solve(const Matrix& b) const {
  return factor_ ? Matrix(factor_->qr.solve(b)) : Matrix(Matrix::Zero(0, b.cols()));
}
Matrix PivotedQr::span() const {
  return factor_ ? Matrix(factor_->qr.householderQ() * Matrix::Identity(rows_, factor_->qr.rank()))
                 : Matrix(Matrix::Zero(rows_, 0));
}

}  // namespace flexspline::algebra
