#pragma once

#include <LagrangianDS.hpp>
#include <NonSmoothDynamicalSystem.hpp>
#include <SiconosException.hpp>
#include <memory>
#include <string>
#include <vector>

#include "methods/method.h"

namespace ricochet::siconos {

/// One body of Siconos' graph: a LagrangianDS and the coordinates of the problem that it holds.
struct Body {
  std::vector<int> coordinates;  ///< ascending
  SP::LagrangianDS system;
};

/// Whether bodies may be split. One body holds all coordinates; a Siconos model of many rigid bodies has one each.
enum class Bodies { one, as_coupled };

/// A problem as Siconos' objects:
///
///   M(q) v' = F(q, v) + sum_i H_i(q)' lambda_i                                           (1)
///   y_i = (f_c^i(q), 0, ..), H_i = (J_n^i, J_t^i)', one Interaction per contact             (2)
///
/// Where M and the derivatives of the force are constant, (1) is a LagrangianLinearTIDS, M v' + C v + K q = F_ext, and
/// `Bodies::as_coupled` makes one of each set of coordinates that M, C, K couple; else one LagrangianDS calls the
/// problem. Where J_n, J_t are constant, (2) is a LagrangianLinearTIR, else a LagrangianScleronomousR that calls the
/// problem.
class Model {
 public:
  Model(const Problem& problem, double end_time, Bodies bodies);
  ~Model();

  const SP::NonSmoothDynamicalSystem& system() const { return system_; }
  const std::vector<Body>& bodies() const { return bodies_; }
  /// q, v: n_q
  void read_state(Vector& q, Vector& v) const;
  /// Reads the multipliers of level 1, impulses [N s]. Lambda_n: n_c, Lambda_t: n_lambda_t
  void read_impulses(Vector& Lambda_n, Vector& Lambda_t) const;
  /// Sets what the problem's functions were called for; where Siconos has the force as matrices, once per iteration.
  void count(Counters& counters) const;

 private:
  class Kinematics;
  class NonlinearSystem;
  class ContactRelation;
  void add_contact(int contact);

  const Problem& problem_;
  SP::NonSmoothDynamicalSystem system_;
  std::vector<Body> bodies_;
  std::shared_ptr<Kinematics> kinematics_;
  std::shared_ptr<Counters> counters_;
  std::vector<SP::Interaction> interactions_;  ///< n_c
};

/// Message of a Siconos exception, in one line.
std::string message_of(const Siconos::exception& error);

}  // namespace ricochet::siconos
