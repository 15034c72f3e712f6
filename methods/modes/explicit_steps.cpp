#include "methods/modes/explicit_steps.h"

#include <cmath>
#include <tuple>

#include "methods/modes/explicit_step.h"
#include "methods/runge_kutta/explicit_coefficients.h"

namespace ricochet {
namespace {

/// (1)-(3) for a pair from a file.
class ExplicitTableauStep final : public StepScheme {
 public:
  ExplicitTableauStep(const EmbeddedTableau& tableau, int n_q, ModeDynamics& dynamics)
      : tableau_(tableau), dynamics_(dynamics) {
    ends.resize(n_q);
    order = tableau.order;
    error_order = tableau.error_order;
    v_.setZero(n_q, tableau.n_s);
    a_ = v_;
    q_.setZero(n_q);
  }

  bool take(double h, EventFunctions* watched) override {
    ends.h = h;
    v_.col(0) = ends.v0;
    a_.col(0) = ends.a0;
    for (int i = 1; i < tableau_.n_s; ++i) {
      q_ = ends.q0;
      v_.col(i) = ends.v0;
      for (int j = 0; j < i; ++j) {
        if (tableau_.A(i, j) == 0) continue;
        q_ += h * tableau_.A(i, j) * v_.col(j);
        v_.col(i) += h * tableau_.A(i, j) * a_.col(j);
      }
      if (!dynamics_.accelerate(q_.data(), v_.col(i).data(), a_.col(i).data())) return false;
      if (watched) watched->record_stage(tableau_.c[i]);
    }
    ends.q1 = ends.q0;
    ends.v1 = ends.v0;
    for (int i = 0; i < tableau_.n_s; ++i) {
      ends.q1 += h * tableau_.b[i] * v_.col(i);
      ends.v1 += h * tableau_.b[i] * a_.col(i);
    }
    return true;
  }

  bool finish() override { return dynamics_.accelerate(ends.q1.data(), ends.v1.data(), ends.a1.data()); }

  double error(double tolerance) const override {
    return ends.h / tolerance * std::sqrt(squares(tableau_.e) / static_cast<double>(2 * ends.q0.size()));
  }

  void copy_stages(Matrix& v, Matrix& a) const override {
    v = v_;
    a = a_;
  }

 private:
  double squares(const Vector& weights) const {
    double total = 0;
    for (Eigen::Index k = 0; k < ends.q0.size(); ++k) {
      double e_q = 0, e_v = 0;
      for (int i = 0; i < tableau_.n_s; ++i) {
        e_q += weights[i] * v_(k, i);
        e_v += weights[i] * a_(k, i);
      }
      e_q /= 1 + std::abs(ends.q0[k]);
      e_v /= 1 + std::abs(ends.v0[k]);
      total += e_q * e_q + e_v * e_v;
    }
    return total;
  }

  const EmbeddedTableau& tableau_;
  ModeDynamics& dynamics_;
  Matrix v_, a_;
  Vector q_;
};

template <class Pair>
std::unique_ptr<StepScheme> make_pair_step(int n_q, ModeDynamics& dynamics) {
  switch (n_q) {
    case 1:
      return std::make_unique<ExplicitPairStep<Pair, 1>>(n_q, dynamics);
    case 2:
      return std::make_unique<ExplicitPairStep<Pair, 2>>(n_q, dynamics);
    case 3:
      return std::make_unique<ExplicitPairStep<Pair, 3>>(n_q, dynamics);
    case 4:
      return std::make_unique<ExplicitPairStep<Pair, 4>>(n_q, dynamics);
    default:
      return std::make_unique<ExplicitPairStep<Pair, 0>>(n_q, dynamics);
  }
}

template <class... Pairs>
std::unique_ptr<StepScheme> find_pair(const std::string& id, int n_q, ModeDynamics& dynamics, std::tuple<Pairs...>) {
  std::unique_ptr<StepScheme> step;
  ((Pairs::id == id && (step = make_pair_step<Pairs>(n_q, dynamics))) || ...);
  return step;
}

}  // namespace

std::unique_ptr<StepScheme> make_explicit_step(const EmbeddedTableau& tableau, int n_q, ModeDynamics& dynamics) {
  auto step = find_pair(tableau.id, n_q, dynamics, EmbeddedPairs());
  if (!step) step = std::make_unique<ExplicitTableauStep>(tableau, n_q, dynamics);
  return step;
}

}  // namespace ricochet
