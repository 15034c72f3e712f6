#include "problems/regions/static_friction.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/regions/region_problems.h"
#include "problems/run_pieces.h"

namespace ricochet {
namespace {

constexpr double kSameTime = 1e-12;   // of the end time
constexpr double kZeroGap = 1e-9;     // of the terms of a gap and of its rate: closed at the start
constexpr double kZeroSpeed = 1e-11;  // of the terms of a slip velocity: zero, as after an impact that ends slip
constexpr double kDependent = 1e-9;   // of a direction: what is left of it beside the others
constexpr double kShortest = 1e-15;   // of the end time: what time can resolve
constexpr int kMostChanges = 20;      // at one time, and four for each contact

}  // namespace

StaticFrictionRun::StaticFrictionRun(const Problem& problem, RunPiece run_piece)
    : problem_(problem), run_piece_(std::move(run_piece)) {}

StaticFrictionRun::~StaticFrictionRun() {
  const std::lock_guard lock(formulas_mutex());
  made_.clear();
}

Problem& StaticFrictionRun::at(const Sticks& sticks) {
  auto& problem = made_[sticks];
  if (!problem) {
    const std::lock_guard lock(formulas_mutex());
    problem = problem_.in_friction_state(sticks);
  }
  return *problem;
}

bool StaticFrictionRun::stands_still(int i, const Vector& q, const Vector& v) const {
  const Vector J_t = problem_.tangent_jacobian(q).col(problem_.info().contacts[i].tangent_index);
  return std::abs(J_t.dot(v)) <= kZeroSpeed * J_t.cwiseAbs().dot((1 + v.array().abs()).matrix());
}

bool StaticFrictionRun::is_closed_at(int i, const Vector& q, const Vector& v) const {
  const Vector J_n = problem_.normal_jacobian(q).col(i);
  return std::abs(problem_.gap(q)[i]) <= kZeroGap * J_n.cwiseAbs().dot((1 + q.array().abs()).matrix()) &&
         std::abs(J_n.dot(v)) <= kZeroGap * J_n.cwiseAbs().dot((1 + v.array().abs()).matrix());
}

/// A contact with mu_static that sticks, and whose forces are not unique: columns (J_n, J_t) of contact i depend on those
/// of the other closed contacts. -1 if there is none.
int StaticFrictionRun::undetermined_contact() const {
  if (std::ranges::count(sticks_, 1) == 0) return -1;
  const ProblemInfo& info = problem_.info();
  const Vector &q = total_.q, &v = total_.v;
  const Matrix J_n = problem_.force_directions(problem_.normal_jacobian(q)),
               slip = problem_.tangent_jacobian(q).transpose() * v,
               J_t = problem_.force_directions(problem_.tangent_jacobian(q));
  const auto n_closed_directions = [&](int without) {
    Matrix J(q.size(), 0);
    const auto add = [&](const Vector& direction) {
      J.conservativeResize(Eigen::NoChange, J.cols() + 1);
      J.rightCols(1) = direction.normalized();
    };
    for (int i = 0; i < info.n_c(); ++i) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(i)];
      if (i == without || (!contact.is_bilateral && !is_closed_at(i, q, v))) continue;
      add(J_n.col(i));
      const bool sticks = sticks_[static_cast<std::size_t>(i)] != 0 ||
                          (contact.mu_static == 0 &&
                           slip.middleRows(contact.tangent_index, contact.n_t).norm() <= kZeroSpeed * (1 + v.norm()));
      for (int d = 0; d < contact.n_t && sticks; ++d) add(J_t.col(contact.tangent_index + d));
    }
    if (J.cols() == 0) return Eigen::Index{0};
    Eigen::ColPivHouseholderQR<Matrix> qr(J);
    qr.setThreshold(kDependent);
    return qr.rank();
  };
  const Eigen::Index all = n_closed_directions(-1);
  for (int i = 0; i < info.n_c(); ++i) {
    if (sticks_[static_cast<std::size_t>(i)] != 0 && all != n_closed_directions(i) + 2) return i;
  }
  return -1;
}

/// Whether an event ends the slip of contact i, which may begin again.
bool StaticFrictionRun::comes_to_rest(int i, const Event& event) const {
  if (event.kind == EventKind::impact || event.v_minus != event.v_plus) return stands_still(i, event.q, event.v_plus);
  return event.contact == i && event.kind == EventKind::slip_reversal;
}

/// (d)
void StaticFrictionRun::take_coefficients_at_rest(const Vector& q, const Vector& v) {
  for (int i = 0; i < problem_.n_c(); ++i) {
    sticks_[static_cast<std::size_t>(i)] =
        problem_.info().contacts[i].mu_static != 0 && is_closed_at(i, q, v) && stands_still(i, q, v) ? 1 : 0;
  }
}

