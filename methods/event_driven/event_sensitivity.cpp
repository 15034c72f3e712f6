#include "methods/event_driven/event_sensitivity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"

namespace ricochet {
namespace {

// A gap has to reach this many of its roundings below zero: what moves with the time of a lower one is rounding.
constexpr double kGrazing = 1e4;
// How far contacts that close together may part, relative to the terms that cancel; the tolerance, if that is larger,
// times the errors of a few dozen steps.
constexpr double kTogether = 1e-6, kErrors = 100;

}  // namespace

EventSensitivity::EventSensitivity(const Problem& problem, const EmbeddedTableau& pair, const ContactScales& scales,
                                   ModeDynamics& dynamics, const Settings& settings)
    : problem_(problem),
      info_(problem.info()),
      pair_(pair),
      scales_(scales),
      dynamics_(dynamics),
      tolerance_(settings.tolerance),
      varied_(problem, settings.sensitivities),
      point_(varied_),
      S_{varied_.dq0(), varied_.dv0()},
      next_(S_),
      stage_v_(static_cast<std::size_t>(pair.n_s), S_.q),
      stage_a_(stage_v_),
      v_(info_.n_q, pair.n_s),
      a_(v_),
      q1_(info_.q0),
      v1_(info_.v0),
      lambda_n_(Vector::Zero(info_.n_c())),
      lambda_t_(Vector::Zero(info_.n_lambda_t)),
      dt_(Vector::Zero(varied_.n_theta())),
      turns_(Matrix::Zero(info_.n_c(), varied_.n_theta())),
      h_(info_.end_time) {}

/// The forces that the dynamics has.
void EventSensitivity::set_forces() {
  lambda_n_.setZero();
  lambda_t_.setZero();
  for (const int i : dynamics_.closed()) {
    lambda_n_[i] = dynamics_.normal_force(i);
    if (info_.contacts[i].n_t > 0) dynamics_.tangential_force(i, lambda_t_.data() + info_.contacts[i].tangent_index);
  }
}

/// The derivatives of a, n_q rows, and of the forces below. The dynamics has the forces of the point.
Matrix EventSensitivity::accelerations(const Vector& q, const Vector& v, const Vector& a, const Variation& S) {
  set_forces();
  const auto closed = PointVariation::Numbering(info_, dynamics_.modes());
  std::vector<PointVariation::Friction> laws;
  for (const auto& [i, row] : closed.contacts) {
    laws.emplace_back();
    const int n_t = info_.contacts[i].n_t;
    const ContactMode mode = dynamics_.modes()[i];
    if (n_t == 0) continue;
    if (mode == ContactMode::stick) {
      laws.back().sticks = true;
    } else if (dynamics_.holds_direction(i)) {
      Vector d(n_t);
      dynamics_.direction(i, d.data());
      laws.back() = {
          .direction = d, .turn = PointVariation::TangentMatrix::Zero(n_t, n_t), .turned = Matrix(n_t, turns_.cols())};
      laws.back().turned << -d[1] * turns_.row(i), d[0] * turns_.row(i);
    } else {
      laws.back() = point_.slip(i, point_.slip_velocity(i, q, v), lambda_n_[i], slip_sign(mode), Vector::Zero(n_t));
    }
  }
  const PointOfMotion at{q, v, a, lambda_n_, lambda_t_};
  Matrix direct(varied_.n_rows(), S.q.cols()), change(closed.size, S.q.cols());
  varied_.rows(at, point_.pool(), direct);
  point_.accelerations(closed, at, direct, laws, h_, S.q, S.v, change);
  return change;
}

/// (2)
bool EventSensitivity::integrate(const StepEnds& ends, double h, const Variation& from) {
  h_ = h;
  const auto combine = [&](const auto& weights, Eigen::Index n) {
    q1_ = ends.q0;
    v1_ = ends.v0;
    next_ = from;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (weights[j] == 0) continue;
      const auto k = static_cast<std::size_t>(j);
      q1_ += h * weights[j] * v_.col(j);
      v1_ += h * weights[j] * a_.col(j);
      next_.q += h * weights[j] * stage_v_[k];
      next_.v += h * weights[j] * stage_a_[k];
    }
  };
  Vector a(info_.n_q);
  for (Eigen::Index i = 0; i < pair_.n_s; ++i) {
    combine(pair_.A.row(i), i);
    if (!dynamics_.accelerate(q1_.data(), v1_.data(), a.data())) return false;
    v_.col(i) = v1_;
    a_.col(i) = a;
    const auto k = static_cast<std::size_t>(i);
    stage_v_[k] = next_.v;
    stage_a_[k] = accelerations(q1_, v1_, a, next_).topRows(info_.n_q);
  }
  combine(pair_.b, pair_.n_s);
  return true;
}

