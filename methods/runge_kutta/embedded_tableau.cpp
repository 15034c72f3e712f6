#include "methods/runge_kutta/embedded_tableau.h"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "methods/runge_kutta/explicit_coefficients.h"
#include "methods/runge_kutta/order_conditions.h"
#include "methods/runge_kutta/tableau_file.h"
#include "problems/input_error.h"
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

ButcherTableau butcher_tableau(const EmbeddedTableau& pair) {
  return {.name = pair.id,
          .n_s = pair.n_s,
          .order = pair.order,
          .A = pair.A,
          .b = pair.b,
          .c = pair.c,
          .right_end = {},
          .diagonal = nullptr,
          .holds_accelerations = true};
}

std::vector<std::string> embedded_tableau_names() {
  return keys_of(makers());
}

EmbeddedTableau embedded_tableau(const std::string& name) {
  const auto known = makers().find(name);
  if (known == makers().end()) throw_unknown_name("embedded tableau", name, embedded_tableau_names());
  return known->second();
}

namespace {

// Coefficients with 15 decimals, up to 50 in size, as some of DOP853 are, and a dozen of them in a sum.
constexpr double kWeightRounding = 1e-12;

constexpr int kMaxOrder = 14;  // 53,000 trees; no pair of a higher order is known

void require_explicit(const TableauFile& file, const Matrix& A) {
  for (int i = 0; i < A.rows(); ++i) {
    for (int j = i; j < A.cols(); ++j) {
      if (A(i, j) != 0)
        throw InputError(fmt::format("{}[{}][{}]", file.field("A"), i, j), A(i, j),
                         "an explicit method has zeros on the diagonal and above");
    }
  }
}

/// The weights of a solution sum to 1, those of a difference of solutions to 0.
void require_sum(const TableauFile& file, const std::string& key, const Vector& weights, int sum) {
  if (std::abs(weights.sum() - sum) > kWeightRounding)
    throw InputError(file.field(key), weights.sum(), fmt::format("the weights must sum to {}", sum));
}

Vector error_weights(const TableauFile& file, const Vector& b) {
  const int n_s = static_cast<int>(b.size());
  if (file.has("b_hat") == file.has("e"))
    throw InputError(file.field("b_hat") + (file.has("e") ? ": this field or e may be given, not both"
                                                          : ": this field, or e in its place, is missing"));
  const std::string key = file.has("e") ? "e" : "b_hat";
  const Vector given = file.vector(key, n_s);
  require_sum(file, key, given, file.has("e") ? 0 : 1);
  const Vector e = file.has("e") ? given : b - given;
  if (e.isZero(0)) throw InputError(file.field(key) + ": there is no error estimate, since b_hat is b");
  return e;
}

}  // namespace

EmbeddedTableau read_embedded_tableau(const std::string& path) {
  const TableauFile file(path, {"A", "b"}, {"name", "source", "b_hat", "e", "c", "order", "error_order"});
  EmbeddedTableau t;
  t.id = path;
  t.name = file.text("name", path);
  t.source = file.text("source", path);
  t.n_s = file.stages();
  t.b = file.vector("b", t.n_s);
  t.A = file.square_matrix("A", t.n_s);
  require_explicit(file, t.A);
  t.c = file.abscissae(t.A, kWeightRounding);
  t.is_first_same_as_last = t.A.row(t.n_s - 1) == t.b.transpose();

  require_sum(file, "b", t.b, 1);
  t.e = error_weights(file, t.b);
  const int confirmed = order_from_trees(t.A, t.b, kMaxOrder, kWeightRounding);
  t.order = file.order("order", confirmed);
  t.error_order = file.order("error_order", order_from_trees(t.A, t.b - t.e, confirmed, kWeightRounding));
  return t;
}

}  // namespace ricochet
