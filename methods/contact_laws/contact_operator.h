#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/bilateral_constraints.h"
#include "methods/contact_laws/delassus.h"
#include "methods/linear_algebra/islands.h"
#include "problems/disjoint_sets.h"
#include "problems/packed_column.h"
#include "problems/problem.h"

namespace ricochet {

/// The contact directions D = [J_n, J_t] of one instant, and the effect of impulses r along them:
///
///   x+ = x + P W D r                                                                    (1)
///   D' x+ = D' x + G r,   G = D' P W D                                                  (2)
///
/// x: a velocity or an acceleration; W: the inverse of the mass matrix or of the iteration matrix of a method; P: the
/// projection onto the bilateral constraints (bilateral_constraints.h), which react to r with impulses of their own; G:
/// the Delassus matrix of any set of contacts.
///
/// W couples only coordinates of the same island, so an impulse moves only the islands that its contact touches. D and
/// P W D are stored with these entries only, and G with the blocks of contacts that touch a common island. Bilateral
/// constraints make all coordinates one island.
///
/// Columns of a contact: d = 0 is the normal, d = 1, ... are its tangents. W is a BlockInverse or a MassInverse: it has
/// islands() and apply(), for all islands or for some. Nothing allocates while the islands of W stay the same.
class ContactOperator {
 public:
  /// Treatment of bilateral constraints: P of (1) keeps them, or they are contacts like the others and P = I.
  enum class Joints { eliminated, as_contacts };

  /// @param normal_only  as if no contact had tangents
  explicit ContactOperator(const Problem& problem, bool normal_only = false, Joints joints = Joints::eliminated);

  /// D of all contacts at q.
  void set_directions(const Vector& q);
  /// The same of these `contacts` and the bilateral ones; that of others stays unchanged.
  void set_directions(const Vector& q, std::span<const int> contacts);

  /// Sets P W D of these contacts; that of others stays unchanged.
  /// @return false when bilateral constraints depend on each other
  template <class Inverse>
  bool set_responses(std::span<const int> contacts, const Inverse& W) {
    set_islands(W.islands());
    if (has_bilateral_) {
      const auto solve = [&](auto column) {
        column_ = column;
        W.apply(column_, product_);
        column = product_;
      };
      const bool is_regular = bilateral_.prepare(packed_n_.data(), solve);
      column_.setZero();
      if (!is_regular) return false;
    }
    for (const int i : contacts) {
      for (int d = 0; d <= n_t(i); ++d) {
        scatter(i, d);
        W.apply(touched(i), column_, product_);
        gather(i, d);
      }
    }
    return true;
  }

  int n_t(int contact) const { return normal_only_ ? 0 : info_.contacts[contact].n_t; }

  /// D_d' x of a contact.
  double dot(int contact, int d, const auto& x) const {
    return packed_dot(info_.contacts[contact], column(contact, d), x);
  }
  /// |D_d|' |x|, the scale of the rounding error of D_d' x.
  double terms(int contact, int d, const auto& x) const {
    return packed_terms(info_.contacts[contact], column(contact, d), x);
  }
  /// Column d of D of a contact, its entries at the support.
  const double* column(int contact, int d) const {
    const auto& info = info_.contacts[contact];
    return d == 0 ? packed_n_.data() + info.normal_begin
                  : packed_t_.data() + info.tangent_begin + (d - 1) * info.support.size();
  }

  // The functions below are for contacts whose responses are set.

  /// (1) of the impulse r along column d of a contact. @param Lambda_n  n_c: impulses of the bilateral constraints are
  /// added
  void push(int contact, int d, double r, Eigen::Ref<Vector> x, Eigen::Ref<Vector> Lambda_n) const;
  /// Adds |r| |P W D_d|, the velocities that cancel in (1).
  void add_size(int contact, int d, double r, Vector& size) const;
  /// Entry (row, d) of its own block of G.
  double own_delassus(int contact, int row, int d) const;
  /// G of some contacts, in their order.
  void assemble(std::span<const int> contacts, Delassus& G);
  /// Islands of contacts that move the same coordinates, by their numbers in the list.
  void find_islands(std::span<const int> contacts, Islands& islands);

  BilateralConstraints& bilateral() { return bilateral_; }
  const BilateralConstraints& bilateral() const { return bilateral_; }

 private:
  void set_islands(const Islands& islands);
  void scatter(int contact, int d);
  void gather(int contact, int d);
  void find_pattern(std::span<const int> contacts, Delassus& G);
  std::span<const int> touched(int contact) const {
    return {touched_.data() + touched_begin_[contact], touched_.data() + touched_begin_[contact + 1]};
  }
  std::span<const int> moved(int contact) const {
    return {moved_.data() + moved_begin_[contact], moved_.data() + moved_begin_[contact + 1]};
  }
  /// Column d of P W D of a contact, its entries at the coordinates that it moves.
  const double* response(int contact, int d) const {
    return responses_.data() + response_begin_[contact] + d * moved(contact).size();
  }
  int reaction_column(int contact, int d) const {
    return d == 0 ? contact : info_.n_c() + info_.contacts[contact].tangent_index + d - 1;
  }

  const Problem& problem_;
  const ProblemInfo& info_;
  const bool normal_only_, has_bilateral_;
  BilateralConstraints bilateral_;
  Matrix reactions_;  // n_c x (n_c + n_lambda_t): of the bilateral constraints to the columns of D
  Vector packed_n_, packed_t_;
  Vector column_, product_;  // n_q; column_ is zero between uses

  // The pattern, from the islands of W:
  Islands islands_;
  std::vector<int> touched_, touched_begin_;  // per contact: islands, ascending
  std::vector<int> moved_, moved_begin_;      // per contact: coordinates of these islands
  std::vector<int> support_in_moved_;         // where the entries of a packed J_n stand among `moved`
  std::vector<std::size_t> response_begin_;   // per contact: its columns in responses_
  std::vector<double> responses_;

  // Workspace of assemble() and find_islands().
  struct Visitor {
    int number = 0, next = -1;  // in the list of contacts; the next entry of touched_ with the same island, or -1
  };
  std::vector<Visitor> visitors_;   // per entry of touched_
  std::vector<int> first_visitor_;  // per island, -1 between uses
  std::vector<int> sizes_, neighbours_, mark_;
  DisjointSets sets_;
};

}  // namespace ricochet
