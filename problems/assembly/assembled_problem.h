#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/assembly/contact_copies.h"

namespace ricochet {

/// A scene with any number of bodies and contacts. Masses and forces are constant, M is diagonal, and contacts are
/// copies of the contacts of small scenes,
///
///   M = diag(m),   f_v = f,   f_c^i(q) = f_c(q at the coordinates of contact i),                            (1)
///
/// so that formulas and their derivatives by GiNaC are made once per kind of contact, not once per contact. Formulas of
/// the whole scene (assembled_model.h) are made only when they are asked for; no value is computed from them.
class AssembledProblem : public Problem {
 public:
  /// Adds a kind of contact, that of the small scene.
  class Kind {
   public:
    Kind() = default;

   private:
    friend class AssembledProblem;
    explicit Kind(ContactCopies* copies) : copies_(copies) {}
    ContactCopies* copies_ = nullptr;
  };

  explicit AssembledProblem(const SceneText& text, double end_time);

  /// @param m  mass or moment of inertia. @param f  constant force or torque. @return the number of the coordinate
  int add_coordinate(double m, double f, double q0, double v0);

  template <template <class> class Scene>
  Kind add_kind(const Scene<double>& scene) {
    kinds_.push_back(std::make_unique<CopiesOf<Scene>>(scene));
    return Kind(kinds_.back().get());
  }

  /// @param coordinates  of the small scene, by their numbers here, ascending. @return the number of the contact
  int add_contact(Kind kind, std::vector<int> coordinates, std::string name);

  /// Sets the geometry; to be called last.
  void set_geometry(GeometryOf<double> geometry) {
    info_.geometry = std::make_shared<Geometry>(Geometry{std::move(geometry)});
  }

  /// Sets the function that makes the formulas of this scene.
  void set_formulas(std::function<SymbolicModel()> make) { make_model_ = std::move(make); }
  /// Made at the first call; n_q^2 entries of M.
  const SymbolicModel* formulas() const override;

  std::unique_ptr<Problem> part(std::span<const int> coordinates, std::span<const int> contacts) const override;

  void mass_matrix(const double* q, double* M) const override;
  void force(const double* q, const double* v, const double* u, double* f) const override;
  void gap(const double* q, double* f_c) const override;
  void normal_jacobian(const double* q, double* J_n) const override;
  void tangent_jacobian(const double* q, double* J_t) const override;
  void gap_of(std::span<const int> contacts, const double* q, double* f_c) const override;
  void gap_acceleration_bias_of(std::span<const int> contacts, const double* q, const double* v,
                                double* b) const override;
  void normal_jacobian_of(std::span<const int> contacts, const double* q, double* J_n) const override;
  void tangent_jacobian_of(std::span<const int> contacts, const double* q, double* J_t) const override;
  void mass_bounds(const Interval* q, Interval* M) const override;
  void force_bounds(const Interval* q, const Interval* v, const double* u, Interval* f) const override;
  void gap_bounds(std::span<const int> contacts, const Interval* q, Interval* f_c) const override;
  void normal_bounds(std::span<const int> contacts, const Interval* q, Interval* J_n) const override;
  void tangent_bounds(std::span<const int> contacts, const Interval* q, Interval* J_t) const override;
  void gap_bias_bounds(std::span<const int> contacts, const Interval* q, const Interval* v, Interval* b) const override;
  void slip_derivative_bounds(std::span<const int> contacts, const Interval* q, const Interval* v,
                              Interval* T) const override;
  double potential_energy(const double* q) const override;
  void force_jacobians(const double* q, const double* v, const double* u, double* f_q, double* f_v) const override;
  void mass_derivative(const double* q, const double* a, double* Ma_q) const override;
  void contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t,
                                double* Jl_q) const override;
  void gap_acceleration_bias(const double* q, const double* v, double* b) const override;
  void slip_velocity_derivative(const double* q, const double* v, double* T) const override;
  void dynamics_hessian(const double* q, const double* v, const double* u, const double* a, const double* lambda_n,
                        const double* lambda_t, const double* w, double* H) const override;
  void gap_hessian(const double* q, const double* w, double* H) const override;
  /// Does nothing: an assembled scene has no parameters for derivatives.
  void parameter_derivative(const double*, const double*, const double*, const double*, const double*,
                            double*) const override {}
  void parameter_derivative_of_constants(double*) const override {}

 private:
  std::vector<double> masses_, forces_;
  std::vector<std::unique_ptr<ContactCopies>> kinds_;
  /// A contact: its kind, and the number of its copy.
  struct Copy {
    const ContactCopies* kind;
    std::size_t number;
  };
  std::vector<Copy> copies_;  // n_c

  std::function<SymbolicModel()> make_model_;
  mutable std::optional<SymbolicModel> formulas_;
};

}  // namespace ricochet
