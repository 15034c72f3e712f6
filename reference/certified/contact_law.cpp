#include "reference/certified/contact_law.h"

namespace ricochet::reference::certified {

ContactLaw contact_law(const SceneFormulas& scene, int contact, SeriesProgram& program) {
  const Precision& a = program.precision();
  std::vector<std::vector<Node>> rows{scene.contacts[contact].J_n};
  rows.insert(rows.end(), scene.contacts[contact].J_t.begin(), scene.contacts[contact].J_t.end());
  const BallMatrix J = program.values_of(rows);
  BallMatrix columns(scene.n);
  for (const auto& row : J) {
    for (int r = 0; r < scene.n; ++r) columns[r].push_back(row[r]);
  }
  auto moved = solve(program.values_of(scene.M), columns, a.bits);
  if (!moved) throw Undecided("the mass matrix may be singular at " + scene.contacts[contact].name);
  ContactLaw law{std::move(*moved), BallMatrix(J.size(), std::vector<Ball>(J.size()))};
  for (std::size_t i = 0; i < J.size(); ++i) {
    for (std::size_t j = 0; j < J.size(); ++j) {
      for (int r = 0; r < scene.n; ++r) law.G[i][j] = a.add(law.G[i][j], a.mul(J[i][r], law.moved[r][j]));
    }
  }
  return law;
}

Node rate_along(const ModeMotion& motion, Node w, const SceneFormulas& scene, SeriesProgram& program) {
  Node sum = program.derivative(w, scene.clock);
  for (int k = 0; k < scene.n; ++k) {
    const Node by_q = program.mul(program.derivative(w, scene.q[k]), scene.v[k]);
    const Node by_v = program.mul(program.derivative(w, scene.v[k]), motion.acceleration[k]);
    sum = program.add(sum, program.add(by_q, by_v));
  }
  return sum;
}

std::vector<Node> contact_rates(const ModeMotion& motion, const ContactFormulas& contact, const SceneFormulas& scene,
                                SeriesProgram& program) {
  std::vector<Node> rates{rate_along(motion, contact.v_n, scene, program)};
  for (const Node v_t : contact.v_t) rates.push_back(rate_along(motion, v_t, scene, program));
  return rates;
}

}  // namespace ricochet::reference::certified
