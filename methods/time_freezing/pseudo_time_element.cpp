#include "methods/time_freezing/pseudo_time_element.h"

namespace ricochet {

void PseudoTimeElement::resize(const ProblemInfo& info, int n_s) {
  q0 = v0 = q1 = v1 = Vector::Zero(info.n_q);
  y0 = y1 = Lambda_n = Vector::Zero(info.n_c());
  Lambda_t = Vector::Zero(info.n_lambda_t);
  q = v = w = Matrix::Zero(info.n_q, n_s);
  y = beta = Matrix::Zero(info.n_c(), n_s);
  tau = Matrix::Zero(info.n_lambda_t, n_s);
  s = Vector::Ones(n_s);
}

void PseudoTimeElement::guess(double length, double speed, const Vector& derivative, const Vector& normal,
                              const Vector& tangential) {
  h = length;
  s.setConstant(speed);
  w.colwise() = derivative;
  beta.colwise() = normal;
  tau.colwise() = tangential;
}

}  // namespace ricochet
