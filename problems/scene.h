#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <type_traits>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/names.h"
#include "problems/problem.h"
#include "problems/registry.h"

/// @file
/// A compiled scene is a class template over its scalar type T. It is evaluated in two ways: with T = double, as
/// machine code, for the values that a time step needs; and once with T = GiNaC::ex to obtain its formulas, from which
/// all derivatives are computed.
///
///     template <class T>
///     struct BouncingBall {
///       static constexpr SceneText text{"bouncing_ball", "title", "source", "hard feature"};
///       T m{1.0}, g{9.81};                                        // parameters with their default values
///       void parameters(auto&& visit) { visit("m", m, "kg"); visit("g", g, "m/s^2"); }
///       Vec<T, 1> q0() const;   Vec<T, 1> v0() const;   T end_time() const;
///       Vec<T, 1> mass() const;                                   // diagonal of a constant M
///       Vec<T, 1> force(const Vec<T, 1>& q, const Vec<T, 1>& v) const;
///       std::array<Contact<T>, 1> contacts() const;               // name, eps_r, mu
///       Vec<T, 1> gap(const Vec<T, 1>& q) const;
///     };
///     const bool registered = register_scene<BouncingBall>();
///
/// A scene states only what it has. Optional members:
///
///     mass(q)                  M depends on q; Mat<T, n> instead of Vec<T, n>, of mass() or mass(q), is a full matrix
///     tangents(q)              std::array<std::array<Vec<T, n_q>, n_t>, n_c>, columns of J_t; needed when some mu > 0
///     input(q), control()      Mat-like std::array of n_q rows with n_u entries, instead of input(q) also input(q, v);
///                              the constant u of the plain simulation
///     potential_energy(q)      for energy reports
///     impact_law()             ImpactLaw: which law impacts obey, Newton's without it (impact_hypothesis.h)
///     friction(q, v)           std::array<Friction<T, n_q>, n>: friction without a normal contact, by elements
///                              (derivatives/friction_elements.h)
///     geometry()               GeometryOf<T>: bodies and shapes as drawings and engines need them (geometry.h)
///
/// A bilateral constraint is a contact joint<T>("name"), and its gap is zero at all times.
///
/// In a scene that depends on time, the time is an additional argument: force(q, v, t), gap(q, t), tangents(q, t),
/// input(q, t), control(t), friction(q, v, t), each instead of the form without t, and
///
///     drives(q, t)             std::array<std::array<T, n_t>, n_c>, added to J_t' v: minus the velocity of the surface
///
/// Coordinates stay those of the bodies; the clock of Problem (7) follows from t.
///
/// Use `using std::sin` and the like inside a function: the call then works for double and, by lookup, for symbols.
/// `sign(x)` and `choose(c, a, b)`, c > 0 ? a : b, serve both (real_functions.h).

