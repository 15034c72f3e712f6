#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/series_program.h"

/// @file
/// SceneFormulas: a scene as nodes of a SeriesProgram, with exact numbers.

namespace ricochet::reference::certified {

/// The scene has a feature for which there is no proof; more digits do not help.
struct Unsupported : std::runtime_error {
  using std::runtime_error::runtime_error;  ///< With the reason.
};
/// A formula bends or jumps.
struct Bends : Unsupported {
  using Unsupported::Unsupported;  ///< With its name.
};
/// A sign could not be decided at this precision.
struct Undecided : std::runtime_error {
  using std::runtime_error::runtime_error;  ///< With the reason.
};

/// Contact i: gap f_c, J_n = grad f_c, v_n = J_n' v + df_c/dt, v_t = J_t' v + drive.
struct ContactFormulas {
  std::string name;                                  ///< as in ContactInfo
  Ball eps_r, mu;                                    ///< Newton's restitution, Coulomb's friction
  Node eps_r_formula = -1, mu_formula = -1;          ///< the same as formulas of the parameters
  bool is_bilateral = false;                         ///< a constraint
  bool is_friction_element = false;                  ///< must stay closed (mode_motion())
  bool mu_varies = false;                            ///< J_t and drives contain mu (varying_friction.h), and mu is 1
  Node gap = -1, v_n = -1;                           ///< f_c [m], v_n [m/s]
  std::vector<Node> J_n;                             ///< n_q
  std::vector<std::vector<Node>> J_t;                ///< n_t directions with n_q entries; none without friction
  std::vector<Node> v_t;                             ///< n_t slip velocities [m/s]
  std::vector<std::pair<int, int>> opposite_slopes;  ///< k < l with dgap/dq_k = -dgap/dq_l, not zero, by formulas
  bool gap_is_zero = false;                          ///< at t = 0, proven by formulas, as are the next two
  bool v_n_is_zero = false;                          ///< v_n = 0 at t = 0
  bool v_t_is_zero = false;                          ///< v_t = 0 at t = 0, all directions
  /// In space: at t = 0 the contact, alone, can stick with |lambda_t| = mu lambda_n, exactly.
  bool sticks_at_limit = false;
  int n_t() const { return static_cast<int>(J_t.size()); }  ///< Tangent directions.
};

/// What two contacts have in common.
struct ContactPair {
  Node gap_difference = -1;       ///< gap of the first less that of the second, with equal terms left out [m]
  bool same_restitution = false;  ///< eps_r is the same number
};

/// A border of the region of a scene: psi_k = 0 (problems/regions/switching_functions.h).
struct Border {
  std::string formula;     ///< psi_k as text
  Node function = -1;      ///< sigma_k psi_k, which is positive in the region
  bool is_zero = false;    ///< at t = 0, proven by formulas
  bool has_place = false;  ///< psi_k depends on q
  bool has_speed = false;  ///< psi_k depends on v
};

struct RegionFormulas;  // scene_formulas.cpp

/// Differences between the formulas of two regions: everywhere, or on the border psi_k = 0 between them.
struct RegionChange {
  struct OfContact {
    bool same_everywhere = true;  ///< gap, tangents, drives and mu
    bool same_gap = true;         ///< on the border
    bool same_slope = true;       ///< gap and J_n on the border
    bool same_directions = true;  ///< tangents and drives on the border
  };
  std::vector<OfContact> contacts;
  bool same_mass_everywhere = true;
};

/// The equations M(q) v' = f(q, v, t) + contact forces, with the control in f. Time is a variable, the clock.
struct SceneFormulas {
  int n = 0;                         ///< coordinates, without a clock
  int n_bodies = 0;                  ///< coordinates of bodies; those of friction elements follow
  std::vector<Node> q, v;            ///< n each
  Node clock = -1;                   ///< t
  std::vector<std::vector<Node>> M;  ///< n rows of n
  std::vector<Node> f;               ///< n
  std::vector<ContactFormulas> contacts;
  std::vector<Border> borders;                   ///< of a region, n_s; else none
  std::shared_ptr<const RegionFormulas> region;  ///< for change_between()
  std::vector<Ball> start;                       ///< q0, then v0
  Ball end_time;                                 ///< [s]
  // Of scenes whose parameters are variables; empty otherwise.
  std::vector<Node> parameters;      ///< in the order of ProblemInfo::parameters
  std::vector<Ball> values;          ///< of the parameters
  std::vector<Node> start_formulas;  ///< q0, then v0
  Node end_time_formula = -1;        ///< T
  /// Whether the gap of a contact, also v_n, also v_t, stay zero at t = 0 if one variable changes: q0, v0 or a
  /// parameter, counted in this order.
  std::function<bool(int contact, int variable, bool with_v_n, bool with_v_t)> stays_zero;
  std::function<ContactPair(int i, int j)> compare;              ///< Contacts i and j.
  int n_c() const { return static_cast<int>(contacts.size()); }  ///< Contacts.
};

/// Translates the formulas of the `problem` into nodes of the `program`. Every number is taken as a rational number,
/// read as `reading` says. An initial state that was set by Problem::set_initial_state() is read in the same way.
/// @throws Unsupported if there are no formulas, or too many, or if one of them bends, jumps, or has a function without a
/// series
/// @param parameters_vary  the parameters are variables of the program, for derivatives
SceneFormulas scene_formulas(const Problem& problem, Reading reading, SeriesProgram& program,
                             bool parameters_vary = false);

/// Compares the formulas of two regions of one scene. @param border  k of the border between them; -1: none
RegionChange change_between(const SceneFormulas& one, const SceneFormulas& other, int border);

}  // namespace ricochet::reference::certified
