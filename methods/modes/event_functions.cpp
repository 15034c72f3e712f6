#include "methods/modes/event_functions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "methods/contact_laws/group_rest.h"
#include "methods/contact_laws/sunk_closing.h"
#include "problems/packed_column.h"

namespace ricochet {
namespace {

constexpr double kLocated = 1e-9;  // of the step: the root of the interpolation, from where the step is taken again
constexpr int kMaxIterations = 60;
// Up to this part of a step that begins at the surface, the interpolation may be wrong by this part of the gap there.
constexpr double kBegin = 0.125, kOfBegin = 0.01;
constexpr double kContradicts = 0.01;  // of a force
constexpr double kNoForce = 1e-8;      // of a force that is as good as none where the cone is reached
constexpr double kOfOthers = 1e-6;     // of the largest force: what redundant contacts without a load may have
constexpr int kSamples = 16;           // of functions without bounds, in a step
constexpr double kOfHeight = 1e-4;     // to which the level of a contact that sinks is located
constexpr int kMaxHalvings = 50;       // in search of a point after a zero at the left end
// Speed of slip in space that is left to the run, over the root of the tolerance and the size of slip.
constexpr double kStop = 0.03;

bool is_of_forces(SwitchKind kind) {
  return kind == SwitchKind::force_vanishes || kind == SwitchKind::cone_reached;
}

/// Locates the zero of a function between two points, where it falls or rises, by the Illinois method.
struct Bracket {
  double from, value_from, to, value_to;
  bool rises = value_to > value_from;
  int last_side = 0;

