#include "tests/tools/event_arbiter.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <stdexcept>

#include "problems/derivatives/symbolic_problem.h"

namespace ricochet::arbiter {
namespace {

using GiNaC::ex;

const BigFloat& rounding() {  // relative, with a margin for sums of many terms
  static const BigFloat value = BigFloat::power_of_ten(25 - BigFloat::kDigits);
  return value;
}

const BigFloat& plastic_velocity() {
  static const BigFloat value = BigFloat::power_of_ten(-40);
  return value;
}

BigFloat exact(const SymbolicModel& model, const ex& expression) {
  GiNaC::exmap values;
  for (std::size_t k = 0; k < model.parameters.size(); ++k)
    values[model.parameter_symbols[k]] = GiNaC::numeric(cln::rational(cln::cl_R(model.parameters[k].value)));
  const ex value = expression.subs(values);
  if (!GiNaC::is_a<GiNaC::numeric>(value)) throw std::invalid_argument("not affine, or M is not constant");
  return BigFloat(cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N()));
}

/// The constant term and the coefficients of an expression that is affine in q.
struct Affine {
  BigFloat constant;
  BigVector slope;
};

Affine affine(const SymbolicModel& model, const ex& expression) {
  Affine result;
  GiNaC::exmap origin;
  for (const auto& q : model.q) origin[q] = 0;
  result.constant = exact(model, expression.subs(origin));
  for (const auto& q : model.q) result.slope.push_back(exact(model, expression.diff(q)));
  return result;
}

BigFloat dot(const BigVector& a, const BigVector& b) {
  BigFloat sum;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

/// Solves A x = r by elimination with pivots. @return empty when A is singular to rounding
BigVector solve_linear(std::vector<BigVector> A, BigVector r) {
  const std::size_t n = r.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i) {
      if (abs(A[i][k]) > abs(A[pivot][k])) pivot = i;
    }
    if (abs(A[pivot][k]) <= rounding()) return {};
    std::swap(A[k], A[pivot]);
    std::swap(r[k], r[pivot]);
    for (std::size_t i = k + 1; i < n; ++i) {
      const BigFloat factor = A[i][k] / A[k][k];
      for (std::size_t j = k; j < n; ++j) A[i][j] -= factor * A[k][j];
      r[i] -= factor * r[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) r[k] -= A[k][j] * r[j];
    r[k] /= A[k][k];
  }
  return r;
}

struct Value {
  BigFloat value, slope, terms;  ///< p, p', and the sum of the sizes of the terms of p
};

Value evaluate(const std::vector<BigFloat>& p, const BigFloat& s) {
  Value result;
  for (std::size_t k = p.size(); k-- > 0;) {
    result.slope = result.slope * s + result.value;
    result.value = result.value * s + p[k];
    result.terms = result.terms * s + abs(p[k]);
  }
  return result;
}

/// First zero of p in (0, h], by (4).
std::optional<BigFloat> first_zero(const std::vector<BigFloat>& p, const BigFloat& h) {
  if (p.front().sign() <= 0) throw std::runtime_error("a contact begins with a double zero");
  BigFloat B, power = 1;
  for (std::size_t k = 2; k < p.size(); ++k, power *= h)
    B += BigFloat(static_cast<int>(k * (k - 1))) * abs(p[k]) * power;
  BigFloat s;
  for (int iteration = 0; iteration < 20000; ++iteration) {
    const Value at = evaluate(p, s);
    if (at.value.sign() <= 0) return s;
    const BigFloat root = sqrt(at.slope * at.slope + BigFloat(2) * B * at.value);
    BigFloat d = h;
    if (at.slope.sign() <= 0 && !(root - at.slope).is_zero())
      d = BigFloat(2) * at.value / (root - at.slope);
    else if (at.slope.sign() > 0 && !B.is_zero())
      d = (root + at.slope) / B;
    if (s + d > h) return std::nullopt;
    s += d;
    if (d <= s * rounding()) return s;
  }
  throw std::runtime_error("a gap has a double zero");
}

}  // namespace

