#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "methods/complementarity/mpcc/nlp.h"

namespace ricochet {

/// A function of one pair (G, H) with its derivatives.
struct PairValue {
  double value = 0;
  double d_G = 0, d_H = 0;
  double d_GG = 0, d_GH = 0, d_HH = 0;
};

/// Smooth replacement of 0 <= G _|_ H >= 0 with a parameter sigma > 0; its solutions tend to those of the pair as
/// sigma -> 0. Those that replace the pair by rows, G, H >= 0 throughout unless stated:
///
///   scholtes             G H <= sigma                                                                        (1)
///   scholtes_equality    G H = sigma                                                                         (2)
///   fischer_burmeister   G + H - sqrt(G^2 + H^2 + 2 sigma) = 0: (2) in another form                          (3)
///   lin_fukushima        G H <= sigma^2,  (G + sigma)(H + sigma) >= sigma^2,  G, H free                      (4)
///   kadrani              (G - sigma)(H - sigma) <= 0,  G, H >= -sigma                                        (5)
///   steffensen_ulbrich   G + H - phi(G - H) <= 0, phi(a) = |a| for |a| >= sigma, else sigma theta(a / sigma),
///                        theta(z) = (3 + 6 z^2 - z^4) / 8, which meets |z| at z = +-1 with two derivatives    (6)
///
/// and those that penalise what is not complementary:
///
///   elastic_1            G H / sigma in the objective                                                        (7)
///   elastic_inf          G H <= s with one s >= 0 for all pairs, s / sigma in the objective                  (8)
///
/// Sources: (1), (2) Scholtes, Convergence properties of a regularization scheme for mathematical programs with
/// complementarity constraints, SIAM J. Optim. 11 (2001). (3) Facchinei, Jiang, Qi, A smoothing method for mathematical
/// programs with equilibrium constraints, Math. Program. 85 (1999), with the function of Kanzow, Some noninterior
/// continuation methods for linear complementarity problems, SIAM J. Matrix Anal. Appl. 17 (1996). (4) Lin, Fukushima,
/// A modified relaxation scheme for mathematical programs with complementarity constraints, Ann. Oper. Res. 133 (2005).
/// (5) Kadrani, Dussault, Benchakroun, A new regularization scheme for mathematical programs with complementarity
/// constraints, SIAM J. Optim. 20 (2009). (6) Steffensen, Ulbrich, A new relaxation scheme for mathematical programs
/// with equilibrium constraints, SIAM J. Optim. 20 (2010). (7), (8) Anitescu, Tseng, Wright, Elastic-mode algorithms
/// for mathematical programs with equilibrium constraints, Math. Program. 110 (2007). Compared in Hoheisel, Kanzow,
/// Schwartz, Theoretical and numerical comparison of relaxation methods for mathematical programs with complementarity
/// constraints, Math. Program. 137 (2013).
struct Relaxation {
  using Function = PairValue (*)(double G, double H, double sigma);
  /// lower <= c(G, H; sigma) <= upper; <= upper + s with an elastic variable.
  struct Constraint {
    Function c;
    double lower, upper;
  };

  std::string_view name;
  std::vector<Constraint> constraints = {};
  Function penalty = nullptr;         ///< term of the objective; null for none
  bool has_elastic_variable = false;  ///< s of (8)
  bool frees_bounds = false;          ///< (4), (5): G, H >= -sigma; for (4) this follows from its rows

  bool is_elastic() const { return penalty || has_elastic_variable; }
};

/// All relaxations, (1) to (8).
const std::vector<Relaxation>& relaxations();

/// @throws InputError for an unknown name, with the known ones
const Relaxation& find_relaxation(std::string_view name);

/// An `Mpcc` with every pair relaxed. The variables and rows of the Mpcc come first, in its numbering.
class RelaxedMpcc {
 public:
  /// @param mpcc  must outlive this
  RelaxedMpcc(const Mpcc& mpcc, const Relaxation& relaxation, double sigma);

  const Nlp& nlp() const { return nlp_; }

  /// Changes values and bounds, not the structure.
  void set_sigma(double sigma);
  /// Takes over bounds and guesses of the Mpcc, which may have changed.
  void update();

 private:
  const Mpcc& mpcc_;
  const Relaxation& relaxation_;
  std::unique_ptr<double> sigma_;  // the blocks point to it
  Nlp nlp_;
};

/// The same program, whose blocks remain those of `nlp`, with bounds and rows of its own.
/// @param nlp  must outlive the result
Nlp borrow(const Nlp& nlp);
/// Bounds and guesses of `from` for a program that began as borrow(from).
void copy_bounds(const Nlp& from, Nlp& to);

}  // namespace ricochet
