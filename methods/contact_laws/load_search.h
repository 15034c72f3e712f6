#pragma once

#include <span>
#include <vector>

#include "methods/contact_laws/switch_kind.h"
#include "methods/contact_laws/wide_box.h"
#include "problems/force_bounds.h"
#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet {

/// Finds the first s on a polynomial path (q, v)(s), 0 <= s <= 1, at which a closed contact would leave its mode, or
/// proves that there is none. The functions of a contact that are positive in its mode,
///
///   force   lambda_n,   closed                                                                     (1)
///   cone    mu lambda_n - ||lambda_t||,   sticks                                                   (2)
///   slip    d' J_t' v - v_stop,   slips along d                                                    (3)
///
/// are bounded over pieces of the path. Its Bernstein coefficients span boxes of q and v: ForceBounds bounds (1) and
/// (2) over them; (3) is a polynomial if J_t is constant, else it is bounded by J_t(Q)' V. A function is clear in a
/// piece where its bounds are at least -slack. A piece in which one is not clear is halved, the left half first; where
/// a function is below -slack in the middle, the right half does not matter any more. Such a piece is halved until it
/// is 1/1024 of the one that showed the change of sign, and contains the zero. Other pieces shorter than 2^-20 are
/// decided by the values at their end, and so are pieces of 1/32 after 128 of them or where a box has no bounds. The
/// proof is for the path; the error control of a method bounds its distance from the motion.
///
/// Most functions are far from zero most of the time. So they are bounded over a WideBox around the path, forward in
/// time only; as long as later paths stay inside, functions that are positive there cost nothing.
///
/// If a function is zero at the beginning of the path, because the contact has just changed its mode, its error there
/// is a fraction of its value. It may therefore be negative by 1/100 of its value at s = 1/8 up to there, and
/// everywhere by twice its negative value at the beginning.
///
/// If a path is known up to an error, zero at both ends, slip is decided only where it is larger than the error.
///
/// A path may end at a zero that is known already: pieces next to it are halved down to 1/1024 and then attributed to
/// it.
class LoadSearch {
 public:
  struct Function {
    SwitchKind kind = SwitchKind::force_vanishes;  ///< or cone_reached or slip_stops
    int contact = -1;
    double slack = 0;                       ///< how far below zero it may be
    double error = 0;                       ///< of slip: of the path inside, and of none at its ends
    double direction[2]{0, 0}, v_stop = 0;  ///< of (3)
  };

  /// @param degree  of the paths
  LoadSearch(const Problem& problem, int degree);

  /// Sets the modes of the next paths, whose functions are listed next. Releases directions and discards earlier
  /// proofs.
  void set_modes(std::span<const ContactMode> modes);
  void hold_direction(int contact, const double* d);
  /// Whether (1) and (2) depend on time, not only on q and v of the bodies. Exact for a force that is affine in q and
  /// v; other forces count as dependent if the scene has a clock.
  bool depends_on_time() const;
  /// Whether the forces have bounds in these modes; those of redundant contacts have none.
  bool is_known_at(const double* q, const double* v);
  /// Whether a function of the list needs the whole path. Slip that is a polynomial needs v of its contact alone.
  bool needs_boxes() const;
  /// The functions of the closed contacts. Before a path all of their fields but kind and contact may be set anew.
  std::vector<Function>& functions() { return functions_; }

  /// 2 n_q x (degree + 1): Bernstein coefficients of q, and below them of v, of the next path.
  Matrix& path() { return path_; }

  /// A piece of a path at whose end functions are below -slack.
  struct Fall {
    double from = 0, to = 1;
    double duration = 1;  ///< for which they stay there, to a factor of two
    bool found = false;
    explicit operator bool() const { return found; }
  };
  /// To be called after path() has been filled. @return the first fall before s = `end`, a known zero unless it is 1
  Fall first_fall(double end = 1);
  /// After first_fall() has found none in a whole path: whether slip that is a polynomial is within its error of zero,
  /// before the end.
  bool is_near_zero();
  /// Whether a function of the list has fallen, where first_fall() has found one.
  bool has_fallen(std::size_t function) const { return has_fallen_[function] != 0; }
  /// The value of a function of the list at s of the path.
  double value(std::size_t function, double s);

 private:
  static constexpr int kDeepest = 20, kMaxPieces = 128, kSampledDepth = 5, kRootDepth = 10;

  struct Piece {
    double from, to;
    int depth;
    bool falls;  ///< a function is below -slack at its end
  };

  Fall search(double end);
  bool is_polynomial(const Function& f) const;
  double allowed(std::size_t function, double to) const;
  void allow_begin(const double* b, double end);
  double* coefficients(std::size_t piece) { return data_.data() + piece * piece_size_; }
  bool is_clear(const double* b, double to);
  void set_boxes(const double* b);
  void set_point(const double* b, double s);
  void begin_path();
  Interval bounds(const Function& f);
  /// Coefficients of a piece or of path(): of coordinate k at k * of_coordinate, of each degree at j * of_degree.
  struct Layout {
    std::ptrdiff_t of_coordinate, of_degree;
  };
  Interval slip_polynomial(const Function& f, const double* b, Layout layout) const;
  bool is_clear_at_once();
  bool falls_at(const double* b, double s, double to);
  void prove_wide_box();
  double duration(double from);

  const Problem& problem_;
  const ProblemInfo& info_;
  const int degree_;
  ForceBounds forces_;
  std::vector<Function> functions_;
  std::vector<char> has_fallen_, is_far_, is_skipped_;  // by function; far: positive in the wide box
  std::vector<double> clear_until_, lower_;             // by function; lower bound of a polynomial along the path
  std::vector<double> slack_, begin_slack_;             // by function: of the path, and up to s = 1/8
  bool force_uses_time_ = false;
  std::vector<int> turning_;  // contacts that slip and are curved
  Vector affine_J_t_;         // packed

  Matrix path_;
  std::size_t piece_size_ = 0;
  std::vector<double> data_;   // coefficients of the pieces that wait
  std::vector<Piece> pieces_;  // the next one last
  // Of what is looked at:
  std::vector<Interval> box_, path_box_;  // 2 n_q
  Vector middle_;
  std::vector<Interval> J_t_;  // packed
  bool has_forces_ = false, knows_forces_ = false, has_tangents_ = false;

  WideBox wide_box_;              // of q and v
  std::vector<int> coordinates_;  // 0 .. 2 n_q - 1
};

}  // namespace ricochet
