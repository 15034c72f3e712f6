// Soft step, also called TGS soft: what Box2D has in its third version. Contacts are critically overdamped springs that
// Gauss-Seidel sweeps solve in substeps, followed by sweeps without springs.
//
// A step of length H has n substeps of length h = H / n. Each is symplectic Euler with contacts, M, J_n, J_t, f at its
// beginning:
//
//   v <- v + h M^-1 f + M^-1 (J_n lambda_n + J_t lambda_t)   with the impulses of the substep before   (1)
//   a sweep with springs (3), then (4);   q <- q + h v;   a sweep without springs, then (4)           (2)
//
// A sweep goes through the contacts once: constraints first, and of a contact its normal direction first,
//
//   lambda_n <- max(0, lambda_n - m (a_m J_n' v + b) - a_i lambda_n),   m = 1 / (J_n' M^-1 J_n)        (3)
//   lambda_t <- P(lambda_t - (J_t' M^-1 J_t)^-1 J_t' v),   P: onto the disc of radius mu lambda_n      (4)
//
// and v follows each change. b = f_c / h, a_m = 1, a_i = 0 where the gap is open ("speculative"), and b = 0 in a sweep
// without springs; in one with, where f_c <= 0,
//
//   b = max(a_m omega / (2 zeta + h omega) f_c, -a_m c),   a_m = h omega (2 zeta + h omega) a_i,
//   a_i = 1 / (1 + h omega (2 zeta + h omega)),   omega = 2 pi min(frequency, 1 / (4 h))                 (5)
//
// zeta = damping_ratio=, c = push_out= (0: no limit). Bilateral constraints have (3) without max(), twice omega and
// zeta = 2. After the substeps, in one sweep over the contacts that approached with J_n' v_k <= -threshold at the
// beginning of the step and carried an impulse in it,
//
//   lambda_n <- max(0, lambda_n - m (J_n' v + eps_r J_n' v_k))                                         (6)
//
// A body at rest stands g / omega^2 below the surface, 0.28 mm with 30 Hz under gravity: there the spring balances the
// part of the weight that (3) leaves. It approaches this depth with the rate a_m omega / (2 zeta + h omega), which is
// omega / (2 zeta) = 9 / s in steps of engines and h omega^2 in small ones, so that the order is 1 once
// h omega 2 zeta << 1, h << 0.3 ms. A large frequency is limited to 1 / (4 h): the penetration is O(h^2). The impulse
// of (6) has no friction and ignores joints: oblique impacts with restitution do not converge.
// Source: E. Catto, Box2D v3, src/contact_solver.c and src/solver.c; Soft Constraints, GDC 2011; Solver2D, 2024.
// Differs from the source: 1. generalised coordinates, double precision, friction in space with a disc; 2. forces, gaps,
// M, J_n, J_t are evaluated in each substep, where the source keeps forces and anchors of contacts; 3. the source's
// contacts with static bodies have twice the frequency; a scene does not tell which they are; 4. threshold=0, where
// the source has 1 m/s (of engines: threshold=1,push_out=3); 5. contacts that can close in the step are found by (1) of
// sequential_contacts.h, the source has 0.02 m; no continuous collision, no sleep, no limit of speed.

#include <fmt/format.h>

#include <numbers>

#include "methods/registry.h"
#include "methods/time_stepping/common/sequential_contacts.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

constexpr double kCap = 0.25;          // of the substep rate
constexpr double kJointFrequency = 2;  // of that of contacts
constexpr double kJointDampingRatio = 2;

struct SoftStepOptions {
  int substeps;
  double frequency, damping_ratio, threshold, push_out;
};

/// (5)
struct Softness {
  double bias_rate = 0, mass_scale = 1, impulse_scale = 0;

  Softness(double frequency, double zeta, double h) {
    const double omega = 2 * std::numbers::pi * frequency, a = 2 * zeta + h * omega;
    impulse_scale = 1 / (1 + h * omega * a);
    mass_scale = h * omega * a * impulse_scale;
    bias_rate = mass_scale * omega / a;
  }
};

/// The steps (1)-(6) of one run.
class SoftStepRun {
 public:
  SoftStepRun(const Problem& problem, const Settings& settings, const SoftStepOptions& options)
      : problem_(problem),
        info_(problem.info()),
        options_(options),
        run_(problem, settings),
        contacts_(run_),
        h_(run_.h / options.substeps),
        contact_(std::min(options.frequency, kCap / h_), options.damping_ratio, h_),
        joint_(kJointFrequency * std::min(options.frequency, kCap / h_), kJointDampingRatio, h_) {
    run_.solution.residuals.clear();  // a sweep fulfils no law
    for (auto* x : {&gap_, &lambda_n_, &approach_, &total_}) x->setZero(info_.n_c());
    lambda_t_.setZero(info_.n_lambda_t);
    change_ = contacts_.free_change(run_.q, run_.v, h_);
  }

  Solution take_steps() {
    return run_.take_steps([&](Vector& v) {
      v = run_.v;
      begin_step(v);
      for (int s = 0; s < options_.substeps; ++s) {
        if (!contacts_.set_position(run_.q)) return false;
        change_ = contacts_.free_change(run_.q, v, h_);
        v += change_;
        warm_start(v);
        sweep(v, true);
        run_.q += h_ * v;
        sweep(v, false);
        run_.Lambda_n += lambda_n_;
        run_.Lambda_t += lambda_t_;
      }
      restore(v);
      return v.allFinite() || run_.fail("the velocity is not finite");
    });
  }

