#include "methods/control/shooting/guards.h"

#include <fmt/format.h>

#include <cmath>

namespace ricochet {
namespace {

/// A slope below this part of the size that its terms have is rounding.
constexpr double kNoSlope = 1e-11;

class GuardCollector {
 public:
  GuardCollector(const Problem& plant, const PointVariation& point, const PlantMotion& motion, int k,
                 const LinearisedInterval& interval, std::vector<Guard>& guards)
      : plant_(plant),
        info_(plant.info()),
        point_(point),
        step_(motion.steps[static_cast<std::size_t>(k)]),
        k_(k),
        interval_(interval),
        n_theta_(interval.x.cols()),
        guards_(guards) {}

  void collect() {
    for (int n = 0; n < step_.n_elements; ++n) {
      const Element& e = step_.elements[n];
      const auto& derivatives = interval_.elements[static_cast<std::size_t>(n)];
      add(Guard::Kind::length, n, 0, -1, e.h, derivatives.h.transpose(), 1);
      if (step_.touches) add_approaches(n, derivatives);
      for (Eigen::Index j = 0; j < e.q.cols(); ++j) add_stage(n, static_cast<int>(j), e, derivatives);
    }
  }

 private:
  void add(Guard::Kind kind, int n, int j, int contact, double value, const Eigen::RowVectorXd& slope, double size) {
    if (!slope.allFinite() || slope.lpNorm<Eigen::Infinity>() <= kNoSlope * size) return;
    guards_.push_back({kind, k_, n, j, contact, value, slope});
  }

  void add_approaches(int n, const Sensitivity::ElementDerivatives& derivatives) {
    if (step_.Lambda_n.col(n).isZero(0)) return;
    const Element& e = step_.elements[n];
    const Matrix J_n = plant_.normal_jacobian(e.q0);
    Matrix H(info_.n_q, info_.n_q);
    for (const int i : info_.unilateral) {
      const Vector v_minus = step_.v_minus.col(n);
      const double rate = J_n.col(i).dot(v_minus);
      if (!(step_.Lambda_n(i, n) > 0) || rate >= 0) continue;  // pushed by the impact of another contact
      const Vector weight = Vector::Unit(info_.n_c(), i);
      plant_.gap_hessian(e.q0.data(), weight.data(), H.data());
      const Eigen::RowVectorXd slope = -(v_minus.transpose() * H * derivatives.start_q.leftCols(n_theta_) +
                                         J_n.col(i).transpose() * derivatives.v_minus.leftCols(n_theta_));
      add(Guard::Kind::approach, n, 0, i, -rate, slope, derivatives.v_minus.lpNorm<Eigen::Infinity>());
    }
  }

  /// Whether this guard defines the switch at the end of the element, where its last stage is.
  bool is_switch(int n, Eigen::Index j, SwitchKind kind, int contact) const {
    return j == step_.elements[n].q.cols() - 1 && step_.ends[n].is(kind, contact);
  }

  void add_stage(int n, int j, const Element& e, const Sensitivity::ElementDerivatives& derivatives) {
    const Eigen::Index n_q = info_.n_q, n_forces = info_.n_c() + info_.n_lambda_t;
    const Vector q = e.q.col(j), v = e.v.col(j);
    const Matrix dq = derivatives.q.middleRows(j * n_q, n_q).leftCols(n_theta_),
                 dv = derivatives.v.middleRows(j * n_q, n_q).leftCols(n_theta_),
                 forces = derivatives.forces.middleRows(j * n_forces, n_forces);
    const Vector gap = plant_.gap(q);
    const Matrix J_n = plant_.normal_jacobian(q), J_t = plant_.tangent_jacobian(q);
    Matrix T(info_.n_lambda_t, n_q);
    if (info_.n_lambda_t > 0) plant_.slip_velocity_derivative(q.data(), v.data(), T.data());
    const double dv_size = dv.lpNorm<Eigen::Infinity>(), dq_size = dq.lpNorm<Eigen::Infinity>() + e.h * dv_size,
                 force_size = forces.lpNorm<Eigen::Infinity>();
    for (const int i : info_.unilateral) {
      const ContactInfo& contact = info_.contacts[i];
      const ContactMode mode = e.modes[i];
      if (!is_closed(mode)) {
        if (is_switch(n, j, SwitchKind::gap_closes, i)) continue;
        add(Guard::Kind::gap, n, j, i, gap[i], J_n.col(i).transpose() * dq, dq_size);
        continue;
      }
      if (!is_switch(n, j, SwitchKind::force_vanishes, i))
        add(Guard::Kind::normal_force, n, j, i, e.lambda_n(i, j), forces.row(i).leftCols(n_theta_), force_size);
      if (contact.n_t == 0) continue;
      const auto t = contact.tangent_index;
      if (is_switch(n, j, mode == ContactMode::stick ? SwitchKind::cone_reached : SwitchKind::slip_stops, i)) continue;
      if (mode == ContactMode::stick) {
        const Vector lambda_t = e.lambda_t.col(j).segment(t, contact.n_t);
        Eigen::RowVectorXd margin(forces.cols());
        point_.cone_margin(i, e.lambda_n(i, j), lambda_t, forces, margin);
        add(Guard::Kind::cone, n, j, i, contact.mu * e.lambda_n(i, j) - lambda_t.norm(), margin.leftCols(n_theta_),
            force_size);
        continue;
      }
      const Vector s = J_t.middleCols(t, contact.n_t).transpose() * v;
      const double speed = s.norm();
      Vector direction = contact.n_t == 1 ? Vector::Constant(1, slip_sign(mode)) : Vector(s / speed);
      if (!direction.allFinite()) continue;  // slip in space at rest: its direction is that of the force
      const Matrix ds = T.middleRows(t, contact.n_t) * dq + J_t.middleCols(t, contact.n_t).transpose() * dv;
      add(Guard::Kind::slip, n, j, i, direction.dot(s), direction.transpose() * ds, dv_size);
    }
  }

  const Problem& plant_;
  const ProblemInfo& info_;
  const PointVariation& point_;
  const FesdStep& step_;
  const int k_;
  const LinearisedInterval& interval_;
  const Eigen::Index n_theta_;
  std::vector<Guard>& guards_;
};

}  // namespace

void add_guards(const Problem& plant, const PointVariation& point, const PlantMotion& motion, int k,
                const LinearisedInterval& interval, std::vector<Guard>& guards) {
  GuardCollector(plant, point, motion, k, interval, guards).collect();
}

std::string describe(const Guard& guard, const ProblemInfo& plant) {
  const auto of_contact = [&](const char* what) {
    return fmt::format("{} of '{}' in interval {}", what, plant.contacts[guard.contact].name, guard.interval + 1);
  };
  switch (guard.kind) {
    case Guard::Kind::gap:
      return of_contact("the gap");
    case Guard::Kind::normal_force:
      return of_contact("the normal force");
    case Guard::Kind::cone:
      return of_contact("the friction cone");
    case Guard::Kind::slip:
      return of_contact("the slip");
    case Guard::Kind::approach:
      return of_contact("the approach speed");
    case Guard::Kind::length:
      return fmt::format("the length of element {} in interval {}", guard.element + 1, guard.interval + 1);
  }
  return {};
}

}  // namespace ricochet
