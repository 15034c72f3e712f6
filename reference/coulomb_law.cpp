#include "reference/coulomb_law.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/disjoint_sets.h"
#include "reference/force_division.h"
#include "reference/force_equations.h"
#include "reference/scales.h"

namespace ricochet::reference {
namespace {

/// Rows of each contact.
std::vector<std::vector<Eigen::Index>> rows_of(const std::vector<CoulombContact>& contacts) {
  std::vector<std::vector<Eigen::Index>> rows;
  Eigen::Index row = 0;
  for (const auto& contact : contacts) {
    rows.emplace_back();
    for (int d = 0; d <= contact.n_t; ++d) rows.back().push_back(row++);
  }
  return rows;
}

class Law {
 public:
  explicit Law(const ContactQuestion& question)
      : question_(question),
        G_(question.J.transpose() * question.MJ),
        rows_(rows_of(question.contacts)),
        answer_{{},
                {},
                std::vector<ContactMode>(question.contacts.size(), ContactMode::open),
                Vector::Zero(question.b.size()),
                question.b,
                question.b_size} {}

  ContactAnswer answer() {
    for (const auto& group : groups()) {
      decide(group);
      if (!answer_.failure.empty()) break;
    }
    return std::move(answer_);
  }

 private:
  using Group = std::vector<std::size_t>;  // contacts

  /// Contacts that act on each other.
  std::vector<Group> groups() const {
    const int n = static_cast<int>(rows_.size());
    DisjointSets sets(n);
    const Vector size = G_.diagonal().cwiseSqrt();
    for (int k = 0; k < n; ++k) {
      for (int l = 0; l < k; ++l) {
        const Matrix effect =
            G_(rows_[k], rows_[l]).cwiseAbs().cwiseQuotient(size(rows_[k]) * size(rows_[l]).transpose());
        if (effect.maxCoeff() > kLawRounding) sets.join(k, l);
      }
    }
    std::vector<Group> groups(rows_.size());
    for (int k = 0; k < n; ++k) groups[sets.of(k)].push_back(k);
    std::erase_if(groups, [](const Group& group) { return group.empty(); });
    return groups;
  }

  void decide(const Group& group) {
    std::vector<CoulombContact> contacts;
    std::vector<Eigen::Index> rows;
    bool in_space = false;
    for (const std::size_t k : group) {
      contacts.push_back(question_.contacts[k]);
      rows.insert(rows.end(), rows_[k].begin(), rows_[k].end());
      in_space = in_space || contacts.back().n_t == 2;
    }
    if (group.size() > most_contacts(in_space)) {
      answer_.failure =
          fmt::format("{} contacts act at once, and the reference, which tries every combination, at most {}",
                      group.size(), most_contacts(in_space));
      return;
    }
    const Matrix G = G_(rows, rows), MJ = question_.MJ(Eigen::all, rows);
    const Vector b_size = question_.b_size(rows);
    const auto solutions = solve_coulomb_by_enumeration(G, question_.b(rows), b_size, contacts);
    if (solutions.empty()) {
      answer_.failure =
          fmt::format("inconsistent: no combination of modes satisfies the {} at {}", question_.what, quoted(group));
      answer_.reason = {FailureCode::inconsistent, names(group)};
      return;
    }
    const auto weight = [&](const CoulombSolution& s) { return s.z.cwiseAbs2().dot(G.diagonal()); };
    CoulombSolution least = *std::ranges::min_element(solutions, {}, weight);
    for (const auto& other : solutions) {
      if (!same_motion(MJ, least.z, other.z)) return fail("motion", group, choices(group, least, other));
    }
    const Vector u_size = G.cwiseAbs() * least.z.cwiseAbs() + b_size;
    if (question_.stays) {
      const auto at_edge = edges(group, contacts, least, u_size);
      const bool is_open_to_choice = solutions.size() > 1 || !at_edge.empty();
      if (is_open_to_choice && !find_inner_division(G, question_.b(rows), contacts, u_size, least) && !at_edge.empty())
        return fail("forces only", group, at_edge);
    }
    for (std::size_t j = 0; j < group.size(); ++j) answer_.modes[group[j]] = least.modes[j];
    answer_.z(rows) = least.z;
    answer_.u(rows) = least.u;
    answer_.u_size(rows) = u_size;
  }

  bool same_motion(const Matrix& MJ, const Vector& z, const Vector& other) const {
    const Vector difference = MJ * (z - other);
    const Vector size = MJ.cwiseAbs() * (z.cwiseAbs() + other.cwiseAbs()) + question_.free.cwiseAbs();
    return (difference.cwiseAbs().array() <= kSame * size.array()).all();
  }