std::optional<StaticFrictionRun::Change> StaticFrictionRun::change_at_start(const Solution& piece) const {
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (problem_.info().contacts[i].mu_static != 0 && !fits(i, piece.initial_modes[static_cast<std::size_t>(i)]))
      return Change{.kind = Change::Kind::at_start, .contact = i};
  }
  return std::nullopt;
}

/// Whether event k of the piece ends it.
std::optional<StaticFrictionRun::Change> StaticFrictionRun::change_at(const Solution& piece, std::size_t k) const {
  const Event& event = piece.events[k];
  const bool is_impact = event.kind == EventKind::impact;
  for (int i = 0; i < problem_.n_c(); ++i) {
    const ContactInfo& contact = problem_.info().contacts[i];
    if (contact.mu_static == 0) continue;
    const bool sticks = sticks_[static_cast<std::size_t>(i)] != 0;
    const ContactMode mode = event.modes[static_cast<std::size_t>(i)];
    if (is_impact && sticks && (event.Lambda_n[i] != 0 || event.Lambda_t[contact.tangent_index] != 0))
      return Change{.kind = Change::Kind::before_impact, .contact = i, .event = k};
    const bool stops = is_slipping(mode) && comes_to_rest(i, event);
    const bool has_stuck = event.contact == i && event.kind == EventKind::stick_to_slip;
    if (!fits(i, mode) || (!sticks && (stops || has_stuck)))
      return Change{.kind = Change::Kind::at_event, .contact = i, .event = k};
  }
  return std::nullopt;
}

/// @param from  the first event that has not been looked at
std::optional<StaticFrictionRun::Change> StaticFrictionRun::first_change(const Solution& piece,
                                                                         std::size_t from) const {
  if (piece.initial_modes.empty()) return std::nullopt;
  bool begins_with_impact = false;
  for (const Event& event : piece.events) {
    if (begins_with_impact || event.t > kSameTime * problem_.info().end_time) break;
    begins_with_impact = event.kind == EventKind::impact;
  }
  if (!begins_with_impact) {
    if (expects_impact_) return Change{.kind = Change::Kind::no_impact, .contact = 0};
    if (const auto change = change_at_start(piece)) return change;
  }
  for (std::size_t k = from; k < piece.events.size(); ++k) {
    if (const auto change = change_at(piece, k)) return change;
  }
  return std::nullopt;
}

/// (a), (b)
void StaticFrictionRun::take_coefficients(const Event& event) {
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (problem_.info().contacts[i].mu_static == 0) continue;
    char& sticks = sticks_[static_cast<std::size_t>(i)];
    const ContactMode mode = event.modes[static_cast<std::size_t>(i)];
    const bool slips_on = sticks == 0 && is_slipping(mode);
    sticks = mode == ContactMode::stick || (slips_on && comes_to_rest(i, event)) ? 1 : 0;
  }
}

/// Takes the part of the piece that has its coefficients, and those of the next piece.
void StaticFrictionRun::end_piece_at(const Change& change, Solution& piece) {
  piece.status = Status::success;
  piece.message.clear();
  piece.reason = {};
  piece.exit = {};
  expects_impact_ = change.kind == Change::Kind::before_impact;
  if (change.kind == Change::Kind::at_start || change.kind == Change::Kind::no_impact) {
    piece.t = 0;
    piece.q = total_.q;
    piece.v = total_.v;
    piece.events.clear();
    piece.samples.clear();
    piece.motion.cut(0);
    piece.cut_groups(-1);
    piece.initial_modes.clear();
    char& sticks = sticks_[static_cast<std::size_t>(change.contact)];
    if (change.kind == Change::Kind::at_start)
      sticks = sticks == 0 ? 1 : 0;
    else
      take_coefficients_at_rest(total_.q, total_.v);
    return;
  }
  const Event event = piece.events[change.event];
  const auto is_same_instant = [&](const Event& other) {
    return other.t == event.t && other.v_minus == event.v_minus && other.v_plus == event.v_plus;
  };
  const bool is_before = change.kind == Change::Kind::before_impact;
  const bool keeps_instant = event.kind == EventKind::impact && !is_before;
  auto end = piece.events.begin() + static_cast<std::ptrdiff_t>(change.event);
  if (keeps_instant)
    while (end != piece.events.end() && is_same_instant(*end)) ++end;
  else  // append() finds the changes of modes
    while (end != piece.events.begin() && is_same_instant(*std::prev(end))) --end;
  piece.events.erase(end, piece.events.end());
  std::erase_if(piece.samples,
                [&](const Sample& sample) { return is_before ? sample.t >= event.t : sample.t > event.t; });
  piece.motion.cut(event.t);
  piece.cut_groups(is_before ? std::nextafter(event.t, -1.0) : event.t);
  piece.t = event.t;
  piece.q = event.q;
  piece.v = is_before ? event.v_minus : event.v_plus;
  if (is_before && event.t == 0) piece.initial_modes.clear();
  if (is_before)
    std::ranges::fill(sticks_, 0);  // (c)
  else
    take_coefficients(event);
}

