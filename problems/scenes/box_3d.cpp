#include "problems/scene.h"

namespace ricochet {
namespace {

// A rigid box with eight corners that falls onto a rough plane in space.
//
//       ______        q = (x, y, z, alpha, beta, gamma): centre, Cardan angles of R = R_x(alpha) R_y(beta) R_z(gamma)
//      /     /|       omega = E(q) (alpha', beta', gamma')  in body axes:
//     /_____/ |         omega_1 =  alpha' cos(beta) cos(gamma) + beta' sin(gamma)                        (1)
//     |     | /         omega_2 = -alpha' cos(beta) sin(gamma) + beta' cos(gamma)
//     |_____|/          omega_3 =  alpha' sin(beta) + gamma'
//  ______________     M = diag(m, m, m, E' I E),   I_1 = m (b^2 + c^2) / 3 and so on for half edges a, b, c    (2)
//                     f = (0, 0, -m g, -E' (I E^. (alpha', beta', gamma') + omega x I omega))                 (3)
//
//   corner p = (x, y, z) + R (+-a, +-b, +-c):   f_c = p_z,   v_t = (p_x', p_y')
//
// q[0] to q[2] are the centre, q[3] to q[5] the Cardan angles alpha, beta, gamma. The forces of the angles are Euler's
// equation times the transposed map from their derivatives to the angular velocity in body axes. The angles are
// singular at beta = +-pi/2, where M is; the default motion tumbles with |beta| below 1. The box lands on a corner at
// 0.21 s, then on edges; from 0.34 s on it slides and turns on four corners, whose forces are not unique, and at 0.39 s
// all four come to rest at once.
template <class T>
struct Box3d {
  static constexpr SceneText text{
      "box_3d", "box with eight corners on a rough plane in space", "Newton-Euler equations in Cardan angles",
      "several contacts with friction in two directions, redundant on a face; M(q), gyroscopic forces"};

