#include "methods/peers/engines/engine_scene.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "problems/levers.h"

namespace ricochet {
namespace {

std::vector<double> numbers_of(const Vector& x) {
  return {x.begin(), x.end()};
}

/// The pairs of shapes of a geometry: corners of a box are one pair.
std::vector<EnginePair> pairs_of(const ProblemInfo& info) {
  std::vector<EnginePair> pairs;
  for (const ShapePair& pair : info.geometry->pairs) {
    const ContactInfo& contact = info.contacts[static_cast<std::size_t>(pair.contact)];
    const auto known = std::find_if(pairs.begin(), pairs.end(), [&](const EnginePair& other) {
      return other.first == pair.first && other.second == pair.second;
    });
    if (known == pairs.end()) pairs.push_back({pair.first, pair.second, contact.eps_r, contact.mu});
  }
  return pairs;
}

/// Whether a coordinate is that of a joint of its own: a body's position along an axis, or its angle in the plane.
bool has_joint(const Geometry& geometry, int coordinate) {
  return std::ranges::any_of(geometry.bodies, [&](const Body& body) {
    const auto is_it = [&](const PoseEntry& entry) { return entry.coordinate == coordinate; };
    return std::ranges::any_of(body.position, is_it) ||
           (body.rotation == BodyRotation::planar && is_it(body.angles[0]));
  });
}

/// Whether the friction elements act along one coordinate of a body each, with constant bounds and at rest in the world.
Support passes_elements(const ProblemInfo& info, bool has_joint_friction) {
  if (has_levers(info)) return Support::no("it has no friction elements that are bounded by the force of a contact");
  if (info.n_friction_elements == 0) return Support::yes();
  if (!has_joint_friction) return Support::no("it has no friction elements");
  for (const ContactInfo& contact : info.contacts) {
    if (!contact.is_friction_element) continue;
    const bool is_along_one = contact.n_t == 1 && contact.support.size() == 2 && contact.is_affine;
    if (!contact.bound || !is_along_one || !has_joint(*info.geometry, contact.support[0]))
      return Support::no(fmt::format(
          "friction element '{}' is not along one coordinate of a body with a constant bound", contact.name));
  }
  return Support::yes();
}

/// Bounds of friction elements, by coordinate: several on one coordinate add up.
Vector joint_friction_of(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  Vector friction = Vector::Zero(info.n_q);
  const Matrix J_t = problem.tangent_jacobian(info.q0);
  for (const ContactInfo& contact : info.contacts) {
    if (contact.is_friction_element) friction += *contact.bound * J_t.col(contact.tangent_index).cwiseAbs();
  }
  return friction;
}

/// v of a body with three angles: omega = J_omega v.
Eigen::Matrix3d J_omega_of(const Body& body, const BodyMotion<double>& motion) {
  Eigen::Matrix3d J;
  for (int k = 0; k < 3; ++k) {
    const auto& column = motion.J_omega[static_cast<std::size_t>(body.angles[static_cast<std::size_t>(k)].coordinate)];
    J.col(k) << column[0], column[1], column[2];
  }
  return J;
}

/// The angle nearest to `near` that differs from `angle` by whole turns.
double unwound(double angle, double near) {
  const double turn = 2 * std::acos(-1.0);
  return angle + turn * std::round((near - angle) / turn);
}

/// Cardan angles of R, those of the two triples that are next to `near`.
std::array<double, 3> cardan_angles(const Matrix3<double>& R, const std::array<double, 3>& near) {
  const double pi = std::acos(-1.0), beta = std::asin(std::clamp(R[0][2], -1.0, 1.0));
  const double alpha = std::atan2(-R[1][2], R[2][2]), gamma = std::atan2(-R[0][1], R[0][0]);
  std::array<double, 3> best{};
  double least = HUGE_VAL;
  for (const auto& angles : {std::array{alpha, beta, gamma}, std::array{alpha + pi, pi - beta, gamma + pi}}) {
    std::array<double, 3> unwrapped{};
    double distance = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      unwrapped[k] = unwound(angles[k], near[k]);
      distance += std::abs(unwrapped[k] - near[k]);
    }
    if (distance < least) best = unwrapped, least = distance;
  }
  return best;
}

}  // namespace

