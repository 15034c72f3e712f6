// The Open Dynamics Engine in double precision: semi-implicit Euler steps, a soft contact problem of forces in each.
//
//   v_{k+1} = v_k + h M^-1 (f + sum_i (J_n^i lambda_n^i + J_t^i lambda_t^i)),   x_{k+1} = x_k + h v_{k+1}      (1)
//   0 <= lambda_n^i  _|_  J_n^i' v_{k+1} + cfm lambda_n^i - c^i >= 0                                           (2)
//   c^i = max(erp d^i / h, -eps_r^i J_n^i' v_k)                                                                (3)
//   |lambda_t^i| <= mu^i lambda_n^i,   J_t^i' v_{k+1} + cfm lambda_t^i = 0 where it is less                    (4)
//
// for points that are d >= 0 deep. The second entry of (3) counts where the approach is faster than bounce_velocity,
// and the first one where d is more than contact_surface_layer. (4) holds in each of two directions by itself, a
// pyramid (dContactApprox1): without that ODE's mu is a force. With K = J' M^-1 J of all rows, (1) to (4) are the
// problem
//
//   (K + cfm / h) lambda = c / h - J' (v_k / h + M^-1 f) + slack                                               (5)
//
// in which a row's slack vanishes between its bounds. dWorldStep solves it by Dantzig's algorithm, dWorldQuickStep by
// projected Gauss-Seidel with a fixed number of iterations.
//
// It gets each touching point by hand, as its guide recommends for shapes that its collision library has not. Rotations
// that are no coordinates get an inertia that nothing turns.
//
// Source: R. Smith, Open Dynamics Engine User Guide, sections on ERP, CFM and contact joints; D. Baraff, Fast contact
// force computation for nonpenetrating rigid bodies, SIGGRAPH 1994.

#include <ode/ode.h>

#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/plugin/plugin.h"
#include "methods/peers/engines/engine_method.h"
#include "methods/peers/engines/ode_settings.h"

namespace ricochet {
namespace {

/// Messages of ODE, which are recorded instead of printed.
struct Messages {
  int n = 0;
  std::string first;
};
Messages messages;

void note(int, const char* format, va_list arguments) {
  if (messages.n++ > 0) return;
  char text[200];
  std::vsnprintf(text, sizeof text, format, arguments);
  messages.first = text;
}

class OdeWorld final : public EngineWorld {
 public:
  OdeWorld(const EngineScene& scene, const EngineSettings& settings, std::span<const BodyState> states, double h)
      : scene_(scene), settings_(settings), h_(h) {
    dInitODE2(0);
    messages = {};
    dSetMessageHandler(note);
    dSetDebugHandler(note);
    world_ = dWorldCreate();
    joints_ = dJointGroupCreate(0);
    dWorldSetERP(world_, settings["erp"]);
    dWorldSetCFM(world_, settings["cfm"]);
    dWorldSetAutoDisableFlag(world_, settings.on("auto_disable"));
    dWorldSetContactSurfaceLayer(world_, settings["contact_surface_layer"]);
    dWorldSetQuickStepNumIterations(world_, static_cast<int>(settings["quick_step_iterations"]));
    if (scene.has_only_weight()) {
      const auto& g = scene.geometry().gravity;
      dWorldSetGravity(world_, g[0], g[1], g[2]);
    }
    for (int i = 0; i < scene.n_bodies(); ++i) add_body(i, states[static_cast<std::size_t>(i)]);
    for (const ShapePair& pair : scene.geometry().pairs) {
      points_.push_back({&pair, scene.shape(pair.first).body, scene.shape(pair.second).body,
                         pose_on_body(scene.shape(pair.first)), pose_on_body(scene.shape(pair.second)),
                         surface_of(*scene.pair_of(pair.first, pair.second))});
    }
    states_.resize(states.size());
    wrenches_.resize(states.size());
    q_ = scene.problem().info().q0;
    v_ = scene.problem().info().v0;
  }
  ~OdeWorld() override {
    dJointGroupDestroy(joints_);
    dWorldDestroy(world_);
    dCloseODE();
  }
  OdeWorld(const OdeWorld&) = delete;
  OdeWorld& operator=(const OdeWorld&) = delete;

  void step() override {
    read(states_);
    if (!scene_.has_only_weight()) push();
    for (const Point& point : points_) touch(point);
    const int done = settings_.on("quick_step") ? dWorldQuickStep(world_, h_) : dWorldStep(world_, h_);
    if (!done) out_of_memory_ = true;
    dJointGroupEmpty(joints_);
  }

  void read(std::span<BodyState> states) const override {
    for (std::size_t i = 0; i < states.size(); ++i) {
      const dReal *x = dBodyGetPosition(bodies_[i]), *R = dBodyGetRotation(bodies_[i]),
                  *v = dBodyGetLinearVel(bodies_[i]), *omega = dBodyGetAngularVel(bodies_[i]);
      states[i] = {
          {{x[0], x[1], x[2]}, {{{R[0], R[1], R[2]}, {R[4], R[5], R[6]}, {R[8], R[9], R[10]}}}},  // rows of four
          {v[0], v[1], v[2]},
          {omega[0], omega[1], omega[2]}};
    }
  }

  std::string complaint() const override {
    if (out_of_memory_) return "ODE had no memory for a step";
    return messages.n == 0 ? "" : fmt::format("ODE said {} times: {}", messages.n, messages.first);
  }

