#include "methods/contact_laws/solvers/contact_solver.h"

#include <algorithm>

#include "methods/contact_laws/friction_cone.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

using Kind = ContactSolverKind;

constexpr int kMostContactsOfPivoting = 100;  // of Lemke's method, on dense matrices

const std::vector<ContactSolverEntry>& all_solvers() {
  static const std::vector<ContactSolverEntry> entries = {{"lemke", Kind::lemke, 0, kMostContactsOfPivoting},
                                                          {"exact", Kind::exact, 200},
                                                          {"pgs", Kind::pgs, 20000},
                                                          {"newton", Kind::newton, 200},
                                                          {"interior_point", Kind::interior_point, 100},
                                                          {"admm", Kind::admm, 20000},
                                                          {"staggered", Kind::staggered, 1000},
                                                          {"siconos", Kind::siconos, 20000}};
  return entries;
}

const Names<Kind>& kinds() {
  static const Names<Kind> names = [] {
    Names<Kind> all = {{"automatic", Kind::automatic}};
    for (const auto& entry : all_solvers()) all.emplace_back(entry.name, entry.kind);
    return all;
  }();
  return names;
}

}  // namespace

const std::vector<ContactSolverEntry>& contact_solvers() {
  static const std::vector<ContactSolverEntry> built = [] {
    std::vector<ContactSolverEntry> entries = all_solvers();
    if (!has_siconos_contact_solver()) std::erase_if(entries, [](const auto& e) { return e.kind == Kind::siconos; });
    return entries;
  }();
  return built;
}

const ContactSolverEntry& contact_solver(ContactSolverKind kind) {
  return *std::ranges::find(all_solvers(), kind, &ContactSolverEntry::kind);
}

const char* reason_of(ContactStatus status) {
  switch (status) {
    case ContactStatus::solved:
      return "solved";
    case ContactStatus::no_solution:
      return "the contact problem has no solution that Lemke's method finds";
    case ContactStatus::iteration_limit:
      return "the contact solver did not reach its tolerance within its iterations";
    case ContactStatus::dependent:
      return "bilateral constraints depend on each other";
  }
  return "";
}

ContactSolverOptions contact_solver_argument(const MethodSpec& spec, double tolerance) {
  ContactSolverOptions options{.kind = spec.choice("solver", kinds()), .tolerance = tolerance};
  if (options.kind == ContactSolverKind::automatic && spec.whole_number("facets", 0, 4, 1024) > 0)
    options.kind = ContactSolverKind::lemke;
  if (options.kind == ContactSolverKind::automatic) return options;
  if (options.kind == ContactSolverKind::lemke) {
    options.facets = facets_argument(spec);
    return options;
  }
  if (options.kind == ContactSolverKind::siconos && !has_siconos_contact_solver())
    throw InputError("solver=siconos is not built: libsiconos-kernel-dev not found");
  options.facets = 0;
  options.tolerance = spec.number("contact_tolerance", options.tolerance, 1e-15, 1);
  options.iterations =
      spec.whole_number("contact_iterations", contact_solver(options.kind).usual_iterations, 1, 100'000'000);
  return options;
}

ContactSolverOptions options_for(const ProblemInfo& problem, ContactSolverOptions options) {
  if (options.kind != ContactSolverKind::automatic) return options;
  const bool in_space = std::ranges::any_of(problem.contacts, [](const auto& contact) { return contact.n_t == 2; });
  options.kind = in_space ? ContactSolverKind::exact : ContactSolverKind::lemke;
  options.iterations = contact_solver(options.kind).usual_iterations;
  return options;
}

std::unique_ptr<ContactSolver> make_contact_solver(const ContactSolverOptions& options) {
  switch (options.kind) {
    case ContactSolverKind::exact:
      return make_exact_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::pgs:
      return make_gauss_seidel_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::newton:
      return make_newton_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::interior_point:
      return make_interior_point_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::admm:
      return make_admm_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::staggered:
      return make_staggered_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::siconos:
      return make_siconos_contact_solver(options.tolerance, options.iterations);
    case ContactSolverKind::lemke:
    case ContactSolverKind::automatic:
      break;
  }
  return make_lemke_contact_solver(options.facets);
}

}  // namespace ricochet