EventArbiter::EventArbiter(const Problem& problem) {
  const SymbolicModel* formulas = problem.formulas();
  if (!formulas || problem.info().has_friction() || problem.info().has_bilateral())
    throw std::invalid_argument("formulas without friction and constraints are required");
  const SymbolicModel& model = *formulas;
  n_ = problem.n_q();
  GiNaC::exmap at_rest;
  for (const auto& v : model.v) at_rest[v] = 0;
  for (int k = 0; k < n_; ++k) {
    const auto row = static_cast<std::size_t>(k);
    for (int j = 0; j < n_; ++j) {
      if (j != k && !model.mass[row][static_cast<std::size_t>(j)].is_zero())
        throw std::invalid_argument("M is not diagonal");
    }
    M_.push_back(exact(model, model.mass[row][row]));
    for (const auto& v : model.v) {
      if (model.force[row].has(v)) throw std::invalid_argument("forces depend on v");
    }
    Affine f = affine(model, model.force[row]);
    c_.push_back(f.constant);
    K_.push_back(std::move(f.slope));
    q_.push_back(exact(model, model.q0[row]));
    v_.push_back(exact(model, model.v0[row]));
  }
  for (const auto& contact : model.contacts) {
    Affine gap = affine(model, contact.gap);
    b_.push_back(gap.constant);
    J_.push_back(std::move(gap.slope));
    e_.push_back(exact(model, contact.eps_r));
  }
  end_ = exact(model, model.end_time);

  for (int i = 0; i < n_c(); ++i) {
    G_.emplace_back();
    for (int j = 0; j < n_c(); ++j) {
      BigFloat sum;
      for (std::size_t k = 0; k < M_.size(); ++k)
        sum += J_[static_cast<std::size_t>(i)][k] * J_[static_cast<std::size_t>(j)][k] / M_[k];
      G_.back().push_back(sum);
    }
    gap_.push_back(b_[static_cast<std::size_t>(i)] + dot(J_[static_cast<std::size_t>(i)], q_));
    if (gap_.back().sign() < 0 && abs(gap_.back()) > BigFloat::power_of_ten(-15))
      throw std::invalid_argument("a contact begins in penetration");
    if (abs(gap_.back()) <= BigFloat::power_of_ten(-15)) gap_.back() = 0;  // parameters are doubles
  }

  // Terms of the series fall at least like (1/2)^k / k! on a step of 1/2 of the fastest frequency.
  BigFloat omega_squared;
  for (std::size_t k = 0; k < M_.size(); ++k) {
    BigFloat sum;
    for (const auto& entry : K_[k]) sum += abs(entry) / M_[k];
    if (sum > omega_squared) omega_squared = sum;
  }
  step_ = BigFloat(1) / (BigFloat(2) * (sqrt(BigFloat(2) * omega_squared) + BigFloat(1)));
  BigFloat term = 1;
  for (terms_ = 4; term > BigFloat::power_of_ten(-BigFloat::kDigits); ++terms_)
    term /= BigFloat(2 * static_cast<int>(terms_));
}

BigFloat EventArbiter::normal_velocity(int i) const {
  return dot(J_[static_cast<std::size_t>(i)], v_);
}

/// 0 <= x _|_ G x + w0 >= 0 on `contacts`, by trying every active set, small ones first unless active ones are
/// preferred.
EventArbiter::Complementary EventArbiter::solve_complementarity(const std::vector<int>& contacts, const BigVector& w0,
                                                                bool prefer_active) const {
  const unsigned n = static_cast<unsigned>(contacts.size());
  std::vector<unsigned> sets;
  for (unsigned set = 0; set < 1u << n; ++set) sets.push_back(set);
  std::ranges::stable_sort(sets, [&](unsigned a, unsigned b) {
    return prefer_active ? std::popcount(a) > std::popcount(b) : std::popcount(a) < std::popcount(b);
  });
  BigFloat scale = BigFloat::power_of_ten(-30);
  for (const int i : contacts) scale = std::max(scale, abs(w0[static_cast<std::size_t>(i)]));
  const BigFloat least = -(scale * rounding());
  for (const unsigned set : sets) {
    std::vector<std::size_t> chosen;
    for (unsigned k = 0; k < n; ++k) {
      if (set & (1u << k)) chosen.push_back(static_cast<std::size_t>(contacts[k]));
    }
    std::vector<BigVector> A;
    BigVector r;
    for (const std::size_t i : chosen) {
      A.emplace_back();
      for (const std::size_t j : chosen) A.back().push_back(G_[i][j]);
      r.push_back(-w0[i]);
    }
    const BigVector forces = solve_linear(A, r);
    if (forces.size() != chosen.size()) continue;  // redundant contacts: another set has the same motion
    Complementary result{BigVector(G_.size()), std::vector<bool>(G_.size(), false), w0};
    bool fits = true;
    for (std::size_t k = 0; k < chosen.size(); ++k) {
      result.x[chosen[k]] = forces[k];
      result.active[chosen[k]] = true;
      fits = fits && forces[k] >= least;
    }
    for (const int i : contacts) {
      auto& w = result.w[static_cast<std::size_t>(i)];
      for (const std::size_t j : chosen) w += G_[static_cast<std::size_t>(i)][j] * result.x[j];
      fits = fits && w >= least;
    }
    if (fits) return result;
  }
  throw std::runtime_error("a complementarity problem has no solution");
}

