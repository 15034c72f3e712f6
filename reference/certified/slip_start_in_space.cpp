#include "reference/certified/taylor_step.h"

// Slip in space that begins from rest: v_t = O(t^m), with m = 1 where the forces do not balance at the beginning, and
// m = 2 where sticking ends at the limit of friction. Let d be its first direction and e the direction across. With the
// slip S (d + y e), S = d . v_t > 0, friction acts against d + y e, and
//
//     q' = v,   v' = a(q, v, y),   S y' = E(q, v, y) = (e - y d) . a_t,   y(0) = 0,   a_t = dv_t/dt                 (1)
//
// Every solution has (e - y d) . v_t = 0 for all times, because its derivative is E - y' S. So Coulomb's law holds. At
// the beginning E = 0 and S_k = 0 for k < m, exactly. Coefficient k of (1) gives
//
//     (k S_1 - F_0) y_k = E_k|_{y_k = 0} - sum_{j=2}^k S_j (k - j + 1) y_{k-j+1},   F = dE/dy                       (2)
//
// with S_1 = 0 for m = 2. Then t = 0 is an irregular singular point: the series diverges like k!, and what its
// polynomial p leaves out is bounded here. F_0 < 0 is required: friction turns other directions towards d. Let
// kappa = -F_0, rounded. For functions q, v, y = p + eps with remainders rho let y^ solve the linear equation
// S y^' = E(q, v, y) - kappa (y^ - y). Then eps^ = y^ - p has
//
//     S eps^' = -kappa eps^ + R,   R = [E(q, v, p) - S p'] + eps (F~ + kappa)                                      (3)
//
// where F~ is a mean of F(q, v, p + sigma eps) over 0 <= sigma <= 1. The bracket has no coefficients up to N, by (2).
// With S > 0 and S >= s t on (0, h], s = 0 for m > 1, the bounded solution has
//
//     |R| <= rho_R (t/h)^(N+1)   =>   |eps^| <= rho_R / (kappa + (N+1) s) (t/h)^(N+1)                              (4)
//
// since u = rho (t/h)^(N+1) -+ eps^ satisfies S u' + kappa u >= 0. A lower bound of S (h/t)^m is the least of the sums
//
//     P_k = S_m h^m + ... + S_k h^k,  m <= k <= N,  and P_N - rho_S                                                (5)
//
// by Abel's summation: their weights (t/h)^(k-m) (1 - t/h) and (t/h)^(N-m) are not negative and have the sum 1. If (4)
// does not exceed the rho of y, this map and that of Picard take the set into itself, and images are equicontinuous; by
// Schauder's theorem it contains a solution of (1).
//
// Contacts whose slip begins at the same time exchange no momentum, so that each E depends on its own y only.

