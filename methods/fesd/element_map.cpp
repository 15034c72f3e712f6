#include "methods/fesd/element_map.h"

#include "methods/fesd/inequality.h"

namespace ricochet {
namespace {

/// The element of length e.h that starts with x = (q_0, v_0).
void solve(ElementSystem& system, const ModeMap& map, const StageCoefficients& k, const Vector& x, Element& e) {
  const int n = system.problem.n_q();
  e.q0 = x.head(n);
  e.v0 = x.tail(n);
  system.work.kept_gap.setZero();
  for (const ActiveContact& active : system.active.closed()) {
    const int first = system.problem.info().contacts[active.contact].tangent_index;
    for (int held = 0; held < active.n_rows - 1; ++held)
      system.work.kept_slip[first + held] = map.R.col(active.row + 1 + held).dot(e.v0);
  }
  system.affine_stages.solve(map, system.equations, k, e, system.work);
  system.set_right_end(k, e);
}

}  // namespace

ElementMap::ElementMap(ElementSystem& system, double h)
    : h_(h), n_q_(system.problem.n_q()), n_s_(system.tableau.n_s), modes_(system.active.modes()) {
  list_conditions(system);
  if (!is_complete_) return;
  const ModeMap& whole = *system.affine();
  ModeMap linear = whole;
  for (Vector* constant : {&linear.A0, &linear.L0, &linear.q_r, &linear.v_r}) constant->setZero();
  StageCoefficients k;
  k.set(system.tableau, h);
  Element e;
  e.resize(system.problem.info(), n_s_);
  e.modes = modes_;
  e.h = h;
  const Eigen::Index n_x = 2 * n_q_, n_conditions = static_cast<Eigen::Index>(conditions_.size());
  J_n_ = system.problem.normal_jacobian(whole.q_r);
  J_t_ = system.problem.tangent_jacobian(whole.q_r);
  const Vector gap_at_reference = system.problem.gap(whole.q_r), none = Vector::Zero(gap_at_reference.size());
  // At rest: velocities that a closed contact would have to stop, and their changes, are terms that cancel.
  reference_.setZero(n_x);
  reference_.head(n_q_) = whole.q_r;
  change_.setZero(n_x);
  for (Eigen::Index c = 0; c < n_conditions; ++c) {
    if (conditions_[static_cast<std::size_t>(c)].point == n_s_) start_rows_.push_back(c);
  }
  map_.setZero(padded(n_x + n_conditions), n_x + 1);
  at_start_.setZero(static_cast<Eigen::Index>(start_rows_.size()), n_x + 1);
  result_.setZero(map_.rows());
  bounds_.setZero(map_.rows());
  for (Eigen::Index c = 0; c <= n_x; ++c) {
    const bool is_constant = c == n_x;
    const ModeMap& map = is_constant ? whole : linear;
    solve(system, map, k, is_constant ? reference_ : Vector(Vector::Unit(n_x, c)), e);
    const auto value_of = [&](Eigen::Index row) {
      const Condition& condition = conditions_[static_cast<std::size_t>(row)];
      return value(condition, system, map, e, (is_constant ? gap_at_reference : none)[condition.contact]);
    };
    map_.col(c).head(n_q_) = h * e.v0 + e.a * k.h2bA;
    map_.col(c).segment(n_q_, n_q_) = e.a * k.hb;
    for (Eigen::Index row = 0; row < n_conditions; ++row) map_(n_x + row, c) = value_of(row);
    e.q1 = e.q0;
    e.v1 = e.v0;
    for (std::size_t row = 0; row < start_rows_.size(); ++row)
      at_start_(static_cast<Eigen::Index>(row), c) = value_of(start_rows_[row]);
  }
  for (Eigen::Index row = n_x + n_conditions; row < map_.rows(); ++row) map_(row, n_x) = 1;  // holds always
}

void ElementMap::list_conditions(const ElementSystem& system) {
  using Of = Condition::Of;
  const ProblemInfo& info = system.problem.info();
  const int right_end = n_s_;
  is_complete_ = !info.has_bilateral();
  for (const int i : info.unilateral) {
    const ContactInfo& contact = info.contacts[i];
    const ContactMode mode = modes_[i];
    is_complete_ = is_complete_ && contact.is_affine && (contact.n_t < 2 || mode == ContactMode::open);
    for (int point = 0; point <= right_end; ++point) {
      for (const Inequality inequality : inequalities_of(mode, false)) {
        switch (inequality) {
          case Inequality::gap:
            conditions_.push_back({Of::gap, i, point});
            break;
          case Inequality::force:
            conditions_.push_back({Of::force, i, point});
            break;
          case Inequality::cone:
            for (const double sign : {1.0, -1.0}) conditions_.push_back({Of::cone, i, point, sign});
            break;
          case Inequality::slip:
            conditions_.push_back({Of::slip, i, point, static_cast<double>(slip_sign(mode))});
            break;
          case Inequality::facet:
            is_complete_ = false;
        }
      }
      for (const double sign : {1.0, -1.0}) {
        if (point != right_end || !is_closed(mode)) continue;
        conditions_.push_back({Of::normal_rest, i, point, sign});
        if (mode == ContactMode::stick) conditions_.push_back({Of::tangential_rest, i, point, sign});
      }
    }
  }
}

/// Left-hand side of a condition. @param gap  at q_r of the map
double ElementMap::value(const Condition& condition, const ElementSystem& system, const ModeMap& map, const Element& e,
                         double gap) const {
  using Of = Condition::Of;
  const auto [of, i, point, sign] = condition;
  const ContactInfo& contact = system.problem.info().contacts[i];
  const bool is_stage = point < n_s_;
  const Eigen::Map<const Vector> q(is_stage ? e.q.col(point).data() : e.q1.data(), n_q_),
      v(is_stage ? e.v.col(point).data() : e.v1.data(), n_q_);
  if (of == Of::gap) return gap + J_n_.col(i).dot(q - map.q_r);
  if (of == Of::normal_rest) return -sign * J_n_.col(i).dot(v);
  if (of == Of::tangential_rest) return -sign * J_t_.col(contact.tangent_index).dot(v);
  if (of == Of::slip) return sign * J_t_.col(contact.tangent_index).dot(v);
  double normal = 0, tangential = 0;
  if (!is_stage) {
    const ActiveContact& active = system.active.of(i);
    const auto force = [&](int row) {
      return map.L0[row] + map.Lq.row(row).dot(q - map.q_r) + map.Lv.row(row).dot(v - map.v_r);
    };
    normal = force(active.row);
    if (active.mode == ContactMode::stick) tangential = force(active.row + 1);
  } else {
    normal = e.lambda_n(i, point);
    if (contact.n_t > 0) tangential = e.lambda_t(contact.tangent_index, point);
  }
  return of == Of::force ? normal : contact.mu * normal - sign * tangential;
}

void ElementMap::set_bounds(const ContactScales& scales) {
  using Of = Condition::Of;
  for (std::size_t row = 0; row < conditions_.size(); ++row) {
    const auto [of, i, point, sign] = conditions_[row];
    const bool is_right_end = point == n_s_;
    double& bound = bounds_[2 * n_q_ + static_cast<Eigen::Index>(row)];
    if (of == Of::gap) bound = is_right_end ? scales.nearly_touching(i) : 0;
    if (of == Of::force || of == Of::cone) bound = scales.no_force(i);
    if (of == Of::slip) bound = is_right_end ? scales.no_slip(i) : 0;
    if (of == Of::normal_rest) bound = -scales.no_approach(i);
    if (of == Of::tangential_rest) bound = -scales.no_slip(i);
  }
}

bool ElementMap::starts_from(const Vector& x) const {
  const Eigen::Index n_x = 2 * n_q_;
  for (std::size_t row = 0; row < start_rows_.size(); ++row) {
    const auto r = static_cast<Eigen::Index>(row);
    if (!(at_start_.row(r).head(n_x).dot(x - reference_) + at_start_(r, n_x) > bounds_[n_x + start_rows_[row]]))
      return false;
  }
  return true;
}

bool ElementMap::advance(Vector& x) {
  using Block = Eigen::Matrix<double, 4, 1>;
  const Eigen::Index n_rows = map_.rows(), n_x = 2 * n_q_;
  const double *map = map_.data(), *bounds = bounds_.data(), *reference = reference_.data();
  double *result = result_.data(), *change = change_.data();
  for (Eigen::Index c = 0; c < n_x; ++c) change[c] = x[c] - reference[c];
  bool holds = true;
  for (Eigen::Index first = 0; first < n_rows; first += 4) {
    const double* column = map + first;
    Block sum = Eigen::Map<const Block>(column + n_x * n_rows);
    for (Eigen::Index c = 0; c < n_x; ++c, column += n_rows) sum += change[c] * Eigen::Map<const Block>(column);
    Eigen::Map<Block>(result + first) = sum;
  }
  for (Eigen::Index row = n_x; row < n_rows; ++row) holds = holds & (result[row] > bounds[row]);
  if (!holds) return false;
  for (Eigen::Index c = 0; c < n_x; ++c) x[c] += result[c];
  return true;
}

}  // namespace ricochet
