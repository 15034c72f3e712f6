#include "reports/section.h"

namespace ricochet {

void Section::failures(std::string name, Table table) {
  if (table.rows.empty()) return;
  table.is_list = true;
  add(std::move(name), std::move(table), Role::failures);
}

std::vector<const Section::NamedTable*> Section::tables() const {
  std::vector<const NamedTable*> list;
  for (const auto& part : parts_) {
    if (const auto* table = std::get_if<NamedTable>(&part)) list.push_back(table);
  }
  return list;
}

}  // namespace ricochet
