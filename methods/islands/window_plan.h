#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/wide_box.h"
#include "problems/disjoint_sets.h"
#include "problems/problem.h"

namespace ricochet {

/// Which bodies may meet within a window of length H, and so have to be integrated together.
///
/// No coordinate is expected to get more energy than the fastest one has, or gets from the largest load,
///
///   |q_k(t + s) - q_k(t)| <= 3/2 (P H + F H^2 / 2) / sqrt(m_k) + margin (1 + |q_k|),   0 <= s <= H        (1)
///   P = max_k sqrt(m_k) |v_k|,   F = max_k |f_k| / sqrt(m_k),   M = diag(m)
///
/// The factor 3/2 allows for energy that passes between coordinates, and the margin for the moves of an instant. (1) is a
/// guess; the run checks it (island_run.h). Contacts whose gap is positive in the whole box (1) cannot close and take no
/// part. The others, which are *near*, join the coordinates that they touch to islands. Each island is a part of the scene
/// with its near contacts; the coordinates without one are parts of 16. The near contacts are searched among those that are
/// near in a wider box (wide_box.h), which stays for several windows.
///
/// The work of a part of n coordinates and n_c contacts with r steps per coordinate and second is estimated by
///
///   r H n (1 + (n + n_c / 8) / 8) + 8 + n + n_c     in units of the cost of an event of one body        (2)
///
/// an event of the part has to advance all of it, and its run has a beginning.
class WindowPlan {
 public:
  /// A part of the scene: numbers of its coordinates and near contacts, ascending.
  struct Part {
    std::vector<int> coordinates, contacts;
    friend bool operator==(const Part&, const Part&) = default;
    friend auto operator<=>(const Part&, const Part&) = default;
  };

  /// M of the problem is constant and diagonal. It must outlive this.
  explicit WindowPlan(const Problem& problem);

  /// Before a run.
  void restart() { wide_box_.restart(); }
  /// The parts in the window of length `H` [s] from (q, v) on. @param margin  relative to 1 + |q|, of (1)
  void divide(const Vector& q, const Vector& v, double H, double margin);
  const std::vector<Part>& parts() const { return parts_; }
  /// (1), n_q
  const std::vector<Interval>& box() const { return box_; }
  /// (2) of all parts, over H. @param rate  r [1/s]
  double work_rate(double rate) const;

 private:
  void bound_motion(const Vector& q, const Vector& v, double margin);
  void find_near();
  void join_coordinates();

  const Problem& problem_;
  const ProblemInfo& info_;
  Vector root_m_, f_;         // n_q: sqrt(m)
  std::vector<int> watched_;  // all coordinates
  double H_ = 0;
  std::vector<Interval> box_, gaps_;  // n_q, n_c
  WideBox wide_box_;
  std::vector<int> wide_, near_;  // contacts, ascending
  DisjointSets sets_;             // of coordinates
  std::vector<int> part_of_;      // per coordinate
  std::vector<Part> parts_;
};

}  // namespace ricochet
