#include "bench/measure/metrics/law_residuals.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/measure/metrics/motion_integral.h"

namespace ricochet {
namespace {

/// W = J_n' M^-1 J_n of one contact [1/kg]. @param normal  the direction of its force
double delassus_entry(const Eigen::LLT<Matrix>& mass, const Vector& normal) {
  return normal.dot(mass.solve(normal));
}

void measure_impact(const Problem& problem, const Event& event, int i, Metrics& metrics) {
  const ContactInfo& contact = problem.info().contacts[static_cast<std::size_t>(i)];
  const Matrix J_n = problem.normal_jacobian(event.q);
  const double W = delassus_entry(problem.mass_matrix(event.q).llt(), problem.force_directions(J_n).col(i));
  const double Lambda_n = event.Lambda_n[i];
  if (Lambda_n > 0) raise_to(metrics.signorini, std::abs(problem.gap(event.q)[i]));  // (1)
  if (problem.info().impact_law.hypothesis == ImpactHypothesis::newton) {
    const double rate = J_n.col(i).dot(event.v_minus),
                 u = J_n.col(i).dot(event.v_plus) + contact.restitution(rate) * rate;
    raise_to(metrics.restitution, std::abs(std::min(u, W * Lambda_n)));  // (2)
  }
  if (contact.n_t == 0 || event.Lambda_t.size() == 0) return;
  const Vector Lambda_t = event.Lambda_t.segment(contact.tangent_index, contact.n_t);
  const Vector v_t =
      problem.tangent_jacobian(event.q).middleCols(contact.tangent_index, contact.n_t).transpose() * event.v_plus;
  const double most = contact.mu * Lambda_n;
  raise_to(metrics.cone, std::max(0.0, W * (Lambda_t.norm() - most)));                           // (3)
  if (most > 0) raise_to(metrics.dissipation, std::abs(v_t.norm() + Lambda_t.dot(v_t) / most));  // (4)
}

std::vector<int> closed_contacts(const std::vector<ContactMode>& modes) {
  std::vector<int> closed;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (is_closed(modes[i])) closed.push_back(static_cast<int>(i));
  }
  return closed;
}

/// Residuals of the contact laws in closed contacts, instant by instant.
class PersistentContacts {
 public:
  PersistentContacts(const Problem& problem, Metrics& metrics) : problem_(problem), metrics_(metrics) {}

  /// @param weight  of the instant in integrals over the time [s]
  void measure(const std::vector<int>& closed, const Vector& q, const Vector& v, const Vector& a, double weight) {
    const ProblemInfo& info = problem_.info();
    const Vector gap = problem_.gap(q);
    for (const int i : closed) {
      const bool is_bilateral = info.contacts[static_cast<std::size_t>(i)].is_bilateral;
      if (!is_bilateral) raise_to(metrics_.contact_gap, std::abs(gap[i]));  // (7)
    }
    if (is_redundant_) return;

    const Matrix J_t = problem_.tangent_jacobian(q), tangents = problem_.force_directions(J_t),
                 normals = problem_.force_directions(problem_.normal_jacobian(q));
    Matrix J(q.size(), 0);
    const auto add = [&](const auto& columns) {
      J.conservativeResize(Eigen::NoChange, J.cols() + columns.cols());
      J.rightCols(columns.cols()) = columns;
    };
    for (const int i : closed) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(i)];
      add(normals.col(i));
      if (contact.n_t > 0) add(tangents.middleCols(contact.tangent_index, contact.n_t));
    }
    const Matrix M = problem_.mass_matrix(q);
    const Eigen::LLT<Matrix> mass(M);
    const Eigen::ColPivHouseholderQR<Matrix> forces(mass.matrixL().solve(J));
    is_redundant_ = forces.rank() < J.cols();
    if (is_redundant_) {
      metrics_.contact_pull = metrics_.contact_cone = metrics_.contact_dissipation = Metrics::kNone;
      return;
    }
    const Vector lambda = forces.solve(mass.matrixL().solve(M * a - problem_.force(q, v)));  // (5)
    Eigen::Index at = 0;
    for (const int i : closed) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(i)];
      const double lambda_n = lambda[at];
      const Vector lambda_t = lambda.segment(at + 1, contact.n_t);
      at += 1 + contact.n_t;
      if (contact.is_bilateral) continue;
      const double W = delassus_entry(mass, normals.col(i));
      add_to(metrics_.contact_pull, weight * W * std::max(0.0, -lambda_n));  // (8)
      if (contact.n_t == 0) continue;
      const Vector v_t = J_t.middleCols(contact.tangent_index, contact.n_t).transpose() * v;
      const double most = contact.mu * lambda_n, at_rest = std::max(contact.mu, contact.mu_static) * lambda_n;
      add_to(metrics_.contact_cone, weight * W * std::max(0.0, lambda_t.norm() - at_rest));            // (9)
      add_to(metrics_.contact_dissipation, weight * std::abs(most * v_t.norm() + lambda_t.dot(v_t)));  // (10)
    }
  }

 private:
  const Problem& problem_;
  Metrics& metrics_;
  bool is_redundant_ = false;  // at some instant so far
};

