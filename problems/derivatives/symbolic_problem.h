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
/// A scene as formulas, and the Problem that follows from them.

namespace ricochet {

/// A scene as formulas: what a scene file states, or what a compiled scene says when it is run with symbols. Symbols
/// are real (real_functions.h). Units are those of the SI.
struct SymbolicModel {
  using Expressions = std::vector<GiNaC::ex>;  ///< A list of formulas.

  /// A contact, as ContactInfo, in formulas of q, the parameters and t.
  struct Contact {
    std::string name;                   ///< in messages, events and figures
    GiNaC::ex gap;                      ///< f_c [m], positive when the bodies are apart
    std::vector<Expressions> tangents;  ///< directions, each with n_q entries; empty without friction
    Expressions drives;                 ///< dv_t/d(v_clock), one per direction: what J_t' v has from a surface that
                                        ///< moves by itself; empty for none
    GiNaC::ex eps_r = 0;                ///< restitution coefficient, in terms of the parameters only
    GiNaC::ex mu = 0;                   ///< friction coefficient, in terms of the parameters only
    bool is_bilateral = false;          ///< a constraint gap = 0
  };

  std::string id;                                ///< as ProblemInfo::id
  std::string title;                             ///< as ProblemInfo::title
  std::string source;                            ///< as ProblemInfo::source
  std::string hard_feature;                      ///< as ProblemInfo::hard_feature
  std::vector<ParameterInfo> parameters;         ///< names, values and units
  std::vector<GiNaC::symbol> parameter_symbols;  ///< same order as `parameters`
  std::vector<GiNaC::symbol> q;                  ///< n_q coordinates
  std::vector<GiNaC::symbol> v;                  ///< n_q velocities
  std::vector<GiNaC::symbol> u;                  ///< n_u controls
  GiNaC::symbol t{"t"};  ///< time; may occur in force, input, control, gaps, tangents and drives

  std::vector<Expressions> mass;              ///< n_q rows of n_q entries
  Expressions force;                          ///< f_v(q, v), n_q entries
  std::vector<Expressions> input;             ///< B_u(q), n_q rows of n_u entries; empty without control
  std::vector<Contact> contacts;              ///< n_c, unilateral and bilateral ones
  Expressions q0;                             ///< n_q, in terms of the parameters only
  Expressions v0;                             ///< n_q, in terms of the parameters only
  Expressions control;                        ///< n_u, of the plain simulation, in terms of the parameters and t
  GiNaC::ex end_time;                         ///< [s], in terms of the parameters only
  ImpactLaw impact_law;                       ///< as ProblemInfo::impact_law
  std::optional<GiNaC::ex> potential_energy;  ///< [J], in terms of q and the parameters
  /// Bodies and shapes, in terms of the parameters only; nothing where the scene states none.
  std::optional<GeometryOf<GiNaC::ex>> geometry;

  /// Value of an `expression` of parameters and numbers.
  double number(const GiNaC::ex& expression) const;
  /// The parameters as constants of a program; if they `may_change`, all of them by StraightLineProgram::set_constants().
  std::vector<StraightLineProgram::Constant> constants(bool may_change = false) const;
};

/// The Problem of a SymbolicModel: J_n is the gradient of f_c, and every other derivative comes from GiNaC too, exact
/// and sparse. Nothing that is identically zero or constant is computed again.
///
/// Why GiNaC and not automatic differentiation: it serves compiled scenes and scene files alike, to any order, finds
/// the structure (constant M, affine f and f_c, supports of contacts) that lets a method skip work. The price is a
/// program that is interpreted: a Jacobian of the double pendulum takes 80 ns, forward-mode Eigen::AutoDiffScalar 25 ns
/// (bench/benchmarks/bench_derivatives.cpp). Jacobians are rare, since Newton matrices are kept; values are machine code.
class SymbolicProblem : public Problem {
 public:
  /// Differentiates the `model` and makes its programs: milliseconds.
  /// @throws InputError for a symbol that has no value, a function without a counterpart in doubles, or a mu without tangents
  explicit SymbolicProblem(SymbolicModel model);

  void mass_matrix(const double* q, double* M) const override;
  void force(const double* q, const double* v, const double* u, double* f) const override;
  void gap(const double* q, double* f_c) const override;
  void normal_jacobian(const double* q, double* J_n) const override;
  void tangent_jacobian(const double* q, double* J_t) const override;
  double potential_energy(const double* q) const override;

  void mass_bounds(const Interval* q, Interval* M) const override;
  void force_bounds(const Interval* q, const Interval* v, const double* u, Interval* f) const override;
  void gap_bounds(const char* chosen, const Interval* q, Interval* f_c) const override;
  void normal_bounds(const char* chosen, const Interval* q, Interval* J_n) const override;
  void tangent_bounds(const char* chosen, const Interval* q, Interval* J_t) const override;
  void gap_bias_bounds(const char* chosen, const Interval* q, const Interval* v, Interval* b) const override;
  void slip_derivative_bounds(const char* chosen, const Interval* q, const Interval* v, Interval* T) const override;

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

  const SymbolicModel& model() const { return stated_; }  ///< The scene as it is stated.
  /// The scene as it is solved: with the clock as its last coordinate where it depends on time, and a control that does
  /// as part of the force.
  const SymbolicModel& equations() const { return model_; }

  // For studies of many runs: a problem takes milliseconds to make, and set_parameters() less than one of them.

  /// Makes the programs once more, so that set_parameters() can be called. To be called before any method runs.
  void open_parameters();
  /// The problem as it would be had it been made with these parameters, up to the sign of zeros. Nothing is validated.
  /// No formula is touched, so that each thread may have a problem of its own. Not to be called while a method runs.
  /// @param values  of info().parameters, all of them
  /// @returns false, with nothing changed, when a contact would begin or cease to have friction: its tangents would
  /// come or go
  bool set_parameters(std::span<const double> values);

 protected:
  /// info().parameters have changed.
  virtual void parameters_changed() {}

 private:
  using Expressions = SymbolicModel::Expressions;

  void make_programs(const std::vector<StraightLineProgram::Constant>& constants);
  void describe_contacts();
  void describe_structure();
  GiNaC::ex contact_force_work(const std::vector<GiNaC::symbol>& weight) const;

  SymbolicModel stated_, model_;
  Expressions total_force_;  ///< f_v + B_u u
  std::vector<GiNaC::symbol> a_, w_, w_c_, lambda_n_, lambda_t_;

  SparseProgram mass_, force_, gap_, normal_, tangent_, potential_;
  SparseProgram force_jacobian_, mass_q_, contact_q_, gap_bias_, slip_q_;

  // Built at first use: only a transcription and sensitivities need them.
  mutable std::once_flag dynamics_hessian_once_, gap_hessian_once_, parameter_derivative_once_;
  mutable SparseProgram dynamics_hessian_, gap_hessian_, parameter_derivative_;

  bool are_parameters_open_ = false;
  SparseProgram numbers_;  ///< when they are: q0, v0, u, T, all eps_r, all mu, the geometry's, one below the other
  std::vector<double> number_values_;
};

}  // namespace ricochet
