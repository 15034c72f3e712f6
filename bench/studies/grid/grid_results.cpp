#include "bench/studies/grid/grid_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "problems/input_error.h"

namespace ricochet {

GridResults::GridResults(const Results& results)
    : path(results.path),
      id(results.experiment()),
      title(results.title()),
      overhead_of(results.header.value("overhead_of", std::map<std::string, std::string>())),
      records(results.all<Run>()),
      trajectories(results.all<Trajectory>()),
      is_complete(results.is_complete),
      is_quick(results.header.value("quick", false)) {
  std::set<std::tuple<std::string, int, double, std::string>> runs;
  for (const Run& record : records) {
    if (!runs.emplace(record.method, record.setting.steps, record.setting.tolerance, record.instead_of).second)
      throw InputError(fmt::format("{}:{}: {} at {}: this run is there twice", results.path, line_of(record),
                                   record.method, record.setting.value()));
  }
  for (const TimingRow& timing : results.all<TimingRow>()) {
    if (timing.row >= records.size())
      throw InputError(fmt::format("{}: timing of row", results.path), timing.row, "no such row");
    timings[timing.row] = timing.timing;
    peak_bytes[timing.row] = timing.peak_bytes;
  }
}

bool GridResults::has_errors() const {
  return std::any_of(records.begin(), records.end(), [](const Run& r) { return r.has_error(); });
}

bool GridResults::has_metrics() const {
  return std::any_of(records.begin(), records.end(), [](const Run& r) { return r.metrics.are_known; });
}

ErrorMeasure GridResults::error_measure() const {
  if (records.empty() || records.front().sensitivities.empty())
    return {"error E(T)", "Error: max-norm of the difference of the final (q, v) to the reference."};
  return {
      "relative error of d(q, v)/dθ at T",
      fmt::format("Error: that of d(q, v)/dθ at the end time, the largest over θ = {}; max-norm, relative to 1 or the "
                  "size of the derivative, whichever is larger.",
                  fmt::join(records.front().sensitivities, ", "))};
}

std::vector<std::string> GridResults::methods() const {
  std::vector<std::string> names;
  for (const auto& record : records) {
    if (record.instead_of.empty() && std::find(names.begin(), names.end(), record.method) == names.end()) {
      names.push_back(record.method);
    }
  }
  return names;
}

const Timing* GridResults::timing_of(const Run& record) const {
  const auto found = timings.find(static_cast<std::size_t>(&record - records.data()));
  return found == timings.end() ? nullptr : &found->second;
}

double GridResults::peak_bytes_of(const Run& record) const {
  const auto found = peak_bytes.find(static_cast<std::size_t>(&record - records.data()));
  return found == peak_bytes.end() ? Metrics::kNone : found->second;
}

}  // namespace ricochet
