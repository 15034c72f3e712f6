#include "reference/certified/sensitivities.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/variables.h"

namespace ricochet::reference::certified {

Sensitivities::Sensitivities(const Problem& problem, Reading reading, const Precision& precision, double seconds)
    : program_(precision), limit_(seconds), taylor_(scene_, program_, limit_) {
  attempt([&] { scene_ = scene_formulas(problem, reading, program_, true); });
  for (const Variable& variable : variables(problem.info())) columns_.push_back({variable.name, -1, ""});
}

/// A step that cannot be proven refuses everything that follows.
void Sensitivities::attempt(const std::function<void()>& action) {
  if (!reason_.empty()) return;
  try {
    action();
  } catch (const std::exception& error) {
    refuse(error.what());
  }
}

void Sensitivities::refuse(const std::string& reason) {
  if (reason_.empty()) reason_ = reason;
}

void Sensitivities::start(const ContactStates& states, const std::vector<Ball>& x) {
  attempt([&] {
    const std::size_t n = scene_.n, m = scene_.parameters.size();
    taylor_.load(x, Ball());
    variables_ = scene_.q;
    variables_.insert(variables_.end(), scene_.v.begin(), scene_.v.end());
    variables_.push_back(scene_.clock);
    variables_.insert(variables_.end(), scene_.parameters.begin(), scene_.parameters.end());
    change_.assign(variables_.size(), {});
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      Column& column = columns_[k];
      if (k >= 2 * n) column.parameter = scene_.parameters[k - 2 * n];
      column.reason = reason_at_start(states, static_cast<int>(k));
      if (!column.reason.empty()) continue;
      live_.push_back(column.parameter);
      for (std::size_t i = 0; i < 2 * n; ++i) {
        const Ball unit(i == k ? 1.0 : 0.0);
        change_[i].push_back(
            k < 2 * n ? unit : program_.value_of(program_.derivative(scene_.start_formulas[i], column.parameter)));
      }
      change_[2 * n].emplace_back();
      for (std::size_t j = 0; j < m; ++j) change_[2 * n + 1 + j].emplace_back(k == 2 * n + j ? 1.0 : 0.0);
    }
    phi_.assign(2 * n, std::vector<Node>(live_.size()));
    for (auto& row : phi_) std::ranges::generate(row, [&] { return program_.state(); });
  });
}

std::string Sensitivities::reason_at_start(const ContactStates& states, int variable) {
  for (int i = 0; i < scene_.n_c(); ++i) {
    const ContactFormulas& contact = scene_.contacts[i];
    const Node parameter = columns_[variable].parameter;
    const auto depends = [&](Node f) { return parameter >= 0 && !program_.is_zero(program_.derivative(f, parameter)); };
    if (contact.mu.is_zero() && depends(contact.mu_formula)) return "friction is zero: " + contact.name;
    if (contact.eps_r.is_zero() && depends(contact.eps_r_formula)) return "restitution is zero: " + contact.name;
    const bool is_open = states.modes[i] == Mode::open;
    if (is_open && states.vanishing_gap[i] == 0) continue;
    const bool rests = !is_open || states.vanishing_gap[i] > 1;
    const bool has_no_slip = states.modes[i] == Mode::stick || states.vanishing_slip[i] > 0;
    if (!scene_.stays_zero(i, variable, rests, has_no_slip)) return "it changes the contact at t = 0: " + contact.name;
  }
  return "";
}

void Sensitivities::begin(const ContactStates& states, const ModeMotion& motion, const std::vector<Ball>& x,
                          const Ball& t) {
  attempt([&] {
    if (!states.starting.empty()) throw Unsupported("slip in space begins from rest");
    if (std::ranges::count(states.sticks_at_limit, 1) > 0) throw Unsupported("friction in space is at its limit");
    taylor_.load(x, t);
    motion_ = mode_motion(scene_, states.modes, program_, {}, states.left_out);
    require_same_events(motion);
    require_kept_rows(states);
    add_rate(x, true);  // (5)
    for (Ball& dtau : change_[2 * static_cast<std::size_t>(scene_.n)]) dtau = Ball();
    variation_ = variation_of(motion_, scene_, phi_, program_, live_);
  });
}

/// A force that is zero by its formula may be one for these parameters only.
void Sensitivities::require_same_events(const ModeMotion& motion) const {
  const auto is_same = [](const EventFunction& a, const EventFunction& b) {
    return a.kind == b.kind && a.contact == b.contact && a.side == b.side && a.with == b.with;
  };
  if (!std::ranges::equal(motion.events, motion_.events, is_same))
    throw Unsupported("a force or slip velocity is zero, or the same as another, for these parameters only");
}