Support EngineScene::supports(const ProblemInfo& info, bool has_joint_friction) {
  if (!info.geometry) return Support::no("the scene states no bodies and shapes, only formulas");
  if (info.has_bilateral()) return Support::no("bilateral constraints are not passed on to engines");
  if (info.clock >= 0) return Support::no("surfaces and forces that depend on time are not passed on to engines");
  if (const Support support = passes_elements(info, has_joint_friction); !support.ok) return support;
  if (std::ranges::any_of(info.contacts, &ContactInfo::mu_varies))
    return Support::no("friction coefficients that depend on the place or the time are not passed on to engines");
  const Geometry& geometry = *info.geometry;
  if (static_cast<int>(geometry.pairs.size()) != info.n_c() - info.n_friction_elements)
    return Support::no("some contact of the scene is between no two shapes");
  for (const Body& body : geometry.bodies) {
    if (!has_own_coordinates(body))
      return Support::no(
          fmt::format("body '{}' hangs on another one or on a pivot: joints are not passed on to engines", body.name));
    const int needed = body.rotation == BodyRotation::none ? 0 : body.rotation == BodyRotation::planar ? 1 : 3;
    for (int k = 0; k < needed; ++k) {
      if (body.angles[static_cast<std::size_t>(k)].coordinate < 0)
        return Support::no(fmt::format("body '{}' turns about some of its axes only", body.name));
    }
  }
  if (std::ranges::find(geometry.shapes, ShapeKind::polygon, &BodyShape::kind) != geometry.shapes.end())
    return Support::no("polygons are not passed on to engines");
  const auto shape = [&](int i) -> const BodyShape& { return geometry.shapes[static_cast<std::size_t>(i)]; };
  for (const ShapePair& pair : geometry.pairs) {
    const ContactInfo& contact = info.contacts[static_cast<std::size_t>(pair.contact)];
    const Touch<double> touch = contact_of<double>(geometry, pair, numbers_of(info.q0));
    for (const ShapePair& other : geometry.pairs) {
      const ContactInfo& another = info.contacts[static_cast<std::size_t>(other.contact)];
      if (shape(pair.first).body == shape(other.first).body && shape(pair.second).body == shape(other.second).body &&
          (contact.eps_r != another.eps_r || contact.mu != another.mu))
        return Support::no("contacts of the same two bodies have different coefficients");
    }
    // Along an axis without coordinate an engine's body would give way.
    for (const int side : {pair.first, pair.second}) {
      if (shape(side).body < 0) continue;
      const Body& body = geometry.bodies[static_cast<std::size_t>(shape(side).body)];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double push = std::abs(touch.normal[axis]);
        if (contact.n_t > 0) push += std::abs(touch.tangents[0][axis]);
        if (contact.n_t > 1) push += std::abs(touch.tangents[1][axis]);
        if (body.position[axis].coordinate < 0 && push > 1e-12)
          return Support::no(
              fmt::format("body '{}' is held against contact forces by what is no coordinate", body.name));
      }
    }
  }
  return Support::yes();
}

EngineScene::EngineScene(const Problem& problem)
    : problem_(problem),
      pairs_(pairs_of(problem.info())),
      joint_friction_(joint_friction_of(problem)),
      has_only_weight_(is_weight_alone()) {}

const EnginePair* EngineScene::pair_of(int shape, int other) const {
  for (const EnginePair& pair : pairs_) {
    if ((pair.first == shape && pair.second == other) || (pair.first == other && pair.second == shape)) return &pair;
  }
  return nullptr;
}

std::vector<int> EngineScene::touching_shapes_of(int body) const {
  std::vector<int> shapes;
  for (int i = 0; i < static_cast<int>(geometry().shapes.size()); ++i) {
    const auto is_in = [i](const EnginePair& pair) { return pair.first == i || pair.second == i; };
    if (shape(i).body == body && std::any_of(pairs_.begin(), pairs_.end(), is_in)) shapes.push_back(i);
  }
  return shapes;
}

bool EngineScene::moves_along(int body, int axis) const {
  return this->body(body).position[static_cast<std::size_t>(axis)].coordinate >= 0;
}

std::vector<BodyState> EngineScene::states_of(const Vector& q, const Vector& v) const {
  std::vector<BodyState> states;
  for (int i = 0; i < n_bodies(); ++i) {
    const BodyMotion<double> motion = motion_of<double>(geometry(), i, numbers_of(q));
    BodyState state{motion, {}, {}};
    for (Eigen::Index k = 0; k < v.size(); ++k) {
      state.velocity = sum(state.velocity, scaled(v[k], motion.J_centre[static_cast<std::size_t>(k)]));
      state.omega = sum(state.omega, scaled(v[k], motion.J_omega[static_cast<std::size_t>(k)]));
    }
    states.push_back(state);
  }
  return states;
}

