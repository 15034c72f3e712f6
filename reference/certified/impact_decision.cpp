#include <arb_mat.h>

#include <array>
#include <optional>

#include "reference/certified/decisions.h"

namespace ricochet::reference::certified {
namespace {

/// Solves A X = B. @returns nothing if A may be singular
std::optional<std::vector<std::vector<Ball>>> solve(const std::vector<std::vector<Ball>>& A,
                                                    const std::vector<std::vector<Ball>>& B, slong bits) {
  const auto n = static_cast<slong>(A.size()), m = static_cast<slong>(B.front().size());
  arb_mat_t a, b, x;
  arb_mat_init(a, n, n);
  arb_mat_init(b, n, m);
  arb_mat_init(x, n, m);
  for (slong i = 0; i < n; ++i) {
    for (slong k = 0; k < n; ++k) arb_set(arb_mat_entry(a, i, k), A[i][k].get());
    for (slong k = 0; k < m; ++k) arb_set(arb_mat_entry(b, i, k), B[i][k].get());
  }
  std::optional<std::vector<std::vector<Ball>>> result;
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

/// Contacts of an impact with their values at the state.
struct Strike {
  int contact;
  bool is_closed;  ///< before the impact, with w- = 0
  Ball w, v_t;     ///< w- and v_t-
  std::vector<Ball> J_n, J_t;
};

/// Unknown impulse of the linear system.
struct Impulse {
  std::size_t strike;
  bool is_tangential;
};

/// One combination of an impact, M v+ - sum c Lambda = M v-, J' v+ given.
class ImpactSystem {
 public:
  ImpactSystem(const SceneFormulas& scene, const Precision& a, const std::vector<std::vector<Ball>>& M,
               const std::vector<Ball>& v, const std::vector<Strike>& strikes, const Combinations& modes)
      : scene_(scene), a_(a), v_(v), strikes_(strikes), modes_(modes) {
    const std::size_t n = v.size();
    for (std::size_t k = 0; k < strikes.size(); ++k) {
      if (modes[k] == Mode::open) continue;
      impulses_.push_back({k, false});
      if (modes[k] == Mode::stick) impulses_.push_back({k, true});
    }
    const std::size_t size = n + impulses_.size();
    A_.assign(size, std::vector<Ball>(size));
    B_.assign(size, std::vector<Ball>(1));
    for (std::size_t r = 0; r < n; ++r) {
      for (std::size_t c = 0; c < n; ++c) {
        A_[r][c] = M[r][c];
        B_[r][0] = a.add(B_[r][0], a.mul(M[r][c], v[c]));
      }
    }
    for (std::size_t j = 0; j < impulses_.size(); ++j) add(j);
  }

  /// Whether inequalities (2) hold. @param outcome  velocities and impulses, if the system is regular
  Sign check(ImpactOutcome& outcome) const {
    const auto solution = solve(A_, B_, a_.bits);
    if (!solution) return check_redundant();
    const std::size_t n = v_.size();
    outcome.velocity.clear();
    for (std::size_t r = 0; r < n; ++r) outcome.velocity.push_back((*solution)[r][0]);
    outcome.Lambda_n.assign(static_cast<std::size_t>(scene_.n_c()), Ball());
    std::vector<Ball> Lambda_t(strikes_.size());
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      const Ball& impulse = (*solution)[n + j][0];
      const std::size_t k = impulses_[j].strike;
      (impulses_[j].is_tangential ? Lambda_t[k] : outcome.Lambda_n[strikes_[k].contact]) = impulse;
    }
    std::vector<Sign> signs;
    for (std::size_t k = 0; k < strikes_.size(); ++k) check_strike(k, outcome, Lambda_t[k], signs);
    return all_of(signs);
  }

 private:
  const ContactFormulas& contact(std::size_t k) const { return scene_.contacts[strikes_[k].contact]; }

  void add(std::size_t j) {
    const std::size_t n = v_.size(), k = impulses_[j].strike;
    const Strike& s = strikes_[k];
    const bool tangential = impulses_[j].is_tangential;
    const std::vector<Ball>& row = tangential ? s.J_t : s.J_n;
    Ball rate = tangential ? s.v_t : s.w;  // w - J' v is the part that does not depend on v
    for (std::size_t r = 0; r < n; ++r) {
      A_[n + j][r] = row[r];
      Ball column = row[r];
      if (!tangential && modes_[k] == Mode::slip_plus) column = a_.sub(column, a_.mul(contact(k).mu, s.J_t[r]));
      if (!tangential && modes_[k] == Mode::slip_minus) column = a_.add(column, a_.mul(contact(k).mu, s.J_t[r]));
      A_[r][n + j] = -column;
      rate = a_.sub(rate, a_.mul(row[r], v_[r]));
    }
    const bool rebounds = !tangential && !s.is_closed && !contact(k).is_bilateral;
    B_[n + j][0] = rebounds ? a_.sub(-a_.mul(contact(k).eps_r, s.w), rate) : -rate;
  }

  void check_strike(std::size_t k, const ImpactOutcome& outcome, const Ball& Lambda_t, std::vector<Sign>& signs) const {
    const Strike& s = strikes_[k];
    const ContactFormulas& c = contact(k);
    const Ball& Lambda_n = outcome.Lambda_n[s.contact];
    Ball change_n, change_t;
    for (std::size_t r = 0; r < v_.size(); ++r) {
      const Ball jump = a_.sub(outcome.velocity[r], v_[r]);
      change_n = a_.add(change_n, a_.mul(s.J_n[r], jump));
      if (!s.J_t.empty()) change_t = a_.add(change_t, a_.mul(s.J_t[r], jump));
    }
    if (modes_[k] == Mode::open) {
      const Ball before = s.is_closed ? Ball() : s.w;
      signs.push_back(a_.add(a_.add(change_n, before), a_.mul(c.eps_r, before)).sign());
      return;
    }
    if (!c.is_bilateral) signs.push_back(Lambda_n.sign());
    const Ball v_t = a_.add(s.v_t, change_t);
    if (modes_[k] == Mode::slip_plus) signs.push_back(v_t.sign());
    if (modes_[k] == Mode::slip_minus) signs.push_back((-v_t).sign());
    if (modes_[k] != Mode::stick) return;
    const Ball bound = a_.mul(c.mu, Lambda_n);
    signs.push_back(a_.sub(bound, Lambda_t).sign());
    signs.push_back(a_.add(bound, Lambda_t).sign());
  }

  /// Redundant rows: the last sticking row is left out and its impulse z becomes a parameter, |z| <= mu Lambda_n. This
  /// contains all solutions of the combination. It is refuted if some Lambda_n < 0 for all z.
  Sign check_redundant() const {
    const std::size_t n = v_.size();
    std::size_t left_out = impulses_.size();
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      if (impulses_[j].is_tangential) left_out = j;
    }
    if (left_out == impulses_.size()) return Sign::unknown;
    std::vector<std::vector<Ball>> A, B;
    for (std::size_t r = 0; r < A_.size(); ++r) {
      if (r == n + left_out) continue;
      A.emplace_back();
      for (std::size_t c = 0; c < A_.size(); ++c) {
        if (c != n + left_out) A.back().push_back(A_[r][c]);
      }
      B.push_back({B_[r][0], -A_[r][n + left_out]});
    }
    const auto solution = solve(A, B, a_.bits);
    if (!solution) return Sign::unknown;
    const auto normal = [&](std::size_t j) -> const std::vector<Ball>& {
      return (*solution)[n + j - (j > left_out ? 1 : 0)];
    };
    const Ball& mu = contact(impulses_[left_out].strike).mu;
    const std::vector<Ball>& own = normal(left_out - 1);  // normal impulse of the same contact: y0 + y1 z
    Ball y0, y1;
    arb_abs(y0.get(), own[0].get());
    arb_abs(y1.get(), own[1].get());
    const Ball room = a_.sub(Ball(1.0), a_.mul(mu, y1));
    if (room.sign() != Sign::positive) return Sign::unknown;
    Ball z;  // |z| <= mu (|y0| + |y1| |z|)
    z.widen(Magnitude(a_.div(a_.mul(mu, y0), room)).get());
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      if (impulses_[j].is_tangential || contact(impulses_[j].strike).is_bilateral) continue;
      if (a_.add(normal(j)[0], a_.mul(normal(j)[1], z)).sign() == Sign::negative) return Sign::negative;
    }
    return Sign::unknown;
  }