 private:
  void begin_step(const Vector& v) {
    if (info_.n_c() == 0) return;
    change_ *= options_.substeps;  // of the substep before
    contacts_.choose(run_.q, v, change_, run_.h);
    total_.setZero();
    for (int i = 0; i < info_.n_c(); ++i) {
      if (contacts_.is_chosen(i)) {
        approach_[i] = contacts_.normal_velocity(i, v);
      } else {
        lambda_n_[i] = 0;
        lambda_t_.segment(info_.contacts[i].tangent_index, info_.contacts[i].n_t).setZero();
      }
    }
  }

  /// (1)
  void warm_start(Vector& v) {
    for (const int i : contacts_.list()) {
      if (lambda_n_[i] == 0) continue;
      contacts_.push(i, lambda_n_[i], v);
      if (contacts_.n_t(i) > 0) contacts_.push_tangent(i, friction(i), v);
    }
  }

  void sweep(Vector& v, bool has_springs) {
    if (contacts_.list().empty()) return;
    problem_.gap(run_.q.data(), gap_.data());
    ++run_.solution.counters.inner_iterations;
    for (const int i : contacts_.list()) {
      const bool is_bilateral = info_.contacts[i].is_bilateral;
      double b = 0, mass_scale = 1, impulse_scale = 0;
      if (gap_[i] > 0 && !is_bilateral) {
        b = gap_[i] / h_;
      } else if (has_springs) {
        const Softness& soft = is_bilateral ? joint_ : contact_;
        b = soft.bias_rate * gap_[i];
        if (options_.push_out > 0 && !is_bilateral) b = std::max(b, -soft.mass_scale * options_.push_out);
        mass_scale = soft.mass_scale;
        impulse_scale = soft.impulse_scale;
      }
      const double speed = contacts_.normal_velocity(i, v);
      set_normal(i, lambda_n_[i] - contacts_.mass(i) * (mass_scale * speed + b) - impulse_scale * lambda_n_[i], v);
      if (contacts_.n_t(i) > 0) rub(i, v);
    }
  }

  /// The end of (3), (6).
  void set_normal(int i, double impulse, Vector& v) {
    if (!info_.contacts[i].is_bilateral) impulse = std::max(0.0, impulse);
    contacts_.push(i, impulse - lambda_n_[i], v);
    lambda_n_[i] = impulse;
    total_[i] += impulse;
  }

  /// (4)
  void rub(int i, Vector& v) {
    const auto before = friction(i), change = contacts_.slip_impulse(i, contacts_.slip(i, v));
    const auto after = in_disc({before[0] - change[0], before[1] - change[1]}, info_.contacts[i].mu * lambda_n_[i]);
    contacts_.push_tangent(i, {after[0] - before[0], after[1] - before[1]}, v);
    for (int d = 0; d < contacts_.n_t(i); ++d) lambda_t_[info_.contacts[i].tangent_index + d] = after[d];
  }

  /// (6)
  void restore(Vector& v) {
    for (const int i : contacts_.list()) {
      const double eps_r = info_.contacts[i].restitution(approach_[i]);
      if (eps_r == 0 || approach_[i] > -options_.threshold || total_[i] == 0) continue;
      const double before = lambda_n_[i];
      set_normal(i, before - contacts_.mass(i) * (contacts_.normal_velocity(i, v) + eps_r * approach_[i]), v);
      run_.Lambda_n[i] = std::max(0.0, run_.Lambda_n[i] + lambda_n_[i] - before);
    }
  }

  std::array<double, 2> friction(int i) const {
    const int at = info_.contacts[i].tangent_index;
    return {lambda_t_[at], contacts_.n_t(i) == 2 ? lambda_t_[at + 1] : 0};
  }

  const Problem& problem_;
  const ProblemInfo& info_;
  const SoftStepOptions options_;
  FixedStepRun run_;
  SequentialContacts contacts_;
  const double h_;  // of a substep
  const Softness contact_, joint_;
  Vector gap_, lambda_n_, lambda_t_, approach_, total_;  // lambda: of a substep
  Vector change_;                                        // h M^-1 f
};

class SoftStep final : public Method {
 public:
  explicit SoftStep(const MethodSpec& spec)
      : id_(spec.text()),
        options_{.substeps = spec.whole_number("substeps", 4, 1, 10000),
                 .frequency = spec.number("frequency", 30, 1e-9, 1e300),
                 .damping_ratio = spec.number("damping_ratio", 10, 1e-9, 1e300),
                 .threshold = spec.number("threshold", 0, 0, 1e300),
                 .push_out = spec.number("push_out", 0, 0, 1e300)} {}

  MethodInfo info() const override {
    return {.id = id_,
            .title = fmt::format("soft step, {} substeps, {:g} Hz", options_.substeps, options_.frequency),
            .source = "Catto, Box2D v3, contact_solver.c; Soft Constraints, GDC 2011",
            .order_smooth = 1,
            .order_impacts = 1,
            .is_adaptive = false,
            .has_restitution_of_speed = true,
            .is_allocation_free = true};
  }

  Support supports(const ProblemInfo& problem) const override {
    if (has_levers(problem))
      return Support::no("friction in its impacts is not bounded by their impulse, and no friction element can be");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return SoftStepRun(problem, settings, options_).take_steps();
  }

 private:
  const std::string id_;
  const SoftStepOptions options_;
};

const bool registered = register_method<SoftStep>({
    .name = "soft_step",
    .usage = "soft_step[,substeps=4][,frequency=30][,damping_ratio=10][,threshold=0][,push_out=0]",
    .summary = "soft step of Box2D v3: contacts as springs in substeps, sweeps without springs, restitution at the end",
    .examples = {"soft_step", "soft_step,frequency=1e9"},
});

}  // namespace
}  // namespace ricochet
