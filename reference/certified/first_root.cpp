#include "reference/certified/first_root.h"

namespace ricochet::reference::certified {
namespace {

constexpr slong kSearchBits = 80;  // of signs on intervals; the root itself is enclosed at full precision
constexpr int kMostBisections = 50;

/// Newton's operator from an interval with p' < 0 that contains all roots.
Ball enclose_root(const BoundedPolynomial& f, Ball X, const Precision& precision) {
  constexpr int kMostIterations = 60;
  for (int k = 0; k < kMostIterations; ++k) {
    const Ball middle = X.midpoint();
    const Ball value = f.at(middle, precision.bits);
    Ball slope, next;
    arb_poly_evaluate(slope.get(), f.slope, X.get(), precision.bits);
    const Ball newton = precision.sub(middle, precision.div(value, slope));
    if (!arb_intersection(next.get(), X.get(), newton.get(), precision.bits)) return X;
    const bool improves = next.log10_radius() < X.log10_radius() - 0.01;
    if (mag_cmp(arb_radref(next.get()), arb_radref(X.get())) < 0) X = next;
    if (!improves) break;
  }
  return X;
}

FirstRoot search(const BoundedPolynomial& f, const Ball& begin, const Ball& end, int depth,
                 const Precision& precision) {
  using Kind = FirstRoot::Kind;
  const Precision coarse{kSearchBits, precision.order};
  const Ball I = coarse.hull(begin, end);
  const Ball middle = I.midpoint();
  Ball slope, value;
  arb_poly_evaluate(slope.get(), f.slope, I.get(), kSearchBits);
  value = coarse.add(f.at(middle, kSearchBits), coarse.mul(coarse.sub(I, middle), slope));
  if (value.sign() == Sign::positive) return {Kind::none, {}, ""};
  if (slope.sign() == Sign::negative) {
    const Sign last = f.at(end, precision.bits).sign();
    if (last == Sign::positive) return {Kind::none, {}, ""};
    if (last == Sign::unknown) return {Kind::unknown, {}, "a root at the end of an interval"};
    return {Kind::found, enclose_root(f, precision.hull(begin, end), precision), ""};
  }
  if (slope.sign() == Sign::positive) {
    if (f.at(begin, precision.bits).sign() == Sign::positive) return {Kind::none, {}, ""};
    return {Kind::unknown, {}, "not positive at the beginning of an interval"};
  }
  if (depth == kMostBisections) return {Kind::unknown, {}, "a grazing root"};
  const FirstRoot left = search(f, begin, middle, depth + 1, precision);
  return left.kind == Kind::none ? search(f, middle, end, depth + 1, precision) : left;
}

}  // namespace

Ball BoundedPolynomial::at(const Ball& tau, slong bits) const {
  Ball value;
  arb_poly_evaluate(value.get(), p, tau.get(), bits);
  value.widen(rho.get());
  return value;
}

FirstRoot first_root(const BoundedPolynomial& f, const Ball& end, const Precision& precision) {
  return search(f, Ball(), end, 0, precision);
}

}  // namespace ricochet::reference::certified
