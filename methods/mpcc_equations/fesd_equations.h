#pragma once

#include <functional>
#include <string>
#include <vector>

#include "methods/elements/fesd_step.h"
#include "methods/mpcc_equations/contact_equations.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// The discrete equations of FESD-J as rows and complementarity pairs of an MPCC, paper section 3 with the corrections
/// in fesd/DIFFERENCES.md. For an element of length h with left end (q_0, v_0), reached with velocity v-, and stages
/// j:
///
///   q_j = q_0 + h sum_k a_jk v_k,   v_j = v_0 + h sum_k a_jk w_k                                          (1)
///   0 = M(q_j) w_j - f_v(q_j,v_j) - B_u u - J_n lambda_n,j - J_t lambda_t,j                               (2)
///   0 = M(q_0) (v_0 - v-) - J_n Lambda_n - J_t Lambda_t                                                   (3)
///   y_j = f_c(q_j),   0 <= lambda_n,j  _|_  y_j' >= 0,   j' = 0..n_s, right end                           (4)
///   0 <= Lambda_n  _|_  y_0 >= 0,   s+ - s- = J_n' (v_0 + eps_r v-),   0 <= Lambda_n  _|_  s+, s- >= 0    (5)
///   f_c(q_0 + eps_c h v_0) >= 0                                                                           (6)
///   sum_n h_n = H                                                                                         (7)
///   J_n' v_0 = z+ - z-,   0 <= z+  _|_  lambda_n,j >= 0,   z+  _|_  z-                                    (9)
///
/// (9) is ours: a contact that bounces has no force. Without it a closed element of Radau type may absorb the bounce by
/// stage forces (open question 2 in fesd/DIFFERENCES.md), and an optimisation would exploit that.
///
/// On a curve (1)-(4) leave a velocity of O(h^n_s) across a closed contact. As in the simulation (end_projection.h,
/// (10)) impulses P of either sign take it away at the right end, v_1 after them and v_ns before,
///
///   0 = M(q_1) (v_1 - v_ns) - J_n P,   P = p+ - p-,   0 <= p+ + p-  _|_  sum_j y_j >= 0                    (10)
///   J_n' v_1 = r+ - r-,   0 <= r+ + r-  _|_  sum_j lambda_n,j >= 0                                        (11)
///
/// and p+ _|_ p-, r+ _|_ r-; with Options::projects, for curved contacts without friction and tableaus whose last stage
/// is the right end. (9) is stated where the equations keep the normal velocity zero: for affine contacts, and those of
/// (10), (11).
///
/// Formulas that bend or jump are functions of theta, (5) of contact_equations.h, with the cross complementarity of FESD:
///
///   0 <= theta_k,j  _|_  b_k,j' >= 0,   0 <= 1 - theta_k,j  _|_  a_k,j' >= 0,
///   j = 1..n_s,   j' = left end, 1..n_s, right end                                                        (12)
///
/// for all j and j', so that theta_k changes where an element ends, and psi_k = 0 there. psi_k of the left end is that of
/// v_0, after an impact, and of the theta of the first stage. A function of the time alone is no exception: t is the last
/// coordinate, and an element ends at the switch whether H is given or a part of a free end time.
///
/// Impulses::slack has the paper's appendix instead of the pairs in (5): Lambda_n _|_ y_0 + s+ + s-, s+ _|_ s-.
/// Options::bounded_parts has s+ _|_ s- with (5), too: without it only their difference has a size, and an
/// interior-point method may drive both to infinity; but with it the crossover of the discs fails.
/// Friction is that of contact_equations.h, with forces at the stages j complementary to slip at j', and xi+_j to
/// xi-_j'; at the left end with (Lambda, v_0).
///
/// Step equilibration between neighbours n - 1, n of one interval: Equilibration::objective adds rho (h_n - h_n-1)^2 to
/// the objective, exact has 0 = (h_n - h_n-1) eta_n, tanh 0 = (h_n - h_n-1) tanh(eta_n), with the indicator
///
///   eta_n = prod_i nu^i,   nu = (y_0 Y_n-1 Y_n + L_n-1 L_n) zeta,   Y = sum_j y_j, L = sum_j lambda_n,j   (8)
///   zeta = 1 without friction, else Y_n-1 + Y_n + sum of the products of neighbouring sums of xi+, xi- and of the cone
///   slack (mu lambda_n)^2 - ||lambda_t||^2
///
/// eta_n has one more factor for each psi_k, with the sums A, B of a_k, b_k, and E, R of theta_k, 1 - theta_k,
///
///   nu_k = (E_n-1 E_n + B_n-1 B_n) (R_n-1 R_n + A_n-1 A_n)                                                (13)
///
/// which is zero where theta_k changes between 0, the interior and 1.
class FesdEquations final : public ContactEquations {
 public:
  enum class Impulses { position_velocity, slack };
  enum class CrossComplementarity { sparse, per_stage, aggregated };
  enum class Equilibration { objective, exact, tanh, none };

