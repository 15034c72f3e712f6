#include "bench/studies/hard_cases/verdict_matrix.h"

#include <map>

namespace ricochet {

nlohmann::json verdict_matrix(const std::vector<HardCell>& cells, const std::string& experiment) {
  using nlohmann::json;
  const HardMatrix matrix(cells);
  json cases = json::array(), rows = json::array();
  std::map<std::string, std::string> meanings;
  for (const auto& [id, title, group] : matrix.cases())
    cases.push_back({{"id", id}, {"title", title}, {"group", group}});
  for (std::size_t m = 0; m < matrix.methods().size(); ++m) {
    json row = json::array();
    for (std::size_t c = 0; c < matrix.cases().size(); ++c) {
      const HardCell* cell = matrix.cell(m, c);
      if (!cell) {
        row.push_back(nullptr);
        continue;
      }
      const VerdictText& text = text_of(cell->verdict());
      meanings.emplace(text.word, text.meaning);
      row.push_back({{"verdict", text.word},
                     {"grade", text.grade},
                     {"number", decisive_number(cell->verdict(), *cell)},
                     {"setting", cell->setting.text()},
                     {"row", cell->row_id(experiment)},
                     {"command", cell->command()}});
    }
    rows.push_back({{"method", matrix.methods()[m]}, {"cells", row}});
  }
  return {{"cases", cases}, {"methods", rows}, {"meanings", meanings}};
}

}  // namespace ricochet