/// Root mean square of a column, as of the motion.
double EventSensitivity::error(double h) const {
  const auto squares = [&](const Vector& weights, Eigen::Index column) {
    double total = 0;
    for (Eigen::Index k = 0; k < info_.n_q; ++k) {
      double e_q = 0, e_v = 0;
      for (std::size_t j = 0; j < stage_v_.size(); ++j) {
        e_q += weights[static_cast<Eigen::Index>(j)] * stage_v_[j](k, column);
        e_v += weights[static_cast<Eigen::Index>(j)] * stage_a_[j](k, column);
      }
      e_q /= 1 + std::abs(S_.q(k, column));
      e_v /= 1 + std::abs(S_.v(k, column));
      total += e_q * e_q + e_v * e_v;
    }
    return total;
  };
  double worst = 0;
  for (Eigen::Index column = 0; column < S_.q.cols(); ++column) {
    const double first = squares(pair_.e, column);
    worst = std::max(worst, pair_.e_2.size() > 0 ? combined_squares(first, squares(pair_.e_2, column)) : first);
  }
  return h / tolerance_ * std::sqrt(worst / (2 * info_.n_q));
}

double EventSensitivity::take(const StepEnds& ends, double h) {
  return integrate(ends, h, S_) ? error(h) : std::numeric_limits<double>::infinity();
}

void EventSensitivity::accept() {
  std::swap(S_, next_);
}

bool EventSensitivity::take_slip_start(const StepEnds& ends, double h, const std::vector<int>& contacts) {
  const auto n = static_cast<Eigen::Index>(contacts.size());
  const auto turn_at_middle = [&](Matrix& turn) {
    if (!integrate(ends, 0.5 * h, S_)) return false;
    turn.resize(n, varied_.n_theta());
    Matrix ds(info_.n_lambda_t, next_.q.cols());
    point_.slip_velocities(q1_, v1_, next_.q, next_.v, ds);
    for (Eigen::Index b = 0; b < n; ++b) {
      const int i = contacts[static_cast<std::size_t>(b)];
      const auto s = point_.slip_velocity(i, q1_, v1_);
      const Eigen::RowVector2d across(-s[1], s[0]);
      turn.row(b) = across * ds.middleRows(info_.contacts[i].tangent_index, 2) / s.squaredNorm();
    }
    return true;
  };
  // Turns of the slip velocities as functions of the turns of the held directions: constant, and by each of them.
  Matrix constant, with_turn, B(n, n);
  turns_.setZero();
  if (!turn_at_middle(constant)) return false;
  for (Eigen::Index b = 0; b < n; ++b) {
    turns_.setZero();
    turns_.row(contacts[static_cast<std::size_t>(b)]).setOnes();
    if (!turn_at_middle(with_turn)) return false;
    B.col(b) = (with_turn - constant).col(0);
  }
  const Matrix turns = solve_full_pivoting(Matrix::Identity(n, n) - B, constant);
  for (Eigen::Index b = 0; b < n; ++b) turns_.row(contacts[static_cast<std::size_t>(b)]) = turns.row(b);
  if (!integrate(ends, h, S_)) return false;
  accept();
  return true;
}

void EventSensitivity::move_at_constant_acceleration(const Vector& q, const Vector& v, const Vector& a, double dt) {
  const Matrix da = accelerations(q, v, a, S_).topRows(info_.n_q);
  S_.q += dt * S_.v + 0.5 * dt * dt * da;
  S_.v += dt * da;
}

