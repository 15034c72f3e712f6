#pragma once

#include <vector>

#include "methods/elements/element.h"
#include "methods/runge_kutta/butcher_tableau.h"

namespace ricochet {

/// A tableau with what (1), (2), (5) of stage_equations.h need of it.
struct StageTableau : ButcherTableau {
  explicit StageTableau(const ButcherTableau& tableau);

  Matrix A2;             ///< A A
  Vector bA;             ///< A' b
  Vector rows;           ///< row sums of A; equal to c in all but the smallest Radau IA and Lobatto IIIB methods
  bool ends_with_stage;  ///< stiffly accurate: the last stage is the right end
  bool has_polynomial;   ///< one passes through the stages: no two entries of c are equal
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

/// (1), (2), (5) of stage_equations.h for one length.
struct StageCoefficients {
  using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  double h = 0;
  RowMajorMatrix hA, h2A2;
  Vector hb, h2bA, h_rows;  ///< h_rows: h times the row sums of A

  void set(const StageTableau& tableau, double length);
};

/// Coefficients of the last lengths: full step, rest after an impact, ... alternate.
class RecentCoefficients {
 public:
  explicit RecentCoefficients(const StageTableau& tableau);
  const StageCoefficients& of(double h);

 private:
  const StageTableau& tableau_;
  std::vector<StageCoefficients> kept_;
  std::size_t last_ = 0, oldest_ = 0;  // used last; to be replaced next
};

}  // namespace ricochet
