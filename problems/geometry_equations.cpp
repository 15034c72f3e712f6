#include "problems/geometry_equations.h"

#include "problems/geometry_kinematics.h"

namespace ricochet {

using GiNaC::ex;
using Expressions = SymbolicModel::Expressions;

namespace {

Expressions coordinates_of(const SymbolicModel& model) {
  return {model.q.begin(), model.q.end()};
}

}  // namespace

std::vector<Expressions> mass_from_geometry(const SymbolicModel& model) {
  return mass_matrix_of(*model.geometry, coordinates_of(model));
}

Expressions force_from_geometry(const SymbolicModel& model) {
  const std::size_t n = model.q.size();
  Expressions force = weight_of(*model.geometry, coordinates_of(model));
  for (std::size_t row = 0; row < n; ++row) {  // (1)
    for (std::size_t column = 0; column < n; ++column) {
      const ex& M = model.mass[row][column];
      for (std::size_t j = 0; j < n && !GiNaC::is_a<GiNaC::numeric>(M); ++j) {
        const ex slope = M.diff(model.q[j]);
        if (slope.is_zero()) continue;
        force[row] -= slope * model.v[column] * model.v[j];
        force[j] += slope / 2 * model.v[row] * model.v[column];
      }
    }
  }
  return force;
}

ex potential_from_geometry(const SymbolicModel& model) {
  ex potential = 0;
  for (std::size_t i = 0; i < model.geometry->bodies.size(); ++i) {  // (2)
    const auto motion = motion_of(*model.geometry, static_cast<int>(i), coordinates_of(model));
    potential -= model.geometry->bodies[i].mass * dot(model.geometry->gravity, motion.centre);
  }
  return potential;
}

SymbolicModel::Contact contact_from_geometry(const SymbolicModel& model, const ShapePair& pair) {
  const auto touching = contact_of(*model.geometry, pair, coordinates_of(model));
  SymbolicModel::Contact contact;
  contact.gap = touching.gap;
  contact.tangents = touching.J_t;
  return contact;
}

}  // namespace ricochet
