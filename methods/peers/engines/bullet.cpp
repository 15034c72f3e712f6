// Bullet in double precision: semi-implicit Euler steps, a contact problem of velocities by projected Gauss-Seidel.
//
//   v* = v_k + h M^-1 f,   x_{k+1} = x_k + h v_{k+1}                                                           (1)
//   v_{k+1} = v* + M^-1 sum_i (J_n^i Lambda_n^i + J_t^i Lambda_t^i)                                            (2)
//   0 <= Lambda_n^i  _|_  J_n^i' v_{k+1} + (cfm / h) Lambda_n^i - b^i >= 0                                     (3)
//   b^i = max(0, -eps_r^i J_n^i' v_k) + erp_2 max(0, -d^i) / h - max(0, d^i) / h                               (4)
//   |Lambda_t^i| <= mu^i Lambda_n^i,   J_t^i' v_{k+1} = 0 where it is less                                     (5)
//
// d is the distance of the shapes that Bullet has found, plus linear_slop; contacts are those with d below
// contact_breaking_threshold. So a contact may come before its bodies touch: the last term of (4) lets them approach by
// d in the step. There is no restitution where J_n' v_k is slower than restitution_velocity_threshold. With
// split_impulse the second term of (4), erp2's, is left out where d is below split_impulse_penetration_threshold, and a
// problem of pseudo-velocities like (3) has it instead, which moves x_{k+1} and is forgotten.
//
// Each iteration goes through the rows once, friction after the normal ones, with the bounds of (5) by the Lambda_n of
// that moment,
//
//   Lambda <- max(lower, min(upper, Lambda + (b - J' v - (cfm / h) Lambda) / (J' M^-1 J + cfm / h)))           (6)
//
// and there are as many as the setting iterations says, or fewer where the residual is small. As it comes friction has
// one direction, that of slip; with two_friction_directions it has two, each with bounds of its own: a box, no disc.
//
// Planar scenes are in its x-y plane, by factors on the bodies. It makes contacts itself.
//
// Source: E. Coumans, Bullet 2.83 Physics SDK Manual; E. Catto, Iterative dynamics with temporal coherence, GDC 2005.
// (3) to (6) are as its class btSequentialImpulseConstraintSolver has them.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "bench/plugin/plugin.h"
#include "methods/peers/engines/bullet_settings.h"
#include "methods/peers/engines/engine_method.h"

namespace ricochet {
namespace {

btVector3 bullet(const Vector3<double>& x) {
  return {x[0], x[1], x[2]};
}
btMatrix3x3 bullet(const Matrix3<double>& R) {
  return {R[0][0], R[0][1], R[0][2], R[1][0], R[1][1], R[1][2], R[2][0], R[2][1], R[2][2]};
}
btTransform bullet(const Pose& pose) {
  return btTransform(bullet(pose.R), bullet(pose.centre));
}
Vector3<double> ours(const btVector3& x) {
  return {x.x(), x.y(), x.z()};
}

class BulletWorld;
const BulletWorld* the_world = nullptr;  // for callbacks of Bullet that carry no pointer

class BulletWorld final : public EngineWorld {
 public:
  BulletWorld(const EngineScene& scene, const EngineSettings& settings, std::span<const BodyState> states, double h)
      : scene_(scene), settings_(settings), h_(h), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    the_world = this;
    gContactBreakingThreshold = settings["contact_breaking_threshold"];
    gDisableDeactivation = !settings.on("deactivation");
    gCalculateCombinedRestitutionCallback = [](const btCollisionObject* a, const btCollisionObject* b) -> btScalar {
      return the_world->pair_of(a, b).eps_r;
    };
    gCalculateCombinedFrictionCallback = [](const btCollisionObject* a, const btCollisionObject* b) -> btScalar {
      return the_world->pair_of(a, b).mu;
    };
    set_solver();
    list_pairs();  // others pass through each other
    world_.getPairCache()->setOverlapFilterCallback(&filter_);
    world_.setGravity(scene.has_only_weight() ? bullet(scene.geometry().gravity) : btVector3(0, 0, 0));
    for (int i = 0; i < scene.n_bodies(); ++i) add_body(i, states[static_cast<std::size_t>(i)]);
    for (const int i : scene.touching_shapes_of(-1)) add_ground(i);
    states_.resize(states.size());
    wrenches_.resize(states.size());
    q_ = scene.problem().info().q0;
    v_ = scene.problem().info().v0;
  }
  ~BulletWorld() override {
    for (auto& object : bodies_) world_.removeRigidBody(object.get());
    the_world = nullptr;
  }
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  void step() override {
    if (!scene_.has_only_weight()) {
      read(states_);
      scene_.coordinates_of(states_, 0, q_, v_);
      scene_.wrenches(q_, v_, wrenches_);
      for (std::size_t i = 0; i < wrenches_.size(); ++i) {
        bodies_[i]->applyCentralForce(bullet(wrenches_[i].force));
        bodies_[i]->applyTorque(bullet(wrenches_[i].torque));
      }
    }
    world_.stepSimulation(h_, 0, h_);  // 0: exactly one step of h
  }

