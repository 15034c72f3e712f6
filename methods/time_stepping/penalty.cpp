// Compliant contact: spring, damper and regularised friction instead of complementarity. The baseline that the methods
// with hard contact are measured against.
//
//   lambda_n = max(0, -k f_c - c J_n' v)                       where f_c < 0              (1)
//   lambda_t = -mu lambda_n J_t' v / sqrt(||J_t' v||^2 + v_s^2)                             (2)
//
// Stiffness k = stiffness=, in N/m; by default such that a contact lasts t_c = sqrt(h T) / 5 (T: end time), k = m_n
// (pi / t_c)^2 with the mass m_n = 1 / (J_n' M^-1 J_n) that the contact feels: as h falls, contacts get stiffer, and
// have more steps. c = 2 zeta sqrt(k m_n), zeta from the restitution of a damped spring that does not pull,
//
//   eps_r = exp(-zeta / s phi),   phi = atan2(2 zeta s, 2 zeta^2 - 1),   s = sqrt(1 - zeta^2)   (3)
//
// (log((zeta + s) / (zeta - s)) with s = sqrt(zeta^2 - 1) in place of phi when zeta > 1),
// with zeta <= 5 (eps_r = 0.01) in place of eps_r = 0. v_s = slip_speed=, in m/s; by default a tenth of what friction
// changes the slip by in a step.
//
// One step of the linearly implicit midpoint rule, contacts in it with their derivatives, v_m = (v_{k+1} + v_k) / 2:
//
//   (M - h/2 f_v - h^2/4 f_q) (v_{k+1} - v_k) = h f + h^2/2 f_q v_k + J_n Lambda_n + J_t Lambda_t   (4)
//   Lambda_n = -h (k f_c + (c + h k / 2) J_n' v_m)                                        (5)
//   Lambda_t = -h mu lambda_n(q_k, v_k) / sqrt(||J_t' v_k||^2 + v_s^2) J_t' v_m             (6)
//   q_{k+1} = q_k + h v_m                                                                 (7)
//
// M, J_n, J_t at q_k + h/2 v_k; contacts that would pull are left out and (4) is solved again. Order 2 between
// contacts; an impact is late and long by t_c and has eps_r to O(h / t_c), so that the order through impacts is 1/2;
// with a stiffness of its own the method converges to the motion of compliant bodies.
//
// Source: Acary, Brogliato (2008), section 1.2 (Kelvin-Voigt); (3): Schwager, Poeschel, Granular Matter 9 (2007)
// 465-469.

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "methods/registry.h"
#include "methods/time_stepping/common/fixed_step_run.h"

namespace ricochet {
namespace {

constexpr double kDuration = 0.2;    // t_c / sqrt(h T)
constexpr double kMaxDamping = 5;    // zeta for eps_r = 0
constexpr double kSlipOfStep = 0.1;  // v_s, as part of what friction changes in a step

/// (3)
double restitution_of(double zeta) {
  if (zeta < 1) {
    const double s = std::sqrt(1 - zeta * zeta);
    // time of separation: the first zero of the force
    return std::exp(-zeta / s * std::atan2(2 * zeta * s, 2 * zeta * zeta - 1));
  }
  if (zeta == 1) return std::exp(-2.0);
  const double s = std::sqrt(zeta * zeta - 1);
  return std::exp(-zeta / s * std::log((zeta + s) / (zeta - s)));
}

double damping_for(double eps_r) {
  double low = 0, high = kMaxDamping;
  if (eps_r <= restitution_of(high)) return high;
  for (int k = 0; k < 60; ++k) {
    const double zeta = 0.5 * (low + high);
    (restitution_of(zeta) > eps_r ? low : high) = zeta;
  }
  return low;
}

class Penalty final : public Method {
 public:
  explicit Penalty(const MethodSpec& spec)
      : id_(spec.text()),
        stiffness_(spec.number("stiffness", 0, 0, 1e300)),
        slip_speed_(spec.number("slip_speed", 0, 0, 1e300)) {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = stiffness_ > 0 ? fmt::format("penalty, k = {} N/m", stiffness_) : "penalty",
            .source = "Acary, Brogliato (2008), section 1.2",
            .order_smooth = 2,
            .order_impacts = stiffness_ > 0 ? 0 : 0.5,
            .is_adaptive = false};
  }

