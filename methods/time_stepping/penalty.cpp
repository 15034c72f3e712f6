// Compliant contact: spring, damper and regularised friction instead of complementarity. The baseline that the methods
// with hard contact are measured against.
//
//   lambda_n = max(0, -k f_c - c J_n' v)                       where f_c < 0              (1)
//   lambda_t = -mu lambda_n J_t' v / sqrt(||J_t' v||^2 + v_s^2)                             (2)
//
// Stiffness k = stiffness=, in N/m; by default such that a contact lasts t_c = sqrt(h T) / 5 (T: end time), k = m_n
// (pi / t_c)^2 with the mass m_n = 1 / (J_n' M^-1 J_n) that the contact feels: as h falls, contacts get stiffer and
// last more steps. c = 2 zeta sqrt(k m_n), zeta from the restitution of a damped spring that does not pull,
//
//   eps_r = exp(-zeta / s phi),   phi = atan2(2 zeta s, 2 zeta^2 - 1),   s = sqrt(1 - zeta^2)   (3)
//
// (log((zeta + s) / (zeta - s)) with s = sqrt(zeta^2 - 1) in place of phi when zeta > 1),
// with zeta <= 5 (eps_r = 0.01) in place of eps_r = 0. v_s = slip_speed=, in m/s; by default a tenth of the change
// of slip velocity that friction causes in a step.
//
// One step of the linearly implicit midpoint rule, which includes the derivatives of the contact forces, with
// v_m = (v_{k+1} + v_k) / 2:
//
//   (M - h/2 f_v - h^2/4 f_q) (v_{k+1} - v_k) = h f + h^2/2 f_q v_k + J_n Lambda_n + J_t Lambda_t   (4)
//   Lambda_n = -h (k f_c + (c + h k / 2) J_n' v_m)                                        (5)
//   Lambda_t = -h mu lambda_n(q_k, v_k) / sqrt(||J_t' v_k||^2 + v_s^2) J_t' v_m             (6)
//   q_{k+1} = q_k + h v_m                                                                 (7)
//
// M, J_n, J_t at q_k + h/2 v_k; contacts that would pull are left out and (4) is solved again. Order 2 between
// contacts. An impact takes the time t_c and has eps_r to O(h / t_c), so that the order through impacts is 1/2. With
// stiffness= the method converges to the motion of compliant bodies.
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

/// The steps (4)-(7) of one run.
class PenaltyRun {
 public:
  /// @param stiffness, slip_speed  of all contacts; 0 for those of the method
  PenaltyRun(const Problem& problem, const Settings& settings, double stiffness, double slip_speed);

  Solution take_steps();

 private:
  void linearize();
  void set_free_motion();
  bool find_contacts();
  void set_directions(int i);
  void set_coefficients(int i);
  void set_drag(int i);
  void solve(Vector& v_plus);
  bool set_impulses();

  const Problem& problem_;
  const ProblemInfo& info_;
  const double stiffness_, slip_speed_;
  const bool constant_matrix_;  // S, and M in it
  FixedStepRun run_;
  const double h_, t_c_;
  Counters& counters_;
  Matrix M_, f_q_, f_v_, S_, with_contacts_;
  BlockInverse W_, S_inverse_, contact_inverse_;
  Vector q_m_, f_, right_, change_, v_m_, WJ_, packed_n_, packed_t_, gaps_;
  std::vector<CompliantContact> contacts_;
};

PenaltyRun::PenaltyRun(const Problem& problem, const Settings& settings, double stiffness, double slip_speed)
    : problem_(problem),
      info_(problem.info()),
      stiffness_(stiffness),
      slip_speed_(slip_speed),
      constant_matrix_(info_.structure.constant_mass && info_.structure.constant_force_jacobian),
      run_(problem, settings),
      h_(run_.h),
      t_c_(kDuration * std::sqrt(h_ * info_.end_time)),
      counters_(run_.solution.counters),
      packed_n_(info_.n_normal_entries),
      packed_t_(info_.n_tangent_entries),
      gaps_(info_.n_c()),
      contacts_(info_.n_c()) {
  run_.solution.residuals.clear();  // there is no contact law to audit
  const int n_q = info_.n_q;
  for (auto* matrix : {&M_, &f_q_, &f_v_, &S_, &with_contacts_}) matrix->resize(n_q, n_q);
  for (auto* x : {&f_, &right_, &change_, &v_m_, &WJ_}) x->resize(n_q);
  for (int i = 0; i < info_.n_c(); ++i) {
    contacts_[i].zeta = damping_for(info_.contacts[i].eps_r);
    contacts_[i].J_n.setZero(n_q);
    contacts_[i].J_t.setZero(n_q, info_.contacts[i].n_t);
  }
  q_m_ = run_.q;
  if (constant_matrix_) {
    linearize();
    W_.compute(M_);
  }
}

