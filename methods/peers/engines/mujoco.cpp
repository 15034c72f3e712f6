// MuJoCo: soft contacts by a convex problem in each step.
//
// With w = J' a + (J')^. v the accelerations along the rows of all contacts, w_0 those without contact forces, and A =
// J' M^-1 J:
//
//   M a = f + J lambda,   v_{k+1} = v_k + h a,   q_{k+1} = q_k + h v_{k+1}                                     (1)
//   lambda = arg min over K of lambda' (A + R) lambda / 2 + lambda' (w_0 - w_ref)                              (2)
//   w_ref = -b J' v - k r,   R_ii = A_ii (1 - d) / d                                                           (3)
//   b = 2 / (d_max tau),   k = d / (d_max tau zeta)^2                                                          (4)
//
// r is the gap of a normal row and zero for friction; K has lambda_n >= 0 and the friction cone, or a pyramid as it
// comes. solref is (tau, zeta), a time constant and a damping ratio; the impedance d grows with depth between the first
// two numbers of solimp, and d_max is the second. So a row that is pressed and alone has the acceleration
//
//   w = d w_ref + (1 - d) w_0                                                                                  (5)
//
// For d near 1 a contact is a spring and a damper whatever the masses, for less it gives way. R of friction is that of
// its normal row over impratio, and friction has no spring: it creeps. (1) is the semi-implicit integrator; RK4
// evaluates (2) at each stage. refsafe keeps tau above 2 h.
//
// It has no coefficient of restitution. A contact by (5) with d = 1 is x'' = -b x' - k x, and lets go where the force
// would pull. With b = 2 zeta sqrt(k) and s = sqrt(|1 - zeta^2|) a body leaves it with
//
//   e = exp(-(2 zeta / s) atan(s / zeta)),   zeta < 1                                                          (6)
//   e = exp(-(2 zeta / s) artanh(s / zeta)),   zeta > 1                                                        (7)
//
// times its velocity of approach, whatever k; the contact takes the time pi / sqrt(k) at zeta = 0.
//
// A friction element with a constant bound F along a coordinate x is a row w = x'' with
//
//   |lambda| <= F,   k = 0 in (3)                                                                              (8)
//
// ("frictionloss"). Under a load it creeps, as friction of contacts does.
//
// Source: E. Todorov, Convex and analytically-invertible dynamics with contacts and constraints, ICRA 2014; MuJoCo
// documentation, Computation.

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "bench/plugin/plugin.h"
#include "methods/peers/engines/engine_method.h"
#include "methods/peers/engines/mujoco_settings.h"

