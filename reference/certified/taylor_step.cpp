#include "reference/certified/taylor_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace ricochet::reference::certified {

void TimeLimit::check() const {
  if (seconds() > limit_) throw OutOfTime(fmt::format("the time limit of {:g} s is exceeded", limit_));
}

void TaylorStep::load(const std::vector<Ball>& x, const Ball& t) {
  p_.forget();
  for (int k = 0; k < scene_.n; ++k) {
    p_.set(scene_.q[k], 0, x[k].get());
    p_.set(scene_.v[k], 0, x[scene_.n + k].get());
  }
  const Ball one(1.0), zero;
  p_.set(scene_.clock, 0, t.get());
  p_.set(scene_.clock, 1, one.get());
  for (int k = 2; k <= p_.precision().order; ++k) p_.set(scene_.clock, k, zero.get());
  for (std::size_t j = 0; j < scene_.parameters.size(); ++j) {
    p_.set(scene_.parameters[j], 0, scene_.values[j].get());
    for (int k = 1; k <= p_.precision().order; ++k) p_.set(scene_.parameters[j], k, zero.get());
  }
}

TaylorStep::Rates TaylorStep::rates(const ModeMotion& motion) const {
  Rates rates;
  for (int k = 0; k < scene_.n; ++k) rates.emplace_back(scene_.q[k], scene_.v[k]);
  for (int k = 0; k < scene_.n; ++k) rates.emplace_back(scene_.v[k], motion.acceleration[k]);
  return rates;
}

TaylorStep::Rates TaylorStep::rates(const Variation& variation) const {
  Rates rates;
  for (int i = 0; i < 2 * scene_.n; ++i) {
    for (std::size_t k = 0; k < variation.phi[i].size(); ++k) {
      const bool upper = i < scene_.n;
      rates.emplace_back(variation.phi[i][k], upper ? variation.phi[scene_.n + i][k] : variation.rate[i - scene_.n][k]);
    }
  }
  return rates;
}

/// Coefficient k + 1 of the variables from coefficient k of their rates.
void TaylorStep::integrate(const Rates& rates, int k, slong bits) {
  Ball next, zero;
  for (const auto& [variable, rate] : rates) {
    const bool vanishes = k > 0 && p_.is_constant(rate);
    arb_div_ui(next.get(), vanishes ? zero.get() : p_.coefficient(rate, k), static_cast<ulong>(k + 1), bits);
    p_.set(variable, k + 1, next.get());
  }
}

void TaylorStep::expand(const ModeMotion& motion, int order) {
  const slong bits = p_.precision().bits;
  const Rates all = rates(motion);
  for (int k = 0; k <= order; ++k) {
    expand_directions(motion, k);
    for (const Node i : motion.schedule) p_.compute(i, k, bits);
    integrate(all, k, bits);
    if (k % 16 == 0) limit_.check();
  }
  differentiate_directions(motion.starts, order);
}

void TaylorStep::expand(const ModeMotion& motion, const Variation& variation, const std::vector<std::vector<Ball>>& Q) {
  const slong bits = p_.precision().bits;
  for (std::size_t i = 0; i < variation.phi.size(); ++i) {
    for (std::size_t k = 0; k < variation.phi[i].size(); ++k) p_.set(variation.phi[i][k], 0, Q[i][k].get());
  }
  const Rates own = rates(motion), varied = rates(variation);
  for (int k = 0; k <= p_.precision().order; ++k) {
    for (const Node i : motion.schedule) p_.compute(i, k, bits);
    integrate(own, k, bits);
    limit_.check();
    if (k > variation.degree) continue;
    for (const Node i : variation.schedule) p_.compute(i, k, variation.bits);
    integrate(varied, k, variation.bits);
  }
}