namespace ricochet {

/// n numbers or symbols.
template <class T, std::size_t n>
using Vec = std::array<T, n>;
/// A matrix, row after row.
template <class T, std::size_t rows, std::size_t columns = rows>
using Mat = std::array<std::array<T, columns>, rows>;

/// Description of a scene in lists and reports, as in ProblemInfo.
struct SceneText {
  const char* id;            ///< lower_snake, "bouncing_ball"
  const char* title;         ///< short description
  const char* source;        ///< publication, or where the equations come from
  const char* hard_feature;  ///< what makes it hard for methods
};

/// A contact of a compiled scene; the scene's gap() and tangents() have its formulas.
template <class T>
struct Contact {
  const char* name;          ///< in messages, events and figures
  T eps_r{0.0};              ///< restitution coefficient, in [0, 1]
  T mu{0.0};                 ///< friction coefficient, >= 0
  bool is_bilateral{false};  ///< a constraint gap = 0, without eps_r and mu
};

/// A bilateral constraint of this `name`.
template <class T>
Contact<T> joint(const char* name) {
  return {.name = name, .is_bilateral = true};
}

/// A friction element of a compiled scene, in one direction.
template <class T, std::size_t n_q>
struct Friction {
  const char* name;  ///< in messages, events and figures; no contact has it
  Vec<T, n_q> J_t;   ///< a formula of q and t
  T bound;           ///< of |lambda_t| [N, N m], >= 0; a formula of q, v and t
  T drive{0.0};      ///< added to J_t' v; a formula of q and t
};

namespace scene_detail {

template <class Scene>
concept HasFriction = requires(const Scene s) {
  s.friction(s.q0(), s.v0());
}
|| requires(const Scene s) {
  s.friction(s.q0(), s.v0(), s.end_time());
};
template <class Scene>
concept HasContacts = requires(const Scene s) {
  s.contacts();
};
template <class Scene>
concept HasPotential = requires(const Scene s) {
  s.potential_energy(s.q0());
};
template <class Scene>
concept HasGeometry = requires(const Scene s) {
  s.geometry();
};
template <class Scene>
concept HasImpactLaw = requires(const Scene s) {
  s.impact_law();
};
template <class Scene>
concept HasControl = requires(const Scene s) {
  s.control();
}
|| requires(const Scene s) {
  s.control(s.end_time());
};
template <class Scene>
concept HasTangents = requires(const Scene s) {
  s.tangents(s.q0());
}
|| requires(const Scene s) {
  s.tangents(s.q0(), s.end_time());
};
template <class Scene>
concept HasDrives = requires(const Scene s) {
  s.drives(s.q0(), s.end_time());
};
template <class Scene>
concept HasConstantMass = requires(const Scene s) {
  s.mass();
};

template <class Scene>
auto mass_of(const Scene& scene, const auto& q) {
  if constexpr (HasConstantMass<Scene>)
    return scene.mass();
  else
    return scene.mass(q);
}

// Members that may depend on the time.

auto force_of(const auto& scene, const auto& q, const auto& v, const auto& t) {
  if constexpr (requires { scene.force(q, v, t); })
    return scene.force(q, v, t);
  else
    return scene.force(q, v);
}

auto gap_of(const auto& scene, const auto& q, const auto& t) {
  if constexpr (requires { scene.gap(q, t); })
    return scene.gap(q, t);
  else
    return scene.gap(q);
}

auto tangents_of(const auto& scene, const auto& q, const auto& t) {
  if constexpr (requires { scene.tangents(q, t); })
    return scene.tangents(q, t);
  else
    return scene.tangents(q);
}

auto input_of(const auto& scene, const auto& q, const auto& v, const auto& t) {
  if constexpr (requires { scene.input(q, v); })
    return scene.input(q, v);
  else if constexpr (requires { scene.input(q, t); })
    return scene.input(q, t);
  else
    return scene.input(q);
}

auto control_of(const auto& scene, const auto& t) {
  if constexpr (requires { scene.control(t); })
    return scene.control(t);
  else
    return scene.control();
}

auto friction_of(const auto& scene, const auto& q, const auto& v, const auto& t) {
  if constexpr (requires { scene.friction(q, v, t); })
    return scene.friction(q, v, t);
  else
    return scene.friction(q, v);
}

/// Friction elements that the scene states.
template <class Scene>
constexpr std::size_t n_elements() {
  if constexpr (HasFriction<Scene>) {
    const auto elements = [](const Scene& s) { return friction_of(s, s.q0(), s.v0(), s.end_time()); };
    return std::tuple_size_v<decltype(elements(std::declval<const Scene&>()))>;
  } else {
    return 0;
  }
}

/// The scene has a control(t), which a plain simulation adds to the force.
template <class Scene>
concept HasControlOfTime = requires(const Scene s) {
  s.control(s.end_time());
};
/// The scene may have a clock.
template <class Scene>
concept TakesTime = HasDrives<Scene> || HasControlOfTime<Scene> || requires(const Scene s) {
  s.force(s.q0(), s.v0(), s.end_time());
} || requires(const Scene s) {
  s.gap(s.q0(), s.end_time());
} || requires(const Scene s) {
  s.tangents(s.q0(), s.end_time());
} || requires(const Scene s) {
  s.input(s.q0(), s.end_time());
} || requires(const Scene s) {
  s.friction(s.q0(), s.v0(), s.end_time());
};

template <class Scene>
constexpr std::size_t n_q = std::tuple_size_v<decltype(std::declval<const Scene>().q0())>;

template <class Array>
constexpr std::size_t length = std::tuple_size_v<std::remove_cvref_t<Array>>;

/// Rejects a scene whose members have different numbers of coordinates or contacts.
template <class Scene>
constexpr bool sizes_agree() {
  using S = const Scene&;
  using Q = decltype(std::declval<S>().q0());
  using T = decltype(std::declval<S>().end_time());
  constexpr std::size_t n = length<Q>;
  static_assert(length<decltype(std::declval<S>().v0())> == n, "v0() needs as many numbers as q0()");
  static_assert(length<decltype(mass_of(std::declval<S>(), std::declval<Q>()))> == n,
                "mass() needs as many rows as q0() has numbers");
  static_assert(
      length<decltype(force_of(std::declval<S>(), std::declval<Q>(), std::declval<Q>(), std::declval<T>()))> == n,
      "force() needs as many numbers as q0()");
  if constexpr (HasContacts<Scene>) {
    constexpr std::size_t n_c = length<decltype(std::declval<S>().contacts())>;
    static_assert(length<decltype(gap_of(std::declval<S>(), std::declval<Q>(), std::declval<T>()))> == n_c,
                  "gap() needs as many numbers as contacts() has entries");
    if constexpr (HasTangents<Scene>)
      static_assert(length<decltype(tangents_of(std::declval<S>(), std::declval<Q>(), std::declval<T>()))> == n_c,
                    "tangents() needs as many entries as contacts()");
    if constexpr (HasDrives<Scene>)
      static_assert(length<decltype(std::declval<S>().drives(std::declval<Q>(), std::declval<T>()))> == n_c,
                    "drives() needs as many entries as contacts()");
  }
  if constexpr (HasControl<Scene>)
    static_assert(
        length<decltype(input_of(std::declval<S>(), std::declval<Q>(), std::declval<Q>(), std::declval<T>()))> == n,
        "input() needs as many rows as q0() has numbers");
  return true;
}

template <std::size_t n>
std::array<double, n> load(const double* x) {
  std::array<double, n> values;
  for (std::size_t k = 0; k < n; ++k) values[k] = x[k];
  return values;
}

/// Evaluates the scene with symbols instead of numbers. Parameter values are those of `numeric`.
template <template <class> class Scene>
SymbolicModel symbolic_model(Scene<double> numeric) {
  using GiNaC::ex;
  Scene<ex> scene;
  SymbolicModel model;
  model.id = Scene<ex>::text.id;
  model.title = Scene<ex>::text.title;
  model.source = Scene<ex>::text.source;
  model.hard_feature = Scene<ex>::text.hard_feature;
  numeric.parameters([&](const char* name, double& value, const char* unit) {
    model.parameters.push_back({name, value, unit});
    model.parameter_symbols.emplace_back(name);
  });
  std::size_t next = 0;
  scene.parameters([&](const char*, ex& value, const char*) { value = model.parameter_symbols[next++]; });

  constexpr std::size_t n = n_q<Scene<ex>>;
  Vec<ex, n> q, v;
  for (std::size_t k = 0; k < n; ++k) {
    model.q.emplace_back(fmt::format("q[{}]", k));
    model.v.emplace_back(fmt::format("v[{}]", k));
    q[k] = model.q[k];
    v[k] = model.v[k];
  }
  const auto list = [](const auto& array) { return SymbolicModel::Expressions(array.begin(), array.end()); };
  model.q0 = list(scene.q0());
  model.v0 = list(scene.v0());
  model.end_time = scene.end_time();

  const auto mass = mass_of(scene, q);
  model.mass.assign(n, SymbolicModel::Expressions(n, 0));
  for (std::size_t row = 0; row < n; ++row) {
    if constexpr (std::is_same_v<std::remove_const_t<decltype(mass)>, Vec<ex, n>>)
      model.mass[row][row] = mass[row];
    else
      model.mass[row] = list(mass[row]);
  }
  const ex t = model.t;
  model.force = list(force_of(scene, q, v, t));
  if constexpr (HasControl<Scene<ex>>) {
    for (const auto& row : input_of(scene, q, v, t)) model.input.push_back(list(row));
    model.control = list(control_of(scene, t));
    for (std::size_t k = 0; k < model.control.size(); ++k) model.u.emplace_back(fmt::format("u[{}]", k));
  }
  if constexpr (HasContacts<Scene<ex>>) {
    const auto gaps = gap_of(scene, q, t);
    const auto laws = scene.contacts();
    for (std::size_t i = 0; i < laws.size(); ++i) {
      model.contacts.push_back({laws[i].name, gaps[i], {}, {}, laws[i].eps_r, laws[i].mu, laws[i].is_bilateral});
    }
    if constexpr (HasTangents<Scene<ex>>) {
      const auto directions = tangents_of(scene, q, t);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        for (const auto& direction : directions[i]) model.contacts[i].tangents.push_back(list(direction));
      }
    }
    if constexpr (HasDrives<Scene<ex>>) {
      const auto drives = scene.drives(q, t);
      for (std::size_t i = 0; i < drives.size(); ++i) model.contacts[i].drives = list(drives[i]);
    }
  }
  if constexpr (HasFriction<Scene<ex>>) {
    for (const auto& element : friction_of(scene, q, v, t)) {
      model.frictions.push_back(
          {.name = element.name, .tangents = {list(element.J_t)}, .drives = {element.drive}, .bound = element.bound});
    }
  }
  if constexpr (HasPotential<Scene<ex>>) model.potential_energy = scene.potential_energy(q);
  if constexpr (HasImpactLaw<Scene<double>>) model.impact_law = numeric.impact_law();
  if constexpr (HasGeometry<Scene<ex>>) model.geometry = scene.geometry();
  return model;
}

}  // namespace scene_detail

