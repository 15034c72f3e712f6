#include "reference/certified/friction_in_space.h"

#include "reference/certified/ball_matrix.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kSearchBits = 80;     // of signs on arcs
constexpr int kMostArcs = 20000;      // that are looked at; directions are undecided then
constexpr int kMostBisections = 50;   // of one of them
constexpr int kMostIterations = 60;   // of Newton's operator
constexpr int kQuarters = 4;          // arcs at the beginning
constexpr double kFirstAngle = 0.37;  // where the first arc begins: no end of an arc is likely to be a solution

/// The search of slip_directions().
class DirectionSearch {
 public:
  DirectionSearch(const ContactInSpace& contact, const Precision& precision,
                  const std::optional<std::array<Ball, 2>>& limit = {})
      : c_(contact), precision_(precision), limit_(limit) {
    b_ = -c_.r[0];
    // For b < 0, the signs of D and b are turned; u keeps its sense with them.
    sense_ = b_.sign();
  }

  SlipDirections run() {
    if (sense_ == Sign::unknown) return {};
    result_.is_complete = true;
    Ball begin(kFirstAngle), quarter;
    arb_const_pi(quarter.get(), precision_.bits);
    arb_mul_2exp_si(quarter.get(), quarter.get(), -1);
    for (int k = 0; k < kQuarters; ++k) {
      const Ball end = precision_.add(begin, quarter);
      search(begin, end);
      begin = end;
    }
    return result_;
  }

  /// Bounds over arcs of equal length.
  std::optional<SlipBounds> bounds() const {
    constexpr int kArcs = 256;
    if (sense_ != Sign::positive) return std::nullopt;
    const Precision coarse{kSearchBits, precision_.order};
    std::optional<SlipBounds> result;
    for (int k = 0; k < kArcs; ++k) {
      const Values x = at(arc(k, kArcs), kSearchBits);
      const Ball braking = -coarse.div(x.S, x.D);
      if (x.D.sign() != Sign::positive || braking.sign() != Sign::positive) return std::nullopt;
      const Ball push = coarse.div(b_, x.D), friction = -coarse.mul(c_.mu, push);
      const std::array<Ball, 3> force{push, coarse.mul(friction, x.d[0]), coarse.mul(friction, x.d[1])};
      Ball least;
      arb_get_lbound_arf(arb_midref(least.get()), braking.get(), kSearchBits);
      if (least.sign() != Sign::positive) return std::nullopt;
      if (!result) {
        result = {least, force};
        continue;
      }
      if (arb_lt(least.get(), result->braking.get())) result->braking = least;
      for (int i = 0; i < 3; ++i) result->force[i] = coarse.hull(result->force[i], force[i]);
    }
    return result;
  }

 private:
  /// Part k of `n` equal parts of the circle.
  static Ball arc(int k, int n) {
    Ball angle(2. * k + 1);
    const Magnitude one{Ball(1.0)};
    angle.widen(one.get());
    Ball scale;
    arb_const_pi(scale.get(), kSearchBits);
    arb_div_si(scale.get(), scale.get(), n, kSearchBits);
    arb_mul(angle.get(), angle.get(), scale.get(), kSearchBits);
    return angle;
  }

  /// Values at an angle, or on an arc.
  struct Values {
    std::array<Ball, 2> d;
    Ball D, S, F, slope;  ///< multiplied by the sign of b: D > 0 and S > 0 are required
    std::array<Ball, 2> u;
  };

  Values at(const Ball& phi, slong bits) const {
    const Precision a{bits, precision_.order};
    Values x;
    arb_sin_cos(x.d[1].get(), x.d[0].get(), phi.get(), bits);
    const std::array<Ball, 2> across{-x.d[1], x.d[0]};
    const auto along = [&](int row, const std::array<Ball, 2>& e) {
      return a.mul(c_.mu, a.add(a.mul(c_.G[row][1], e[0]), a.mul(c_.G[row][2], e[1])));
    };
    x.D = a.sub(c_.G[0][0], along(0, x.d));
    const Ball D_slope = -along(0, across);
    std::array<Ball, 2> u_slope;
    for (int k = 0; k < 2; ++k) {
      x.u[k] = a.add(a.mul(x.D, c_.r[1 + k]), a.mul(b_, a.sub(c_.G[1 + k][0], along(1 + k, x.d))));
      u_slope[k] = a.sub(a.mul(D_slope, c_.r[1 + k]), a.mul(b_, along(1 + k, across)));
    }
    const auto dot = [&](const std::array<Ball, 2>& e, const std::array<Ball, 2>& f) {
      return a.add(a.mul(e[0], f[0]), a.mul(e[1], f[1]));
    };
    x.S = dot(x.d, x.u);
    x.F = dot(across, x.u);
    x.slope = a.sub(dot(across, u_slope), x.S);
    if (sense_ == Sign::negative) {
      x.D = -x.D;
      for (Ball* value : {&x.S, &x.F, &x.slope, x.u.data(), &x.u[1]}) *value = -*value;
    }
    return x;
  }

