// Box2D, in the plane and in single precision: semi-implicit Euler steps, contacts by sequential impulses, then
// positions.
//
//   v* = v_k + h M^-1 f                                                                                        (1)
//   Lambda_t^i <- max(-mu^i Lambda_n^i, min(mu^i Lambda_n^i, Lambda_t^i - J_t^i' v / (J_t^i' M^-1 J_t^i)))     (2)
//   Lambda_n^i <- max(0, Lambda_n^i - (J_n^i' v - b^i) / (J_n^i' M^-1 J_n^i)),   b^i = -eps_r^i J_n^i' v*      (3)
//   x* = x_k + h v_{k+1}                                                                                       (4)
//   x <- x + M^-1 J_n^i P^i,   P^i = -max(-0.2, min(0, 0.2 (d^i + s))) / (J_n^i' M^-1 J_n^i)                   (5)
//
// (2), then (3) for every contact is one of velocity_iterations; v starts as v* and has every change of an impulse at
// once, and Lambda starts as that of the step before. The two points of an edge are solved together. b = 0 in (3) where
// the approach is slower than restitution_threshold. (5) for every contact is one of position_iterations, from x = x*
// on, with the distance d of the shapes at x and s = 0.005 m (b2_linearSlop), so that what is no deeper than s stays;
// 0.2 are b2_baumgarte and b2_maxLinearCorrection [m]. Velocities do not notice it. Friction acts at what (3) of the
// last iteration has left.
//
// With continuous_physics a body that would pass a surface is stopped there, and the rest of its step is lost. Boxes
// and planes have a skin of b2_polygonRadius outside their edges.
//
// Source: E. Catto, Iterative dynamics with temporal coherence, GDC 2005; constants are those of its header
// b2_common.h.

#include <box2d/box2d.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/plugin/plugin.h"
#include "methods/peers/engines/box2d_settings.h"
#include "methods/peers/engines/engine_method.h"

namespace ricochet {
namespace {

b2Vec2 box2d(const Vector3<double>& x) {
  return {static_cast<float>(x[0]), static_cast<float>(x[1])};
}

class Box2dWorld final : public EngineWorld, b2ContactListener, b2ContactFilter {
 public:
  Box2dWorld(const EngineScene& scene, const EngineSettings& settings, std::span<const BodyState> states, double h)
      : scene_(scene),
        settings_(settings),
        h_(static_cast<float>(h)),
        world_(scene.has_only_weight() ? box2d(scene.geometry().gravity) : b2Vec2(0, 0)) {
    world_.SetAllowSleeping(settings.on("sleeping"));
    world_.SetContinuousPhysics(settings.on("continuous_physics"));
    world_.SetContactListener(this);
    world_.SetContactFilter(this);
    b2BodyDef fixed;
    b2Body* const ground = world_.CreateBody(&fixed);
    for (const int i : scene.touching_shapes_of(-1)) add_fixture(*ground, i);
    for (int i = 0; i < scene.n_bodies(); ++i) add_body(i, states[static_cast<std::size_t>(i)]);
    states_.resize(states.size());
    wrenches_.resize(states.size());
    q_ = scene.problem().info().q0;
    v_ = scene.problem().info().v0;
  }

  void step() override {
    if (!scene_.has_only_weight()) {
      read(states_);
      scene_.coordinates_of(states_, 0, q_, v_);
      scene_.wrenches(q_, v_, wrenches_);
      for (std::size_t i = 0; i < bodies_.size(); ++i) {
        bodies_[i]->ApplyForceToCenter(box2d(wrenches_[i].force), true);
        bodies_[i]->ApplyTorque(static_cast<float>(wrenches_[i].torque[2]), true);
      }
    }
    world_.Step(h_, static_cast<int>(settings_["velocity_iterations"]),
                static_cast<int>(settings_["position_iterations"]));
    for (const b2Body* const body : bodies_) {
      // Faster bodies are slowed down without a word.
      if (body->GetLinearVelocity().Length() * h_ >= 0.999f * b2_maxTranslation ||
          std::abs(body->GetAngularVelocity()) * h_ >= 0.999f * b2_maxRotation)
        ++cut_off_;
    }
  }

  void read(std::span<BodyState> states) const override {
    for (std::size_t i = 0; i < states.size(); ++i) {
      const b2Vec2 x = bodies_[i]->GetPosition(), v = bodies_[i]->GetLinearVelocity();
      states[i] = {{{x.x, x.y, 0}, geometry_detail::about(2, static_cast<double>(bodies_[i]->GetAngle()))},
                   {v.x, v.y, 0},
                   {0, 0, bodies_[i]->GetAngularVelocity()}};
    }
  }

  std::string complaint() const override {
    return cut_off_ == 0
               ? ""
               : fmt::format("Box2D slowed {} bodies down, which moved by more than 2 m or a quarter turn in a step",
                             cut_off_);
  }

