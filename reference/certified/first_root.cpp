#include "reference/certified/first_root.h"

#include <algorithm>
#include <array>
#include <vector>

namespace ricochet::reference::certified {
namespace {

constexpr slong kSearchBits = 80;    // of signs on intervals; the root itself is enclosed at full precision
constexpr int kQuickBisections = 3;  // before better bounds are worth their time
constexpr int kMostBisections = 50;

/// g(x) = f(b x) with the terms that matter on [0, 1]; those left out are in its rho.
void restrict_to(BoundedPolynomial& g, const BoundedPolynomial& f, const Ball& b) {
  std::vector<Ball> terms(static_cast<std::size_t>(std::max<slong>(1, arb_poly_length(f.p))));
  Ball power(1.0);
  Magnitude largest;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    arb_poly_get_coeff_arb(terms[k].get(), f.p, static_cast<slong>(k));
    arb_mul(terms[k].get(), terms[k].get(), power.get(), kSearchBits);
    arb_mul(power.get(), power.get(), b.get(), kSearchBits);
    mag_max(largest.get(), largest.get(), Magnitude(terms[k]).get());
  }
  Magnitude rest;
  mag_mul_2exp_si(largest.get(), largest.get(), -kSearchBits - 10);
  while (terms.size() > 3 && mag_cmp(Magnitude(terms.back()).get(), largest.get()) < 0) {
    mag_add(rest.get(), rest.get(), Magnitude(terms.back()).get());
    terms.pop_back();
  }
  mag_mul_2exp_si(rest.get(), rest.get(), 1);  // x may exceed 1 by rounding
  mag_add(g.rho.get(), f.rho.get(), rest.get());
  for (std::size_t k = 0; k < terms.size(); ++k) arb_poly_set_coeff_arb(g.p, static_cast<slong>(k), terms[k].get());
  arb_poly_derivative(g.slope, g.p, kSearchBits);
}

/// Bounds of f, p' and p'' on an interval.
struct Range {
  Ball value, slope, bend;
};

/// The range by the mean value theorem. Horner's scheme bounds p' on the interval: it is fast, but its bound is wide
/// where terms cancel.
Range quick_range(const BoundedPolynomial& f, const Ball& I, const Precision& coarse) {
  const Ball middle = I.midpoint();
  Ball slope;
  arb_poly_evaluate(slope.get(), f.slope, I.get(), kSearchBits);
  return {coarse.add(f.at(middle, kSearchBits), coarse.mul(coarse.sub(I, middle), slope)), slope, {}};
}

/// From g(s) = p(m + w s), |s| <= 1, whose derivatives are within
///
///     g_0 +- sum_{k>0} |g_k|,    g_1 +- sum_{k>1} k |g_k|,    2 g_2 +- sum_{k>2} k (k-1) |g_k|                       (1)
///
/// Terms that cancel have done so in the g_k.
Range shifted_range(const BoundedPolynomial& f, const Ball& I) {
  Ball w, power(1.0);
  arf_set_mag(arb_midref(w.get()), arb_radref(I.get()));
  arb_poly_t g;
  arb_poly_init(g);
  arb_poly_taylor_shift(g, f.p, I.midpoint().get(), kSearchBits);
  Range range;
  const std::array<Ball*, 3> derivatives{&range.value, &range.slope, &range.bend};
  for (slong k = 0; k < arb_poly_length(g); ++k) {
    Ball term;
    arb_poly_get_coeff_arb(term.get(), g, k);
    arb_mul(term.get(), term.get(), power.get(), kSearchBits);
    arb_mul(power.get(), power.get(), w.get(), kSearchBits);
    for (slong d = 0; d < 3 && d <= k; ++d) {
      if (k == d) *derivatives[d] = term;
      if (k > d) derivatives[d]->widen(Magnitude(term).get());
      arb_mul_si(term.get(), term.get(), k - d, kSearchBits);
    }
  }
  arb_poly_clear(g);
  range.value.widen(f.rho.get());
  arb_div(range.slope.get(), range.slope.get(), w.get(), kSearchBits);
  arb_div(range.bend.get(), range.bend.get(), w.get(), kSearchBits);
  arb_div(range.bend.get(), range.bend.get(), w.get(), kSearchBits);
  return range;
}

/// Newton's operator from an interval with p' < 0 that contains all roots.
Ball enclose_root(const BoundedPolynomial& f, Ball X, const Precision& precision) {
  constexpr int kMostIterations = 60;
  for (int k = 0; k < kMostIterations; ++k) {
    const Ball middle = X.midpoint();
    const Ball value = f.at(middle, precision.bits);
    Ball slope, next;
    arb_poly_evaluate(slope.get(), f.slope, X.get(), precision.bits);
    if (slope.sign() != Sign::negative) slope = shifted_range(f, X).slope;
    const Ball newton = precision.sub(middle, precision.div(value, slope));
    if (!arb_intersection(next.get(), X.get(), newton.get(), precision.bits)) return X;
    const bool improves = next.log10_radius() < X.log10_radius() - 0.01;
    if (mag_cmp(arb_radref(next.get()), arb_radref(X.get())) < 0) X = next;
    if (!improves) break;
  }
  return X;
}

/// The least value of f on an interval I where p'' >= kappa > 0: for every m of I,
///
///     f >= p(m) - p'(m)^2 / (2 kappa) - rho                                                                         (2)
///
/// @returns a number that is not larger, for an m near the minimum
Ball least_of_convex(const BoundedPolynomial& f, const Ball& I, const Ball& bend, const Precision& a) {
  constexpr int kMostIterations = 12;
  Ball m = I.midpoint(), slope, second;
  arb_poly_t bends;
  arb_poly_init(bends);
  arb_poly_derivative(bends, f.slope, a.bits);
  for (int k = 0; k < kMostIterations; ++k) {
    arb_poly_evaluate(slope.get(), f.slope, m.get(), a.bits);
    arb_poly_evaluate(second.get(), bends, m.get(), a.bits);
    const Ball next = a.sub(m, a.div(slope, second)).midpoint();
    if (!arb_contains(I.get(), next.get())) break;
    m = next;
  }
  arb_poly_clear(bends);
  arb_poly_evaluate(slope.get(), f.slope, m.get(), a.bits);
  Ball kappa;
  arb_get_lbound_arf(arb_midref(kappa.get()), bend.get(), a.bits);
  return a.sub(f.at(m, a.bits), a.div(a.mul(slope, slope), a.mul(Ball(2.0), kappa)));
}

FirstRoot search(const BoundedPolynomial& f, const Ball& begin, const Ball& end, int depth, double graze,
                 const Precision& precision) {
  using Kind = FirstRoot::Kind;
  const Precision coarse{kSearchBits, precision.order};
  const Ball I = coarse.hull(begin, end);
  const Ball middle = I.midpoint();
  BoundedPolynomial g;
  restrict_to(g, f, end);
  const Ball own = coarse.div(I, end);
  Range range = quick_range(g, own, coarse);
  const bool is_undecided = range.value.sign() != Sign::positive && range.slope.sign() == Sign::unknown;
  if (is_undecided && depth >= kQuickBisections) range = shifted_range(g, own);
  if (range.value.sign() == Sign::positive) return {Kind::none, {}, ""};
  if (range.slope.sign() == Sign::negative) {
    const Sign last = f.at(end, precision.bits).sign();
    if (last == Sign::positive) return {Kind::none, {}, ""};
    if (last == Sign::unknown) return {Kind::unknown, {}, "a root at the end of an interval"};
    return {Kind::found, enclose_root(f, precision.hull(begin, end), precision), ""};
  }
  if (range.slope.sign() == Sign::positive) {
    if (f.at(begin, precision.bits).sign() == Sign::positive) return {Kind::none, {}, ""};
    return {Kind::unknown, {}, "not positive at the beginning of an interval"};
  }
  if (range.bend.sign() == Sign::positive) {
    const Ball bend = coarse.div(range.bend, coarse.mul(end, end));
    const Ball least = least_of_convex(f, I, bend, precision);
    if (least.sign() == Sign::positive) return {Kind::none, {}, ""};
    if (precision.add(least, Ball(graze)).sign() == Sign::positive) return {Kind::none, {}, "", true};
    if (least.sign() == Sign::unknown) return {Kind::unknown, {}, "a grazing root"};
  }
  if (depth == kMostBisections) return {Kind::unknown, {}, "a grazing root"};
  const FirstRoot left = search(f, begin, middle, depth + 1, graze, precision);
  if (left.kind != Kind::none) return left;
  FirstRoot right = search(f, middle, end, depth + 1, graze, precision);
  right.grazes = right.grazes || left.grazes;
  return right;
}

}  // namespace

Ball BoundedPolynomial::at(const Ball& tau, slong bits) const {
  Ball value;
  arb_poly_evaluate(value.get(), p, tau.get(), bits);
  value.widen(rho.get());
  return value;
}

FirstRoot first_root(const BoundedPolynomial& f, const Ball& end, const Precision& precision, double graze) {
  return search(f, Ball(), end, 0, graze, precision);
}

}  // namespace ricochet::reference::certified
