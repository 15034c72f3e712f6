#include <algorithm>
#include <array>
#include <optional>

#include "reference/certified/ball_matrix.h"
#include "reference/certified/decisions.h"
#include "reference/certified/friction_in_space.h"

namespace ricochet::reference::certified {
namespace {

/// Contacts of an impact with their values at the state.
struct Strike {
  int contact;
  bool is_closed;         ///< before the impact, with w- = 0
  Ball w;                 ///< w-
  std::vector<Ball> v_t;  ///< v_t-, n_t
  std::vector<Ball> J_n;
  BallMatrix J_t;  ///< n_t rows
};

/// Unknown impulse of the linear system.
struct Impulse {
  std::size_t strike;
  bool is_tangential;
};

/// One combination of an impact, M v+ - sum c Lambda = M v-, J' v+ given. The impulse of a contact in space is a
/// parameter of the solution, which Coulomb's law decides then.
class ImpactSystem {
 public:
  ImpactSystem(const SceneFormulas& scene, const Precision& a, const BallMatrix& M, const std::vector<Ball>& v,
               const std::vector<Strike>& strikes, const Combinations& modes)
      : scene_(scene), a_(a), v_(v), strikes_(strikes), modes_(modes) {
    const std::size_t n = v.size();
    for (std::size_t k = 0; k < strikes.size(); ++k) {
      if (strikes[k].J_t.size() == 2) in_space_ = k;
      if (modes[k] == Mode::open || in_space_ == k) continue;
      impulses_.push_back({k, false});
      if (modes[k] == Mode::stick) impulses_.push_back({k, true});
    }
    const std::size_t size = n + impulses_.size();
    A_.assign(size, std::vector<Ball>(size));
    B_.assign(size, std::vector<Ball>(in_space_ ? 4 : 1));
    for (std::size_t r = 0; r < n; ++r) {
      for (std::size_t c = 0; c < n; ++c) {
        A_[r][c] = M[r][c];
        B_[r][0] = a.add(B_[r][0], a.mul(M[r][c], v[c]));
      }
      for (int j = 0; in_space_ && j < 3; ++j) B_[r][1 + j] = row_in_space(j)[r];
    }
    for (std::size_t j = 0; j < impulses_.size(); ++j) add(j);
  }

