#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "methods/elements/stage_equations.h"
#include "methods/linear_algebra/band_lu.h"
#include "methods/linear_algebra/small_lu.h"
#include "problems/disjoint_sets.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// The linear systems of Newton's method on the stage equations,
///
///   K dx = -r,   K = d(3, 4, 7) / d(w_1, lambda_1, ..., w_s, lambda_s)                                   (1)
///
/// by *islands*: the connected components of coordinates that M, the derivatives of forces or a closed contact couple.
/// (1) splits into one system per island, each with its own factors. A switch therefore costs new factors only for the
/// islands of that contact. If neither M nor f_v nor the contacts of an island vary, its matrix depends neither on the
/// state nor on h: rows (4) are divided by h^2 and rows (7a) by h. Its factors then stay valid.
///
/// A small island keeps its inverse if that stays valid: it is used many times, and residuals correct its rounding. A
/// large one is numbered along its breadth-first levels, all stages of a coordinate together and each contact between
/// its bodies; then K is a band matrix (band_lu.h), and a row of n bodies costs time in proportion to n. A system with
/// few unknowns is one island, whatever it couples.
///
/// Contacts that are redundant in an island make it dense, see redundant_system.h.
class NewtonSystem {
 public:
  NewtonSystem(const Problem& problem, int n_s, Counters& counters);

  /// Another active set: finds the islands. @param n_rows  unknown forces per stage
  void set_active(std::span<const ActiveContact> closed, int n_rows);

  /// Discards the factors of all active sets; their storage stays.
  void forget_factors();
  /// Takes the factors that were kept for this length and active set. False when some are missing.
  bool recall(double h);
  /// Factorises where recall() found nothing, and wherever the matrix may have changed since.
  /// @return false when a matrix is not regular, not even as that of redundant contacts
  bool factorize(const StageCoefficients& k, const StageDerivatives& derivatives);
  /// dx = -K^-1 r by the factors of recall() and factorize(); see redundant_system.h for redundant contacts.
  /// @param x  the forces among the unknowns, read only if is_redundant()
  void solve(const Vector& r, const Vector& x, Vector& dx);
  bool is_constant() const;                            ///< the factors of every island stay valid
  bool is_redundant() const { return is_redundant_; }  ///< some contacts are redundant, by the last factors

  /// response = -K^-1 rhs, two columns, with K of this instant; nothing of it is kept, unless it stays valid.
  /// @param x  as of solve(), counts for the first column
  void solve_once(const StageCoefficients& k, const StageDerivatives& derivatives, const Matrix& rhs, const Vector& x,
                  Matrix& response);

 private:
  struct Factor {
    double h = 0;
    std::vector<int> key;  // of the island
    int n_coordinates = 0;
    bool is_valid = false, is_banded = false;
    BandLu band;
    Matrix K;
    SmallLu lu;
    Matrix negative_inverse;     // where it is kept: it holds for ever, or the contacts are redundant
    Matrix to_smallest;          // RedundantSystem (2); empty when the contacts are not redundant
    std::uint64_t last_use = 0;  // 0: free
  };

  struct Island {
    std::vector<int> coordinates;  // ascending
    std::vector<int> contacts;     // in the list of closed ones
    std::vector<int> key;          // contact, mode and facet of each
    int n_rows = 0;
    bool is_whole = false;     // all unknowns, in the order of the whole system
    bool is_constant = false;  // the matrix holds for ever
    // Unknown number m at stage j has position m * number_step + j * stage_step, and stands in the whole system at
    // unknowns[position].
    int number_step = 1, stage_step = 1;
    std::vector<int> unknowns;
    bool is_banded = false;
    int lower = 0, upper = 0;                  // diagonals
    std::vector<std::pair<int, int>> couples;  // coordinates with an entry in (3), when the island has levels
    Factor* factor = nullptr;

    int n() const { return static_cast<int>(unknowns.size()); }
    int position(int number, int stage) const { return number * number_step + stage * stage_step; }
  };

  void make_room();
  void find_islands();
  void set_members();
  void number_by_stage(Island& island);
  void number_along_levels(Island& island);
  void order_by_levels(const Island& island, int first);
  void set_unknowns(Island& island, int coordinate_step, int stage_step);
  Factor& factor_for(const Island& island, double h);
  void assemble(const Island& island, const StageCoefficients& k, const StageDerivatives& derivatives,
                auto&& add) const;
  bool factorize(const Island& island, const StageCoefficients& k, const StageDerivatives& derivatives,
                 Factor& factor) const;
  std::vector<int> force_positions(const Island& island) const;

  const Problem& problem_;
  Counters& counters_;
  const int n_q_, n_s_;
  const bool constant_dynamics_;  // M and f_v + B_u u are constant
  std::span<const ActiveContact> closed_;
  int n_x_ = 0;

  std::size_t n_islands_ = 0;  // of the list, which keeps its storage
  std::vector<Island> islands_;
  DisjointSets coordinate_sets_;                     // of coordinates: one per island
  std::vector<int> island_of_;                       // per coordinate
  std::vector<std::vector<int>> coupled_;            // per coordinate: those of ProblemInfo::Structure::couplings
  std::vector<std::vector<int>> contacts_of_;        // per coordinate: the closed contacts, in their list
  std::vector<int> coordinate_number_, row_number_;  // of a coordinate, and a row of (4), (7), within its island
  std::vector<int> order_, place_;                   // along the levels: coordinates, and where they stand there

  std::vector<std::vector<Factor>> factors_;  // kept; index: smallest coordinate of the island
  std::vector<Factor> scratch_;               // of solve_once(), with the same index
  std::uint64_t clock_ = 0;
  double recalled_h_ = 0;  // of the factors that the islands point to; 0 when they are of another active set
  bool is_known_ = false;  // all of these factors are there
  bool is_redundant_ = false;
  std::vector<double> local_, result_;
};

}  // namespace ricochet
