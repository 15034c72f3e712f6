#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/elements/bilateral_support.h"
#include "methods/fesd/capture.h"
#include "methods/fesd/fesd_audit.h"
#include "methods/fesd/moving_contacts.h"
#include "methods/fesd/pivoting_solver.h"
#include "methods/fesd/record_step.h"
#include "methods/fesd/sensitivity.h"
#include "methods/registry.h"
#include "methods/runge_kutta/tableau_argument.h"
#include "methods/time_limit.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

/// |C| 2^p of FesdAdaptive (2)
double error_constant(const ButcherTableau& tableau) {
  const int p = tableau.order;
  Vector A_p = Vector::Ones(tableau.n_s);
  for (int k = 0; k < p; ++k) A_p = (tableau.A * A_p).eval();
  const double of_stability = tableau.b.dot(A_p) - 1 / std::tgamma(p + 2);
  const double of_quadrature = (tableau.b.dot(tableau.c.array().pow(p).matrix()) - 1.0 / (p + 1)) / std::tgamma(p + 1);
  return std::max(std::abs(of_stability), std::abs(of_quadrature)) * std::pow(2, p);
}

/// FESD-J with error control: every element is a step of its own. It ends where the tolerance or a switch says; the
/// lengths are free, so step equilibration has nothing to do.
///
/// Estimate. The accelerations w(c) of an element, as a polynomial through its n_s stages, have Legendre coefficients
///
///   alpha_k = sum_j L_kj w_j,   sum_k alpha_k P_k(2 c_j - 1) = w_j.                                           (1)
///
/// Where the solution behaves like exp(lambda t), |alpha_k| / |w| is about x^k / (2 k - 1)!!, x = |lambda| h / 2, and a
/// method of order p leaves an error of |C| (2 x)^p h |w| in the velocity, with C the first coefficient of its
/// stability function that is not that of exp,
///
///   C = b' A^p 1 - 1 / (p + 1)!,   or  (b' c^p - 1 / (p + 1)) / p!  of its quadrature if that is larger.      (2)
///
/// The last coefficient alpha_k says what x is, and the one before it too in case the last is small by chance, for each
/// velocity
///
///   e_v = |C| 2^p h |w| max over k = n_s - 1, n_s - 2 >= 1 of ((2 k - 1)!! |alpha_k| / |w|)^(p / k),   e_q = h e_v.
///   (3)
///
/// This is the local error of order p + 1 itself, without evaluating anything: not that of a lower-order method
/// embedded in it. Where surfaces move by themselves, gaps and slip paths are estimated as well (moving_contacts.h).
///
/// A step is accepted when e <= tol (1 + |x|) in every component. The next one has length
///
///   h min(4, max(1/5, 0.8 (tol (1 + |x|) / e)^(1 / (p + 1))))                                                (4)
///
/// at most end_time, but the same length as long as (4) asks for 0.9 to 1.5 of it: the Newton matrix of a length is
/// kept. Steps for which no solution was found are halved. A contact that bounces with less than tol / kappa stays
/// closed (capture.h): its stage forces stop it with accelerations of kappa v_n / h, and an accumulation of impacts
/// ends there, with an error of tol.
///
/// Sensitivities are derivatives of the solution at the lengths chosen, as usual for a method that chooses them: h does
/// not depend on theta where (4) gave it, follows from the switch equation where the element ends at a switch, and the
/// last element has what remains. A perturbation may oscillate where the solution does not; so the lengths have to hold
/// (3) for the derivatives of w, q and v as well, each within tol (1 + |dx|).
class FesdAdaptive final : public Method {
 public:
  explicit FesdAdaptive(const MethodSpec& spec) : id_(spec.text()), tableau_(tableau_argument(spec)) {
    options_.n_fe = 1;
    options_.between_stages = true;
    cone_ = cone_argument(spec);
    options_.facets = cone_.facets;
    const int n = tableau_.n_s;
    bool is_distinct = true;
    for (int j = 0; j < n; ++j) {
      for (int m = 0; m < j; ++m) is_distinct = is_distinct && tableau_.c[j] != tableau_.c[m];
    }
    if (n < 2 || !is_distinct) {
      throw InputError("tableau of fesd_adaptive", tableau_.name,
                       "at least two stages with different nodes c are required, the error estimate needs them");
    }
    Matrix values(n, n);  // P_k(2 c_j - 1)
    for (int j = 0; j < n; ++j) {
      for (int k = 0; k < n; ++k) values(j, k) = std::legendre(static_cast<unsigned>(k), 2 * tableau_.c[j] - 1);
    }
    legendre_ = values.inverse();
    odd_factorial_ = Vector::Ones(n);
    for (int k = 2; k < n; ++k) odd_factorial_[k] = (2 * k - 1) * odd_factorial_[k - 1];
    error_constant_ = error_constant(tableau_);
    if (const Capture captured = capture(tableau_); tableau_.is_stiffly_accurate() && captured.absorbs())
      kappa_ = captured.kappa;
  }

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("FESD-J, {}, error-controlled", tableau_.name),
            .source = "Nurkanovic, Frey, Pozharskiy, Diehl: FESD-J, section 3; error control of this project",
            .order_smooth = static_cast<double>(tableau_.order),
            .order_impacts = static_cast<double>(tableau_.order),
            .is_adaptive = true,
            .has_sensitivities = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    // A body that rests on a surface which is accelerated would creep along in steps as short as rounding asks for.
    const auto rests_on_moving = [](const ContactInfo& contact) {
      return contact.is_moving && !contact.is_affine && contact.eps_r == 0;
    };
    const auto found = std::find_if(problem.contacts.begin(), problem.contacts.end(), rests_on_moving);
    if (!tableau_.is_stiffly_accurate() && found != problem.contacts.end()) {
      return Support::no(fmt::format(
          "tableau {} has no stage at the right end; what rests on '{}', a surface that is accelerated, needs one",
          tableau_.name, found->name));
    }
    return can_hold_bilateral(tableau_, problem);
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override;

