#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/impact_solver.h"

namespace ricochet {

/// Impacts at one instant. They may follow each other ever faster: of a ball between the floor and another one, or of a
/// disc that falls between two. When a flight between two of them is lower than rounding of q, or so short that no velocity
/// changes in it, they are taken one after the other at one instant,
///
///   v_0 = v-,   v_k from v_k-1 by Newton's law (1)-(3) of impact_solver.h at the contacts S_k,   v+ = v_K       (1)
///
/// S_1: contacts that touch and do not part; S_k: those that the impact before has sent against each other, and those
/// at rest there. Of contacts at rest that were open, or that have had an impulse, those that the load pulls apart take
/// no part: they have opened by the time of the impact, however soon that follows. The last impact leaves no contact that
/// approaches; of infinitely many what remains is rounding, which counts as rest. It is the limit of the motion, while
/// one impact of all of them would be another motion wherever one of them is elastic.
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
  /// Sets the touching contacts if they are known.
  void set_touching(const std::vector<int>& touching) { candidates_ = together_ = touching; }
  /// After find_touching(): adds a contact whose closing has been located.
  void add_touching(int contact, std::vector<int>& touching);
  /// Contacts that touch, or are apart by no more than rounding of q.
  const std::vector<int>& candidates() const { return candidates_; }

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
  void record_impact(const Eigen::Ref<const Vector>& v);
  bool approaches(int contact, const Eigen::Ref<const Vector>& v) const;
  bool find_approaching(const Eigen::Ref<const Vector>& v);
  bool closes_now(int contact, const Vector& q, const Eigen::Ref<const Vector>& v);
  bool rests(int contact, const Eigen::Ref<const Vector>& v) const;
  bool find_first(const Vector& q, const Eigen::Ref<const Vector>& v, const std::vector<ContactMode>* before,
                  const std::vector<int>& touching);
  bool find_next(const Vector& q, const Eigen::Ref<const Vector>& v, const Eigen::Ref<const Vector>& Lambda_n,
                 const std::vector<ContactMode>* before, const std::vector<int>& touching);
  bool add_unless_pulled_apart(const std::vector<int>& contacts, const Vector& q, const Eigen::Ref<const Vector>& v);

  const Problem& problem_;
  ContactScales& scales_;
  ImpactSolver& law_;
  std::vector<int> candidates_;
  std::vector<int> together_, approaching_;  // of them those of one impact, and those that it has to stop
  std::vector<int> may_open_;                // contacts at rest, if the load pulls them apart
  std::vector<ImpactSolver::ClosedContact> resting_;
  Vector impulse_n_, impulse_t_;  // impulses of one impact
  Vector gap_, v_;
  std::vector<Impact>* kept_ = nullptr;
};

}  // namespace ricochet
