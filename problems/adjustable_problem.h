#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

/// A problem of which some parameters and components of the initial state have other values in every run of a study:
/// for one thread, which sets them again and again.
///
/// A problem made of formulas keeps its programs (SymbolicProblem::set_parameters()): microseconds instead of the
/// milliseconds of GiNaC, which no two threads may use at once. It is made again, once, for contacts that have friction
/// in some runs only. An assembled problem of which a parameter varies is made for every run, by one thread at a time.
/// Whatever values were set before, the same values give the same problem.
class AdjustableProblem {
 public:
  using Make = std::function<std::unique_ptr<Problem>(const ParameterChanges&)>;

  /// @param make   the problem with parameters that differ from its defaults, validated
  /// @param names  what varies: a parameter, or "q0:0", "v0:0" for a component of the initial state, which replaces
  ///               what follows from the parameters
  /// @throws InputError for a name that is not there, or comes twice
  AdjustableProblem(Make make, std::vector<std::string> names);
  ~AdjustableProblem();
  AdjustableProblem(const AdjustableProblem&) = delete;
  AdjustableProblem& operator=(const AdjustableProblem&) = delete;

  /// Valid until the next call. @param values  as many as names
  /// @throws InputError for values that the problem does not allow, with field, value and what is allowed
  const Problem& at(std::span<const double> values);

  /// The problem of all runs, where no parameter varies; else null. Until the first call of at() it has the initial state
  /// of the scene.
  const Problem* only() const { return has_parameters_ ? nullptr : made_.front().get(); }

  /// What is the same in all runs: coordinates, names.
  const ProblemInfo& base() const { return base_; }

 private:
  struct Place {
    enum class Of { parameter, q0, v0 };
    Of of;
    std::string name;  ///< of a parameter
    int index;         ///< in info().parameters, -1 where the problem does not list them; or in q0, v0
  };

  Place place_of(Problem& problem, const std::string& name) const;
  Problem& with_parameters(std::span<const double> values);

  Make make_;
  std::vector<Place> places_;
  bool has_parameters_ = false;                 ///< among the places
  ProblemInfo base_;                            ///< of the scene by itself
  std::vector<double> parameters_;              ///< of the scene by itself, then of the run
  std::vector<std::unique_ptr<Problem>> made_;  ///< one for all runs, or for those with friction at the same contacts
};

}  // namespace ricochet