std::optional<std::string> EventSensitivity::reach(const DetectedEvent& event, const Vector& q, const Vector& v,
                                                   const Vector& a) {
  dt_.setZero();
  size_q_ = S_.q.cwiseAbs();
  if (!event) return {};
  const Eigen::Index n = varied_.n_theta();
  const int i = event.contact;
  const auto& contact = info_.contacts[i];
  Variation S{Matrix(info_.n_q, n + 1), Matrix(info_.n_q, n + 1)};  // the last column is along the motion
  S.q << S_.q, v;
  S.v << S_.v, a;
  set_forces();
  Matrix slope;
  switch (event.kind) {
    case SwitchKind::gap_closes: {
      slope = gap_variation(i, q, S.q);
      const double rate = slope(0, n);
      const Vector J_n = problem_.normal_jacobian(q).col(i);
      const double acceleration = J_n.dot(a) + problem_.gap_acceleration_bias(q, v)[i];
      if (rate * rate <= 2 * acceleration * kGrazing * scales_.nearly_touching(i))
        return fmt::format("contact '{}' grazes, and the motion after it has no derivative", contact.name);
      break;
    }
    case SwitchKind::slip_stops:
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      slope.resize(info_.n_lambda_t, n + 1);
      point_.slip_velocities(q, v, S.q, S.v, slope);
      slope = slope.middleRows(contact.tangent_index, contact.n_t).eval();
      break;
    case SwitchKind::force_vanishes:
    case SwitchKind::cone_reached: {
      Matrix forces = Matrix::Zero(info_.n_c() + info_.n_lambda_t, n + 1);
      point_.add_forces(PointVariation::Numbering(info_, dynamics_.modes()), accelerations(q, v, a, S), 1, forces);
      Eigen::RowVectorXd margin = forces.row(i);
      if (event.kind == SwitchKind::cone_reached)
        point_.cone_margin(i, lambda_n_[i], lambda_t_.segment(contact.tangent_index, contact.n_t), forces, margin);
      slope = margin;
    }
  }
  const Vector along = slope.col(n);
  if (!(along.squaredNorm() > 0))
    return fmt::format("the time of an event at contact '{}' has no derivative", contact.name);
  dt_ = -slope.leftCols(n).transpose() * along / along.squaredNorm();  // (3)
  S_.q += v * dt_.transpose();
  S_.v += a * dt_.transpose();
  size_q_ += v.cwiseAbs() * dt_.cwiseAbs().transpose();
  return {};
}

/// d f_c of one contact.
Eigen::RowVectorXd EventSensitivity::gap_variation(int contact, const Vector& q, const Matrix& dq) const {
  Matrix change(info_.n_c(), dq.cols());
  point_.gaps(q, dq, change);
  return change.row(contact);
}

/// Why there is no derivative where a contact closes that, beside it, closes at a time of its own; or nothing.
std::optional<std::string> EventSensitivity::closes_apart(int contact, const Vector& q) const {
  const Eigen::RowVectorXd gap = gap_variation(contact, q, S_.q),
                           direct = gap_variation(contact, q, Matrix::Zero(info_.n_q, S_.q.cols())),
                           terms = problem_.normal_jacobian(q).col(contact).cwiseAbs().transpose() * size_q_ +
                                   direct.cwiseAbs();
  const double most = std::max(kTogether, kErrors * tolerance_);
  if ((gap.cwiseAbs().array() <= most * terms.array()).all()) return {};
  return fmt::format("contact '{}' touches at this instant, but beside it at another one: there is no derivative",
                     info_.contacts[contact].name);
}

std::optional<std::string> EventSensitivity::apply_impacts(const std::vector<ImpactSequence::Impact>& impacts,
                                                           const std::vector<ContactMode>& before, const Vector& q) {
  for (const auto& impact : impacts) {
    for (const int i : info_.unilateral) {
      if (!(impact.Lambda_n[i] > 0) || is_closed(before[i])) continue;
      if (&impact != &impacts.front()) return VariedProblem::kNoDerivative;
      if (auto reason = closes_apart(i, q)) return reason;
    }
    point_.through_impact({q, impact.v_minus, impact.v_plus, impact.Lambda_n, impact.Lambda_t}, S_.q, S_.v);
  }
  return {};
}

std::optional<std::string> EventSensitivity::leave(const std::vector<ContactMode>& before, const Vector& q,
                                                   const Vector& v, const Vector& a) {
  for (const int i : info_.unilateral) {
    if (is_closed(before[i]) || !is_closed(dynamics_.modes()[i])) continue;
    if (auto reason = closes_apart(i, q)) return reason;
  }
  S_.q -= v * dt_.transpose();  // (4)
  S_.v -= a * dt_.transpose();
  point_.project(dynamics_.modes(), q, v, S_.q, S_.v);
  return {};
}

void EventSensitivity::finish(const Vector& q, const Vector& v, const Vector& a, Solution& solution) {
  if (info_.has_bilateral()) point_.project(dynamics_.modes(), q, v, S_.q, S_.v);
  solution.dq = S_.q + v * varied_.dt_final().transpose();  // (6)
  solution.dv = S_.v + a * varied_.dt_final().transpose();
}

}  // namespace ricochet
