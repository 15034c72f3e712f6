#pragma once

#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "reference/certified/ball.h"

/// @file
/// SeriesProgram: formulas as a straight-line program over Taylor series with proven remainders.

namespace ricochet::reference::certified {

/// Index of a formula in a SeriesProgram. Operands have smaller indices.
using Node = int;

/// A growing straight-line program. Equal operations are one node; operations on constants are folded into balls.
///
/// On a step 0 <= t <= h every node is a function with the Taylor coefficients c_k at t = 0 and a relative remainder:
///
///     f(t) = sum_{k<=N} c_k t^k + r(t),   |r(t)| <= rho (t/h)^(N+1)                                             (1)
///
/// Coefficients are computed order by order by recurrences, O(k) each; with a' b = x' for the last:
///
///     c = a b:            c_k = sum_{i<=k} a_i b_{k-i}                                                          (2)
///     c = a / b:          c_k = (a_k - sum_{i<k} c_i b_{k-i}) / b_0                                             (3)
///     c = sqrt(a):        c_k = (a_k - sum_{0<i<k} c_i c_{k-i}) / (2 c_0)                                       (4)
///     s, c = sin a, cos a:  k s_k = sum_{i=1}^k i a_i c_{k-i},   k c_k = -sum_{i=1}^k i a_i s_{k-i}             (5)
///     c = exp(a):         k c_k = sum_{i=1}^k i a_i c_{k-i}                                                     (6)
///     c = log(a), atan(a), asin(a), with w = a, 1 + a^2, sqrt(1 - a^2) and c' w = a':
///                         k c_k = (k a_k - sum_{i=1}^{k-1} i c_i w_{k-i}) / w_0                                 (7)
///
/// The rules of remainders are those of remainder(). If the c_k are balls, (1) holds for every initial state of a box,
/// with coefficients in these balls.
class SeriesProgram {
 public:
  explicit SeriesProgram(const Precision& precision) : precision_(precision), degree_(precision.order) {}

  // Construction of formulas.
  Node constant(const Ball& value);                                  ///< A number.
  Node number(long value);                                           ///< A whole number, exactly.
  Node state();                                                      ///< A variable with coefficients of its own.
  Node add(Node a, Node b);                                          ///< a + b
  Node sub(Node a, Node b);                                          ///< a - b
  Node mul(Node a, Node b);                                          ///< a b
  Node div(Node a, Node b);                                          ///< a / b
  Node neg(Node a);                                                  ///< -a
  Node sqrt(Node a);                                                 ///< for a > 0
  Node sin(Node a);                                                  ///< sin(a)
  Node cos(Node a);                                                  ///< cos(a)
  Node exp(Node a);                                                  ///< exp(a)
  Node log(Node a);                                                  ///< for a > 0
  Node atan(Node a);                                                 ///< arc tangent
  Node asin(Node a);                                                 ///< for |a| < 1
  Node dot(const std::vector<Node>& a, const std::vector<Node>& b);  ///< sum_i a_i b_i
  /// The partial derivative of f with respect to the variable x.
  Node derivative(Node f, Node x);

  bool is_constant(Node a) const { return nodes_[a].op == Op::constant; }  ///< A number.
  bool is_zero(Node a) const;                                              ///< The number zero, exactly.
  int size() const { return static_cast<int>(nodes_.size()); }             ///< Nodes.
  /// `outputs` and everything that they depend on, ascending.
  std::vector<Node> schedule(const std::vector<Node>& outputs) const;

  // Coefficients.
  const Precision& precision() const { return precision_; }  ///< Of everything without one of its own.
  /// Forgets all values but those of constants. Call it before the variables change.
  void forget() { ++epoch_; }
  /// Coefficient k of a variable.
  void set(Node variable, int k, arb_srcptr value);
  /// Value at t = 0, from the variables' coefficients 0.
  arb_srcptr value(Node a);
  /// The same as a ball.
  Ball value_of(Node a) { return Ball(value(a)); }
  /// The same of several nodes.
  std::vector<Ball> values_of(const std::vector<Node>& nodes);
  /// The same of rows of nodes.
  std::vector<std::vector<Ball>> values_of(const std::vector<std::vector<Node>>& rows);
  /// Computes coefficient k; those of lower order, and of the operands, must be there.
  void compute(Node a, int k, slong bits);
  /// The first k, from `first` to `last`, whose coefficient is not exactly zero; last + 1 if there is none.
  int leading(Node a, int first, int last) const;
  /// Coefficient k, if it was computed.
  arb_srcptr coefficient(Node a, int k) const { return nodes_[a].c.at(k); }

