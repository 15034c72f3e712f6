#include "methods/peers/siconos/model.h"

#include <BlockVector.hpp>
#include <Interaction.hpp>
#include <LagrangianLinearTIDS.hpp>
#include <LagrangianLinearTIR.hpp>
#include <LagrangianScleronomousR.hpp>
#include <NewtonImpactFrictionNSL.hpp>
#include <NewtonImpactNSL.hpp>
#include <SimpleMatrix.hpp>
#include <algorithm>

#include "methods/peers/siconos/bodies.h"

namespace ricochet::siconos {
namespace {

SP::SiconosVector to_siconos(const Vector& x) {
  auto copy = std::make_shared<SiconosVector>(static_cast<unsigned>(x.size()));
  std::copy(x.begin(), x.end(), copy->getArray());
  return copy;
}

SP::SimpleMatrix to_siconos(const Matrix& A) {
  auto copy = std::make_shared<SimpleMatrix>(static_cast<unsigned>(A.rows()), static_cast<unsigned>(A.cols()));
  std::copy(A.data(), A.data() + A.size(), copy->getArray());
  return copy;
}

}  // namespace

/// The contacts of the problem at the state that the bodies are in. Siconos asks contact by contact and the problem
/// answers for all, so what was evaluated is kept until a body has moved.
class Model::Kinematics {
 public:
  Kinematics(const Problem& problem, const std::vector<Body>& bodies)
      : problem_(problem), bodies_(bodies), q_(problem.n_q()), v_(problem.n_q()) {}

  const Vector& gap() {
    if (update(q_at_gap_)) {
      gap_.resize(problem_.n_c());
      problem_.gap(q_.data(), gap_.data());
    }
    return gap_;
  }
  /// Sets columns [0, n) of row 0 to J_n, those of the rows below to J_t. `columns`: of each coordinate in the support.
  void jacobian(int contact, const std::vector<int>& columns, SimpleMatrix& H) {
    if (update(q_at_jacobian_)) {
      J_n_.resize(problem_.info().n_normal_entries);
      J_t_.resize(problem_.info().n_tangent_entries);
      problem_.normal_jacobian(q_.data(), J_n_.data());
      if (J_t_.size() > 0) problem_.tangent_jacobian(q_.data(), J_t_.data());
    }
    const ContactInfo& info = problem_.info().contacts[contact];
    const std::size_t n = columns.size();
    for (std::size_t k = 0; k < n; ++k) {
      H(0, columns[k]) = J_n_[info.normal_begin + k];
      for (int d = 0; d < info.n_t; ++d) H(1 + d, columns[k]) = J_t_[info.tangent_begin + d * n + k];
    }
  }
  /// Row 0 of dH: dJ_n/dt = grad^2 f_c v, for the normal acceleration.
  void jacobian_rate(int contact, const std::vector<int>& columns, SimpleMatrix& dH) {
    gather();
    const Matrix hessian = [&] {
      Matrix H(q_.size(), q_.size());
      const Vector w = Vector::Unit(problem_.n_c(), contact);
      problem_.gap_hessian(q_.data(), w.data(), H.data());
      return H;
    }();
    const auto& support = problem_.info().contacts[contact].support;
    for (std::size_t k = 0; k < columns.size(); ++k) dH(0, columns[k]) = hessian.row(support[k]).dot(v_);
  }
  void gather() {
    for (const Body& body : bodies_) {
      const double *q = body.system->q()->getArray(), *v = body.system->velocity()->getArray();
      for (std::size_t k = 0; k < body.coordinates.size(); ++k) {
        q_[body.coordinates[k]] = q[k];
        v_[body.coordinates[k]] = v[k];
      }
    }
  }
  const Vector& q() const { return q_; }
  const Vector& v() const { return v_; }

 private:
  bool update(Vector& evaluated_at) {
    gather();
    if (evaluated_at.size() == q_.size() && evaluated_at == q_) return false;
    evaluated_at = q_;
    return true;
  }