  double next() const { return to - value_to * (to - from) / (value_to - value_from); }
  /// The point takes the place of the end whose sign the value there has. An end that stays twice counts half.
  void narrow(double point, double value) {
    if (rises ? value < 0 : value > 0) {
      from = point;
      value_from = value;
      if (last_side == -1) value_to *= 0.5;
      last_side = -1;
    } else {
      to = point;
      value_to = value;
      if (last_side == 1) value_from *= 0.5;
      last_side = 1;
    }
  }
};

}  // namespace

EventFunctions::EventFunctions(const Problem& problem, const ContactScales& scales, ModeDynamics& dynamics, int degree)
    : problem_(problem),
      info_(problem.info()),
      scales_(scales),
      dynamics_(dynamics),
      degree_(degree),
      gaps_(problem, degree) {
  const auto n_c = info_.contacts.size();
  functions_.reserve(2 * n_c);
  gap_.setZero(info_.n_c());
  sinks_.assign(n_c, 0);
  closing_.reserve(n_c);
  v_stop_ = gap_;
  packed_n_.setZero(info_.n_normal_entries);
  packed_t_.setZero(info_.n_tangent_entries);
  direction_.setZero(info_.n_lambda_t);
  for (auto* x : {&q_, &v_, &a_}) x->setZero(info_.n_q);
  for (const auto& contact : info_.contacts) {
    curved_tangents_ = curved_tangents_ || (contact.n_t > 0 && !contact.is_affine);
  }
  if (curved_tangents_) T_.setZero(info_.n_lambda_t, info_.n_q);
  path_error_ = q_;
  load_function_.reserve(2 * n_c);
  problem.normal_jacobian(info_.q0.data(), packed_n_.data());
  if (info_.has_friction()) problem.tangent_jacobian(info_.q0.data(), packed_t_.data());
}

/// J_t of the closed contacts at q, if it varies.
void EventFunctions::set_positions(const double* q) {
  if (slips_ && curved_tangents_) problem_.tangent_jacobian_of(dynamics_.closed(), q, packed_t_.data());
}

/// J_t' v at the positions that were set.
void EventFunctions::tangent_dots(const ContactInfo& contact, const double* v, double* v_t) const {
  packed_tangent_dots(contact, packed_t_.data(), v, v_t);
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
  if (curved_tangents_) problem_.tangent_jacobian_of({&contact, 1}, q, packed_t_.data());
  tangent_dots(info_.contacts[contact], v, v_t);
}

double EventFunctions::first_v_stop(int contact) const {
  return kStop * std::sqrt(tolerance_) * scales_.slip(contact);
}

EventFunctions::Rest EventFunctions::rest(int contact, const Vector& q, const Vector& v, const Vector& a) {
  double v_t[2], w_t[2];
  slip_velocity(contact, q.data(), a.data(), w_t);
  slip_velocity(contact, q.data(), v.data(), v_t);
  const auto& info = info_.contacts[contact];
  if (!info.is_affine) {
    problem_.slip_velocity_derivative(q.data(), v.data(), T_.data());
    for (int d = 0; d < 2; ++d) {
      for (const int k : info.support) w_t[d] += T_(info.tangent_index + d, k) * v[k];
    }
  }
  const double w = std::hypot(w_t[0], w_t[1]);
  const double distance = std::abs(v_t[0] * w_t[1] - v_t[1] * w_t[0]) / w;
  return {std::hypot(v_t[0], v_t[1]), -(v_t[0] * w_t[0] + v_t[1] * w_t[1]) / (w * w), distance, distance / w, w};
}

int EventFunctions::slowest_slip(const Vector& v) const {
  int slowest = -1;
  double least = std::numeric_limits<double>::infinity();
  for (const Function& f : functions_) {
    if (f.kind != SwitchKind::slip_stops) continue;
    double v_t[2]{0, 0};
    tangent_dots(info_.contacts[f.contact], v.data(), v_t);
    const double speed = std::hypot(v_t[0], v_t[1]);
    if (speed >= least) continue;
    least = speed;
    slowest = f.contact;
  }
  return slowest;
}

void EventFunctions::find_slow(int contact, const Vector& q, const Vector& v, std::vector<int>& slow) {
  slow.clear();
  for (const Function& f : functions_) {
    if (f.kind != SwitchKind::slip_stops || info_.contacts[f.contact].n_t != 2) continue;
    double v_t[2];
    slip_velocity(f.contact, q.data(), v.data(), v_t);
    if (f.contact == contact || std::hypot(v_t[0], v_t[1]) <= first_v_stop(f.contact)) slow.push_back(f.contact);
  }
}

void EventFunctions::pass_slip(int contact, const Vector& q, const Vector& v) {
  double v_t[2];
  slip_velocity(contact, q.data(), v.data(), v_t);
  v_stop_[contact] = 0.5 * std::hypot(v_t[0], v_t[1]);
  pass(q.data(), v.data());
}

/// (1)-(4), at the positions that were set.
double EventFunctions::function(const Function& f, const double* v) {
  const int i = f.contact;
  switch (f.kind) {
    case SwitchKind::gap_closes:
      return gap_[i];
    case SwitchKind::force_vanishes:
      return dynamics_.normal_force(i);
    case SwitchKind::cone_reached:
      return dynamics_.cone_margin(i);
    case SwitchKind::slip_stops:
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      break;
  }
  return slip_speed(i, v) - (info_.contacts[i].n_t == 1 ? 0 : v_stop_[i]);
}

double EventFunctions::rounding(const Function& f) const {
  switch (f.kind) {
    case SwitchKind::gap_closes:
      return scales_.nearly_touching(f.contact);
    case SwitchKind::force_vanishes:
      return scales_.no_force(f.contact);
    case SwitchKind::cone_reached:
      return info_.contacts[f.contact].mu * scales_.no_force(f.contact);
    case SwitchKind::slip_stops:
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:
      break;
  }
  return scales_.no_slip(f.contact);
}

/// All functions at the right end.
void EventFunctions::evaluate(const double* q, const double* v) {
  if (has_gaps_) problem_.gap(q, gap_.data());
  set_positions(q);
  for (Function& f : functions_) f.right = function(f, v);
}

void EventFunctions::begin(const double* q, const double* v) {
  functions_.clear();
  slips_ = has_gaps_ = false;
  for (const int i : info_.unilateral) {
    const ContactMode mode = dynamics_.modes()[i];
    functions_.push_back({is_closed(mode) ? SwitchKind::force_vanishes : SwitchKind::gap_closes, i});
    has_gaps_ = has_gaps_ || !is_closed(mode);
    if (mode == ContactMode::stick) functions_.push_back({SwitchKind::cone_reached, i});
    if (!is_slipping(mode)) continue;
    functions_.push_back({SwitchKind::slip_stops, i});
    slips_ = true;
    const auto& info = info_.contacts[i];
    if (info.n_t == 1) {
      direction_[info.tangent_index] = slip_sign(mode);
    } else {
      v_stop_[i] = 0;
    }
  }
  list_loads(q, v);
  pass(q, v);
}

int EventFunctions::contradicted() const {
  double largest = 0;  // of all forces: a contact without a load has their rounding
  for (const int i : dynamics_.closed()) largest = std::max({largest, scales_.force(i), dynamics_.normal_force(i)});
  for (const Function& f : functions_) {
    const double allowed = std::max(kContradicts * scales_.force(f.contact), kOfOthers * largest);
    if (is_of_forces(f.kind) && f.left < -allowed) return f.contact;
  }
  return -1;
}

/// The functions that are searched within steps, and how.
void EventFunctions::list_loads(const double* q, const double* v) {
  watch_ = LoadWatch::none;
  if (dynamics_.closed().empty() || (info_.clock < 0 && !slips_)) return;
  if (!info_.structure.has_bounds) {
    if (info_.clock >= 0) watch_ = LoadWatch::samples;
    return;
  }
  if (!loads_) loads_.emplace(problem_, degree_);  // most scenes need none
  loads_->set_modes(dynamics_.modes());
  load_function_.clear();
  const bool has_forces = loads_->depends_on_time();
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Function& f = functions_[k];
    if (f.kind == SwitchKind::gap_closes || (f.kind != SwitchKind::slip_stops && !has_forces)) continue;
    load_function_.push_back(k);
    loads_->functions().push_back({.kind = f.kind, .contact = f.contact});
  }
  if (load_function_.empty()) return;
  watch_ = !has_forces || loads_->is_known_at(q, v) ? LoadWatch::bounds : LoadWatch::samples;
}

