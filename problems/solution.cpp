#include "problems/solution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace ricochet {

namespace {

constexpr double kRisen = 1e-9;  // [m], [m/s], of a body of 1 kg: far above the rounding of z = 0 and z' = 0
// Of a lever, relative to 1 + |q| and 1 + |v| of the bodies, in time stepping: contact solvers stop at 1e-9, and an
// impulse that one contact has alone turns it at the speed of the bodies.
constexpr double kTurned = 1e-6;

/// The friction element whose lever has turned at (q, v); empty: none.
std::string turned_lever(const ProblemInfo& info, const Vector& q, const Vector& v, double most) {
  const int n = info.n_mechanical(), first = info.n_c() - info.n_friction_elements;
  const double q_size = 1 + q.head(n).cwiseAbs().maxCoeff(), v_size = 1 + v.head(n).cwiseAbs().maxCoeff();
  for (int k = 0; k < info.n_friction_elements; ++k) {
    const ContactInfo& contact = info.contacts[static_cast<std::size_t>(first + k)];
    if (contact.is_friction_element) break;  // levers come first
    if (!(std::abs(q[n + k]) <= most * q_size && std::abs(v[n + k]) <= most * v_size)) return contact.name;
  }
  return {};
}

}  // namespace

void fail_where_bound_is_negative(const Problem& problem, double h, Solution& solution) {
  const ProblemInfo& info = problem.info();
  if (info.n_friction_elements == 0 || !solution.succeeded()) return;
  const int first = info.n_c() - info.n_friction_elements;
  const auto z_of = [&](int contact) { return info.n_mechanical() + contact - first; };
  const auto bound = [&](int contact, const Vector& q, const Vector& v) {
    return std::abs(problem.force(q, v)[z_of(contact)]);
  };
  const auto fail = [&](int contact, const char* when, double t) {
    const std::string& name = info.contacts[static_cast<std::size_t>(contact)].name;
    solution.status = Status::infeasible;
    solution.message = fmt::format(
        "the bound of friction element '{}' becomes negative {} t = {:.6g} s; a bound >= 0 is "
        "required",
        name, when, t);
    solution.reason.contacts = {name};
  };
  const auto has_turned = [&](const Vector& q, const Vector& v, double t) {
    const std::string name = turned_lever(info, q, v, h > 0 ? kTurned : kRisen);
    if (name.empty()) return false;
    solution.status = Status::inner_solver_failed;
    solution.message = fmt::format(
        "the bound of friction element '{}' is not the force of its contact before t = {:.6g} s: contacts that close "
        "together were taken one by one",
        name, t);
    solution.reason.contacts = {name};
    return true;
  };
  constexpr double kSteps = 4;
  for (const Event& event : solution.events) {
    if (has_turned(event.q, event.v_plus, event.t)) return;
    const int i = event.contact;
    if (i < first || !info.contacts[static_cast<std::size_t>(i)].is_friction_element) continue;
    if (event.kind == EventKind::detach) return fail(i, "at", event.t);
    if (event.kind != EventKind::impact) continue;
    const double speed = std::max(kRisen, kSteps * h * bound(i, event.q, event.v_minus));
    if (event.v_minus[z_of(i)] < -speed) return fail(i, "before", event.t);
  }
  if (has_turned(solution.q, solution.v, solution.t)) return;
  for (int i = first; i < info.n_c(); ++i) {
    if (!info.contacts[static_cast<std::size_t>(i)].is_friction_element) continue;
    const double height = std::max(kRisen, kSteps * h * h * bound(i, solution.q, solution.v));
    if (solution.q[z_of(i)] > height) return fail(i, "before", solution.t);
  }
}

void fail_where_friction_is_not_positive(const Problem& problem, Solution& solution) {
  constexpr double kVanishing = 1e-3;
  const ProblemInfo& info = problem.info();
  if (std::ranges::none_of(info.contacts, &ContactInfo::mu_varies)) return;
  const Vector start = problem.friction_coefficients(info.q0);
  const auto check = [&](double t, const Vector& q) {
    const Vector mu = problem.friction_coefficients(q);
    for (int i = 0; i < info.n_c(); ++i) {
      const ContactInfo& contact = info.contacts[static_cast<std::size_t>(i)];
      const double least = solution.succeeded() ? 0 : kVanishing * start[i];
      if (!contact.mu_varies || !q.allFinite() || mu[i] > least) continue;
      solution.message += fmt::format("{}mu of contact '{}' is {:.3g} at t = {:.6g} s; a positive value is required",
                                      solution.message.empty() ? "" : "; ", contact.name, mu[i], t);
      solution.status = Status::infeasible;
      solution.reason.contacts = {contact.name};
      return true;
    }
    return false;
  };
  for (const Event& event : solution.events) {
    if (check(event.t, event.q)) return;
  }
  for (const Sample& sample : solution.samples) {
    if (check(sample.t, sample.q)) return;
  }
  check(solution.t, solution.q);
}

const char* to_string(Status status) {
  switch (status) {
    case Status::success:
      return "success";
    case Status::infeasible:
      return "infeasible";
    case Status::inner_solver_failed:
      return "inner_solver_failed";
    case Status::step_limit:
      return "step_limit";
    case Status::time_limit:
      return "time_limit";
    case Status::non_finite:
      return "non_finite";
  }
  return "unknown";
}

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::impact:
      return "impact";
    case EventKind::detach:
      return "detach";
    case EventKind::slip_to_stick:
      return "slip_to_stick";
    case EventKind::stick_to_slip:
      return "stick_to_slip";
    case EventKind::slip_reversal:
      return "slip_reversal";
    case EventKind::facet_change:
      return "facet_change";
  }
  return "unknown";
}

std::optional<EventKind> event_kind(ContactMode before, ContactMode after, bool has_impulse, bool slip_ended) {
  if (!is_closed(before)) return has_impulse ? std::optional(EventKind::impact) : std::nullopt;
  if (!is_closed(after)) return EventKind::detach;
  if (is_slipping(before) && is_slipping(after) && (before != after || slip_ended)) return EventKind::slip_reversal;
  if (before == after) return std::nullopt;
  return after == ContactMode::stick ? EventKind::slip_to_stick : EventKind::stick_to_slip;
}

const char* to_string(ContactMode mode) {
  switch (mode) {
    case ContactMode::open:
      return "open";
    case ContactMode::closed:
      return "closed";
    case ContactMode::stick:
      return "stick";
    case ContactMode::slip_positive:
      return "slip+";
    case ContactMode::slip_negative:
      return "slip-";
    case ContactMode::slip:
      return "slip";
    case ContactMode::vertex_slip:
      return "vertex slip";
    case ContactMode::edge_slip:
      return "edge slip";
  }
  return "unknown";
}

double Solution::captured_height() const {
  double sum = 0;
  for (const auto& capture : captures) sum += capture.height;
  return sum;
}

double Solution::captured_speed() const {
  double sum = 0;
  for (const auto& capture : captures) sum += capture.speed;
  return sum;
}

void Solution::cut_groups(double t_end) {
  std::erase_if(captures, [&](const CapturedGroup& capture) { return capture.t > t_end; });
  std::erase_if(wedges, [&](const OpenWedge& wedge) { return wedge.t > t_end; });
}

double Solution::max_residual() const {
  double largest = -1;
  for (const auto& residual : residuals) largest = std::max(largest, residual.value);
  return largest;
}

}  // namespace ricochet