  void read(std::span<BodyState> states) const override {
    for (std::size_t i = 0; i < states.size(); ++i) {
      const btRigidBody& body = *bodies_[i];
      const btMatrix3x3& R = body.getWorldTransform().getBasis();
      states[i] = {{ours(body.getCenterOfMassPosition()), {ours(R[0]), ours(R[1]), ours(R[2])}},
                   ours(body.getLinearVelocity()),
                   ours(body.getAngularVelocity())};
    }
  }

  std::vector<double> gaps() override {
    world_.performDiscreteCollisionDetection();
    std::vector<double> gaps(scene_.pairs().size(), kNoGap);
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(m);
      for (int k = 0; k < manifold.getNumContacts(); ++k) {
        const auto pair =
            static_cast<std::size_t>(&pair_of(manifold.getBody0(), manifold.getBody1()) - scene_.pairs().data());
        const double distance = manifold.getContactPoint(k).getDistance();
        if (!(gaps[pair] <= distance)) gaps[pair] = distance;
      }
    }
    return gaps;
  }

  /// The first pair of the shapes of two bodies: engines get scenes where all pairs of two bodies are alike.
  const EnginePair& pair_of(const btCollisionObject* a, const btCollisionObject* b) const {
    return *pairs_[index_of(a->getUserIndex(), b->getUserIndex())];
  }