 private:
  using State = Eigen::Ref<const Vector>;
  double error(double h, const Eigen::Ref<const Matrix>& w, const State& q, const State& v, double tolerance) const;
  double error(const Element& e, double tolerance) const { return error(e.h, e.a, e.q0, e.v0, tolerance); }
  double error(const Element& e, const Sensitivity& sensitivity, double tolerance) const;

  std::string id_;
  ButcherTableau tableau_;
  FrictionConeOptions cone_;
  PivotingSolver::Options options_;
  Matrix legendre_;                                         // L of (1)
  Vector odd_factorial_;                                    // (2 k - 1)!!
  double error_constant_ = 1;                               // |C| 2^p
  double kappa_ = std::numeric_limits<double>::infinity();  // no capture without a stage at the right end that stops it
};

constexpr double kMaxGrowth = 4;
constexpr double kFirstStep = 0.05;        // of end_time; the first elements tell more
constexpr double kHopeless = 100;          // an error that an element which ends at a switch inside will hardly lose
constexpr double kShortest = 1e-13;        // of end_time; what time can resolve
constexpr double kShortestOnCurve = 1e-6;  // of end_time, where shorter steps would only drift a little less
constexpr int kMaxRefusals = 6;            // of a capture: by then its step is a ten thousandth
constexpr double kCaptureErrors = 2;       // errors of an element that a captured velocity explains, by that velocity
constexpr int kMaxStandstills = 100;       // steps in a row too short to move t; a few switches may coincide