/// (2) at the contacts that touch; those at rest are among them.
void EventArbiter::impact(const std::vector<bool>& touching) {
  std::vector<int> contacts;
  for (int i = 0; i < n_c(); ++i) {
    if (touching[static_cast<std::size_t>(i)]) contacts.push_back(i);
  }
  BigVector before(G_.size());
  BigFloat scale;
  for (const int i : contacts) {
    before[static_cast<std::size_t>(i)] = resting_[static_cast<std::size_t>(i)] ? BigFloat() : normal_velocity(i);
    scale = std::max(scale, abs(before[static_cast<std::size_t>(i)]));
  }
  std::vector<bool> plastic(G_.size(), false);
  Complementary law;
  for (bool has_changed = true; has_changed;) {
    BigVector w0(G_.size());
    for (const int i : contacts) {
      const auto k = static_cast<std::size_t>(i);
      w0[k] = plastic[k] ? before[k] : (BigFloat(1) + e_[k]) * before[k];
    }
    law = solve_complementarity(contacts, w0, false);
    has_changed = false;
    for (const int i : contacts) {
      const auto k = static_cast<std::size_t>(i);
      const BigFloat after = -(e_[k] * before[k]);
      if (law.active[k] && !plastic[k] && after.sign() > 0 && after < plastic_velocity()) {
        plastic[k] = has_changed = true;
        if (result_.collapses.empty() || t_.to_double() > result_.collapses.back() + 1e-12)
          result_.collapses.push_back(t_.to_double());
      }
    }
  }
  for (std::size_t k = 0; k < M_.size(); ++k) {
    for (std::size_t i = 0; i < J_.size(); ++i) v_[k] += J_[i][k] * law.x[i] / M_[k];
  }
  ++result_.impacts;
  const std::vector<bool> rested = resting_;
  for (const int i : contacts) {
    const auto k = static_cast<std::size_t>(i);
    const bool has_no_bounce = rested[k] || plastic[k] || e_[k].is_zero();
    const bool stays = law.active[k] || law.w[k] <= std::max(scale, plastic_velocity()) * rounding();
    resting_[k] = has_no_bounce && stays;
    vanishing_[k] = 1;
  }
}

/// Which of the contacts at rest stay closed, by (1) with accelerations; the others open with a t^2.
void EventArbiter::choose_active() {
  std::vector<int> contacts;
  BigVector w0(G_.size()), acceleration;
  for (std::size_t k = 0; k < M_.size(); ++k) acceleration.push_back((c_[k] + dot(K_[k], q_)) / M_[k]);
  for (int i = 0; i < n_c(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (!resting_[k]) continue;
    contacts.push_back(i);
    w0[k] = dot(J_[k], acceleration);
  }
  const Complementary law = solve_complementarity(contacts, w0, true);
  for (const int i : contacts) {
    const auto k = static_cast<std::size_t>(i);
    if (!law.active[k]) vanishing_[k] = std::max(vanishing_[k], 2);
    resting_[k] = law.active[k];
  }
  active_ = resting_;
}

/// The series of positions, gaps and contact forces.
void EventArbiter::expand() {
  std::vector<std::size_t> closed;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    if (active_[i]) closed.push_back(i);
  }
  std::vector<BigVector> G;
  for (const std::size_t i : closed) {
    G.emplace_back();
    for (const std::size_t j : closed) G.back().push_back(G_[i][j]);
  }
  position_.assign(M_.size(), {});
  force_series_.assign(J_.size(), {});
  for (std::size_t k = 0; k < M_.size(); ++k) position_[k] = {q_[k], v_[k]};
  for (std::size_t order = 0; order + 2 < terms_; ++order) {
    BigVector a(M_.size());
    for (std::size_t k = 0; k < M_.size(); ++k) {
      if (order == 0) a[k] = c_[k];
      for (std::size_t j = 0; j < M_.size(); ++j) {
        if (!K_[k][j].is_zero()) a[k] += K_[k][j] * position_[j][order];
      }
      a[k] /= M_[k];
    }
    BigVector r;
    for (const std::size_t i : closed) r.push_back(-dot(J_[i], a));
    const BigVector lambda = solve_linear(G, r);  // (3)
    for (std::size_t p = 0; p < closed.size(); ++p) {
      force_series_[closed[p]].push_back(lambda[p]);
      for (std::size_t k = 0; k < M_.size(); ++k) a[k] += J_[closed[p]][k] * lambda[p] / M_[k];
    }
    const auto factor = BigFloat(static_cast<int>((order + 1) * (order + 2)));
    for (std::size_t k = 0; k < M_.size(); ++k) position_[k].push_back(a[k] / factor);
  }
  gap_series_.assign(J_.size(), {});
  for (std::size_t i = 0; i < J_.size(); ++i) {
    if (active_[i]) continue;
    gap_series_[i].push_back(gap_[i]);
    for (std::size_t order = 1; order < terms_; ++order) {
      BigFloat sum;
      for (std::size_t k = 0; k < M_.size(); ++k) {
        if (!J_[i][k].is_zero()) sum += J_[i][k] * position_[k][order];
      }
      gap_series_[i].push_back(sum);
    }
    for (int order = 0; order < vanishing_[i]; ++order) gap_series_[i][static_cast<std::size_t>(order)] = 0;
  }
}

