#include "methods/time_freezing/time_freezing_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/packed_column.h"

namespace ricochet {
namespace {

// What a switching function has of rounding behind the equations of an element, relative to what it has seen.
constexpr double kRounding = 1e-11;
// Of a switch: its functions are zero to this part of their rounding, or time cannot tell.
constexpr double kZero = 0.05;
constexpr double kShortest = 1e-15;    // of the end time
constexpr double kStandstill = 1e-14;  // the same, of an element between switches at one time
constexpr int kMaxZeros = 60;          // evaluations of a bracket
constexpr int kMaxHalvings = 45;
constexpr int kMaxSwitches = 400;      // that an element is tried with
constexpr int kMaxInstants = 200;      // switches without time between them
constexpr int kMaxFrozen = 1'000'000;  // elements of one instant
constexpr double kSlowing = 1e-3;      // of the slip in space at the left end: from there on its direction is held
// Of the slip whose direction is held: what is slower where it stops, stops with it.
constexpr double kTogether = 0.3;
// A bounce that rises by this many roundings of the gap is none.
constexpr double kLow = 4;
// An approach below this part of the largest is none.
constexpr double kNoApproach = 1e-12;

// Of the push over the force of persistent contact: near beta = 1 time would hardly run.
constexpr double kReserve = 10;
constexpr double kMostWeight = 0.5;

constexpr const char* kNoMass = "M is not positive definite, or bilateral constraints depend on each other";
constexpr const char* kNoForces = "no forces hold the contacts in their modes";

}  // namespace

TimeFreezingRun::TimeFreezingRun(const Problem& problem, const ButcherTableau& tableau,
                                 const TimeFreezingOptions& options, const Settings& settings)
    : problem_(problem),
      info_(problem.info()),
      tableau_(tableau),
      options_(options),
      settings_(settings),
      T_(info_.end_time),
      H_(info_.end_time / settings.steps / options.n_fe),
      counters_(solution_.counters),
      time_limit_(settings.time_limit),
      auxiliary_(problem, options.a_n, options.bounce * info_.end_time),
      scales_(problem),
      system_(problem, counters_),
      law_(system_, info_, auxiliary_, scales_, counters_),
      forces_(info_),
      elements_(problem, tableau, counters_),
      flight_solver_(elements_, settings.inner_tolerance),
      flight_motion_(tableau),
      slide_solver_(problem, tableau, auxiliary_, settings.inner_tolerance, counters_),
      q_(info_.q0),
      v_(info_.v0) {
  flight_.resize(info_, tableau.n_s);
  slide_.resize(info_, tableau.n_s);
  regions_.of.resize(info_.contacts.size());
  y_ = y1_ = Lambda_n_ = gap_ = Vector::Zero(info_.n_c());
  Lambda_t_ = Vector::Zero(info_.n_lambda_t);
  q1_ = q_;
  v1_ = v_;
}

bool TimeFreezingRun::fail(Status status, std::string message) {
  solution_.status = status;
  solution_.message = std::move(message);
  return false;
}

ContactMode TimeFreezingRun::mode_of(int contact) const {
  const ContactRegion& region = regions_.of[contact];
  if (info_.contacts[contact].is_bilateral) return ContactMode::closed;
  if (!region.is_held()) return ContactMode::open;
  if (region.sticks) return ContactMode::stick;
  if (!region.slips()) return ContactMode::closed;
  return slip_mode(info_.contacts[contact].n_t, region.direction.data());
}

Solution TimeFreezingRun::run() {
  modes_.assign(info_.contacts.size(), ContactMode::open);
  for (const int i : info_.bilateral) modes_[i] = ContactMode::closed;
  scales_.begin_step(q_.data(), v_.data(), T_ / settings_.steps, true);
  bool is_going = pass_instant({}, true);
  if (settings_.recording >= Recording::events) {
    solution_.initial_modes = modes_;
  }
  for (int k = 1; k <= settings_.steps && is_going; ++k) {
    const double begin = (k - 1) * T_ / settings_.steps, end = k == settings_.steps ? T_ : k * T_ / settings_.steps;
    scales_.begin_step(q_.data(), v_.data(), T_ / settings_.steps, false);
    for (int n = 1; n <= options_.n_fe && is_going; ++n)
      is_going = advance(n == options_.n_fe ? end : begin + (end - begin) * n / options_.n_fe);
    if (!is_going) break;
    ++counters_.steps;
    if (settings_.recording >= Recording::grid) solution_.samples.push_back({t_, q_, v_, v_});
  }
  solution_.t = t_;
  solution_.q = q_;
  solution_.v = v_;
  return std::move(solution_);
}

/// From the clock's t to `end`, through all switches between.
bool TimeFreezingRun::advance(double end) {
  for (int standstills = 0; t_ < end;) {
    if (standstills > kMaxInstants) return fail(Status::step_limit, "switches accumulate");
    if (time_limit_.is_over()) return fail(Status::time_limit, time_limit_.message());
    double dt = end - t_;
    const double whole = dt;
    if (dt <= kShortest * T_) {
      t_ = end;
      break;
    }
    RegionSwitch cause;
    const double begin = t_;
    if (!take(dt, cause)) return false;
    const bool is_end = !cause && dt == whole;
    t_ = is_end ? end : std::min(begin + dt, end);
    standstills = dt <= kStandstill * T_ ? standstills + 1 : 0;
    if (settings_.recording == Recording::motion && t_ > begin) {
      if (is_free_) {
        flight_motion_.add(begin, t_, flight_, solution_.motion);
      } else {
        const double length = t_ - begin;
        const Vector q0 = q_, v0 = v_;
        solution_.motion.add(begin, t_, 3, [&](double s, Vector& q, Vector& v) {
          const Vector change = q1_ - q0, bend0 = length * v0 - change, bend1 = change - length * v1_;
          q = q0 + s * change + s * (1 - s) * ((1 - s) * bend0 + s * bend1);
          v = (change + (1 - 2 * s) * ((1 - s) * bend0 + s * bend1) + s * (1 - s) * (bend1 - bend0)) / length;
        });
      }
    }
    q_ = q1_;
    v_ = v1_;
    if (info_.clock >= 0) {
      q_[info_.clock] = t_;
      v_[info_.clock] = 1;
    }
    ++counters_.elements;
    const bool is_short_of_push = !is_free_ && slide_.beta.maxCoeff() > kMostWeight;
    has_law_ = !cause && info_.clock < 0;  // the right end is the next left end
    if (cause) {
      if (!pass_instant(cause, false)) return false;
    } else if (is_short_of_push && !renew_guess(dt)) {
      return fail(Status::inner_solver_failed, kNoForces);
    }
  }
  return true;
}

/// Contacts that touch at (q_, v_): evaluates the law for them.
bool TimeFreezingRun::find_touching(RegionSwitch cause) {
  problem_.gap(q_.data(), gap_.data());
  touching_.clear();
  for (const int i : info_.unilateral) {
    if (regions_.of[i].is_held() || cause.is(SwitchKind::gap_closes, i) || gap_[i] <= scales_.touching(i))
      touching_.push_back(i);
  }
  return system_.prepare(q_, v_, touching_);
}

/// Records in the scales the speeds of contacts that touch; at the start of the run also the change of speed that the load
/// makes within a step.
void TimeFreezingRun::record_contacts(bool is_first) {
  const double H = T_ / settings_.steps;
  const Vector& load = system_.load();
  for (const int i : touching_) {
    const double G_nn = system_.normal_delassus(i), G_tt = system_.tangential_delassus(i);
    scales_.record_contact(i, system_.normal(i), G_nn, G_tt);
    scales_.record_approach(i, system_.normal_terms(i, v_));
    scales_.record_slip(i, system_.tangent_terms(i, v_));
    if (G_nn > 0) scales_.record_force(i, system_.normal_terms(i, load) / G_nn);
    if (!is_first) continue;
    scales_.record_approach(i, H * system_.normal_terms(i, load));
    scales_.record_slip(i, H * (system_.tangent_terms(i, load) + info_.contacts[i].mu * scales_.force(i) * G_tt));
  }
}

/// Restitution, unless the bounce would be too low to be followed: (e J_n' v)^2 <= 2 |a| (rounding of the gap).
bool TimeFreezingRun::begins_to_bounce(int contact) const {
  const double eps_r = info_.contacts[contact].eps_r;
  if (eps_r == 0) return false;
  const double rebound = eps_r * system_.normal_velocity(contact, v_), a = system_.load_rate(contact);
  return !(eps_r < 1 && a < 0 && rebound * rebound <= -2 * a * kLow * scales_.nearly_touching(contact));
}

/// Pushed and bouncing contacts at (q_, v_). @return whether there are any: time is frozen
bool TimeFreezingRun::find_approaching(RegionSwitch cause) {
  bool is_frozen = false;
  for (const int i : touching_) {
    ContactRegion& region = regions_.of[i];
    if (cause.ends(Region::bouncing, i)) region = {};
    const bool approaches =
        !cause.ends(Region::pushed, i) && system_.normal_velocity(i, v_) < -kNoApproach * scales_.approach(i);
    if (region.region == Region::bouncing || (approaches && region.region == Region::pushed)) {
      is_frozen = true;
    } else if (approaches) {
      region.region = begins_to_bounce(i) ? Region::bouncing : Region::pushed;
      y_[i] = 0;
      is_frozen = true;
    } else if (region.region == Region::pushed) {
      region.region = Region::sliding;
    }
  }
  return is_frozen;
}

/// All that happens at one time of the clock: frozen elements until no contact approaches, then the regions behind.
bool TimeFreezingRun::pass_instant(RegionSwitch cause, bool is_first) {
  if (cause.slows) {
    hold_direction(cause.contact);
    return renew_guess(H_) || fail(Status::inner_solver_failed, kNoForces);
  }
  const std::vector<ContactMode> before = modes_;
  const Vector v_minus = v_;
  const RegionSwitch first_cause = cause;
  Lambda_n_.setZero();
  Lambda_t_.setZero();
  for (int n = 0;; ++n) {
    if (n > kMaxInstants) return fail(Status::step_limit, fmt::format("impacts accumulate at t = {:.6g}", t_));
    if (!find_touching(cause)) return fail(Status::inner_solver_failed, kNoMass);
    record_contacts(is_first);
    if (!find_approaching(cause)) break;
    if (law_.select_frozen(v_, y_, cause, regions_, forces_) != LcpStatus::solved)
      return fail(Status::infeasible, "no auxiliary dynamics stop the approach");
    if (!pass_frozen(cause)) return false;
  }
  if (law_.select_sliding(v_, cause, regions_, forces_) != LcpStatus::solved)
    return fail(Status::infeasible, "the contact law has no solution");
  project_velocity(system_, regions_, v_);
  for (std::size_t i = 0; i < modes_.size(); ++i) modes_[i] = mode_of(static_cast<int>(i));
  record(before, v_minus, first_cause, is_first);
  is_free_ = std::ranges::none_of(regions_.of, [](const ContactRegion& region) { return region.is_held(); });
  if (is_free_) return true;
  if (!forces_.solve(system_, auxiliary_, regions_, v_, y_)) return fail(Status::inner_solver_failed, kNoForces);
  set_guess(H_);
  return true;
}

/// Elements of pseudo time until a region changes.
bool TimeFreezingRun::pass_frozen(RegionSwitch& cause) {
  is_free_ = false;
  double length = 0;
  bool has_limit = false;
  for (const int i : touching_) {
    const ContactRegion& region = regions_.of[i];
    has_limit = has_limit || region.region == Region::bouncing || region.turns;
    if (region.region == Region::pushed) length = std::max(length, -2 * system_.normal_velocity(i, v_) / options_.a_n);
  }
  if (has_limit) length = length > 0 ? std::min(length, H_) : H_;
  for (int n = 0; n < kMaxFrozen; ++n) {
    if (time_limit_.is_over()) return fail(Status::time_limit, time_limit_.message());
    if (!forces_.solve(system_, auxiliary_, regions_, v_, y_)) return fail(Status::inner_solver_failed, kNoForces);
    set_guess(length);
    cause = {};
    double taken = length;
    if (!take(taken, cause)) return false;
    v_ = v1_;
    y_ = y1_;
    Lambda_n_ += slide_.Lambda_n;
    Lambda_t_ += slide_.Lambda_t;
    ++counters_.elements;
    if (cause.slows) {
      hold_direction(cause.contact);
      continue;
    }
    if (cause) return true;
    if (!system_.prepare(q_, v_, touching_)) return fail(Status::inner_solver_failed, kNoMass);
    turn_slip(v_, regions_);
  }
  return fail(Status::step_limit, "the auxiliary dynamics do not end");
}

/// Slip in space that turns has, in `regions`, the direction of `v`, with the sign of the element's left end.
void TimeFreezingRun::turn_slip(const Vector& v, Regions& regions) const {
  for (const int i : touching_) {
    if (!regions_.of[i].turns) continue;
    double v_t[2];
    system_.slip_velocity(i, v, v_t);
    const auto& left = regions_.of[i].direction;
    const double speed = std::copysign(std::hypot(v_t[0], v_t[1]), v_t[0] * left[0] + v_t[1] * left[1]);
    if (std::abs(speed) > kRounding * scales_.slip(i)) regions.of[i].direction = {v_t[0] / speed, v_t[1] / speed};
  }
}

/// The last of a slip in space keeps its direction: at its end it would have none.
void TimeFreezingRun::hold_direction(int contact) {
  turn_slip(v_, regions_);
  regions_.of[contact].turns = false;
  double v_t[2];
  system_.slip_velocity(contact, v_, v_t);
  law_.set_resting_speed(kTogether * std::hypot(v_t[0], v_t[1]));
}

/// First guess of an element from the forces of the law.
void TimeFreezingRun::set_guess(double length) {
  Vector beta = Vector::Zero(info_.n_c()), tau = Vector::Zero(info_.n_lambda_t);
  double s = regions_.is_frozen ? 0 : 1;
  const auto set_weights = [&](double factor) {
    for (const int i : touching_) {
      beta[i] = forces_.lambda_n[i] * factor / auxiliary_.push[i];
      for (int d = 0; d < info_.contacts[i].n_t; ++d) {
        const int k = info_.contacts[i].tangent_index + d;
        tau[k] = forces_.lambda_t[k] * factor / auxiliary_.push[i];
      }
    }
  };
  if (regions_.is_frozen) {
    set_weights(1);
  } else {
    for (const int i : touching_) auxiliary_.push[i] = std::max(auxiliary_.push[i], kReserve * forces_.lambda_n[i]);
    // (3) of pseudo_time_equations.h, beta = s lambda / push: the right side falls with s.
    double low = 0, high = 1;
    for (int k = 0; k < 40; ++k) {
      s = 0.5 * (low + high);
      double product = 1;
      for (const int i : touching_) product *= 1 - std::min(1.0, s * forces_.lambda_n[i] / auxiliary_.push[i]);
      (product > s ? low : high) = s;
    }
    set_weights(s);
  }
  const Vector w = (regions_.is_frozen ? 1 : s) * forces_.w;
  slide_.guess(s > 0 ? length / s : length, s, w, beta, tau);
}

/// The same at the left end, where Newton's method has spoilt what was there.
bool TimeFreezingRun::renew_guess(double length) {
  if (is_free_) {
    flight_.forget_guess();
    return true;
  }
  if (!system_.prepare(q_, v_, touching_) || !forces_.solve(system_, auxiliary_, regions_, v_, y_)) return false;
  set_guess(length);
  return true;
}

/// The functions (1) of the regions at hand, with their values at the left end.
void TimeFreezingRun::set_functions() {
  functions_.clear();
  end_regions_ = regions_;
  const auto add = [&](SwitchKind kind, int i, double rounding, bool slows = false) {
    functions_.push_back({{kind, i, regions_.of[i].region, slows}, 0, 0, rounding});
  };
  problem_.gap(q_.data(), gap_.data());
  has_forces_ = false;
  for (const int i : info_.unilateral) {
    const ContactRegion& region = regions_.of[i];
    const double velocity = kRounding * scales_.approach(i);
    switch (region.region) {
      case Region::free:
        if (!regions_.is_frozen) add(SwitchKind::gap_closes, i, scales_.nearly_touching(i));
        if (regions_.is_frozen && std::ranges::count(touching_, i) > 0) add(SwitchKind::gap_closes, i, velocity);
        continue;
      case Region::sliding:
        add(SwitchKind::force_vanishes, i, kRounding * (regions_.is_frozen ? auxiliary_.push[i] : scales_.force(i)));
        has_forces_ = true;
        break;
      case Region::pushed:
        add(SwitchKind::force_vanishes, i, velocity);
        break;
      case Region::bouncing:
        add(SwitchKind::force_vanishes, i, 1e-13 * scales_.approach(i) / std::sqrt(auxiliary_.k));
        break;
    }
    if (region.sticks && region.region != Region::bouncing) {
      add(SwitchKind::cone_reached, i,
          kRounding * info_.contacts[i].mu * (regions_.is_frozen ? auxiliary_.push[i] : scales_.force(i)));
      has_forces_ = true;
    } else if (region.slips()) {
      add(SwitchKind::slip_stops, i, kRounding * scales_.slip(i), region.turns);
    }
  }
  if (has_forces_ && !regions_.is_frozen && !has_law_ && !forces_.solve(system_, auxiliary_, regions_, v_, y_))
    has_forces_ = false;
  y1_ = y_;
  for (Function& function : functions_) function.left = value(function, v_);
}

/// A function at a state whose law is prepared, with y1_, and gap_ for gaps.
double TimeFreezingRun::value(const Function& function, const Vector& v) {
  const int i = function.zero.contact;
  const ContactInfo& contact = info_.contacts[i];
  switch (function.zero.kind) {
    case SwitchKind::gap_closes:
      return regions_.is_frozen ? system_.normal_velocity(i, v) : gap_[i];
    case SwitchKind::force_vanishes:
      if (function.zero.region == Region::pushed) return -system_.normal_velocity(i, v);
      return function.zero.region == Region::bouncing ? -y1_[i] : forces_.lambda_n[i];
    case SwitchKind::cone_reached: {
      const double* force = forces_.lambda_t.data() + contact.tangent_index;
      const double size = contact.n_t == 2 ? std::hypot(force[0], force[1]) : std::abs(force[0]);
      return contact.mu * std::abs(forces_.lambda_n[i]) - size;
    }
    case SwitchKind::slip_stops: {
      double v_t[2]{0, 0};
      system_.slip_velocity(i, v, v_t);
      const auto& d = regions_.of[i].direction;
      const double along = v_t[0] * d[0] + (contact.n_t == 2 ? v_t[1] * d[1] : 0);
      if (!function.zero.slows || &v == &v_) return along;
      return along - kSlowing * std::max(function.left, 0.0);
    }
    case SwitchKind::slip_turns:
    case SwitchKind::edge_left:  // there is no polygon
      break;
  }
  return 0;
}

/// The element at hand with a length of time, or of pseudo time while time is frozen. Behind: q1_, v1_, y1_.
bool TimeFreezingRun::solve(double length) {
  if (is_free_) {
    flight_.q0 = q_;
    flight_.v0 = v_;
    flight_.h = length;
    if (flight_solver_.solve(flight_) != ElementSolver::Result::converged) {
      flight_.forget_guess();
      if (flight_solver_.solve(flight_) != ElementSolver::Result::converged) return false;
    }
    q1_ = flight_.q1;
    v1_ = flight_.v1;
    return true;
  }
  slide_.q0 = q_;
  slide_.v0 = v_;
  slide_.y0 = y_;
  const bool is_solved =
      regions_.is_frozen ? slide_solver_.solve_length(slide_, length) : slide_solver_.solve_to_clock(slide_, length);
  if (!is_solved) return false;
  q1_ = slide_.q1;
  v1_ = slide_.v1;
  y1_ = slide_.y1;
  return true;
}

/// All functions at the right end of the element at hand.
bool TimeFreezingRun::evaluate() {
  problem_.gap(q1_.data(), gap_.data());
  if (!is_free_) {
    if (!system_.prepare(q1_, v1_, touching_)) return false;
    turn_slip(v1_, end_regions_);
    if (has_forces_ && !forces_.solve(system_, auxiliary_, end_regions_, v1_, y1_)) return false;
  }
  for (Function& function : functions_) function.right = value(function, v1_);
  return true;
}

/// The function that seems to reach zero first of those that are negative at the right end; null for none.
/// @param located  whose zero the right end is
TimeFreezingRun::Function* TimeFreezingRun::first_negative(RegionSwitch located) {
  Function* first = nullptr;
  double earliest = INFINITY;
  for (Function& function : functions_) {
    const double left = std::max(function.left, 0.0);
    if (located.is(function.zero.kind, function.zero.contact) || !(function.right < -function.rounding)) continue;
    const double theta = left / (left - function.right);
    if (theta >= earliest) continue;
    earliest = theta;
    first = &function;
  }
  return first;
}

/// Whether a gap that is open at both ends is closed at a stage: the length becomes that up to it.
bool TimeFreezingRun::cuts_dip(RegionSwitch located, double& length) {
  for (int j = 0; j < tableau_.n_s && is_free_; ++j) {
    const double c = tableau_.c[j];
    if (!(c > 0 && c < 1)) continue;
    problem_.gap(flight_.q.col(j).data(), gap_.data());
    for (const Function& function : functions_) {
      if (located.is(function.zero.kind, function.zero.contact)) continue;
      if (!(gap_[function.zero.contact] < -function.rounding)) continue;
      length *= c;
      return true;
    }
  }
  return false;
}

/// One element of at most this length, shorter where a function reaches zero before: `cause`.
bool TimeFreezingRun::take(double& length, RegionSwitch& cause) {
  if (!is_free_) {
    if (!regions_.is_frozen) {
      touching_.clear();
      for (const int i : info_.unilateral)
        if (regions_.of[i].is_held()) touching_.push_back(i);
      if (!has_law_ && !system_.prepare(q_, v_, touching_)) return fail(Status::inner_solver_failed, kNoMass);
      turn_slip(v_, regions_);
    }
    slide_solver_.set_regions(regions_);
  }
  set_functions();
  cause = {};
  int failures = 0;
  for (int n = 0; n < kMaxSwitches; ++n) {
    if (!solve(length) || !evaluate()) {
      has_law_ = false;
      // In free flight there is no switch that a shorter element would end with.
      if (is_free_ || ++failures > kMaxHalvings / 4)
        return fail(Status::inner_solver_failed, "Newton's method did not converge");
      length *= 0.5;
      if (!renew_guess(length)) return fail(Status::inner_solver_failed, kNoForces);
      continue;
    }
    Function* const first = first_negative(cause);
    if (!first && cuts_dip(cause, length)) continue;
    if (!first) return true;
    if (!locate(*first, length)) {
      if (length > 0) return fail(Status::inner_solver_failed, "Newton's method did not converge at a switch");
      cause = first->zero;  // it is at the left end
      q1_ = q_;
      v1_ = v_;
      y1_ = y_;
      slide_.Lambda_n.setZero();
      slide_.Lambda_t.setZero();
      return true;
    }
    cause = first->zero;
  }
  return fail(Status::step_limit, "too many switches in an element");
}

/// The zero of a function that is negative at the right end of an element of this length: the length becomes that of it.
bool TimeFreezingRun::locate(Function& function, double& length) {
  double b = length, f_b = function.right, a = 0, f_a = function.left;
  const double shortest = kShortest * T_;
  if (!(f_a > function.rounding)) {  // zero at the left end, too: the next zero is meant
    double trial = b;
    for (int k = 0; k < kMaxHalvings; ++k) {
      trial *= 0.5;
      if (!solve(trial) || !evaluate()) {
        if (!renew_guess(trial)) return false;
        continue;
      }
      if (function.right > 0) {
        a = trial;
        f_a = function.right;
        break;
      }
      b = trial;
      f_b = function.right;
    }
    if (a == 0) {  // there is none: the switch is at once
      length = 0;
      return false;
    }
  }
  // Regula falsi, with the value at an end that stays halved (Illinois).
  int side = 0;
  double x = b;
  for (int k = 0; k < kMaxZeros; ++k) {
    x = k % 8 == 7 ? 0.5 * (a + b) : (a * f_b - b * f_a) / (f_b - f_a);
    if (!(x > a && x < b)) x = 0.5 * (a + b);
    if (!solve(x) || !evaluate()) {  // a stage too near to where slip has no direction: the zero is looked for before
      if (!renew_guess(x)) return false;
      b = x;
      f_b = std::min(f_b, -f_a);
      continue;
    }
    const double f = function.right;
    if (std::abs(f) <= kZero * function.rounding || b - a <= shortest) break;
    if (f > 0) {
      a = x;
      f_a = f;
      if (side == 1) f_b *= 0.5;
      side = 1;
    } else {
      b = x;
      f_b = f;
      if (side == -1) f_a *= 0.5;
      side = -1;
    }
  }
  length = x;
  return true;
}

void TimeFreezingRun::record(const std::vector<ContactMode>& before, const Vector& v_minus, RegionSwitch cause,
                             bool is_first) {
  for (const int i : info_.unilateral) {
    const bool has_impulse = Lambda_n_[i] > 0;
    if (!has_impulse) Lambda_n_[i] = 0;
    const auto kind = event_kind(before[i], modes_[i], has_impulse, cause.is(SwitchKind::slip_stops, i));
    if (!kind || (is_first && !has_impulse)) continue;
    ++counters_.events;
    if (settings_.recording == Recording::final_state) continue;
    solution_.events.push_back({t_, *kind, i, q_, v_minus, v_, Lambda_n_, Lambda_t_, modes_, {}});
  }
  if (settings_.recording >= Recording::grid && !is_first) solution_.samples.push_back({t_, q_, v_minus, v_});
}

}  // namespace ricochet