/// A scene whose values are machine code and whose derivatives are programs.
template <template <class> class Scene>
class CompiledProblem final : public SymbolicProblem {
 public:
  /// Runs the `scene` with symbols. @throws InputError as SymbolicProblem
  explicit CompiledProblem(const Scene<double>& scene)
      : SymbolicProblem(scene_detail::symbolic_model<Scene>(scene)), scene_(scene) {}

  void force(const double* q, const double* v, const double* u, double* f) const override {
    if (has_jumps_as_friction()) return SymbolicProblem::force(q, v, u, f);
    const auto position = scene_detail::load<n>(q), velocity = scene_detail::load<n>(v);
    const double t = time(q);
    auto value = scene_detail::force_of(scene_, position, velocity, t);
    if constexpr (scene_detail::HasControl<Scene<double>>) {
      const auto B_u = scene_detail::input_of(scene_, position, velocity, t);
      if constexpr (scene_detail::HasControlOfTime<Scene<double>>) {
        const auto u_t = scene_.control(t);
        if (info_.n_u == 0) u = u_t.data();
        add_control(B_u, u, value);
      } else {
        add_control(B_u, u, value);
      }
    }
    std::copy(value.begin(), value.end(), f);
    if constexpr (scene_detail::HasFriction<Scene<double>>) {
      double* load = f + n;
      for (const auto& element : scene_detail::friction_of(scene_, position, velocity, t)) *load++ = -element.bound;
    }
    if constexpr (scene_detail::TakesTime<Scene<double>>) {
      if (info_.clock >= 0) f[info_.clock] = 0;
    }
  }

