#include "reference/stated_impact.h"

#include <fmt/format.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_odeiv2.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace ricochet::reference {
namespace {

constexpr int kMaxPieces = 10;  // of (1): slip, stop, slip back or stick, end of compression, end

/// dp_t/dp_n by Coulomb's law at the velocities w; w_t = 0 remains zero if friction suffices.
double friction_direction(const Matrix& G, double mu, const Vector& w, double w_t_size) {
  if (std::abs(w[1]) > 1e-15 * w_t_size) return w[1] > 0 ? -mu : mu;
  const double holding = -G(0, 1) / G(1, 1);
  return std::abs(holding) <= mu ? holding : std::copysign(mu, holding);
}

/// (1)
StatedImpulses along_path(const ContactInfo& contact, ImpactHypothesis law, const Matrix& G, Vector w) {
  const double e = contact.restitution(w[0]);
  Vector r = Vector::Zero(2);
  const double size = std::abs(w[0]) + std::abs(w[1]);
  bool compresses = true;
  double work = 0, left = HUGE_VAL;  // int w_n dp_n so far; the rest of it, or of p_n, in the expansion
  for (int piece = 0; piece < kMaxPieces; ++piece) {
    const Vector direction = (Vector(2) << 1, friction_direction(G, contact.mu, w, size)).finished();
    const Vector rate = G * direction;
    double length = HUGE_VAL;  // of p_n, to where the piece ends
    bool ends_phase = false;
    const bool slip_stops = w[1] * rate[1] < 0;
    if (slip_stops) length = -w[1] / rate[1];
    double to_end = HUGE_VAL;
    if (compresses) {
      if (rate[0] > 0) to_end = -w[0] / rate[0];
    } else if (law == ImpactHypothesis::routh) {
      to_end = left;
    } else {  // w_n x + rate x^2 / 2 = left
      const double root = w[0] * w[0] + 2 * rate[0] * left;
      if (root >= 0) to_end = 2 * left / (w[0] + std::sqrt(root));
    }
    if (to_end <= length) {
      length = to_end;
      ends_phase = true;
    }
    if (!std::isfinite(length)) return {"the path of the impact has no end", {}};
    const double done = w[0] * length + rate[0] * length * length / 2;
    w += length * rate;
    r += length * direction;
    if (ends_phase && !compresses) return {"", r};
    if (!ends_phase) w[1] = 0;
    if (compresses) {
      work += done;
    } else {
      left -= law == ImpactHypothesis::routh ? length : done;
    }
    if (!ends_phase) continue;
    w[0] = 0;
    compresses = false;
    left = law == ImpactHypothesis::routh ? e * r[0] : -e * e * work;
    if (left == 0) return {"", r};
  }
  return {"the path of the impact has too many pieces", {}};
}

/// Impulse that makes w_n zero and satisfies Coulomb's law for w_t after it; empty if there is none.
Vector compressing(const Matrix& G, double mu, const Vector& w) {
  const Vector stick = -G.ldlt().solve(w);
  if (stick[0] >= 0 && std::abs(stick[1]) <= mu * stick[0]) return stick;
  for (const double t : {-mu, mu}) {  // w_t after it is positive, negative
    const Vector direction = (Vector(2) << 1, t).finished();
    const double p_n = -w[0] / G.row(0).dot(direction);
    const Vector after = w + p_n * (G * direction);
    if (p_n >= 0 && after[1] * t <= 0) return p_n * direction;
  }
  return {};
}

/// (2)
StatedImpulses poisson(const ContactInfo& contact, const Matrix& G, const Vector& w) {
  const double mu = contact.mu;
  const Vector compression = compressing(G, mu, w);
  if (compression.size() == 0) return {"Poisson's compression has no solution", {}};
  const Vector w_C = w + G * compression;
  const double p_n = contact.restitution(w[0]) * compression[0];
  const auto expansion = [&](double p_t) { return (Vector(2) << p_n, p_t).finished(); };
  const double sticking = -(w_C[1] + G(1, 0) * p_n) / G(1, 1);
  Vector p = expansion(std::clamp(sticking, -mu * p_n, mu * p_n));
  if ((w_C + G * p)[0] < 0) {  // friction presses: the contact does not open
    p = compressing(G, mu, w_C);
    if (p.size() == 0) return {"Poisson's expansion has no solution", {}};
  }
  return {"", compression + p};
}

/// (3): y = (delta, P) of n contacts.
class Springs {
 public:
  Springs(const ProblemInfo& info, const std::vector<int>& contacts, const Matrix& G, const Vector& w)
      : n_(w.size()),
        G_(G),
        w_0_(w),
        e_(n_),
        K_(Vector::Ones(n_)),
        eta_(info.impact_law.eta),
        y_(Vector::Zero(2 * n_)),
        phase_(static_cast<std::size_t>(n_), 0) {
    for (Eigen::Index k = 0; k < n_; ++k) {
      const auto i = static_cast<std::size_t>(contacts[static_cast<std::size_t>(k)]);
      e_[k] = info.contacts[i].eps_r;
      if (!info.impact_law.stiffness.empty()) K_[k] = info.impact_law.stiffness[i];
    }
    speed_ = w.cwiseAbs().maxCoeff();
    K_ *= speed_ * speed_ / (K_.maxCoeff() * G.diagonal().maxCoeff());  // a common factor changes the time alone
  }