  /// Whether inequalities (2) hold. @param outcome  velocities and impulses, if the system is regular
  Sign check(ImpactOutcome& outcome) const {
    auto solution = solve(A_, B_, a_.bits);
    if (!solution) return in_space_ ? Sign::unknown : check_redundant();
    const std::size_t n = v_.size();
    std::array<Ball, 3> force;
    if (in_space_ && modes_[*in_space_] != Mode::open) {
      const Sign sign = decide_force(*solution, force);
      if (sign != Sign::positive) return sign;
      for (auto& row : *solution) {
        for (int j = 0; j < 3; ++j) row[0] = a_.add(row[0], a_.mul(row[1 + j], force[j]));
      }
    }
    outcome.velocity.clear();
    for (std::size_t r = 0; r < n; ++r) outcome.velocity.push_back((*solution)[r][0]);
    outcome.Lambda_n.assign(static_cast<std::size_t>(scene_.n_c()), Ball());
    if (in_space_) outcome.Lambda_n[strikes_[*in_space_].contact] = force[0];
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

  /// J_n or J_t of the contact in space.
  const std::vector<Ball>& row_in_space(int j) const {
    const Strike& s = strikes_[*in_space_];
    return j == 0 ? s.J_n : s.J_t[j - 1];
  }

  /// Stick or slip of the contact in space, from the velocities without its impulse and with unit impulses.
  Sign decide_force(const BallMatrix& solution, std::array<Ball, 3>& force) const {
    const Strike& s = strikes_[*in_space_];
    ContactInSpace law;
    law.mu = contact(*in_space_).mu;
    law.r = {s.w, s.v_t[0], s.v_t[1]};
    if (!s.is_closed) law.r[0] = a_.add(s.w, a_.mul(contact(*in_space_).eps_r, s.w));
    for (int i = 0; i < 3; ++i) {
      for (std::size_t r = 0; r < v_.size(); ++r) {
        const Ball& along = row_in_space(i)[r];
        law.r[i] = a_.add(law.r[i], a_.mul(along, a_.sub(solution[r][0], v_[r])));
        for (int j = 0; j < 3; ++j) law.G[i][j] = a_.add(law.G[i][j], a_.mul(along, solution[r][1 + j]));
      }
    }
    if (modes_[*in_space_] == Mode::stick) {
      const auto sticking = sticking_force(law, a_);
      if (!sticking) return Sign::unknown;
      force = *sticking;
      return is_inside_cone(force, law.mu, a_);
    }
    const SlipDirections directions = slip_directions(law, a_);
    if (!directions.is_complete || directions.n_proven > 1) return Sign::unknown;
    force = directions.force;
    return directions.n_proven == 1 ? Sign::positive : Sign::negative;
  }

  void add(std::size_t j) {
    const std::size_t n = v_.size(), k = impulses_[j].strike;
    const Strike& s = strikes_[k];
    const bool tangential = impulses_[j].is_tangential;
    const std::vector<Ball>& row = tangential ? s.J_t[0] : s.J_n;
    Ball rate = tangential ? s.v_t[0] : s.w;  // w - J' v is the part that does not depend on v
    for (std::size_t r = 0; r < n; ++r) {
      A_[n + j][r] = row[r];
      Ball column = row[r];
      if (!tangential && modes_[k] == Mode::slip_plus) column = a_.sub(column, a_.mul(contact(k).mu, s.J_t[0][r]));
      if (!tangential && modes_[k] == Mode::slip_minus) column = a_.add(column, a_.mul(contact(k).mu, s.J_t[0][r]));
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
      if (s.J_t.size() == 1) change_t = a_.add(change_t, a_.mul(s.J_t[0][r], jump));
    }
    if (modes_[k] == Mode::open) {
      const Ball before = s.is_closed ? Ball() : s.w;
      signs.push_back(a_.add(a_.add(change_n, before), a_.mul(c.eps_r, before)).sign());
      return;
    }
    if (!c.is_bilateral) signs.push_back(Lambda_n.sign());
    if (s.J_t.size() != 1) return;
    const Ball v_t = a_.add(s.v_t[0], change_t);
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
    BallMatrix A, B;
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
  std::optional<std::size_t> in_space_;  ///< strike with two tangents
  std::vector<Impulse> impulses_;
  BallMatrix A_, B_;
};

/// Modes that a contact may have in an impact.
std::vector<Mode> impact_options(const ContactFormulas& contact) {
  std::vector<Mode> options;
  if (!contact.is_bilateral) options.push_back(Mode::open);
  if (contact.n_t() == 0) options.push_back(Mode::closed);
  if (contact.n_t() > 0) options.push_back(Mode::stick);
  if (contact.n_t() == 1) options.insert(options.end(), {Mode::slip_plus, Mode::slip_minus});
  if (contact.n_t() == 2) options.push_back(Mode::slip);
  return options;
}

/// @throws Unsupported for more than one contact in space
void require_one_in_space(const SceneFormulas& scene, const std::vector<int>& candidates) {
  int n_in_space = 0;
  for (const int i : candidates) {
    const ContactFormulas& contact = scene.contacts[i];
    if (contact.n_t() < 2) continue;
    if (contact.is_bilateral) throw Unsupported("impact of a joint with friction in space: " + contact.name);
    if (++n_in_space > 1)
      throw Unsupported("impact of several coupled contacts with friction in space, one of them " + contact.name);
  }
}

}  // namespace

ImpactOutcome Decisions::decide_impact(const std::vector<Ball>& x, const Ball& t, const std::vector<int>& candidates,
                                       const std::vector<char>& closed) {
  require_one_in_space(scene_, candidates);
  step_.load(x, t);
  const auto values = [&](const std::vector<Node>& nodes) {
    std::vector<Ball> list;
    for (const Node node : nodes) list.push_back(p_.value_of(node));
    return list;
  };
  const auto rows = [&](const std::vector<std::vector<Node>>& nodes) {
    BallMatrix matrix;
    for (const auto& row : nodes) matrix.push_back(values(row));
    return matrix;
  };
  const BallMatrix M = rows(scene_.M);
  const std::vector<Ball> v(x.begin() + scene_.n, x.end());
  std::vector<Strike> strikes;
  std::vector<std::vector<Mode>> options;
  for (const int i : candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    strikes.push_back(
        {i, closed[i] != 0, p_.value_of(contact.v_n), values(contact.v_t), values(contact.J_n), rows(contact.J_t)});
    options.push_back(impact_options(contact));
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
