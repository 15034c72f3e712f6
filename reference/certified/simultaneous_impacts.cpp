#include <algorithm>

#include "reference/certified/boxes.h"
#include "reference/certified/hybrid_motion.h"

// Impacts whose times cannot be told apart, of contacts that exchange no momentum. All of them happen within a window
// t_1 <= t <= t_1 + w. For all times of the window, whatever the order of the impacts:
//
//     q in Q = q(t_1) + [0, w] V,    V = hull(V-, V+)
//     V- = v(t_1) + [0, w] A-,    V+ = impact(Q, V-) + [0, w] A+                                                   (1)
//     A- = a(Q, V), A+ = a(Q, V) with the modes before and after
//
// where V+ = V- for coordinates that no impact changes. If the right-hand sides lie within Q, V- and V+, these boxes
// contain the motion. Contact i hits within the window if gap(t_1) + w v_n(Q, V-) < 0 and v_n(Q, V-) < 0. With
// restitution it is open before and after, and hits no second time if v_n(Q, V+) > 0. Without restitution it closes:
// its mode is decided for all states (Q, impact(Q, V-)), and its event functions are positive for all states (Q, V+).
// Such a contact moves independently of the others that hit, see independent_parts(), so that neither its mode nor its
// event functions depend on their order.

namespace ricochet::reference::certified {

/// Boxes of (1).
struct HybridMotion::Window {
  std::vector<int> hit;                ///< contacts
  std::vector<int> group;              ///< label of their momentum
  std::vector<int> of_coordinate;      ///< labels
  std::vector<Ball> start;             ///< q(t_1), v(t_1)
  Ball time, w, duration;              ///< ball of [t_1, t_1 + w]; w; ball of [0, w]
  std::vector<Ball> Q, before, after;  ///< Q, V-, V+
  std::vector<Ball> Lambda_n;          ///< of all contacts
  std::vector<Mode> modes;             ///< of all contacts, after the impacts
  ModeMotion motion;                   ///< in these modes
};

namespace {

std::vector<Ball> joined(const std::vector<Ball>& q, const std::vector<Ball>& v) {
  std::vector<Ball> x = q;
  x.insert(x.end(), v.begin(), v.end());
  return x;
}

}  // namespace

bool HybridMotion::are_decoupled_impacts(const Step& step) const {
  std::vector<int> hit;
  bool some_close = false;
  for (const std::size_t k : step.reached) {
    const EventFunction& event = motion_.events[k];
    if (event.kind != EventKind::impact) return false;
    const Ball& eps_r = scene_.contacts[event.contact].eps_r;
    if (!eps_r.is_zero() && eps_r.sign() != Sign::positive) return false;
    some_close = some_close || eps_r.is_zero();
    hit.push_back(event.contact);
  }
  const std::vector<int> all = with_closed(hit, states_.modes);
  const std::vector<int> labels = momentum_groups(scene_, all, p_).of_contact;
  for (std::size_t k = 0; k < hit.size(); ++k) {
    if (std::ranges::count(labels, labels[k]) > 1) return false;
  }
  if (!some_close) return true;
  const auto parts = independent_parts(scene_, all, p_);
  return std::ranges::all_of(parts, [&](const std::vector<int>& part) {
    const auto is_hit = [&](int i) { return std::ranges::count(hit, i) > 0; };
    return part.size() == 1 || std::ranges::none_of(part, is_hit);
  });
}

/// Moves the set to t_1 and begins the boxes with their values there.
HybridMotion::Window HybridMotion::window_of(const Step& step) {
  const Precision& a = p_.precision();
  Window window;
  for (const std::size_t k : step.reached) window.hit.push_back(motion_.events[k].contact);
  const MomentumGroups groups = momentum_groups(scene_, with_closed(window.hit, states_.modes), p_);
  window.of_coordinate = groups.of_coordinate;
  window.group.assign(groups.of_contact.begin(), groups.of_contact.begin() + std::ssize(window.hit));

  Step to_begin = step;
  arb_get_lbound_arf(arb_midref(to_begin.end.get()), step.end.get(), a.bits);
  mag_zero(arb_radref(to_begin.end.get()));
  constexpr double kWindow = 8;  // in widths of the roots: impacts move each other's times by less
  Magnitude width;
  mag_set_d(width.get(), step.h);
  mag_mul_2exp_si(width.get(), width.get(), -a.bits);
  Magnitude roots;
  mag_set_d(roots.get(), kWindow * 2 * step.h);
  mag_addmul(width.get(), roots.get(), arb_radref(step.end.get()));
  arf_set_mag(arb_midref(window.w.get()), width.get());
  window.duration = a.hull(Ball(), window.w);
  advance(to_begin);
  window.time = a.add(t_, window.duration);
  window.start = set_.box();
  window.Q.assign(window.start.begin(), window.start.begin() + scene_.n);
  window.before.assign(window.start.begin() + scene_.n, window.start.end());
  window.after = window.before;
  window.modes = states_.modes;
  return window;
}

/// Mode of contact `i` after an impact, for all states `x` right after it.
Mode HybridMotion::mode_after_impact(const std::vector<Ball>& x, const Ball& t, int i, Mode impact) {
  const ContactFormulas& contact = scene_.contacts[i];
  if (impact == Mode::open) throw Undecided("an impact without impulse of " + contact.name);
  if (!contact.eps_r.is_zero()) return Mode::open;
  ContactStates next = states_;
  std::vector<int> slip_sign(scene_.n_c(), 0);
  slip_sign[i] = slip_sign_of(impact);
  decisions_.decide_modes(x, t, {i}, slip_sign, next);
  const Mode mode = next.modes[i];
  if (mode == Mode::open || slip_sign_of(mode) != slip_sign[i])
    throw Unsupported("simultaneous impacts: after that of " + contact.name + " it opens, or slip begins");
  return mode;
}

/// The right-hand sides of (1).
void HybridMotion::map_window(Window& window) {
  const Precision& a = p_.precision();
  const int n = scene_.n;
  window.Lambda_n.assign(scene_.n_c(), Ball());
  std::vector<Ball> after = window.before, hull(n);
  for (std::size_t k = 0; k < window.hit.size(); ++k) {
    const int i = window.hit[k];
    const auto outcome =
        decisions_.decide_impact(joined(window.Q, window.before), window.time, {i}, std::vector<char>(scene_.n_c(), 0));
    window.Lambda_n[i] = outcome.Lambda_n[i];
    for (int r = 0; r < n; ++r) {
      if (window.of_coordinate[r] == window.group[k]) after[r] = outcome.velocity[r];
    }
    window.modes[i] = mode_after_impact(joined(window.Q, outcome.velocity), window.time, i, outcome.modes[0]);
  }
  for (int r = 0; r < n; ++r) hull[r] = a.hull(a.hull(window.before[r], after[r]), window.after[r]);
  taylor_.load(joined(window.Q, hull), window.time);
  window.motion = mode_motion(scene_, window.modes, p_);
  for (const EventFunction& event : motion_.events) {
    const bool is_hit = event.kind == EventKind::impact && std::ranges::count(window.hit, event.contact) > 0;
    if (!is_hit && p_.value_of(event.node).sign() != Sign::positive)
      throw Undecided(name_of_event(event) + " within a window of simultaneous impacts");
  }
  for (int r = 0; r < n; ++r) {
    const auto change = [&](const ModeMotion& motion) {
      return a.mul(window.duration, p_.value_of(motion.acceleration[r]));
    };
    const bool is_struck = std::ranges::count(window.group, window.of_coordinate[r]) > 0;
    window.Q[r] = a.add(window.start[r], a.mul(window.duration, hull[r]));
    window.before[r] = a.add(window.start[n + r], change(motion_));
    window.after[r] = is_struck ? a.add(after[r], change(window.motion)) : window.before[r];
  }
}

void HybridMotion::require_impacts(const Window& window) {
  const Precision& a = p_.precision();
  for (const int i : window.hit) {
    const ContactFormulas& contact = scene_.contacts[i];
    taylor_.load(window.start, t_);
    const Ball gap = p_.value_of(contact.gap);
    taylor_.load(joined(window.Q, window.before), window.time);
    const Ball v_n = p_.value_of(contact.v_n);
    const bool hits = v_n.sign() == Sign::negative && a.add(gap, a.mul(window.w, v_n)).sign() == Sign::negative;
    taylor_.load(joined(window.Q, window.after), window.time);
    bool is_certain = hits && (window.modes[i] != Mode::open || p_.value_of(contact.v_n).sign() == Sign::positive);
    for (const EventFunction& event : window.motion.events) {
      if (event.contact == i && window.modes[i] != Mode::open)
        is_certain = is_certain && p_.value_of(event.node).sign() == Sign::positive;
    }
    if (!is_certain) throw Undecided("simultaneous impacts: that of " + contact.name + " is not proven to happen once");
  }
}

void HybridMotion::handle_decoupled_impacts(const Step& step) {
  refuse_sensitivities("simultaneous impacts");
  Window window = window_of(step);
  map_window(window);
  map_window(window);  // with V+ in the hull
  bool is_inside = false;
  for (int k = 0; k < kMostInflations && !is_inside; ++k) {
    for (auto* box : {&window.Q, &window.before, &window.after}) inflate(*box, p_.precision().bits);
    const Window candidate = window;
    map_window(window);
    is_inside = contains(candidate.Q, window.Q) && contains(candidate.before, window.before) &&
                contains(candidate.after, window.after);
  }
  if (!is_inside) throw Undecided("simultaneous impacts: no enclosure of the motion within their time ball");
  require_impacts(window);
  set_.set_box(joined(window.Q, window.after));
  const Ball begin = t_;
  t_ = window.time;
  states_.modes = window.modes;
  for (const int i : window.hit) {
    std::vector<Ball> impulses(scene_.n_c());
    impulses[i] = window.Lambda_n[i];
    states_.vanishing_gap[i] = window.modes[i] == Mode::open ? 1 : 0;
    states_.gap_is_bounded_only[i] = window.modes[i] == Mode::open;
    record("impact", scene_.contacts[i].name, impulses);
  }
  t_ = p_.precision().add(begin, window.w);
  begin_motion();
}

}  // namespace ricochet::reference::certified
