#include "methods/mpcc_equations/time_freezing_equations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/dense_solve.h"
#include "problems/input_error.h"
#include "problems/join.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Symbols = std::vector<symbol>;
using Expressions = SmoothFunction::Expressions;

/// x_j - x_0 - h sum_k a_jk d_k: inputs (h, x_0, x_1..x_s, d_1..d_s).
SmoothFunction stage_rows(const Matrix& A) {
  const auto n_s = A.rows();
  const symbol h, start;
  const Symbols values(static_cast<std::size_t>(n_s)), slopes(static_cast<std::size_t>(n_s));
  Expressions outputs;
  for (Eigen::Index j = 0; j < n_s; ++j) {
    ex sum = 0;
    for (Eigen::Index k = 0; k < n_s; ++k) sum += A(j, k) * slopes[k];
    outputs.push_back(values[j] - start - h * sum);
  }
  return {outputs, join<symbol>({{h, start}, values, slopes}), {}};
}

void require(bool holds, const ContactInfo& contact, const char* what) {
  if (!holds) throw InputError("plant", "contact " + contact.name, what);
}

/// The numbers that are not negative: a negative one stands for a variable that does not exist.
std::vector<int> present(std::initializer_list<int> numbers) {
  std::vector<int> result;
  for (const int number : numbers)
    if (number >= 0) result.push_back(number);
  return result;
}

}  // namespace

TimeFreezingEquations::TimeFreezingEquations(const Problem& plant, const ButcherTableau& tableau,
                                             const Options& options, Mpcc& mpcc)
    : ContactEquations(plant, Cone::exact, 0, 0, mpcc),
      tableau_(tableau),
      options_(options),
      dynamics_(pseudo_time_dynamics(plant)),
      runge_kutta_(stage_rows(tableau.A)) {
  if (!tableau.is_stiffly_accurate())
    throw InputError("tableau", tableau.name, "a stage at the right end is required: radau-iia or lobatto-iiic");
  if (step_functions_.size() > 0)
    throw InputError("plant", info_.id, "time freezing takes no forces with abs, sign, min, max or if");
  if (info_.n_friction_elements > 0) throw InputError("plant", info_.id, "time freezing takes no friction elements");
  const Matrix J = plant.force_directions(plant.normal_jacobian(info_.q0));
  D_ = CholeskyFactors(plant.mass_matrix(info_.q0)).solve_columns(J);
  G_ = J.cwiseProduct(D_).colwise().sum();
  const symbol x, y, z;
  product_ = {{z - x * y}, {x, y, z}, {}};
  Symbols betas;
  ex speed = 1;
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    require(contact.n_t <= 1, contact, "time freezing has friction in the plane only");
    require(contact.n_t == 0 || contact.eps_r == 0, contact, "time freezing has no friction with restitution");
    require(contact.eps_r == 0 || (contact.is_affine && info_.structure.constant_mass), contact,
            "an elastic contact has to be affine, and M constant");
    D_.col(i) /= G_[i];
    const symbol b_q, b_v, Lambda, g_plus, g_minus, rate, Lambda_t, a_t, b_t;
    if (is_elastic(i)) {  // (5), (3)
      const ex beta = b_q;
      force_.push_back({{G_[i] * Lambda + beta * (options.k * (g_plus - g_minus) + options.damping[i] * rate)},
                        {Lambda, b_q, g_plus, g_minus, rate},
                        {}});
      betas.push_back(b_q);
      speed *= 1 - beta;
    } else {  // (4)
      force_.push_back({{Lambda - options.push[i] * b_q * b_v}, {Lambda, b_q, b_v}, {}});
      betas.push_back(b_q);
      betas.push_back(b_v);
      speed *= 1 - b_q * b_v;
    }
    friction_.push_back({{Lambda_t - contact.mu * Lambda * (b_t - a_t)}, {Lambda_t, Lambda, b_t, a_t}, {}});
  }
  const symbol s;
  speed_ = {{s - speed}, join<symbol>({{s}, betas}), {}};
  for (int k = 0; k < info_.n_q; ++k) {  // (3)
    const symbol p, v;
    Symbols inputs{p, s, v};
    ex slope = s * v;
    for (int i = 0; i < info_.n_c(); ++i) {
      if (!is_elastic(i)) continue;
      const symbol b_q, rate;
      slope += D_(k, i) * b_q * rate;
      inputs.insert(inputs.end(), {b_q, rate});
    }
    position_rate_.push_back({{p - slope}, inputs, {}});
  }
}