namespace ricochet {
namespace {

/// e of (6) and (7).
double restitution_of(double zeta) {
  const double s = std::sqrt(std::abs(1 - zeta * zeta));
  if (zeta == 0) return 1;
  if (s < 1e-9) return std::exp(-2.0);
  return std::exp(-2 * zeta / s * (zeta < 1 ? std::atan(s / zeta) : std::atanh(s / zeta)));
}

/// zeta of a restitution 0 < e <= 1, by bisection of log(1 + zeta).
double damping_ratio_of(double e) {
  double low = 0, high = 40;
  for (int k = 0; k < 200; ++k) {
    const double middle = (low + high) / 2;
    (restitution_of(std::expm1(middle)) > e ? low : high) = middle;
  }
  return std::expm1((low + high) / 2);
}

/// Warnings of MuJoCo, which are not printed.
struct Messages {
  int n = 0;
  std::string first;
};
Messages messages;

void note(const char* text) {
  if (messages.n++ == 0) messages.first = text;
}

/// Replaces MuJoCo's error handler, which writes a line to a file in the working directory and ends the process.
[[noreturn]] void give_up(const char* text) {
  throw std::runtime_error(fmt::format("MuJoCo gave up: {}", text));
}

class MujocoWorld;
const MujocoWorld* the_world = nullptr;  // for a callback that carries no pointer

class MujocoWorld final : public EngineWorld {
 public:
  MujocoWorld(const EngineScene& scene, const EngineSettings& settings, std::span<const BodyState> states, double h)
      : scene_(scene), settings_(settings), h_(h) {
    messages = {};
    mju_user_warning = note;
    mju_user_error = give_up;
    const std::string text = model_text();
    mjVFS files;
    mj_defaultVFS(&files);
    mj_makeEmptyFileVFS(&files, "scene.xml", static_cast<int>(text.size()) + 1);
    std::memcpy(files.filedata[mj_findFileVFS(&files, "scene.xml")], text.c_str(), text.size() + 1);
    char error[1000] = "";
    model_ = mj_loadXML("scene.xml", &files, error, sizeof error);
    mj_deleteVFS(&files);
    if (!model_) throw std::runtime_error(fmt::format("MuJoCo refuses the scene: {}", error));
    if (!settings.on("refsafe")) model_->opt.disableflags |= mjDSBL_REFSAFE;
    data_ = mj_makeData(model_);
    for (int i = 0; i < scene.n_bodies(); ++i) start(i, states[static_cast<std::size_t>(i)]);
    states_.resize(states.size());
    wrenches_.resize(states.size());
    q_ = scene.problem().info().q0;
    v_ = scene.problem().info().v0;
    the_world = this;
    mjcb_passive = nullptr;
    if (!scene.has_only_weight()) {
      mjcb_passive = [](const mjModel*, mjData* data) { the_world->push(data); };
    }
  }
  ~MujocoWorld() override {
    mjcb_passive = nullptr;
    the_world = nullptr;
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  MujocoWorld(const MujocoWorld&) = delete;
  MujocoWorld& operator=(const MujocoWorld&) = delete;

  void step() override { mj_step(model_, data_); }
  void read(std::span<BodyState> states) const override { read_from(data_, states); }

  std::string complaint() const override {
    std::string text = messages.n == 0 ? "" : fmt::format("MuJoCo said {} times: {}", messages.n, messages.first);
    for (int k = 0; k < mjNWARNING; ++k) {
      const mjWarningStat& warning = data_->warning[k];
      if (warning.number > 0)
        text += fmt::format("{}MuJoCo warned {} times: {}", text.empty() ? "" : "; ", warning.number,
                            mju_warningText(k, static_cast<std::size_t>(warning.lastinfo)));
    }
    return text;
  }

  std::vector<double> gaps() override {
    // Distances of shapes that do not overlap are found within a margin.
    for (int k = 0; k < model_->npair; ++k) model_->pair_margin[k] = 1;
    mj_forward(model_, data_);
    std::vector<double> gaps(scene_.pairs().size(), kNoGap);
    for (int k = 0; k < data_->ncon; ++k) {
      const mjContact& contact = data_->contact[k];
      const auto* const pair = scene_.pair_of(shape_of_geom_[static_cast<std::size_t>(contact.geom1)],
                                              shape_of_geom_[static_cast<std::size_t>(contact.geom2)]);
      double& least = gaps[static_cast<std::size_t>(pair - scene_.pairs().data())];
      if (!(least <= contact.dist)) least = contact.dist;
    }
    return gaps;
  }

 private:
  static std::string text_of(const Vector3<double>& x) { return fmt::format("{} {} {}", x[0], x[1], x[2]); }
  static Eigen::Quaterniond quaternion_of(const Matrix3<double>& R) {
    Eigen::Matrix3d matrix;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) matrix(i, j) = R[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
    return Eigen::Quaterniond(matrix);
  }

  std::string model_text() {
    static const char* const integrators[] = {"Euler", "RK4", "implicit"};
    const auto& gravity = scene_.geometry().gravity;
    const std::size_t most_contacts = 8 * scene_.pairs().size() + 8;  // else contacts are dropped
    std::string text = fmt::format(
        R"(<mujoco><compiler inertiafromgeom="false" boundinertia="0" autolimits="true"/>
<size nconmax="{}" njmax="{}"/>
<option timestep="{}" gravity="{}" integrator="{}" solver="Newton" iterations="{}" tolerance="{}" cone="{}" impratio="{}" noslip_iterations="{}"/>
<default><geom contype="0" conaffinity="0"/></default><worldbody>
)",
        most_contacts, 6 * most_contacts + static_cast<std::size_t>(scene_.problem().n_q()), h_,
        text_of(scene_.has_only_weight() ? gravity : Vector3<double>{}),
        integrators[static_cast<std::size_t>(settings_["integrator"])], settings_["iterations"], settings_["tolerance"],
        settings_.on("elliptic_cone") ? "elliptic" : "pyramidal", settings_["impratio"],
        settings_["noslip_iterations"]);
    for (const int i : scene_.touching_shapes_of(-1)) text += geom_text(i);
    for (int i = 0; i < scene_.n_bodies(); ++i) text += body_text(i);
    text += "</worldbody><contact>\n";
    for (const EnginePair& pair : scene_.pairs()) text += pair_text(pair);
    return text + "</contact></mujoco>\n";
  }