  const Problem& problem_;
  const std::vector<Body>& bodies_;
  Vector q_, v_, q_at_gap_, q_at_jacobian_, gap_, J_n_, J_t_;
};

/// (1), all coordinates in one, evaluated by the problem.
class Model::NonlinearSystem final : public LagrangianDS {
 public:
  NonlinearSystem(const Problem& problem, std::shared_ptr<Counters> counters)
      : LagrangianDS(to_siconos(problem.info().q0), to_siconos(problem.info().v0)),
        problem_(problem),
        counters_(std::move(counters)),
        f_q_(problem.n_q(), problem.n_q()),
        f_v_(problem.n_q(), problem.n_q()) {
    allocateMass();
    _hasConstantMass = false;
    computeMass();
    _forces = std::make_shared<SiconosVector>(_ndof);
    _jacobianqForces = std::make_shared<SimpleMatrix>(_ndof, _ndof);
    _jacobianqDotForces = std::make_shared<SimpleMatrix>(_ndof, _ndof);
  }

  using LagrangianDS::computeMass;
  void computeMass() override { computeMass(_q[0]); }
  void computeMass(SP::SiconosVector q) override {
    problem_.mass_matrix(q->getArray(), _mass->getArray());
    _mass->resetFactorizationFlags();
  }
  void computeForces(double, SP::SiconosVector q, SP::SiconosVector v) override {
    problem_.force(q->getArray(), v->getArray(), problem_.info().u.data(), _forces->getArray());
    ++counters_->force_evaluations;
  }
  void computeJacobianqForces(double) override {
    evaluate_jacobians();
    std::copy(f_q_.data(), f_q_.data() + f_q_.size(), _jacobianqForces->getArray());
  }
  void computeJacobianvForces(double) override {
    evaluate_jacobians();
    std::copy(f_v_.data(), f_v_.data() + f_v_.size(), _jacobianqDotForces->getArray());
  }

 private:
  void evaluate_jacobians() {
    const Eigen::Map<const Vector> q(_q[0]->getArray(), _ndof), v(_q[1]->getArray(), _ndof);
    if (q_.size() > 0 && q_ == q && v_ == v) return;
    q_ = q, v_ = v;
    problem_.force_jacobians(q_.data(), v_.data(), problem_.info().u.data(), f_q_.data(), f_v_.data());
    ++counters_->jacobian_evaluations;
  }

  const Problem& problem_;
  std::shared_ptr<Counters> counters_;
  Vector q_, v_;  // at which f_q_, f_v_ were evaluated
  Matrix f_q_, f_v_;
};

/// (2) of one contact, evaluated by the problem.
class Model::ContactRelation final : public LagrangianScleronomousR {
 public:
  ContactRelation(std::shared_ptr<Kinematics> kinematics, int contact, std::vector<int> columns, unsigned n_y,
                  unsigned n_columns)
      : kinematics_(std::move(kinematics)), contact_(contact), columns_(std::move(columns)) {
    _jachq = std::make_shared<SimpleMatrix>(n_y, n_columns);
    _dotjachq = std::make_shared<SimpleMatrix>(n_y, n_columns);
    _dotjacqhXqdot = std::make_shared<SiconosVector>(n_y);
  }
  void computeh(const BlockVector&, BlockVector&, SiconosVector& y) override { y(0) = kinematics_->gap()[contact_]; }
  void computeJachq(const BlockVector&, BlockVector&) override { kinematics_->jacobian(contact_, columns_, *_jachq); }
  void computeDotJachq(const BlockVector&, BlockVector&, const BlockVector&) override {
    kinematics_->jacobian_rate(contact_, columns_, *_dotjachq);
  }