void Sensitivities::require_kept_rows(const ContactStates& states) {
  std::vector<Mode> modes = states.modes;
  for (const auto& [unknown, force] : states.left_out)
    modes[unknown.first] = unknown.second < 0 || modes[unknown.first] == Mode::open ? Mode::open : Mode::closed;
  const std::vector<int> locked = locked_by(scene_, modes, true, program_);
  for (const auto& [unknown, force] : states.left_out) {
    const ContactFormulas& contact = scene_.contacts[unknown.first];
    const auto& row = unknown.second < 0 ? contact.J_n : contact.J_t[unknown.second];
    bool is_kept = is_at_rest_with_its_bodies(scene_, unknown.first, program_);
    for (int k = 0; k < scene_.n; ++k)
      is_kept = is_kept && (program_.is_zero(row[k]) || std::ranges::count(locked, k) > 0);
    if (!is_kept) throw Unsupported("redundant contacts, which may depend on these parameters: " + contact.name);
  }
}

/// f = (v, a) at the state in the program.
std::vector<Ball> Sensitivities::rate(const std::vector<Ball>& x) {
  std::vector<Ball> f(x.begin() + scene_.n, x.end());
  for (const Node a : motion_.acceleration) f.push_back(program_.value_of(a));
  return f;
}

/// Adds f dtau, or takes it away.
void Sensitivities::add_rate(const std::vector<Ball>& x, bool backwards) {
  const Precision& a = program_.precision();
  const std::vector<Ball> f = rate(x);
  for (std::size_t k = 0; k < live_.size(); ++k) {
    const Ball& dtau = change_[f.size()][k];
    if (dtau.is_zero()) continue;
    for (std::size_t i = 0; i < f.size(); ++i)
      change_[i][k] = a.add(change_[i][k], a.mul(backwards ? -f[i] : f[i], dtau));
  }
}

/// The derivatives of f with respect to q, v, t and p, at the state that the program holds.
std::vector<Ball> Sensitivities::gradient(Node f) {
  std::vector<Ball> slopes;
  for (const Node x : variables_) slopes.push_back(program_.value_of(program_.derivative(f, x)));
  return slopes;
}

/// The derivative of a formula, one entry per live column.
std::vector<Ball> Sensitivities::vary(Node f) {
  const Precision& a = program_.precision();
  const std::vector<Ball> slopes = gradient(f);
  std::vector<Ball> change(live_.size());
  for (std::size_t j = 0; j < slopes.size(); ++j) {
    for (std::size_t k = 0; k < change.size() && !slopes[j].is_zero(); ++k)
      change[k] = a.add(change[k], a.mul(slopes[j], change_[j][k]));
  }
  return change;
}

void Sensitivities::move(const std::vector<Ball>& x, const Ball& t, const Ball& length) {
  constexpr int kMostHalvings = 20;
  attempt([&] {
    const Precision& a = program_.precision();
    const std::size_t m = x.size();
    std::vector<Ball> from = x;
    Ball time = t, left = length;
    for (bool is_last = false; !is_last;) {
      limit_.check();
      taylor_.load(from, time);
      taylor_.expand(motion_, variation_, change_);
      double h = Magnitude(left).upper() * (1 + 1e-9);
      is_last = true;
      for (int trial = 0; !taylor_.validate(motion_, h) || !taylor_.validate(motion_, variation_, h); ++trial) {
        if (trial == kMostHalvings) throw Undecided("the remainder of the variation is not proven");
        h /= 2;
        is_last = false;
      }
      const Ball tau = is_last ? a.div(left, Ball(h)) : Ball(1.0);
      for (std::size_t i = 0; i < m; ++i) {
        for (std::size_t k = 0; k < live_.size(); ++k)
          change_[i][k] = taylor_.at_of_variation(variation_, i, k, h, tau, a.bits);
        from[i] = taylor_.at(variables_[i], h, tau, a.bits);
      }
      left = a.sub(left, Ball(h));
      time = a.add(time, Ball(h));
    }
  });
}

void Sensitivities::reach(const EventFunction& event, const std::vector<Ball>& x, const Ball& t) {
  attempt([&] {
    const auto is_same = [&](const EventFunction& own) {
      return own.kind == event.kind && own.contact == event.contact && own.side == event.side;
    };
    const Node g = std::ranges::find_if(motion_.events, is_same)->node;
    const Precision& a = program_.precision();
    taylor_.load(x, t);
    const std::vector<Ball> slopes = gradient(g), f = rate(x), change = vary(g);
    Ball along = slopes[f.size()];
    for (std::size_t i = 0; i < f.size(); ++i) along = a.add(along, a.mul(slopes[i], f[i]));
    if (along.sign() == Sign::unknown)
      throw Undecided("an event is not transversal: " + scene_.contacts[event.contact].name);
    for (std::size_t k = 0; k < change.size(); ++k) change_[f.size()][k] = -a.div(change[k], along);  // (2)
    add_rate(x, false);                                                                               // (3)
  });
}

