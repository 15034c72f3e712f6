#include "methods/contact_laws/impact_laws/lzb_impact.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {
namespace {

enum class Phase { open, compression, expansion };

// A normal velocity below this part of the largest one is rest: its energy is rounding of that of the impact.
constexpr double kRest = 1e-10;
// The bisection that locates an event halves a step this often: the step is then below rounding of t.
constexpr int kHalvings = 50;
constexpr int kMaxSteps = 20'000'000;

void check(const LzbLaw& law, const Matrix& G, const Vector& w, int steps) {
  const auto n = w.size();
  if (law.K.size() != n || law.e.size() != n || G.rows() != n || G.cols() != n)
    throw InputError(fmt::format("K, e, G have {}, {}, {} x {} entries: have to match the n = {} velocities",
                                 law.K.size(), law.e.size(), G.rows(), G.cols(), n));
  for (int i = 0; i < n; ++i) {
    if (!(law.K[i] > 0 && std::isfinite(law.K[i])))
      throw InputError(fmt::format("K[{}]", i), law.K[i], "has to be in (0, infinity)");
    if (!(law.e[i] > 0 && law.e[i] <= 1)) throw InputError(fmt::format("e[{}]", i), law.e[i], "has to be in (0, 1]");
  }
  if (!(law.eta >= 1 && std::isfinite(law.eta))) throw InputError("eta", law.eta, "has to be in [1, infinity)");
  if (steps < 1) throw InputError("steps", steps, "has to be positive");
}

class Springs {
 public:
  Springs(const LzbLaw& law, const Matrix& G, const Vector& w)
      : law_(law), G_(G), w_0_(w), rest_(kRest * w.cwiseAbs().maxCoeff()), phase_(w.size(), Phase::open) {
    // A scale of K at which the stiffest contact alone, at the fastest approach, has delta = 1 and t = O(1).
    const double speed = w.cwiseAbs().maxCoeff();
    scale_ = speed * speed / (law.K.maxCoeff() * G.diagonal().maxCoeff());
    time_ = 1 / speed;
    y_.setZero(2 * n());  // delta, P
  }

  double time() const { return time_; }
  Vector velocity() const { return w_0_ + G_ * y_.tail(n()); }
  Vector impulses() const { return y_.tail(n()); }

  // Contacts that approach close. False when none is closed: the impact is over.
  bool set_phases() {
    const Vector w = velocity();
    bool any = false;
    for (int i = 0; i < n(); ++i) {
      if (phase_[i] == Phase::open) {
        if (w[i] < -rest_) phase_[i] = Phase::compression;
      } else {
        phase_[i] = w[i] < 0 ? Phase::compression : Phase::expansion;
        if (phase_[i] == Phase::expansion && y_[i] <= 0) phase_[i] = Phase::open;
      }
      if (phase_[i] == Phase::open) y_[i] = 0;
      any = any || phase_[i] != Phase::open;
    }
    return any;
  }

  // A step, cut where the first contact changes its phase.
  void step(double h) {
    Vector end = stepped(h);
    if (changes(end)) {
      double before = 0, after = h;
      for (int k = 0; k < kHalvings; ++k) {
        const double middle = (before + after) / 2;
        (changes(stepped(middle)) ? after : before) = middle;
      }
      end = stepped(after);
    }
    y_ = end;
  }

 private:
  int n() const { return static_cast<int>(w_0_.size()); }

  Vector rate(const Vector& y) const {  // (4)
    const Vector w = w_0_ + G_ * y.tail(n());
    Vector dy = Vector::Zero(2 * n());
    for (int i = 0; i < n(); ++i) {
      if (phase_[i] == Phase::open) continue;
      dy[i] = phase_[i] == Phase::compression ? -w[i] : -w[i] / (law_.e[i] * law_.e[i]);
      dy[n() + i] = scale_ * law_.K[i] * std::pow(std::max(y[i], 0.0), law_.eta);
    }
    return dy;
  }

  Vector stepped(double h) const {
    const Vector k1 = rate(y_), k2 = rate(y_ + h / 2 * k1), k3 = rate(y_ + h / 2 * k2), k4 = rate(y_ + h * k3);
    return y_ + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }

  bool changes(const Vector& y) const {
    const Vector w = w_0_ + G_ * y.tail(n());
    for (int i = 0; i < n(); ++i) {
      if (phase_[i] == Phase::open && w[i] < -rest_) return true;
      if (phase_[i] == Phase::compression && w[i] >= 0) return true;
      if (phase_[i] == Phase::expansion && (w[i] < 0 || y[i] <= 0)) return true;
    }
    return false;
  }

  const LzbLaw& law_;
  const Matrix& G_;
  const Vector& w_0_;
  double rest_, scale_ = 1, time_ = 1;
  std::vector<Phase> phase_;
  Vector y_;
};

}  // namespace

LzbImpact lzb_impact(const LzbLaw& law, const Matrix& G, const Vector& w, int steps) {
  check(law, G, w, steps);
  if (w.size() == 0 || w.minCoeff() >= 0) return {w, Vector::Zero(w.size())};
  Springs springs(law, G, w);
  for (int k = 0; springs.set_phases(); ++k) {
    if (k == kMaxSteps) throw std::runtime_error(fmt::format("LZB: the impact has not ended after {} steps", k));
    springs.step(springs.time() / steps);
  }
  return {springs.velocity(), springs.impulses()};
}

}  // namespace ricochet