  const SceneFormulas& scene_;
  const Precision& a_;
  const std::vector<Ball>& v_;
  const std::vector<Strike>& strikes_;
  const Combinations& modes_;
  std::vector<Impulse> impulses_;
  std::vector<std::vector<Ball>> A_, B_;
};

}  // namespace

ImpactOutcome Decisions::decide_impact(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                                       const std::vector<char>& closed) {
  step_.load(x, t);
  const auto values = [&](const std::vector<Node>& nodes) {
    std::vector<Ball> list;
    for (const Node node : nodes) list.push_back(p_.value_of(node));
    return list;
  };
  std::vector<std::vector<Ball>> M;
  for (const auto& row : scene_.M) M.push_back(values(row));
  const std::vector<Ball> v(x.begin() + scene_.n, x.end());
  std::vector<Strike> strikes;
  std::vector<std::vector<Mode>> options;
  for (const int i : candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    if (contact.n_t() == 2) throw Unsupported("impact with friction in space of " + contact.name);
    const bool planar = contact.n_t() == 1;
    strikes.push_back({i, closed[i] != 0, p_.value_of(contact.v_n), planar ? p_.value_of(contact.v_t[0]) : Ball(),
                       values(contact.J_n), planar ? values(contact.J_t[0]) : std::vector<Ball>()});
    options.emplace_back();
    if (!contact.is_bilateral) options.back().push_back(Mode::open);
    if (planar)
      options.back().insert(options.back().end(), {Mode::stick, Mode::slip_plus, Mode::slip_minus});
    else
      options.back().push_back(Mode::closed);
  }
  Combinations combination(std::move(options));
  Verdict verdict;
  ImpactOutcome best;
  do {
    limit_.check();
    ImpactOutcome outcome;
    const Sign sign = ImpactSystem(scene_, p_.precision(), M, v, strikes, combination).check(outcome);
    if (!verdict.add(sign, names(candidates, combination))) continue;
    for (std::size_t k = 0; k < candidates.size(); ++k) outcome.modes.push_back(combination[k]);
    best = std::move(outcome);
  } while (combination.next());
  verdict.require_one("impact");
  return best;
}

}  // namespace ricochet::reference::certified
