#include "reference/bracketed_root.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_roots.h>

#include <cmath>
#include <memory>

namespace ricochet::reference {
namespace {

constexpr int kMaxIterations = 100;  // of Brent's method, whose worst case is bisection to rounding, twice

}  // namespace

double bracketed_root(const std::function<double(double)>& f, double from, double to) {
  const double at_from = f(from), at_to = f(to);
  if (!(at_from * at_to < 0)) return std::abs(at_from) < std::abs(at_to) ? from : to;  // GSL ends the program there
  const std::unique_ptr<gsl_root_fsolver, decltype(&gsl_root_fsolver_free)> solver(
      gsl_root_fsolver_alloc(gsl_root_fsolver_brent), &gsl_root_fsolver_free);
  gsl_function function{
      [](double x, void* self) { return (*static_cast<const std::function<double(double)>*>(self))(x); },
      const_cast<void*>(static_cast<const void*>(&f))};
  gsl_root_fsolver_set(solver.get(), &function, from, to);
  for (int i = 0; i < kMaxIterations; ++i) {
    gsl_root_fsolver_iterate(solver.get());
    const double low = gsl_root_fsolver_x_lower(solver.get()), high = gsl_root_fsolver_x_upper(solver.get());
    if (gsl_root_test_interval(low, high, 0, 1e-15) == GSL_SUCCESS) break;
  }
  return gsl_root_fsolver_root(solver.get());
}

}  // namespace ricochet::reference
