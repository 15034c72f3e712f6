#include "methods/contact_laws/contact_scales.h"

#include <cmath>

namespace ricochet {
namespace {

/// The distance that each gap moves by itself until the end, sampled at a few instants. There is a clock.
Vector own_motion(const Problem& problem) {
  constexpr int kInstants = 16;
  const ProblemInfo& info = problem.info();
  Vector motion = Vector::Zero(problem.n_c());
  const Vector start = problem.gap(info.q0);
  Vector q = info.q0;
  for (int k = 1; k <= kInstants; ++k) {
    q[info.clock] = info.start_time() + info.end_time * k / kInstants;
    motion = motion.cwiseMax((problem.gap(q) - start).cwiseAbs());
  }
  return motion;
}

}  // namespace

ContactScales::ContactScales(const Problem& problem) : problem_(problem) {
  for (Vector* of_contacts : {&gap_, &approach_, &slip_, &force_, &G_nn_, &G_tt_}) of_contacts->resize(problem.n_c());
  normal_.resize(problem.info().n_normal_entries);
  restart();
}

void ContactScales::restart() {
  for (Vector* of_contacts : {&gap_, &approach_, &slip_, &force_, &G_nn_, &G_tt_}) of_contacts->setZero();
  if (problem_.info().clock >= 0) gap_ = own_motion(problem_);
  problem_.normal_jacobian(problem_.info().q0.data(), normal_.data());
  normal_ = normal_.cwiseAbs();
}

void ContactScales::begin_step(const double* q, const double* v, double H, bool is_first) {
  const ProblemInfo& info = problem_.info();
  H_ = H;
  if (is_first) {
    load_.resize(info.n_q);
    problem_.force(q, v, info.u.data(), load_.data());
    const Matrix M = problem_.mass_matrix(Vector(Eigen::Map<const Vector>(q, info.n_q)));
    load_ = load_.cwiseQuotient(M.diagonal()).cwiseAbs();
  }
  const double* J = normal_.data();
  for (std::size_t i = 0; i < info.contacts.size(); ++i) {
    double size = 0;
    for (const int k : info.contacts[i].support) {
      const double load = is_first ? H * H * load_[k] : 0;
      size += *J++ * (std::abs(q[k]) + H * std::abs(v[k]) + load);
    }
    raise(gap_[static_cast<Eigen::Index>(i)], size);
  }
}

void ContactScales::record_contact(int contact, const double* J_n, double G_nn, double G_tt) {
  G_nn_[contact] = G_nn;
  G_tt_[contact] = G_tt;
  const auto& info = problem_.info().contacts[contact];
  for (std::size_t s = 0; s < info.support.size(); ++s) raise(normal_[info.normal_begin + s], std::abs(J_n[s]));
}

}  // namespace ricochet