  T m{1.0}, a{0.15}, b{0.1}, c{0.05}, g{9.81}, e{0.2}, mu{0.3};
  T height{0.3}, alpha0{0.5}, beta0{0.3}, gamma0{0.2}, v_x0{0.8}, v_y0{-0.3};
  T d_alpha0{1.0}, d_beta0{-0.5}, d_gamma0{2.0}, duration{0.6};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("a", a, "m");
    visit("b", b, "m");
    visit("c", c, "m");
    visit("g", g, "m/s^2");
    visit("e", e, "1");
    visit("mu", mu, "1");
    visit("height", height, "m");
    visit("alpha0", alpha0, "rad");
    visit("beta0", beta0, "rad");
    visit("gamma0", gamma0, "rad");
    visit("v_x0", v_x0, "m/s");
    visit("v_y0", v_y0, "m/s");
    visit("d_alpha0", d_alpha0, "rad/s");
    visit("d_beta0", d_beta0, "rad/s");
    visit("d_gamma0", d_gamma0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 6> q0() const { return {0, 0, height, alpha0, beta0, gamma0}; }
  Vec<T, 6> v0() const { return {v_x0, v_y0, 0, d_alpha0, d_beta0, d_gamma0}; }
  T end_time() const { return duration; }

  Vec<T, 3> inertia() const { return {m * (b * b + c * c) / 3, m * (a * a + c * c) / 3, m * (a * a + b * b) / 3}; }

  Mat<T, 6> mass(const Vec<T, 6>& q) const {  // (2)
    using std::sin, std::cos;
    const auto I = inertia();
    const T s_b = sin(q[4]), c_b = cos(q[4]), s_g = sin(q[5]), c_g = cos(q[5]);
    Mat<T, 6> M;
    for (auto& row : M) row.fill(T(0));
    M[0][0] = M[1][1] = M[2][2] = m;
    M[3][3] = c_b * c_b * (I[0] * c_g * c_g + I[1] * s_g * s_g) + I[2] * s_b * s_b;
    M[3][4] = M[4][3] = (I[0] - I[1]) * c_b * c_g * s_g;
    M[3][5] = M[5][3] = I[2] * s_b;
    M[4][4] = I[0] * s_g * s_g + I[1] * c_g * c_g;
    M[5][5] = I[2];
    return M;
  }

  Vec<T, 6> force(const Vec<T, 6>& q, const Vec<T, 6>& v) const {
    using std::sin, std::cos;
    const auto I = inertia();
    const T s_b = sin(q[4]), c_b = cos(q[4]), s_g = sin(q[5]), c_g = cos(q[5]);
    const T da = v[3], db = v[4], dg = v[5];
    const Vec<T, 3> omega{da * c_b * c_g + db * s_g, -da * c_b * s_g + db * c_g, da * s_b + dg};  // (1)
    const Vec<T, 3> bias{-da * db * s_b * c_g - da * dg * c_b * s_g + db * dg * c_g,              // E^. (a', b', g')
                         da * db * s_b * s_g - da * dg * c_b * c_g - db * dg * s_g, da * db * c_b};
    const Vec<T, 3> moment{I[0] * bias[0] + (I[2] - I[1]) * omega[1] * omega[2],  // (3), before E'
                           I[1] * bias[1] + (I[0] - I[2]) * omega[2] * omega[0],
                           I[2] * bias[2] + (I[1] - I[0]) * omega[0] * omega[1]};
    return {0,
            0,
            -m * g,
            -(c_b * c_g * moment[0] - c_b * s_g * moment[1] + s_b * moment[2]),
            -(s_g * moment[0] + c_g * moment[1]),
            -moment[2]};
  }

  std::array<Contact<T>, 8> contacts() const {
    return {{{"corner ---", e, mu},
             {"corner +--", e, mu},
             {"corner -+-", e, mu},
             {"corner ++-", e, mu},
             {"corner --+", e, mu},
             {"corner +-+", e, mu},
             {"corner -++", e, mu},
             {"corner +++", e, mu}}};
  }
  /// Corner i in body axes, in the order of contacts().
  Vec<T, 3> corner(std::size_t i) const { return {i & 1 ? a : -a, i & 2 ? b : -b, i & 4 ? c : -c}; }

  static T dot(const Vec<T, 3>& x, const Vec<T, 3>& y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; }

  Vec<T, 8> gap(const Vec<T, 6>& q) const {
    const auto row = rotation(q)[2];
    Vec<T, 8> f_c;
    for (std::size_t i = 0; i < 8; ++i) f_c[i] = q[2] + dot(row, corner(i));
    return f_c;
  }

  std::array<std::array<Vec<T, 6>, 2>, 8> tangents(const Vec<T, 6>& q) const {
    using std::sin, std::cos;
    const T s_a = sin(q[3]), s_b = sin(q[4]), c_b = cos(q[4]), s_g = sin(q[5]), c_g = cos(q[5]);
    const auto R = rotation(q);
    const Vec<T, 3> x_beta{-s_b * c_g, s_b * s_g, c_b};  // derivatives of the rows of R
    const Vec<T, 3> x_gamma{R[0][1], -R[0][0], 0}, y_gamma{R[1][1], -R[1][0], 0};
    std::array<std::array<Vec<T, 6>, 2>, 8> J_t;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto p = corner(i);
      J_t[i][0] = {1, 0, 0, 0, dot(x_beta, p), dot(x_gamma, p)};
      J_t[i][1] = {0, 1, 0, -dot(R[2], p), s_a * dot(R[0], p), dot(y_gamma, p)};
    }
    return J_t;
  }
  T potential_energy(const Vec<T, 6>& q) const { return m * g * q[2]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.in_space = true, .gravity = {0, 0, -g}};
    const int body = geometry.add_body({.name = "box",
                                        .mass = m,
                                        .inertia = inertia(),
                                        .position = {{{0}, {1}, {2}}},
                                        .rotation = BodyRotation::cardan,
                                        .angles = {{{3}, {4}, {5}}}});
    const int plane = geometry.add_shape({.kind = ShapeKind::half_space});
    const int box = geometry.add_shape({.kind = ShapeKind::box, .body = body, .size = {a, b, c}});
    for (int corner = 0; corner < 8; ++corner) geometry.pairs.push_back({corner, plane, box, corner});
    return geometry;
  }

 private:
  Mat<T, 3> rotation(const Vec<T, 6>& q) const {
    using std::sin, std::cos;
    const T s_a = sin(q[3]), c_a = cos(q[3]), s_b = sin(q[4]), c_b = cos(q[4]), s_g = sin(q[5]), c_g = cos(q[5]);
    return {{{c_b * c_g, -c_b * s_g, s_b},
             {c_a * s_g + s_a * s_b * c_g, c_a * c_g - s_a * s_b * s_g, -s_a * c_b},
             {s_a * s_g - c_a * s_b * c_g, s_a * c_g + c_a * s_b * s_g, c_a * c_b}}};
  }
};

const bool box_3d_registered = register_scene<Box3d>();

}  // namespace
}  // namespace ricochet
