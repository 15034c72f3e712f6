#include "reports/site/motion_csv.h"

#include <fmt/format.h>

#include <utility>

namespace ricochet {

std::string motion_csv(const nlohmann::json& row) {
  const auto t = row.find("t"), q = row.find("q"), v = row.find("v");
  if (t == row.end() || q == row.end() || v == row.end() || t->empty() || q->size() != t->size() ||
      v->size() != t->size())
    return "";
  std::string csv = "t";
  for (const auto& [name, values] : {std::pair{"q", q}, std::pair{"v", v}}) {
    for (std::size_t k = 0; k < values->front().size(); ++k) csv += fmt::format(",{}[{}]", name, k);
  }
  csv += "\n";
  for (std::size_t k = 0; k < t->size(); ++k) {
    csv += t->at(k).dump();
    for (const auto& values : {q, v}) {
      for (const auto& number : values->at(k)) csv += "," + number.dump();
    }
    csv += "\n";
  }
  return csv;
}

}  // namespace ricochet
