#include "reports/results.h"

#include "bench/studies/grid/grid_results.h"
#include "problems/input_error.h"
#include "reports/order_fit.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {

/// As results of methods on a grid, with the orders that are fitted to them.
void results(const std::string& text) {
  try {
    const GridResults grid(read_results(file_of(text)));
    for (const auto& method : grid.methods()) fit_order(grid.of(method));
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