  // Remainders on 0 <= t <= h.
  /// The degree N of the polynomials in (1): the order of the precision, or less, until it is changed again.
  void set_degree(int degree) { degree_ = degree; }
  int degree() const { return degree_; }  ///< N
  /// Magnitudes of the coefficients c_k h^k of the scheduled nodes, up to order N.
  void measure(const std::vector<Node>& schedule, double h);
  /// Lowers the degree to D < N. The terms of the scheduled nodes, which are measured, from D + 1 on belong to the
  /// remainders then: |sum_{D<k<=N} c_k t^k| <= sum_{D<k<=N} |c_k| h^k (t/h)^(D+1).
  void lower_degree(const std::vector<Node>& schedule, int degree);
  /// The bound rho in (1) of a node from those of its operands. @returns false if there is none: a divisor may be zero
  bool remainder(Node a);
  mag_ptr rho(Node a) { return nodes_[a].rho.get(); }                           ///< Bound of the remainder (1).
  mag_srcptr rho(Node a) const { return nodes_[a].rho.get(); }                  ///< The same.
  mag_srcptr size_of(Node a, int k) const { return nodes_[a].alpha[k].get(); }  ///< |c_k| h^k

 private:
  enum class Op { constant, state, add, sub, mul, div, neg, sqrt, sin, cos, exp, log, atan, asin };

  /// Balls in one array, which grows.
  class Coefficients {
   public:
    Coefficients() = default;
    Coefficients(Coefficients&& o) noexcept : data_(std::exchange(o.data_, nullptr)), n_(std::exchange(o.n_, 0)) {}
    Coefficients& operator=(Coefficients&& o) noexcept {
      std::swap(data_, o.data_);
      std::swap(n_, o.n_);
      return *this;
    }
    ~Coefficients() { clear(); }
    void reserve(int n);
    arb_ptr at(int k) const { return data_ + k; }
    bool empty() const { return n_ == 0; }

   private:
    void clear();
    arb_ptr data_ = nullptr;
    int n_ = 0;
  };

  struct Entry {
    Op op = Op::constant;
    Node a = -1, b = -1;            ///< operands; the pair of sin and cos; the w of (7)
    Coefficients c;                 ///< c_k
    Coefficients slopes;            ///< k a_k of sin and exp, k c_k of (7)
    long epoch = -1;                ///< of c_0
    std::vector<Magnitude> alpha;   ///< |c_k| h^k
    std::vector<Magnitude> suffix;  ///< sum_{i>=k} alpha_i
    Magnitude rho;
  };

  static bool is_inverse(Op op) { return op == Op::log || op == Op::atan || op == Op::asin; }
  Node append(Op op, Node a, Node b);
  Node make(Op op, Node a, Node b = -1);
  Node fold(Op op, Node a, Node b);
  Node pair_of_sine(Node a, bool cosine);
  bool is_one(Node a) const;
  Node differentiate(Node f, Node x);
  void start(Entry& x, slong bits);
  void advance(Entry& x, int k, slong bits);
  void advance_transcendental(Entry& x, int k, slong bits);

  // series_remainder.cpp
  void tail(Magnitude& r, const Entry& a, const Entry& b) const;
  bool lower_bound(Magnitude& r, const Entry& a) const;
  bool remainder_of_quotient(Entry& x);
  bool remainder_of_root(Entry& x);
  bool remainder_of_function(Entry& x);
  bool slope_bound(Magnitude& r, const Entry& x) const;
  bool disc_bound(Magnitude& r, Op op, const Entry& a, const Magnitude& U) const;
  bool cauchy(Magnitude& r, Op op, const Entry& a) const;

  Precision precision_;
  int degree_;
  std::vector<Entry> nodes_;
  std::map<std::tuple<Op, Node, Node>, Node> known_;
  std::map<std::pair<Node, Node>, Node> derivatives_;
  long epoch_ = 0;
};

}  // namespace ricochet::reference::certified
