#include "methods/contact_laws/impact_laws/planar_impact.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/input_error.h"

namespace ricochet {
namespace {

double sign(double x) {
  return x < 0 ? -1 : 1;
}

void check(const PlanarContact& k) {
  if (!(k.a > 0 && k.b > 0 && k.a * k.b > k.c * k.c))
    throw InputError(fmt::format("G = ({0}, {1}; {1}, {2}): has to be positive definite", k.a, k.c, k.b));
  if (!(k.e >= 0 && k.e <= 1)) throw InputError("e", k.e, "has to be in [0, 1]");
  if (!(k.mu >= 0 && std::isfinite(k.mu))) throw InputError("mu", k.mu, "has to be in [0, infinity)");
}

PlanarPair pushed(const PlanarContact& k, PlanarPair w, PlanarPair p) {  // (1)
  return {w.n + k.a * p.n + k.c * p.t, w.t + k.c * p.n + k.b * p.t};
}

// p_t in -mu p_n Sgn(w_t+) for a known p_n: w_t+ grows with p_t, so that there is one.
double friction_impulse(const PlanarContact& k, PlanarPair w, double p_n) {
  const double stopping = -(w.t + k.c * p_n) / k.b;
  return std::abs(stopping) <= k.mu * p_n ? stopping : k.mu * p_n * sign(stopping);
}

// The impulse that ends with w_n+ = `target` under Coulomb's law for w_t+, as in (2).
std::optional<PlanarPair> impulse_to(const PlanarContact& k, PlanarPair w, double target) {
  const double rise = target - w.n, D = k.a * k.b - k.c * k.c;
  const PlanarPair stick{(k.b * rise + k.c * w.t) / D, (-k.c * rise - k.a * w.t) / D};
  if (stick.n >= 0 && std::abs(stick.t) <= k.mu * stick.n) return stick;
  for (const double s : {sign(w.t), -sign(w.t)}) {
    const double slope = k.a - s * k.mu * k.c;
    if (slope <= 0) continue;
    const PlanarPair p{rise / slope, -s * k.mu * rise / slope};
    if (s * pushed(k, w, p).t >= 0) return p;
  }
  return std::nullopt;
}

std::optional<PlanarImpact> newton(const PlanarContact& k, PlanarPair w) {
  const auto p = impulse_to(k, w, -k.e * w.n);
  if (!p) return std::nullopt;
  return PlanarImpact{pushed(k, w, *p), *p};
}

std::optional<PlanarImpact> poisson(const PlanarContact& k, PlanarPair w) {
  const auto compression = impulse_to(k, w, 0);
  if (!compression) return std::nullopt;
  const PlanarPair w_C = pushed(k, w, *compression);
  PlanarPair expansion{k.e * compression->n, 0};
  expansion.t = friction_impulse(k, w_C, expansion.n);
  if (pushed(k, w_C, expansion).n < 0) {  // the other branch of (3): a larger impulse, and w_n+ = 0
    const auto larger = impulse_to(k, w_C, 0);
    if (!larger) return std::nullopt;
    expansion = *larger;
  }
  const PlanarPair p{compression->n + expansion.n, compression->t + expansion.t};
  return PlanarImpact{pushed(k, w, p), p};
}

// (4)-(6) as two straight lines: until slip stops, and after.
class ImpulsePath {
 public:
  ImpulsePath(const PlanarContact& k, PlanarPair w) : k_(k), w_(w) {
    const double s = sign(w.t), loss = k.mu * k.b - s * k.c;  // of |w_t| per impulse
    if (w.t == 0) {
      stop_ = 0;
    } else if (loss > 0) {
      stop_ = std::abs(w.t) / loss;
    }
    before_ = {1, -k.mu * s};
    after_ = {1, std::abs(k.c) <= k.mu * k.b ? -k.c / k.b : -k.mu * sign(k.c)};
  }

  PlanarPair impulse(double p_n) const {
    const double slipping = std::min(p_n, stop_), rest = p_n - slipping;
    return {p_n, before_.t * slipping + (rest > 0 ? after_.t * rest : 0)};
  }
  double normal_velocity(double p_n) const { return pushed(k_, w_, impulse(p_n)).n; }
  // p_c: w_n grows after the stop, and before it unless the contact jams; it passes through zero once.
  double compression() const {
    if (const double slope = slope_of(before_); slope > 0 && -w_.n <= slope * stop_) return -w_.n / slope;
    return stop_ - normal_velocity(stop_) / slope_of(after_);
  }
  // int_from^to w_n dp_n by trapezoids, exact on straight lines.
  double work(double from, double to) const {
    const double middle = std::clamp(stop_, from, to);
    return trapezoid(from, middle) + trapezoid(middle, to);
  }
  // Impulse at which the work of w_n after p_c reaches W; w_n = 0 at p_c.
  double end_of_work(double p_c, double W) const {
    if (p_c < stop_) {
      const double end = p_c + std::sqrt(2 * W / slope_of(before_));
      if (end <= stop_) return end;
    }
    // w x + slope x^2 / 2 = W on the line after `start`, by the root without cancellation
    const double start = std::max(p_c, stop_), w = p_c < stop_ ? normal_velocity(start) : 0;
    const double left = W - work(p_c, start);
    if (left <= 0) return start;
    return start + 2 * left / (w + std::sqrt(w * w + 2 * slope_of(after_) * left));
  }

 private:
  double slope_of(PlanarPair direction) const { return k_.a + k_.c * direction.t; }
  double trapezoid(double from, double to) const {
    return to > from ? (to - from) * (normal_velocity(from) + normal_velocity(to)) / 2 : 0;
  }

  PlanarContact k_;
  PlanarPair w_, before_{}, after_{};
  double stop_ = HUGE_VAL;
};

PlanarImpact along_path(ImpactHypothesis law, const PlanarContact& k, PlanarPair w) {
  const ImpulsePath path(k, w);
  const double p_c = path.compression();
  const double p_f = law == ImpactHypothesis::routh ? (1 + k.e) * p_c                                         // (7)
                                                    : path.end_of_work(p_c, -k.e * k.e * path.work(0, p_c));  // (8)
  const PlanarPair p = path.impulse(p_f);
  return {pushed(k, w, p), p};
}

}  // namespace

std::optional<PlanarImpact> planar_impact(ImpactHypothesis law, const PlanarContact& contact, PlanarPair w) {
  check(contact);
  if (w.n >= 0) return PlanarImpact{w, {0, 0}};
  if (law == ImpactHypothesis::lzb)
    throw InputError("impact law lzb of a single impact with friction: newton, poisson, routh or stronge");
  if (law == ImpactHypothesis::newton) return newton(contact, w);
  if (law == ImpactHypothesis::poisson) return poisson(contact, w);
  return along_path(law, contact, w);
}

double energy_change(const PlanarImpact& impact, PlanarPair w) {
  return (impact.p.n * (impact.w.n + w.n) + impact.p.t * (impact.w.t + w.t)) / 2;  // (9)
}

}  // namespace ricochet
