#pragma once

#include <memory>
#include <string>
#include <vector>

#include "problems/problem.h"

namespace ricochet {

/// A variable of a motion: a component of its initial values, or a parameter.
struct Variable {
  std::string name;  ///< "q0:0", "v0:0", "param:mu"
  double value = 0;
};

/// All variables of a problem: the components of q0 and v0 of the bodies, and the parameters, on which q0 and v0
/// may depend.
std::vector<Variable> variables(const ProblemInfo& info);

/// Index of `name` in variables(). @throws InputError for an unknown name, with all known ones
Eigen::Index find_variable(const ProblemInfo& info, const std::string& name);

/// A copy of the problem with another value of one variable.
/// @param variable  index in variables()
/// @throws InputError for a value that the problem does not allow, or a problem that is not made of formulas
std::unique_ptr<Problem> with_value(const Problem& problem, Eigen::Index variable, double value);

}  // namespace ricochet
