#include <algorithm>
#include <array>
#include <optional>

#include "reference/certified/ball_matrix.h"
#include "reference/certified/decisions.h"
#include "reference/certified/friction_in_space.h"
#include "reference/certified/redundant_rows.h"

namespace ricochet::reference::certified {
namespace {

/// Contacts of an impact with their values at the state.
struct Strike {
  int contact;
  bool is_closed;         ///< before the impact, with w- = 0
  Ball w;                 ///< w-
  std::vector<Ball> v_t;  ///< v_t-, n_t
  std::vector<Ball> J_n;
  BallMatrix J_t;             ///< n_t rows
  Ball drift_n;               ///< w where v = 0: df_c/dt
  std::vector<Ball> drift_t;  ///< v_t where v = 0, n_t
};

/// A combination that satisfies the law, or is not refuted.
struct ImpactAlternative {
  Sign sign = Sign::unknown;
  std::vector<Mode> modes;        ///< of the candidates
  std::vector<Mode> active;       ///< the same, with contacts whose impulses are exactly zero as open
  bool is_regular = false;        ///< the modes determine v+
  std::vector<int> at_rest;       ///< coordinates Z with v+ = 0 exactly
  std::vector<Mode> reaching;     ///< the modes of contacts that reach coordinates outside of Z, others as open
  bool has_one_velocity = false;  ///< Z and `reaching` determine v+
  ImpactOutcome outcome;
  std::string name;
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

  /// Whether inequalities (2) hold, strictly or with exactly zero. `alternative` gets the velocities and impulses; of
  /// redundant contacts, which satisfy (2) with many impulses, the hull of all.
  void check(ImpactAlternative& alternative) const {
    const std::vector<int> locked = in_space_ ? std::vector<int>() : locked_coordinates(kinematic_rows(), a_);
    auto solution = solve(A_, B_, a_.bits);
    if (!solution) {
      if (!in_space_) check_redundant(alternative, locked);
      return;
    }
    std::array<Ball, 3> force;
    if (in_space_ && modes_[*in_space_] != Mode::open) {
      alternative.sign = decide_force(*solution, force);
      if (alternative.sign != Sign::positive) return;
      for (auto& row : *solution) {
        for (int j = 0; j < 3; ++j) row[0] = a_.add(row[0], a_.mul(row[1 + j], force[j]));
      }
    }
    std::vector<Ball> y;
    for (auto& row : *solution) y.push_back(row[0]);
    alternative.is_regular = true;
    take(alternative, y, locked);
    if (in_space_) alternative.outcome.Lambda_n[strikes_[*in_space_].contact] = force[0];
    std::vector<Sign> signs;
    for (const LinearForm& form : inequalities()) {
      const Ball value = value_of(form, alternative.outcome.velocity, y);
      if (!value.is_zero()) signs.push_back(value.sign());
    }
    alternative.sign = all_of(signs);
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
    const Ball& rate = tangential ? s.drift_t[0] : s.drift_n;
    for (std::size_t r = 0; r < n; ++r) {
      A_[n + j][r] = row[r];
      Ball column = row[r];
      if (!tangential && modes_[k] == Mode::slip_plus) column = a_.sub(column, a_.mul(contact(k).mu, s.J_t[0][r]));
      if (!tangential && modes_[k] == Mode::slip_minus) column = a_.add(column, a_.mul(contact(k).mu, s.J_t[0][r]));
      A_[r][n + j] = -column;
    }
    B_[n + j][0] = !tangential && rebounds(k) ? a_.sub(-a_.mul(contact(k).eps_r, s.w), rate) : -rate;
  }

  bool rebounds(std::size_t k) const {
    return !strikes_[k].is_closed && !contact(k).is_bilateral && !contact(k).eps_r.is_zero();
  }

  /// Rows with J' v+ = 0 in this combination.
  BallMatrix kinematic_rows() const {
    BallMatrix rows;
    for (std::size_t k = 0; k < strikes_.size(); ++k) {
      const Strike& s = strikes_[k];
      if (modes_[k] != Mode::open && !rebounds(k) && s.drift_n.is_zero()) rows.push_back(s.J_n);
      if (modes_[k] == Mode::stick && s.drift_t[0].is_zero()) rows.push_back(s.J_t[0]);
    }
    return rows;
  }

  /// v+ and Lambda_n from a solution; locked velocities are zero.
  void take(ImpactAlternative& alternative, const std::vector<Ball>& y, const std::vector<int>& locked) const {
    const std::size_t n = v_.size();
    ImpactOutcome& outcome = alternative.outcome;
    outcome.velocity.assign(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(n));
    for (const int k : locked) outcome.velocity[k] = Ball();
    outcome.Lambda_n.assign(static_cast<std::size_t>(scene_.n_c()), Ball());
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      if (!impulses_[j].is_tangential) outcome.Lambda_n[strikes_[impulses_[j].strike].contact] = y[n + j];
    }
    set_rates(outcome);
    if (!in_space_) set_reaching(alternative, y);
  }

