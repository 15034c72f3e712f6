#include "methods/time_freezing/instant_law.h"

#include <algorithm>
#include <cmath>

#include "problems/dense_solve.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

// Velocities behind an element carry the rounding of its stage equations.
constexpr double kLawRounding = 1e-12;
constexpr double kForceRounding = 1e-11;

}  // namespace

InstantLaw::InstantLaw(const Problem& problem, const AuxiliaryDynamics& auxiliary, const ContactScales& scales,
                       Counters& counters)
    : problem_(problem),
      info_(problem.info()),
      auxiliary_(auxiliary),
      scales_(scales),
      counters_(counters),
      first_column_(info_.contacts.size(), -1) {
  f_ = load_ = w_ = Vector::Zero(info_.n_q);
  gap_bias_ = lambda_n_ = Vector::Zero(info_.n_c());
  slip_bias_ = lambda_t_ = Vector::Zero(info_.n_lambda_t);
  packed_n_.resize(info_.n_normal_entries);
  packed_t_.resize(info_.n_tangent_entries);
  M_.resize(info_.n_q, info_.n_q);
  T_.resize(info_.n_lambda_t, info_.n_q);
}

bool InstantLaw::prepare(const Vector& q, const Vector& v, std::span<const int> contacts) {
  contacts_.assign(contacts.begin(), contacts.end());
  problem_.mass_matrix(q.data(), M_.data());
  problem_.force(q.data(), v.data(), info_.u.data(), f_.data());
  problem_.normal_jacobian(q.data(), packed_n_.data());
  problem_.gap_acceleration_bias(q.data(), v.data(), gap_bias_.data());
  if (info_.has_friction()) {
    problem_.tangent_jacobian(q.data(), packed_t_.data());
    problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
    slip_bias_.noalias() = T_.lazyProduct(v);
  }
  ++counters_.force_evaluations;
  ++counters_.mass_factorizations;
  int n = 0;
  for (const int i : contacts_) {
    first_column_[i] = n;
    n += 1 + n_t(i);
  }
  R_.setZero(info_.n_q, n);
  C_.setZero(info_.n_q, n);
  bias_.resize(n);
  const auto set_column = [](const ContactInfo& contact, const double* J, int k, Matrix& R, Matrix& C) {
    for (std::size_t e = 0; e < contact.support.size(); ++e) R(contact.support[e], k) = J[e];
    for (std::size_t e = 0; e < contact.pushed().size(); ++e) C(contact.support[e], k) = J[e];
  };
  for (const int i : contacts_) {
    const ContactInfo& contact = info_.contacts[i];
    set_column(contact, packed_n_.data() + contact.normal_begin, column(i), R_, C_);
    bias_[column(i)] = gap_bias_[i];
    for (int d = 0; d < contact.n_t; ++d) {
      const double* J = packed_t_.data() + contact.tangent_begin + d * static_cast<int>(contact.support.size());
      set_column(contact, J, column(i) + 1 + d, R_, C_);
      bias_[column(i) + 1 + d] = slip_bias_[contact.tangent_index + d];
    }
  }
  const CholeskyFactors mass(M_);
  load_ = mass.solve(f_);
  if (!load_.allFinite()) return false;
  X_ = mass.solve_columns(C_);
  if (info_.has_bilateral()) {  // these constraints answer every force
    const auto n_b = static_cast<Eigen::Index>(info_.bilateral.size());
    Matrix R_b = Matrix::Zero(info_.n_q, n_b), C_b = R_b;
    Vector bias_b(n_b);
    for (int k = 0; k < n_b; ++k) {
      const ContactInfo& contact = info_.contacts[info_.bilateral[k]];
      set_column(contact, packed_n_.data() + contact.normal_begin, k, R_b, C_b);
      bias_b[k] = gap_bias_[info_.bilateral[k]];
    }
    const Matrix X_b = mass.solve_columns(C_b);
    const Matrix G_b = R_b.transpose() * X_b;
    load_ -= X_b * Vector(solve_partial_pivoting(G_b, R_b.transpose() * load_ + bias_b));
    X_ -= X_b * solve_partial_pivoting(G_b, R_b.transpose() * X_);
    if (!load_.allFinite()) return false;
  }
  G_ = R_.transpose() * X_;
  return true;
}

