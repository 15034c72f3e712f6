#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "reference/certified/contact_law.h"
#include "reference/certified/hybrid_motion.h"

// The end of infinitely many impacts of coupled contacts, without a proof: the grade is `computed`. Where all contacts of
// a group come to rest, the velocity after them is unique, whatever the restitution and the order of the impacts, because
// their impulses add up to v+ - v- = M^-1 J_n L:
//
//     v+ = argmin |v - v-|_M   over all v with   r = J_n' v + df_c/dt = 0 of every contact of the group              (1)
//
// The last impacts follow each other within 10^-cut s. The group consists of the contacts that exchange momentum and are
// closed, or whose gap is below 10^-cut. It comes to rest if all r are below 10^-cut, or if a sequence of impacts without
// flights between them ends there: with G = J_n' M^-1 J_n, the contact i that approaches fastest hits next,
//
//     r <- r - (1 + eps_r) r_i G_i / G_ii                                                                           (2)
//
// until all r are small. If contacts part instead, nothing is taken as zero, and the enclosure goes on. In a wedge (1)
// would change velocities by much more than r; this is refused, too.

namespace ricochet::reference::certified {
namespace {

/// Projects a velocity as in (1), one row after the other. A row that depends on those before has no rate of its own.
class Projection {
 public:
  Projection(const SceneFormulas& scene, SeriesProgram& program, std::vector<Ball> v)
      : p_(program), a_(program.precision()), M_(program.values_of(scene.M)), before_(v), v_(std::move(v)) {}

  const std::vector<Ball>& velocity() const { return v_; }

  /// Makes the rate row' v + ... zero, which is `rate` before the projection.
  void add(const std::vector<Node>& row, Ball rate) {
    constexpr double kDependent = 1e-10;
    const std::size_t n = v_.size();
    std::vector<Ball> J = p_.values_of(row);
    BallMatrix right;
    for (const Ball& entry : J) right.push_back({entry});
    const auto moved = solve(M_, right, a_.bits);
    if (!moved) throw Undecided("the mass matrix may be singular where impacts accumulate");
    std::vector<Ball> c;
    for (const auto& entry : *moved) c.push_back(entry[0]);
    const double whole = dot(J, c).nearest();
    for (const Row& known : rows_) {
      const Ball share = a_.div(dot(known.J, c), known.G);
      for (std::size_t r = 0; r < n; ++r) c[r] = a_.sub(c[r], a_.mul(share, known.c[r]));
    }
    const Ball G = dot(J, c);
    if (!(G.nearest() > kDependent * whole)) return;
    for (std::size_t r = 0; r < n; ++r) rate = a_.add(rate, a_.mul(J[r], a_.sub(v_[r], before_[r])));
    const Ball impulse = a_.div(rate, G);
    for (std::size_t r = 0; r < n; ++r) v_[r] = a_.sub(v_[r], a_.mul(impulse, c[r]));
    rows_.push_back({std::move(J), std::move(c), G});
  }

  /// Upper bound of all changes of velocities.
  double change() const {
    double most = 0;
    for (std::size_t r = 0; r < v_.size(); ++r) most = std::max(most, Magnitude(a_.sub(v_[r], before_[r])).upper());
    return most;
  }

 private:
  /// A row J with the direction c = M^-1 J', from which those of the rows before are taken away, and G = J c.
  struct Row {
    std::vector<Ball> J, c;
    Ball G;
  };

  Ball dot(const std::vector<Ball>& x, const std::vector<Ball>& y) const {
    Ball sum;
    for (std::size_t r = 0; r < x.size(); ++r) sum = a_.add(sum, a_.mul(x[r], y[r]));
    return sum;
  }