/// The solution tells an impact at the time `t` that `is_it` holds for.
template <class IsIt>
bool tells_impact(const Solution& solution, double t, IsIt is_it) {
  const double rounding = 1e-12 * (1 + std::abs(t));
  const auto& events = solution.events;
  auto event = std::ranges::lower_bound(events, t - rounding, {}, &Event::t);
  for (; event != events.end() && event->t <= t + rounding; ++event) {
    if (event->kind == EventKind::impact && is_it(*event)) return true;
  }
  return false;
}

/// The jump of v where a piece begins is an impact. @param before, after  v on either side
bool begins_with_impact(const Solution& solution, double begin, const Vector& before, const Vector& after) {
  return tells_impact(solution, begin, [&](const Event& event) {
    return (event.v_plus - after).norm() < (event.v_plus - before).norm();
  });
}

/// Whether an impact ends a piece with constant v. @param v_end  velocity at the end of the piece
bool ends_with_impact(const Solution& solution, double end, const Vector& v_end) {
  return tells_impact(solution, end, [&](const Event& event) {
    return (event.v_minus - v_end).norm() < (event.v_plus - v_end).norm();
  });
}

}  // namespace

void measure_impacts(const Problem& problem, const Solution& solution, Metrics& metrics) {
  for (const Event& event : solution.events) {
    if (event.kind == EventKind::impact && event.Lambda_n.size() > 0)
      measure_impact(problem, event, event.contact, metrics);
  }
}

void measure_persistent_contact(const Problem& problem, const Solution& solution, const Solution& reference,
                                Metrics& metrics) {
  const Motion& motion = solution.motion;
  PersistentContacts contacts(problem, metrics);
  Vector q, v, a, v_end, before = problem.info().v0;
  for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) {
    const double begin = motion.begin_of(piece), end = motion.end_of(piece), length = end - begin;
    motion.within(piece, 1, q, v_end);
    motion.within(piece, 0, q, v);
    const bool is_impact = begins_with_impact(solution, begin, before, v);
    const Vector jump = is_impact ? Vector(Vector::Zero(v.size())) : Vector(v - before);
    before = v_end;
    // In a step of time stepping with an impact, the impulse contains the forces, and v is constant on either side of it.
    if (v == v_end && (is_impact || ends_with_impact(solution, end, v_end))) continue;
    const auto cuts = cuts_of(motion, piece, reference.events, [](const Event&) { return true; });
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      const double h = cuts[k + 1] - cuts[k];
      const auto next = std::ranges::upper_bound(reference.events, cuts[k] + h / 2, {}, &Event::t);
      const auto& modes = next == reference.events.begin() ? reference.initial_modes : (next - 1)->modes;
      const std::vector<int> closed = closed_contacts(modes);
      if (closed.empty()) continue;
      for (const auto& [place, weight] : kGauss) {
        const double s = std::clamp((cuts[k] + place * h - begin) / length, 0.0, 1.0);
        motion.within(piece, s, q, v);
        motion.acceleration_within(piece, s, a);
        contacts.measure(closed, q, v, a + jump / length, weight * h);  // (6)
      }
    }
  }
}

}  // namespace ricochet
