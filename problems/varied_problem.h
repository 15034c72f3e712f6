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
/// milliseconds of GiNaC, which no two threads may use at once. An assembled problem of which a parameter varies is
/// made afresh, by one thread at a time.
class VariedProblem {
 public:
  using Make = std::function<std::unique_ptr<Problem>(const ParameterChanges&)>;

  /// @param make   the problem with parameters that differ from its defaults, validated
  /// @param names  what varies: a parameter, or "q0:0", "v0:0" for a component of the initial state, which replaces
  ///               what follows from the parameters
  /// @throws InputError for a name that is not there, or comes twice
  VariedProblem(Make make, std::vector<std::string> names);
  ~VariedProblem();
  VariedProblem(const VariedProblem&) = delete;
  VariedProblem& operator=(const VariedProblem&) = delete;

  /// Valid until the next call. @param values  as many as names
  /// @throws InputError for values that the problem does not allow, with field, value and what is allowed
  const Problem& at(std::span<const double> values);

  /// With the values that the scene has by itself.
  const Problem& base() const { return *base_; }

 private:
  struct Place {
    enum class Of { parameter, q0, v0 };
    Of of;
    std::string name;  ///< of a parameter
    int index;         ///< in info().parameters, -1 where the problem does not list them; or in q0, v0
  };

  Place place_of(const std::string& name) const;
  bool set_parameters(std::span<const double> values);
  void make_afresh(std::span<const double> values);
  Problem& current() { return *(fresh_ ? fresh_ : base_); }

  Make make_;
  std::vector<Place> places_;
  bool has_parameters_ = false;     ///< among the places
  std::unique_ptr<Problem> base_;   ///< its parameters are set where that can be done
  std::unique_ptr<Problem> fresh_;  ///< instead, made for the present values
  Vector q0_, v0_;                  ///< of the scene by itself
  std::vector<double> parameters_;  ///< of the scene by itself, then of the run
};

}  // namespace ricochet