  SeriesProgram& p_;
  const Precision& a_;
  BallMatrix M_;
  std::vector<Ball> before_, v_;
  std::vector<Row> rows_;
};

/// Whether impacts without flights (2) bring all contacts to rest. @param e  restitution; -1: bilateral
bool come_to_rest(const std::vector<std::vector<double>>& G, std::vector<double> r, const std::vector<double>& e) {
  constexpr int kMostImpacts = 100000;
  constexpr double kRest = 1e-12;  // of the greatest velocity
  const auto size = [&] {
    double most = 0;
    for (const double rate : r) most = std::max(most, std::abs(rate));
    return most;
  };
  const double rest = kRest * size();
  for (int impact = 0; impact < kMostImpacts; ++impact) {
    if (!(size() > rest)) return true;
    std::size_t next = r.size();
    double fastest = 0;
    for (std::size_t k = 0; k < r.size(); ++k) {
      const double approach = (e[k] < 0 ? std::abs(r[k]) : -r[k]) / std::sqrt(G[k][k]);
      if (!(approach > fastest)) continue;
      next = k;
      fastest = approach;
    }
    if (next == r.size()) return false;
    const double impulse = -(1 + std::max(0.0, e[next])) * r[next] / G[next][next];
    for (std::size_t k = 0; k < r.size(); ++k) r[k] += impulse * G[k][next];
  }
  return false;
}

}  // namespace

/// The contacts that exchange momentum with contact i and are closed, or nearly so, if one of them is open; otherwise
/// none. The state must be loaded.
std::vector<int> HybridMotion::group_of(int i) {
  const double small = std::pow(10., -cut_);
  std::vector<int> near;
  for (int j = 0; j < scene_.n_c(); ++j) {
    const bool is_near = Magnitude(p_.value_of(scene_.contacts[j].gap)).upper() < small;
    if (states_.modes[j] != Mode::open || is_near) near.push_back(j);
  }
  const std::vector<int> labels = momentum_groups(scene_, near, p_).of_contact;
  const auto own = std::ranges::find(near, i);
  std::vector<int> group;
  bool is_open = false;
  for (std::size_t k = 0; own != near.end() && k < near.size(); ++k) {
    if (labels[k] != labels[own - near.begin()]) continue;
    group.push_back(near[k]);
    is_open = is_open || states_.modes[near[k]] == Mode::open;
  }
  return is_open ? group : std::vector<int>();
}

/// Whether the group comes to rest: all velocities are small, or by (2). The state must be loaded.
bool HybridMotion::comes_to_rest(const std::vector<int>& group) {
  double most = 0;
  bool has_friction = false;
  std::vector<double> r, e;
  std::vector<std::vector<double>> G;
  for (const int j : group) {
    const ContactFormulas& contact = scene_.contacts[j];
    const Ball rate = p_.value_of(contact.v_n);
    most = std::max(most, Magnitude(rate).upper());
    has_friction = has_friction || contact.n_t() > 0;
    r.push_back(states_.modes[j] == Mode::open ? rate.nearest() : 0);
    e.push_back(contact.is_bilateral ? -1 : contact.eps_r.nearest());
    const ContactLaw law = contact_law(scene_, j, p_);
    G.emplace_back();
    for (const int k : group) {
      double sum = 0;
      for (int q = 0; q < scene_.n; ++q)
        sum += p_.value_of(scene_.contacts[k].J_n[q]).nearest() * law.moved[q][0].nearest();
      G.back().push_back(sum);
    }
  }
  return most < std::pow(10., -cut_) || (!has_friction && come_to_rest(G, r, e));
}

/// After an impact of contact i: if the flights of its group are too short for the digits, and it comes to rest, the
/// motion goes on from there.
void HybridMotion::pass_group_collapse(int i) {
  constexpr std::size_t kLast = 3;
  constexpr double kWedge = 1e6;
  const std::size_t n = event_times_.size();
  const double small = std::pow(10., -cut_);
  if (cut_ == 0 || n < kLast) return;
  if (!(p_.precision().sub(event_times_[n - 1], event_times_[n - kLast]).nearest() < small)) return;
  std::vector<Ball> x = set_.box();
  taylor_.load(x, t_);
  const std::vector<int> group = group_of(i);
  if (group.empty() || !comes_to_rest(group)) return;
  std::vector<std::string> names;
  std::vector<int> slip_sign(scene_.n_c(), 0);
  double most = small;
  Projection projection(scene_, p_, {x.begin() + scene_.n, x.end()});
  for (const int j : group) {
    const Ball rate = p_.value_of(scene_.contacts[j].v_n);
    most = std::max(most, Magnitude(rate).upper());
    projection.add(scene_.contacts[j].J_n, rate);
    names.push_back(scene_.contacts[j].name);
  }
  for (const int j : group) {
    const ContactFormulas& contact = scene_.contacts[j];
    if (contact.n_t() == 0) continue;
    const Ball slip = p_.value_of(contact.n_t() == 1 ? contact.v_t[0] : p_.dot(contact.v_t, contact.v_t));
    if (Magnitude(slip).upper() < (contact.n_t() == 1 ? small : small * small)) {
      for (int d = 0; d < contact.n_t(); ++d) projection.add(contact.J_t[d], p_.value_of(contact.v_t[d]));
    } else if (slip.sign() == Sign::unknown) {
      throw Undecided("impacts accumulate while slip ends: " + contact.name);
    } else {
      slip_sign[j] = static_cast<int>(slip.sign());
    }
  }
  if (!(projection.change() < kWedge * most)) return;
  std::ranges::copy(projection.velocity(), x.begin() + scene_.n);
  for (const int j : group) states_.vanishing_gap[j] = 0;
  decisions_.decide_modes(x, t_, group, slip_sign, states_);
  set_.set_box(std::move(x));
  take_as_zero(fmt::format("gaps, flights and velocities of {} after impacts that accumulate", fmt::join(names, ", ")));
  record("zeno_end", names.front());
}

}  // namespace ricochet::reference::certified
