#pragma once

#include <vector>

#include "problems/packed_column.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet::reference {

/// The closed contacts of a set of modes: their columns of J, which of their forces are unknown, and how they slip.
class ClosedContacts {
 public:
  /// One closed contact: its columns of J, normal and, with friction, tangents; its unknown forces, normal and, if it
  /// sticks, tangential.
  struct Part {
    const ContactInfo* info;
    int contact;
    Eigen::Index column, row;
    int n_t, n_stuck;  ///< tangential columns, and unknowns among them: n_t or 0
  };
  /// Entries of a column of J, on the support of its contact.
  struct Column {
    double dot(const double* x) const { return packed_dot(*info, J, x); }

    const ContactInfo* info;
    const double* J;
    Eigen::Index index;
  };

  /// @param problem  must outlive this object
  explicit ClosedContacts(const Problem& problem);
  ClosedContacts(const ClosedContacts&) = delete;  // columns point into it

  void set_modes(const std::vector<ContactMode>& modes);
  /// Fixes the slip direction of contact i, which slips in space. @param d  as of ContactDynamics
  void hold_direction(int i, const Vector& d);

  const std::vector<ContactMode>& modes() const { return modes_; }
  const std::vector<int>& closed() const { return closed_; }
  const std::vector<Part>& parts() const { return parts_; }          ///< by closed contact
  const std::vector<Column>& columns() const { return columns_; }    ///< all
  const std::vector<Column>& unknowns() const { return unknowns_; }  ///< by unknown force
  bool is_affine() const { return is_affine_; }                      ///< all closed contacts are
  bool follows_velocity() const { return follows_velocity_; }        ///< a slip direction does
  const double* direction(const Part& part) const { return direction_.data() + part.info->tangent_index; }

  /// J of the closed contacts at q.
  void evaluate(const double* q);
  /// Slip directions that follow the velocity v.
  void set_directions(const double* v);

 private:
  const Problem& problem_;
  std::vector<ContactMode> modes_;
  std::vector<int> closed_;
  std::vector<Part> parts_;
  std::vector<Column> columns_, unknowns_;
  bool is_affine_ = false, follows_velocity_ = false;
  Vector direction_;                   // n_lambda_t: of slipping contacts
  std::vector<char> holds_direction_;  // n_c
  Vector packed_n_, packed_t_;
};

}  // namespace ricochet::reference
