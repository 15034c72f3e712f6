#pragma once

#include <ginac/ginac.h>

#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "problems/derivatives/sparse_program.h"
#include "problems/derivatives/straight_line_program.h"
#include "problems/geometry.h"
#include "problems/problem.h"

/// @file
/// SymbolicModel, a scene as formulas, and SymbolicProblem, the Problem that follows from them.

namespace ricochet {

/// A scene as formulas: the contents of a scene file, or a compiled scene evaluated with symbols. Symbols are real
/// (real_functions.h). Units are those of the SI.
struct SymbolicModel {
  using Expressions = std::vector<GiNaC::ex>;  ///< A list of formulas.

  /// A contact, as in ContactInfo, with formulas of q, the parameters and t.
  struct Contact {
    std::string name;                   ///< in messages, events and figures
    GiNaC::ex gap;                      ///< f_c [m], positive when the bodies are apart
    std::vector<Expressions> tangents;  ///< directions, each with n_q entries; empty without friction
    Expressions drives;                 ///< dv_t/d(v_clock), one per direction: contribution of a moving surface to
                                        ///< J_t' v; empty if there is none
    GiNaC::ex eps_r = 0;                ///< restitution coefficient, in terms of the parameters and of `v_n`
    GiNaC::ex mu = 0;                   ///< friction coefficient, in terms of the parameters, q and t
    bool is_bilateral = false;          ///< a constraint gap = 0
    bool is_friction_element = false;   ///< of `frictions`, see friction_elements.h; never stated as a contact
    bool mu_varies = false;             ///< mu depends on q or t, maybe in other regions only; set by normalized()
    GiNaC::ex mu_static = 0;            ///< friction coefficient while it sticks, in terms of the parameters; 0: mu
  };

  /// Friction without a normal contact (friction_elements.h), or rolling and drilling friction at a contact
  /// (rolling_friction.h), with formulas of q, the parameters and t.
  struct FrictionElement {
    std::string name;                   ///< in messages, events and figures, other than those of contacts
    std::vector<Expressions> tangents;  ///< one or two directions, each with n_q entries
    Expressions drives;                 ///< one per direction, added to J_t' v; empty if there is none
    int contact = -1;                   ///< of `contacts`, whose normal force bounds the friction; -1: none
    GiNaC::ex bound;             ///< of |lambda_t| [N, N m], >= 0; a formula of v, too. With a `contact`: over its
                                 ///< normal force [1, m], a formula of q, the parameters and t
    GiNaC::ex static_ratio = 0;  ///< bound while it sticks over `bound`, in terms of the parameters; 0: 1
  };

  std::string id;                                 ///< as ProblemInfo::id
  std::string title;                              ///< as ProblemInfo::title
  std::string source;                             ///< as ProblemInfo::source
  std::string hard_feature;                       ///< as ProblemInfo::hard_feature
  std::vector<ParameterInfo> parameters;          ///< names, values and units
  std::vector<GiNaC::symbol> parameter_symbols;   ///< same order as `parameters`
  std::map<std::string, GiNaC::ex> exact_values;  ///< of parameters that a formula of numbers states
  std::vector<GiNaC::symbol> q;                   ///< n_q coordinates
  std::vector<GiNaC::symbol> v;                   ///< n_q velocities
  std::vector<GiNaC::symbol> u;                   ///< n_u controls
  GiNaC::symbol t{"t"};     ///< time; may occur in force, input, control, gaps, tangents, drives and mu
  GiNaC::symbol v_n{"vn"};  ///< approach speed -J_n' v- of an impact [m/s]; may occur in eps_r

