#include "problems/control/replay_problem.h"

#include "problems/input_error.h"

namespace ricochet {
namespace {

const SymbolicModel& plant_model(const OptimalControlProblem& problem) {
  const SymbolicModel* plant = problem.plant->formulas();
  if (!plant) throw InputError("plant", problem.id, "a plant with formulas is required");
  return *plant;
}

SymbolicModel with_cost(const OptimalControlProblem& problem) {
  SymbolicModel model = plant_model(problem);
  const auto n_q = model.q.size();
  model.q.emplace_back("cost_integral");
  model.v.emplace_back("cost");
  model.q0.emplace_back(0);
  model.v0.emplace_back(0);
  for (auto& row : model.mass) row.emplace_back(0);
  model.mass.emplace_back(n_q + 1, 0);
  model.mass[n_q][n_q] = 1;
  model.force.push_back(problem.running_cost.formulas()[0]);  // (1)
  model.input.emplace_back(model.u.size(), 0);
  for (std::size_t c = 0; c < model.u.size(); ++c) {
    const std::string name = ReplayProblem::control_parameter(static_cast<int>(c));
    model.parameters.push_back({name, model.number(model.control[c]), ""});
    model.parameter_symbols.emplace_back(name);
    model.control[c] = model.parameter_symbols.back();
  }
  for (auto& contact : model.contacts) {
    for (auto& direction : contact.tangents) direction.emplace_back(0);
  }
  for (auto& element : model.frictions) {
    for (auto& direction : element.tangents) direction.emplace_back(0);
  }
  model.potential_energy.reset();
  return model;
}

}  // namespace

ControlledPlant::ControlledPlant(const OptimalControlProblem& problem) : SymbolicProblem(plant_model(problem)) {}

ReplayProblem::ReplayProblem(const OptimalControlProblem& problem)
    : SymbolicProblem(with_cost(problem)), n_bodies_(problem.plant->info().n_mechanical()) {}

void ReplayProblem::restart(const Vector& q, const Vector& v, const Vector& u, double duration) {
  Vector q0(info_.n_q), v0(info_.n_q);
  q0 << q.head(n_bodies_), 0, q.tail(q.size() - n_bodies_);
  v0 << v.head(n_bodies_), 0, v.tail(v.size() - n_bodies_);
  set_initial_state(q0, v0);
  info_.u = u;
  info_.end_time = duration;
}

Vector ReplayProblem::of_plant(const Vector& x) const {
  Vector part(x.size() - 1);
  part << x.head(n_bodies_), x.tail(x.size() - n_bodies_ - 1);
  return part;
}

}  // namespace ricochet