double TaylorStep::suggested_length(const ModeMotion& motion) const {
  constexpr double kNone = -1e200;
  const int N = p_.precision().order;
  const auto log2_of = [&](Node node, int k) {
    if (k > 0 && p_.is_constant(node)) return 2 * kNone;
    const Magnitude size{Ball(p_.coefficient(node, k))};
    return mag_is_zero(size.get()) ? 2 * kNone : mag_get_d_log2_approx(size.get());
  };
  double shortest = 1e300;
  const auto look_at = [&](Node node, double scale) {
    if (scale < kNone) return;
    for (int k = N - 1; k <= N; ++k) {
      const double size = log2_of(node, k);
      if (size > kNone) shortest = std::min(shortest, (-static_cast<double>(p_.precision().bits) - size + scale) / k);
    }
  };
  double scale = 2 * kNone;
  for (const Node v : scene_.v) {
    for (int k = 0; k < 3; ++k) scale = std::max(scale, log2_of(v, k) - 3 * k);
  }
  for (const Node v : scene_.v) look_at(v, scale);
  for (const auto& [contact, start] : motion.starts) look_at(start.y, 0);
  for (const auto& event : motion.events) {
    double own = 2 * kNone;
    for (int k = 0; k < 4; ++k) own = std::max(own, log2_of(event.node, k) - 3 * k);
    look_at(event.node, own);
  }
  return shortest > 60 ? 1e6 : std::exp2(shortest);
}

bool TaylorStep::validate(const ModeMotion& motion, double h) {
  constexpr int kMostIterations = 12;
  mag_zero(p_.rho(scene_.clock));
  if (!contract(motion.schedule, rates(motion), h, kMostIterations, motion.starts)) return false;
  constexpr slong kSpareBits = 16;  // of directions: suggested_length() sees their polynomials only
  return std::ranges::all_of(motion.starts, [&](const auto& start) {
    return mag_cmp_2exp_si(p_.rho(start.second.y), kSpareBits - p_.precision().bits) <= 0;
  });
}

bool TaylorStep::validate(const ModeMotion& motion, const Variation& variation, double h) {
  constexpr int kMostIterations = 40;
  std::vector<Magnitude> own(motion.schedule.size());
  for (std::size_t k = 0; k < own.size(); ++k) mag_set(own[k].get(), p_.rho(motion.schedule[k]));
  if (variation.degree < p_.degree()) p_.lower_degree(motion.schedule, variation.degree);
  const bool is_valid = contract(variation.schedule, rates(variation), h, kMostIterations);
  p_.set_degree(p_.precision().order);
  for (std::size_t k = 0; k < own.size(); ++k) mag_set(p_.rho(motion.schedule[k]), own[k].get());
  return is_valid;
}

bool TaylorStep::find_remainders(const std::vector<Node>& schedule) {
  return std::ranges::all_of(schedule, [&](Node i) { return p_.remainder(i); });
}

bool TaylorStep::contract(const std::vector<Node>& schedule, const Rates& rates, double h, int most_iterations,
                          const Starts& starts) {
  const auto N = static_cast<ulong>(p_.degree());
  p_.measure(schedule, h);
  Magnitude length;
  mag_set_d(length.get(), h);
  const auto first_term = [&](Magnitude& r, Node rate) {
    if (p_.is_constant(rate)) return mag_zero(r.get());
    mag_mul(r.get(), p_.size_of(rate, static_cast<int>(N)), length.get());
    mag_div_ui(r.get(), r.get(), N + 1);
  };
  for (const auto& [variable, rate] : rates) {
    Magnitude guess;
    first_term(guess, rate);
    mag_mul_2exp_si(p_.rho(variable), guess.get(), 1 + room_);
  }
  if (!begin_contraction(starts, h)) return false;
  std::vector<Magnitude> mapped(rates.size()), fixed(starts.size());
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    limit_.check();
    if (!find_remainders(schedule, starts, fixed)) return false;
    bool is_inside = true;
    for (std::size_t j = 0; j < rates.size(); ++j) {
      Magnitude rest;
      first_term(mapped[j], rates[j].second);
      mag_mul(rest.get(), p_.rho(rates[j].second), length.get());
      mag_div_ui(rest.get(), rest.get(), N + 2);
      mag_add(mapped[j].get(), mapped[j].get(), rest.get());
      mag_mul_2exp_si(mapped[j].get(), mapped[j].get(), room_);
      is_inside = is_inside && mag_cmp(mapped[j].get(), p_.rho(rates[j].first)) <= 0;
    }
    if (!contract_directions(starts, fixed, h, is_inside)) return false;
    if (is_inside) return true;
    for (std::size_t j = 0; j < rates.size(); ++j) {
      const mag_ptr rho = p_.rho(rates[j].first);
      if (mag_cmp(mapped[j].get(), rho) > 0) mag_mul_2exp_si(rho, mapped[j].get(), 1);
    }
  }
  return false;
}