 private:
  std::shared_ptr<Kinematics> kinematics_;
  int contact_;
  std::vector<int> columns_;
};

Model::Model(const Problem& problem, double end_time, Bodies bodies)
    : problem_(problem),
      system_(std::make_shared<NonSmoothDynamicalSystem>(0.0, end_time)),
      kinematics_(std::make_shared<Kinematics>(problem, bodies_)),
      counters_(std::make_shared<Counters>()) {
  const ProblemInfo& info = problem.info();
  std::vector<int> all(info.n_q);
  for (int k = 0; k < info.n_q; ++k) all[k] = k;
  if (info.structure.constant_mass && info.structure.constant_force_jacobian) {
    const Matrix M = problem.mass_matrix(info.q0);
    Matrix f_q(info.n_q, info.n_q), f_v(info.n_q, info.n_q);
    problem.force_jacobians(info.q0.data(), info.v0.data(), info.u.data(), f_q.data(), f_v.data());
    const Vector f_0 = problem.force(info.q0, info.v0) - f_q * info.q0 - f_v * info.v0;
    const auto sets =
        bodies == Bodies::one ? std::vector<std::vector<int>>{all} : coupled_coordinates(info, M, f_q, f_v);
    for (const auto& set : sets) {
      auto body = std::make_shared<LagrangianLinearTIDS>(
          to_siconos(Vector(info.q0(set))), to_siconos(Vector(info.v0(set))), to_siconos(Matrix(M(set, set))));
      if (const Matrix K = -f_q(set, set); !K.isZero(0)) body->setKPtr(to_siconos(K));
      if (const Matrix C = -f_v(set, set); !C.isZero(0)) body->setCPtr(to_siconos(C));
      body->setFExtPtr(to_siconos(Vector(f_0(set))));
      bodies_.push_back({set, body});
    }
  } else {
    bodies_.push_back({all, std::make_shared<NonlinearSystem>(problem, counters_)});
  }
  for (const Body& body : bodies_) system_->insertDynamicalSystem(body.system);
  for (int i = 0; i < info.n_c(); ++i) add_contact(i);
}

Model::~Model() = default;

void Model::add_contact(int contact) {
  const ContactInfo& info = problem_.info().contacts[contact];
  // The bodies that it touches, and the column of H of each coordinate of its support: those of the first come first.
  std::vector<const Body*> touched;
  for (const Body& body : bodies_) {
    const bool touches = std::any_of(info.support.begin(), info.support.end(), [&](int k) {
      return std::binary_search(body.coordinates.begin(), body.coordinates.end(), k);
    });
    if (touches) touched.push_back(&body);
  }
  std::vector<int> coordinates;
  for (const Body* body : touched)
    coordinates.insert(coordinates.end(), body->coordinates.begin(), body->coordinates.end());
  std::vector<int> columns;
  for (const int k : info.support)
    columns.push_back(static_cast<int>(std::find(coordinates.begin(), coordinates.end(), k) - coordinates.begin()));

  const unsigned n_y = 1 + info.n_t, n_columns = static_cast<unsigned>(coordinates.size());
  SP::NonSmoothLaw law;
  if (info.n_t == 0)
    law = std::make_shared<NewtonImpactNSL>(info.eps_r);
  else
    law = std::make_shared<NewtonImpactFrictionNSL>(info.eps_r, 0.0, info.mu, n_y);
  SP::Relation relation;
  if (info.is_affine) {
    auto H = std::make_shared<SimpleMatrix>(n_y, n_columns);
    kinematics_->jacobian(contact, columns, *H);
    auto e = std::make_shared<SiconosVector>(n_y);
    double Hq = 0;
    for (std::size_t k = 0; k < columns.size(); ++k) Hq += (*H)(0, columns[k]) * problem_.info().q0[info.support[k]];
    (*e)(0) = kinematics_->gap()[contact] - Hq;
    relation = std::make_shared<LagrangianLinearTIR>(H, e);
  } else {
    relation = std::make_shared<ContactRelation>(kinematics_, contact, columns, n_y, n_columns);
  }
  interactions_.push_back(std::make_shared<Interaction>(law, relation));
  system_->link(interactions_.back(), touched[0]->system,
                touched.size() > 1 ? touched[1]->system : SP::DynamicalSystem());
}

void Model::read_state(Vector& q, Vector& v) const {
  kinematics_->gather();
  q = kinematics_->q();
  v = kinematics_->v();
}

void Model::read_impulses(Vector& Lambda_n, Vector& Lambda_t) const {
  for (std::size_t i = 0; i < interactions_.size(); ++i) {
    const ContactInfo& info = problem_.info().contacts[i];
    const double* lambda = interactions_[i]->lambda(1)->getArray();
    Lambda_n[i] = lambda[0];
    for (int d = 0; d < info.n_t; ++d) Lambda_t[info.tangent_index + d] = lambda[1 + d];
  }
}

void Model::count(Counters& counters) const {
  const bool has_matrices = bodies_.front().system->isLinear();
  counters.force_evaluations = has_matrices ? counters.inner_iterations : counters_->force_evaluations;
  counters.jacobian_evaluations = counters_->jacobian_evaluations;
}

std::string message_of(const Siconos::exception& error) {
  const std::string* text = boost::get_error_info<Siconos::exception::extra_message>(error);
  return "Siconos: " + (text ? *text : std::string("an exception without a message"));
}

}  // namespace ricochet::siconos
