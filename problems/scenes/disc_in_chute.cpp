#include "problems/scene.h"

namespace ricochet {
namespace {

// A spinning disc that drops into a chute of two inclined rough walls.
//
//   \    _    /     m x'' = ...,  m y'' = -m g + ...,  J phi'' = R sum lambda_t,   J = m R^2 / 2
//    \  ( )  /      inward normals  n = (cos(beta_l), sin(beta_l)),  (-cos(beta_r), sin(beta_r))
//     \     /       f_c = n_x x + n_y y - R
//  beta_l | / beta_r   v_t = n_y x' - n_x y' + R phi'
//       \|/
//
// q[0] and q[1] are the centre (x, y), q[2] is the angle phi; beta_l, beta_r are the angles of the walls from the
// vertical. When both contacts are closed the centre is fixed, the disc spins on between the walls, and friction stops
// it. In steep chutes with mu > tan(beta) the forces of a disc at rest are not unique: it jams.
template <class T>
struct DiscInChute {
  static constexpr SceneText text{"disc_in_chute", "spinning disc between two inclined walls",
                                  "Newton restitution with Coulomb friction on the impulse",
                                  "two frictional contacts that close one after the other and wedge the disc"};

  T m{1.0}, R{0.1}, g{9.81}, beta_l{0.6}, beta_r{0.8}, e{0.0}, mu{0.3};
  T x0{-0.05}, y0{0.4}, omega0{40.0}, duration{0.6};

  void parameters(auto&& visit) {
    visit("m", m, "kg");
    visit("R", R, "m");
    visit("g", g, "m/s^2");
    visit("beta_l", beta_l, "rad");
    visit("beta_r", beta_r, "rad");
    visit("e", e, "1");
    visit("mu", mu, "1");
    visit("x0", x0, "m");
    visit("y0", y0, "m");
    visit("omega0", omega0, "rad/s");
    visit("duration", duration, "s");
  }

  Vec<T, 3> q0() const { return {x0, y0, 0}; }
  Vec<T, 3> v0() const { return {0, 0, omega0}; }
  T end_time() const { return duration; }

  Vec<T, 3> mass() const { return {m, m, m * R * R / 2}; }
  Vec<T, 3> force(const Vec<T, 3>&, const Vec<T, 3>&) const { return {0, -m * g, 0}; }
  std::array<Contact<T>, 2> contacts() const { return {{{"left wall", e, mu}, {"right wall", e, mu}}}; }
  Vec<T, 2> gap(const Vec<T, 3>& q) const {
    using std::sin, std::cos;
    return {cos(beta_l) * q[0] + sin(beta_l) * q[1] - R, -cos(beta_r) * q[0] + sin(beta_r) * q[1] - R};
  }
  std::array<std::array<Vec<T, 3>, 1>, 2> tangents(const Vec<T, 3>&) const {
    using std::sin, std::cos;
    return {{{{{sin(beta_l), -cos(beta_l), R}}}, {{{sin(beta_r), cos(beta_r), R}}}}};
  }
  T potential_energy(const Vec<T, 3>& q) const { return m * g * q[1]; }

  GeometryOf<T> geometry() const {
    GeometryOf<T> geometry{.gravity = {0, -g, 0}};
    const int disc = geometry.add_body({.name = "disc",
                                        .mass = m,
                                        .inertia = {0, 0, m * R * R / 2},
                                        .position = {{{0}, {1}, {}}},
                                        .rotation = BodyRotation::planar,
                                        .angles = {{{2}, {}, {}}}});
    const T quarter = quarter_turn<T>();
    const int shape = geometry.add_shape({.kind = ShapeKind::sphere, .body = disc, .size = {R}});
    const int left = geometry.add_shape({.kind = ShapeKind::half_space, .angles = {0, 0, beta_l - quarter}});
    const int right = geometry.add_shape({.kind = ShapeKind::half_space, .angles = {0, 0, quarter - beta_r}});
    geometry.pairs = {{0, left, shape}, {1, right, shape}};
    return geometry;
  }
};

const bool disc_in_chute_registered = register_scene<DiscInChute>();

}  // namespace
}  // namespace ricochet
