#include "methods/fesd_homotopy/options.h"

#include "problems/input_error.h"

namespace ricochet {
namespace {

bool is_on(const MethodSpec& spec, const std::string& option) {
  return spec.choice(option, {"on", "off"}) == "on";
}

FesdEquations::Options equation_options(const MethodSpec& spec) {
  using E = FesdEquations;
  E::Options options;
  options.n_fe = spec.whole_number("n_fe", 2, 1, 64);
  options.impulses = spec.choice("impulses", E::impulse_names());
  options.cone = spec.choice("cone", friction_cone_names());
  options.facets = spec.whole_number("facets", 8, 3, 1000);
  options.cross = spec.choice("cross", E::cross_names());
  options.equilibration = spec.choice("equilibration", E::equilibration_names());
  options.rho = spec.number("rho", 1, 0, 1e10);
  options.shortest = spec.number("shortest", 1e-3, 0, 1);
  options.no_capture = spec.choice("capture", {"on", "off"}) == "off";
  options.bounded_parts = true;
  options.eps_c = spec.number("eps_c", 1e-3, 0, 1);
  return options;
}

/// @param is_near  the guess is a solution, which only has to be kept
HomotopyOptions homotopy_options(const MethodSpec& spec, bool is_near) {
  HomotopyOptions options;
  std::vector<std::string> names;
  for (const auto& relaxation : relaxations()) names.emplace_back(relaxation.name);
  options.relaxation = spec.choice("relaxation", names);
  options.sigma_0 = spec.number("sigma_0", is_near ? 1e-7 : 1e-3, 1e-14, 1e6);
  options.sigma_final = spec.number("sigma_n", is_near ? 1e-10 : 1e-11, 1e-14, options.sigma_0);
  options.factor = spec.number("factor", 0.1, 1e-6, 0.999);
  options.update = spec.choice(
      "update", Names<SigmaUpdate>{{"superlinear", SigmaUpdate::superlinear}, {"linear", SigmaUpdate::linear}});
  options.tolerance = spec.number("tolerance", is_near ? 1e-10 : 1e-11, 1e-13, 1e-2);
  options.max_iterations = spec.whole_number("max_iterations", 300, 1, 1000000);
  options.cross_over = is_on(spec, "crossover");
  options.max_branches = spec.whole_number("branches", 3, 0, 1000);
  options.descend = false;  // every solution of the equations will do
  return options;
}

}  // namespace

StepHomotopy::Options step_homotopy_options(const MethodSpec& spec) {
  using Guess = StepHomotopy::Guess;
  StepHomotopy::Options options;
  options.equations = equation_options(spec);
  options.guess = spec.choice(
      "guess", Names<Guess>{{"ballistic", Guess::ballistic}, {"cold", Guess::cold}, {"pivoting", Guess::pivoting}});
  options.homotopy = homotopy_options(spec, options.guess == Guess::pivoting);
  options.retries = spec.whole_number("retry", 3, 0, 10);
  if (options.equations.cone == FesdEquations::Cone::squared && options.homotopy.cross_over)
    throw InputError("crossover", "on",
                     "off is required with cone=squared, which no open contact that slips fulfils exactly");
  return options;
}

}  // namespace ricochet