  StatedImpulses impulses() {
    const gsl_odeiv2_system system{&Springs::rate, nullptr, static_cast<std::size_t>(2 * n_), this};
    const std::unique_ptr<gsl_odeiv2_driver, decltype(&gsl_odeiv2_driver_free)> driver(
        gsl_odeiv2_driver_alloc_y_new(&system, gsl_odeiv2_step_rk8pd, 1e-3 / speed_, 1e-14, 1e-13),
        &gsl_odeiv2_driver_free);
    for (int piece = 0; piece < kMaxPhases; ++piece) {
      if (!choose_phases()) return {"", y_.tail(n_)};
      if (!go_to_next_change(*driver)) return {"the springs of the impact law could not be integrated", {}};
    }
    return {"the contacts of the impact law change between compression and expansion without an end", {}};
  }

 private:
  static constexpr int kMaxPhases = 100000;
  static constexpr double kRest = 1e-12;  // of the speed

  Vector velocity(const Vector& y) const { return w_0_ + G_ * y.tail(n_); }

  static int rate(double, const double* y, double* dy, void* self) {
    const auto& s = *static_cast<const Springs*>(self);
    const Eigen::Map<const Vector> state(y, 2 * s.n_);
    const Vector w = s.w_0_ + s.G_ * state.tail(s.n_);
    for (Eigen::Index k = 0; k < s.n_; ++k) {
      const int phase = s.phase_[static_cast<std::size_t>(k)];
      dy[k] = phase == 0 ? 0 : phase < 0 ? -w[k] : -w[k] / (s.e_[k] * s.e_[k]);
      dy[s.n_ + k] = phase == 0 ? 0 : s.K_[k] * std::pow(std::max(state[k], 0.0), s.eta_);
    }
    return GSL_SUCCESS;
  }

  /// Sets the phases (0 open, -1 compression, 1 expansion) by velocities and lengths. False if all stay open.
  bool choose_phases() {
    const Vector w = velocity(y_);
    for (Eigen::Index k = 0; k < n_; ++k) {
      int& phase = phase_[static_cast<std::size_t>(k)];
      if (phase > 0 && y_[k] <= 0) phase = 0;
      if (phase == 0) y_[k] = 0;
      if (phase == 0 && w[k] < -kRest * speed_) phase = -1;
      if (phase != 0 && y_[k] > 0) phase = w[k] < 0 ? -1 : 1;
    }
    return std::ranges::any_of(phase_, [](int phase) { return phase != 0; });
  }

  bool has_changed(const Vector& y) const {
    const Vector w = velocity(y);
    for (Eigen::Index k = 0; k < n_; ++k) {
      const int phase = phase_[static_cast<std::size_t>(k)];
      if (phase == 0 && w[k] < -kRest * speed_) return true;
      if (phase < 0 && w[k] >= 0) return true;
      if (phase > 0 && (w[k] < 0 || y[k] <= 0)) return true;
    }
    return false;
  }

  /// Makes steps until a phase changes, then bisects the last one. False if GSL fails.
  bool go_to_next_change(gsl_odeiv2_driver& driver) {
    const auto advanced = [&](const Vector& from, double length) {
      Vector y = from;
      double t = 0;
      gsl_odeiv2_driver_reset_hstart(&driver, length);
      if (gsl_odeiv2_driver_apply(&driver, &t, length, y.data()) != GSL_SUCCESS) y.setConstant(NAN);
      return y;
    };
    double length = 1e-2 / speed_;
    Vector next = advanced(y_, length);
    for (int k = 0; !has_changed(next); ++k) {
      if (!next.allFinite() || k > 1000000) return false;
      y_ = next;
      next = advanced(y_, length);
    }
    double before = 0, after = length;
    while (after - before > 1e-15 * length) {
      const double middle = (before + after) / 2;
      (has_changed(advanced(y_, middle)) ? after : before) = middle;
    }
    y_ = advanced(y_, after);
    return y_.allFinite();
  }

  Eigen::Index n_;
  Matrix G_;
  Vector w_0_, e_, K_;
  double eta_, speed_ = 0;
  Vector y_;
  std::vector<int> phase_;
};

}  // namespace

StatedImpulses stated_impulses(const ProblemInfo& info, const std::vector<int>& contacts, const Matrix& G,
                               const Vector& w) {
  const auto law = info.impact_law.hypothesis;
  const ContactInfo& contact = info.contacts[static_cast<std::size_t>(contacts.front())];
  if (contacts.size() == 1 && contact.n_t == 0)
    return {"", Vector::Constant(1, -(1 + contact.restitution(w[0])) * w[0] / G(0, 0))};
  if (law == ImpactHypothesis::lzb) return Springs(info, contacts, G, w).impulses();
  if (contacts.size() > 1)
    return {fmt::format("{} contacts meet, and the impact law {} is that of one", contacts.size(), name_of(law)), {}};
  return law == ImpactHypothesis::poisson ? poisson(contact, G, w) : along_path(contact, law, G, w);
}

}  // namespace ricochet::reference