  std::vector<Expressions> mass;              ///< n_q rows of n_q entries
  Expressions force;                          ///< f_v(q, v), n_q entries
  std::vector<Expressions> input;             ///< B_u(q), n_q rows of n_u entries; empty without control
  std::vector<Contact> contacts;              ///< n_c, unilateral and bilateral ones
  std::vector<FrictionElement> frictions;     ///< in addition to the friction of contacts
  Expressions q0;                             ///< n_q, in terms of the parameters only
  Expressions v0;                             ///< n_q, in terms of the parameters only
  Expressions control;                        ///< n_u, of the plain simulation, in terms of the parameters and t
  GiNaC::ex end_time;                         ///< [s], in terms of the parameters only
  ImpactLaw impact_law;                       ///< as ProblemInfo::impact_law
  std::optional<GiNaC::ex> potential_energy;  ///< [J], in terms of q and the parameters
  std::optional<GiNaC::ex> until;             ///< of q, v, t and the parameters: a run ends at its first zero
  Expressions switching;                      ///< of a region: psi_k, n_s (problems/regions/switching_functions.h)
  std::vector<int> region;                    ///< its signs, n_s
  std::vector<int> acting;                    ///< of a region that slides: 1 for contacts that act on it (sliding.h)
  bool has_clock = false;                     ///< the clock is a coordinate even if no formula depends on time
  /// Bodies and shapes, in terms of the parameters only; empty if the scene states none.
  std::optional<GeometryOf<GiNaC::ex>> geometry;

  /// Value of an `expression` of parameters and numbers.
  double number(const GiNaC::ex& expression) const;
  /// Value of a formula of q, v, t and the parameters at the initial state.
  double number_at_start(const GiNaC::ex& formula) const;
  /// The formula of numbers that states a parameter, such as 1/3; null if there is none, or if the value was changed.
  const GiNaC::ex* exact_value(const ParameterInfo& parameter) const;
  /// The parameters as constants of a program; if they `may_change`, StraightLineProgram::set_constants() sets them.
  std::vector<StraightLineProgram::Constant> constants(bool may_change = false) const;
};

/// GiNaC's reference counts have no locks: problems are made and destroyed by one thread at a time, with this lock.
std::mutex& formulas_mutex();

/// Makes a control of the `model` that depends on time a part of the force.
void add_control_of_time(SymbolicModel& model);

/// The `model` with real symbols, and without tangents and drives of contacts that have no friction.
SymbolicModel normalized(SymbolicModel model);

struct SwitchedModel;  // problems/regions/switching_functions.h

/// The Problem of a SymbolicModel. J_n is the gradient of f_c; it and all other derivatives are computed by GiNaC,
/// exact and sparse. Entries that are identically zero or constant are not computed again.
///
/// GiNaC is used instead of automatic differentiation because it works for compiled scenes and scene files, to any
/// order, and finds the structure (constant M, affine f and f_c, supports of contacts) that lets a method skip work.
/// Its programs are interpreted: a Jacobian of the double pendulum takes 80 ns, with forward-mode Eigen::AutoDiffScalar
/// 25 ns (bench/benchmarks/bench_derivatives.cpp). Newton matrices are reused; values are machine code.
class SymbolicProblem : public Problem {
 public:
  /// Differentiates the `model` and makes its programs: milliseconds.
  /// @throws InputError for a symbol without value, a function without a counterpart in doubles, mu without tangents, or
  /// mu_static without a constant mu > 0 and one tangent direction
  explicit SymbolicProblem(SymbolicModel model);

  void mass_matrix(const double* q, double* M) const override;
  void force(const double* q, const double* v, const double* u, double* f) const override;
  void gap(const double* q, double* f_c) const override;
  void normal_jacobian(const double* q, double* J_n) const override;
  void tangent_jacobian(const double* q, double* J_t) const override;
  void friction_coefficients(const double* q, double* mu) const override;
  double potential_energy(const double* q) const override;

  void mass_bounds(const Interval* q, Interval* M) const override;
  void force_bounds(const Interval* q, const Interval* v, const double* u, Interval* f) const override;
  void gap_bounds(std::span<const int> contacts, const Interval* q, Interval* f_c) const override;
  void normal_bounds(std::span<const int> contacts, const Interval* q, Interval* J_n) const override;
  void tangent_bounds(std::span<const int> contacts, const Interval* q, Interval* J_t) const override;
  void gap_bias_bounds(std::span<const int> contacts, const Interval* q, const Interval* v, Interval* b) const override;
  void slip_derivative_bounds(std::span<const int> contacts, const Interval* q, const Interval* v,
                              Interval* T) const override;

  void switching_bounds(const Interval* q, const Interval* v, Interval* psi) const override;

