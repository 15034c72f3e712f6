#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

/// @file
/// RegionProblems, and what runs from region to region have in common.

namespace ricochet {

/// The regions of a problem, made when they are entered.
class RegionProblems {
 public:
  /// The `problem` must outlive this object.
  explicit RegionProblems(const Problem& problem) : problem_(problem) {}
  ~RegionProblems();
  RegionProblems(const RegionProblems&) = delete;
  RegionProblems& operator=(const RegionProblems&) = delete;

  /// The region of `signs`, n_s. Its initial state and end time may be changed.
  Problem& at(const std::vector<int>& signs);

 private:
  const Problem& problem_;
  std::map<std::vector<int>, std::unique_ptr<Problem>> made_;
};

/// Why no motion goes on from q in the `region` beyond psi_k = 0: a gap jumps below zero there. Empty if none does.
std::string jumped_gap(const Problem& region, const Vector& q, const SwitchInfo& psi);

/// Why the motion that begins at the initial state of the `problem` is not unique: a psi_k vanishes there, and leads away
/// on both sides. With the accelerations a of the regions of sigma_k = 1 and -1, and all contacts open,
///
///     psi_k' > 0 and psi_k' < 0,   psi_k' = dpsi_k/dq v + dpsi_k/dv a                                         (1)
///
/// or, where psi_k depends on q only and psi_k' = 0, the same of psi_k''. Empty if there is no such psi_k, or if a contact
/// touches. @param signs  of the region in which the motion would begin
std::string ambiguous_start(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs);

/// Adds a `piece` of a run to the `whole`, at whose end it begins. Contacts that the border between them has changed
/// get an event. Derivatives are left alone.
/// @param modes  of all contacts at the end of `whole`; empty at its start, or if the method has no modes
void append(const ProblemInfo& info, Solution piece, Solution& whole, std::vector<ContactMode>& modes);

}  // namespace ricochet
