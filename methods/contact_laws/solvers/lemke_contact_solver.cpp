// Contact problems as linear complementarity problems, solved by pivoting: exact, for a few dozen contacts.
//
// The friction disc of radius 1 is a polygon with vertices d_f, in the plane +-1 (friction_polygon.h), r_t = sum_f
// beta_f d_f. Unknowns z = (r_n, beta, gamma), contact after contact in each:
//
//   0 <= r_n    _|_  w_n >= 0                          Coulomb's law                       (1)
//                    w_n - mu gamma >= 0               associated law                     (1b)
//   0 <= beta_f _|_  d_f' w_t + gamma >= 0                                                 (2)
//   0 <= gamma  _|_  mu (r_n + p) - sum_f beta_f >= 0                                      (3)
//
// with w = G r + b. gamma is the slip speed. The matrix is copositive with (1) and positive semidefinite with (1b), so
// Lemke's method ends with a solution when there is one.
//
// Source: Stewart, Trinkle, IJNME 39 (1996), eq. (12)-(16); (1b): Anitescu, Math. Program. 105 (2006).

#include <limits>

#include "methods/complementarity/lemke.h"
#include "methods/contact_laws/solvers/contact_solver.h"

namespace ricochet {
namespace {

class LemkeContactSolver final : public ContactSolver {
 public:
  explicit LemkeContactSolver(int facets) : polygon_(facets) {}

  ContactStatus solve(const ContactProblem& problem, Vector& r) override;
  const FrictionPolygon& polygon() const override { return polygon_; }
  void count(Counters& counters) override {
    counters.pivots += pivots_;
    pivots_ = 0;
  }

 private:
  int facets(const ContactProblem::Contact& contact) const {
    return contact.n_t == 2 ? polygon_.facets() : 2 * contact.n_t;
  }
  void reserve(const ContactProblem& problem);
  void set_matrix(const ContactProblem& problem);
  void mark_basis_of_open_contacts(const ContactProblem& problem, const Vector& r);