/// S: the matrix of (4) without contacts.
void PenaltyRun::linearize() {
  problem_.mass_matrix(q_m_.data(), M_.data());
  problem_.force_jacobians(run_.q.data(), run_.v.data(), info_.u.data(), f_q_.data(), f_v_.data());
  S_ = M_ - (0.5 * h_) * f_v_ - (0.25 * h_ * h_) * f_q_;
  S_inverse_.compute(S_);
  ++counters_.jacobian_evaluations;
  ++counters_.matrix_factorizations;
}

/// Both sides of (4) without contacts.
void PenaltyRun::set_free_motion() {
  q_m_ = run_.q + (0.5 * h_) * run_.v;
  if (!constant_matrix_) linearize();
  problem_.force(run_.q.data(), run_.v.data(), info_.u.data(), f_.data());
  right_ = h_ * f_;
  if (info_.structure.force_uses_position) right_.noalias() += (0.5 * h_ * h_) * f_q_.lazyProduct(run_.v);
  ++counters_.force_evaluations;
}

/// Contacts with f_c < 0, with the coefficients of (5), (6). @return whether there are any
bool PenaltyRun::find_contacts() {
  problem_.gap(run_.q.data(), gaps_.data());
  if (!(gaps_.minCoeff() < 0)) return false;
  if (!constant_matrix_) W_.compute(M_);
  problem_.normal_jacobian(q_m_.data(), packed_n_.data());
  if (info_.has_friction()) problem_.tangent_jacobian(q_m_.data(), packed_t_.data());
  for (int i = 0; i < info_.n_c(); ++i) {
    contacts_[i].is_active = gaps_[i] < 0;
    if (!contacts_[i].is_active) continue;
    contacts_[i].gap = gaps_[i];
    set_directions(i);
    set_coefficients(i);
    if (info_.contacts[i].n_t > 0) set_drag(i);
  }
  return true;
}

void PenaltyRun::set_directions(int i) {
  CompliantContact& contact = contacts_[i];
  const ContactInfo& law = info_.contacts[i];
  const std::size_t entries = law.support.size(), n_pushed = law.pushed().size();
  for (std::size_t s = 0; s < n_pushed; ++s) {
    contact.J_n[law.support[s]] = packed_n_[law.normal_begin + s];
    for (int d = 0; d < law.n_t; ++d) contact.J_t(law.support[s], d) = packed_t_[law.tangent_begin + d * entries + s];
  }
  if (law.is_moving) contact.surface_n = packed_n_[law.normal_begin + n_pushed];
  for (int d = 0; d < law.n_t && law.is_moving; ++d)
    contact.surface_t[d] = packed_t_[law.tangent_begin + d * entries + n_pushed];
}

/// k and c of (5).
void PenaltyRun::set_coefficients(int i) {
  CompliantContact& contact = contacts_[i];
  W_.apply(contact.J_n, WJ_);
  const double m_n = 1 / contact.J_n.dot(WJ_);
  contact.k = stiffness_ > 0 ? stiffness_ : m_n * std::pow(std::numbers::pi / t_c_, 2);
  contact.c = 2 * contact.zeta * std::sqrt(contact.k * m_n);
}