  void gap(const double* q, double* f_c) const override {
    if (has_jumps_as_friction()) return SymbolicProblem::gap(q, f_c);
    if constexpr (scene_detail::HasContacts<Scene<double>>) {
      const auto value = scene_detail::gap_of(scene_, scene_detail::load<n>(q), time(q));
      std::copy(value.begin(), value.end(), f_c);
    }
    if constexpr (n_elements > 0) std::copy_n(q + n, n_elements, f_c + info_.n_c() - n_elements);
  }

 protected:
  void parameters_changed() override {
    auto next = info_.parameters.begin();
    scene_.parameters([&](const char*, double& value, const char*) { value = (next++)->value; });
  }

 private:
  /// The force is not that of the scene_: its jumps are friction elements.
  bool has_jumps_as_friction() const { return info_.n_friction_elements > static_cast<int>(n_elements); }
  double time([[maybe_unused]] const double* q) const {
    if constexpr (scene_detail::TakesTime<Scene<double>>)
      return info_.clock < 0 ? 0 : q[info_.clock];
    else
      return 0;
  }
  static void add_control(const auto& B_u, const double* u, auto& value) {
    for (std::size_t row = 0; row < n; ++row) {
      for (std::size_t k = 0; k < B_u[row].size(); ++k) value[row] += B_u[row][k] * u[k];
    }
  }

  static constexpr std::size_t n = scene_detail::n_q<Scene<double>>,
                               n_elements = scene_detail::n_elements<Scene<double>>();
  Scene<double> scene_;
};

/// The scene with the parameters of `changes` in place of its own.
/// @throws InputError for a name that it does not have
template <template <class> class Scene>
Scene<double> scene_with(const ParameterChanges& changes) {
  Scene<double> scene;
  ParameterChanges unused = changes;
  std::vector<std::string> known;
  scene.parameters([&](const char* name, double& value, const char*) {
    known.emplace_back(name);
    if (const auto change = unused.find(name); change != unused.end()) {
      value = change->second;
      unused.erase(change);
    }
  });
  if (!unused.empty())
    throw_unknown_name(fmt::format("parameter of {}", Scene<double>::text.id), unused.begin()->first, known);
  return scene;
}

/// Makes the scene known under its id. Call once, in the scene's own file.
/// @param file  of the caller: std::source_location, which Clang has from 16 on only
/// @returns true, so that a constant of that file can be initialised by it
template <template <class> class Scene>
bool register_scene(const char* file = __builtin_FILE()) {
  static_assert(scene_detail::sizes_agree<Scene<double>>());
  const auto text = Scene<double>::text;
  SceneEntry entry{text.id, text.title, text.source, text.hard_feature, nullptr};
  entry.file = file;
  entry.make = [](const ParameterChanges& changes) -> std::unique_ptr<Problem> {
    return std::make_unique<CompiledProblem<Scene>>(scene_with<Scene>(changes));
  };
  return add_scene(std::move(entry));
}

}  // namespace ricochet
