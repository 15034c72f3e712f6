#include "methods/fesd/sign_conditions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

void report(Violation& first, const Violation& violation) {
  if (!first || violation.time < first.time) first = violation;
}

Violation past(SwitchKind kind, int contact, double time, double value, int facet_condition = -1) {
  return {Violation::Kind::past_switch, kind, contact, time, value, facet_condition};
}

Violation drift(int contact, double time, double value) {
  return {.kind = Violation::Kind::drift, .contact = contact, .time = time, .value = value};
}

/// The switch that a broken condition of friction_polygon.h announces.
SwitchKind facet_switch(ContactMode mode, bool is_of_force) {
  if (mode == ContactMode::stick) return SwitchKind::cone_reached;
  if (mode == ContactMode::vertex_slip) return SwitchKind::slip_turns;
  return is_of_force ? SwitchKind::edge_left : SwitchKind::slip_stops;
}

}  // namespace

SignConditions::SignConditions(const Problem& problem, const ButcherTableau& tableau, const FrictionPolygon& polygon,
                               ContactScales& scales, double gap_tolerance)
    : problem_(problem),
      tableau_(tableau),
      polygon_(polygon),
      scales_(scales),
      gap_tolerance_(gap_tolerance),
      n_s_(tableau.n_s),
      n_points_(tableau.is_stiffly_accurate() ? n_s_ : n_s_ + 1) {
  gap_.setZero(problem.n_c());
  left_gap_.setZero(problem.n_c());
  allowed_gap_.setZero(problem.n_c());
  J_t_.setZero(problem.info().n_tangent_entries, n_points_ + 1);
  J_n_.setZero(problem.info().n_normal_entries);
  const FullPivotingFactors A(tableau.A);
  if (A.is_invertible()) absorption_ = A.solve(Vector::Ones(n_s_)).cwiseAbs().maxCoeff();
  tangential_delassus_.setZero(problem.n_c());
  if (!problem.info().has_friction()) return;
  const Matrix J_t = problem.force_directions(problem.tangent_jacobian(problem.info().q0)).cwiseAbs();
  const Matrix G =
      J_t.transpose() * CholeskyFactors(problem.mass_matrix(problem.info().q0)).solve_columns(J_t).cwiseAbs();
  for (int i = 0; i < problem.n_c(); ++i) {
    const auto& contact = problem.info().contacts[i];
    for (int d = 0; d < contact.n_t; ++d)
      tangential_delassus_[i] =
          std::max(tangential_delassus_[i], G(contact.tangent_index + d, contact.tangent_index + d));
  }
}

/// The common case: every contact is open and no gap is negative.
bool SignConditions::is_clear(const Element& stages) {
  if (problem_.info().has_bilateral() && n_points_ > n_s_) return false;  // it may drift
  for (const int i : problem_.info().unilateral) {
    if (is_closed(stages.modes[i])) return false;
  }
  const int n_q = problem_.n_q();
  for (int j = 0; j < n_points_; ++j) {
    problem_.gap(j < n_s_ ? stages.q.data() + j * n_q : stages.q1.data(), gap_.data());
    for (const int i : problem_.info().unilateral) {
      if (!(gap_[i] >= 0)) return false;
    }
  }
  return true;
}

Violation SignConditions::check(const Element& stages, int just_broken, std::span<const int> unloaded,
                                std::span<const char> sinks) {
  Violation first;
  if (is_clear(stages)) return first;
  check_gaps(stages, just_broken, unloaded, sinks, first);
  check_forces(stages, first);
  if (problem_.info().has_friction()) check_slip(stages, first);
  return first;
}

/// Rounding error of a gap that starts at zero: that of the displacements by velocity, acceleration and force along the
/// normal, which cancel.
double SignConditions::gap_rounding(const Element& stages, int i) {
  problem_.normal_jacobian(stages.q0.data(), J_n_.data());
  const auto& contact = problem_.info().contacts[i];
  const double* J = J_n_.data() + contact.normal_begin;
  double way = 0;
  for (const int k : contact.support)
    way += std::abs(*J++) * stages.h * (std::abs(stages.v0[k]) + stages.h * stages.a.row(k).cwiseAbs().maxCoeff());
  if (is_closed(stages.modes[i]) && !contact.is_bilateral)
    way += stages.h * stages.h * stages.lambda_n.row(i).cwiseAbs().maxCoeff() * scales_.normal_delassus(i);
  return ContactScales::kGapRounding * way;
}

