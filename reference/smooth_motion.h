#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "reference/contact_dynamics.h"
#include "reference/event_located.h"
#include "reference/flights.h"
#include "reference/integrator.h"
#include "reference/slips.h"

namespace ricochet::reference {

/// Root functions at the end of a step, by contact.
struct Roots {
  explicit Roots(std::size_t n_c) : normal(n_c, false), friction(n_c, false) {}
  bool any() const { return std::ranges::count(normal, true) + std::ranges::count(friction, true) > 0; }

  std::vector<char> normal, friction;
};

/// The motion between two events, with the modes of ContactDynamics. It ends at the first downward zero crossing
/// of a root function:
///
///   open               gap, with the offset of Flights                                   (1)
///   closed             lambda_n; 1 if bilateral                                          (1)
///   in a region        the border, regions.h (1)
///   with friction      stick  mu lambda_n - |lambda_t|                                   (2)
///                      slip   Slips::root                                                (3)
///
/// Roots within a step are found by StepWatch. More variables than q and v are integrated. They are used only by the
/// error control:
///
///   the gaps of open, curved contacts            free fall is exact in steps of any length, which would miss the waves
///                                                of a moving surface
///   impulses of the contacts, with friction or   a body that sticks or rests does not move while its forces vary, and
///   if the scene depends on time                 longer steps would not resolve them
class SmoothMotion final : public SmoothSystem {
 public:
  /// @param settings  integrator and tolerance; the others must outlive this object. The modes are those of `dynamics`
  SmoothMotion(const Problem& problem, const Scales& scales, const EventLocatedSettings& settings,
               ContactDynamics& dynamics, const Slips& slips, const Flights& flights);
  SmoothMotion(const SmoothMotion&) = delete;
  SmoothMotion& operator=(const SmoothMotion&) = delete;

  /// Starts after an event.
  void restart(double t, const Vector& q, const Vector& v);
  /// Makes one step. @param t  in: its start, out: its end or the root [s]
  /// @param longest  longest step, 0: no limit [s]
  StepEnd step(double& t, double longest) { return integrator_->step(t, longest); }
  Integrator& integrator() { return *integrator_; }
  const Integrator& integrator() const { return *integrator_; }
  /// State at the end of the step, or within it.
  void load(Vector& q, Vector& v) const;
  void load(double t, Vector& q, Vector& v);

  /// Roots at the end of the step, and roots that were missed.
  Roots roots_at_end(StepEnd end, const Vector& q, const Vector& v) const;
  /// The switching function of a region that reached its border at the end of the step; -1: none.
  int border_at_end(StepEnd end) const;
  /// sigma_k psi_k of a region.
  double inside(int k, const Vector& q, const Vector& v) const;
  /// The one that is beyond its border at (q, v); -1: none.
  int border_passed(const Vector& q, const Vector& v) const;
  Roots no_roots() const { return Roots(static_cast<std::size_t>(n_c_)); }
  int size() const override { return static_cast<int>(floor_.size()); }
  int n_roots() const override { return n_roots_; }
  bool rates(const double* y, double* y_dot) override;
  /// (1)-(3). @param y  q, then v
  bool roots(const double* y, double* values) override;
  void error_weights(const double* y, double* weights) const override;

  /// Evaluates the acceleration at (q, v) and the forces of closed contacts, which the functions below return. They are
  /// those of the last evaluation. False if ContactDynamics does not determine them.
  bool accelerate(const Vector& q, const Vector& v) { return accelerate(q.data(), v.data(), a_.data()); }
  const Vector& acceleration() const { return a_; }
  double normal_force(int i) const { return lambda_n_[i]; }
  Eigen::VectorBlock<const Vector> tangential_force(int i) const {
    const auto& contact = problem_.info().contacts[i];
    return lambda_t_.segment(contact.tangent_index, contact.n_t);
  }
  /// (2)
  double cone_slack(int i) const { return problem_.info().contacts[i].mu * lambda_n_[i] - tangential_force(i).norm(); }
  /// Index of (2), (3) among the root functions; -1 without friction.
  int friction_root(int i) const { return friction_root_[i]; }
  /// The largest normal force of a contact in all calls of note_forces() [N].
  double force_size(int i) const { return force_size_[i]; }
  void note_forces();

  /// Adds the integrator's work since its last start.
  void count(Counters& counters) const;

 private:
  bool accelerate(const double* q, const double* v, double* a) {
    return dynamics_.acceleration(q, v, a, lambda_n_.data(), lambda_t_.data());
  }
  void set_borders(const double* q, const double* v, double* values) const;
  bool accelerate_for_roots(const double* y);
  void set_friction_roots(const double* y, double* values);
  void load_from(const double* y, Vector& q, Vector& v) const {
    q = Eigen::Map<const Vector>(y, n_q_);
    v = Eigen::Map<const Vector>(y + n_q_, n_q_);
  }
  bool is_closed_now(int i) const { return is_closed(dynamics_.modes()[i]); }

  const Problem& problem_;
  const Scales& scales_;
  const EventLocatedSettings& settings_;
  ContactDynamics& dynamics_;
  const Slips& slips_;
  const Flights& flights_;
  const int n_q_, n_c_, n_s_, n_roots_;
  const std::vector<int> curved_;  // contacts
  const bool has_impulses_;        // among the unknowns
  const Vector floor_;             // of the absolute tolerances, by unknown
  const std::unique_ptr<Integrator> integrator_;
  std::vector<int> friction_root_;  // index of (2), (3) among the root functions, by contact; -1 without friction
  Vector force_size_;
  Vector packed_n_, packed_t_, lambda_n_, lambda_t_, a_;
  struct {
    bool has = false;
    Vector y, a, lambda_n, lambda_t;
  } known_;  // accelerations and forces of the last roots()
};

}  // namespace ricochet::reference