  void force_jacobians(const double* q, const double* v, const double* u, double* f_q, double* f_v) const override;
  void mass_derivative(const double* q, const double* a, double* Ma_q) const override;
  void contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t,
                                double* Jl_q) const override;
  void gap_acceleration_bias(const double* q, const double* v, double* b) const override;
  void slip_velocity_derivative(const double* q, const double* v, double* T) const override;

  void dynamics_hessian(const double* q, const double* v, const double* u, const double* a, const double* lambda_n,
                        const double* lambda_t, const double* w, double* H) const override;
  void gap_hessian(const double* q, const double* w, double* H) const override;

  void parameter_derivative(const double* q, const double* v, const double* a, const double* lambda_n,
                            const double* lambda_t, double* D) const override;
  void parameter_derivative_of_constants(double* C) const override;

  void switching(const double* q, const double* v, double* psi) const override;
  void switching_derivative(const double* q, const double* v, double* D) const override;
  std::unique_ptr<Problem> in_region(std::span<const int> signs) const override;
  std::unique_ptr<Problem> without_until() const override;
  std::unique_ptr<Problem> in_friction_state(std::span<const char> sticks) const override;

  const SymbolicModel* formulas() const override { return &stated_; }
  const SymbolicProblem* symbolic() const override { return this; }
  SymbolicProblem* symbolic() override { return this; }

  const SymbolicModel& model() const { return stated_; }  ///< The scene as it is stated, formulas().
  /// The scene as it is solved: friction elements are contacts with coordinates (friction_elements.h,
  /// rolling_friction.h); if it depends on time, the clock is its last coordinate, and a control that depends on time is
  /// part of the force.
  const SymbolicModel& equations() const { return model_; }

  // For studies of many runs: making a problem takes milliseconds, set_parameters() microseconds.

  /// Makes the programs again, so that set_parameters() can be called. Call it before any method runs.
  void open_parameters();
  /// Changes the parameters. The result is the problem that is made with them, up to the sign of zeros. Not validated.
  /// No formula is read, so that each thread may change its own problem. Do not call while a method runs.
  /// @param values  of all info().parameters
  /// @returns false, without a change, if a contact would gain or lose friction: its tangents would
  /// have to be added or removed; likewise if the bound of a friction element would not be positive at the start
  bool set_parameters(std::span<const double> values);

 protected:
  /// info().parameters have changed.
  virtual void parameters_changed() {}

 private:
  using Expressions = SymbolicModel::Expressions;

  std::unique_ptr<Problem> as_here(SymbolicModel model) const;
  void make_programs(const std::vector<StraightLineProgram::Constant>& constants);
  void describe_contacts();
  void describe_structure();
  std::optional<double> constant_bound(const SymbolicModel::FrictionElement& element) const;
  GiNaC::ex eps_r_of(const SymbolicModel::Contact& contact) const;
  GiNaC::ex contact_force_work(const std::vector<GiNaC::symbol>& weight) const;

  SymbolicModel stated_, model_;
  Expressions total_force_;  ///< f_v + B_u u
  std::vector<GiNaC::symbol> a_, w_, w_c_, lambda_n_, lambda_t_;

  SparseProgram mass_, force_, gap_, normal_, tangent_, potential_;
  SparseProgram varying_mu_;  ///< of Problem (9), in the order of varying_
  std::vector<int> varying_;  ///< contacts whose mu varies
  SparseProgram force_jacobian_, mass_q_, contact_q_, gap_bias_, slip_q_;
  SparseProgram switching_, switching_derivative_;
  std::shared_ptr<const SwitchedModel> switched_;  ///< null without switching functions

  // Built at first use, by a transcription or for sensitivities.
  mutable std::once_flag dynamics_hessian_once_, gap_hessian_once_, parameter_derivative_once_;
  mutable SparseProgram dynamics_hessian_, gap_hessian_, parameter_derivative_;

  bool are_parameters_open_ = false;
  SparseProgram
      numbers_;  ///< when they are: q0, v0, u, T, all eps_r, mu, mu_static, the geometry's, bounds at the start
  std::vector<double> number_values_;
};

}  // namespace ricochet