void EventFunctions::pass(const double* q, const double* v) {
  evaluate(q, v);
  v_ = Eigen::Map<const Vector>(v, info_.n_q);
  advance(v_);
}

void EventFunctions::advance(const Vector& v) {
  for (Function& f : functions_) {
    const auto& info = info_.contacts[f.contact];
    if (f.kind == SwitchKind::slip_stops && info.n_t == 2) {
      double* d = direction_.data() + info.tangent_index;
      tangent_dots(info, v.data(), d);
      const double speed = std::hypot(d[0], d[1]);
      if (speed > 0) {
        d[0] /= speed;
        d[1] /= speed;
      }
      double& v_stop = v_stop_[f.contact];
      v_stop = std::max(v_stop, std::min(first_v_stop(f.contact), 0.5 * speed));
      f.right = speed - v_stop;
    }
    f.left = f.right;
    f.from_zero = f.left <= rounding(f);
    if (f.kind == SwitchKind::gap_closes && !f.from_zero) sinks_[f.contact] = 0;
  }
}

void EventFunctions::record_stage(double c) {
  if (lowest_stage_ <= 1) return;
  for (const Function& f : functions_) {
    if (!is_of_forces(f.kind)) continue;
    if (function(f, nullptr) < 0) lowest_stage_ = std::min(lowest_stage_, c);
  }
}

/// J_n' v of a contact whose J_n is constant, or has been evaluated.
double EventFunctions::gap_rate(int contact, const Vector& v) const {
  const auto& info = info_.contacts[contact];
  return packed_dot(info, packed_n_.data() + info.normal_begin, v);
}

double EventFunctions::at(const Function& f, double theta, const StepEnds& ends) {
  if (f.kind == SwitchKind::gap_closes) return gaps_.gap(f.contact, theta);
  if (is_of_forces(f.kind) && theta == forces_at_) return function(f, v_.data());  // of all contacts
  ends.interpolate(theta, q_, v_);
  forces_at_ = is_of_forces(f.kind) ? theta : kNowhere;
  return value({f.kind, f.contact}, q_.data(), v_.data());
}

double EventFunctions::value(const DetectedEvent& event, const double* q, const double* v) {
  if (is_of_forces(event.kind)) dynamics_.accelerate(q, v, a_.data());
  return value_with_forces(event, q, v);
}

double EventFunctions::value_with_forces(const DetectedEvent& event, const double* q, const double* v) {
  if (event.kind == SwitchKind::gap_closes)
    problem_.gap_of({&event.contact, 1}, q, gap_.data());
  else if (!is_of_forces(event.kind) && curved_tangents_)
    problem_.tangent_jacobian_of(dynamics_.closed(), q, packed_t_.data());
  return function({event.kind, event.contact}, v) + event.level;
}