  static const Names<Impulses>& impulse_names();
  static const Names<CrossComplementarity>& cross_names();
  static const Names<Equilibration>& equilibration_names();

  struct Options {
    int n_fe = 2;
    Impulses impulses = Impulses::position_velocity;
    Cone cone = Cone::exact;
    int facets = 8;  ///< of Cone::polyhedral in space
    CrossComplementarity cross = CrossComplementarity::sparse;
    Equilibration equilibration = Equilibration::objective;
    double rho = 1;              ///< of Equilibration::objective [1/s^2]
    double shortest = 0.1;       ///< element, relative to equal ones: elements that collapse are degenerate
    bool no_capture = true;      ///< (9)
    bool projects = false;       ///< (10), (11)
    bool bounded_parts = false;  ///< s+ _|_ s- with (5), too
    double eps_c = 1e-3;         ///< of (6); 0 leaves (6) out
  };

  /// @param mpcc  receives all variables, rows and pairs; must outlive this object, like `plant`
  FesdEquations(const Problem& plant, const ButcherTableau& tableau, const Options& options, Mpcc& mpcc);

  /// One interval of N_FE elements with constant control. @param u  its variables; @param H  its length [s], or, with
  /// `T` >= 0, as part of the variable T: H = share T. Bounds of q and v hold at every point.
  /// @return the right end
  Point add_interval(const Point& left, const std::vector<int>& u, double H, int T, double share);

  /// A finite element.
  struct ElementVariables {
    int h = -1;
    Point left;  ///< v is v_0, after an impact
    std::vector<int> v_minus;
    std::vector<int> Lambda_n, s_plus, s_minus;
    std::vector<int> z_plus, z_minus;                      ///< of (9)
    std::vector<int> P, p_plus, p_minus, r_plus, r_minus;  ///< of (10), (11); empty without
    std::vector<Slip> left_slip;
    std::vector<Force> impulse;
    std::vector<Stage> stages;
    Point right;
    std::vector<Slip> right_slip;  ///< empty where the right end is the last stage
  };
  const std::vector<std::vector<ElementVariables>>& intervals() const { return intervals_; }

  /// The solution x of the MPCC in an interval.
  FesdStep read(const Vector& x, int interval) const;
  /// n_s x stages, theta of (12) there in an element.
  Matrix theta(const Vector& x, int interval, int element) const;

  /// Sets the guess of the interval to a solved step with as many elements; the indicators of (8) stay unchanged.
  void set_guess(const FesdStep& step, int interval);

 private:
  using PartOfPsi = std::vector<int> Point::*;

  ContactMode mode(const ElementVariables& element, int contact, const Vector& x) const;
  void guess_gamma(const Point& point, const std::vector<Slip>& slips, const std::vector<Force>& forces);
  bool is_projected(int contact) const;
  bool keeps_velocity(int contact) const;
  void add_normal_velocity(const Point& point, const std::function<bool(int)>& is_split, std::vector<int>& plus,
                           std::vector<int>& minus, const std::string& name);
  void add_impact(ElementVariables& element, const std::string& name);
  void add_projection(ElementVariables& element, const std::string& name);
  void add_stages(ElementVariables& element, const std::vector<int>& u, const std::string& name);
  void add_cross(const std::vector<int>& stages, const std::vector<int>& points, const std::string& name);
  void add_cross_complementarity(const ElementVariables& element, const std::string& name);
  std::vector<std::vector<int>> indicator_lists(const ElementVariables& element, int contact) const;
  SmoothFunction indicator(const std::vector<std::vector<int>>& lists, int n_slacks) const;
  std::vector<int> parts_of_psi(const ElementVariables& element, PartOfPsi part, std::size_t k) const;
  std::vector<int> switch_lists(const ElementVariables& element, std::size_t k) const;
  void add_equilibration(const ElementVariables& before, const ElementVariables& element, const std::string& name);

  const ButcherTableau tableau_;
  const Options options_;
  const bool stiffly_accurate_;
  bool projects_ = false;                   // some contact
  SmoothFunction runge_kutta_, right_end_;  // (1): of one coordinate
  std::vector<SmoothFunction> indicator_;   // nu of (8), per contact
  SmoothFunction switch_indicator_;         // (13)
  SmoothFunction equilibration_;
  std::vector<std::vector<ElementVariables>> intervals_;
};

}  // namespace ricochet
