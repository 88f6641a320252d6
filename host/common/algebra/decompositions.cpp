#include "host/common/algebra/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

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

Matrix orthogonal_of(const Matrix& a) {
  return Eigen::HouseholderQR<Matrix>(a).householderQ();
}

Matrix solve_positive(const Matrix& a, const Matrix& b) {
  return a.llt().solve(b);
}
Matrix inverse_of_positive(const Matrix& a) {
  return solve_positive(a, Matrix::Identity(a.rows(), a.cols()));
}

Matrix inverse_of(const Matrix& a) {
  return Eigen::FullPivLU<Matrix>(a).inverse();
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