  std::vector<double> gaps() override {
    read(states_);
    std::vector<double> gaps(scene_.pairs().size(), HUGE_VAL);
    for (const Point& point : points_) {
      const EnginePair* const pair = scene_.pair_of(point.pair->first, point.pair->second);
      double& least = gaps[static_cast<std::size_t>(pair - scene_.pairs().data())];
      least = std::min(least, touch_of(point).gap);
    }
    return gaps;
  }

 private:
  /// A point at which two bodies may touch.
  struct Point {
    const ShapePair* pair;
    int first, second;  // bodies, -1 for the world
    Pose first_shape, second_shape;
    dSurfaceParameters surface;
  };

  dSurfaceParameters surface_of(const EnginePair& pair) const {
    dSurfaceParameters surface{};
    surface.mode =
        dContactBounce | dContactSoftERP | dContactSoftCFM;  // without them a bounce has parameters of its own
    surface.bounce = pair.eps_r;
    surface.bounce_vel = settings_["bounce_velocity"];
    surface.soft_erp = settings_["erp"];
    surface.soft_cfm = settings_["cfm"];
    surface.mu = pair.mu;
    if (pair.mu > 0) surface.mode |= dContactApprox1 | dContactFDir1;             // else mu is a force [N]
    if (pair.mu > 0 && !scene_.geometry().in_space) surface.mode |= dContactMu2;  // and mu2 is zero
    return surface;
  }

  Pose pose_of(int body) const { return body < 0 ? Pose{} : states_[static_cast<std::size_t>(body)].pose; }
  dBodyID handle(int body) const { return body < 0 ? nullptr : bodies_[static_cast<std::size_t>(body)]; }

  Touch<double> touch_of(const Point& point) const {
    return ricochet::touch_of<double>(scene_.geometry(), *point.pair, pose_of(point.first).carries(point.first_shape),
                                      pose_of(point.second).carries(point.second_shape));
  }

  void touch(const Point& point) {
    const Touch<double> touch = touch_of(point);
    if (touch.gap > 0) return;
    dContact contact{};
    contact.surface = point.surface;
    contact.geom.depth = -touch.gap;
    for (std::size_t k = 0; k < 3; ++k) {
      contact.geom.pos[k] = touch.point[k];
      contact.geom.normal[k] = touch.normal[k];  // into the joint's first body, which is the pair's second
      contact.fdir1[k] = touch.tangents[0][k];
    }
    dJointAttach(dJointCreateContact(world_, joints_, &contact), handle(point.second), handle(point.first));
  }

  void push() {
    scene_.coordinates_of(states_, 0, q_, v_);
    scene_.wrenches(q_, v_, wrenches_);
    for (std::size_t i = 0; i < wrenches_.size(); ++i) {
      const auto &force = wrenches_[i].force, &torque = wrenches_[i].torque;
      dBodyAddForce(bodies_[i], force[0], force[1], force[2]);
      dBodyAddTorque(bodies_[i], torque[0], torque[1], torque[2]);
    }
  }

  void add_body(int i, const BodyState& state) {
    constexpr double kUnmoved = 1e12;  // times the mass [m^2]: an angular velocity of rounding's size
    const Body& body = scene_.body(i);
    const double held = kUnmoved * body.mass;
    const dBodyID made = dBodyCreate(world_);
    dMass mass;
    dMassSetZero(&mass);
    if (scene_.turns_in_space(i))
      dMassSetParameters(&mass, body.mass, 0, 0, 0, body.inertia[0], body.inertia[1], body.inertia[2], 0, 0, 0);
    else
      dMassSetParameters(&mass, body.mass, 0, 0, 0, held, held, scene_.turns(i) ? body.inertia[2] : held, 0, 0, 0);
    dBodySetMass(made, &mass);
    const auto& [x, R] = state.pose;
    const dMatrix3 rotation = {R[0][0], R[0][1], R[0][2], 0,       R[1][0], R[1][1],
                               R[1][2], 0,       R[2][0], R[2][1], R[2][2], 0};
    dBodySetPosition(made, x[0], x[1], x[2]);
    dBodySetRotation(made, rotation);
    dBodySetLinearVel(made, state.velocity[0], state.velocity[1], state.velocity[2]);
    dBodySetAngularVel(made, state.omega[0], state.omega[1], state.omega[2]);
    dBodySetGyroscopicMode(made, scene_.turns_in_space(i) && settings_.on("gyroscopic"));
    dBodySetFiniteRotationMode(made, settings_.on("finite_rotation"));
    bodies_.push_back(made);
  }

  const EngineScene& scene_;
  const EngineSettings& settings_;
  double h_;
  dWorldID world_;
  dJointGroupID joints_;
  std::vector<dBodyID> bodies_;
  std::vector<Point> points_;
  bool out_of_memory_ = false;
  mutable std::vector<BodyState> states_;
  std::vector<Wrench> wrenches_;
  Vector q_, v_;
};

}  // namespace
}  // namespace ricochet

RICOCHET_PLUGIN() {
  using namespace ricochet;
  register_engine({.name = "ode",
                   .library = "Open Dynamics Engine 0.16, double precision",
                   .source = "R. Smith, Open Dynamics Engine User Guide",
                   .known_settings = kOdeSettings,
                   .make = [](const EngineScene& scene, const EngineSettings& settings,
                              std::span<const BodyState> states, double h) -> std::unique_ptr<EngineWorld> {
                     return std::make_unique<OdeWorld>(scene, settings, states, h);
                   }});
}
