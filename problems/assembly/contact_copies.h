#pragma once

#include <array>
#include <memory>
#include <vector>

#include "problems/scene.h"

namespace ricochet {

/// Position of one copy of a small scene's contact in a large scene.
struct ContactPlace {
  int contact = 0;               ///< its number in the large scene
  std::vector<int> coordinates;  ///< of the small scene, by their numbers in the large one, ascending
  int normal_begin = 0, tangent_begin = 0, tangent_index = 0;  ///< as in ContactInfo
};

/// All copies of one contact. Arrays are those of the large scene, as in Problem; one call serves all copies, so there
/// is no virtual call per contact, unless single contacts are requested.
class ContactCopies {
 public:
  virtual ~ContactCopies() = default;

  /// The contact in the small scene.
  virtual const ContactInfo& contact() const = 0;
  virtual int n_local() const = 0;
  /// The same kind of contact without copies.
  virtual std::unique_ptr<ContactCopies> without_places() const = 0;
  const ContactPlace& place(std::size_t copy) const { return places_[copy]; }
  void add(ContactPlace place) { places_.push_back(std::move(place)); }
  std::size_t count() const { return places_.size(); }

  virtual void gap(const double* q, double* f_c) const = 0;
  virtual void normal_jacobian(const double* q, double* J_n) const = 0;
  virtual void tangent_jacobian(const double* q, double* J_t) const = 0;
  virtual void gap_acceleration_bias(const double* q, const double* v, double* b) const = 0;
  // Of one copy.
  virtual void gap_of(std::size_t copy, const double* q, double* f_c) const = 0;
  virtual void normal_jacobian_of(std::size_t copy, const double* q, double* J_n) const = 0;
  virtual void tangent_jacobian_of(std::size_t copy, const double* q, double* J_t) const = 0;
  virtual void gap_acceleration_bias_of(std::size_t copy, const double* q, const double* v, double* b) const = 0;
  // Bounds over boxes, as in Problem, of one copy.
  virtual void gap_bounds(std::size_t copy, const Interval* q, Interval* f_c) const = 0;
  virtual void normal_bounds(std::size_t copy, const Interval* q, Interval* J_n) const = 0;
  virtual void tangent_bounds(std::size_t copy, const Interval* q, Interval* J_t) const = 0;
  virtual void gap_bias_bounds(std::size_t copy, const Interval* q, const Interval* v, Interval* b) const = 0;
  virtual void slip_derivative_bounds(std::size_t copy, const Interval* q, const Interval* v, int n_lambda_t,
                                      Interval* T) const = 0;
  // These functions add to their results. n_q is that of the large scene.
  virtual void contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t, int n_q,
                                        double* Jl_q) const = 0;
  virtual void slip_velocity_derivative(const double* q, const double* v, int n_lambda_t, double* T) const = 0;
  /// Adds the part of the contact forces.
  virtual void dynamics_hessian(const double* q, const double* v, const double* lambda_n, const double* lambda_t,
                                const double* w, int n_q, double* H) const = 0;
  virtual void gap_hessian(const double* q, const double* w, int n_q, double* H) const = 0;

 protected:
  std::vector<ContactPlace> places_;
};

/// Common part of the small scenes with one contact: a size, the contact law, and no motion of their own. Each scene
/// states its gap, and its tangents if it has friction.
template <class T, std::size_t n>
struct ContactScene {
  static constexpr SceneText text{"contact", "", "", ""};
  T size{1.0}, e{0.0}, mu{0.0};  ///< size is a radius or a height [m]

  void parameters(auto&& visit) {
    visit("size", size, "m");
    visit("e", e, "1");
    visit("mu", mu, "1");
  }
  std::array<Contact<T>, 1> contacts() const { return {{{"contact", e, mu}}}; }

  Vec<T, n> q0() const { return filled(0); }
  Vec<T, n> v0() const { return filled(0); }
  T end_time() const { return 1; }
  Vec<T, n> mass() const { return filled(1); }
  Vec<T, n> force(const Vec<T, n>&, const Vec<T, n>&) const { return filled(0); }

 private:
  static Vec<T, n> filled(int value) {
    Vec<T, n> x;
    x.fill(T(value));
    return x;
  }
};

/// The copies of the contact of `Scene`, a scene (scene.h) with one contact.
template <template <class> class Scene>
class CopiesOf final : public ContactCopies {
 public:
  explicit CopiesOf(const Scene<double>& scene) : CopiesOf(std::make_shared<const CompiledProblem<Scene>>(scene)) {}
  explicit CopiesOf(std::shared_ptr<const CompiledProblem<Scene>> local) : local_(std::move(local)) {}

  const ContactInfo& contact() const override { return local_->info().contacts[0]; }
  int n_local() const override { return n; }
  std::unique_ptr<ContactCopies> without_places() const override { return std::make_unique<CopiesOf>(local_); }

