#include "methods/peers/siconos/bodies.h"

#include <map>
#include <set>

#include "problems/disjoint_sets.h"

namespace ricochet::siconos {
std::vector<std::vector<int>> coupled_coordinates(const ProblemInfo& info, const Matrix& M, const Matrix& f_q,
                                                  const Matrix& f_v) {
  DisjointSets sets(info.n_q);
  for (int i = 0; i < info.n_q; ++i) {
    for (int j = 0; j < info.n_q; ++j) {
      if (M(i, j) != 0 || f_q(i, j) != 0 || f_v(i, j) != 0) sets.join(i, j);
    }
  }
  // A join can only lower what the other contacts touch, so one pass is enough.
  for (const ContactInfo& contact : info.contacts) {
    std::set<int> touched;
    for (const int k : contact.support) touched.insert(sets.of(k));
    while (touched.size() > 2) {
      sets.join(*touched.begin(), *touched.rbegin());
      touched.erase(std::prev(touched.end()));
    }
  }
  std::map<int, std::vector<int>> members;
  for (int i = 0; i < info.n_q; ++i) members[sets.of(i)].push_back(i);
  std::vector<std::vector<int>> result;
  for (auto& [name, coordinates] : members) result.push_back(std::move(coordinates));
  return result;
}

}  // namespace ricochet::siconos
