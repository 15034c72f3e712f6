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

  /// The region of `signs`, n_s, 0 where the motion slides (sliding.h). Its initial state and end time may be changed.
  /// @throws InputError as sliding_region()
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

/// Whether there is a region that slides on psi_k = 0 (sliding.h), and no contact that acts on psi_k is closed.
/// @param modes    of all contacts; empty if they are not known
/// @param why_not  set if the result is false
bool can_slide(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k,
               const std::vector<ContactMode>& modes, std::string& why_not);

/// Whether a motion goes on in that region from (q, v): can_slide(), psi_k is zero, and both of its sides lead back, with
/// (1) for the regions of sigma_k = 1 and -1:
///
///     psi_k' < 0 and psi_k' > 0                                                                                  (2)
///
/// False for a psi_k that depends on q and t only: its rate is the same on both sides. Other arguments as of can_slide().
bool slides(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q,
            const Vector& v, const std::vector<ContactMode>& modes, std::string& why_not);

/// Whether only the side of sigma_k leads away from psi_k = 0 at a state, and does so slowly: its rate (1) is less than a
/// tenth of that of the other side.
bool leaves_slowly(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v);

/// The side, 1 or -1, to which a motion leaves psi_k = 0 at a state: the one with the larger sigma_k psi_k' of (1).
int side_of_exit(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v);

/// Moves v to psi_k = 0 for the functions on which the motion slides, in the norm of M: what it has drifted by.
void hold_on_borders(RegionProblems& regions, const std::vector<int>& signs, const Vector& q, Vector& v);

/// Where contacts first act on the functions on which a `region` slides.
struct ActingContact {
  int contact = -1;        ///< -1: none does
  double t = 0;            ///< of its first event [s], from the begin of the piece
  bool is_closed = false;  ///< from the begin on, without an impact there
};

/// The first contact that acts on the functions on which the `region` slides (sliding.h) and is closed at the start of a
/// `piece` of a run, or has an event in it.
ActingContact acting_contact(const Problem& region, const Solution& piece);

}  // namespace ricochet
