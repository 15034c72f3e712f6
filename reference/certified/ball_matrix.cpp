#include "reference/certified/ball_matrix.h"

#include <arb_mat.h>

namespace ricochet::reference::certified {

std::optional<BallMatrix> solve(const BallMatrix& A, const BallMatrix& B, slong bits) {
  const auto n = static_cast<slong>(A.size()), m = static_cast<slong>(B.front().size());
  arb_mat_t a, b, x;
  arb_mat_init(a, n, n);
  arb_mat_init(b, n, m);
  arb_mat_init(x, n, m);
  for (slong i = 0; i < n; ++i) {
    for (slong k = 0; k < n; ++k) arb_set(arb_mat_entry(a, i, k), A[i][k].get());
    for (slong k = 0; k < m; ++k) arb_set(arb_mat_entry(b, i, k), B[i][k].get());
  }
  std::optional<BallMatrix> result;
  if (arb_mat_solve(x, a, b, bits)) {
    result.emplace(n);
    for (slong i = 0; i < n; ++i) {
      for (slong k = 0; k < m; ++k) (*result)[i].emplace_back(arb_mat_entry(x, i, k));
    }
  }
  arb_mat_clear(a);
  arb_mat_clear(b);
  arb_mat_clear(x);
  return result;
}

}  // namespace ricochet::reference::certified
