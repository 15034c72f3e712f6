#include "reference/coulomb_enumeration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "problems/dense_solve.h"
#include "problems/input_error.h"
#include "reference/force_equations.h"
#include "reference/scales.h"

namespace ricochet::reference {
namespace {

// Number of starting angles of Newton's method per contact that slips in space. Four suffice if G is nearly isotropic;
// eight also find the second solution of an indeterminate state.
constexpr int kAngles = 8;
// Contacts whose singular combinations are tried, which takes a hundred times as long.
constexpr std::size_t kMaxRedundant = 5;

Vector unit(double angle) {
  Vector d(2);
  d << std::cos(angle), std::sin(angle);
  return d;
}

class Enumeration {
 public:
  Enumeration(const Matrix& G, const Vector& b, const Vector& b_size, const std::vector<CoulombContact>& contacts)
      : G_(G),
        b_(b),
        b_size_(b_size),
        z_size_(b_size.cwiseQuotient(G.diagonal()).maxCoeff()),
        contacts_(contacts),
        modes_(contacts.size()),
        direction_(contacts.size()) {
    int row = 0;
    for (const auto& contact : contacts) {
      row_.push_back(row);
      row += 1 + contact.n_t;
    }
  }

  std::vector<CoulombSolution> solve() {
    try_modes(0);
    if (solutions_.empty() && contacts_.size() <= kMaxRedundant) {
      singular_ = ForceEquations::Singular::divide;
      try_modes(0);
    }
    return std::move(solutions_);
  }

 private:
  /// Tries the modes of contact k, in the order of their active conditions, for every choice of the contacts before it.
  void try_modes(std::size_t k) {
    if (k == contacts_.size()) return try_combination();
    const auto& contact = contacts_[k];
    const bool is_free = contact.direction.size() == 0;
    const auto choose = [&](ContactMode mode, const Vector& direction) {
      modes_[k] = mode;
      direction_[k] = direction;
      try_modes(k + 1);
    };
    choose(ContactMode::open, {});
    if (contact.n_t == 0) return choose(ContactMode::closed, {});
    if (is_free) choose(ContactMode::stick, {});
    if (contact.n_t == 2) return choose(ContactMode::slip, contact.direction);
    for (const int sign : {1, -1}) {
      if (is_free || contact.direction[0] * sign > 0)
        choose(sign > 0 ? ContactMode::slip_positive : ContactMode::slip_negative, Vector::Constant(1, sign));
    }
  }

  /// Solves for the current modes; unknown directions from every starting angle.
  void try_combination() {
    std::vector<std::size_t> turning;  // slip in space with the direction unknown
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      if (modes_[k] == ContactMode::slip && contacts_[k].direction.size() == 0) turning.push_back(k);
    }
    if (turning.empty()) return accept(linear_solution());
    for (const Vector& start : starting_angles(turning)) accept(newton(turning, start));
  }

  /// For up to two contacts, every combination of kAngles angles. For more, which would take minutes, all contacts
  /// start from the direction of their b_t, the slip without contact forces, turned by the same angle.
  std::vector<Vector> starting_angles(const std::vector<std::size_t>& turning) const {
    const auto n = static_cast<Eigen::Index>(turning.size());
    const auto nth = [](int k) { return 2 * std::numbers::pi / kAngles * k; };
    std::vector<Vector> starts;
    for (int first = 0; first < kAngles; ++first) {
      if (n <= 2) {
        for (int second = 0; second < (n == 2 ? kAngles : 1); ++second) {
          starts.emplace_back(Vector::Constant(n, nth(first)));
          starts.back()[n - 1] += nth(second);
        }
        continue;
      }
      Vector angles(n);
      for (Eigen::Index j = 0; j < n; ++j) {
        const int row = row_[turning[static_cast<std::size_t>(j)]];
        angles[j] = std::atan2(b_[row + 2], b_[row + 1]) + nth(first);
      }
      starts.push_back(angles);
    }
    return starts;
  }

  void set_angles(const std::vector<std::size_t>& turning, const Vector& angles) {
    for (std::size_t j = 0; j < turning.size(); ++j)
      direction_[turning[j]] = unit(angles[static_cast<Eigen::Index>(j)]);
  }

  /// u_t perpendicular to the slip directions, relative to all velocities; empty if the linear system is singular.
  std::optional<Vector> across(const std::vector<std::size_t>& turning, const Vector& angles) {
    set_angles(turning, angles);
    const auto solution = linear_solution();
    if (!solution) return std::nullopt;
    Vector residual(angles.size());
    for (Eigen::Index j = 0; j < residual.size(); ++j) {
      const auto k = turning[static_cast<std::size_t>(j)];
      const Vector& d = direction_[k];
      residual[j] = -d[1] * solution->u[row_[k] + 1] + d[0] * solution->u[row_[k] + 2];
    }
    return residual / u_size(*solution);
  }

