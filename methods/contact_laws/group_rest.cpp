#include "methods/contact_laws/group_rest.h"

#include <algorithm>
#include <cmath>

namespace ricochet {
namespace {

constexpr double kExplained = 16;                               // of (3)
constexpr double kFlat = 1e-3, kSteep = 0.03, kOfWedge = 0.01;  // of (4)

}  // namespace

GroupRest::GroupRest(const Problem& problem, const ContactScales& scales, ImpactSolver& law)
    : problem_(problem), scales_(scales), law_(law) {
  for (auto* x : {&change_, &v_}) x->setZero(problem.n_q());
  wedge_.reserve(problem.info().contacts.size());
}

double GroupRest::low_speed(const Vector& q, const Eigen::Ref<const Vector>& v, std::span<const int> contacts) {
  double height = 0, load = 0;
  for (const int i : contacts) height = std::max(height, scales_.capture_height(i));
  if (!(height > 0)) return 0;
  v_ = v;
  const Vector& w = law_.free_acceleration(q, v_);
  for (const int i : contacts) load = std::max(load, law_.normal_velocity_scale(i, w));
  return std::sqrt(2 * load * height);
}

/// (3) for change_.
bool GroupRest::is_explained(const Vector& q, double of_group, std::size_t n) {
  if (M_.size() == 0) M_.resize(problem_.n_q(), problem_.n_q());
  problem_.mass_matrix(q.data(), M_.data());
  const auto count = static_cast<double>(n);
  return change_.dot(M_ * change_) <= kExplained * count * count * of_group;
}

bool GroupRest::is_explained(const Vector& q, const Eigen::Ref<const Vector>& v, const Eigen::Ref<const Vector>& v_plus,
                             double of_group, std::size_t n) {
  change_ = v_plus - v;
  return is_explained(q, of_group, n);
}

bool GroupRest::is_explained_by_rates(std::span<const int> group, const Vector& q, const Eigen::Ref<const Vector>& v,
                                      const Eigen::Ref<const Vector>& v_plus) {
  double size = 0;
  for (const int i : group) {
    const double rate = law_.normal_velocity(i, v);
    size += rate * rate / law_.normal_delassus(i);
  }
  return is_explained(q, v, v_plus, size, group.size());
}

bool GroupRest::is_explained_by_gaps(std::span<const int> group, const Vector& gap, const Vector& q,
                                     const Vector& q_moved) {
  double size = 0;
  for (const int i : group) size += gap[i] * gap[i] / law_.normal_delassus(i);
  change_ = q_moved - q;
  return is_explained(q, size, group.size());
}

const std::vector<int>& GroupRest::find_wedge(std::span<const int> contacts, const Vector& lambda_n) {
  const auto size = [&](int i) {
    const double* J_n = law_.normal(i);
    double largest = 0;
    for (std::size_t s = 0; s < law_.contact(i).support.size(); ++s) largest = std::max(largest, std::abs(J_n[s]));
    return lambda_n[i] * largest;
  };
  double largest = 0;
  for (const int i : contacts) largest = std::max(largest, size(i));
  wedge_.clear();
  change_.setZero();
  for (const int i : contacts) {
    if (!(size(i) > kOfWedge * largest)) continue;
    wedge_.push_back(i);
    const double* J_n = law_.normal(i);
    for (const int k : law_.contact(i).support) change_[k] += lambda_n[i] * *J_n++;
  }
  const double inclination = std::clamp(std::sqrt(scales_.redundant()), kFlat, kSteep);  // redundant: 100 delta / gap
  if (change_.lpNorm<Eigen::Infinity>() >= inclination * largest) wedge_.clear();
  return wedge_;
}

}  // namespace ricochet