/// (1), (3), relative to the tolerance: the largest of all components. @param w  n_q x n_s
double FesdAdaptive::error(double h, const Eigen::Ref<const Matrix>& w, const State& q, const State& v,
                           double tolerance) const {
  const int n_s = tableau_.n_s;
  double worst = 0;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const double size = w.row(i).cwiseAbs().maxCoeff();
    if (size == 0) continue;
    double decay = 0;
    for (int k = n_s - 1; k >= std::max(1, n_s - 2); --k) {
      const double alpha = std::abs(legendre_.row(k).dot(w.row(i)));
      decay = std::max(decay, std::pow(odd_factorial_[k] * alpha / size, static_cast<double>(tableau_.order) / k));
    }
    const double e_v = error_constant_ * h * size * decay, e_q = h * e_v;
    worst = std::max({worst, e_v / (tolerance * (1 + std::abs(v[i]))), e_q / (tolerance * (1 + std::abs(q[i])))});
  }
  return worst;
}

/// The same for the derivatives in the element that was added last.
double FesdAdaptive::error(const Element& e, const Sensitivity& sensitivity, double tolerance) const {
  double worst = 0;
  for (Eigen::Index k = 0; k < sensitivity.dq().cols(); ++k) {
    const Eigen::Map<const Matrix> dw(sensitivity.stage_accelerations().col(k).data(), e.a.rows(), e.a.cols());
    worst = std::max(worst, error(e.h, dw, sensitivity.dq().col(k), sensitivity.dv().col(k), tolerance));
  }
  return worst;
}

