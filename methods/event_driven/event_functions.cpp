#include "methods/event_driven/event_functions.h"

#include <algorithm>
#include <cmath>

#include "methods/event_driven/explicit_step.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

using Kind = Happening::Kind;

constexpr double kLocated = 1e-9;  // of the step: the root of the interpolation, from where the step is taken again
constexpr int kMaxIterations = 60;
constexpr int kMaxHalvings = 50;  // in search of a point behind a zero at the left end
// Speed of slip in space that is left to ModeChange, over the root of the tolerance and the size of slip.
constexpr double kStop = 0.03;
constexpr double kPassing = 0.3;  // of its speed: slip that would not come nearer to zero goes on

}  // namespace

void StepEnds::interpolate(double s, Vector& q, Vector& v) const {
  // q = q0 + h s v0 + (h s)^2 a0 / 2 + s^3 (c3 + s (c4 + s c5)), from what Taylor's polynomial leaves at s = 1.
  for (Eigen::Index k = 0; k < q0.size(); ++k) {
    const double hv = h * v0[k], ha = h * h * a0[k];
    const double d0 = q1[k] - q0[k] - hv - 0.5 * ha, d1 = h * v1[k] - hv - ha, d2 = h * h * a1[k] - ha;
    const double c3 = 10 * d0 - 4 * d1 + 0.5 * d2, c4 = -15 * d0 + 7 * d1 - d2, c5 = 6 * d0 - 3 * d1 + 0.5 * d2;
    q[k] = q0[k] + s * (hv + s * (0.5 * ha + s * (c3 + s * (c4 + s * c5))));
    v[k] = (hv + s * (ha + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / h;
  }
}

EventFunctions::EventFunctions(const Problem& problem, const ContactScales& scales, ModeDynamics& dynamics,
                               double tolerance)
    : problem_(problem), info_(problem.info()), scales_(scales), dynamics_(dynamics), tolerance_(tolerance) {
  const auto n_c = info_.contacts.size();
  functions_.reserve(2 * n_c);
  gap_.setZero(info_.n_c());
  rate0_ = rate1_ = v_stop_ = gap_;
  packed_n_.setZero(info_.n_normal_entries);
  packed_t_.setZero(info_.n_tangent_entries);
  direction_.setZero(info_.n_lambda_t);
  is_armed_.assign(n_c, 0);
  for (auto* x : {&q_, &v_, &a_}) x->setZero(info_.n_q);
  for (const auto& contact : info_.contacts) {
    curved_normals_ = curved_normals_ || (!contact.is_bilateral && !contact.is_affine);
    curved_tangents_ = curved_tangents_ || (contact.n_t > 0 && !contact.is_affine);
  }
  problem.normal_jacobian(info_.q0.data(), packed_n_.data());
  if (info_.has_friction()) problem.tangent_jacobian(info_.q0.data(), packed_t_.data());
}

/// J_n and J_t at q, those that vary.
void EventFunctions::set_positions(const double* q) {
  if (has_gaps_ && curved_normals_) problem_.normal_jacobian(q, packed_n_.data());
  if (slips_ && curved_tangents_) problem_.tangent_jacobian(q, packed_t_.data());
}

/// J_t' v at the positions that were set.
void EventFunctions::tangent_dots(const ContactInfo& contact, const double* v, double* v_t) const {
  const double* column = packed_t_.data() + contact.tangent_begin;
  for (int d = 0; d < contact.n_t; ++d, column += contact.support.size()) v_t[d] = packed_dot(contact, column, v);
}

/// d' J_t' v
double EventFunctions::slip_speed(int contact, const double* v) const {
  const auto& info = info_.contacts[contact];
  double v_t[2]{0, 0}, speed = 0;
  tangent_dots(info, v, v_t);
  for (int d = 0; d < info.n_t; ++d) speed += direction_[info.tangent_index + d] * v_t[d];
  return speed;
}

void EventFunctions::slip_velocity(int contact, const double* q, const double* v, double* v_t) {
  if (curved_tangents_) problem_.tangent_jacobian(q, packed_t_.data());
  tangent_dots(info_.contacts[contact], v, v_t);
}

bool EventFunctions::stops(int contact, const Vector& q, const Vector& v, const Vector& a, double& duration) {
  double v_t[2], w_t[2];
  slip_velocity(contact, q.data(), a.data(), w_t);
  slip_velocity(contact, q.data(), v.data(), v_t);
  const double w = w_t[0] * w_t[0] + w_t[1] * w_t[1];
  duration = -(v_t[0] * w_t[0] + v_t[1] * w_t[1]) / w;
  const double passes = std::abs(v_t[0] * w_t[1] - v_t[1] * w_t[0]) / std::sqrt(w), speed = std::hypot(v_t[0], v_t[1]);
  const bool comes_to_rest = duration > 0 && passes < kPassing * speed;
  if (!comes_to_rest) v_stop_[contact] = 0.5 * speed;
  return comes_to_rest;
}

/// (1)-(4), at the positions that were set.
double EventFunctions::function(const Function& f, const double* v) {
  const int i = f.contact;
  switch (f.kind) {
    case Kind::none:
      return 1;
    case Kind::gap_closes:
      return gap_[i];
    case Kind::force_vanishes:
      return dynamics_.normal_force(i);
    case Kind::cone_reached:
      return dynamics_.cone_margin(i);
    case Kind::slip_stops:
      break;
  }
  const double speed = slip_speed(i, v);
  if (info_.contacts[i].n_t == 1) return speed;
  return is_armed_[i] ? speed - v_stop_[i] : speed + v_stop_[i];
}

double EventFunctions::rounding(const Function& f) const {
  switch (f.kind) {
    case Kind::none:
      return 0;
    case Kind::gap_closes:
      return scales_.nearly_touching(f.contact);
    case Kind::force_vanishes:
      return scales_.no_force(f.contact);
    case Kind::cone_reached:
      return info_.contacts[f.contact].mu * scales_.no_force(f.contact);
    case Kind::slip_stops:
      break;
  }
  return scales_.no_slip(f.contact);
}

void EventFunctions::evaluate(const double* q, const double* v, double Function::*end) {
  if (has_gaps_) problem_.gap(q, gap_.data());
  set_positions(q);
  for (Function& f : functions_) f.*end = function(f, v);
}

void EventFunctions::begin(const double* q, const double* v) {
  functions_.clear();
  slips_ = has_gaps_ = false;
  for (const int i : info_.unilateral) {
    const ContactMode mode = dynamics_.modes()[i];
    functions_.push_back({is_closed(mode) ? Kind::force_vanishes : Kind::gap_closes, i});
    has_gaps_ = has_gaps_ || !is_closed(mode);
    if (mode == ContactMode::stick) functions_.push_back({Kind::cone_reached, i});
    if (!is_slipping(mode)) continue;
    functions_.push_back({Kind::slip_stops, i});
    slips_ = true;
    const auto& info = info_.contacts[i];
    if (info.n_t == 1) {
      direction_[info.tangent_index] = slip_sign(mode);
    } else {
      v_stop_[i] = kStop * std::sqrt(tolerance_) * scales_.slip(i);
      is_armed_[i] = false;
    }
  }
  pass(q, v);
}

void EventFunctions::pass(const double* q, const double* v) {
  evaluate(q, v, &Function::right);
  for (const int i : info_.unilateral)
    rate1_[i] = packed_dot(info_.contacts[i], packed_n_.data() + info_.contacts[i].normal_begin, v);
  v_ = Eigen::Map<const Vector>(v, info_.n_q);
  advance(v_);
}

void EventFunctions::advance(const Vector& v) {
  rate0_.swap(rate1_);
  for (Function& f : functions_) {
    const auto& info = info_.contacts[f.contact];
    if (f.kind == Kind::slip_stops && info.n_t == 2) {
      double* d = direction_.data() + info.tangent_index;
      tangent_dots(info, v.data(), d);
      const double speed = std::hypot(d[0], d[1]);
      if (speed > 0) {
        d[0] /= speed;
        d[1] /= speed;
      }
      is_armed_[f.contact] = is_armed_[f.contact] || speed > 2 * v_stop_[f.contact];
      f.right = is_armed_[f.contact] ? speed - v_stop_[f.contact] : speed + v_stop_[f.contact];
    }
    f.left = f.right;
    f.from_zero = f.left <= rounding(f);
  }
}

void EventFunctions::see_stage(double c) {
  if (lowest_stage_ <= 1) return;
  for (const Function& f : functions_) {
    if (f.kind != Kind::force_vanishes && f.kind != Kind::cone_reached) continue;
    if (function(f, nullptr) < 0) lowest_stage_ = std::min(lowest_stage_, c);
  }
}

/// The gap of an affine contact along the interpolation of the step, by its values and two derivatives at the ends.
void EventFunctions::set_gap_polynomial(const Function& f, const StepEnds& ends) {
  const auto& info = info_.contacts[f.contact];
  const double* J_n = packed_n_.data() + info.normal_begin;
  const double h = ends.h, rate = h * packed_dot(info, J_n, ends.v0), a = h * h * packed_dot(info, J_n, ends.a0);
  const double d0 = f.right - f.left - rate - 0.5 * a, d1 = h * packed_dot(info, J_n, ends.v1) - rate - a;
  const double d2 = h * h * packed_dot(info, J_n, ends.a1) - a;
  gap_polynomial_[0] = f.left;
  gap_polynomial_[1] = rate;
  gap_polynomial_[2] = 0.5 * a;
  gap_polynomial_[3] = 10 * d0 - 4 * d1 + 0.5 * d2;
  gap_polynomial_[4] = -15 * d0 + 7 * d1 - d2;
  gap_polynomial_[5] = 6 * d0 - 3 * d1 + 0.5 * d2;
  polynomial_of_ = f.contact;
}

double EventFunctions::at(const Function& f, double theta, const StepEnds& ends) {
  if (f.kind == Kind::gap_closes && info_.contacts[f.contact].is_affine) {
    if (polynomial_of_ != f.contact) set_gap_polynomial(f, ends);
    double gap = 0;
    for (int k = 5; k >= 0; --k) gap = gap * theta + gap_polynomial_[k];
    return gap;
  }
  ends.interpolate(theta, q_, v_);
  return value({f.kind, f.contact}, q_.data(), v_.data());
}

double EventFunctions::value(const Happening& happening, const double* q, const double* v) {
  switch (happening.kind) {
    case Kind::none:
      break;
    case Kind::gap_closes:
      problem_.gap(q, gap_.data());
      break;
    case Kind::force_vanishes:
    case Kind::cone_reached:
      dynamics_.accelerate(q, v, a_.data());
      break;
    case Kind::slip_stops:
      if (curved_tangents_) problem_.tangent_jacobian(q, packed_t_.data());
  }
  return function({happening.kind, happening.contact}, v);
}

/// The zero between a point where f is positive and one where it is negative, by the Illinois method, if it is before
/// the first one so far.
void EventFunctions::search(const Function& f, double from, double value_from, double to, double value_to,
                            const StepEnds& ends, Happening& first) {
  if (first && first.theta < to) {
    to = first.theta;
    if (to <= from) return;
    value_to = at(f, to, ends);
    if (value_to > 0) return;
  }
  double theta = to, value = value_to, slope = (value_to - value_from) / (to - from);
  for (int k = 0; k < kMaxIterations && to - from > kLocated; ++k) {
    const double next = to - value_to * (to - from) / (value_to - value_from);
    const double at_next = at(f, next, ends);
    if (next != theta) slope = (at_next - value) / (next - theta);
    const double moved = std::abs(next - theta);
    theta = next;
    value = at_next;
    if (value > 0) {
      if (from != 0 || k > 0) value_to *= 0.5;
      from = theta;
      value_from = value;
    } else {
      value_from *= 0.5;
      to = theta;
      value_to = value;
    }
    if (moved < kLocated || value == 0) break;
  }
  first = {f.kind, f.contact, theta, slope / ends.h};
}

/// Gaps that close and open again within the step.
void EventFunctions::find_dips(const StepEnds& ends, Happening& first) {
  for (const Function& f : functions_) {
    if (f.kind != Kind::gap_closes || f.right < 0) continue;
    const int i = f.contact;
    if (!(rate0_[i] < 0 && rate1_[i] > 0)) continue;
    // The minimum, where the rate vanishes.
    double from = 0, to = 1, rate_from = rate0_[i], rate_to = rate1_[i], theta = 0, gap = 0;
    for (int k = 0; k < 8; ++k) {
      theta = from - rate_from * (to - from) / (rate_to - rate_from);
      gap = at(f, theta, ends);
      if (gap < 0) break;
      ends.interpolate(theta, q_, v_);
      if (curved_normals_) problem_.normal_jacobian(q_.data(), packed_n_.data());
      const double rate = packed_dot(info_.contacts[i], packed_n_.data() + info_.contacts[i].normal_begin, v_);
      if (std::abs(rate) * ends.h * (to - from) < 1e-3 * std::abs(gap)) break;
      if (rate < 0) {
        from = theta;
        rate_from = rate;
        rate_to *= k > 0 ? 0.5 : 1;
      } else {
        to = theta;
        rate_to = rate;
        rate_from *= k > 0 ? 0.5 : 1;
      }
    }
    if (gap < -rounding(f)) search(f, 0, std::max(f.left, 0.0), theta, gap, ends, first);
  }
  if (curved_normals_) problem_.normal_jacobian(ends.q1.data(), packed_n_.data());
}

Happening EventFunctions::find(const StepEnds& ends) {
  polynomial_of_ = -1;
  evaluate(ends.q1.data(), ends.v1.data(), &Function::right);
  bool dips = false;
  for (const Function& f : functions_) {
    if (f.kind != Kind::gap_closes) continue;
    const auto& info = info_.contacts[f.contact];
    rate1_[f.contact] = packed_dot(info, packed_n_.data() + info.normal_begin, ends.v1);
    dips = dips || (rate0_[f.contact] < 0 && rate1_[f.contact] > 0 && f.right >= 0);
  }
  Happening first;
  for (const Function& f : functions_) {
    if (f.right >= 0 || (f.from_zero && f.right >= -rounding(f))) continue;
    if (!f.from_zero) {
      search(f, 0, f.left, 1, f.right, ends, first);
      continue;
    }
    double theta = 1, value = f.right;
    for (int k = 0; k < kMaxHalvings && value <= rounding(f); ++k) value = at(f, theta *= 0.5, ends);
    if (value > rounding(f))
      search(f, theta, value, 2 * theta, at(f, 2 * theta, ends), ends, first);
    else
      first = {f.kind, f.contact, 0, f.right / ends.h};
  }
  if (lowest_stage_ <= 1) {
    for (const Function& f : functions_) {
      if (f.from_zero || f.right < 0 || (f.kind != Kind::force_vanishes && f.kind != Kind::cone_reached)) continue;
      const double value = at(f, lowest_stage_, ends);
      if (value < -rounding(f)) search(f, 0, f.left, lowest_stage_, value, ends, first);
    }
  }
  if (dips) find_dips(ends, first);
  return first;
}

}  // namespace ricochet