/// (6); the rate of an elastic contact is one variable of either sign.
void TimeFreezingEquations::add_parts(Node& node, const std::string& name) {
  const auto add = [&](Parts& parts, const SmoothFunction& function, const std::vector<int>& inputs, const char* what,
                       const auto& has, const auto& is_split) {
    std::vector<int> plus, minus;
    for (int i = 0; i < info_.n_c(); ++i) {
      parts.plus.push_back(-1);
      parts.minus.push_back(-1);
      if (!has(i)) continue;
      const std::string at = fmt::format("{}, {}, {}", name, info_.contacts[i].name, what);
      const bool splits = is_split(i);
      parts.plus.back() = add_variable(splits ? 0 : -kInfinity, splits ? kPositive : 0, at + " +");
      if (splits) parts.minus.back() = add_variable(0, kPositive, at + " -");
      plus.push_back(parts.plus.back());
      minus.push_back(parts.minus.back());
    }
    add_split(function, inputs, fmt::format("{}, {}", name, what), plus, minus);
  };
  const auto all = [](int) { return true; };
  const auto inelastic = [&](int i) { return !is_elastic(i); };
  const auto with_friction = [&](int i) { return info_.contacts[i].n_t > 0; };
  const std::vector<int> state = join<int>({node.point.q, node.point.v});
  add(node.gap, functions_.gap, node.point.q, "gap", all, all);
  add(node.rate, functions_.normal_velocity, state, "normal velocity", all, inelastic);
  add(node.slip, functions_.slip, state, "slip", with_friction, all);
}

TimeFreezingEquations::Node TimeFreezingEquations::add_start(const Point& initial) {
  Node node;
  node.point = initial;
  add_parts(node, "start");
  return node;
}

/// Weights with a + b = 1, forces and the speed of time.
void TimeFreezingEquations::add_weights(PseudoStage& stage, const std::string& name) {
  std::vector<int> speed{stage.s};
  const auto add = [&](std::vector<int>& a, std::vector<int>& b, bool has, const std::string& what) {
    a.push_back(-1);
    b.push_back(-1);
    if (!has) return;
    a.back() = mpcc_.nlp.add_variable(0, kInfinity, 1 - kPositive, what + " a");
    b.back() = mpcc_.nlp.add_variable(0, kInfinity, kPositive, what + " b");
    add_linear({{a.back(), 1}, {b.back(), 1}}, 1, 1, what + ", a + b = 1");
  };
  for (int i = 0; i < info_.n_c(); ++i) {
    const bool has = has_pi(i);
    stage.pi.push_back(has ? add_variable(0, kPositive, fmt::format("{}, {}, b_q s", name, info_.contacts[i].name))
                           : -1);
  }
  stage.Lambda_n = add_variables(info_.n_c(), -kInfinity, 0, name + ", Lambda_n");
  stage.Lambda_t = add_variables(info_.n_lambda_t, -kInfinity, 0, name + ", Lambda_t");
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    const std::string at = fmt::format("{}, {}", name, contact.name);
    add(stage.a_q, stage.b_q, true, at + ", gap");
    add(stage.a_v, stage.b_v, !is_elastic(i), at + ", normal velocity");
    add(stage.a_t, stage.b_t, contact.n_t > 0, at + ", slip");
    if (has_pi(i)) add_equations(product_, {stage.b_q[i], stage.s, stage.pi[i]}, at + ", b_q s");  // (9)
    const std::vector<int> weights = present({stage.b_q[i], stage.b_v[i]});
    speed.insert(speed.end(), weights.begin(), weights.end());
    const Node& node = stage.node;
    if (is_elastic(i)) {
      add_equations(force_[i],
                    {stage.Lambda_n[i], stage.b_q[i], node.gap.plus[i], node.gap.minus[i], node.rate.plus[i]},
                    at + ", force");  // (5)
    } else {
      add_equations(force_[i], {stage.Lambda_n[i], stage.b_q[i], stage.b_v[i]}, at + ", force");  // (4)
    }
    if (contact.n_t > 0)
      add_equations(friction_[i],
                    {stage.Lambda_t[contact.tangent_index], stage.Lambda_n[i], stage.b_t[i], stage.a_t[i]},
                    at + ", friction");
  }
  add_equations(speed_, speed, name + ", speed of time");
}

