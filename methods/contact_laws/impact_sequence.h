#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/group_rest.h"
#include "methods/contact_laws/impact_solver.h"

namespace ricochet {

/// Impacts at one instant. They may follow each other ever faster, as those of a ball between the floor and another
/// ball, or of a disc that falls between two. If a flight between two impacts is lower than the rounding of q, or too
/// short to change a velocity, they are applied one after the other at one instant,
///
///   v_0 = v-,   v_k from v_k-1 by Newton's law (1)-(3) of impact_solver.h at the contacts S_k,   v+ = v_K       (1)
///
/// S_1: contacts that touch and do not separate; S_k: those that approach after the previous impact, and those at rest.
/// Contacts at rest that were open, or had an impulse, take no part if the load pulls them apart: they open before the
/// impact, however soon it follows. After the last impact no contact approaches; after infinitely many, the remaining
/// velocities are rounding and count as rest. The result is the limit of the motion; one impact of all contacts would
/// be a different motion if one of them is elastic.
///
/// Impacts of a group S that ends at rest after infinitely many of them are not followed to their end. The impulses of
/// v+ = v_k + M^-1 N Lambda are not negative and N' v+ = 0, so that v+ does not depend on k, the order or eps_r:
///
///   v+ = argmin |v - v_k|_M  over  N' v >= 0,   N = (J_n^i), i in S                                             (2)
///
/// which is (1) once more for all of S with eps_r = 0. It takes the place of the impacts after 16 + 4 n of them at n
/// contacts, and after 8 where all have eps_r = 0 and no friction and all of S is at rest then. Two kinds of S have no
/// such limit. If an island of S is elastic, it loses no energy. If v changes by more than the rates r = N' v_k explain
/// (is_explained_by_rates(), group_rest.h), bodies pass between others that nearly touch, and the directions that (1)
/// holds would turn. Rates up to the low speed
/// of group_rest.h are left as they are there. Impulses of a wedge (group_rest.h (4)), of one impact or of all at the
/// instant together, are taken back: its contacts take no part.
class ImpactSequence {
 public:
  /// All references must outlive this object. @param law  prepared by its owner, for candidates() after find_touching()
  ImpactSequence(const Problem& problem, ContactScales& scales, ImpactSolver& law);

  /// accumulates: the impacts lose too little of their velocity
  enum class Result : std::uint8_t { done, no_impulse, no_forces, accumulates };
  struct Outcome {
    Result result = Result::done;
    int n_impacts = 0;
    int failed_contact = -1;  ///< a contact that approached; -1: none did
  };

  /// One of the impacts at an instant.
  struct Impact {
    Vector v_minus{}, v_plus{};     ///< n_q
    Vector Lambda_n{}, Lambda_t{};  ///< n_c, n_lambda_t
  };
  /// apply_impacts() adds every impact to this list. @param impacts  null for none
  void keep_impacts(std::vector<Impact>* impacts) { kept_ = impacts; }

  /// @param before  modes of the contacts before this instant, or null at the start of a run: those that were closed
  /// touch. @param touching  out, ascending
  void find_touching(const Vector& q, const std::vector<ContactMode>* before, std::vector<int>& touching);
  /// Impacts of n contacts that are followed one by one.
  static int most_followed(std::size_t n) { return 16 + 4 * static_cast<int>(n); }
  /// Sets the touching contacts if they are known.
  void set_touching(const std::vector<int>& touching) { candidates_ = together_ = touching; }
  /// After find_touching(): adds a contact whose closing has been located.
  void add_touching(int contact, std::vector<int>& touching);
  /// Contacts that touch, or are apart by no more than rounding of q or the height of group_rest.h.
  const std::vector<int>& candidates() const { return candidates_; }
  /// Contacts that have approached before the last impact of apply_impacts().
  const std::vector<int>& approaching() const { return approaching_; }
  /// Whether a contact takes no part in impacts at this instant, nor closes, as apply_impacts() has left it.
  bool is_left(int contact) const { return is_left_[static_cast<std::size_t>(contact)] != 0; }
  /// Their gaps, and what counts as rest of a group of them.
  const Vector& gaps() const { return gap_; }
  GroupRest& rest() { return rest_; }

  /// Records in the scales the contacts that touch, at velocity v.
  void record_touching(const Eigen::Ref<const Vector>& v);
  /// Records in the scales the change of velocity that the load makes within H. For the first element or phase of a run: a
  /// body that begins at rest has no other size.
  void record_load(const Vector& q, const Vector& v, double H);

  /// (1). @param touching  in and out: contacts that close at this instant are added
  /// @param v  v- in, v+ out; @param Lambda_n, Lambda_t  the impulses are added
  Outcome apply_impacts(const Vector& q, const std::vector<ContactMode>* before, std::vector<int>& touching,
                        Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t);
  /// One impact of the contacts that touch, where one of them approaches. False when it has no solution.
  bool apply_impact(Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t);

 private:
  Outcome follow_impacts(const Vector& q, const std::vector<ContactMode>* before, const std::vector<int>& touching,
                         Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t);
  void record_impact(const Eigen::Ref<const Vector>& v);
  bool approaches(int contact, const Eigen::Ref<const Vector>& v) const;
  bool find_approaching(const Eigen::Ref<const Vector>& v);
  bool closes_now(int contact, const Vector& q, const Eigen::Ref<const Vector>& v);
  bool rests(int contact, const Eigen::Ref<const Vector>& v) const;
  bool find_first(const Vector& q, const Eigen::Ref<const Vector>& v, const std::vector<ContactMode>* before,
                  const std::vector<int>& touching);
  bool find_next(const Vector& q, const Eigen::Ref<const Vector>& v, const Eigen::Ref<const Vector>& Lambda_n,
                 const std::vector<ContactMode>* before, const std::vector<int>& touching);
  bool candidates_are_plastic() const;
  bool loses_energy();
  bool come_to_rest(const Vector& q, Eigen::Ref<Vector> v, Eigen::Ref<Vector> Lambda_n, Eigen::Ref<Vector> Lambda_t,
                    bool all);
  bool is_wedge_at_last(const Vector& q, const Eigen::Ref<const Vector>& Lambda_n);
  void leave_approaching();
  std::span<const int> find_wedge(const std::vector<int>& contacts, const Vector& q, const Eigen::Ref<const Vector>& v);
  bool leave_wedge(const std::vector<int>& contacts, const Vector& q, const Eigen::Ref<const Vector>& v);
  bool is_slow(const Vector& q, const Eigen::Ref<const Vector>& v);
  double fastest_approach(const Eigen::Ref<const Vector>& v) const;
  bool add_unless_pulled_apart(const Vector& q, const Eigen::Ref<const Vector>& v);

  const Problem& problem_;
  ContactScales& scales_;
  ImpactSolver& law_;
  std::vector<int> candidates_;
  std::vector<int> together_, approaching_;  // contacts of one impact, and those that it has to stop
  std::vector<int> may_open_;                // contacts at rest, if the load pulls them apart
  std::vector<ImpactSolver::ClosedContact> resting_;
  Vector impulse_n_, impulse_t_;  // impulses of one impact
  Vector gap_, v_, v_before_;
  Vector v_start_, Lambda_n_start_, Lambda_t_start_;  // before the first impact
  GroupRest rest_;
  std::vector<int> group_, island_;
  std::vector<char> is_left_;  // n_c
  std::vector<Impact>* kept_ = nullptr;
};

}  // namespace ricochet
