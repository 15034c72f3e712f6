#include "problems/variables.h"

#include <algorithm>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/initial_state.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {

std::vector<Variable> variables(const ProblemInfo& info) {
  std::vector<Variable> list;
  const int n_q = info.n_mechanical();
  for (int k = 0; k < n_q; ++k) list.push_back({fmt::format("q0:{}", k), info.q0[k]});
  for (int k = 0; k < n_q; ++k) list.push_back({fmt::format("v0:{}", k), info.v0[k]});
  for (const auto& parameter : info.parameters) list.push_back({"param:" + parameter.name, parameter.value});
  return list;
}

Eigen::Index find_variable(const ProblemInfo& info, const std::string& name) {
  std::vector<std::string> known;
  for (const auto& variable : variables(info)) {
    if (variable.name == name) return static_cast<Eigen::Index>(known.size());
    known.push_back(variable.name);
  }
  throw_unknown_name("sensitivity", name, known);
}

namespace {

const SymbolicModel& model_of(const Problem& problem) {
  const SymbolicModel* formulas = problem.formulas();
  if (!formulas) throw InputError("problem", problem.info().id, "only a problem made of formulas can be varied");
  return *formulas;
}

std::unique_ptr<Problem> valid_problem(SymbolicModel model) {
  auto varied = std::make_unique<SymbolicProblem>(std::move(model));
  validate(*varied);
  return varied;
}

/// Initial values that set_initial_state() has replaced are numbers; others stay formulas of the parameters.
void keep_initial_state(const Problem& problem, SymbolicModel& model) {
  const auto keep = [](const Vector& now, const Vector& stated, auto& formulas) {
    for (std::size_t k = 0; k < formulas.size(); ++k) {
      const double value = now[static_cast<Eigen::Index>(k)];
      if (stated[static_cast<Eigen::Index>(k)] != value) formulas[k] = value;
    }
  };
  keep(problem.info().q0, problem.stated_q0(), model.q0);
  keep(problem.info().v0, problem.stated_v0(), model.v0);
}

}  // namespace

std::unique_ptr<Problem> with_value(const Problem& problem, Eigen::Index variable, double value) {
  SymbolicModel model = model_of(problem);
  keep_initial_state(problem, model);
  const auto k = static_cast<std::size_t>(variable), n_q = model.q.size();
  if (k < n_q)
    model.q0[k] = value;
  else if (k < 2 * n_q)
    model.v0[k - n_q] = value;
  else
    model.parameters.at(k - 2 * n_q).value = value;
  return valid_problem(std::move(model));
}

std::unique_ptr<Problem> with_initial_state(const Problem& problem, const Vector& q0, const Vector& v0) {
  SymbolicModel model = model_of(problem);
  const auto n = static_cast<std::ptrdiff_t>(model.q.size());  // without coordinates that are no body's
  model.q0.assign(q0.begin(), q0.begin() + n);
  model.v0.assign(v0.begin(), v0.begin() + n);
  return valid_problem(std::move(model));
}

}  // namespace ricochet