double InstantLaw::normal_velocity(int contact, const Vector& v) const {
  return R_.col(column(contact)).dot(v);
}

void InstantLaw::slip_velocity(int contact, const Vector& v, double* v_t) const {
  for (int d = 0; d < n_t(contact); ++d) v_t[d] = R_.col(column(contact) + 1 + d).dot(v);
}

double InstantLaw::normal_terms(int contact, const Vector& x) const {
  return R_.col(column(contact)).cwiseAbs().dot(x.cwiseAbs());
}

double InstantLaw::tangent_terms(int contact, const Vector& x) const {
  double size = 0;
  for (int d = 0; d < n_t(contact); ++d)
    size = std::max(size, R_.col(column(contact) + 1 + d).cwiseAbs().dot(x.cwiseAbs()));
  return size;
}

double InstantLaw::normal_delassus(int contact) const {
  return G_(column(contact), column(contact));
}

double InstantLaw::tangential_delassus(int contact) const {
  double size = 0;
  for (int d = 1; d <= n_t(contact); ++d) size = std::max(size, G_(column(contact) + d, column(contact) + d));
  return size;
}

const double* InstantLaw::normal(int contact) const {
  return packed_n_.data() + info_.contacts[contact].normal_begin;
}

double InstantLaw::load_rate(int contact) const {
  return R_.col(column(contact)).dot(load_) + bias_[column(contact)];
}

/// What is known of the slip of a contact before its law is solved.
void InstantLaw::set_law(int contact, const Vector& v, RegionSwitch cause, const ContactRegion& before,
                         FrictionProblem::Contact& law) const {
  const ContactInfo& info = info_.contacts[contact];
  law = {.mu = info.mu, .n_t = info.n_t};
  if (info.n_t == 0) return;
  double v_t[2]{0, 0};
  if (cause.is(SwitchKind::cone_reached, contact)) {  // slip begins against the force
    for (int d = 0; d < info.n_t; ++d) v_t[d] = -lambda_t_[info.tangent_index + d];
  } else if (cause.is(SwitchKind::slip_stops, contact) && info.n_t == 1) {
    return;
  } else {
    slip_velocity(contact, v, v_t);
    const bool rests = cause.kind == SwitchKind::slip_stops && info.n_t == 2;
    const double least =
        std::max((before.sticks ? 10 : 1) * kLawRounding * scales_.slip(contact), rests ? resting_speed_ : 0);
    if (std::hypot(v_t[0], v_t[1]) <= least) return;
  }
  const double size = std::hypot(v_t[0], v_t[1]);
  if (!(size > 0)) return;
  law.slides = true;
  for (int d = 0; d < info.n_t; ++d) law.direction[d] = v_t[d] / size;
}

void InstantLaw::set_region(const FrictionProblem::Contact& law, const double* r, ContactRegion& region) const {
  region.sticks = law.mode == ContactMode::stick;
  region.turns = law.mode == ContactMode::slip;
  region.direction = {0, 0};
  if (!is_slipping(law.mode)) return;
  if (law.slides) {
    region.direction = {law.direction[0], law.n_t == 2 ? law.direction[1] : 0};
  } else if (law.n_t == 1) {
    region.direction = {static_cast<double>(slip_sign(law.mode)), 0};
  } else {
    const double size = std::hypot(r[1], r[2]);
    region.direction = {-r[1] / size, -r[2] / size};
  }
}

/// The laws of the chosen contacts, laws_ set: law_r_ is the solution.
LcpStatus InstantLaw::solve(std::span<const int> chosen, bool is_frozen, const Regions& regions) {
  int n = 0;
  std::vector<int> columns;
  for (const int i : chosen) {
    for (int d = 0; d <= n_t(i); ++d) columns.push_back(column(i) + d);
    n += 1 + n_t(i);
  }
  law_G_.resize(n, n);
  law_b_.resize(n);
  law_r_.setZero(n);
  double size = 0;
  const Vector rates = is_frozen ? Vector(Vector::Zero(G_.rows())) : Vector(R_.transpose() * load_ + bias_);
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b) law_G_(a, b) = G_(columns[a], columns[b]);
    law_b_[a] = rates[columns[a]];
    if (!is_frozen) size = std::max(size, R_.col(columns[a]).cwiseAbs().dot(load_.cwiseAbs()));
  }
  int row = 0;
  for (const int i : chosen) {
    if (is_frozen) size = std::max(size, auxiliary_.push[i] * G_(column(i), column(i)));
    if (is_frozen && regions.of[i].region != Region::sliding) {  // r_n = push: a row of its own
      law_G_.row(row).setZero();
      law_G_(row, row) = 1;
      law_b_[row] = -auxiliary_.push[i];
    }
    row += 1 + n_t(i);
  }
  ++counters_.complementarity_solves;
  const LcpStatus status = friction_.solve(law_G_, law_b_, kLawRounding * size, laws_, law_r_);
  counters_.pivots += friction_.pivots();
  return status;
}

