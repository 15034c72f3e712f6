#include "methods/elements/affine_stages.h"

#include <algorithm>
#include <cmath>

#include "problems/small_complex.h"

namespace ricochet {
namespace {

// Velocities across closed contacts, as those along sticking ones (stage_equations.cpp), are removed from here on.
constexpr double kRounding = 1e-13;

/// Solves the n equations whose rows, right-hand side last, stand one after the other; the solution replaces the
/// right-hand sides. Elimination with partial pivoting.
bool eliminate(Complex* rows, int n) {
  const int width = n + 1;
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i) {
      if (rows[i * width + k].size() > rows[pivot * width + k].size()) pivot = i;
    }
    if (!(rows[pivot * width + k].size() > 0)) return false;
    if (pivot != k) std::swap_ranges(rows + k * width, rows + (k + 1) * width, rows + pivot * width);
    const Complex *row = rows + k * width, inverse = row[k].inverse();
    for (int i = k + 1; i < n; ++i) {
      Complex* other = rows + i * width;
      if (other[k].re == 0 && other[k].im == 0) continue;
      const Complex factor = other[k] * inverse;
      for (int c = k + 1; c < width; ++c) other[c] = other[c] - factor * row[c];
    }
    rows[k * width + k] = inverse;
  }
  for (int k = n - 1; k >= 0; --k) {
    Complex* row = rows + k * width;
    Complex x = row[n];
    for (int c = k + 1; c < n; ++c) x = x - row[c] * rows[c * width + n];
    row[n] = x * row[k];
  }
  return true;
}

/// J_n' v_0 of a closed contact, zero where it is rounding: in short elements it would show in the forces.
double velocity_across(const ContactInfo& contact, const double* J_n, const double* v0) {
  double rate = 0, size = 0;
  for (const int at : contact.support) {
    rate += J_n[at] * v0[at];
    size += std::abs(J_n[at] * v0[at]);
  }
  return std::abs(rate) > kRounding * size ? rate : 0;
}

}  // namespace

AffineStages::AffineStages(const Problem& problem, const StageTableau& tableau, const ActiveSet& active)
    : problem_(problem), tableau_(tableau), active_(active) {
  g_.setZero(problem.n_q(), 4);
}

bool AffineStages::solve(const ModeMap& map, const StageEquations& equations, const StageCoefficients& k, Element& e,
                         StageWorkspace& work) {
  set_forcing(map, e, work);
  for (int j = 0; j < tableau_.n_s; ++j) {
    e.a.col(j) = g_.col(0);
    if (has_forcing_)
      e.a.col(j) +=
          tableau_.diagonal->inverse[j] / k.h * g_.col(2) + tableau_.diagonal->inverse2[j] / (k.h * k.h) * g_.col(3);
  }
  if (!map.is_constant && !add_changes(map, k.h, e)) return false;
  equations.set_stages(k, e, work);
  if (!active_.empty()) set_forces(map, k.h, e);
  return true;
}

/// g_0, .., g_3 of (2), and r_1, r_2 of (1).
void AffineStages::set_forcing(const ModeMap& map, const Element& e, const StageWorkspace& work) {
  const int n = problem_.n_q();
  double* g0 = g_.data();
  const double *q0 = e.q0.data(), *v0 = e.v0.data();
  std::copy_n(map.A0.data(), n, g0);
  if (!map.is_constant) {
    for (int c = 0; c < n; ++c) {
      const double *by_q = map.Aq.data() + c * n, *by_v = map.Av.data() + c * n;
      const double q = q0[c] - map.q_r[c], v = v0[c] - map.v_r[c];
      for (int i = 0; i < n; ++i) g0[i] += by_q[i] * q + by_v[i] * v;
    }
  }
  has_forcing_ = false;
  if (active_.empty()) return;
  r1_.setZero(active_.n_rows());
  r2_.setZero(active_.n_rows());
  for (const ActiveContact& active : active_.closed()) {
    const auto& contact = problem_.info().contacts[active.contact];
    r1_[active.row] = velocity_across(contact, map.R.col(active.row).data(), v0);
    r2_[active.row] = work.kept_gap[active.contact];
    for (int held = 0; held < active.n_rows - 1; ++held)
      r1_[active.row + 1 + held] = work.kept_slip[contact.tangent_index + held];
  }
  has_forcing_ = !r1_.isZero(0) || !r2_.isZero(0);
  if (!has_forcing_) return;
  g_.col(2).noalias() = -map.B.lazyProduct(r1_);
  g_.col(3).noalias() = -map.B.lazyProduct(r2_);
}

