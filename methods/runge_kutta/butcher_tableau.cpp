#include "methods/runge_kutta/butcher_tableau.h"

#include <cln/dfloat.h>
#include <cln/integer.h>
#include <cln/lfloat.h>
#include <cln/real.h>
#include <fmt/format.h>
#include <gsl/gsl_poly.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "methods/runge_kutta/diagonal_tableau.h"
#include "methods/runge_kutta/order_conditions.h"
#include "methods/runge_kutta/tableau_file.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

// CLN (the number library under GiNaC) because a tableau with nine stages loses ten digits on the way to its
// coefficients.
using Real = cln::cl_R;
using Polynomial = std::vector<Real>;  // coefficient k belongs to x^k
using Reals = std::vector<Real>;
constexpr int kDigits = 60;

Real real(const cln::cl_I& n) {
  return cln::cl_float(n, cln::float_format(kDigits));
}

Polynomial multiply(const Polynomial& p, const Polynomial& q) {
  Polynomial product(p.size() + q.size() - 1, real(0));
  for (std::size_t i = 0; i < p.size(); ++i) {
    for (std::size_t j = 0; j < q.size(); ++j) product[i + j] = product[i + j] + p[i] * q[j];
  }
  return product;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial result;
  for (std::size_t k = 1; k < p.size(); ++k) result.push_back(p[k] * cln::cl_I(k));
  return result;
}

Real evaluate(const Polynomial& p, const Real& x) {
  Real value = real(0);
  for (auto coefficient = p.rbegin(); coefficient != p.rend(); ++coefficient) value = value * x + *coefficient;
  return value;
}

Real integral(const Polynomial& p, const Real& from, const Real& to) {
  Polynomial primitive{real(0)};
  for (std::size_t k = 0; k < p.size(); ++k) primitive.push_back(p[k] / cln::cl_I(k + 1));
  return evaluate(primitive, to) - evaluate(primitive, from);
}

/// (d/dx)^derivatives of x^left (x - 1)^right: its roots are the abscissae of the classical quadratures.
Polynomial abscissa_polynomial(int left, int right, int derivatives) {
  Polynomial p{real(1)};
  for (int k = 0; k < left; ++k) p = multiply(p, {real(0), real(1)});
  for (int k = 0; k < right; ++k) p = multiply(p, {real(-1), real(1)});
  for (int k = 0; k < derivatives; ++k) p = derivative(p);
  return p;
}

Reals roots(const Polynomial& p) {
  std::vector<double> coefficients;
  for (const auto& c : p) coefficients.push_back(cln::double_approx(c));
  const std::size_t degree = p.size() - 1;
  std::vector<double> packed(2 * degree);
  std::unique_ptr<gsl_poly_complex_workspace, void (*)(gsl_poly_complex_workspace*)> workspace(
      gsl_poly_complex_workspace_alloc(degree + 1), gsl_poly_complex_workspace_free);
  gsl_poly_complex_solve(coefficients.data(), degree + 1, workspace.get(), packed.data());
  std::vector<double> approximations;
  for (std::size_t k = 0; k < degree; ++k) approximations.push_back(packed[2 * k]);
  std::sort(approximations.begin(), approximations.end());

  const Polynomial slope = derivative(p);
  const Real zero = cln::expt(real(10), cln::cl_I(10 - kDigits));
  Reals result;
  for (const double guess : approximations) {
    Real x = cln::cl_float(guess, cln::float_format(kDigits));
    for (int k = 0; k < 8; ++k)
      x = x - evaluate(p, x) / evaluate(slope, x);  // quadratic: 1e-12 -> 1e-60 in three steps
    if (cln::abs(x) < zero) x = real(0);
    result.push_back(x);
  }
  return result;
}

/// Lagrange polynomials: one at node j, zero at the others.
std::vector<Polynomial> lagrange(const Reals& nodes) {
  std::vector<Polynomial> basis;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    Polynomial p{real(1)};
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (k == j) continue;
      const Real distance = nodes[j] - nodes[k];
      p = multiply(p, {-nodes[k] / distance, real(1) / distance});
    }
    basis.push_back(p);
  }
  return basis;
}

enum class Construction { collocation, adjoint, lobatto_iiic };

struct Family {
  int min_stages;
  int zeros_left, zeros_right;  // how often 0 and 1 are roots of the abscissa polynomial
  int order_deficit;            // order = 2 n_s - deficit
  Construction construction;
};

const std::map<std::string, Family>& families() {
  static const std::map<std::string, Family> families = {
      {"gauss", {1, 0, 0, 0, Construction::collocation}},
      {"radau-ia", {1, 1, 0, 1, Construction::adjoint}},
      {"radau-iia", {1, 0, 1, 1, Construction::collocation}},
      {"lobatto-iiia", {2, 1, 1, 2, Construction::collocation}},
      {"lobatto-iiib", {2, 1, 1, 2, Construction::adjoint}},
      {"lobatto-iiic", {2, 1, 1, 2, Construction::lobatto_iiic}},
  };
  return families;
}

std::shared_ptr<const DiagonalTableau> diagonalized(const Matrix& A) {
  auto diagonal = std::make_shared<DiagonalTableau>(A);
  return diagonal->exists() ? std::move(diagonal) : nullptr;
}

/// Extrapolation of stage values to the right end; empty when two abscissae coincide.
Vector right_end_weights(const ButcherTableau& tableau) {
  const int s = tableau.n_s;
  if (tableau.is_stiffly_accurate()) return Vector::Unit(s, s - 1);
  Vector weights = Vector::Ones(s);
  for (int j = 0; j < s; ++j) {
    for (int k = 0; k < s; ++k) {
      if (k == j) continue;
      if (tableau.c[j] == tableau.c[k]) return {};
      weights[j] *= (1 - tableau.c[k]) / (tableau.c[j] - tableau.c[k]);
    }
  }
  return weights;
}

}  // namespace