TimeFreezingEquations::PseudoStage TimeFreezingEquations::add_pseudo_stage(const std::vector<int>& u, int h,
                                                                           const std::string& name) {
  PseudoStage stage;
  stage.node.point = add_point(name);
  add_parts(stage.node, name);
  stage.p = add_variables(info_.n_q, -kInfinity, 0, name + ", q'");
  stage.w = add_variables(info_.n_q, -kInfinity, 0, name + ", v'");
  stage.s = mpcc_.nlp.add_variable(-kInfinity, kInfinity, 1 - kPositive, name + ", s");
  stage.theta = mpcc_.nlp.add_variable(-kInfinity, kInfinity, mpcc_.nlp.variables[h].guess, name + ", theta");
  add_weights(stage, name);
  const Point& point = stage.node.point;
  add_equations(dynamics_, join<int>({point.q, point.v, stage.w, {stage.s}, stage.Lambda_n, stage.Lambda_t, u}),
                name + ", dynamics");  // (2)
  for (int k = 0; k < info_.n_q; ++k) {
    std::vector<int> inputs{stage.p[k], stage.s, point.v[k]};
    for (int i = 0; i < info_.n_c(); ++i) {
      if (!is_elastic(i)) continue;
      inputs.insert(inputs.end(), {stage.b_q[i], stage.node.rate.plus[i]});
    }
    add_equations(position_rate_[k], inputs, fmt::format("{}, rate of position {}", name, k));
  }
  add_equations(product_, {h, stage.s, stage.theta}, name + ", theta = h s");  // (8)
  return stage;
}

/// (7)
void TimeFreezingEquations::add_pairs(const Node& left, const PseudoElement& element, const std::string& name) {
  const auto add = [&](int i, auto weight, auto part, const std::string& what) {
    std::vector<int> weights, parts;
    if (part(left) >= 0) parts.push_back(part(left));
    for (const PseudoStage& stage : element.stages) {
      if (weight(stage) >= 0) weights.push_back(weight(stage));
      if (part(stage.node) >= 0) parts.push_back(part(stage.node));
    }
    if (weights.empty() || parts.empty()) return;
    mpcc_.add_pair(weights, parts, fmt::format("{}, {}, {}", name, info_.contacts[i].name, what));
  };
  for (int i = 0; i < info_.n_c(); ++i) {  // (9)
    if (!has_pi(i)) continue;
    std::vector<int> held;
    for (const PseudoStage& stage : element.stages) held.push_back(stage.pi[i]);
    mpcc_.add_pair({left.rate.minus[i]}, held, fmt::format("{}, {}, r- _|_ b_q s", name, info_.contacts[i].name));
  }
  using S = const PseudoStage&;
  using N = const Node&;
  for (int i = 0; i < info_.n_c(); ++i) {
    add(
        i, [i](S s) { return s.b_q[i]; }, [i](N n) { return n.gap.plus[i]; }, "b_q _|_ g+");
    add(
        i, [i](S s) { return s.a_q[i]; }, [i](N n) { return n.gap.minus[i]; }, "a_q _|_ g-");
    add(
        i, [i](S s) { return s.b_v[i]; }, [i](N n) { return n.rate.plus[i]; }, "b_v _|_ r+");
    add(
        i, [i](S s) { return s.a_v[i]; }, [i](N n) { return n.rate.minus[i]; }, "a_v _|_ r-");
    add(
        i, [i](S s) { return s.b_t[i]; }, [i](N n) { return n.slip.plus[i]; }, "b_t _|_ xi+");
    add(
        i, [i](S s) { return s.a_t[i]; }, [i](N n) { return n.slip.minus[i]; }, "a_t _|_ xi-");
  }
}

TimeFreezingEquations::Node TimeFreezingEquations::add_interval(const Node& start, const std::vector<int>& u, double H,
                                                                int T, double share) {
  const int n_fe = options_.n_fe;
  const std::string interval = fmt::format("interval {}", intervals_.size() + 1);
  std::vector<PseudoElement> elements(static_cast<std::size_t>(n_fe));
  Node left = start;
  Terms time;
  for (int n = 0; n < n_fe; ++n) {
    const std::string name = fmt::format("{}, element {}", interval, n + 1);
    PseudoElement& element = elements[n];
    element.h = mpcc_.nlp.add_variable(kShortest * H / n_fe, kInfinity, H / n_fe, name + ", h");
    for (int j = 0; j < tableau_.n_s; ++j)
      element.stages.push_back(add_pseudo_stage(u, element.h, fmt::format("{}, stage {}", name, j + 1)));
    for (int k = 0; k < info_.n_q; ++k) {  // (1)
      std::vector<int> q{element.h, left.point.q[k]}, v{element.h, left.point.v[k]}, slopes_q, slopes_v;
      for (const PseudoStage& stage : element.stages) {
        q.push_back(stage.node.point.q[k]);
        v.push_back(stage.node.point.v[k]);
        slopes_q.push_back(stage.p[k]);
        slopes_v.push_back(stage.w[k]);
      }
      add_equations(runge_kutta_, join<int>({q, slopes_q}), fmt::format("{}, stage positions {}", name, k));
      add_equations(runge_kutta_, join<int>({v, slopes_v}), fmt::format("{}, stage velocities {}", name, k));
    }
    add_pairs(left, element, name);
    for (int j = 0; j < tableau_.n_s; ++j) time.emplace_back(element.stages[j].theta, tableau_.b[j]);
    if (n > 0)
      mpcc_.nlp.add_block(std::make_unique<SquareBlock>(options_.rho, Terms{{element.h, 1}, {elements[n - 1].h, -1}}));
    left = element.stages.back().node;
  }
  if (T >= 0) time.emplace_back(T, -share);
  add_linear(time, T >= 0 ? 0 : H, T >= 0 ? 0 : H, interval + ", its time");  // (8)
  intervals_.push_back(std::move(elements));
  return left;
}