  std::vector<std::string> choices(const Group& group, const CoulombSolution& a, const CoulombSolution& b) const {
    std::vector<std::string> choices;
    for (std::size_t j = 0; j < group.size(); ++j) {
      if (a.modes[j] == b.modes[j]) continue;
      choices.push_back(
          fmt::format("'{}' may be {} or {}", question_.names[group[j]], to_string(a.modes[j]), to_string(b.modes[j])));
    }
    return choices;
  }

  /// Contacts that may stick and are at the edge of their cone without slipping.
  std::vector<std::string> edges(const Group& group, const std::vector<CoulombContact>& contacts,
                                 const CoulombSolution& s, const Vector& u_size) const {
    std::vector<std::string> edges;
    Eigen::Index row = 0;
    for (std::size_t j = 0; j < group.size(); ++j) {
      const auto& contact = contacts[j];
      if (is_slipping(s.modes[j]) && contact.direction.size() == 0 &&
          s.u.segment(row + 1, contact.n_t).norm() <= kSame * u_size.segment(row + 1, contact.n_t).maxCoeff())
        edges.push_back(fmt::format("'{}' may be stick or {}", question_.names[group[j]], to_string(s.modes[j])));
      row += 1 + contact.n_t;
    }
    return edges;
  }

  /// Replaces forces at the edge of cones by forces inside all cones, with every resting contact sticking, and
  /// unchanged slip. @return whether such forces exist
  bool find_inner_division(const Matrix& G, const Vector& b, const std::vector<CoulombContact>& contacts,
                           const Vector& u_size, CoulombSolution& solution) const {
    CoulombSolution inner = solution;
    Matrix conditions = Matrix::Zero(b.size(), b.size()), forces = conditions;  // by unknown: u' E = 0, z = F x
    std::vector<ForceCone> cones;
    Eigen::Index n = 0, row = 0;
    for (std::size_t k = 0; k < contacts.size(); row += 1 + contacts[k++].n_t) {
      const auto& contact = contacts[k];
      const auto tangents = Eigen::seqN(row + 1, contact.n_t);
      const auto is_zero = [&](Eigen::Index r) { return std::abs(solution.u[r]) <= kSame * u_size[r]; };
      if (!is_zero(row)) continue;
      const bool slips = contact.direction.size() > 0;
      bool rests = !slips;
      for (int d = 1; d <= contact.n_t; ++d) rests = rests && is_zero(row + d);
      if (!rests && !slips && solution.modes[k] == ContactMode::open) continue;
      if (!rests && !slips && !(solution.z[row] > 0)) return false;
      conditions(row, n) = forces(row, n) = 1;
      cones.push_back({n, rests ? contact.n_t : 0, contact.mu});
      if (slips) {
        forces.col(n)(tangents) = -contact.mu * contact.direction;
        inner.modes[k] = slip_mode(contact.n_t, contact.direction.data());
      } else if (!rests) {
        forces.col(n)(tangents) = solution.z(tangents) / solution.z[row];
      }
      ++n;
      if (!rests) continue;
      inner.modes[k] = contact.n_t > 0 ? ContactMode::stick : ContactMode::closed;
      for (int d = 1; d <= contact.n_t; ++d, ++n) conditions(row + d, n) = forces(row + d, n) = 1;
    }
    const auto E = conditions.leftCols(n), F = forces.leftCols(n);
    const Matrix GF = G * F;
    const ForceEquations equations(E.transpose() * GF, (E.transpose() * G * E).diagonal());
    const auto least = equations.solve(-(E.transpose() * b), E.transpose() * u_size);
    if (!least || !equations.determines_motion(G.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * GF)) return false;
    const Vector x = steadiest_division(*least, equations.null_space(), cones);
    if (!(slack(x, cones) > kSame * x.cwiseAbs().maxCoeff())) return false;
    inner.z = F * x;
    inner.u = G * inner.z + b;
    solution = inner;
    return true;
  }

  void fail(const char* difference, const Group& group, const std::vector<std::string>& choices) {
    answer_.failure =
        fmt::format("indeterminate: the {} has several solutions that differ in {}, {}", question_.what, difference,
                    choices.empty() ? "at " + quoted(group) : fmt::format("{}", fmt::join(choices, ", ")));
    answer_.reason = {FailureCode::indeterminate, names(group)};
  }

  std::vector<std::string> names(const Group& group) const {
    std::vector<std::string> names;
    for (const std::size_t k : group) names.push_back(question_.names[k]);
    return names;
  }
  std::string quoted(const Group& group) const { return fmt::format("'{}'", fmt::join(names(group), "', '")); }

  const ContactQuestion& question_;
  const Matrix G_;
  const std::vector<std::vector<Eigen::Index>> rows_;
  ContactAnswer answer_;
};

}  // namespace

ContactAnswer answer_coulomb_law(const ContactQuestion& question) {
  return Law(question).answer();
}

}  // namespace ricochet::reference