  void search(const Ball& begin, const Ball& end, int depth = 0) {
    if (!result_.is_complete) return;
    if (++n_arcs_ > kMostArcs || depth > kMostBisections) {
      result_.is_complete = false;
      return;
    }
    const Precision coarse{kSearchBits, precision_.order};
    const Ball arc = coarse.hull(begin, end), middle = arc.midpoint();
    const Values all = at(arc, kSearchBits);
    if (all.D.sign() == Sign::negative || all.S.sign() == Sign::negative) return;
    const Ball F = coarse.add(at(middle, kSearchBits).F, coarse.mul(coarse.sub(arc, middle), all.slope));
    if (F.sign() != Sign::unknown) return;
    if (all.slope.sign() != Sign::unknown) {
      decide(begin, end, all.slope.sign());
      return;
    }
    search(begin, middle, depth + 1);
    search(middle, end, depth + 1);
  }

  /// Whether the limit certainly lies on an arc, which is less than half of the circle.
  bool has_limit(const Ball& begin, const Ball& end) const {
    const auto turn_to = [&](const Ball& phi) {  // the sine of the angle from phi to the limit
      const Values x = at(phi, precision_.bits);
      return precision_.sub(precision_.mul(x.d[0], (*limit_)[1]), precision_.mul(x.d[1], (*limit_)[0])).sign();
    };
    return limit_ && turn_to(begin) == Sign::positive && turn_to(end) == Sign::negative;
  }

  /// An arc where F is strictly monotonous.
  void decide(const Ball& begin, const Ball& end, Sign slope) {
    if (has_limit(begin, end)) return;
    const Sign first = at(begin, precision_.bits).F.sign(), last = at(end, precision_.bits).F.sign();
    if (first == Sign::unknown || last == Sign::unknown) {
      result_.is_complete = false;
      return;
    }
    if (first == last) return;
    const Ball phi = enclose(precision_.hull(begin, end));
    const Values x = at(phi, precision_.bits);
    if (x.D.sign() == Sign::negative || x.S.sign() == Sign::negative) return;
    if (x.D.sign() == Sign::unknown || x.S.sign() == Sign::unknown) {
      result_.is_complete = false;
      return;
    }
    ++result_.n_proven;
    result_.is_stable = slope == Sign::negative;
    result_.d = x.d;
    Ball size;
    arb_abs(size.get(), b_.get());
    result_.force[0] = precision_.div(size, x.D);
    for (int k = 0; k < 2; ++k) result_.force[1 + k] = -precision_.mul(c_.mu, precision_.mul(result_.force[0], x.d[k]));
  }

  /// Newton's operator on an arc with F' != 0 and one root.
  Ball enclose(Ball X) const {
    for (int k = 0; k < kMostIterations; ++k) {
      const Ball middle = X.midpoint();
      const Values at_middle = at(middle, precision_.bits), all = at(X, precision_.bits);
      const Ball newton = precision_.sub(middle, precision_.div(at_middle.F, all.slope));
      Ball next;
      if (!arb_intersection(next.get(), X.get(), newton.get(), precision_.bits)) return X;
      const bool improves = next.log10_radius() < X.log10_radius() - 0.01;
      if (mag_cmp(arb_radref(next.get()), arb_radref(X.get())) < 0) X = next;
      if (!improves) break;
    }
    return X;
  }

  const ContactInSpace& c_;
  const Precision& precision_;
  const std::optional<std::array<Ball, 2>> limit_;
  Ball b_;
  Sign sense_;
  int n_arcs_ = 0;
  SlipDirections result_;
};

}  // namespace

SlipDirections slip_directions(const ContactInSpace& contact, const Precision& precision,
                               const std::optional<std::array<Ball, 2>>& limit) {
  return DirectionSearch(contact, precision, limit).run();
}

std::optional<SlipBounds> slip_bounds(const ContactInSpace& contact, const Precision& precision) {
  return DirectionSearch(contact, precision).bounds();
}

std::optional<std::array<Ball, 3>> sticking_force(const ContactInSpace& contact, const Precision& precision) {
  BallMatrix G, right;
  for (int i = 0; i < 3; ++i) {
    G.emplace_back(contact.G[i].begin(), contact.G[i].end());
    right.push_back({-contact.r[i]});
  }
  const auto solution = solve(G, right, precision.bits);
  if (!solution) return std::nullopt;
  return std::array<Ball, 3>{(*solution)[0][0], (*solution)[1][0], (*solution)[2][0]};
}

Sign is_inside_cone(const std::array<Ball, 3>& force, const Ball& mu, const Precision& precision) {
  const Sign push = force[0].sign();
  if (push != Sign::positive) return push;
  const Ball bound = precision.mul(mu, force[0]);
  const Ball friction = precision.add(precision.mul(force[1], force[1]), precision.mul(force[2], force[2]));
  return precision.sub(precision.mul(bound, bound), friction).sign();
}

}  // namespace ricochet::reference::certified