/// After a piece that ended without an event.
void StaticFrictionRun::take_coefficients_at_end() {
  modes_ = std::exchange(end_modes_, {});
  for (int i = 0; i < problem_.n_c(); ++i) {
    if (problem_.info().contacts[i].mu_static == 0) continue;
    const ContactMode mode = modes_[static_cast<std::size_t>(i)];
    sticks_[static_cast<std::size_t>(i)] =
        mode == ContactMode::stick || (is_slipping(mode) && stands_still(i, total_.q, total_.v)) ? 1 : 0;
  }
}

bool StaticFrictionRun::fail(int contact, const char* why) {
  const std::string& name = problem_.info().contacts[contact].name;
  total_.status = Status::infeasible;
  total_.message = fmt::format("at t = {:.12g} s: contact '{}' {}", total_.t, name, why);
  total_.reason.contacts = {name};
  return false;
}

/// Whether coefficients change again and again at one time: then the run ends.
bool StaticFrictionRun::is_endless(int contact) {
  const bool is_same = last_change_ >= 0 && total_.t - last_change_ <= kSameTime * problem_.info().end_time;
  changes_ = is_same ? changes_ + 1 : 1;
  last_change_ = total_.t;
  if (changes_ <= kMostChanges + 4 * problem_.n_c()) return false;
  return !fail(contact, "neither sticks with mu_static nor slips with mu; friction changes again and again");
}

Solution StaticFrictionRun::solve(int steps) {
  const ProblemInfo& info = problem_.info();
  const double T = info.end_time;
  total_ = {};
  total_.q = info.q0;
  total_.v = info.v0;
  modes_.clear();
  changes_ = 0;
  last_change_ = -1;
  expects_impact_ = false;
  sticks_.assign(info.contacts.size(), 0);
  take_coefficients_at_rest(info.q0, info.v0);
  while (total_.t < T) {
    if (T - total_.t <= kShortest * T) {  // nothing happens there
      total_.t = T;
      break;
    }
    Problem& here = at(sticks_);
    hold_closed(here, modes_, sticks_, total_.q, total_.v);
    if (const int contact = undetermined_contact(); contact >= 0) {
      fail(contact, "shares its load with others, so that friction does not tell which of them breaks loose");
      break;
    }
    double until = T;
    const int n = steps > 0 ? piece_on_grid(total_.t, T, steps, until) : 0;
    here.set_initial_state(total_.q, total_.v);
    here.set_end_time(until - total_.t);
    end_modes_.clear();
    std::size_t seen = 0;
    Solution piece = run_piece_(here, sticks_, n, [&](const Solution& so_far, std::span<const ContactMode> modes) {
      const std::size_t from = so_far.events.size() < seen ? 0 : seen;  // of a region, whose events are its own
      seen = so_far.events.size();
      if (first_change(so_far, from)) return true;
      for (int i = 0; i < std::ssize(modes); ++i) {
        if (info.contacts[i].mu_static == 0 || fits(i, modes[static_cast<std::size_t>(i)])) continue;
        end_modes_.assign(modes.begin(), modes.end());
        return true;
      }
      return false;
    });
    const std::optional<Change> change = first_change(piece);
    if (change && change->kind == Change::Kind::at_event && sticks_[static_cast<std::size_t>(change->contact)] == 0 &&
        piece.events[change->event].kind == EventKind::stick_to_slip &&
        piece.events[change->event].contact == change->contact) {
      fail(change->contact, "has stuck with mu in place of mu_static, within one step");
      break;
    }
    if (change) end_piece_at(*change, piece);
    if (total_.t > 0 && !piece.succeeded())
      piece.message =
          fmt::format("after t = {:.12g} s, where the coefficient of friction changed: {}", total_.t, piece.message);
    const bool is_whole = piece.t >= here.info().end_time - kSameTime * T;
    const bool is_at_start = total_.t == 0 && piece.t == 0;
    append(info, std::move(piece), total_, modes_);
    if (change) {
      if (is_at_start) total_.initial_modes.clear();
      if (is_endless(change->contact)) break;
      continue;
    }
    expects_impact_ = false;
    if (!total_.succeeded()) break;
    if (is_whole) {
      total_.t = until;
    } else if (end_modes_.empty()) {
      break;  // ProblemInfo::until has vanished
    }
    if (!end_modes_.empty()) take_coefficients_at_end();
  }
  total_.counters.events = std::ssize(total_.events);
  return std::move(total_);
}

}  // namespace ricochet