  std::vector<double> gaps() override {
    world_.Step(0, 0, 0);  // finds contacts only
    std::vector<double> gaps(scene_.pairs().size(), kNoGap);
    for (const b2Contact* contact = world_.GetContactList(); contact; contact = contact->GetNext()) {
      const EnginePair* const pair = pair_of(*contact->GetFixtureA(), *contact->GetFixtureB());
      double& least = gaps[static_cast<std::size_t>(pair - scene_.pairs().data())];
      b2WorldManifold manifold;
      contact->GetWorldManifold(&manifold);
      for (int k = 0; k < contact->GetManifold()->pointCount; ++k) {
        if (!(least <= manifold.separations[k])) least = manifold.separations[k];
      }
    }
    return gaps;
  }

 private:
  const EnginePair* pair_of(const b2Fixture& a, const b2Fixture& b) const {
    const auto shape_of = [](const b2Fixture& fixture) {
      return static_cast<int>(const_cast<b2Fixture&>(fixture).GetUserData().pointer);
    };
    return scene_.pair_of(shape_of(a), shape_of(b));
  }
  bool ShouldCollide(b2Fixture* a, b2Fixture* b) override { return pair_of(*a, *b) != nullptr; }
  void PreSolve(b2Contact* contact, const b2Manifold*) override {
    const EnginePair* const pair = pair_of(*contact->GetFixtureA(), *contact->GetFixtureB());
    contact->SetFriction(static_cast<float>(pair->mu));
    contact->SetRestitution(static_cast<float>(pair->eps_r));
    contact->SetRestitutionThreshold(static_cast<float>(settings_["restitution_threshold"]));
  }

  void add_fixture(b2Body& body, int i) {
    const BodyShape& shape = scene_.shape(i);
    const Pose pose = pose_on_body(shape);
    const double skin = settings_.on("shrunk_by_skin") ? b2_polygonRadius : 0;
    b2CircleShape circle;
    b2PolygonShape box;
    b2EdgeShape edge;
    b2FixtureDef fixture;
    fixture.userData.pointer = static_cast<uintptr_t>(i);
    if (shape.kind == ShapeKind::sphere) {
      circle.m_radius = static_cast<float>(shape.size[0]);
      circle.m_p = box2d(pose.centre);
      fixture.shape = &circle;
    } else if (shape.kind == ShapeKind::box) {
      if (std::min(shape.size[0], shape.size[1]) <= skin)
        throw std::runtime_error(fmt::format("Box2D: a box of half edge {} m is thinner than its skin of {} m",
                                             std::min(shape.size[0], shape.size[1]), skin));
      box.SetAsBox(static_cast<float>(shape.size[0] - skin), static_cast<float>(shape.size[1] - skin),
                   box2d(pose.centre), static_cast<float>(std::atan2(pose.R[1][0], pose.R[0][0])));
      fixture.shape = &box;
    } else {
      constexpr double kLong = 100;  // [m]; single precision has 1e-5 m there
      edge.SetTwoSided(box2d(pose.point({-kLong, -skin, 0})), box2d(pose.point({kLong, -skin, 0})));
      fixture.shape = &edge;
    }
    body.CreateFixture(&fixture);
  }

  void add_body(int i, const BodyState& state) {
    const Body& body = scene_.body(i);
    b2BodyDef definition;
    definition.type = b2_dynamicBody;
    definition.position = box2d(state.pose.centre);
    definition.angle = static_cast<float>(std::atan2(state.pose.R[1][0], state.pose.R[0][0]));
    definition.linearVelocity = box2d(state.velocity);
    definition.angularVelocity = static_cast<float>(state.omega[2]);
    definition.fixedRotation = !scene_.turns(i);
    b2Body* const made = world_.CreateBody(&definition);
    for (const int shape : scene_.touching_shapes_of(i)) add_fixture(*made, shape);
    const b2MassData mass{static_cast<float>(body.mass), b2Vec2(0, 0), static_cast<float>(body.inertia[2])};
    made->SetMassData(&mass);
    bodies_.push_back(made);
  }

  const EngineScene& scene_;
  const EngineSettings& settings_;
  float h_;
  b2World world_;
  std::vector<b2Body*> bodies_;
  int cut_off_ = 0;
  std::vector<BodyState> states_;
  std::vector<Wrench> wrenches_;
  Vector q_, v_;
};

Support is_in_the_plane(const ProblemInfo& info) {
  if (info.geometry->in_space) return Support::no("Box2D is two-dimensional");
  for (const BodyShape& shape : info.geometry->shapes) {
    if (shape.kind == ShapeKind::capsule) return Support::no("Box2D has no capsules");
  }
  return Support::yes();
}

}  // namespace
}  // namespace ricochet

RICOCHET_PLUGIN() {
  using namespace ricochet;
  register_engine({.name = "box2d",
                   .library = "Box2D 2.4.1, single precision",
                   .source = "E. Catto, Iterative dynamics with temporal coherence, GDC 2005",
                   .known_settings = kBox2dSettings,
                   .make = [](const EngineScene& scene, const EngineSettings& settings,
                              std::span<const BodyState> states, double h) -> std::unique_ptr<EngineWorld> {
                     return std::make_unique<Box2dWorld>(scene, settings, states, h);
                   },
                   .supports = is_in_the_plane});
}
