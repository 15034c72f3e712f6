#include "problems/varied_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <set>

#include "problems/assembly/assembled_problem.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"
#include "problems/names.h"

namespace ricochet {
namespace {

/// GiNaC counts its references without locks: problems are made and destroyed by one thread at a time.
std::mutex& formulas() {
  static std::mutex mutex;
  return mutex;
}

SymbolicProblem* symbolic(Problem& problem) {
  return dynamic_cast<SymbolicProblem*>(&problem);
}

void set_initial_state(Problem& problem, const Vector& q0, const Vector& v0) {
  if (auto* made_of_formulas = symbolic(problem))
    made_of_formulas->set_initial_state(q0, v0);
  else
    dynamic_cast<AssembledProblem&>(problem).set_initial_state(q0, v0);
}

}  // namespace

VariedProblem::VariedProblem(Make make, std::vector<std::string> names) : make_(std::move(make)) {
  const std::lock_guard lock(formulas());
  base_ = make_({});
  q0_ = base_->info().q0;
  v0_ = base_->info().v0;
  for (const auto& parameter : base_->info().parameters) parameters_.push_back(parameter.value);
  std::set<std::string> seen;
  for (const auto& name : names) {
    places_.push_back(place_of(name));
    if (!seen.insert(name).second) throw InputError("varied", name, "once is enough");
  }
  has_parameters_ = std::ranges::any_of(places_, [](const Place& p) { return p.of == Place::Of::parameter; });
  if (has_parameters_ && symbolic(*base_)) symbolic(*base_)->open_parameters();
}

VariedProblem::~VariedProblem() {
  const std::lock_guard lock(formulas());
  fresh_.reset();
  base_.reset();
}

VariedProblem::Place VariedProblem::place_of(const std::string& name) const {
  const ProblemInfo& info = base_->info();
  std::vector<std::string> known;
  for (const char* part : {"q0", "v0"}) {
    for (int k = 0; k < info.n_mechanical(); ++k) {
      known.push_back(fmt::format("{}:{}", part, k));
      if (name == known.back()) return {*part == 'q' ? Place::Of::q0 : Place::Of::v0, name, k};
    }
  }
  for (std::size_t k = 0; k < info.parameters.size(); ++k) {
    known.push_back(info.parameters[k].name);
    if (name == known.back()) return {Place::Of::parameter, name, static_cast<int>(k)};
  }
  if (!symbolic(*base_) && name.find(':') == std::string::npos) {  // its parameters are known to make_ alone
    return {Place::Of::parameter, name, -1};
  }
  throw_unknown_name("quantity of " + info.id, name, known);
}

bool VariedProblem::set_parameters(std::span<const double> values) {
  if (!symbolic(*base_)) return false;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].of == Place::Of::parameter) parameters_[static_cast<std::size_t>(places_[k].index)] = values[k];
  }
  return symbolic(*base_)->set_parameters(parameters_);
}

void VariedProblem::make_afresh(std::span<const double> values) {
  ParameterChanges changes;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].of == Place::Of::parameter) changes[places_[k].name] = values[k];
  }
  const std::lock_guard lock(formulas());
  fresh_.reset();
  fresh_ = make_(changes);
}

const Problem& VariedProblem::at(std::span<const double> values) {
  if (has_parameters_ && !set_parameters(values)) {
    make_afresh(values);
  } else if (fresh_) {
    const std::lock_guard lock(formulas());
    fresh_.reset();
  }
  Vector q0 = has_parameters_ ? current().info().q0 : q0_, v0 = has_parameters_ ? current().info().v0 : v0_;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k].of == Place::Of::q0) q0[places_[k].index] = values[k];
    if (places_[k].of == Place::Of::v0) v0[places_[k].index] = values[k];
  }
  set_initial_state(current(), q0, v0);
  validate(current());
  return current();
}

}  // namespace ricochet
