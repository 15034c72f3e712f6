#pragma once

#include <string>
#include <vector>

#include "methods/mpcc_equations/contact_equations.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The time-freezing system (methods/time_freezing/) by finite elements with switch detection, as rows and
/// complementarity pairs of an MPCC. For an element of pseudo length h and stages j, with ' for the derivative by pseudo
/// time:
///
///   x_j = x_0 + h sum_k a_jk x'_k   for x = q, v                                                            (1)
///   0 = M(q_j) v'_j - s_j (f_v + B_u u) - J_n Lambda_n,j - J_t Lambda_t,j                                   (2)
///   q'_j = s_j v_j + sum_{i elastic} beta_j^i D^i rho_j^i,   s_j = prod_i (1 - beta_j^i),   rho = J_n' v    (3)
///   inelastic  Lambda_n = push beta,   beta = b_q b_v,   Lambda_t = mu push beta (b_t - a_t)                (4)
///   elastic    G Lambda_n = -beta (k f_c + c rho),   beta = b_q,   D = M^-1 J_n / G,   G = J_n' M^-1 J_n    (5)
///
/// The weights a, b = 1 - a are those of a switching function's sides, its sign where that is not zero,
///
///   f_c = g+ - g-,   rho = r+ - r-,   J_t' v = xi+ - xi-                                                    (6)
///   0 <= b_q  _|_  g+ >= 0,   0 <= a_q  _|_  g- >= 0,   and a_v, b_v with r, a_t, b_t with xi               (7)
///
/// for weights at every stage and parts at every stage and the left end of the same element, so that no switch lies
/// inside of one. Elements of an interval make its time together, whatever their pseudo lengths:
///
///   theta_j = h s_j,   sum_n sum_j b_j theta_nj = H                                                         (8)
///
/// so that every interval has its own speed of time; rho (h_n - h_n-1)^2 is added to the objective. And
///
///   r-_0  _|_  sum_j b_q,j s_j   of an inelastic contact                                                   (9)
///
/// is ours: an element that begins with an approach and holds the contact is frozen. Without it the stage forces of one in
/// which time runs may absorb an impact, as those of FESD-J may (open question 2 in fesd/DIFFERENCES.md).
///
/// Sources: Nurkanovic, Albrecht, Brogliato, Diehl, Automatica 158 (2023) 111295; (5) Nurkanovic, Sartor, Albrecht, Diehl,
/// IEEE L-CSS 5 (2021); (7) in the step form of nosnoc.
/// Differs from the sources: friction in the plane, without restitution; (5) for constant M and affine contacts.
class TimeFreezingEquations final : public ContactEquations {
 public:
  struct Options {
    int n_fe = 3;
    Vector push;             ///< n_c [N]
    double k = 0;            ///< [1/s^2]
    Vector damping;          ///< n_c [1/s], c
    double rho = 1;          ///< weight of equal lengths [1/s^2]
    bool no_capture = true;  ///< (9)
  };

  /// @param mpcc  receives all variables, rows and pairs; must outlive this object, like `plant`
  /// @throws InputError for friction in space, friction with restitution, a curved elastic contact, forces that bend or
  /// jump, or a tableau without a stage at the right end
  TimeFreezingEquations(const Problem& plant, const ButcherTableau& tableau, const Options& options, Mpcc& mpcc);

  /// The parts (6) of a switching function at a point, n_c each; -1 where a contact has none.
  struct Parts {
    std::vector<int> plus, minus;
  };
  struct Node {
    Point point;
    Parts gap, rate, slip;
  };
  struct PseudoStage {
    Node node;
    std::vector<int> p, w;  ///< n_q, q' and v'
    int s = -1, theta = -1;
    std::vector<int> a_q, b_q, a_v, b_v, a_t, b_t;  ///< n_c; -1 where a contact has none
    std::vector<int> pi;                            ///< n_c, b_q s of (9)
    std::vector<int> Lambda_n, Lambda_t;            ///< n_c, n_lambda_t
  };
  struct PseudoElement {
    int h = -1;
    std::vector<PseudoStage> stages;
  };

  /// The parts at the initial state.
  Node add_start(const Point& initial);
  /// An interval of N_FE elements with constant control, H [s] long, or share T. @return the right end
  Node add_interval(const Node& left, const std::vector<int>& u, double H, int T, double share);
  const std::vector<std::vector<PseudoElement>>& intervals() const { return intervals_; }

  /// A stage of the guess, at an instant of a motion with mean forces lambda; w: acceleration.
  void set_guess(const PseudoStage& stage, const Vector& q, const Vector& v, const Vector& w, const Vector& lambda_n,
                 const Vector& lambda_t);
  void set_length_guess(const PseudoElement& element, double dt);

 private:
  static constexpr double kShortest = 0.01;  // element, relative to equal ones in time

  bool is_elastic(int contact) const { return info_.contacts[contact].eps_r > 0; }
  bool has_pi(int contact) const { return options_.no_capture && !is_elastic(contact); }
  void add_parts(Node& node, const std::string& name);
  PseudoStage add_pseudo_stage(const std::vector<int>& u, int h, const std::string& name);
  void add_weights(PseudoStage& stage, const std::string& name);
  void add_pairs(const Node& left, const PseudoElement& element, const std::string& name);
  void guess_parts(const Parts& parts, int contact, double value);

  const ButcherTableau tableau_;
  const Options options_;
  Vector G_;  // n_c
  Matrix D_;  // n_q x n_c
  SmoothFunction dynamics_, runge_kutta_, product_;
  std::vector<SmoothFunction> force_, friction_, position_rate_;
  SmoothFunction speed_;
  std::vector<std::vector<PseudoElement>> intervals_;
};

}  // namespace ricochet
