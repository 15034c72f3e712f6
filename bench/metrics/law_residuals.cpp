#include "bench/metrics/law_residuals.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/metrics/motion_integral.h"

namespace ricochet {
namespace {

/// J_n' M^-1 J_n of one contact [1/kg].
double delassus_entry(const Problem& problem, const Matrix& J_n, const Eigen::LLT<Matrix>& mass, int i) {
  const Vector force = problem.force_directions(J_n).col(i);
  return force.dot(mass.solve(force));
}

void measure_impact(const Problem& problem, const Event& event, int i, Metrics& metrics) {
  const ContactInfo& contact = problem.info().contacts[static_cast<std::size_t>(i)];
  const Matrix J_n = problem.normal_jacobian(event.q);
  const double W = delassus_entry(problem, J_n, problem.mass_matrix(event.q).llt(), i);
  const double Lambda_n = event.Lambda_n[i];
  if (Lambda_n > 0) raise(metrics.signorini, std::abs(problem.gap(event.q)[i]));  // (1)
  if (problem.info().impact_law.hypothesis == ImpactHypothesis::newton) {
    const double u = J_n.col(i).dot(event.v_plus) + contact.eps_r * J_n.col(i).dot(event.v_minus);
    raise(metrics.restitution, std::abs(std::min(u, W * Lambda_n)));  // (2)
  }
  if (contact.n_t == 0 || event.Lambda_t.size() == 0) return;
  const Vector Lambda_t = event.Lambda_t.segment(contact.tangent_index, contact.n_t);
  const Vector v_t =
      problem.tangent_jacobian(event.q).middleCols(contact.tangent_index, contact.n_t).transpose() * event.v_plus;
  const double most = contact.mu * Lambda_n;
  raise(metrics.cone, std::max(0.0, W * (Lambda_t.norm() - most)));                                 // (3)
  if (most > 0) raise(metrics.dissipation, std::abs(v_t.norm() + Lambda_t.dot(v_t) / most));  // (4)
}

std::vector<int> closed_contacts(const std::vector<ContactMode>& modes) {
  std::vector<int> closed;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (is_closed(modes[i])) closed.push_back(static_cast<int>(i));
  }
  return closed;
}

/// What a motion does at one instant in contacts that are closed.
class LastingContacts {
 public:
  LastingContacts(const Problem& problem, Metrics& metrics) : problem_(problem), metrics_(metrics) {}

  /// @param weight  of the instant in integrals over the time [s]
  void measure(const std::vector<int>& closed, const Vector& q, const Vector& v, const Vector& a, double weight) {
    const ProblemInfo& info = problem_.info();
    const Vector gap = problem_.gap(q);
    for (const int i : closed) raise(metrics_.contact_gap, std::abs(gap[i]));  // (7)

    const Matrix J_n = problem_.normal_jacobian(q), J_t = problem_.tangent_jacobian(q);
    const Matrix normals = problem_.force_directions(J_n), tangents = problem_.force_directions(J_t);
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
    if (forces.rank() < J.cols()) return;
    const Vector lambda = forces.solve(mass.matrixL().solve(M * a - problem_.force(q, v)));  // (5)
    Eigen::Index at = 0;
    for (const int i : closed) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(i)];
      const double lambda_n = lambda[at];
      const Vector lambda_t = lambda.segment(at + 1, contact.n_t);
      at += 1 + contact.n_t;
      if (contact.is_bilateral) continue;
      const double W = delassus_entry(problem_, J_n, mass, i);
      add_to(metrics_.contact_pull, weight * W * std::max(0.0, -lambda_n));  // (8)
      if (contact.n_t == 0) continue;
      const Vector v_t = J_t.middleCols(contact.tangent_index, contact.n_t).transpose() * v;
      const double most = contact.mu * lambda_n;
      add_to(metrics_.contact_cone, weight * W * std::max(0.0, lambda_t.norm() - most));             // (9)
      add_to(metrics_.contact_dissipation, weight * std::abs(most * v_t.norm() + lambda_t.dot(v_t)));  // (10)
    }
  }

 private:
  const Problem& problem_;
  Metrics& metrics_;
};

/// Whether the solution tells an impact about the begin of a piece, up to its length away.
bool has_impact(const Solution& solution, double begin, double length) {
  const auto& events = solution.events;
  auto event = std::ranges::lower_bound(events, begin - length, {}, &Event::t);
  for (; event != events.end() && event->t <= begin + length; ++event) {
    if (event->kind == EventKind::impact) return true;
  }
  return false;
}

}  // namespace

void measure_impacts(const Problem& problem, const Solution& solution, Metrics& metrics) {
  for (const Event& event : solution.events) {
    if (event.kind == EventKind::impact && event.Lambda_n.size() > 0)
      measure_impact(problem, event, event.contact, metrics);
  }
}

void measure_contacts(const Problem& problem, const Solution& solution, const Solution& reference, Metrics& metrics) {
  const Motion& motion = solution.motion;
  LastingContacts contacts(problem, metrics);
  Vector q, v, a, v_before;
  for (std::size_t piece = 0; piece < motion.n_pieces(); ++piece) {
    const double begin = motion.begin_of(piece), length = motion.end_of(piece) - begin;
    motion.within(piece, 0, q, v);
    Vector jump = v - (piece == 0 ? problem.info().v0 : v_before);
    motion.within(piece, 1, q, v_before);
    if (has_impact(solution, begin, length)) {
      if (v == v_before) continue;  // the step of time stepping: its forces are in the impulse
      jump.setZero();
    }
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