double EventFunctions::slope(const DetectedEvent& event, const double* q, const double* v) {
  if (event.kind != SwitchKind::gap_closes) return event.slope;
  if (!info_.contacts[event.contact].is_affine) problem_.normal_jacobian_of({&event.contact, 1}, q, packed_n_.data());
  v_ = Eigen::Map<const Vector>(v, info_.n_q);
  const double rate = gap_rate(event.contact, v_);
  return rate < 0 ? rate : event.slope;
}

/// The zero between a point where f is positive and one where it is negative, if it is before the first one so far.
void EventFunctions::search(const Function& f, double from, double value_from, double to, double value_to,
                            const StepEnds& ends, DetectedEvent& first) {
  if (first && first.theta < to) {
    to = first.theta;
    if (to <= from) return;
    value_to = at(f, to, ends);
    if (value_to > 0) return;
  }
  double theta = to, value = value_to, slope = (value_to - value_from) / (to - from);
  Bracket bracket{from, value_from, to, value_to};
  for (int k = 0; k < kMaxIterations && bracket.to - bracket.from > kLocated; ++k) {
    const double next = bracket.next(), at_next = at(f, next, ends);
    if (next != theta) slope = (at_next - value) / (next - theta);
    theta = next;
    value = at_next;
    // The slope decides: next to a minimum the ends of the bracket do not bound the distance to the zero.
    if (std::abs(value) <= kLocated * std::abs(slope)) break;
    bracket.narrow(theta, value);
  }
  first = {f.kind, f.contact, theta, slope / ends.h};
}

/// The first closing of a gap along the step.
void EventFunctions::find_closing(const Function& f, const StepEnds& ends, DetectedEvent& first) {
  const double rounding_f = rounding(f);
  bool is_near = false;  // within the error of the interpolation, before the right end
  if (const double error = f.from_zero ? 0 : gaps_.gap_error(f.contact); error > rounding_f) {
    const auto nearest = gaps_.first_closing(f.contact, {.gap = -error, .rounding = rounding_f});
    if (!nearest) return;
    is_near = nearest.to < 1;
  }
  GapSearch::Allowance allowed{.gap = std::max(rounding_f, -2 * f.left), .rounding = rounding_f};
  if (f.from_zero) {
    allowed.until = kBegin;
    // (2) of quintic.h; and a collocation polynomial is an integral of s times factors below one.
    const double error = gaps_.begin_error(f.contact);
    if (ends.collocation)
      allowed.square = 0.5 * (degree_ + 1) * error;
    else
      allowed.cube = error;
    allowed.most = kOfBegin * gaps_.gap(f.contact, kBegin);
  }
  const auto closing = gaps_.first_closing(f.contact, allowed);
  if (!closing && (gaps_.end() < 1 || f.right >= 0 || f.from_zero)) {
    if (is_near) inexact_ = {f.kind, f.contact};
    return;
  }
  double from = closing ? closing.from : 0;
  const double to = closing ? closing.to : 1, at_to = at(f, to, ends);  // or by less than rounding, at the end
  if (f.from_zero) {                                                    // a flight no higher than rounding is none
    double theta = to, height = at_to;
    for (int k = 0; k < kMaxHalvings && height <= rounding_f; ++k) height = at(f, theta *= 0.5, ends);
    if (height <= rounding_f) {
      if (sinks_[f.contact]) return find_sunk(f, ends, first);
      first = {f.kind, f.contact, 0, at_to / (to * ends.h)};
      return;
    }
    from = std::max(from, theta);
  }
  const double at_from = at(f, from, ends);
  if (at_from > 0)
    search(f, from, at_from, to, at_to, ends, first);
  else if (!first || from < first.theta)
    first = {f.kind, f.contact, from, (at_to - at_from) / ((to - from) * ends.h)};
}

/// Finds where a contact that may sink closes.
void EventFunctions::find_sunk(const Function& f, const StepEnds& ends, DetectedEvent& first) {
  const double height = scales_.capture_height(f.contact);
  const auto closing = find_sunk_closing(gaps_, f.contact, height, f.left, rounding(f), kOfHeight * height);
  if (!closing || (first && first.theta <= closing.theta)) return;
  const auto gap = [&](double s) { return gaps_.gap(f.contact, s); };
  const auto& [from, to, found] = closing.piece;
  const double slope = (gap(to) - gap(from)) / ((to - from) * ends.h);
  first = {.kind = f.kind, .contact = f.contact, .theta = closing.theta, .slope = slope, .level = closing.level};
}

