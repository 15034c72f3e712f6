#include "problems/adjustable_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <set>
#include <stdexcept>

#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {

AdjustableProblem::AdjustableProblem(Make make, std::vector<std::string> names) : make_(std::move(make)) {
  const std::lock_guard lock(formulas_mutex());
  auto problem = make_({});
  base_ = problem->info();
  for (const auto& parameter : base_.parameters) parameters_.push_back(parameter.value);
  std::set<std::string> seen;
  for (const auto& name : names) {
    places_.push_back(place_of(*problem, name));
    if (!seen.insert(name).second) throw InputError("varied", name, "this quantity is given twice");
  }
  has_parameters_ = std::ranges::any_of(places_, [](const Place& p) { return p.of == Place::Of::parameter; });
  if (has_parameters_ && problem->symbolic()) problem->symbolic()->open_parameters();
  made_.push_back(std::move(problem));
}

AdjustableProblem::~AdjustableProblem() {
  const std::lock_guard lock(formulas_mutex());
  made_.clear();
}

AdjustableProblem::Place AdjustableProblem::place_of(Problem& problem, const std::string& name) const {
  std::vector<std::string> known;
  for (const char* part : {"q0", "v0"}) {
    for (int k = 0; k < base_.n_mechanical(); ++k) {
      known.push_back(fmt::format("{}:{}", part, k));
      if (name == known.back()) return {*part == 'q' ? Place::Of::q0 : Place::Of::v0, name, k};
    }
  }
  for (std::size_t k = 0; k < base_.parameters.size(); ++k) {
    known.push_back(base_.parameters[k].name);
    if (name == known.back()) return {Place::Of::parameter, name, static_cast<int>(k)};
  }
  if (!problem.symbolic() && name.find(':') == std::string::npos) {  // its parameters are known to make_ alone
    return {Place::Of::parameter, name, -1};
  }
  throw_unknown_name("quantity of " + base_.id, name, known);
}

/// A problem with these parameters, reused if possible.
Problem& AdjustableProblem::with_parameters(std::span<const double> values) {
  if (!has_parameters_) {
    made_.front()->set_initial_state(base_.q0, base_.v0);
    return *made_.front();
  }
  ParameterChanges changes;
  const bool is_symbolic = made_.front()->symbolic() != nullptr;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].of != Place::Of::parameter) continue;
    changes[places_[k].name] = values[k];
    if (is_symbolic) parameters_[static_cast<std::size_t>(places_[k].index)] = values[k];
  }
  if (is_symbolic) {
    for (const auto& problem : made_) {
      if (problem->symbolic()->set_parameters(parameters_)) return *problem;
    }
  }
  const std::lock_guard lock(formulas_mutex());
  auto problem = make_(changes);
  if (is_symbolic) {
    problem->symbolic()->open_parameters();
    if (!problem->symbolic()->set_parameters(parameters_))
      throw std::logic_error("a problem that has just been made takes its own parameters");
  } else {
    made_.clear();
  }
  made_.push_back(std::move(problem));
  return *made_.back();
}

const Problem& AdjustableProblem::at(std::span<const double> values) {
  Problem& problem = with_parameters(values);
  Vector q0 = problem.info().q0, v0 = problem.info().v0;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].of == Place::Of::q0) q0[places_[k].index] = values[k];
    if (places_[k].of == Place::Of::v0) v0[places_[k].index] = values[k];
  }
  problem.set_initial_state(q0, v0);
  validate(problem);
  return problem;
}

}  // namespace ricochet