/// A flight that is lower than rounding of the gap is none: r^2 <= 2 |a| (rounding), r the rate of the gap and a < 0 its
/// acceleration by the load.
bool InstantLaw::separates(int contact, const Vector& v) const {
  const double r = normal_velocity(contact, v), a = load_rate(contact);
  if (r <= kLawRounding * scales_.approach(contact)) return false;
  return !(a < 0 && r * r <= -2 * a * scales_.nearly_touching(contact));
}

LcpStatus InstantLaw::select_sliding(const Vector& v, RegionSwitch cause, Regions& regions) {
  chosen_.clear();
  laws_.clear();
  for (const int i : contacts_) {
    ContactRegion& region = regions.of[i];
    const ContactRegion before = region;
    region = {};
    if (cause.ends(Region::sliding, i) || separates(i, v)) continue;
    chosen_.push_back(i);
    set_law(i, v, cause, before, laws_.emplace_back());
  }
  regions.is_frozen = false;
  lambda_n_.setZero();
  lambda_t_.setZero();
  if (chosen_.empty()) return LcpStatus::solved;
  if (const LcpStatus status = solve(chosen_, false, regions); status != LcpStatus::solved) return status;
  const double* r = law_r_.data();
  for (std::size_t k = 0; k < chosen_.size(); ++k) {
    const int i = chosen_[k];
    // What shares a force that vanishes, vanishes with it.
    const bool vanishes = cause.ends(Region::sliding) && r[0] <= kForceRounding * scales_.force(i);
    if (is_closed(laws_[k].mode) && !vanishes) {
      regions.of[i].region = Region::sliding;
      set_region(laws_[k], r, regions.of[i]);
    }
    lambda_n_[i] = r[0];
    for (int d = 0; d < n_t(i); ++d) lambda_t_[info_.contacts[i].tangent_index + d] = r[1 + d];
    r += 1 + n_t(i);
  }
  return LcpStatus::solved;
}

LcpStatus InstantLaw::select_frozen(const Vector& v, const Vector& y, RegionSwitch cause, Regions& regions) {
  const bool pulls = std::ranges::any_of(contacts_, [&](int i) {
    return regions.of[i].region == Region::bouncing &&
           auxiliary_.k * y[i] + auxiliary_.damping[i] * normal_velocity(i, v) > 0;
  });
  const std::vector<ContactRegion> before = regions.of;
  regions.is_frozen = true;
  for (;;) {
    chosen_.clear();
    laws_.clear();
    for (const int i : contacts_) {
      ContactRegion& region = regions.of[i];
      if (region.region == Region::free || region.region == Region::sliding) {
        region = {};
        if (pulls || cause.ends(Region::sliding, i) || normal_velocity(i, v) > kLawRounding * scales_.approach(i))
          continue;
        region.region = Region::sliding;
      }
      chosen_.push_back(i);
      set_law(i, v, cause, before[i], laws_.emplace_back());
    }
    if (const LcpStatus status = solve(chosen_, true, regions); status != LcpStatus::solved) return status;
    bool is_full = false;
    const double* r = law_r_.data();
    lambda_n_.setZero();
    lambda_t_.setZero();
    for (std::size_t k = 0; k < chosen_.size(); ++k) {
      const int i = chosen_[k];
      ContactRegion& region = regions.of[i];
      if (region.region == Region::sliding) {
        if (r[0] > auxiliary_.push[i] * (1 + kLawRounding)) {  // beta > 1
          region.region = Region::pushed;
          is_full = true;
        } else if (!is_closed(laws_[k].mode)) {
          region = {};
        }
      }
      if (region.is_held()) set_region(laws_[k], r, region);
      lambda_n_[i] = r[0];
      for (int d = 0; d < n_t(i); ++d) lambda_t_[info_.contacts[i].tangent_index + d] = r[1 + d];
      r += 1 + n_t(i);
    }
    if (!is_full) return LcpStatus::solved;
  }
}