void EngineScene::coordinates_of(std::span<const BodyState> states, double h, Vector& q, Vector& v) const {
  for (int i = 0; i < n_bodies(); ++i) {
    const Body& body = this->body(i);
    const BodyState& state = states[static_cast<std::size_t>(i)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const PoseEntry& entry = body.position[axis];
      if (entry.coordinate < 0) continue;
      q[entry.coordinate] = state.pose.centre[axis] - entry.offset;
      v[entry.coordinate] = state.velocity[axis];
    }
    const auto angle = [&](std::size_t k) -> double& { return q[body.angles[k].coordinate]; };
    const auto rate = [&](std::size_t k) -> double& { return v[body.angles[k].coordinate]; };
    switch (body.rotation) {
      case BodyRotation::none:
        break;
      case BodyRotation::planar: {
        const double offset = body.angles[0].offset, turned = std::atan2(state.pose.R[1][0], state.pose.R[0][0]);
        angle(0) = unwound(turned - offset, angle(0) + h * state.omega[2]);
        rate(0) = state.omega[2];
        break;
      }
      case BodyRotation::spin:
        for (std::size_t k = 0; k < 3; ++k) {
          angle(k) += h * state.omega[k];
          rate(k) = state.omega[k];
        }
        break;
      case BodyRotation::cardan: {
        std::array<double, 3> near{};
        for (std::size_t k = 0; k < 3; ++k) near[k] = angle(k) + h * rate(k) + body.angles[k].offset;
        const auto angles = cardan_angles(state.pose.R, near);
        for (std::size_t k = 0; k < 3; ++k) angle(k) = angles[k] - body.angles[k].offset;
        const Eigen::Matrix3d J = J_omega_of(body, motion_of<double>(geometry(), i, numbers_of(q)));
        const Eigen::Vector3d rates = J.inverse() * Eigen::Vector3d(state.omega[0], state.omega[1], state.omega[2]);
        for (std::size_t k = 0; k < 3; ++k) rate(k) = rates[static_cast<Eigen::Index>(k)];
        break;
      }
    }
  }
}

Vector EngineScene::external_force(const Vector& q, const Vector& v) const {  // (1)
  Vector f = problem_.force(q, v);
  if (problem_.info().structure.constant_mass) return f;
  Matrix Mv_q(q.size(), q.size());
  problem_.mass_derivative(q.data(), v.data(), Mv_q.data());
  return f + Mv_q * v - 0.5 * Mv_q.transpose() * v;
}

bool EngineScene::is_weight_alone() const {
  // Formulas that agree at twenty random states agree everywhere, unless they are chosen to deceive.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int sample = 0; sample < 20; ++sample) {
    Vector q = problem_.info().q0, v = problem_.info().v0;
    for (double& x : q) x += any(random);
    for (double& x : v) x += any(random);
    const Vector f = external_force(q, v);
    const std::vector<double> weight = weight_of<double>(geometry(), numbers_of(q));
    for (Eigen::Index k = 0; k < problem_.info().n_mechanical(); ++k) {
      const double w = weight[static_cast<std::size_t>(k)];
      if (std::abs(f[k] - w) > 1e-10 * (1 + std::abs(w))) return false;
    }
  }
  return true;
}

void EngineScene::wrenches(const Vector& q, const Vector& v, std::span<Wrench> wrenches) const {
  const Vector f = external_force(q, v);
  for (int i = 0; i < n_bodies(); ++i) {
    const Body& body = this->body(i);
    Wrench& wrench = wrenches[static_cast<std::size_t>(i)];
    wrench = {};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (body.position[axis].coordinate >= 0) wrench.force[axis] = f[body.position[axis].coordinate];
    }
    if (body.rotation == BodyRotation::planar) wrench.torque[2] = f[body.angles[0].coordinate];
    if (!turns_in_space(i)) continue;
    Eigen::Vector3d at_angles;
    for (int k = 0; k < 3; ++k) at_angles[k] = f[body.angles[static_cast<std::size_t>(k)].coordinate];
    const Eigen::Matrix3d J = J_omega_of(body, motion_of<double>(geometry(), i, numbers_of(q)));
    const Eigen::Vector3d torque = J.transpose().inverse() * at_angles;
    wrench.torque = {torque[0], torque[1], torque[2]};
  }
}

}  // namespace ricochet
