#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "methods/modes/mode_dynamics.h"
#include "methods/modes/step_scheme.h"
#include "methods/runge_kutta/embedded_tableau.h"
#include "methods/runge_kutta/explicit_coefficients.h"

namespace ricochet {

/// One step of an embedded explicit Runge-Kutta pair for q' = v, v' = a(q, v), with the modes of ModeDynamics:
///
///   q_i = q_0 + h sum_j A_ij v_j,   v_i = v_0 + h sum_j A_ij a_j,   a_i = a(q_i, v_i),   j < i          (1)
///   q_1 = q_0 + h sum_i b_i v_i,    v_1 = v_0 + h sum_i b_i a_i                                         (2)
///   e = h sum_i e_i (v_i, a_i)                                                                          (3)
///
/// The coefficients are constants of the program (explicit_coefficients.h), so (1)-(3) are unrolled and zeros dropped;
/// for up to four coordinates so is their number.
///
/// @tparam Pair  of explicit_coefficients.h; @tparam N  n_q, 0 where it is known at run time only
template <class Pair, int N>
class ExplicitPairStep final : public StepScheme {
 public:
  ExplicitPairStep(int n_q, ModeDynamics& dynamics) : n_q_(n_q), dynamics_(dynamics) {
    ends.resize(n_q);
    order = Pair::order;
    error_order = Pair::error_order;
    if constexpr (N == 0) {
      for (auto* stages : {&v_, &a_}) {
        for (auto& stage : *stages) stage.setZero(n_q);
      }
      q_.setZero(n_q);
    }
  }

  bool take(double h, EventFunctions* watched) override {
    ends.h = h;
    const double *v0 = ends.v0.data(), *a0 = ends.a0.data();
    for (int k = 0; k < size(); ++k) {
      v_[0][k] = v0[k];
      a_[0][k] = a0[k];
    }
    if (!stages(h, watched, std::make_index_sequence<Pair::n_s - 1>())) return false;
    double *q1 = ends.q1.data(), *v1 = ends.v1.data();
    if constexpr (is_first_same_as_last<Pair>()) {
      for (int k = 0; k < size(); ++k) {
        q1[k] = q_[k];
        v1[k] = v_[Pair::n_s - 1][k];
      }
    } else {
      const double* q0 = ends.q0.data();
      for (int k = 0; k < size(); ++k) {
        q1[k] = q0[k] + h * sum(Pair::b, v_, k, every_stage());
        v1[k] = v0[k] + h * sum(Pair::b, a_, k, every_stage());
      }
    }
    return true;
  }

  bool finish() override {
    if constexpr (is_first_same_as_last<Pair>()) {
      for (int k = 0; k < size(); ++k) ends.a1[k] = a_[Pair::n_s - 1][k];
      return true;
    } else {
      return dynamics_.accelerate<N>(ends.q1.data(), ends.v1.data(), ends.a1.data());
    }
  }

  double error(double tolerance) const override {
    double total = squares(Pair::e);
    if constexpr (requires { Pair::e_2; }) total = combined_squares(total, squares(Pair::e_2));
    return ends.h / tolerance * std::sqrt(total / (2 * size()));
  }

  void copy_stages(Matrix& v, Matrix& a) const override {
    for (int i = 0; i < Pair::n_s; ++i) {
      for (int k = 0; k < size(); ++k) {
        v(k, i) = v_[i][k];
        a(k, i) = a_[i][k];
      }
    }
  }

 private:
  static constexpr auto every_stage() { return std::make_index_sequence<Pair::n_s>(); }
  using Stage = std::conditional_t<N == 0, Vector, std::array<double, N == 0 ? 1 : N>>;
  using Stages = std::array<Stage, Pair::n_s>;

  int size() const { return N == 0 ? n_q_ : N; }

  template <std::size_t... I>
  bool stages(double h, EventFunctions* watched, std::index_sequence<I...>) {
    return (stage<I + 1>(h, watched, std::make_index_sequence<I + 1>()) && ...);
  }

  /// (1)
  template <std::size_t I, std::size_t... J>
  bool stage(double h, EventFunctions* watched, std::index_sequence<J...> before) {
    static constexpr Weights<Pair::n_s> row = {Pair::A[I][J]...};
    const double *q0 = ends.q0.data(), *v0 = ends.v0.data();
    for (int k = 0; k < size(); ++k) {
      q_[k] = q0[k] + h * sum(row, v_, k, before);
      v_[I][k] = v0[k] + h * sum(row, a_, k, before);
    }
    if (!dynamics_.accelerate<N>(q_.data(), v_[I].data(), a_[I].data())) return false;
    if (watched) watched->record_stage(Pair::c[I]);
    return true;
  }

  // GCC inlines it or not as the other files of its group have it; a call per coordinate and stage costs 10 % of a step.
  template <std::size_t... J>
  [[gnu::always_inline]] static double sum(const Weights<Pair::n_s>& weights, const Stages& x, int k,
                                           std::index_sequence<J...>) {
    double total = 0;
    (((weights[J] != 0) ? total += weights[J] * x[J][k] : total), ...);
    return total;
  }

  double squares(const Weights<Pair::n_s>& weights) const {
    const double *q0 = ends.q0.data(), *v0 = ends.v0.data();
    double total = 0;
    for (int k = 0; k < size(); ++k) {
      const double e_q = sum(weights, v_, k, every_stage()) / (1 + std::abs(q0[k]));
      const double e_v = sum(weights, a_, k, every_stage()) / (1 + std::abs(v0[k]));
      total += e_q * e_q + e_v * e_v;
    }
    return total;
  }

  const int n_q_;
  ModeDynamics& dynamics_;
  Stages v_, a_;
  Stage q_;
};

}  // namespace ricochet
