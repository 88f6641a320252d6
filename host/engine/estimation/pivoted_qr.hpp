// QR with column pivoting that also takes a matrix without columns: a model without linear parameters, or data that
// determine none. Eigen's own reads the first of no column lengths then.
#pragma once

#include <Eigen/QR>

namespace flexspline::estimation {

class PivotedQr {
 public:
  PivotedQr() = default;
  // `threshold`: pivots below that share of the largest count as zero; zero: Eigen's own.
  explicit PivotedQr(const Eigen::MatrixXd& A, double threshold = 0.0) : rows_(A.rows()) {
    if (A.cols() == 0) return;
    if (threshold > 0.0) qr_.setThreshold(threshold);
    qr_.compute(A);
  }

  // Least squares; of a matrix without columns a vector (matrix) without rows.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const {
    return qr_.cols() == 0 ? Eigen::MatrixXd::Zero(0, b.cols()) : Eigen::MatrixXd(qr_.solve(b));
  }
  // Orthonormal columns that span those of the matrix, as many as its rank.
  Eigen::MatrixXd span() const {
    return qr_.cols() == 0 ? Eigen::MatrixXd::Zero(rows_, 0)
                           : Eigen::MatrixXd(qr_.householderQ() * Eigen::MatrixXd::Identity(rows_, qr_.rank()));
  }

 private:
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
  Eigen::Index rows_ = 0;
};

}  // namespace flexspline::estimation