  void gap(const double* q, double* f_c) const override {
    for (std::size_t copy = 0; copy < places_.size(); ++copy) CopiesOf::gap_of(copy, q, f_c);
  }
  void gap_of(std::size_t copy, const double* q, double* f_c) const override {
    const auto& place = places_[copy];
    local_->gap(gather(place, q).data(), f_c + place.contact);
  }
  void normal_jacobian(const double* q, double* J_n) const override {
    for (std::size_t copy = 0; copy < places_.size(); ++copy) CopiesOf::normal_jacobian_of(copy, q, J_n);
  }
  void normal_jacobian_of(std::size_t copy, const double* q, double* J_n) const override {
    const auto& place = places_[copy];
    local_->normal_jacobian(gather(place, q).data(), J_n + place.normal_begin);
  }
  void tangent_jacobian(const double* q, double* J_t) const override {
    for (std::size_t copy = 0; copy < places_.size(); ++copy) CopiesOf::tangent_jacobian_of(copy, q, J_t);
  }
  void tangent_jacobian_of(std::size_t copy, const double* q, double* J_t) const override {
    if (contact().n_t == 0) return;
    const auto& place = places_[copy];
    local_->tangent_jacobian(gather(place, q).data(), J_t + place.tangent_begin);
  }
  void gap_acceleration_bias(const double* q, const double* v, double* b) const override {
    for (std::size_t copy = 0; copy < places_.size(); ++copy) CopiesOf::gap_acceleration_bias_of(copy, q, v, b);
  }
  void gap_acceleration_bias_of(std::size_t copy, const double* q, const double* v, double* b) const override {
    const auto& place = places_[copy];
    local_->gap_acceleration_bias(gather(place, q).data(), gather(place, v).data(), b + place.contact);
  }
  void gap_bounds(std::size_t copy, const Interval* q, Interval* f_c) const override {
    const auto& place = places_[copy];
    local_->gap_bounds({}, gather(place, q).data(), f_c + place.contact);
  }
  void normal_bounds(std::size_t copy, const Interval* q, Interval* J_n) const override {
    const auto& place = places_[copy];
    local_->normal_bounds({}, gather(place, q).data(), J_n + place.normal_begin);
  }
  void tangent_bounds(std::size_t copy, const Interval* q, Interval* J_t) const override {
    if (contact().n_t == 0) return;
    const auto& place = places_[copy];
    local_->tangent_bounds({}, gather(place, q).data(), J_t + place.tangent_begin);
  }
  void gap_bias_bounds(std::size_t copy, const Interval* q, const Interval* v, Interval* b) const override {
    const auto& place = places_[copy];
    local_->gap_bias_bounds({}, gather(place, q).data(), gather(place, v).data(), b + place.contact);
  }
  void slip_derivative_bounds(std::size_t copy, const Interval* q, const Interval* v, int n_lambda_t,
                              Interval* T) const override {
    const int n_t = contact().n_t;
    if (contact().is_affine || n_t == 0) return;
    const auto& place = places_[copy];
    std::array<Interval, 2 * n> block;
    local_->slip_derivative_bounds({}, gather(place, q).data(), gather(place, v).data(), block.data());
    for (int k = 0; k < n; ++k) {
      for (int d = 0; d < n_t; ++d) T[place.coordinates[k] * n_lambda_t + place.tangent_index + d] = block[k * n_t + d];
    }
  }
  void contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t, int n_q,
                                double* Jl_q) const override {
    if (contact().is_affine) return;
    std::array<double, n * n> block;
    for (const auto& place : places_) {
      if (lambda_n[place.contact] == 0 && contact().n_t == 0) continue;
      local_->contact_force_derivative(gather(place, q).data(), lambda_n + place.contact,
                                       lambda_t ? lambda_t + place.tangent_index : nullptr, block.data());
      scatter(place, block, n_q, Jl_q);
    }
  }
  void slip_velocity_derivative(const double* q, const double* v, int n_lambda_t, double* T) const override {
    const int n_t = contact().n_t;
    if (contact().is_affine || n_t == 0) return;
    std::array<double, 2 * n> block;
    for (const auto& place : places_) {
      local_->slip_velocity_derivative(gather(place, q).data(), gather(place, v).data(), block.data());
      for (int k = 0; k < n; ++k) {
        for (int d = 0; d < n_t; ++d)
          T[place.coordinates[k] * n_lambda_t + place.tangent_index + d] += block[k * n_t + d];
      }
    }
  }
  void dynamics_hessian(const double* q, const double* v, const double* lambda_n, const double* lambda_t,
                        const double* w, int n_q, double* H) const override {
    if (contact().is_affine) return;
    const std::array<double, n> none{};
    std::array<double, 4 * n * n> block;
    for (const auto& place : places_) {
      local_->dynamics_hessian(gather(place, q).data(), gather(place, v).data(), nullptr, none.data(),
                               lambda_n + place.contact, lambda_t ? lambda_t + place.tangent_index : nullptr,
                               gather(place, w).data(), block.data());
      for (int column = 0; column < 2 * n; ++column) {
        for (int row = 0; row < 2 * n; ++row)
          H[at(place, column, n_q) * 2 * n_q + at(place, row, n_q)] += block[column * 2 * n + row];
      }
    }
  }
  void gap_hessian(const double* q, const double* w, int n_q, double* H) const override {
    if (contact().is_affine) return;
    std::array<double, n * n> block;
    for (const auto& place : places_) {
      local_->gap_hessian(gather(place, q).data(), w + place.contact, block.data());
      scatter(place, block, n_q, H);
    }
  }

 private:
  static constexpr int n = static_cast<int>(scene_detail::n_q<Scene<double>>);

  template <class Number>
  static std::array<Number, n> gather(const ContactPlace& place, const Number* x) {
    std::array<Number, n> local;
    for (int k = 0; k < n; ++k) local[k] = x[place.coordinates[k]];
    return local;
  }
  /// Index in the large scene of the local entry k of (q, v).
  static int at(const ContactPlace& place, int k, int n_q) {
    return k < n ? place.coordinates[k] : n_q + place.coordinates[k - n];
  }
  static void scatter(const ContactPlace& place, const std::array<double, n * n>& block, int n_q, double* to) {
    for (int column = 0; column < n; ++column) {
      for (int row = 0; row < n; ++row)
        to[place.coordinates[column] * n_q + place.coordinates[row]] += block[column * n + row];
    }
  }

  std::shared_ptr<const CompiledProblem<Scene>> local_;
};

}  // namespace ricochet