void SignConditions::check_gaps(const Element& stages, int just_broken, std::span<const int> unloaded,
                                std::span<const char> sinks, Violation& first) {
  problem_.gap(stages.q0.data(), left_gap_.data());
  for (int i = 0; i < problem_.n_c(); ++i) {
    // A contact that opens starts from the rounding it gathered while it was closed.
    const double start = std::clamp(-left_gap_[i], scales_.touching(i), scales_.nearly_touching(i));
    allowed_gap_[i] = -start - (i == just_broken ? gap_tolerance_ : 0);
  }
  if (!unloaded.empty()) problem_.normal_jacobian(stages.q0.data(), J_n_.data());
  for (const int i : unloaded)
    allowed_gap_[i] -= ContactScales::of_positions(problem_.info().contacts[i], J_n_.data(), stages.q0);
  for (std::size_t i = 0; i < sinks.size(); ++i) {
    if (sinks[i] != 0) allowed_gap_[static_cast<Eigen::Index>(i)] = -std::numeric_limits<double>::infinity();
  }
  double left_time = 0;
  for (int j = 0; j < n_points_; ++j) {
    const bool is_stage = j < n_s_;
    const double time = is_stage ? tableau_.c[j] * stages.h : stages.h;
    problem_.gap(is_stage ? stages.q.col(j).data() : stages.q1.data(), gap_.data());
    for (int i = 0; i < problem_.n_c(); ++i) {
      if (!has(inequalities(stages, i), Inequality::gap)) {
        if (!is_stage && std::abs(gap_[i]) > scales_.nearly_touching(i) && std::abs(gap_[i]) > gap_rounding(stages, i))
          report(first, drift(i, time, gap_[i]));
      } else if (gap_[i] < allowed_gap_[i] && gap_[i] < -gap_rounding(stages, i)) {
        const double left = std::max(left_gap_[i], 0.0), right = gap_[i];
        report(first, past(SwitchKind::gap_closes, i, left_time + (time - left_time) * left / (left - right), gap_[i]));
      }
    }
    std::swap(gap_, left_gap_);
    left_time = time;
  }
}

/// Impulse by which closed contacts remove the rounding of their velocities at the left end, whatever the length of the
/// element: (A^-1 1)_j v_n / (h G_nn) at stage j. It acts on their neighbours, too. After the element the rounding is gone.
double SignConditions::left_impulse(const Element& stages) {
  problem_.normal_jacobian(stages.q0.data(), J_n_.data());
  if (problem_.info().has_friction()) problem_.tangent_jacobian(stages.q0.data(), J_t_.col(0).data());
  double impulse = 0;
  for (const int i : problem_.info().unilateral) {
    if (!is_closed(stages.modes[i])) continue;
    const auto& contact = problem_.info().contacts[i];
    const auto entries = static_cast<Eigen::Index>(contact.support.size());
    const double v_n = std::abs(packed_dot(contact, J_n_.data() + contact.normal_begin, stages.v0));
    impulse += std::min(v_n, scales_.no_drift(i)) / scales_.normal_delassus(i);
    if (stages.modes[i] != ContactMode::stick) continue;
    double v_t = 0;
    for (int d = 0; d < contact.n_t; ++d)
      v_t = std::hypot(v_t, packed_dot(contact, J_t_.col(0).data() + contact.tangent_begin + d * entries, stages.v0));
    impulse += std::min(v_t, scales_.no_slip(i)) / scales_.tangential_delassus(i);
  }
  return absorption_ * impulse;
}

