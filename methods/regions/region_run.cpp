#include "methods/regions/region_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/regions/border_search.h"
#include "methods/regions/time_switch.h"
#include "methods/time_limit.h"
#include "problems/input_error.h"
#include "problems/run_pieces.h"
#include "problems/variables.h"

namespace ricochet {
namespace {

constexpr double kSameTime = 1e-12;     // of the end time: two borders at one time
constexpr double kLongestEnd = 1e-6;    // of the end time: within it the impact happens that ends the run
constexpr double kZero = 4e-16;         // of the terms of psi_k: the border is located
constexpr double kUnresolved = 1e-14;   // of the run: a step with no room for its equations
constexpr double kShortest = 1e-15;     // of the run: what time can resolve
constexpr double kRoundedZero = 1e-13;  // of the terms of psi_k at the start
constexpr double kOutside = 1e-12;      // of the terms of another psi_j, beyond its border
constexpr double kDrift = 1e-6;         // of rates of closed contacts, relative
constexpr double kSmooth = 1e-12;       // jump of an acceleration that is rounding, relative

}  // namespace

RegionRun::RegionRun(const Problem& problem, bool is_adaptive, Prepare prepare)
    : problem_(problem), is_adaptive_(is_adaptive), prepare_(std::move(prepare)), regions_(problem) {}

bool RegionRun::stop(Status status, const std::string& message) {
  total_.status = status;
  total_.message = message;
  return false;
}

/// The sign of psi_k, as the formulas of the branches that hold there give it; that of a zero is 1 at first.
std::vector<int> RegionRun::signs_at(const Vector& q, const Vector& v) const {
  std::vector<double> psi(problem_.info().switches.size());
  problem_.switching(q.data(), v.data(), psi.data());
  std::vector<int> signs;
  for (const double x : psi) signs.push_back(x < 0 ? -1 : 1);
  return signs;
}

void RegionRun::begin() {
  const ProblemInfo& info = problem_.info();
  total_ = {};
  total_.q = info.q0;
  total_.v = info.v0;
  T_ = info.end_time;
  last_crossing_ = -1;
  crossings_ = 0;
  left_ = -1;
  has_ended_ = false;
  why_not_.clear();
  modes_.clear();
  piece_variables_.clear();
  signs_ = signs_at(total_.q, total_.v);
  signs_ = signs_of_time();
}

/// signs_, with functions of time alone as they are just after the present time.
std::vector<int> RegionRun::signs_of_time() const {
  const ProblemInfo& info = problem_.info();
  if (info.clock < 0) return signs_;
  Vector later = total_.q;
  later[info.clock] += 2 * kSameTime * T_;
  std::vector<int> signs = signs_at(later, total_.v);
  for (std::size_t k = 0; k < signs.size(); ++k) {
    if (!info.switches[k].is_of_time) signs[k] = signs_[k];
  }
  return signs;
}

/// The next time at which a function of time alone changes its sign [s], from the begin of the run.
double RegionRun::next_time_switch() const {
  const ProblemInfo& info = problem_.info();
  double next = T_;
  for (std::size_t k = 0; k < signs_.size(); ++k) {
    if (!info.switches[k].is_of_time) continue;
    const double start = info.start_time(), from = total_.t + 2 * kSameTime * T_;
    if (from < next)
      next = std::min(
          next,
          first_time_switch(problem_, static_cast<int>(k), {start + from, start + next}, total_.q, total_.v) - start);
  }
  return next;
}

/// One run of the method from the present state.
Solution RegionRun::run(double length, int steps, bool stays) {
  Problem& here = regions_.at(signs_);
  hold_closed(here, modes_, {}, total_.q, total_.v);
  here.set_initial_state(total_.q, total_.v);
  here.set_end_time(length);
  Settings settings = settings_;
  settings.steps = steps;
  settings.stays_in_region = stays;
  settings.sensitivities = piece_variables_;
  settings.ends = nullptr;
  if (settings_.ends && stays) {
    settings.ends = [this](const Solution& so_far, std::span<const ContactMode> modes) {
      return has_ended_ = settings_.ends(so_far, modes);
    };
  }
  auto& solver = solvers_[signs_];
  if (!solver) solver = prepare_(here);
  return solver->solve(settings);
}

/// Adds a run to the whole.
void RegionRun::take(Solution&& piece) {
  chain(piece);
  if (total_.t > 0 && !piece.succeeded())
    piece.message = fmt::format("after t = {:.12g} s, where a formula changed its branch: {}", total_.t, piece.message);
  append(problem_.info(), std::move(piece), total_, modes_);
}

/// (e) Goes on to the event of a contact that acts on what the motion slides on, and to one side, so that an impact
/// happens there. @param length, steps  of the run that found it @returns false if the run ends
bool RegionRun::go_to_event(const ActingContact& at, double length, int steps) {
  if (at.is_closed)
    return stop(
        Status::infeasible,
        fmt::format("at t = {:.12g} s: the motion slides where a formula jumps, and '{}', which acts on that, is "
                    "closed. This is not followed",
                    total_.t + at.t, problem_.info().contacts[at.contact].name));
  std::vector<std::size_t> sliding;
  for (std::size_t k = 0; k < signs_.size(); ++k) {
    if (signs_[k] == 0) sliding.push_back(k);
  }
  bool has_happened = false;
  const auto go = [&](double part, int n) {
    Solution piece = run(part, n, false);
    const bool ok = piece.succeeded();
    take(std::move(piece));
    const Vector J = regions_.at(signs_).normal_jacobian(total_.q).col(at.contact);
    has_happened = J.dot(total_.v) >= -kDrift * J.cwiseAbs().dot(total_.v.cwiseAbs());
    return ok;
  };
  const auto leave = [&] {
    const std::vector<int> sides = signs_at(total_.q, total_.v);
    for (const std::size_t k : sliding) signs_[k] = sides[k];
  };
  const double H = length / steps;
  const auto whole = static_cast<int>(std::floor(at.t / H));
  if (whole > 0 && !go(H * whole, whole)) return false;
  if (at.t > H * whole && !go(at.t - H * whole, 1)) return false;
  leave();
  for (double h = kSameTime * T_; !has_happened && h < kLongestEnd * T_; h *= 10) {  // it begins the next element
    if (!go(h, 1)) return false;
  }
  leave();
  return true;
}

/// (e) Whether the first step to the side that leads away, from psi_k = 0, ends on the wrong side.
bool RegionRun::comes_back(const RegionExit& exit) {
  const int k = exit.function;
  if (exit.inside > 0 || exit.outside <= 0 || total_.t != last_crossing_ || signs_[k] == 0) return false;
  if (k == left_ && total_.t == left_at_) return true;
  return crossings_ > 2 && k != problem_.info().until && !problem_.info().switches[k].is_of_time &&
         can_slide(problem_, regions_, signs_, k, modes_, why_not_) &&
         leaves_slowly(regions_, signs_, k, total_.q, total_.v);
}

/// (e) One step more, and then to the side that leads away. @returns false if the run has failed
bool RegionRun::slide_on(const RegionExit& exit) {
  signs_[exit.function] = 0;
  Solution piece = run(exit.outside, 1, false);
  if (const ActingContact at = acting_contact(regions_.at(signs_), piece); at.contact >= 0)
    return go_to_event(at, exit.outside, 1);
  const bool ok = piece.succeeded();
  take(std::move(piece));
  return ok && change(exit.function, side_of_exit(regions_, signs_, exit.function, total_.q, total_.v));
}

/// (a) From the begin of the step that leaves the region. @returns false if the run has failed
bool RegionRun::locate(const RegionExit& exit) {
  const int k = exit.function;
  if (comes_back(exit)) return slide_on(exit);
  const Problem& here = regions_.at(signs_);
  const int n_s = static_cast<int>(signs_.size());
  Vector psi(n_s);
  const auto psi_at = [&](const Vector& q, const Vector& v) {
    here.switching(q.data(), v.data(), psi.data());
    return here.info().region[k] * psi[k];
  };
  if (exit.inside == exit.outside) {  // (c)
    if (!piece_variables_.empty())
      return stop(
          Status::inner_solver_failed,
          fmt::format("at t = {:.12g} s: an impact changes the branch of a formula; derivatives through that are not "
                      "available",
                      total_.t + exit.inside));
    bool ok = true;
    const auto go = [&](double length) {
      Solution piece = run(length, 1, false);
      ok = piece.succeeded();
      take(std::move(piece));
    };
    if (exit.inside > 0) go(exit.inside);
    if (k == problem_.info().until) {  // the impact begins the next element
      for (double h = kSameTime * T_; ok && psi_at(total_.q, total_.v) > 0 && h < kLongestEnd * T_; h *= 10) go(h);
    }
    return ok && cross(k, true);
  }
  const double zero = kZero * here.switching_sizes(total_.q, total_.v)[k];
  RegionExit bracket = exit;
  if (exit.inside == 0) {
    bracket.psi_inside = std::max(0.0, psi_at(total_.q, total_.v));
    const double way = std::abs(exit.psi_outside) / exit.outside * kShortest * (total_.t + T_);  // of psi in no time
    if (bracket.psi_inside <= std::max(zero, way)) return cross(k);
  }
  BorderPiece found = search_border(
      bracket, zero, kShortest * (total_.t + T_), [&](double h) { return run(h, 1, false); },
      [&](const Solution& piece) { return psi_at(piece.q, piece.v); });
  Solution& best = found.solution;
  if (!best.succeeded()) {
    if (found.length <= kUnresolved * (total_.t + T_)) return cross(k);  // the border is here
    take(std::move(best));
    return false;
  }
  // A function that has changed its sign before is the one to cross first.
  here.switching(total_.q.data(), total_.v.data(), psi.data());
  const Vector at_start = psi;
  here.switching(best.q.data(), best.v.data(), psi.data());
  const Vector size = here.switching_sizes(best.q, best.v);
  for (int j = 0; j < n_s; ++j) {
    if (j == k || here.info().region[j] * psi[j] >= -kOutside * size[j]) continue;
    return locate({.function = j,
                   .inside = 0,
                   .outside = found.length,
                   .psi_inside = here.info().region[j] * at_start[j],
                   .psi_outside = here.info().region[j] * psi[j]});
  }
  take(std::move(best));
  return cross(k);
}

/// The variables of the pieces, and S at the start.
void RegionRun::begin_sensitivities() {
  const ProblemInfo& info = problem_.info();
  const int n = info.n_mechanical();
  const auto n_theta = std::ssize(settings_.sensitivities), n_p = std::ssize(info.parameters);
  Matrix C(2 * info.n_q + 2 * info.n_c() + 1, n_p);
  problem_.parameter_derivative_of_constants(C.data());
  S_.setZero(2 * info.n_q, n_theta);
  of_start_ = S_;
  for (const char* of : {"q0", "v0"}) {
    for (int k = 0; k < n; ++k) piece_variables_.push_back(fmt::format("{}:{}", of, k));
  }
  std::vector<Eigen::Index> columns;  // of varied parameters
  for (Eigen::Index j = 0; j < n_theta; ++j) {
    const Eigen::Index variable = find_variable(info, settings_.sensitivities[j]);
    if (variable < 2 * n) {
      S_(variable < n ? variable : info.n_q + variable - n, j) = 1;
      continue;
    }
    const Eigen::Index p = variable - 2 * n;
    if (C(C.rows() - 1, p) != 0)
      throw InputError("sensitivities", settings_.sensitivities[j],
                       "the end time must not depend on it where formulas have abs, sign, min, max or if");
    S_.col(j) = of_start_.col(j) = C.col(p).head(2 * info.n_q);
    piece_variables_.push_back(settings_.sensitivities[j]);
    columns.push_back(j);
  }
  of_parameters_.setZero(std::ssize(columns), n_theta);
  for (std::size_t row = 0; row < columns.size(); ++row)
    of_parameters_(static_cast<Eigen::Index>(row), columns[row]) = 1;
}

/// S at the end of a piece, and the derivatives of its events.
void RegionRun::chain(Solution& piece) {
  if (piece_variables_.empty() || piece.dq.size() == 0) return;
  const Eigen::Index n_q = problem_.n_q(), n = problem_.info().n_mechanical();
  Matrix start(2 * n + of_parameters_.rows(), S_.cols());
  // The derivatives of a piece by parameters contain those of the stated initial state, which is not its start.
  const Matrix of_state = S_ - of_start_;
  start << of_state.topRows(n), of_state.middleRows(n_q, n), of_parameters_;
  for (Event& event : piece.events) {
    if (event.dt.size() > 0) event.dt = start.transpose() * Vector(event.dt);
  }
  S_.topRows(n_q) = piece.dq * start;
  S_.bottomRows(n_q) = piece.dv * start;
}

/// d tau of (2). @param a  accelerations of the region `here`, before the border
Eigen::RowVectorXd RegionRun::border_variation(int k, const Problem& here, const Vector& a) const {
  const Eigen::Index n_q = total_.q.size(), n_p = std::ssize(problem_.info().parameters);
  Matrix D(std::ssize(signs_), 2 * n_q + n_p);
  here.switching_derivative(total_.q.data(), total_.v.data(), D.data());
  Eigen::RowVectorXd change = D.row(k).head(2 * n_q) * S_;
  for (Eigen::Index j = 0; j < S_.cols(); ++j) {
    const Eigen::Index variable = find_variable(problem_.info(), settings_.sensitivities[j]);
    const Eigen::Index p = variable - 2 * problem_.info().n_mechanical();
    if (p >= 0) change[j] += D(k, 2 * n_q + p);
  }
  const double rate = D.row(k).head(n_q).dot(total_.v) + D.row(k).segment(n_q, n_q).dot(a);
  return -change / rate;
}

/// (2)
bool RegionRun::vary_border(int k, const Problem& before, const Problem& after) {
  if (piece_variables_.empty()) return true;
  const Vector a = before.free_acceleration(total_.q, total_.v), jump = a - after.free_acceleration(total_.q, total_.v);
  if (jump.norm() <= kSmooth * a.norm()) return true;
  if (std::ranges::any_of(modes_, is_closed))
    return stop(
        Status::inner_solver_failed,
        fmt::format("at t = {:.12g} s: a force jumps while contacts are closed; derivatives through that are not "
                    "available",
                    total_.t));
  S_.bottomRows(total_.q.size()) += jump * border_variation(k, before, a);
  return true;
}

/// (d), (3)
bool RegionRun::end_at_until() {
  has_ended_ = true;
  if (piece_variables_.empty()) return true;
  if (std::ranges::any_of(modes_, is_closed))
    return stop(
        Status::inner_solver_failed,
        fmt::format("at t = {:.12g} s: the run ends where {} = 0 while contacts are closed; derivatives of that "
                    "are not available",
                    total_.t, problem_.info().switches[problem_.info().until].formula));
  const Problem& here = regions_.at(signs_);
  const Vector a = here.free_acceleration(total_.q, total_.v);
  const Eigen::RowVectorXd d_tau = border_variation(problem_.info().until, here, a);
  S_.topRows(total_.q.size()) += total_.v * d_tau;
  S_.bottomRows(total_.q.size()) += a * d_tau;
  return true;
}

/// (c) The sign of psi_k changes, and that of others whose formula changes with it.
/// @param by_impact  v jumps next, and with it psi_k @returns false if the run ends
bool RegionRun::cross(int k, bool by_impact) {
  if (k == problem_.info().until && total_.t > kSameTime * T_) return end_at_until();
  const bool is_same = last_crossing_ >= 0 && total_.t - last_crossing_ <= kSameTime * T_;
  crossings_ = is_same ? crossings_ + 1 : 1;
  last_crossing_ = total_.t;
  const int n_s = static_cast<int>(signs_.size());
  if (crossings_ > 2 * n_s + 4)
    return stop(
        Status::infeasible,
        fmt::format("at t = {:.12g} s: the motion slides on {} = 0, where a formula jumps: both of its sides lead "
                    "back there{}",
                    total_.t, problem_.info().switches[k].formula, why_not_.empty() ? "" : ". " + why_not_));
  if (signs_[k] == 0) return change(k, side_of_exit(regions_, signs_, k, total_.q, total_.v));
  return change(k, !by_impact && slides(k) ? 0 : -signs_[k]);
}

/// (e)
bool RegionRun::slides(int k) {
  return ricochet::slides(problem_, regions_, signs_, k, total_.q, total_.v, modes_, why_not_);
}

/// (e) Functions that are zero at the start.
void RegionRun::slide_at_start() {
  const ProblemInfo& info = problem_.info();
  Vector psi(std::ssize(signs_));
  problem_.switching(total_.q.data(), total_.v.data(), psi.data());
  const Vector size = problem_.switching_sizes(total_.q, total_.v);
  for (int k = 0; k < psi.size(); ++k) {
    if (info.switches[k].is_of_time || k == info.until || std::abs(psi[k]) > kRoundedZero * size[k]) continue;
    if (slides(k)) signs_[k] = 0;
  }
}

/// (c), (2) sigma_k becomes `sign`. @returns false if the run ends
bool RegionRun::change(int k, int sign) {
  const Problem& before = regions_.at(signs_);
  hold_on_borders(regions_, signs_, total_.q, total_.v);
  if (signs_[k] == 0) {
    left_ = k;
    left_at_ = total_.t;
  }
  signs_[k] = sign;
  const Problem& next = regions_.at(signs_);
  if (!vary_border(k, before, next)) return false;
  hold_on_borders(regions_, signs_, total_.q, total_.v);
  const std::string jump = jumped_gap(next, total_.q, problem_.info().switches[k]);
  if (!jump.empty()) return stop(Status::infeasible, fmt::format("at t = {:.12g} s: {}", total_.t, jump));
  return true;
}

Solution RegionRun::solve(const Settings& settings) {
  settings_ = settings;
  settings_.recording = std::max(settings.recording, Recording::events);  // which modes change at a border
  begin();
  if (const std::string why = ambiguous_start(problem_, regions_, signs_); !why.empty()) {
    stop(Status::infeasible, why);
    return std::move(total_);
  }
  slide_at_start();
  if (!settings.sensitivities.empty()) begin_sensitivities();
  const TimeLimit limit(settings.time_limit);
  const int n = settings.steps;
  double switch_time = next_time_switch();
  while (total_.t < T_) {
    if (settings.time_limit > 0) settings_.time_limit = std::max(1e-3, limit.left());
    double until = switch_time;
    int steps = 1;
    if (!is_adaptive_) steps = piece_on_grid(total_.t, T_, n, until);  // up to the switch, or to the next grid point
    const double begin_of_piece = total_.t;
    const bool is_at_switch = switch_time < T_ && switch_time - total_.t <= kSameTime * T_;  // of the grid
    if (!is_at_switch) {
      Solution piece = run(until - total_.t, steps, true);
      if (const ActingContact at = acting_contact(regions_.at(signs_), piece); at.contact >= 0) {
        if (!go_to_event(at, until - total_.t, steps)) break;
        continue;
      }
      const RegionExit exit = piece.exit;
      const bool ok = piece.succeeded();
      take(std::move(piece));
      if (!ok || has_ended_) break;
      if (exit.function >= 0) {
        if (!locate(exit) || has_ended_) break;
        continue;
      }
    }
    total_.t = is_at_switch ? std::max(total_.t, switch_time) : until;
    if (!is_at_switch && total_.t < begin_of_piece + kShortest * T_ && total_.t < T_) {
      stop(Status::inner_solver_failed, fmt::format("at t = {:.12g} s: the time stands still", total_.t));
      break;
    }
    if (total_.t >= switch_time && switch_time < T_) {  // (b)
      const std::vector<int> next = signs_of_time();
      bool goes_on = true;
      for (std::size_t k = 0; k < signs_.size() && goes_on; ++k) {
        if (signs_[k] == next[k]) continue;
        goes_on = static_cast<int>(k) == problem_.info().until ? end_at_until() : change(static_cast<int>(k), next[k]);
      }
      if (!goes_on || has_ended_) break;
      switch_time = next_time_switch();
    }
  }
  if (!piece_variables_.empty()) {
    total_.dq = S_.topRows(total_.q.size());
    total_.dv = S_.bottomRows(total_.q.size());
  }
  return std::move(total_);
}

}  // namespace ricochet