/// The sum over k in (3).
bool AffineStages::add_changes(const ModeMap& map, double h, Element& e) {
  const DiagonalTableau& diagonal = *tableau_.diagonal;
  const int n = problem_.n_q(), n_s = tableau_.n_s;
  system_.resize(static_cast<std::size_t>(2 * n * (n + 1)));
  auto* rows = reinterpret_cast<Complex*>(system_.data());
  const double *Aq = map.Aq.data(), *Av = map.Av.data(), *v0 = e.v0.data();
  const double *g0 = g_.data(), *g2 = g0 + 2 * n, *g3 = g0 + 3 * n;
  for (std::size_t k = 0; k < diagonal.l.size(); ++k) {
    const Complex z{h * diagonal.l[k].real(), h * diagonal.l[k].imag()}, z2 = z * z, once = z.inverse();
    for (int i = 0; i < n; ++i) {
      Complex* row = rows + i * (n + 1);
      row[n] = {};
      for (int c = 0; c < n; ++c) {
        const double by_v = Av[c * n + i], by_q = Aq[c * n + i];
        row[c] = {(c == i ? 1 : 0) - by_v * z.re - by_q * z2.re, -by_v * z.im - by_q * z2.im};
        Complex velocity = g0[c] * z, position = v0[c] * z + g0[c] * z2;
        if (has_forcing_) {
          velocity = velocity + Complex{g2[c], 0} + g3[c] * once;
          position = position + g2[c] * z + Complex{g3[c], 0};
        }
        row[n] = row[n] + by_v * velocity + by_q * position;
      }
    }
    if (!eliminate(rows, n)) return false;
    const auto column = static_cast<Eigen::Index>(k);
    const double *re = diagonal.sigma_re.col(column).data(), *im = diagonal.sigma_im.col(column).data();
    for (int j = 0; j < n_s; ++j) {
      for (int i = 0; i < n; ++i) {
        const Complex x = rows[i * (n + 1) + n];
        e.a(i, j) += re[j] * x.re - im[j] * x.im;
      }
    }
  }
  return true;
}

/// (3) of mode_map.h at the stages, with (1)
void AffineStages::set_forces(const ModeMap& map, double h, Element& e) {
  const DiagonalTableau& diagonal = *tableau_.diagonal;
  const int n = problem_.n_q();
  s_.resize(active_.n_rows());
  for (int j = 0; j < tableau_.n_s; ++j) {
    set_unconstrained(map, e.q.data() + j * n, e.v.data() + j * n);
    if (has_forcing_) {
      s_ = -diagonal.inverse[j] / h * r1_ - diagonal.inverse2[j] / (h * h) * r2_;
      lambda_.noalias() += map.Ls.lazyProduct(s_);
    }
    distribute(e.lambda_n.col(j).data(), e.lambda_t.col(j).data());
  }
}

/// lambda_: (3) of mode_map.h for s = 0
void AffineStages::set_unconstrained(const ModeMap& map, const double* q, const double* v) {
  const int n = problem_.n_q(), n_rows = active_.n_rows();
  lambda_ = map.L0;
  for (int c = 0; c < n && !map.is_constant; ++c) {
    const double *by_q = map.Lq.data() + c * n_rows, *by_v = map.Lv.data() + c * n_rows;
    const double dq = q[c] - map.q_r[c], dv = v[c] - map.v_r[c];
    for (int row = 0; row < n_rows; ++row) lambda_[row] += by_q[row] * dq + by_v[row] * dv;
  }
}

/// The forces of the closed contacts from lambda_.
void AffineStages::distribute(double* lambda_n, double* lambda_t) const {
  for (const ActiveContact& active : active_.closed()) {
    const auto& contact = problem_.info().contacts[active.contact];
    const double normal = lambda_n[active.contact] = lambda_[active.row];
    double* tangential = lambda_t + contact.tangent_index;
    for (int d = 0; d < contact.n_t; ++d) {
      tangential[d] = -contact.mu * normal * active.law.along[d];
      for (int held = 0; held < active.n_rows - 1; ++held)
        tangential[d] += active.law.held[held][d] * lambda_[active.row + 1 + held];
    }
  }
}

void AffineStages::set_end_forces(const ModeMap& map, Element& e) {
  e.end_lambda_n.setZero();
  e.end_lambda_t.setZero();
  set_unconstrained(map, e.q1.data(), e.v1.data());
  distribute(e.end_lambda_n.data(), e.end_lambda_t.data());
}

}  // namespace ricochet