/// lambda_n >= 0 of unilateral contacts, and the cone margin mu lambda_n - ||lambda_t|| of sticking contacts
void SignConditions::check_forces(const Element& stages, Violation& first) {
  const int n_points = tableau_.right_end.size() > 0 ? n_s_ + 1 : n_s_;
  for (const int i : problem_.info().unilateral) {
    const auto list = inequalities(stages, i);
    if (!has(list, Inequality::force)) continue;
    const auto& contact = problem_.info().contacts[i];
    scales_.record_force(i, stages.lambda_n.row(i).maxCoeff());
    const double rounding = scales_.no_force(i);
    const bool has_cone = has(list, Inequality::cone);
    double force_before = 0, margin_before = 0, time_before = 0;
    bool pulls = false, leaves = false;
    for (int j = 0; j < n_points; ++j) {
      if (is_end_stage(j) && stages.is_projected) continue;  // the right end: (11) of end_projection.h is more accurate
      const double time = j < n_s_ ? tableau_.c[j] * stages.h : stages.h;
      const double lambda = j < n_s_ ? stages.lambda_n(i, j) : stages.end_lambda_n[i];
      const auto crossing = [&](double before, double value) {
        return time_before + (time - time_before) * (j > 0 && before > 0 ? before / (before - value) : 0.5);
      };
      if (!pulls && lambda < -rounding && lambda < -rounding - left_impulse(stages) / stages.h) {
        report(first, past(SwitchKind::force_vanishes, i, crossing(force_before, lambda), lambda));
        pulls = true;
      }
      if (has_cone && !leaves) {
        const double lambda_t = j < n_s_ ? stages.lambda_t.col(j).segment(contact.tangent_index, contact.n_t).norm()
                                         : stages.end_lambda_t.segment(contact.tangent_index, contact.n_t).norm();
        const double margin = contact.mu * lambda - lambda_t;
        if (margin < -contact.mu * rounding &&
            margin < -contact.mu * rounding - (1 + contact.mu) * left_impulse(stages) / stages.h) {
          report(first, past(SwitchKind::cone_reached, i, crossing(margin_before, margin), margin));
          leaves = true;
        }
        margin_before = margin;
      }
      force_before = lambda;
      time_before = time;
    }
    if (has(list, Inequality::facet)) check_facet_forces(stages, i, first);
  }
}

/// Conditions (2) of friction_polygon.h on the force
void SignConditions::check_facet_forces(const Element& stages, int i, Violation& first) {
  const ContactMode mode = stages.modes[i];
  const auto& contact = problem_.info().contacts[i];
  const int n_points = tableau_.right_end.size() > 0 ? n_s_ + 1 : n_s_;
  for (int c = 0; c < polygon_.n_conditions(mode); ++c) {
    const FacetCondition condition = polygon_.condition(mode, stages.facets[i], c);
    if (!condition.is_of_force) continue;
    double before = 0, time_before = 0;
    for (int j = 0; j < n_points; ++j) {
      if (is_end_stage(j) && stages.is_projected) continue;  // as in check_forces()
      const double time = j < n_s_ ? tableau_.c[j] * stages.h : stages.h;
      const double lambda_n = j < n_s_ ? stages.lambda_n(i, j) : stages.end_lambda_n[i];
      const double* lambda_t =
          (j < n_s_ ? stages.lambda_t.col(j).data() : stages.end_lambda_t.data()) + contact.tangent_index;
      const double margin = condition.cone * contact.mu * lambda_n - condition.direction[0] * lambda_t[0] -
                            condition.direction[1] * lambda_t[1];
      if (margin < -contact.mu * scales_.no_force(i)) {
        const double part = j > 0 && before > 0 ? before / (before - margin) : 0.5;
        report(first, past(facet_switch(mode, true), i, time_before + (time - time_before) * part, margin, c));
        break;
      }
      before = margin;
      time_before = time;
    }
  }
}

/// Rounding of the slip velocities in an element: of the changes by its load and friction, and of the largest slip so far.
double SignConditions::slip_rounding(const Element& stages, int i) const {
  const auto& contact = problem_.info().contacts[i];
  double size = 0;
  for (int j = 0; j <= n_points_; ++j) {
    const double* J_t = J_t_.col(j).data() + contact.tangent_begin;
    for (int d = 0; d < contact.n_t; ++d) {
      double terms = 0;
      for (const int row : contact.support)
        terms += std::abs(*J_t++) * (std::abs(stages.v0[row]) + stages.h * stages.a.row(row).cwiseAbs().maxCoeff());
      size = std::max(size, terms);
    }
  }
  size += stages.h * tangential_delassus_[i] * contact.mu * scales_.force(i);
  return std::max(ContactScales::kStageRounding * size, ContactScales::kVelocityRounding * scales_.slip(i));
}