void Sensitivities::strike(const std::vector<Ball>& x, const Ball& t, int hit, const std::vector<Mode>& modes,
                           const std::vector<int>& candidates, const std::vector<Mode>& impact) {
  attempt([&] {
    if (coupled_contacts(scene_, modes, {hit}, program_) != candidates)
      throw Unsupported("contacts exchange no momentum for these parameters only");
    SeriesProgram& p = program_;
    const std::size_t n = scene_.n;
    std::size_t n_used = n;
    const auto unknown = [&](std::size_t j) {
      while (impact_.size() <= j) impact_.push_back(p.state());
      return impact_[j];
    };
    std::vector<Node> jump, r, conditions;
    for (std::size_t i = 0; i < n; ++i) jump.push_back(p.sub(unknown(i), scene_.v[i]));
    for (std::size_t i = 0; i < n; ++i) r.push_back(p.dot(scene_.M[i], jump));
    const auto after = [&](Node w, const std::vector<Node>& J) { return p.add(w, p.dot(J, jump)); };
    const auto push = [&](const std::vector<Node>& column, Node impulse) {
      for (std::size_t i = 0; i < n; ++i) r[i] = p.sub(r[i], p.mul(column[i], impulse));
    };
    for (std::size_t k = 0; k < candidates.size(); ++k) {  // (6)
      const ContactFormulas& contact = scene_.contacts[candidates[k]];
      const Node mu = contact.mu_formula;
      Node w = after(contact.v_n, contact.J_n);
      if (modes[candidates[k]] == Mode::open) w = p.add(w, p.mul(contact.eps_r_formula, contact.v_n));
      if (impact[k] == Mode::open) {
        conditions.push_back(w);
        continue;
      }
      if (impact[k] == Mode::slip) throw Unsupported("an impact with slip in space: " + contact.name);
      const Node Lambda_n = unknown(n_used++);
      r.push_back(w);
      push(contact.J_n, Lambda_n);
      if (!contact.is_bilateral) conditions.push_back(Lambda_n);
      if (const int sign = slip_sign_of(impact[k]); sign != 0) {
        const Node slip = after(contact.v_t[0], contact.J_t[0]), friction = p.mul(mu, Lambda_n);
        conditions.push_back(sign > 0 ? slip : p.neg(slip));
        push(contact.J_t[0], sign > 0 ? p.neg(friction) : friction);
      } else if (impact[k] == Mode::stick) {
        Node reserve = p.mul(p.mul(mu, Lambda_n), p.mul(mu, Lambda_n));
        for (int d = 0; d < contact.n_t(); ++d) {
          const Node Lambda_t = unknown(n_used++);
          r.push_back(after(contact.v_t[d], contact.J_t[d]));
          push(contact.J_t[d], Lambda_t);
          reserve = p.sub(reserve, p.mul(Lambda_t, Lambda_t));
        }
        conditions.push_back(reserve);
      }
    }
    const auto load = [&](const BallMatrix& y) {
      taylor_.load(x, t);
      for (std::size_t j = 0; j < n_used; ++j) p.set(impact_[j], 0, y[j][0].get());
    };
    load(BallMatrix(n_used, {Ball()}));  // r is affine in y
    BallMatrix A, b;
    for (const Node row : r) {
      A.emplace_back();
      for (std::size_t j = 0; j < n_used; ++j) A.back().push_back(p.value_of(p.derivative(row, impact_[j])));
      b.push_back({-p.value_of(row)});
    }
    const auto y = solve(A, b, p.precision().bits);
    if (!y) throw Unsupported("redundant contacts in an impact of " + scene_.contacts[hit].name);
    load(*y);
    for (const Node condition : conditions) {
      if (p.value_of(condition).sign() != Sign::positive)
        throw Unsupported("the law of an impact does not hold strictly: " + scene_.contacts[hit].name);
    }
    BallMatrix right;
    for (const Node row : r) {
      right.push_back(vary(row));
      for (Ball& entry : right.back()) entry = -entry;
    }
    const auto dy = solve(A, right, p.precision().bits);  // (7)
    for (std::size_t i = 0; i < n; ++i) change_[n + i] = dy->at(i);
  });
}

void Sensitivities::finish(const std::vector<Ball>& x, const Ball& t) {
  attempt([&] {
    taylor_.load(x, t);
    change_[x.size()] = vary(scene_.end_time_formula);
    add_rate(x, false);  // (8)
    if (!std::isfinite(log10_radius())) throw Undecided("the balls are not finite");
    is_finished_ = true;
  });
}

double Sensitivities::log10_radius() const {
  double radius = -1e9, size = 0;
  if (!reason_.empty() || change_.empty()) return radius;
  for (std::size_t i = 0; i < 2 * static_cast<std::size_t>(scene_.n); ++i) {
    for (const Ball& entry : change_[i]) {
      radius = std::max(radius, entry.log10_radius());
      size = std::max(size, std::log10(std::max(1.0, std::abs(entry.nearest()))));
    }
  }
  return radius - size;
}

void Sensitivities::write(CertifiedMotion& motion, int digits) const {
  motion.no_sensitivities = reason_;
  if (!is_finished_) return;
  const std::size_t n = scene_.n;
  std::size_t live = 0;
  for (const Column& column : columns_) {
    CertifiedSensitivity result{column.name, column.reason, {}, {}};
    if (column.reason.empty()) {
      for (std::size_t i = 0; i < 2 * n; ++i) {
        const Decimal d = decimal(change_[i][live], digits);
        (i < n ? result.q : result.v).push_back({d.text, d.radius, d.decimals});
      }
      ++live;
    }
    motion.sensitivities.push_back(std::move(result));
  }
}

}  // namespace ricochet::reference::certified