bool ButcherTableau::is_stiffly_accurate() const {
  return (A.row(n_s - 1).transpose().array() == b.array()).all();
}

std::vector<std::string> tableau_families() {
  return keys_of(families());
}

ButcherTableau make_tableau(const std::string& name, int n_s) {
  const auto known = families().find(name);
  if (known == families().end()) throw_unknown_name("tableau", name, tableau_families());
  const Family& family = known->second;
  if (n_s < family.min_stages || n_s > 9) {
    throw InputError(fmt::format("stages of {}", name), n_s,
                     fmt::format("{} to 9 stages are possible", family.min_stages));
  }

  const int fixed = family.zeros_left + family.zeros_right;
  const Reals c = roots(abscissa_polynomial(n_s - family.zeros_right, n_s - family.zeros_left, n_s - fixed));
  const auto s = static_cast<std::size_t>(n_s);
  const auto basis = lagrange(c);
  const Real zero = real(0), one = real(1);

  Reals b;
  std::vector<Reals> A(s, Reals(s));
  for (const auto& p : basis) b.push_back(integral(p, zero, one));
  for (std::size_t i = 0; i < s; ++i) {
    for (std::size_t j = 0; j < s; ++j) A[i][j] = integral(basis[j], zero, c[i]);  // C(n_s)
  }
  if (family.construction == Construction::adjoint) {  // D(n_s) with the Lagrange basis as test polynomials
    const auto collocation = A;
    for (std::size_t i = 0; i < s; ++i) {
      for (std::size_t j = 0; j < s; ++j) A[i][j] = b[j] * (b[i] - collocation[j][i]) / b[i];
    }
  } else if (family.construction == Construction::lobatto_iiic) {  // a_i1 = b_1 and C(n_s - 1)
    const auto rest = lagrange(Reals(c.begin() + 1, c.end()));
    for (std::size_t i = 0; i < s; ++i) {
      A[i][0] = b[0];
      for (std::size_t j = 1; j < s; ++j)
        A[i][j] = integral(rest[j - 1], zero, c[i]) - b[0] * evaluate(rest[j - 1], c[0]);
    }
  }

  ButcherTableau tableau;
  tableau.name = fmt::format("{}:{}", name, n_s);
  tableau.n_s = n_s;
  tableau.order = 2 * n_s - family.order_deficit;
  tableau.A.resize(n_s, n_s);
  tableau.b.resize(n_s);
  tableau.c.resize(n_s);
  for (int i = 0; i < n_s; ++i) {
    tableau.b[i] = cln::double_approx(b[i]);
    tableau.c[i] = cln::double_approx(c[i]);
    for (int j = 0; j < n_s; ++j) tableau.A(i, j) = cln::double_approx(A[i][j]);
  }
  tableau.right_end = right_end_weights(tableau);
  tableau.diagonal = diagonalized(tableau.A);
  return tableau;
}

double residual_B(const ButcherTableau& t, int p) {
  double worst = 0;
  for (int k = 1; k <= p; ++k) worst = std::max(worst, std::abs(t.b.dot(t.c.array().pow(k - 1).matrix()) - 1.0 / k));
  return worst;
}

double residual_C(const ButcherTableau& t, int q) {
  double worst = 0;
  for (int k = 1; k <= q; ++k) {
    const Vector residual = t.A * t.c.array().pow(k - 1).matrix() - t.c.array().pow(k).matrix() / k;
    worst = std::max(worst, residual.cwiseAbs().maxCoeff());
  }
  return worst;
}

double residual_D(const ButcherTableau& t, int r) {
  double worst = 0;
  for (int k = 1; k <= r; ++k) {
    const Vector left = t.A.transpose() * (t.b.array() * t.c.array().pow(k - 1)).matrix();
    const Vector right = t.b.array() * (1 - t.c.array().pow(k)) / k;
    worst = std::max(worst, (left - right).cwiseAbs().maxCoeff());
  }
  return worst;
}

namespace {

// Coefficients are correct to half a unit in the last place and at most a few in size; sums of up to 81 of them.
constexpr double kRounding = 1e-13;

}  // namespace

int verified_order(const ButcherTableau& t) {
  const auto largest = [&](double (*residual)(const ButcherTableau&, int)) {
    int k = 0;
    while (k < 2 * t.n_s && residual(t, k + 1) <= kRounding) ++k;
    return k;
  };
  const int p = largest(residual_B), q = largest(residual_C), r = largest(residual_D);
  return std::max(std::min({p, q + r + 1, 2 * q + 2}), order_from_trees(t.A, t.b, std::min(6, p), kRounding));
}

ButcherTableau read_tableau_file(const std::string& path) {
  const TableauFile file(path, {"A", "b"}, {"name", "source", "c", "order"});
  ButcherTableau t;
  t.name = file.text("name", path);
  t.n_s = file.stages();
  t.b = file.vector("b", t.n_s);
  t.A = file.square_matrix("A", t.n_s);
  t.c = file.abscissae(t.A, kRounding);
  const int confirmed = verified_order(t);
  if (confirmed < 1) throw InputError(file.field("b"), t.b.sum(), "the weights must sum to 1");
  t.order = file.order("order", confirmed);
  t.right_end = right_end_weights(t);
  t.diagonal = diagonalized(t.A);
  return t;
}

}  // namespace ricochet