  /// Finds the equations that determine v+. Coordinates Z have v_Z = 0 exactly. The others, T, follow from the equations
  /// of T with the impulses of the contacts that reach T, except impulses that are exactly zero. If this system is
  /// regular, all combinations with the same Z and the same modes of these contacts have the same v+.
  void set_reaching(ImpactAlternative& alternative, const std::vector<Ball>& y) const {
    const std::size_t n = v_.size();
    std::vector<std::size_t> kept;  // rows and columns of T
    for (std::size_t r = 0; r < n; ++r) {
      if (alternative.outcome.velocity[r].is_zero())
        alternative.at_rest.push_back(static_cast<int>(r));
      else
        kept.push_back(r);
    }
    alternative.active.assign(strikes_.size(), Mode::open);
    alternative.reaching = alternative.active;
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      const std::size_t k = impulses_[j].strike;
      const bool reaches = leaves(strikes_[k].J_n, alternative.at_rest) ||
                           (!strikes_[k].J_t.empty() && leaves(strikes_[k].J_t[0], alternative.at_rest));
      if (has_no_impulse(k, y)) continue;
      alternative.active[k] = modes_[k];
      if (!reaches) continue;
      alternative.reaching[k] = modes_[k];
      kept.push_back(n + j);
    }
    BallMatrix A, B;
    for (const std::size_t r : kept) {
      A.emplace_back();
      for (const std::size_t c : kept) A.back().push_back(A_[r][c]);
      B.push_back({Ball()});
    }
    alternative.has_one_velocity = kept.empty() || solve(A, B, a_.bits);
  }