Solution FesdAdaptive::do_solve(const Problem& problem, const Settings& settings) const {
  Solution solution;
  PivotingSolver::Options options = options_;
  options.tolerance = settings.inner_tolerance;
  PivotingSolver solver(problem, tableau_, options, solution.counters);
  std::optional<FesdAudit> audit;
  if (settings.audit) audit.emplace(problem, tableau_, true, 0.0, cone_);
  std::optional<Sensitivity> sensitivity;
  if (!settings.sensitivities.empty()) sensitivity.emplace(problem, tableau_, settings.sensitivities);
  const TimeLimit time_limit(settings.time_limit);

  const ProblemInfo& info = problem.info();
  const double T = info.end_time;
  solver.start(info.q0, info.v0);
  const Element* reached = nullptr;
  MovingContacts moving(problem);
  const auto error_of = [&](const Element& element) {
    const double of_state = error(element, settings.tolerance);
    if (moving.empty()) return of_state;
    const Matrix& w = moving.accelerations(element);
    const Vector none = Vector::Zero(w.rows());
    return std::max(of_state, error(element.h, w, none, none, settings.tolerance));
  };
  const std::function<bool(const Element&)> is_accurate = [&](const Element& element) {
    return error_of(element) <= kHopeless;
  };
  double t = 0, h = kFirstStep * T;
  int standstills = 0;
  const double may_be_captured = settings.tolerance / kappa_;
  double capture = may_be_captured;
  int refusals = 0;  // of the captures at t
  while (t < T) {
    // The last two steps share what is left, so that none is tiny.
    const double rest = T - t;
    const bool is_last = h >= rest * (1 - 1e-12);
    const double H = is_last ? rest : (2 * h > rest ? 0.5 * rest : h);
    PivotingSolver::ElementStep advanced{.status = Status::time_limit, .closed = {}};
    if (!time_limit.is_over()) advanced = solver.advance_to_switch(H, capture, is_accurate);
    const Status status = advanced.status;
    double scaled_error = 0;
    if (status == Status::success) {
      const Element& element = solver.step().last();
      scaled_error = error_of(element);
      if (sensitivity && solver.step().has_impact_sequence()) {
        solution.status = Status::infeasible;
        solution.message = fmt::format("t = {:.12g} s: {}", t, Sensitivity::kNoDerivative);
        break;
      }
      if (sensitivity) {
        sensitivity->add(solver.step(), is_last ? sensitivity->dt_final() : sensitivity->dt());
        scaled_error = std::max(scaled_error, error(element, *sensitivity, settings.tolerance));
      }
      const double wanted = std::clamp(0.8 * std::pow(std::max(scaled_error, 1e-300), -1.0 / (tableau_.order + 1)), 0.2,
                                       kMaxGrowth);  // (4)
      const bool was_refused = advanced.closed.throughout && capture == 0;
      if (scaled_error > kHopeless && H <= kShortest * T) {
        solution.status = Status::step_limit;
        solution.message = fmt::format("t = {:.12g} s: a step of {:.3g} s still has {:.3g} times the error allowed", t,
                                       H, scaled_error);
        break;
      }
      if (scaled_error > 1 && H > kShortest * T && !was_refused) {
        // What the forces of a capture do is the same in a shorter step: the contact has to bounce once more.
        const bool is_captured = advanced.closed.throughout;
        capture = is_captured ? 0 : capture;
        solver.reject();
        if (sensitivity) sensitivity->reject();
        h = is_captured ? h : solver.step().H * wanted;
        continue;
      }
      // A bounce that cannot be followed is closed, and its velocity is an error that no shorter step loses. The motion
      // behind it has to be as accurate as elsewhere.
      const bool is_of_motion = scaled_error * settings.tolerance > kCaptureErrors * advanced.closed.speed;
      if (scaled_error > 1 && H > kShortest * T && was_refused && is_of_motion && ++refusals <= kMaxRefusals) {
        solver.reject();
        if (sensitivity) sensitivity->reject();
        h = 0.2 * H;
        continue;
      }
      refusals = 0;
      capture = may_be_captured;
      // An element that a switch has cut short says what its own length may become; if it is too short for that, the
      // length before it was good enough.
      const bool is_cut = solver.step().H < H;
      if (is_cut)
        h = std::min(wanted < kMaxGrowth ? solver.step().H * wanted : std::max(h, solver.step().H * wanted), T);
      else if (wanted < 0.9 || wanted > 1.5)
        h = std::min(std::max(H, h) * wanted, T);
    } else if (status != Status::time_limit && solver.failure().depends_on_length() &&
               H > (solver.failure().drifts() ? kShortestOnCurve : kShortest) * T) {
      h = 0.5 * H;
      continue;
    }
    if (status != Status::success) {
      solution.status = status;
      const std::string reason = status == Status::time_limit ? time_limit.message() : solver.failure_message();
      solution.message = fmt::format("from t = {:.12g} s, with a step of {:.3g} s: {}", t, H, reason);
      break;
    }
    const FesdStep* previous = solver.previous_step();
    record_step(problem, settings.recording, solver.step(), previous, t, sensitivity ? &*sensitivity : nullptr,
                solution);
    if (audit) audit->add(solver.step(), previous, t);
    reached = &solver.step().last();
    const double next = is_last && solver.step().H == H ? T : t + solver.step().H;
    standstills = next > t ? 0 : standstills + 1;
    t = next;
    solution.t = t;
    if (standstills > kMaxStandstills) {
      solution.status = Status::step_limit;
      solution.message = fmt::format("t = {:.12g} s: {} steps in a row too short to move the time", t, standstills);
      break;
    }
  }
  solution.q = reached ? reached->q1 : info.q0;
  solution.v = reached ? reached->v1 : info.v0;
  if (audit) solution.residuals = audit->residuals();
  if (sensitivity) {
    solution.dq = sensitivity->dq();
    solution.dv = sensitivity->dv();
  }
  return solution;
}

const bool registered = register_method<FesdAdaptive>({
    .name = "fesd_adaptive",
    .usage = "fesd_adaptive:TABLEAU:STAGES[,cone=exact|squared|polyhedral][,facets=8], or "
             "fesd_adaptive:@TABLEAU_FILE, with --tolerance",
    .max_arguments = 2,
    .summary = "FESD-J with steps that follow a tolerance",
    .examples = {"fesd_adaptive:radau-iia:3", "fesd_adaptive:radau-iia:4", "fesd_adaptive:gauss:4"},
});

}  // namespace
}  // namespace ricochet