int EventFunctions::sunk(const double* q) {
  for (const Function& f : functions_) {
    if (f.kind != SwitchKind::gap_closes || !sinks_[f.contact]) continue;
    problem_.gap_of({&f.contact, 1}, q, gap_.data());
    if (GroupRest::is_too_low(scales_, f.contact, gap_[f.contact])) return f.contact;
  }
  return -1;
}

/// The cheap test: the gap of an affine contact is (1) of quintic.h, too.
bool EventFunctions::stays_open(const Function& f, const StepEnds& ends) const {
  if (!info_.contacts[f.contact].is_affine || ends.collocation) return false;
  const double h = ends.h;
  const int i = f.contact;
  const QuinticBernstein gap(f.left, h * gap_rate(i, ends.v0), h * h * gap_rate(i, ends.a0), f.right,
                             h * gap_rate(i, ends.v1), h * h * gap_rate(i, ends.a1));
  return gap.smallest() >= gap.error();
}

/// How often the step can be halved until no gap that was open at its left end has closed at the right one. The first
/// event is on the last half before that, or earlier.
int EventFunctions::closed_halves(const StepEnds& ends) {
  const auto find_closed = [&](const auto& gap) {
    for (const Function& f : functions_) {
      if (f.is_near && !f.from_zero && gap(f) < -rounding(f)) closing_.push_back(f.contact);
    }
    return !closing_.empty();
  };
  closing_.clear();
  if (!find_closed([](const Function& f) { return f.right; })) return 0;
  double theta = 0.5;
  for (int n = 0; n < kMaxHalvings; ++n, theta *= 0.5) {
    ends.interpolate(theta, q_, v_);
    problem_.gap_of(closing_, q_.data(), gap_.data());
    std::erase_if(closing_, [&](int i) { return !(gap_[i] < -scales_.nearly_touching(i)); });
    if (!closing_.empty()) continue;
    problem_.gap(q_.data(), gap_.data());  // others may have closed before, and opened
    if (!find_closed([&](const Function& f) { return gap_[f.contact]; })) return n;
  }
  return kMaxHalvings;
}

/// The first closing of all gaps. A fall by a few roundings may count as none: then the whole step is searched.
void EventFunctions::find_closings(const StepEnds& ends, DetectedEvent& first) {
  ends.bernstein(gaps_.path(), gaps_.path_error());
  for (int n = closed_halves(ends);; n = 0) {
    gaps_.begin(dynamics_.modes(), n);
    for (const Function& f : functions_) {
      if (f.is_near) find_closing(f, ends, first);
    }
    if (first || n == 0) return;
  }
}

bool EventFunctions::another_has_fallen(const DetectedEvent& event, const StepEnds& ends) {
  evaluate(ends.q1.data(), ends.v1.data());
  return std::ranges::any_of(functions_, [&](const Function& f) {
    return !event.is(f.kind, f.contact) && f.right < std::min(0.0, f.left) - rounding(f);
  });
}

DetectedEvent EventFunctions::find(const StepEnds& ends, const std::vector<int>& beginning) {
  evaluate(ends.q1.data(), ends.v1.data());
  forces_at_ = kNowhere;
  inexact_ = {};
  bool is_near = false;
  for (Function& f : functions_) {
    f.is_near = f.kind == SwitchKind::gap_closes && !stays_open(f, ends);
    is_near = is_near || f.is_near;
    f.begins = f.kind == SwitchKind::slip_stops && std::ranges::count(beginning, f.contact) > 0;
  }
  DetectedEvent first;
  if (is_near) find_closings(ends, first);
  for (const Function& f : functions_) {
    if (f.kind == SwitchKind::gap_closes || f.begins || f.right >= 0 || (f.from_zero && f.right >= -rounding(f)))
      continue;
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
      if (f.from_zero || f.right < 0 || !is_of_forces(f.kind)) continue;
      const double value = at(f, lowest_stage_, ends);
      if (value < -rounding(f)) search(f, 0, f.left, lowest_stage_, value, ends, first);
    }
  }
  if (watch_ == LoadWatch::bounds) find_hidden(ends, first);
  if (watch_ == LoadWatch::samples) find_sampled(ends, first);
  if (first.kind == SwitchKind::cone_reached && info_.clock >= 0) tell_opening(ends, first);
  return first;
}

