#include "methods/contact_laws/contact_prediction.h"

#include <algorithm>
#include <cmath>

#include "methods/linear_algebra/breadth_first.h"

namespace ricochet {
namespace {

// Corrections of the modes. A contact that breaks or slips changes its neighbours, and so on: a few dozen at most.
constexpr int kMaxCorrections = 60;
// Pivots of the band matrix, relative to their column, below which contacts are redundant.
constexpr double kDependent = 1e-11;

}  // namespace

/// Island after island of what G connects, each breadth first from an end.
void ContactPrediction::order_by_levels(const Delassus& G) {
  const int n = G.n_contacts();
  order_.resize(n);
  const auto visit_neighbours = [&](int i, auto visit) {
    for (int k = 0; k < G.n_neighbours(i); ++k) visit(G.block(i, k).contact);
  };
  int start = 0;
  for (int pass = 0; pass < 2; ++pass) {
    place_.assign(n, -1);
    for (int first = start, count = 0; count < n; first = (first + 1) % n)
      count = append_breadth_first(first, count, order_, place_, visit_neighbours);
    start = order_[n - 1];
  }
}

/// (1) for the modes of the contacts; r_n and r_t of all.
bool ContactPrediction::solve_linear(const Delassus& G, const Eigen::Ref<const Vector>& b,
                                     std::span<const FrictionProblem::Contact> contacts, Eigen::Ref<Vector> r) {
  const auto unknowns = [&](int i) {
    return contacts[i].mode == ContactMode::open ? 0 : contacts[i].mode == ContactMode::stick ? 1 + contacts[i].n_t : 1;
  };
  first_.resize(order_.size());
  int n = 0;
  for (const int i : order_) {
    first_[i] = n;
    n += unknowns(i);
  }
  r.setZero();
  if (n == 0) return true;
  int width = 0;
  for (const int i : order_) {
    for (int k = 0; k < G.n_neighbours(i); ++k) {
      const int j = G.block(i, k).contact;
      if (unknowns(i) > 0 && unknowns(j) > 0) width = std::max(width, first_[j] + unknowns(j) - 1 - first_[i]);
    }
  }
  band_.set_zero(n, width, width);
  x_.resize(n);
  for (const int i : order_) {
    for (int e = 0; e < unknowns(i); ++e) x_[first_[i] + e] = -b[G.row(i) + e];
    for (int k = 0; k < G.n_neighbours(i) && unknowns(i) > 0; ++k) {
      const auto block = G.block(i, k);
      const auto& other = contacts[block.contact];
      for (int e = 0; e < unknowns(i); ++e) {
        const auto value = [&](int d) { return block.values[d * G.size(i) + e]; };
        for (int d = 0; d < unknowns(block.contact); ++d)
          band_.entry(first_[i] + e, first_[block.contact] + d) += value(d);
        if (unknowns(block.contact) != 1) continue;
        for (int d = 0; d < other.n_t; ++d)
          band_.entry(first_[i] + e, first_[block.contact]) -= other.mu * other.direction[d] * value(1 + d);
      }
    }
  }
  band_.factorize();
  if (!(band_.smallest_pivot() > kDependent)) return false;
  band_.solve(x_.data());
  for (const int i : order_) {
    if (unknowns(i) == 0) continue;
    for (int e = 0; e < unknowns(i); ++e) r[G.row(i) + e] = x_[first_[i] + e];
    for (int d = 0; d < contacts[i].n_t && unknowns(i) == 1; ++d)
      r[G.row(i) + 1 + d] = -contacts[i].mu * contacts[i].direction[d] * r[G.row(i)];
  }
  return true;
}

bool ContactPrediction::solve(const Delassus& G, const Eigen::Ref<const Vector>& b, double rounding,
                              std::span<FrictionProblem::Contact> contacts, Eigen::Ref<Vector> r) {
  order_by_levels(G);
  const auto closed_mode = [](const FrictionProblem::Contact& contact) {
    if (contact.n_t == 0) return ContactMode::closed;
    return contact.slides ? slip_mode(contact.n_t, contact.direction) : ContactMode::stick;
  };
  for (auto& contact : contacts) contact.mode = closed_mode(contact);
  const int n = G.n_contacts();
  w_.resize(n > 0 ? G.n_rows() : 0);
  for (int correction = 0; correction < kMaxCorrections; ++correction) {
    if (!solve_linear(G, b, contacts, r)) return false;
    bool is_right = true;
    for (int i = 0; i < n; ++i) {
      auto& contact = contacts[i];
      const double* force = r.data() + G.row(i);
      const ContactMode before = contact.mode;
      const double least = rounding / G.diagonal(i, 0);
      double w[3];
      if (contact.mode == ContactMode::open) {
        G.row_times(i, r.data(), b.data(), w);
        if (w[0] < -rounding) contact.mode = closed_mode(contact);
      } else if (force[0] <= least) {
        contact.mode = ContactMode::open;
      } else if (contact.mode == ContactMode::stick) {
        const double cone = contact.mu * force[0];
        if (std::hypot(force[1], contact.n_t > 1 ? force[2] : 0) > cone + least) {
          if (contact.n_t > 1) return false;
          contact.direction[0] = force[1] > 0 ? -1 : 1;
          contact.mode = slip_mode(1, contact.direction);
        }
      } else if (contact.n_t == 1 && !contact.slides) {
        G.row_times(i, r.data(), b.data(), w);
        if (contact.direction[0] * w[1] < -rounding) contact.mode = ContactMode::stick;
      }
      is_right = is_right && contact.mode == before;
    }
    if (is_right) return true;
  }
  return false;
}

}  // namespace ricochet
