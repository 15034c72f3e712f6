#include "methods/peers/siconos/bodies.h"

#include <map>
#include <numeric>
#include <set>

namespace ricochet::siconos {
namespace {

/// Disjoint sets of coordinates; each is named by its smallest member.
class Sets {
 public:
  explicit Sets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int name_of(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int i, int j) {
    i = name_of(i), j = name_of(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace

std::vector<std::vector<int>> coupled_coordinates(const ProblemInfo& info, const Matrix& M, const Matrix& f_q,
                                                  const Matrix& f_v) {
  Sets sets(info.n_q);
  for (int i = 0; i < info.n_q; ++i) {
    for (int j = 0; j < info.n_q; ++j) {
      if (M(i, j) != 0 || f_q(i, j) != 0 || f_v(i, j) != 0) sets.join(i, j);
    }
  }
  // A join can only lower what the other contacts touch, so one pass is enough.
  for (const ContactInfo& contact : info.contacts) {
    std::set<int> touched;
    for (const int k : contact.support) touched.insert(sets.name_of(k));
    while (touched.size() > 2) {
      sets.join(*touched.begin(), *touched.rbegin());
      touched.erase(std::prev(touched.end()));
    }
  }
  std::map<int, std::vector<int>> members;
  for (int i = 0; i < info.n_q; ++i) members[sets.name_of(i)].push_back(i);
  std::vector<std::vector<int>> result;
  for (auto& [name, coordinates] : members) result.push_back(std::move(coordinates));
  return result;
}

}  // namespace ricochet::siconos