/// Opens the contact if the normal force vanishes where the cone is reached, up to the accuracy of located zeros.
void EventFunctions::tell_opening(const StepEnds& ends, DetectedEvent& first) {
  const double located = 4 * kLocated * std::abs(first.slope) * ends.h / info_.contacts[first.contact].mu;
  const Function force{SwitchKind::force_vanishes, first.contact};
  if (at(force, first.theta, ends) <= kNoForce * scales_.force(first.contact) + located)
    first.kind = SwitchKind::force_vanishes;
}

/// How far a function may fall below zero within a step without a switch.
double EventFunctions::hidden_slack(const Function& f) const {
  const double size = f.kind == SwitchKind::slip_stops     ? scales_.slip(f.contact)
                      : f.kind == SwitchKind::cone_reached ? info_.contacts[f.contact].mu * scales_.force(f.contact)
                                                           : scales_.force(f.contact);
  return std::max(rounding(f), tolerance_ * size);
}

/// Error of a slip velocity within a step, from the estimate (2) of quintic.h for positions: the slope of that
/// remainder is at most 3.5 times its largest value.
double EventFunctions::slip_error(int contact, double h) const {
  const auto& info = info_.contacts[contact];
  double error = 0;
  for (int d = 0; d < info.n_t; ++d) {
    const double* column = packed_t_.data() + info.tangent_begin + d * static_cast<int>(info.support.size());
    error = std::max(error, packed_terms(info, column, path_error_));
  }
  return 3.5 * error / h;
}

/// A fall before the first zero so far that neither the right end nor a stage shows.
void EventFunctions::find_hidden(const StepEnds& ends, DetectedEvent& first) {
  ends.bernstein(loads_->path(), path_error_);
  ends.bernstein_of_velocity(loads_->path());
  for (std::size_t k = 0; k < load_function_.size(); ++k) {
    const Function& f = functions_[load_function_[k]];
    LoadSearch::Function& load = loads_->functions()[k];
    load.slack = f.begins ? std::numeric_limits<double>::infinity() : hidden_slack(f);
    if (f.kind != SwitchKind::slip_stops) continue;
    const auto& info = info_.contacts[f.contact];
    for (int d = 0; d < info.n_t; ++d) load.direction[d] = direction_[info.tangent_index + d];
    if (info.n_t == 2) load.v_stop = v_stop_[f.contact];
    load.error = f.from_zero ? 0 : slip_error(f.contact, ends.h);
    if (!dynamics_.holds_direction(f.contact)) continue;
    double held[2];
    dynamics_.direction(f.contact, held);
    loads_->hold_direction(f.contact, held);
  }
  const auto fall = loads_->first_fall(first ? first.theta : 1);
  if (!first && !fall && loads_->is_near_zero()) inexact_ = {SwitchKind::slip_stops, slowest_slip(ends.v0)};
  const double before = first ? first.theta : 2;
  for (std::size_t k = 0; fall && k < load_function_.size(); ++k) {
    if (!loads_->has_fallen(k)) continue;
    const Function& f = functions_[load_function_[k]];
    const double at_from = at(f, fall.from, ends), at_to = at(f, fall.to, ends);
    if (at_from > 0)
      search(f, fall.from, at_from, fall.to, at_to, ends, first);
    else if (!first || fall.from < first.theta)
      first = {f.kind, f.contact, fall.from, (at_to - at_from) / ((fall.to - fall.from) * ends.h)};
  }
  if (first && first.theta < before) first.duration = fall.duration * ends.h;
}

/// The same of values at points.
void EventFunctions::find_sampled(const StepEnds& ends, DetectedEvent& first) {
  for (int n = 1; n < kSamples; ++n) {
    const double theta = static_cast<double>(n) / kSamples;
    if (first && theta >= first.theta) return;
    ends.interpolate(theta, q_, v_);
    forces_at_ = kNowhere;
    if (!dynamics_.accelerate(q_.data(), v_.data(), a_.data())) return;
    set_positions(q_.data());
    for (const Function& f : functions_) {
      if (f.kind == SwitchKind::gap_closes || f.from_zero || f.begins) continue;
      const double value = function(f, v_.data());
      if (value >= -hidden_slack(f)) continue;
      const double from = theta - 1.0 / kSamples, at_from = at(f, from, ends);
      if (!(at_from > 0)) continue;
      search(f, from, at_from, theta, value, ends, first);
      first.duration = ends.h / kSamples;
      return;
    }
  }
}

}  // namespace ricochet