bool TaylorStep::vanishes(Node node, double h) {
  if (p_.is_constant(node)) return p_.is_zero(node);
  const std::vector<Node> schedule = p_.schedule({node});
  const int N = p_.precision().order;
  for (int k = 0; k <= N; ++k) {
    for (const Node i : schedule) p_.compute(i, k, p_.precision().bits);
  }
  p_.measure(schedule, h);
  for (const Node i : schedule) {
    if (!p_.remainder(i)) return false;
  }
  return p_.leading(node, 0, N) > N && mag_is_zero(p_.rho(node)) != 0;
}

void TaylorStep::polynomial(BoundedPolynomial& f, Node node, double h, int vanishing) const {
  polynomial(f, node, h, vanishing, p_.precision().order);
}

void TaylorStep::polynomial(BoundedPolynomial& f, Node node, double h, int vanishing, int N) const {
  const slong bits = p_.precision().bits;
  const Ball length(h);
  Ball power(1.0), scaled;
  arb_poly_zero(f.p);
  arb_poly_fit_length(f.p, N + 1);
  const int last = p_.is_constant(node) ? 0 : N;
  for (int k = 0; k <= last; ++k) {
    if (k >= vanishing) {
      arb_mul(scaled.get(), p_.coefficient(node, k), power.get(), bits);
      arb_poly_set_coeff_arb(f.p, k - vanishing, scaled.get());
    }
    arb_mul(power.get(), power.get(), length.get(), bits);
  }
  arb_poly_derivative(f.slope, f.p, bits);
  mag_set(f.rho.get(), p_.rho(node));
}

Ball TaylorStep::at(Node node, double h, const Ball& tau, slong bits) const {
  BoundedPolynomial f;
  polynomial(f, node, h, 0);
  return f.at(tau, bits);
}

Ball TaylorStep::at_of_variation(const Variation& variation, std::size_t i, std::size_t k, double h, const Ball& tau,
                                 slong bits) const {
  BoundedPolynomial f;
  polynomial(f, variation.phi[i][k], h, 0, variation.degree);
  return f.at(tau, bits);
}

Variation variation_of(const ModeMotion& motion, const SceneFormulas& scene, std::vector<std::vector<Node>> phi,
                       SeriesProgram& program, const std::vector<Node>& varied) {
  Variation variation;
  variation.bits = program.precision().bits;
  variation.degree = program.precision().order;
  const int n = scene.n;
  variation.phi = std::move(phi);
  std::vector<Node> outputs;
  for (int i = 0; i < n; ++i) {
    variation.rate.emplace_back();
    for (std::size_t k = 0; k < variation.phi[i].size(); ++k) {
      Node sum = program.number(0);
      if (!varied.empty() && varied[k] >= 0) sum = program.derivative(motion.acceleration[i], varied[k]);
      for (int j = 0; j < n; ++j) {
        const Node by_q = program.derivative(motion.acceleration[i], scene.q[j]);
        const Node by_v = program.derivative(motion.acceleration[i], scene.v[j]);
        sum = program.add(sum, program.mul(by_q, variation.phi[j][k]));
        sum = program.add(sum, program.mul(by_v, variation.phi[n + j][k]));
      }
      variation.rate.back().push_back(sum);
      outputs.push_back(sum);
    }
  }
  for (const auto& row : variation.phi) outputs.insert(outputs.end(), row.begin(), row.end());
  std::vector<char> is_known(program.size(), 0);
  for (const Node i : motion.schedule) is_known[i] = 1;
  for (const Node i : program.schedule(outputs)) {
    if (!is_known[i]) variation.schedule.push_back(i);
  }
  return variation;
}

}  // namespace ricochet::reference::certified