EventArbiter::EventFound EventArbiter::next_event(const BigFloat& h) const {
  EventFound event{h, Kind::none, -1};
  const auto consider = [&](const Series& series, Kind kind, std::size_t contact) {
    const auto zero = first_zero(series, event.after);
    if (zero && (*zero < event.after || event.kind == Kind::none)) event = {*zero, kind, static_cast<int>(contact)};
  };
  for (std::size_t i = 0; i < J_.size(); ++i) {
    if (!active_[i]) {
      const Series& gap = gap_series_[i];
      consider({gap.begin() + vanishing_[i], gap.end()}, Kind::impact, i);
    } else {
      const Value size = evaluate(force_series_[i], h);
      if (size.terms > rounding()) consider(force_series_[i], Kind::opening, i);  // else there is no force at all
    }
  }
  return event;
}

void EventArbiter::advance(const EventFound& event) {
  const BigFloat& h = event.after;
  std::vector<bool> touching = active_;
  for (std::size_t i = 0; i < J_.size(); ++i) {
    if (active_[i]) continue;
    const Value gap = evaluate(gap_series_[i], h);
    const bool is_zero = vanishing_[i] == 0 && abs(gap.value) <= gap.terms * rounding();
    touching[i] = event.kind == Kind::impact && (static_cast<int>(i) == event.contact || is_zero);
    gap_[i] = touching[i] ? BigFloat() : gap.value;
  }
  for (std::size_t k = 0; k < M_.size(); ++k) {
    const Value position = evaluate(position_[k], h);
    q_[k] = position.value;
    v_[k] = position.slope;
  }
  t_ += h;
  std::ranges::fill(vanishing_, 0);
  if (event.kind == Kind::impact) {
    impact(touching);
    choose_active();
  } else if (event.kind == Kind::opening) {
    const auto opened = static_cast<std::size_t>(event.contact);
    resting_[opened] = false;
    gap_[opened] = 0;
    choose_active();
    vanishing_[opened] = 3;  // the force was zero, and so is the gap's acceleration
  }
}

EventArbiter::Result EventArbiter::solve() {
  const std::size_t n = J_.size();
  resting_.assign(n, false);
  active_.assign(n, false);
  vanishing_.assign(n, 0);
  std::vector<bool> touching(n, false);
  bool is_impact = false;
  for (std::size_t i = 0; i < n; ++i) {
    touching[i] = gap_[i].is_zero();
    if (!touching[i]) continue;
    const int sign = normal_velocity(static_cast<int>(i)).sign();
    is_impact = is_impact || sign < 0;
    resting_[i] = sign == 0;
    vanishing_[i] = 1;
  }
  if (is_impact) impact(touching);
  choose_active();
  while (t_ < end_) {
    expand();
    advance(next_event(std::min(step_, end_ - t_)));
  }
  for (const auto& x : q_) result_.q.push_back(x.to_double());
  for (const auto& x : v_) result_.v.push_back(x.to_double());
  return result_;
}

}  // namespace ricochet::arbiter
