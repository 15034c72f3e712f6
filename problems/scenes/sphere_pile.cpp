#include "problems/assembly/scene_parameters.h"
#include "problems/tangent_frame.h"

namespace ricochet {
namespace {

// n spheres fall on rough ground in layers and make a pile.
//
//      o         per sphere q = (x, y, z, phi_x, phi_y, phi_z) with the angular velocity omega = phi':
//     o o        no force depends on how a sphere is turned, so phi is the integral of omega and no more
//    o o o       m p'' = -m g e_z + contacts,   (2/5) m R^2 omega' = contacts
//   -------
//
// Ground: f_c = z - R; two spheres: f_c = |p_2 - p_1| - 2 R. With the unit normal n from 1 to 2 the slip velocity is
//
//   v_t = (t_1, t_2)' (v_2 - v_1 - R (omega_1 + omega_2) x n),   t_1, t_2 those of tangents_of(n)           (1)

template <class T>
struct SphereOnGround : ContactScene<T, 6> {
  Vec<T, 1> gap(const Vec<T, 6>& q) const { return {q[2] - this->size}; }
  std::array<std::array<Vec<T, 6>, 2>, 1> tangents(const Vec<T, 6>&) const {
    const T R = this->size;
    return {{{{{1, 0, 0, 0, -R, 0}, {0, 1, 0, R, 0, 0}}}}};
  }
};

template <class T>
struct SphereOnSphere : ContactScene<T, 12> {
  T distance(const Vec<T, 12>& q) const {
    using std::sqrt;
    const T x = q[6] - q[0], y = q[7] - q[1], z = q[8] - q[2];
    return sqrt(x * x + y * y + z * z);
  }
  Vec<T, 1> gap(const Vec<T, 12>& q) const { return {distance(q) - 2 * this->size}; }
  std::array<std::array<Vec<T, 12>, 2>, 1> tangents(const Vec<T, 12>& q) const {
    const T d = distance(q);
    const Vec<T, 3> n{(q[6] - q[0]) / d, (q[7] - q[1]) / d, (q[8] - q[2]) / d};
    const std::array<Vec<T, 3>, 2> tangents = tangents_of(n);
    std::array<std::array<Vec<T, 12>, 2>, 1> J;
    for (int k = 0; k < 2; ++k) {
      const Vec<T, 3>& t = tangents[k];
      // t' (omega x n) = omega' (n x t)
      const Vec<T, 3> arm{n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]};
      for (int c = 0; c < 3; ++c) {  // (1)
        J[0][k][c] = -t[c];
        J[0][k][c + 6] = t[c];
        J[0][k][c + 3] = J[0][k][c + 9] = -this->size * arm[c];
      }
    }
    return J;
  }
};

template <class T>
struct SpherePile {
  static constexpr SceneText text{"sphere_pile", "n spheres that fall and make a pile", "Coulomb friction in space",
                                  "rolling, slip and stick at many curved contacts at once"};

  static void assemble(AssemblyOf<T>& pile, const SceneParametersOf<T>& p) {
    const int n = p.count("n", 1, 400);
    const T m = p.positive("m"), R = p.positive("R"), pitch = T(41) / 20 * R;
    const auto ground = pile.add_kind(SphereOnGround<T>{{R, p["e"], p["mu"]}});
    const auto pair = pile.add_kind(SphereOnSphere<T>{{R, p["e"], p["mu"]}});
    // A pyramid of square layers, each in the hollows of the one below, the lowest just large enough.
    int side = 1;
    for (int room = 1; room < n; room += side * side) ++side;
    int i = 0;
    for (int layer = 0, width = side; i < n; ++layer, --width) {
      for (int k = 0; k < width * width && i < n; ++k, ++i) {
        const T middle = T(width - 1) / 2, x = (k % width - middle) * pitch, y = (k / width - middle) * pitch;
        const T z = p["height"] + R + layer * (T(8) / 5) * R;  // hollows of touching spheres are at sqrt(2) R
        for (const T& position : {x, y}) pile.add_coordinate(m, 0, position, 0);
        pile.add_coordinate(m, -m * p["g"], z, 0);
        for (int c = 0; c < 3; ++c) pile.add_coordinate(T(2) / 5 * m * R * R, 0, 0, 0);
      }
    }
    const auto of = [](int body, std::vector<int> coordinates = {}) {
      for (int c = 0; c < 6; ++c) coordinates.push_back(6 * body + c);
      return coordinates;
    };
    GeometryOf<T> geometry{.in_space = true, .gravity = {0, 0, -p["g"]}};
    const int plane = geometry.add_shape({.kind = ShapeKind::half_space});
    const T J = T(2) / 5 * m * R * R;
    std::vector<int> spheres;
    for (i = 0; i < n; ++i) {
      const int k = 6 * i, sphere = geometry.add_body({.name = fmt::format("sphere {}", i + 1),
                                                       .mass = m,
                                                       .inertia = {J, J, J},
                                                       .position = {{{k}, {k + 1}, {k + 2}}},
                                                       .rotation = BodyRotation::spin,
                                                       .angles = {{{k + 3}, {k + 4}, {k + 5}}}});
      spheres.push_back(geometry.add_shape({.kind = ShapeKind::sphere, .body = sphere, .size = {R}}));
      const int contact = pile.add_contact(ground, of(i), fmt::format("sphere {}, ground", i + 1));
      geometry.pairs.push_back({contact, plane, spheres.back()});
    }
    for (i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        const int contact = pile.add_contact(pair, of(j, of(i)), fmt::format("spheres {}, {}", i + 1, j + 1));
        geometry.pairs.push_back({contact, spheres[i], spheres[j]});
      }
    }
    pile.set_geometry(std::move(geometry));
  }
};

const bool sphere_pile_registered = register_assembled_scene<SpherePile>({{"n", 2, "1"},
                                                                          {"m", 0.2, "kg"},
                                                                          {"R", 0.05, "m"},
                                                                          {"g", 9.81, "m/s^2"},
                                                                          {"e", 0, "1"},
                                                                          {"mu", 0.3, "1"},
                                                                          {"height", 0.02, "m"},
                                                                          {"duration", 0.5, "s"}});

}  // namespace
}  // namespace ricochet
