#include "methods/contact_laws/contact_residuals.h"

#include <cmath>

#include "methods/contact_laws/friction_set.h"

namespace ricochet {
namespace {

// Parts of the scales below which a slip velocity or a friction impulse has no direction but that of rounding.
constexpr double kNoDirection = 1e-8;

}  // namespace

ContactResiduals residuals_of(const ContactProblem& problem, const Vector& r, const Vector& w) {
  const ContactScale scale = scale_of(problem, r);
  ContactResiduals worst;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const double *r_i = r.data() + problem.G.row(i), *w_i = w.data() + problem.G.row(i);
    const double speed = tangential_length(w_i + 1, contact.n_t), friction = tangential_length(r_i + 1, contact.n_t),
                 most = contact.mu * (r_i[0] + contact.present);
    const double opening = w_i[0] - (problem.law == FrictionLaw::associated ? contact.mu * speed : 0);
    worst.signorini = std::max(worst.signorini, std::abs(r_i[0] * opening));
    worst.pull = std::max(worst.pull, -r_i[0]);
    worst.approach = std::max(worst.approach, -opening);
    if (contact.n_t == 0) continue;
    worst.cone = std::max(worst.cone, friction - most);
    worst.dissipation = std::max(worst.dissipation, std::abs(most - friction) * speed);
    if (speed <= kNoDirection * scale.velocity || friction <= kNoDirection * scale.impulse) continue;
    const double against = -r_i[1] * w_i[1] - (contact.n_t > 1 ? r_i[2] * w_i[2] : 0),
                 across = contact.n_t > 1 ? r_i[1] * w_i[2] - r_i[2] * w_i[1] : 0;
    worst.angle = std::max(worst.angle, std::abs(std::atan2(across, against)));
  }
  return worst;
}

double fclib_merit(const ContactProblem& problem, const Vector& r, const Vector& w) {
  double sum = 0;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const int row = problem.G.row(i);
    const double *r_i = r.data() + row, *w_i = w.data() + row;
    double y[3]{};
    for (int d = 0; d <= contact.n_t; ++d) y[d] = r_i[d] - w_i[d];
    y[0] -= contact.mu * tangential_length(w_i + 1, contact.n_t);
    project_on_friction_set(contact.mu, contact.n_t, 0, y);
    for (int d = 0; d <= contact.n_t; ++d) sum += (r_i[d] - y[d]) * (r_i[d] - y[d]);
  }
  return std::sqrt(sum) / (1 + std::sqrt(problem.b.head(problem.G.n_rows()).norm()));  // (1)
}

}  // namespace ricochet