  Support supports(const ProblemInfo& problem) const override {
    return problem.has_bilateral() ? Support::no("bilateral constraints would need a compliance of their own")
                                   : Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  std::string id_;
  double stiffness_, slip_speed_;
};

/// J of one contact, full length: a penalty step is dense in the bodies that touch. The clock is not in it; what it has
/// of the contact's velocities is the surface's.
struct CompliantContact {
  double k = 0, c = 0, gap = 0, zeta = 0;
  double drag = 0;  // Lambda_t = -drag J_t' v_m
  bool is_active = false;
  Vector J_n;
  Matrix J_t;
  double surface_n = 0, surface_t[2]{0, 0};

  double normal_velocity(const Vector& v) const { return J_n.dot(v) + surface_n; }
  double slip_velocity(Eigen::Index d, const Vector& v) const { return J_t.col(d).dot(v) + surface_t[d]; }
};

Solution Penalty::do_solve(const Problem& problem, const Settings& settings) const {
  const ProblemInfo& info = problem.info();
  const auto& structure = info.structure;
  const int n_q = info.n_q;
  FixedStepRun run(problem, settings);
  run.solution.residuals.clear();  // there is no contact law to audit
  const double h = run.h, t_c = kDuration * std::sqrt(h * info.end_time);
  const Vector &q = run.q, &v = run.v;
  Counters& counters = run.solution.counters;

  Matrix M(n_q, n_q), f_q(n_q, n_q), f_v(n_q, n_q), S(n_q, n_q), with_contacts(n_q, n_q);
  BlockInverse W, S_inverse, contact_inverse;
  Vector q_m = q, f(n_q), right(n_q), change(n_q), v_m(n_q), WJ(n_q), packed_n(info.n_normal_entries),
         packed_t(info.n_tangent_entries), gaps(info.n_c());
  std::vector<CompliantContact> contacts(info.n_c());
  for (int i = 0; i < info.n_c(); ++i) {
    contacts[i].zeta = damping_for(info.contacts[i].eps_r);
    contacts[i].J_n.setZero(n_q);
    contacts[i].J_t.setZero(n_q, info.contacts[i].n_t);
  }
  const auto linearize = [&] {
    problem.mass_matrix(q_m.data(), M.data());
    problem.force_jacobians(q.data(), v.data(), info.u.data(), f_q.data(), f_v.data());
    S = M - (0.5 * h) * f_v - (0.25 * h * h) * f_q;
    S_inverse.compute(S);
    ++counters.jacobian_evaluations;
    ++counters.matrix_factorizations;
  };
  const bool constant_matrix = structure.constant_mass && structure.constant_force_jacobian;
  if (constant_matrix) {
    linearize();
    W.compute(M);
  }

  /// Contacts with f_c < 0, with the coefficients of (5), (6). @return whether there are any
  const auto find_contacts = [&] {
    problem.gap(q.data(), gaps.data());
    if (!(gaps.minCoeff() < 0)) return false;
    if (!constant_matrix) W.compute(M);
    problem.normal_jacobian(q_m.data(), packed_n.data());
    if (info.has_friction()) problem.tangent_jacobian(q_m.data(), packed_t.data());
    for (int i = 0; i < info.n_c(); ++i) {
      CompliantContact& contact = contacts[i];
      contact.is_active = gaps[i] < 0;
      if (!contact.is_active) continue;
      const ContactInfo& law = info.contacts[i];
      const std::size_t entries = law.support.size(), n_pushed = law.pushed().size();
      for (std::size_t s = 0; s < n_pushed; ++s) {
        contact.J_n[law.support[s]] = packed_n[law.normal_begin + s];
        for (int d = 0; d < law.n_t; ++d)
          contact.J_t(law.support[s], d) = packed_t[law.tangent_begin + d * entries + s];
      }
      if (law.is_moving) contact.surface_n = packed_n[law.normal_begin + n_pushed];
      for (int d = 0; d < law.n_t && law.is_moving; ++d)
        contact.surface_t[d] = packed_t[law.tangent_begin + d * entries + n_pushed];
      W.apply(contact.J_n, WJ);
      const double m_n = 1 / contact.J_n.dot(WJ);
      contact.gap = gaps[i];
      contact.k = stiffness_ > 0 ? stiffness_ : m_n * std::pow(std::numbers::pi / t_c, 2);
      contact.c = 2 * contact.zeta * std::sqrt(contact.k * m_n);
      if (law.n_t == 0) continue;
      const double pressed = std::max(0.0, -contact.k * contact.gap - contact.c * contact.normal_velocity(v));  // (1)
      double slip = 0, mobility = 0;
      for (int d = 0; d < law.n_t; ++d) {
        v_m = contact.J_t.col(d);
        W.apply(v_m, WJ);
        mobility = std::max(mobility, v_m.dot(WJ));
        slip += std::pow(contact.slip_velocity(d, v), 2);
      }
      const double most = h * law.mu * pressed, v_s = slip_speed_ > 0 ? slip_speed_ : kSlipOfStep * most * mobility;
      contact.drag = most > 0 ? most / std::sqrt(slip + v_s * v_s) : 0;  // (6)
    }
    return true;
  };

  /// (4)-(6) with the active contacts. @return whether none of them pulls
  const auto solve = [&](Vector& v_plus) {
    with_contacts = S;
    v_plus = right;
    for (const CompliantContact& contact : contacts) {
      if (!contact.is_active) continue;
      const double damping = h * (contact.c + 0.5 * h * contact.k);
      with_contacts.noalias() += (0.5 * damping) * contact.J_n.lazyProduct(contact.J_n.transpose());
      v_plus -= (h * contact.k * contact.gap + damping * contact.normal_velocity(v)) * contact.J_n;
      for (Eigen::Index d = 0; d < contact.J_t.cols(); ++d) {
        with_contacts.noalias() +=
            (0.5 * contact.drag) * contact.J_t.col(d).lazyProduct(contact.J_t.col(d).transpose());
        v_plus -= contact.drag * contact.slip_velocity(d, v) * contact.J_t.col(d);
      }
    }
    contact_inverse.compute(with_contacts);
    ++counters.matrix_factorizations;
    ++counters.linear_solves;
    contact_inverse.apply(v_plus, change);
    v_plus = v + change;
    v_m = v + 0.5 * change;
    bool none_pulls = true;
    run.clear_impulses();
    for (int i = 0; i < info.n_c(); ++i) {
      CompliantContact& contact = contacts[i];
      if (!contact.is_active) continue;
      const double impulse =
          -h * (contact.k * contact.gap + (contact.c + 0.5 * h * contact.k) * contact.normal_velocity(v_m));
      contact.is_active = impulse >= 0;
      none_pulls = none_pulls && contact.is_active;
      run.Lambda_n[i] = std::max(0.0, impulse);
      for (Eigen::Index d = 0; d < contact.J_t.cols(); ++d)
        run.Lambda_t[info.contacts[i].tangent_index + d] = -contact.drag * contact.slip_velocity(d, v_m);
    }
    return none_pulls;
  };

  return run.take_steps([&](Vector& v_plus) {
    q_m = q + (0.5 * h) * v;
    if (!constant_matrix) linearize();
    problem.force(q.data(), v.data(), info.u.data(), f.data());
    right = h * f;
    if (structure.force_uses_position) right.noalias() += (0.5 * h * h) * f_q.lazyProduct(v);
    ++counters.force_evaluations;
    if (info.n_c() > 0 && find_contacts()) {
      while (!solve(v_plus)) {
      }
    } else {
      S_inverse.apply(right, change);
      ++counters.linear_solves;
      v_plus = v + change;
    }
    run.q += (0.5 * h) * (v_plus + v);  // (7)
    return v_plus.allFinite() || run.fail("the velocity is not finite");
  });
}

const bool registered = register_method<Penalty>({
    .name = "penalty",
    .usage = "penalty[,stiffness=N/m][,slip_speed=m/s]",
    .summary = "compliant contact: spring, damper, regularised friction",
    .examples = {"penalty"},
    .conformance_steps = 4000,
});

}  // namespace
}  // namespace ricochet