bool InstantLaw::forces(const Regions& regions, const Vector& v, const Vector& y) {
  // Unknown forces have a direction in X_ and an equation in R_; known ones, of pushed contacts, are part of the load.
  std::vector<int> rows;
  for (const int i : contacts_) {
    const ContactRegion& region = regions.of[i];
    if (!region.is_held()) continue;
    if (region.region != Region::pushed) rows.push_back(column(i));
    for (int d = 0; d < n_t(i) && region.sticks; ++d) rows.push_back(column(i) + 1 + d);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  Matrix directions(info_.n_q, n), D(n, n);
  Vector guess(n), missing(n);
  w_ = regions.is_frozen ? Vector(Vector::Zero(info_.n_q)) : load_;
  Eigen::Index k = 0;
  for (const int i : contacts_) {
    const ContactRegion& region = regions.of[i];
    const ContactInfo& contact = info_.contacts[i];
    if (!region.is_held()) {
      lambda_n_[i] = 0;
      for (int d = 0; d < contact.n_t; ++d) lambda_t_[contact.tangent_index + d] = 0;
      continue;
    }
    Vector along = X_.col(column(i));
    for (int d = 0; d < contact.n_t && region.slips(); ++d)
      along -= contact.mu * region.direction[d] * X_.col(column(i) + 1 + d);
    if (region.region == Region::pushed) {
      lambda_n_[i] = auxiliary_.push[i];
      w_ += lambda_n_[i] * along;
    } else {
      directions.col(k) = along;
      missing[k] = regions.is_frozen ? 0 : -bias_[column(i)];
      if (region.region == Region::bouncing)
        missing[k] = -auxiliary_.k * y[i] - auxiliary_.damping[i] * normal_velocity(i, v);
      guess[k++] = lambda_n_[i];
    }
    for (int d = 0; d < contact.n_t && region.sticks; ++d) {
      directions.col(k) = X_.col(column(i) + 1 + d);
      missing[k] = regions.is_frozen ? 0 : -bias_[column(i) + 1 + d];
      guess[k++] = lambda_t_[contact.tangent_index + d];
    }
  }
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) D(a, b) = R_.col(rows[a]).dot(directions.col(b));
    missing[a] -= R_.col(rows[a]).dot(w_);
  }
  // Redundant contacts: of all forces those nearest to the ones that the law has found.
  if (n > 0) guess += least_squares(D, missing - D * guess);
  if (!guess.allFinite()) return false;
  if (n > 0) w_ += directions * guess;
  k = 0;
  for (const int i : contacts_) {
    const ContactRegion& region = regions.of[i];
    const ContactInfo& contact = info_.contacts[i];
    if (!region.is_held()) continue;
    if (region.region != Region::pushed) lambda_n_[i] = guess[k++];
    for (int d = 0; d < contact.n_t; ++d)
      lambda_t_[contact.tangent_index + d] =
          region.sticks ? guess[k++] : -contact.mu * lambda_n_[i] * region.direction[d];
  }
  return true;
}

void InstantLaw::project(const Regions& regions, Vector& v) const {
  std::vector<int> rows;
  for (const int i : contacts_) {
    if (regions.of[i].region != Region::sliding) continue;
    rows.push_back(column(i));
    for (int d = 0; d < n_t(i) && regions.of[i].sticks; ++d) rows.push_back(column(i) + 1 + d);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n == 0) return;
  Matrix D(n, n);
  Vector rate(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    for (Eigen::Index b = 0; b < n; ++b) D(a, b) = G_(rows[a], rows[b]);
    rate[a] = R_.col(rows[a]).dot(v);
  }
  const Vector nu = least_squares(D, rate);
  if (!nu.allFinite()) return;
  for (Eigen::Index a = 0; a < n; ++a) v -= nu[a] * X_.col(rows[a]);
}

}  // namespace ricochet