void SignConditions::check_slip(const Element& stages, Violation& first) {
  // Without a stage at the right end, a sticking contact on a curve may creep there.
  const auto is_checked = [&](ContactMode mode) {
    return is_slipping(mode) || (mode == ContactMode::stick && n_points_ > n_s_);
  };
  if (std::none_of(stages.modes.begin(), stages.modes.end(), is_checked)) return;
  for (int j = -1; j < n_points_; ++j) {  // -1: the left end
    const auto q = j < 0 ? stages.q0.data() : j < n_s_ ? stages.q.col(j).data() : stages.q1.data();
    problem_.tangent_jacobian(q, J_t_.col(j + 1).data());
  }
  for (int i = 0; i < problem_.n_c(); ++i) {
    const ContactMode mode = stages.modes[i];
    if (!is_checked(mode)) continue;
    const auto& contact = problem_.info().contacts[i];
    const double rounding = slip_rounding(stages, i);
    double before[2]{0, 0}, time_before = 0;
    for (int j = -1; j < n_points_; ++j) {
      const bool is_stage = j < n_s_;
      const bool is_right_end = j + 1 == n_points_;
      const auto v = j < 0 ? stages.v0.data() : is_right_end ? stages.v1.data() : stages.v.col(j).data();
      const double time = j < 0 ? 0 : is_stage ? tableau_.c[j] * stages.h : stages.h;
      const double* J_t = J_t_.col(j + 1).data() + contact.tangent_begin;
      double slip[2]{0, 0};
      for (int d = 0; d < contact.n_t; ++d) {
        for (const int row : contact.support) slip[d] += *J_t++ * v[row];
      }
      // Slip that begins has the rounding of its velocity at the left end, which points anywhere.
      if (j < 0 && contact.n_t == 2 && std::hypot(slip[0], slip[1]) <= scales_.no_slip(i)) slip[0] = slip[1] = 0;
      if (mode == ContactMode::vertex_slip || mode == ContactMode::edge_slip) {
        check_facet_velocity(stages, i, {j, time_before, time, before, slip, rounding}, first);
      } else if (mode == ContactMode::stick) {
        const double speed = std::hypot(slip[0], slip[1]);
        if (j == n_s_ && speed > rounding) report(first, drift(i, time, speed));
      } else if (j >= 0) {
        // In the plane the slip velocity itself; in space its component along the direction before.
        const double speed_before = contact.n_t == 1 ? slip_sign(mode) * before[0] : std::hypot(before[0], before[1]);
        const double speed = contact.n_t == 1
                                 ? slip_sign(mode) * slip[0]
                                 : (speed_before > 0 ? (slip[0] * before[0] + slip[1] * before[1]) / speed_before : 0);
        if (speed < -rounding) {
          const double part = speed_before > 0 ? speed_before / (speed_before - speed) : 0;
          report(first, past(SwitchKind::slip_stops, i, time_before + (time - time_before) * part, speed));
          break;
        }
      }
      std::copy_n(slip, 2, before);
      time_before = time;
    }
  }
}

/// Conditions (2) of friction_polygon.h on the slip velocity, between a point and the one before; and on an edge held'
/// v_t = 0 at a right end that is no stage
void SignConditions::check_facet_velocity(const Element& stages, int i, const SlipChange& change, Violation& first) {
  const ContactMode mode = stages.modes[i];
  const auto along = [](const auto& direction, const double* slip) {
    return direction[0] * slip[0] + direction[1] * slip[1];
  };
  if (mode == ContactMode::edge_slip && change.point == n_s_) {
    const double creep = along(polygon_.edge(stages.facets[i]), change.slip);
    if (std::abs(creep) > change.rounding) report(first, drift(i, change.time, creep));
  }
  for (int c = 0; c < polygon_.n_conditions(mode) && change.point >= 0; ++c) {
    const FacetCondition condition = polygon_.condition(mode, stages.facets[i], c);
    if (condition.is_of_force) continue;
    const double speed = along(condition.direction, change.slip);
    if (speed >= -change.rounding) continue;
    const double before = std::max(0.0, along(condition.direction, change.slip_before));
    const double time = change.time_before + (change.time - change.time_before) * before / (before - speed);
    report(first, past(facet_switch(mode, false), i, time, speed, c));
  }
}

}  // namespace ricochet