  FrictionPolygon polygon_;
  LemkeSolver lemke_;
  Matrix G_, M_;
  Vector q_, z_, column_;
  std::vector<int> last_;  // contacts that z_ belongs to
  int n_columns_ = 0, size_ = 0, pivots_ = 0;
};

void LemkeContactSolver::reserve(const ContactProblem& problem) {
  n_columns_ = problem.G.n_contacts();
  int n_frictional = 0;
  for (const auto& contact : problem.contacts) {
    n_columns_ += facets(contact);
    n_frictional += contact.n_t > 0;
  }
  size_ = n_columns_ + n_frictional;
  const int n = problem.G.n_rows();
  if (n > G_.rows()) {
    G_.resize(n, n);
    column_.resize(n);
  }
  if (size_ > M_.rows()) {
    M_.resize(size_, size_);
    q_.resize(size_);
    z_.setZero(size_);
    last_.clear();
    lemke_.resize(size_);
  }
  const auto same = [](int id, const auto& contact) { return id == contact.id; };
  if (!std::equal(last_.begin(), last_.end(), problem.contacts.begin(), problem.contacts.end(), same)) {
    z_.setZero();
    last_.clear();
    for (const auto& contact : problem.contacts) last_.push_back(contact.id);
  }
}

void LemkeContactSolver::set_matrix(const ContactProblem& problem) {
  problem.G.to_dense(G_);
  const int n_c = problem.G.n_contacts(), n = problem.G.n_rows();
  auto M = M_.topLeftCorner(size_, size_);
  M.setZero();
  // Rows of column `c`, whose impulse moves the contacts by G times its direction.
  const auto fill = [&](int c) {
    int row = n_c;
    for (int i = 0; i < n_c; ++i) {
      const int begin = problem.G.row(i), n_t = problem.contacts[i].n_t, n_f = facets(problem.contacts[i]);
      M(i, c) = column_[begin];
      for (int f = 0; f < n_f; ++f, ++row) {
        const auto d = facet_direction(n_t, f, n_f);
        M(row, c) = d[0] * column_[begin + 1] + (n_t == 2 ? d[1] * column_[begin + 2] : 0);
      }
    }
  };
  int column = n_c, gamma = n_columns_;
  for (int j = 0; j < n_c; ++j) {
    const auto& contact = problem.contacts[j];
    const int begin = problem.G.row(j), n_f = facets(contact);
    column_.head(n) = G_.col(begin).head(n);
    fill(j);
    if (n_f == 0) continue;
    M(gamma, j) = contact.mu;
    if (problem.law == FrictionLaw::associated) M(j, gamma) = -contact.mu;
    for (int f = 0; f < n_f; ++f, ++column) {
      const auto d = facet_direction(contact.n_t, f, n_f);
      column_.head(n) = d[0] * G_.col(begin + 1).head(n);
      if (contact.n_t == 2) column_.head(n) += d[1] * G_.col(begin + 2).head(n);
      fill(column);
      M(column, gamma) = 1;
      M(gamma, column) = -1;
    }
    ++gamma;
  }
}

ContactStatus LemkeContactSolver::solve(const ContactProblem& problem, Vector& r) {
  reserve(problem);
  set_matrix(problem);
  const int n_c = problem.G.n_contacts();
  int column = n_c, gamma = n_columns_;
  for (int i = 0; i < n_c; ++i) {
    const auto& contact = problem.contacts[i];
    const double* b = problem.b.data() + problem.G.row(i);
    q_[i] = b[0];
    const int n_f = facets(contact);
    for (int f = 0; f < n_f; ++f) {
      const auto d = facet_direction(contact.n_t, f, n_f);
      q_[column++] = d[0] * b[1] + (contact.n_t == 2 ? d[1] * b[2] : 0);
    }
    if (n_f > 0) q_[gamma++] = contact.mu * contact.present;
  }
  const LcpStatus status = lemke_.solve_warm(M_.topLeftCorner(size_, size_), q_.head(size_), z_.head(size_));
  pivots_ += lemke_.pivots();
  if (status != LcpStatus::solved)
    return status == LcpStatus::ray ? ContactStatus::no_solution : ContactStatus::iteration_limit;

  column = n_c;
  for (int i = 0; i < n_c; ++i) {
    const auto& contact = problem.contacts[i];
    double* r_i = r.data() + problem.G.row(i);
    r_i[0] = z_[i];
    for (int d = 0; d < contact.n_t; ++d) r_i[1 + d] = 0;
    const int n_f = facets(contact);
    for (int f = 0; f < n_f; ++f, ++column) {
      const auto e = facet_direction(contact.n_t, f, n_f);
      for (int d = 0; d < contact.n_t; ++d) r_i[1 + d] += e[d] * z_[column];
    }
  }
  clear_open_contacts(problem, r);
  mark_basis_of_open_contacts(problem, r);
  return ContactStatus::solved;
}

/// An open contact that slips has gamma > 0 = mu r_n - sum beta: only with the facet that determines gamma, whose beta
/// is zero, do they make a basis. The warm start of the next step takes what is positive for one. In the plane only:
/// bodies in space on redundant contacts have bases that rounding would choose between.
void LemkeContactSolver::mark_basis_of_open_contacts(const ContactProblem& problem, const Vector& r) {
  int column = problem.G.n_contacts(), gamma = n_columns_;
  for (int i = 0; i < problem.G.n_contacts(); ++i) {
    const auto& contact = problem.contacts[i];
    const int n_f = facets(contact);
    if (contact.n_t == 1 && z_[i] == 0 && contact.present == 0 && z_[gamma] > 0) {
      double w[3];
      problem.G.row_times(i, r.data(), problem.b.data(), w);
      const int facet = w[1] > 0 ? 1 : 0;
      z_.segment(column, n_f).setZero();
      z_[column + facet] = std::numeric_limits<double>::min();
    }
    column += n_f;
    gamma += n_f > 0;
  }
}

}  // namespace

std::unique_ptr<ContactSolver> make_lemke_contact_solver(int facets) {
  return std::make_unique<LemkeContactSolver>(facets);
}

}  // namespace ricochet
