#include "methods/elements/element.h"

#include "methods/contact_laws/friction_polygon.h"

namespace ricochet {

void Element::resize(const ProblemInfo& info, int n_s) {
  q0 = v0 = q1 = v1 = end_a = Vector::Zero(info.n_q);
  q = v = a = Matrix::Zero(info.n_q, n_s);
  lambda_n = Matrix::Zero(info.n_c(), n_s);
  lambda_t = Matrix::Zero(info.n_lambda_t, n_s);
  slip_start = end_lambda_t = Vector::Zero(info.n_lambda_t);
  end_lambda_n = Vector::Zero(info.n_c());
  modes.assign(info.contacts.size(), ContactMode::open);
  facets.assign(has_friction_in_space(info) ? info.contacts.size() : 0, 0);
  for (const int i : info.bilateral) modes[i] = ContactMode::closed;
}

}  // namespace ricochet