  bool has_no_impulse(std::size_t k, const std::vector<Ball>& y) const {
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      if (impulses_[j].strike == k && !y[v_.size() + j].is_zero()) return false;
    }
    return true;
  }

  /// A form of v+ and impulses, with the velocities that are known best.
  Ball value_of(const LinearForm& form, const std::vector<Ball>& velocity, const std::vector<Ball>& y) const {
    Ball sum = form.constant;
    for (std::size_t k = 0; k < y.size(); ++k)
      sum = a_.add(sum, a_.mul(form.along[k], k < velocity.size() ? velocity[k] : y[k]));
    return sum;
  }

  LinearForm form_of_rate(const std::vector<Ball>& J, const Ball& constant) const {
    LinearForm form{J, constant};
    form.along.resize(A_.size());
    return form;
  }

  /// Inequalities (2) of all contacts but that in space.
  std::vector<LinearForm> inequalities() const {
    const std::size_t n = v_.size();
    std::vector<LinearForm> forms;
    for (std::size_t k = 0; k < strikes_.size(); ++k) {
      const Strike& s = strikes_[k];
      if (modes_[k] == Mode::open) {  // w+ + eps_r w- >= 0
        forms.push_back(
            form_of_rate(s.J_n, s.is_closed ? s.drift_n : a_.add(s.drift_n, a_.mul(contact(k).eps_r, s.w))));
      }
      if (s.J_t.size() == 1 && (modes_[k] == Mode::slip_plus || modes_[k] == Mode::slip_minus)) {
        forms.push_back(form_of_rate(s.J_t[0], s.drift_t[0]));
        if (modes_[k] == Mode::slip_minus) forms.back() = opposite(forms.back());
      }
    }
    for (std::size_t j = 0; j < impulses_.size(); ++j) {
      const std::size_t k = impulses_[j].strike;
      LinearForm form{std::vector<Ball>(A_.size()), {}};
      if (!impulses_[j].is_tangential) {
        if (contact(k).is_bilateral) continue;
        form.along[n + j] = Ball(1.0);
        forms.push_back(form);
      } else {  // mu Lambda_n -+ Lambda_t >= 0; the normal impulse stands before
        form.along[n + j - 1] = contact(k).mu;
        for (const double side : {1.0, -1.0}) {
          form.along[n + j] = Ball(side);
          forms.push_back(form);
        }
      }
    }
    return forms;
  }

  /// w+ and v_t+, exactly zero where the combination says so.
  void set_rates(ImpactOutcome& outcome) const {
    outcome.slip.assign(strikes_.size(), Ball());
    outcome.rebound.assign(strikes_.size(), Ball());
    for (std::size_t k = 0; k < strikes_.size(); ++k) {
      const Strike& s = strikes_[k];
      const auto rate = [&](const std::vector<Ball>& J, const Ball& drift) {
        Ball sum = drift;
        for (std::size_t r = 0; r < v_.size(); ++r) sum = a_.add(sum, a_.mul(J[r], outcome.velocity[r]));
        return sum;
      };
      if (modes_[k] == Mode::open || rebounds(k)) outcome.rebound[k] = rate(s.J_n, s.drift_n);
      if (s.J_t.size() == 1 && modes_[k] != Mode::stick) outcome.slip[k] = rate(s.J_t[0], s.drift_t[0]);
    }
  }

  /// Redundant rows: an unknown is left out, one of sticking if possible. Without a refutation, (2) is satisfied if some
  /// impulses do, and the row that was left out holds because it is one of locked coordinates.
  void check_redundant(ImpactAlternative& alternative, const std::vector<int>& locked) const {
    const std::size_t n = v_.size();
    const std::vector<LinearForm> forms = inequalities();
    std::vector<Ball> b;
    for (const auto& row : B_) b.push_back(row[0]);
    std::vector<std::size_t> order;
    for (const bool tangential : {true, false}) {
      for (std::size_t j = impulses_.size(); j-- > 0;) {
        if (impulses_[j].is_tangential == tangential) order.push_back(j);
      }
    }
    for (const std::size_t j : order) {
      const auto system = RedundantRow::without(A_, b, n + j, a_);
      if (!system) continue;
      if (system->is_refuted(forms)) {
        alternative.sign = Sign::negative;
        return;
      }
      take(alternative, system->hull(forms), locked);
      const std::vector<Ball> row(A_[n + j].begin(), A_[n + j].begin() + static_cast<std::ptrdiff_t>(n));
      const bool follows = !leaves(row, locked) && b[n + j].is_zero();
      if (follows && system->feasible(forms)) alternative.sign = Sign::positive;
      return;
    }
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

/// Whether two combinations that satisfy the law have the same v+: their impulses that are not exactly zero are those of
/// `one`, which is regular; or set_reaching() says so.
bool have_same_velocity(const ImpactAlternative& one, const ImpactAlternative& other) {
  if (one.is_regular && one.modes == one.active && one.active == other.active) return true;
  return one.has_one_velocity && one.at_rest == other.at_rest && one.reaching == other.reaching;
}

/// The outcome of all combinations that are not refuted. @throws Undecided unless it is one outcome, and proven
ImpactOutcome the_only_outcome(std::vector<ImpactAlternative> left, const Precision& a) {
  const auto best = std::ranges::find(left, Sign::positive, &ImpactAlternative::sign);
  Verdict verdict;
  for (auto next = left.begin(); next != left.end(); ++next) {
    if (best == left.end() || next == best || !have_same_velocity(*best, *next)) {
      verdict.add(next->sign, next->name);
      continue;
    }
    for (std::size_t i = 0; i < best->outcome.Lambda_n.size(); ++i)
      best->outcome.Lambda_n[i] = a.hull(best->outcome.Lambda_n[i], next->outcome.Lambda_n[i]);
  }
  verdict.require_one("impact");
  for (const Ball& impulse : best->outcome.Lambda_n) {
    if (arb_is_finite(impulse.get()) == 0) throw Undecided("impact: the impulses of redundant contacts have no bounds");
  }
  best->outcome.modes = best->modes;
  return std::move(best->outcome);
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
  const BallMatrix M = p_.values_of(scene_.M);
  const std::vector<Ball> v(x.begin() + scene_.n, x.end());
  std::vector<Strike> strikes;
  std::vector<std::vector<Mode>> options;
  for (const int i : candidates) {
    const ContactFormulas& contact = scene_.contacts[i];
    strikes.push_back({i,
                       closed[i] != 0,
                       p_.value_of(contact.v_n),
                       p_.values_of(contact.v_t),
                       p_.values_of(contact.J_n),
                       p_.values_of(contact.J_t),
                       {},
                       {}});
    options.push_back(impact_options(contact));
  }
  std::vector<Ball> at_rest = x;
  std::fill(at_rest.begin() + scene_.n, at_rest.end(), Ball());
  step_.load(at_rest, t);
  for (Strike& s : strikes) {
    s.drift_n = p_.value_of(scene_.contacts[s.contact].v_n);
    s.drift_t = p_.values_of(scene_.contacts[s.contact].v_t);
  }
  Combinations combination(std::move(options));
  std::vector<ImpactAlternative> left;
  do {
    limit_.check();
    ImpactAlternative next;
    next.name = names(candidates, combination);
    for (std::size_t k = 0; k < candidates.size(); ++k) next.modes.push_back(combination[k]);
    ImpactSystem(scene_, p_.precision(), M, v, strikes, combination).check(next);
    if (next.sign != Sign::negative) left.push_back(std::move(next));
  } while (combination.next());
  return the_only_outcome(std::move(left), p_.precision());
}

}  // namespace ricochet::reference::certified
