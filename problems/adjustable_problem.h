#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/registry.h"

namespace ricochet {

/// A problem whose parameters and initial state are changed for every run of a study. Each thread has its own
/// AdjustableProblem.
///
/// A problem made of formulas keeps its programs (SymbolicProblem::set_parameters()). A change takes microseconds
/// instead of the milliseconds of GiNaC, which must not be used by two threads at once. The problem is made again,
/// once, if contacts have friction in some runs only. An assembled problem with a varied parameter is made for every
/// run, by one thread at a time. The same values always give the same problem.
class AdjustableProblem {
 public:
  using Make = std::function<std::unique_ptr<Problem>(const ParameterChanges&)>;

  /// @param make   the problem with parameters that differ from its defaults, validated
  /// @param names  the varied quantities: a parameter, or "q0:0", "v0:0" for a component of the initial state, which
  ///               replaces the value that follows from the parameters
  /// @throws InputError for an unknown name, or one that occurs twice
  AdjustableProblem(Make make, std::vector<std::string> names);
  ~AdjustableProblem();
  AdjustableProblem(const AdjustableProblem&) = delete;
  AdjustableProblem& operator=(const AdjustableProblem&) = delete;

  /// Valid until the next call. @param values  as many as names
  /// @throws InputError for values that the problem does not allow, with field, value and what is allowed
  const Problem& at(std::span<const double> values);

  /// The problem of all runs if no parameter varies; else null. Until the first call of at() it has the initial state
  /// of the scene.
  const Problem* only() const { return has_parameters_ ? nullptr : made_.front().get(); }

  /// Properties that are the same in all runs: coordinates, names.
  const ProblemInfo& base() const { return base_; }

 private:
  struct Place {
    enum class Of { parameter, q0, v0 };
    Of of;
    std::string name;  ///< of a parameter
    int index;         ///< in info().parameters, -1 if the problem does not list them; or in q0, v0
  };

  Place place_of(Problem& problem, const std::string& name) const;
  Problem& with_parameters(std::span<const double> values);

  Make make_;
  std::vector<Place> places_;
  bool has_parameters_ = false;                 ///< among the places
  ProblemInfo base_;                            ///< of the scene as stated
  std::vector<double> parameters_;              ///< of the scene as stated, then of the run
  std::vector<std::unique_ptr<Problem>> made_;  ///< one for all runs, or for those with friction at the same contacts
};

}  // namespace ricochet