  /// The shape at its place on the body.
  std::string geom_text(int i) {
    const BodyShape& shape = scene_.shape(i);
    const Pose pose = pose_on_body(shape);
    const Vector3<double> up = column_of(pose.R, scene_.geometry().in_space ? 2 : 1);
    const double depth = scene_.geometry().in_space ? shape.size[2] : std::max(shape.size[0], shape.size[1]);
    shape_of_geom_.push_back(i);
    const Eigen::Quaterniond turn = quaternion_of(pose.R);
    const std::string name = fmt::format(R"(<geom name="s{}" )", i);
    switch (shape.kind) {
      case ShapeKind::sphere:
        return name + fmt::format("type=\"sphere\" size=\"{}\" pos=\"{}\"/>\n", shape.size[0], text_of(pose.centre));
      case ShapeKind::box:
        return name + fmt::format("type=\"box\" size=\"{} {} {}\" pos=\"{}\" quat=\"{} {} {} {}\"/>\n", shape.size[0],
                                  shape.size[1], depth, text_of(pose.centre), turn.w(), turn.x(), turn.y(), turn.z());
      case ShapeKind::capsule:
        return name + fmt::format("type=\"capsule\" size=\"{}\" fromto=\"{} {}\"/>\n", shape.size[0],
                                  text_of(pose.point({-shape.size[1], 0, 0})),
                                  text_of(pose.point({shape.size[1], 0, 0})));
      case ShapeKind::polygon:  // declined
      case ShapeKind::half_space:
        break;
    }
    return name +
           fmt::format("type=\"plane\" size=\"1 1 1\" pos=\"{}\" zaxis=\"{}\"/>\n", text_of(pose.centre), text_of(up));
  }

  std::string body_text(int i) {
    const Body& body = scene_.body(i);
    const double about_z = body.inertia[2];
    const Vector3<double> inertia = !scene_.turns(i)           ? Vector3<double>{body.mass, body.mass, body.mass}
                                    : scene_.turns_in_space(i) ? body.inertia
                                                               : Vector3<double>{about_z, about_z, about_z};
    Vector3<double> held{};
    std::string joints;
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      if (scene_.moves_along(i, axis))
        joints += fmt::format("<joint type=\"slide\" axis=\"{:d} {:d} {:d}\"{}/>", axis == 0, axis == 1, axis == 2,
                              friction_text(body.position[k].coordinate));
      else
        held[k] = body.position[k].offset;
    }
    if (scene_.turns_in_space(i))
      joints += "<joint type=\"ball\"/>";
    else if (scene_.turns(i))
      joints += fmt::format("<joint type=\"hinge\" axis=\"0 0 1\"{}/>", friction_text(body.angles[0].coordinate));
    std::string text = fmt::format("<body pos=\"{}\">{}<inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"{}\"/>\n",
                                   text_of(held), joints, body.mass, text_of(inertia));
    for (const int shape : scene_.touching_shapes_of(i)) text += geom_text(shape);
    return text + "</body>\n";
  }

  /// (8) of a joint.
  std::string friction_text(int coordinate) const {
    const double bound = scene_.joint_friction(coordinate);
    if (bound == 0) return "";
    return fmt::format(R"( frictionloss="{}" solimpfriction="{} {} 0.001 0.5 2")", bound, settings_["impedance_min"],
                       settings_["impedance_max"]);
  }

  std::string pair_text(const EnginePair& pair) const {
    std::string text = fmt::format(R"(<pair geom1="s{}" geom2="s{}" condim="{}" margin="0" gap="0")", pair.first,
                                   pair.second, pair.mu > 0 ? 3 : 1);
    if (pair.mu > 0) text += fmt::format(R"( friction="{0} {0} 0 0 0")", pair.mu);
    if (settings_["contact_steps"] > 0 && pair.eps_r > 0) {  // (1), (2)
      const double sqrt_k = std::acos(-1.0) / (settings_["contact_steps"] * h_);
      text += fmt::format(R"( solref="{} {}")", -sqrt_k * sqrt_k, -2 * damping_ratio_of(pair.eps_r) * sqrt_k);
    } else if (settings_["time_constant_steps"] > 0) {
      text += fmt::format(R"( solref="{} 1")", settings_["time_constant_steps"] * h_);
    }
    text += fmt::format(R"( solimp="{} {} 0.001 0.5 2"/>)", settings_["impedance_min"], settings_["impedance_max"]);
    return text + "\n";
  }

  /// Indices at which the joints of a body begin in qpos and in qvel.
  struct Addresses {
    int position, velocity;
  };
  Addresses addresses_of(int i) const {
    const int joint = model_->body_jntadr[i + 1];  // body 0 is the world
    return joint < 0 ? Addresses{0, 0} : Addresses{model_->jnt_qposadr[joint], model_->jnt_dofadr[joint]};
  }