void TimeFreezingEquations::guess_parts(const Parts& parts, int contact, double value) {
  auto& variables = mpcc_.nlp.variables;
  const int plus = parts.plus[contact], minus = parts.minus[contact];
  if (plus >= 0) variables[plus].guess = minus >= 0 ? std::max(value, 0.0) : value;
  if (minus >= 0) variables[minus].guess = std::max(-value, 0.0);
}

void TimeFreezingEquations::set_length_guess(const PseudoElement& element, double dt) {
  auto& variables = mpcc_.nlp.variables;
  double s = 0;
  for (std::size_t j = 0; j < element.stages.size(); ++j) s += tableau_.b[j] * variables[element.stages[j].s].guess;
  variables[element.h].guess = dt / s;
  for (const PseudoStage& stage : element.stages) variables[stage.theta].guess = dt / s * variables[stage.s].guess;
}

void TimeFreezingEquations::set_guess(const PseudoStage& stage, const Vector& q, const Vector& v, const Vector& w,
                                      const Vector& lambda_n, const Vector& lambda_t) {
  auto& variables = mpcc_.nlp.variables;
  const auto set = [&](int variable, double value) {
    if (variable >= 0) variables[variable].guess = value;
  };
  const Vector gap = plant_.gap(q), rate = plant_.normal_jacobian(q).transpose() * v,
               v_t = plant_.tangent_jacobian(q).transpose() * v;
  // beta = s lambda / push with s = prod (1 - beta): s = prod 1 / (1 + lambda / push) to first order.
  double s = 1;
  for (int i = 0; i < info_.n_c(); ++i) {
    if (!is_elastic(i)) s /= 1 + lambda_n[i] / options_.push[i];
  }
  set(stage.s, s);
  for (int k = 0; k < info_.n_q; ++k) {
    set(stage.node.point.q[k], q[k]);
    set(stage.node.point.v[k], v[k]);
    set(stage.p[k], s * v[k]);
    set(stage.w[k], s * w[k]);
  }
  for (int i = 0; i < info_.n_c(); ++i) {
    const ContactInfo& contact = info_.contacts[i];
    guess_parts(stage.node.gap, i, gap[i]);
    guess_parts(stage.node.rate, i, rate[i]);
    const bool presses = !is_elastic(i) && lambda_n[i] > 0;
    const double beta = presses ? s * lambda_n[i] / options_.push[i] : 0;
    set(stage.b_q[i], presses ? 1 : 0);
    set(stage.a_q[i], presses ? 0 : 1);
    set(stage.pi[i], presses ? s : 0);
    set(stage.b_v[i], presses ? beta : rate[i] > 0 ? 0 : 1);
    set(stage.a_v[i], presses ? 1 - beta : rate[i] > 0 ? 1 : 0);
    set(stage.Lambda_n[i], presses ? s * lambda_n[i] : 0);
    if (contact.n_t == 0) continue;
    guess_parts(stage.node.slip, i, v_t[contact.tangent_index]);
    const double part = presses ? lambda_t[contact.tangent_index] / (contact.mu * lambda_n[i]) : 0;
    const double b = std::clamp(0.5 * (1 + part), 0.0, 1.0);
    set(stage.b_t[i], b);
    set(stage.a_t[i], 1 - b);
    set(stage.Lambda_t[contact.tangent_index], presses ? s * lambda_t[contact.tangent_index] : 0);
  }
}

}  // namespace ricochet