/// The factor of J_t' v_m in (6).
void PenaltyRun::set_drag(int i) {
  CompliantContact& contact = contacts_[i];
  const ContactInfo& law = info_.contacts[i];
  const double pressed = std::max(0.0, -contact.k * contact.gap - contact.c * contact.normal_velocity(run_.v));  // (1)
  double slip = 0, tangential_delassus = 0;
  for (int d = 0; d < law.n_t; ++d) {
    v_m_ = contact.J_t.col(d);
    W_.apply(v_m_, WJ_);
    tangential_delassus = std::max(tangential_delassus, v_m_.dot(WJ_));
    slip += std::pow(contact.slip_velocity(d, run_.v), 2);
  }
  const double most = h_ * law.mu * pressed,
               v_s = slip_speed_ > 0 ? slip_speed_ : kSlipOfStep * most * tangential_delassus;
  contact.drag = most > 0 ? most / std::sqrt(slip + v_s * v_s) : 0;
}

/// (4) with the active contacts, their forces (5), (6) by v_{k+1}; v_m_.
void PenaltyRun::solve(Vector& v_plus) {
  with_contacts_ = S_;
  v_plus = right_;
  for (const CompliantContact& contact : contacts_) {
    if (!contact.is_active) continue;
    const double damping = h_ * (contact.c + 0.5 * h_ * contact.k);
    with_contacts_.noalias() += (0.5 * damping) * contact.J_n.lazyProduct(contact.J_n.transpose());
    v_plus -= (h_ * contact.k * contact.gap + damping * contact.normal_velocity(run_.v)) * contact.J_n;
    for (Eigen::Index d = 0; d < contact.J_t.cols(); ++d) {
      with_contacts_.noalias() += (0.5 * contact.drag) * contact.J_t.col(d).lazyProduct(contact.J_t.col(d).transpose());
      v_plus -= contact.drag * contact.slip_velocity(d, run_.v) * contact.J_t.col(d);
    }
  }
  contact_inverse_.compute(with_contacts_);
  ++counters_.matrix_factorizations;
  ++counters_.linear_solves;
  contact_inverse_.apply(v_plus, change_);
  v_plus = run_.v + change_;
  v_m_ = run_.v + 0.5 * change_;
}

/// (5), (6) of the active contacts; those that pull are active no more. @return whether there are none of these
bool PenaltyRun::set_impulses() {
  bool none_pulls = true;
  run_.clear_impulses();
  for (int i = 0; i < info_.n_c(); ++i) {
    CompliantContact& contact = contacts_[i];
    if (!contact.is_active) continue;
    const double impulse =
        -h_ * (contact.k * contact.gap + (contact.c + 0.5 * h_ * contact.k) * contact.normal_velocity(v_m_));
    contact.is_active = impulse >= 0;
    none_pulls = none_pulls && contact.is_active;
    run_.Lambda_n[i] = std::max(0.0, impulse);
    for (Eigen::Index d = 0; d < contact.J_t.cols(); ++d)
      run_.Lambda_t[info_.contacts[i].tangent_index + d] = -contact.drag * contact.slip_velocity(d, v_m_);
  }
  return none_pulls;
}

Solution PenaltyRun::take_steps() {
  run_.impact_place = 0.5;  // (7)
  return run_.take_steps([&](Vector& v_plus) {
    set_free_motion();
    if (info_.n_c() > 0 && find_contacts()) {
      do {
        solve(v_plus);
      } while (!set_impulses());
    } else {
      S_inverse_.apply(right_, change_);
      ++counters_.linear_solves;
      v_plus = run_.v + change_;
    }
    run_.q += (0.5 * h_) * (v_plus + run_.v);  // (7)
    return v_plus.allFinite() || run_.fail("the velocity is not finite");
  });
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
            .is_adaptive = false,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (problem.has_bilateral()) return Support::no("bilateral constraints would need a compliance of their own");
    if (problem.n_friction_elements > 0)
      return Support::no("the normal force of a friction element would oscillate on the spring of its contact");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return PenaltyRun(problem, settings, stiffness_, slip_speed_).take_steps();
  }

 private:
  std::string id_;
  double stiffness_, slip_speed_;
};

const bool registered = register_method<Penalty>({
    .name = "penalty",
    .usage = "penalty[,stiffness=N/m][,slip_speed=m/s]",
    .summary = "compliant contact: spring, damper, regularised friction",
    .examples = {"penalty"},
    .conformance_steps = 4000,
});

}  // namespace
}  // namespace ricochet
