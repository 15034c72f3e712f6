#pragma once

#include <deque>
#include <vector>

#include "methods/elements/element.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// A tableau with the data that (1), (2), (5) of stage_equations.h require.
struct StageTableau : ButcherTableau {
  explicit StageTableau(const ButcherTableau& tableau);

  Matrix A2;             ///< A A
  Vector bA;             ///< A' b
  Vector rows;           ///< row sums of A; equal to c in all but the smallest Radau IA and Lobatto IIIB methods
  bool ends_with_stage;  ///< stiffly accurate: the last stage is the right end
  bool has_polynomial;   ///< a polynomial passes through the stages: no entries of c are equal
  Matrix extrapolation;  ///< stage values to those of the next step of equal length, if has_polynomial
  Vector node_weights;   ///< 1 / prod_m (c_k - c_m), m != k

  /// First guess for `to`, of equal length and starting where `from` ends: the stage polynomials of `from`, continued.
  void extrapolate(const Element& from, Element& to) const;
  /// First guess for `to`, which begins at `begin` and has length `length`, both in units of the length of `from` and
  /// from its left end: the stage polynomials of `from` there. `to` must be another element.
  void continue_stages(const Element& from, double begin, double length, Element& to) const;

 private:
  void combine(const double* weights, const Element& from, Element& to) const;
};

/// (1), (2), (5) of stage_equations.h for one length, in one piece of memory.
class StageCoefficients {
 public:
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  StageCoefficients() = default;
  StageCoefficients(const StageCoefficients&) = delete;  // the maps point into values_
  StageCoefficients& operator=(const StageCoefficients&) = delete;

  double h = 0;
  Eigen::Map<RowMajorMatrix> hA{nullptr, 0, 0}, h2A2{nullptr, 0, 0};
  Eigen::Map<Vector> hb{nullptr, 0}, h2bA{nullptr, 0}, h_rows{nullptr, 0};  ///< h_rows: h times the row sums of A

  void set(const StageTableau& tableau, double length);

 private:
  std::vector<double> values_;
};

/// Coefficients of the last lengths: full step, rest after an impact, ... alternate.
class RecentCoefficients {
 public:
  explicit RecentCoefficients(const StageTableau& tableau) : tableau_(tableau) {}
  const StageCoefficients& of(double h);

 private:
  const StageTableau& tableau_;
  std::deque<StageCoefficients> kept_;  // they do not move
  std::size_t last_ = 0, oldest_ = 0;   // used last; to be replaced next
};

}  // namespace ricochet