 private:
  struct Filter final : btOverlapFilterCallback {
    explicit Filter(const BulletWorld& of) : world(of) {}
    const BulletWorld& world;
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
      const auto index = [](const btBroadphaseProxy* proxy) {
        return static_cast<const btCollisionObject*>(proxy->m_clientObject)->getUserIndex();
      };
      return world.pairs_[world.index_of(index(a), index(b))] != nullptr;
    }
  };

  std::size_t index_of(int a, int b) const {
    const std::size_t n_objects = scene_.geometry().bodies.size() + scene_.geometry().shapes.size();
    return static_cast<std::size_t>(a) * n_objects + static_cast<std::size_t>(b);
  }
  void list_pairs() {
    const int n_objects = scene_.n_bodies() + static_cast<int>(scene_.geometry().shapes.size());
    pairs_.assign(index_of(n_objects, 0), nullptr);
    for (const EnginePair& pair : scene_.pairs()) {
      const int a = object_of_shape(pair.first), b = object_of_shape(pair.second);
      pairs_[index_of(a, b)] = pairs_[index_of(b, a)] = &pair;
    }
  }
  /// Bodies come first, then shapes of the world.
  int object_of_shape(int shape) const {
    const int body = scene_.shape(shape).body;
    return body >= 0 ? body : scene_.n_bodies() + shape;
  }

  void set_solver() {
    btContactSolverInfo& info = world_.getSolverInfo();
    info.m_erp = settings_["erp"];
    info.m_erp2 = settings_["erp2"];
    info.m_frictionERP = settings_["friction_erp"];
    info.m_splitImpulse = settings_.on("split_impulse");
    info.m_splitImpulsePenetrationThreshold = settings_["split_impulse_penetration_threshold"];
    info.m_restitutionVelocityThreshold = settings_["restitution_velocity_threshold"];
    info.m_numIterations = static_cast<int>(settings_["iterations"]);
    info.m_leastSquaresResidualThreshold = settings_["least_squares_residual_threshold"];
    info.m_globalCfm = settings_["global_cfm"];
    info.m_linearSlop = settings_["linear_slop"];
    if (settings_.on("two_friction_directions")) info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  }

  std::unique_ptr<btCollisionShape> collision_shape(const BodyShape& shape) {
    const auto& size = shape.size;
    const double margin = settings_["shape_margin"];
    std::unique_ptr<btCollisionShape> made;
    switch (shape.kind) {
      case ShapeKind::sphere:
        return std::make_unique<btSphereShape>(size[0]);  // whose margin is its radius
      case ShapeKind::capsule:
        return std::make_unique<btCapsuleShapeX>(size[0], 2 * size[1]);
      case ShapeKind::box:
        made = std::make_unique<btBoxShape>(
            btVector3(size[0], size[1], scene_.geometry().in_space ? size[2] : std::max(size[0], size[1])));
        break;
      case ShapeKind::polygon:  // declined
      case ShapeKind::half_space:
        made = std::make_unique<btStaticPlaneShape>(
            scene_.geometry().in_space ? btVector3(0, 0, 1) : btVector3(0, 1, 0), 0);
        break;
    }
    made->setMargin(margin);
    return made;
  }

  btCollisionShape* keep(std::unique_ptr<btCollisionShape> shape) {
    shapes_.push_back(std::move(shape));
    return shapes_.back().get();
  }

  /// One body's shapes as one.
  btCollisionShape* shape_of(int body) {
    const std::vector<int> touching = scene_.touching_shapes_of(body);
    if (touching.empty()) return keep(std::make_unique<btEmptyShape>());
    const auto is_alone_at_the_centre = [&] {
      const BodyShape& shape = scene_.shape(touching.front());
      const std::array<double, 3> none{};
      return touching.size() == 1 && shape.position == none && shape.angles == none;
    };
    if (is_alone_at_the_centre()) return keep(collision_shape(scene_.shape(touching.front())));
    auto compound = std::make_unique<btCompoundShape>();
    for (const int i : touching)
      compound->addChildShape(bullet(pose_on_body(scene_.shape(i))), keep(collision_shape(scene_.shape(i))));
    return keep(std::move(compound));
  }

  void add(btScalar mass, btCollisionShape* shape, const btVector3& inertia, const btTransform& pose, int index) {
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
    info.m_startWorldTransform = pose;
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    bodies_.back()->setUserIndex(index);
  }

  void add_ground(int shape) {
    add(0, keep(collision_shape(scene_.shape(shape))), {0, 0, 0}, bullet(pose_on_body(scene_.shape(shape))),
        scene_.n_bodies() + shape);
    world_.addRigidBody(bodies_.back().get());
  }

  void add_body(int i, const BodyState& state) {
    const Body& body = scene_.body(i);
    const double about_z = body.inertia[2];
    const btVector3 inertia = !scene_.turns(i)           ? btVector3(body.mass, body.mass, body.mass)
                              : scene_.turns_in_space(i) ? bullet(body.inertia)
                                                         : btVector3(about_z, about_z, about_z);
    add(body.mass, shape_of(i), inertia, bullet(state.pose), i);
    btRigidBody& made = *bodies_.back();
    made.setLinearVelocity(bullet(state.velocity));
    made.setAngularVelocity(bullet(state.omega));
    made.setLinearFactor({scene_.moves_along(i, 0) ? 1.0 : 0.0, scene_.moves_along(i, 1) ? 1.0 : 0.0,
                          scene_.moves_along(i, 2) ? 1.0 : 0.0});
    const double in_space = scene_.turns_in_space(i) ? 1 : 0;
    made.setAngularFactor({in_space, in_space, scene_.turns(i) ? 1.0 : 0.0});
    world_.addRigidBody(&made);
  }

  const EngineScene& scene_;
  const EngineSettings& settings_;
  double h_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  Filter filter_{*this};
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<const EnginePair*> pairs_;  // of two objects, null where they are none
  std::vector<BodyState> states_;
  std::vector<Wrench> wrenches_;
  Vector q_, v_;
};

}  // namespace
}  // namespace ricochet

RICOCHET_PLUGIN() {
  using namespace ricochet;
  register_engine({.name = "bullet",
                   .library = "Bullet 3.24, double precision",
                   .source = "E. Coumans, Bullet Physics SDK Manual",
                   .known_settings = kBulletSettings,
                   .make = [](const EngineScene& scene, const EngineSettings& settings,
                              std::span<const BodyState> states, double h) -> std::unique_ptr<EngineWorld> {
                     return std::make_unique<BulletWorld>(scene, settings, states, h);
                   }});
}