  void start(int i, const BodyState& state) {
    auto [p, d] = addresses_of(i);
    for (int axis = 0; axis < 3; ++axis) {
      if (!scene_.moves_along(i, axis)) continue;
      data_->qpos[p++] = state.pose.centre[static_cast<std::size_t>(axis)];
      data_->qvel[d++] = state.velocity[static_cast<std::size_t>(axis)];
    }
    if (scene_.turns_in_space(i)) {
      const Eigen::Quaterniond turn = quaternion_of(state.pose.R);
      const double quaternion[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
      const Vector3<double> local = times_transposed(state.pose.R, state.omega);
      std::copy_n(quaternion, 4, data_->qpos + p);
      std::copy_n(local.begin(), 3, data_->qvel + d);
    } else if (scene_.turns(i)) {
      data_->qpos[p] = std::atan2(state.pose.R[1][0], state.pose.R[0][0]);
      data_->qvel[d] = state.omega[2];
    }
  }

  void read_from(const mjData* data, std::span<BodyState> states) const {
    for (int i = 0; i < scene_.n_bodies(); ++i) {
      BodyState& state = states[static_cast<std::size_t>(i)];
      state = {};
      auto [p, d] = addresses_of(i);
      for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        state.pose.centre[k] = scene_.moves_along(i, axis) ? data->qpos[p++] : scene_.body(i).position[k].offset;
        if (scene_.moves_along(i, axis)) state.velocity[k] = data->qvel[d++];
      }
      if (scene_.turns_in_space(i)) {
        mjtNum quaternion[4], R[9];
        std::copy_n(data->qpos + p, 4, quaternion);
        mju_normalize4(quaternion);
        mju_quat2Mat(R, quaternion);
        state.pose.R = {{{R[0], R[1], R[2]}, {R[3], R[4], R[5]}, {R[6], R[7], R[8]}}};
        state.omega = times(state.pose.R, Vector3<double>{data->qvel[d], data->qvel[d + 1], data->qvel[d + 2]});
      } else if (scene_.turns(i)) {
        state.pose.R = geometry_detail::about(2, data->qpos[p]);
        state.omega[2] = data->qvel[d];
      }
    }
  }

  /// The scene's forces, whenever MuJoCo evaluates its own: at each stage of RK4.
  void push(mjData* data) const {
    read_from(data, states_);
    scene_.coordinates_of(states_, 0, q_, v_);
    scene_.wrenches(q_, v_, wrenches_);
    for (int i = 0; i < scene_.n_bodies(); ++i) {
      const Wrench& wrench = wrenches_[static_cast<std::size_t>(i)];
      int d = addresses_of(i).velocity;
      for (int axis = 0; axis < 3; ++axis) {
        if (scene_.moves_along(i, axis)) data->qfrc_passive[d++] += wrench.force[static_cast<std::size_t>(axis)];
      }
      if (scene_.turns_in_space(i)) {
        const auto local = times_transposed(states_[static_cast<std::size_t>(i)].pose.R, wrench.torque);
        for (std::size_t k = 0; k < 3; ++k) data->qfrc_passive[d++] += local[k];
      } else if (scene_.turns(i)) {
        data->qfrc_passive[d] += wrench.torque[2];
      }
    }
  }

  const EngineScene& scene_;
  const EngineSettings& settings_;
  double h_;
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  std::vector<int> shape_of_geom_;  // geoms in the order of the text, which is MuJoCo's
  mutable std::vector<BodyState> states_;
  mutable std::vector<Wrench> wrenches_;
  mutable Vector q_, v_;
};

Support has_sizes(const ProblemInfo& info) {
  for (const BodyShape& shape : info.geometry->shapes) {
    if (shape.kind == ShapeKind::sphere && shape.size[0] <= 0)
      return Support::no("MuJoCo has no sphere of radius zero");
  }
  return Support::yes();
}

}  // namespace
}  // namespace ricochet

RICOCHET_PLUGIN() {
  using namespace ricochet;
  register_engine({.name = "mujoco",
                   .library = "MuJoCo 2.2.2",
                   .source = "E. Todorov, ICRA 2014, 6054-6061",
                   .known_settings = kMujocoSettings,
                   .make = [](const EngineScene& scene, const EngineSettings& settings,
                              std::span<const BodyState> states, double h) -> std::unique_ptr<EngineWorld> {
                     return std::make_unique<MujocoWorld>(scene, settings, states, h);
                   },
                   .has_joint_friction = true,
                   .supports = has_sizes});
}