  /// Directions for which u_t _|_ d_perp holds, with central differences for the derivative: the residual stays exact.
  std::optional<CoulombSolution> newton(const std::vector<std::size_t>& turning, Vector angles) {
    const Eigen::Index n = angles.size();
    for (int iteration = 0; iteration < 50; ++iteration) {
      const auto residual = across(turning, angles);
      if (!residual) return std::nullopt;
      Matrix derivative(n, n);
      for (Eigen::Index j = 0; j < n; ++j) {
        constexpr double kStep = 1e-5;  // cube root of the rounding
        const Vector step = kStep * Vector::Unit(n, j);
        const auto above = across(turning, angles + step), below = across(turning, angles - step);
        if (!above || !below) return std::nullopt;
        derivative.col(j) = (*above - *below) / (2 * kStep);
      }
      Vector change = -FullPivotingFactors(derivative).solve(*residual);
      if (!change.allFinite()) return std::nullopt;
      const double largest = change.cwiseAbs().maxCoeff();
      angles += change * std::min(1.0, 0.5 / largest);  // half a radian, or it leaves for another solution
      if (largest < 1e-14) break;
    }
    const auto residual = across(turning, angles);
    if (!residual || residual->cwiseAbs().maxCoeff() > kLawRounding) return std::nullopt;
    set_angles(turning, angles);
    return linear_solution();
  }

  /// Solves (1) with the equations of the modes; the least of several solutions with one motion; nothing if none.
  std::optional<CoulombSolution> linear_solution() const {
    const Eigen::Index n = b_.size();
    Matrix force = Matrix::Zero(n, n), condition = Matrix::Zero(n, n);  // z = force x, condition' u = 0
    Eigen::Index size = 0;
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      if (modes_[k] == ContactMode::open) continue;
      condition(row_[k], size) = force(row_[k], size) = 1;
      if (is_slipping(modes_[k]))
        force.col(size).segment(row_[k] + 1, contacts_[k].n_t) = -contacts_[k].mu * direction_[k];  // (3)
      ++size;
      if (modes_[k] != ContactMode::stick) continue;
      for (int d = 1; d <= contacts_[k].n_t; ++d, ++size) condition(row_[k] + d, size) = force(row_[k] + d, size) = 1;
    }
    CoulombSolution solution{modes_, Vector::Zero(n), b_};
    if (size == 0) return solution;
    const auto E = condition.leftCols(size), F = force.leftCols(size);
    const Matrix GF = G_ * F;
    const ForceEquations equations(E.transpose() * GF, (E.transpose() * G_ * E).diagonal(), singular_);
    const auto x = equations.solve(-(E.transpose() * b_), E.transpose() * b_size_);
    if (!x || !equations.determines_motion(G_.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * GF))
      return std::nullopt;
    solution.z = F * *x;
    solution.u = G_ * solution.z + b_;
    return solution;
  }

  double u_size(const CoulombSolution& s) const {
    return (G_.cwiseAbs() * s.z.cwiseAbs() + b_size_).maxCoeff() + std::numeric_limits<double>::min();
  }

  /// Size of vanishing impulses: those that cancel the largest term of b.
  double z_size(const CoulombSolution& s) const { return std::max(z_size_, s.z.cwiseAbs().maxCoeff()); }

  /// Stores a solution if its inequalities hold and its z is new.
  void accept(const std::optional<CoulombSolution>& s) {
    if (!s) return;
    const double z_rounding = kLawRounding * z_size(*s), u_rounding = kLawRounding * u_size(*s);
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      const int row = row_[k], n_t = contacts_[k].n_t;
      if (s->modes[k] == ContactMode::open && s->u[row] < -u_rounding) return;  // (2)
      if (s->z[row] < -z_rounding) return;                                      // (2)
      const auto z_t = s->z.segment(row + 1, n_t), u_t = s->u.segment(row + 1, n_t);
      if (s->modes[k] == ContactMode::stick && z_t.norm() > contacts_[k].mu * s->z[row] + z_rounding) return;  // (3)
      const bool decided = is_slipping(s->modes[k]) && contacts_[k].direction.size() == 0;
      if (decided && direction_[k].dot(u_t) < -u_rounding) return;  // (3)
    }
    for (const auto& other : solutions_) {
      // Newton's method returns a direction to about the square root of kLawRounding where u_t nearly vanishes.
      const double size = std::max(z_size(*s), z_size(other));
      if ((s->z - other.z).cwiseAbs().maxCoeff() <= std::sqrt(kLawRounding) * size) return;
    }
    solutions_.push_back(*s);
  }

  const Matrix& G_;
  const Vector &b_, &b_size_;
  const double z_size_;
  const std::vector<CoulombContact>& contacts_;
  std::vector<int> row_;
  std::vector<ContactMode> modes_;
  std::vector<Vector> direction_;
  ForceEquations::Singular singular_ = ForceEquations::Singular::refuse;
  std::vector<CoulombSolution> solutions_;
};

}  // namespace

std::vector<CoulombSolution> solve_coulomb_by_enumeration(const Matrix& G, const Vector& b, const Vector& b_size,
                                                          const std::vector<CoulombContact>& contacts) {
  const bool in_space = std::ranges::any_of(contacts, [](const CoulombContact& contact) { return contact.n_t == 2; });
  if (contacts.size() > most_contacts(in_space))
    throw InputError("simultaneous contacts with friction", contacts.size(),
                     fmt::format("at most {} can be enumerated", most_contacts(in_space)));
  return Enumeration(G, b, b_size, contacts).solve();
}

}  // namespace ricochet::reference
