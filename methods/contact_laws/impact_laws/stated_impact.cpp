#include "methods/contact_laws/impact_laws/stated_impact.h"

#include <fmt/format.h>

#include "methods/contact_laws/impact_laws/lzb_impact.h"
#include "methods/contact_laws/impact_laws/planar_impact.h"

namespace ricochet {
namespace {

/// Contacts without friction, of which some may rest: those are open until they are pressed.
LcpStatus lzb(const ProblemInfo& info, std::span<const int> contacts, const Eigen::Ref<const Matrix>& G,
              const Eigen::Ref<const Vector>& w, Eigen::Ref<Vector> r) {
  const auto n = static_cast<Eigen::Index>(contacts.size());
  LzbLaw law{.K = Vector::Ones(n), .e = Vector(n), .eta = info.impact_law.eta};
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto contact = static_cast<std::size_t>(contacts[static_cast<std::size_t>(k)]);
    law.e[k] = info.contacts[contact].eps_r;
    if (!info.impact_law.stiffness.empty()) law.K[k] = info.impact_law.stiffness[contact];
  }
  r = lzb_impact(law, G, w).P;
  return LcpStatus::solved;
}

}  // namespace

LcpStatus stated_impact(const ProblemInfo& info, std::span<const int> contacts, const Eigen::Ref<const Matrix>& G,
                        const Eigen::Ref<const Vector>& w, Eigen::Ref<Vector> r) {
  const ContactInfo& contact = info.contacts[static_cast<std::size_t>(contacts.front())];
  if (contacts.size() == 1 && contact.n_t == 0) {
    r[0] = -(1 + contact.restitution(w[0])) * w[0] / G(0, 0);
    return LcpStatus::solved;
  }
  if (info.impact_law.hypothesis == ImpactHypothesis::lzb) return lzb(info, contacts, G, w, r);
  if (contacts.size() > 1) return LcpStatus::ray;
  const PlanarContact planar{
      .a = G(0, 0), .b = G(1, 1), .c = G(0, 1), .e = contact.restitution(w[0]), .mu = contact.mu};
  const auto impact = planar_impact(info.impact_law.hypothesis, planar, {w[0], w[1]});
  if (!impact) return LcpStatus::ray;
  r[0] = impact->p.n;
  r[1] = impact->p.t;
  return LcpStatus::solved;
}

std::string why_no_impulse(const ProblemInfo& info) {
  const auto law = info.impact_law.hypothesis;
  if (law == ImpactHypothesis::newton || law == ImpactHypothesis::lzb)
    return "no impulses keep all contacts that touch from closing, or they are so large that rounding hides them";
  return fmt::format("it is that of one contact, {}, and several strike at once, or M(q) is not positive definite",
                     name_of(law));
}

}  // namespace ricochet
