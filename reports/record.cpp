#include "reports/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet {

std::string Record::setting() const {
  return steps > 0 ? fmt::format("{}", steps) : fmt::format("{:.0e}", tolerance);
}

bool Record::has_error() const {
  return succeeded() && std::isfinite(error);
}

std::vector<const Record*> runs_of(const std::vector<Record>& records, const std::string& method) {
  std::vector<const Record*> list;
  for (const auto& record : records) {
    if (record.method == method && record.instead_of.empty()) list.push_back(&record);
  }
  std::stable_sort(list.begin(), list.end(), [](const Record* a, const Record* b) {
    return a->steps != b->steps ? a->steps < b->steps : a->tolerance > b->tolerance;
  });
  return list;
}

}  // namespace ricochet
