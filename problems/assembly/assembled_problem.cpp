#include "problems/assembly/assembled_problem.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <stdexcept>

namespace ricochet {

AssembledProblem::AssembledProblem(const SceneText& text, double end_time) {
  info_.id = text.id;
  info_.title = text.title;
  info_.source = text.source;
  info_.hard_feature = text.hard_feature;
  info_.end_time = end_time;
  info_.structure.constant_mass = true;
  info_.structure.diagonal_mass = true;
  info_.structure.constant_force_jacobian = true;
  info_.structure.has_potential = true;
  info_.structure.has_bounds = true;
}

int AssembledProblem::add_coordinate(double m, double f, double q0, double v0) {
  masses_.push_back(m);
  forces_.push_back(f);
  const Eigen::Index k = info_.n_q++;
  info_.q0.conservativeResize(info_.n_q);
  info_.v0.conservativeResize(info_.n_q);
  info_.q0[k] = q0;
  info_.v0[k] = v0;
  return static_cast<int>(k);
}

int AssembledProblem::add_contact(Kind kind, std::vector<int> coordinates, std::string name) {
  ContactCopies& copies = *kind.copies_;
  if (static_cast<int>(coordinates.size()) != copies.n_local() || !std::ranges::is_sorted(coordinates))
    throw std::logic_error("contact " + name + ": coordinates of another number or order than its scene has");
  ContactInfo contact = copies.contact();
  contact.name = std::move(name);
  for (int& k : contact.support) k = coordinates[k];
  contact.normal_begin = info_.n_normal_entries;
  contact.tangent_begin = info_.n_tangent_entries;
  contact.tangent_index = info_.n_lambda_t;
  copies_.push_back({&copies, copies.count()});
  copies.add({info_.n_c(), std::move(coordinates), contact.normal_begin, contact.tangent_begin, contact.tangent_index});
  const int entries = static_cast<int>(contact.support.size());
  info_.n_normal_entries += entries;
  info_.n_tangent_entries += entries * contact.n_t;
  info_.n_lambda_t += contact.n_t;
  (contact.is_bilateral ? info_.bilateral : info_.unilateral).push_back(info_.n_c());
  info_.contacts.push_back(std::move(contact));
  return info_.n_c() - 1;
}

const SymbolicModel* AssembledProblem::formulas() const {
  if (!make_model_) return nullptr;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (!formulas_) formulas_ = normalized(make_model_());
  return &*formulas_;
}

std::unique_ptr<Problem> AssembledProblem::part(std::span<const int> coordinates, std::span<const int> contacts) const {
  if (info_.has_bilateral()) return nullptr;
  auto part = std::make_unique<AssembledProblem>(
      SceneText{info_.id.c_str(), info_.title.c_str(), info_.source.c_str(), info_.hard_feature.c_str()},
      info_.end_time);
  std::vector<int> number(masses_.size(), -1);  // of a coordinate in the part
  for (const int k : coordinates)
    number[static_cast<std::size_t>(k)] = part->add_coordinate(masses_[k], forces_[k], info_.q0[k], info_.v0[k]);
  std::map<const ContactCopies*, Kind> kinds;
  for (const int i : contacts) {
    const Copy& copy = copies_[static_cast<std::size_t>(i)];
    auto [kind, is_new] = kinds.try_emplace(copy.kind);
    if (is_new) {
      part->kinds_.push_back(copy.kind->without_places());
      kind->second = Kind(part->kinds_.back().get());
    }
    std::vector<int> of_part = copy.kind->place(copy.number).coordinates;
    for (int& k : of_part) k = number[static_cast<std::size_t>(k)];
    // A coordinate outside of the part is none on which the contact depends: any other one stands for it.
    int stand_in = *std::ranges::find_if(of_part, [](int k) { return k >= 0; });
    for (int& k : of_part) stand_in = k = k < 0 ? stand_in : k;
    part->add_contact(kind->second, std::move(of_part), info_.contacts[static_cast<std::size_t>(i)].name);
  }
  part->info_.geometry = info_.geometry;
  part->info_.impact_law = info_.impact_law;
  return part;
}

void AssembledProblem::mass_matrix(const double*, double* M) const {
  std::fill_n(M, info_.n_q * info_.n_q, 0.0);
  for (int k = 0; k < info_.n_q; ++k) M[k * (info_.n_q + 1)] = masses_[k];
}

void AssembledProblem::force(const double*, const double*, const double*, double* f) const {
  std::ranges::copy(forces_, f);
}

void AssembledProblem::mass_bounds(const Interval*, Interval* M) const {
  std::fill_n(M, info_.n_q * info_.n_q, Interval(0.0));
  for (int k = 0; k < info_.n_q; ++k) M[k * (info_.n_q + 1)] = masses_[k];
}

void AssembledProblem::force_bounds(const Interval*, const Interval*, const double*, Interval* f) const {
  std::ranges::copy(forces_, f);
}

void AssembledProblem::gap_bounds(std::span<const int> contacts, const Interval* q, Interval* f_c) const {
  for (const int i : contacts) copies_[i].kind->gap_bounds(copies_[i].number, q, f_c);
}

void AssembledProblem::normal_bounds(std::span<const int> contacts, const Interval* q, Interval* J_n) const {
  for (const int i : contacts) copies_[i].kind->normal_bounds(copies_[i].number, q, J_n);
}

void AssembledProblem::tangent_bounds(std::span<const int> contacts, const Interval* q, Interval* J_t) const {
  for (const int i : contacts) copies_[i].kind->tangent_bounds(copies_[i].number, q, J_t);
}

void AssembledProblem::gap_bias_bounds(std::span<const int> contacts, const Interval* q, const Interval* v,
                                       Interval* b) const {
  for (const int i : contacts) copies_[i].kind->gap_bias_bounds(copies_[i].number, q, v, b);
}

void AssembledProblem::slip_derivative_bounds(std::span<const int> contacts, const Interval* q, const Interval* v,
                                              Interval* T) const {
  std::fill_n(T, info_.n_lambda_t * info_.n_q, Interval(0.0));
  for (const int i : contacts) copies_[i].kind->slip_derivative_bounds(copies_[i].number, q, v, info_.n_lambda_t, T);
}

double AssembledProblem::potential_energy(const double* q) const {
  double energy = 0;
  for (int k = 0; k < info_.n_q; ++k) energy -= forces_[k] * q[k];
  return energy;
}

void AssembledProblem::force_jacobians(const double*, const double*, const double*, double* f_q, double* f_v) const {
  std::fill_n(f_q, info_.n_q * info_.n_q, 0.0);
  std::fill_n(f_v, info_.n_q * info_.n_q, 0.0);
}

void AssembledProblem::mass_derivative(const double*, const double*, double* Ma_q) const {
  std::fill_n(Ma_q, info_.n_q * info_.n_q, 0.0);
}

void AssembledProblem::gap(const double* q, double* f_c) const {
  for (const auto& kind : kinds_) kind->gap(q, f_c);
}

void AssembledProblem::gap_of(std::span<const int> contacts, const double* q, double* f_c) const {
  for (const int i : contacts) copies_[i].kind->gap_of(copies_[i].number, q, f_c);
}

void AssembledProblem::gap_acceleration_bias_of(std::span<const int> contacts, const double* q, const double* v,
                                                double* b) const {
  for (const int i : contacts) copies_[i].kind->gap_acceleration_bias_of(copies_[i].number, q, v, b);
}

void AssembledProblem::normal_jacobian(const double* q, double* J_n) const {
  for (const auto& kind : kinds_) kind->normal_jacobian(q, J_n);
}

void AssembledProblem::normal_jacobian_of(std::span<const int> contacts, const double* q, double* J_n) const {
  for (const int i : contacts) copies_[i].kind->normal_jacobian_of(copies_[i].number, q, J_n);
}

void AssembledProblem::tangent_jacobian(const double* q, double* J_t) const {
  for (const auto& kind : kinds_) kind->tangent_jacobian(q, J_t);
}

void AssembledProblem::tangent_jacobian_of(std::span<const int> contacts, const double* q, double* J_t) const {
  for (const int i : contacts) copies_[i].kind->tangent_jacobian_of(copies_[i].number, q, J_t);
}

void AssembledProblem::gap_acceleration_bias(const double* q, const double* v, double* b) const {
  for (const auto& kind : kinds_) kind->gap_acceleration_bias(q, v, b);
}

void AssembledProblem::contact_force_derivative(const double* q, const double* lambda_n, const double* lambda_t,
                                                double* Jl_q) const {
  std::fill_n(Jl_q, info_.n_q * info_.n_q, 0.0);
  for (const auto& kind : kinds_) kind->contact_force_derivative(q, lambda_n, lambda_t, info_.n_q, Jl_q);
}

void AssembledProblem::slip_velocity_derivative(const double* q, const double* v, double* T) const {
  std::fill_n(T, info_.n_lambda_t * info_.n_q, 0.0);
  for (const auto& kind : kinds_) kind->slip_velocity_derivative(q, v, info_.n_lambda_t, T);
}

void AssembledProblem::dynamics_hessian(const double* q, const double* v, const double*, const double*,
                                        const double* lambda_n, const double* lambda_t, const double* w,
                                        double* H) const {
  std::fill_n(H, 4 * info_.n_q * info_.n_q, 0.0);
  for (const auto& kind : kinds_) kind->dynamics_hessian(q, v, lambda_n, lambda_t, w, info_.n_q, H);
}

void AssembledProblem::gap_hessian(const double* q, const double* w, double* H) const {
  std::fill_n(H, info_.n_q * info_.n_q, 0.0);
  for (const auto& kind : kinds_) kind->gap_hessian(q, w, info_.n_q, H);
}

}  // namespace ricochet