namespace ricochet::reference::certified {

Ball TaylorStep::coefficient_of(Node node, int k) const {
  return k > 0 && p_.is_constant(node) ? Ball() : Ball(p_.coefficient(node, k));
}

/// Coefficient k of all y, by (2).
void TaylorStep::expand_directions(const ModeMotion& motion, int k) {
  if (motion.starts.empty()) return;
  const Precision& a = p_.precision();
  const Ball zero;
  for (const auto& [contact, start] : motion.starts) p_.set(start.y, k, zero.get());
  if (k == 0) return;
  for (const Node i : motion.schedule) p_.compute(i, k, a.bits);
  for (const auto& [contact, start] : motion.starts) {
    Ball sum = coefficient_of(start.E, k), divisor = -coefficient_of(start.F, 0);
    for (int j = 2; j <= k; ++j) {
      const Ball slope = a.mul(Ball(k - j + 1.0), coefficient_of(start.y, k - j + 1));
      sum = a.sub(sum, a.mul(coefficient_of(start.S, j), slope));
    }
    if (start.onset.order == 1)
      divisor = a.add(divisor, a.mul(Ball(static_cast<double>(k)), coefficient_of(start.S, 1)));
    if (divisor.sign() == Sign::unknown) throw Undecided("the direction of slip that begins is not determined");
    p_.set(start.y, k, a.div(sum, divisor).get());
  }
}

/// The polynomials p'.
void TaylorStep::differentiate_directions(const Starts& starts, int order) {
  const Precision& a = p_.precision();
  for (const auto& [contact, start] : starts) {
    for (int k = 0; k <= order; ++k) {
      const Ball slope = k < order ? a.mul(Ball(k + 1.0), coefficient_of(start.y, k + 1)) : Ball();
      p_.set(start.turn, k, slope.get());
      p_.compute(start.product, k, a.bits);
    }
  }
}

/// @returns false unless F_0 < 0
bool TaylorStep::begin_contraction(const Starts& starts, double h) {
  for (const auto& [contact, start] : starts) {
    if (coefficient_of(start.F, 0).sign() != Sign::negative) return false;
    p_.measure({start.turn, start.product}, h);
    mag_zero(p_.rho(start.turn));
    mag_zero(p_.rho(start.y));
  }
  return true;
}

/// Remainders of the schedule. @param fixed  of the brackets in (3)
bool TaylorStep::find_remainders(const std::vector<Node>& schedule, const Starts& starts,
                                 std::vector<Magnitude>& fixed) {
  std::vector<Magnitude> rho;
  for (const auto& [contact, start] : starts) {
    rho.emplace_back();
    mag_swap(rho.back().get(), p_.rho(start.y));
  }
  if (!starts.empty() && !find_remainders(schedule)) return false;  // of E(q, v, p)
  std::size_t k = 0;
  for (const auto& [contact, start] : starts) {
    if (!p_.remainder(start.product)) return false;
    mag_add(fixed[k].get(), p_.rho(start.E), p_.rho(start.product));
    mag_swap(rho[k++].get(), p_.rho(start.y));
  }
  return find_remainders(schedule);
}

/// The lower bound of S (h/t)^m by (5). @returns false if it is not positive
bool TaylorStep::least_slip(Magnitude& low, const SlipStart& start, double h) const {
  constexpr slong kBits = 80;
  const Precision a{kBits, p_.precision().order};
  const Ball length(h);
  Ball power(1.0), sum;
  mag_inf(low.get());
  for (int k = 0; k <= a.order; ++k, power = a.mul(power, length)) {
    if (k < start.onset.order) continue;
    sum = a.add(sum, a.mul(power, coefficient_of(start.S, k)));
    if (k == a.order) sum.widen(p_.rho(start.S));
    if (sum.sign() != Sign::positive) return false;
    Magnitude least;
    arb_get_mag_lower(least.get(), sum.get());
    mag_min(low.get(), low.get(), least.get());
  }
  return true;
}

/// Whether the images (4) are inside; the rho of y grow otherwise. @returns false if S may vanish
bool TaylorStep::contract_directions(const Starts& starts, const std::vector<Magnitude>& fixed, double h,
                                     bool& is_inside) {
  const int N = p_.precision().order;
  std::size_t n = 0;
  for (const auto& [contact, start] : starts) {
    const Ball F = coefficient_of(start.F, 0), kappa(-F.nearest());
    Magnitude low;
    if (!least_slip(low, start, h)) return false;
    Magnitude change(p_.precision().add(F, kappa)), divisor;  // of F + kappa
    for (int k = 1; k <= N; ++k) mag_add(change.get(), change.get(), p_.size_of(start.F, k));
    mag_add(change.get(), change.get(), p_.rho(start.F));
    arb_get_mag_lower(divisor.get(), kappa.get());
    if (start.onset.order == 1) {
      Magnitude length;
      mag_set_d(length.get(), h);
      mag_div_lower(low.get(), low.get(), length.get());
      mag_mul_ui_lower(low.get(), low.get(), static_cast<ulong>(N + 1));
      mag_add_lower(divisor.get(), divisor.get(), low.get());
    }
    Magnitude image = fixed[n++];
    mag_addmul(image.get(), change.get(), p_.rho(start.y));
    mag_div(image.get(), image.get(), divisor.get());
    if (mag_cmp(image.get(), p_.rho(start.y)) <= 0) continue;
    is_inside = false;
    mag_mul_2exp_si(p_.rho(start.y), image.get(), 1);
  }
  return true;
}

}  // namespace ricochet::reference::certified
