#include "methods/runge_kutta/embedded_tableau.h"

#include <map>

#include "methods/runge_kutta/explicit_coefficients.h"
#include "problems/names.h"

namespace ricochet {
namespace {

template <std::size_t n_s>
Vector vector(const Weights<n_s>& weights) {
  return Eigen::Map<const Vector>(weights.data(), n_s);
}

template <class Pair>
EmbeddedTableau tableau_of() {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  EmbeddedTableau t;
  t.id = Pair::id;
  t.name = Pair::name;
  t.source = Pair::source;
  t.order = Pair::order;
  t.error_order = Pair::error_order;
  t.n_s = Pair::n_s;
  t.is_first_same_as_last = is_first_same_as_last<Pair>();
  t.A = Eigen::Map<const RowMajor>(&Pair::A[0][0], Pair::n_s, Pair::n_s);
  t.b = vector(Pair::b);
  t.c = vector(Pair::c);
  t.e = vector(Pair::e);
  if constexpr (requires { Pair::e_2; }) t.e_2 = vector(Pair::e_2);
  return t;
}

using Makers = std::map<std::string, EmbeddedTableau (*)()>;

template <class... Pairs>
Makers makers_of(std::tuple<Pairs...>) {
  return {{std::string(Pairs::id), tableau_of<Pairs>}...};
}

const Makers& makers() {
  static const Makers makers = makers_of(EmbeddedPairs());
  return makers;
}

}  // namespace

std::vector<std::string> embedded_tableau_names() {
  return keys_of(makers());
}

EmbeddedTableau embedded_tableau(const std::string& name) {
  const auto known = makers().find(name);
  if (known == makers().end()) throw_unknown_name("embedded tableau", name, embedded_tableau_names());
  return known->second();
}

}  // namespace ricochet
