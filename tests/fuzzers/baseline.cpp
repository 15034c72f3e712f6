#include "bench/studies/method_grid/baseline.h"

#include "problems/input_error.h"
#include "tests/fuzzers/targets.h"

namespace ricochet::fuzzing {
namespace {

/// Results of one method that is of second order, and of one that fails.
GridResults some_results() {
  GridResults results;
  results.id = "two_balls_order";
  for (const int steps : {10, 100, 1000, 10000}) {
    for (const char* method : {"moreau_jean", "fesd:gauss:2"}) {
      Record record;
      record.method = method;
      record.steps = steps;
      record.h_bar = 1.0 / steps;
      record.status = method[0] == 'm' ? "success" : "infeasible";
      record.error = record.h_bar * record.h_bar;
      record.solution_size = 1;
      results.records.push_back(record);
    }
  }
  return results;
}

}  // namespace

void baseline(const std::string& text) {
  static const GridResults results = some_results();
  try {
    check_baseline(results, file_of(text));
  } catch (const InputError&) {
  }
}

}  // namespace ricochet::fuzzing
