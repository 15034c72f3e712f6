#pragma once

#include <span>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The rows of R' a + b = 0 in a set of modes, (2) of mode_dynamics.h, and the directions C of their forces: a row for the
/// gap of each closed contact, and for each tangent of one that sticks.
class ModeRows {
 public:
  /// A row: the gap of a contact, or its slip velocity along a tangent.
  struct Row {
    int contact = -1, tangent = -1;
  };

  explicit ModeRows(const Problem& problem);

  /// @param modes  n_c. Releases held directions.
  void set_modes(std::span<const ContactMode> modes);
  const std::vector<ContactMode>& modes() const { return modes_; }
  const std::vector<int>& closed() const { return closed_; }  ///< contacts that are not open
  bool is_affine() const { return is_affine_; }               ///< R and C are constant, b = 0
  bool is_symmetric() const { return !slips_; }               ///< C = R
  bool empty() const { return rows_.empty(); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows_.size()); }
  const Row& operator[](Eigen::Index r) const { return rows_[static_cast<std::size_t>(r)]; }
  int first(int contact) const { return first_[contact]; }  ///< row of a closed contact

  /// The direction of slip in space while it is zero or held. @param d  2, a unit vector; null to follow the velocity
  void hold_direction(int contact, const double* d);
  bool holds_direction(int contact) const { return is_held_[contact] != 0; }
  /// Slip direction of a contact, n_t components.
  const double* direction(int contact) const { return direction_.data() + info_.contacts[contact].tangent_index; }

  /// C at q, with the directions of slip at v. @param C  n_q x size()
  void set_columns(const double* q, const double* v, Matrix& C);
  /// b
  void set_rates(const double* q, const double* v, Vector& b);
  /// A column of R times x, at the last q of set_columns().
  double dot(const Row& row, const double* x) const;
  /// Adds a column of R as the direction of a force.
  void add(const Row& row, double* x) const;

 private:
  const double* entries(const Row& row) const {
    const auto& contact = info_.contacts[row.contact];
    return row.tangent < 0
               ? packed_n_.data() + contact.normal_begin
               : packed_t_.data() + contact.tangent_begin + row.tangent * static_cast<int>(contact.support.size());
  }
  void subtract_friction(int contact, const double* v, double* column);

  const Problem& problem_;
  const ProblemInfo& info_;
  std::vector<ContactMode> modes_;
  std::vector<int> closed_, first_;
  std::vector<Row> rows_;
  bool has_friction_ = false, turns_ = false;  // closed contacts: with tangents; with tangents that depend on q
  bool is_affine_ = true, slips_ = false;
  std::vector<char> is_held_;  // per contact
  Vector direction_;           // n_lambda_t, d of slipping contacts
  Vector packed_n_, packed_t_, bias_;
  Matrix T_;
};

}  // namespace ricochet
