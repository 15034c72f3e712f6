#include "methods/event_driven/collocation_guess.h"

namespace ricochet {

CollocationGuess::CollocationGuess(const Vector& c, int n_q) : c_(c), polynomial_(c, n_q) {
  for (auto* x : {&v0_, &a0_, &v1_, &a1_}) x->setZero(n_q);
}

void CollocationGuess::keep(const StepEnds& ends, const CollocationPolynomial& polynomial) {
  polynomial_ = polynomial;
  h_ = ends.h;
  v0_ = ends.v0;
  a0_ = ends.a0;
  v1_ = ends.v1;
  a1_ = ends.a1;
}

void CollocationGuess::predict(const StepEnds& ends, Matrix& w) const {
  const bool from_left = h_ > 0 && v0_ == ends.v0 && a0_ == ends.a0;
  const bool from_right = h_ > 0 && v1_ == ends.v0 && a1_ == ends.a0;
  for (Eigen::Index i = 0; i < w.cols(); ++i) {
    if (!from_left && !from_right) {
      w.col(i) = ends.h * c_[i] * ends.a0;
      continue;
    }
    const double s = (from_left ? 0 : 1) + c_[i] * ends.h / h_;
    for (Eigen::Index k = 0; k < w.rows(); ++k)
      w(k, i) = polynomial_.velocity(k, s) - (from_left ? 0 : polynomial_.velocity(k, 1));
  }
}

}  // namespace ricochet
