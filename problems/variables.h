#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// A number that a motion depends on: a component of its initial values, or a parameter.
struct Variable {
  std::string name;  ///< "q0:0", "v0:0", "param:mu"
  double value = 0;
};

/// All variables of a problem: those of q0 and of v0 without the clock, and the parameters, which q0 and v0 may depend
/// on.
std::vector<Variable> variables(const ProblemInfo& info);

/// Where `name` stands in variables(). @throws InputError for a name that is not there, with those that are
Eigen::Index find_variable(const ProblemInfo& info, const std::string& name);

/// The problem with another value of one variable.
/// @param variable  where it stands in variables()
/// @throws InputError for a value that the problem does not allow, or a problem that is not made of formulas
std::unique_ptr<Problem> with_value(const Problem& problem, Eigen::Index variable, double value);

}  // namespace ricochet
