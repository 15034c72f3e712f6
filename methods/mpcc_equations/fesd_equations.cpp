#include "methods/mpcc_equations/fesd_equations.h"

#include <fmt/format.h>

#include <cmath>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/dense_solve.h"
#include "problems/join.h"

namespace ricochet {
namespace {

using GiNaC::ex;
using GiNaC::symbol;
using Symbols = std::vector<symbol>;
using Expressions = SmoothFunction::Expressions;

// An impulse is taken for none unless it is so many times as large as what it is complementary to: a contact that
// persists has small ones of both.
constexpr double kNoImpact = 100;
// Guess of gamma of Cone::squared where it has no finite value: slip at an open contact.
constexpr double kLargeGamma = 1e3;

/// x_1 - x_0 - h sum_k a_k d_k for every row `a` of A: inputs (h, x_0, x_1..x_rows, d_1..d_s).
SmoothFunction runge_kutta_rows(const Matrix& A) {
  const auto rows = A.rows(), n_s = A.cols();
  const symbol h, start;
  const Symbols values(static_cast<std::size_t>(rows)), slopes(static_cast<std::size_t>(n_s));
  Expressions outputs;
  for (Eigen::Index j = 0; j < rows; ++j) {
    ex sum = 0;
    for (Eigen::Index k = 0; k < n_s; ++k) sum += A(j, k) * slopes[k];
    outputs.push_back(values[j] - start - h * sum);
  }
  return {outputs, join<symbol>({{h, start}, values, slopes}), {}};
}

ex sum_of(const symbol* first, int count) {
  ex total = 0;
  for (int k = 0; k < count; ++k) total += first[k];
  return total;
}

/// (13) minus nu: inputs of both elements, theta and 1 - theta at the stages, then a and b at the points; nu comes last.
SmoothFunction switch_indicator(int n_s, int n_points) {
  const int count = 2 * (n_s + n_points);  // of an element
  const Symbols inputs(static_cast<std::size_t>(2 * count + 1));
  const auto product = [&](int begin, int size) {  // of the sums of both elements
    return sum_of(&inputs[begin], size) * sum_of(&inputs[count + begin], size);
  };
  const ex theta = product(0, n_s), rest = product(n_s, n_s), a = product(2 * n_s, n_points),
           b = product(2 * n_s + n_points, n_points);
  return {{(theta + b) * (rest + a) - inputs.back()}, inputs, {}};
}

}  // namespace

const Names<FesdEquations::Impulses>& FesdEquations::impulse_names() {
  static const Names<Impulses> names = {{"position_velocity", Impulses::position_velocity}, {"slack", Impulses::slack}};
  return names;
}

const Names<FesdEquations::CrossComplementarity>& FesdEquations::cross_names() {
  using Cross = CrossComplementarity;
  static const Names<Cross> names = {
      {"sparse", Cross::sparse}, {"per_stage", Cross::per_stage}, {"aggregated", Cross::aggregated}};
  return names;
}

const Names<FesdEquations::Equilibration>& FesdEquations::equilibration_names() {
  static const Names<Equilibration> names = {{"objective", Equilibration::objective},
                                             {"exact", Equilibration::exact},
                                             {"tanh", Equilibration::tanh},
                                             {"none", Equilibration::none}};
  return names;
}

FesdEquations::FesdEquations(const Problem& plant, const ButcherTableau& tableau, const Options& options, Mpcc& mpcc)
    : ContactEquations(plant, options.cone, options.facets, options.eps_c, mpcc),
      tableau_(tableau),
      options_(options),
      stiffly_accurate_(tableau.is_stiffly_accurate()),
      runge_kutta_(runge_kutta_rows(tableau.A)),
      right_end_(runge_kutta_rows(tableau.b.transpose())) {
  for (int i = 0; i < info_.n_c(); ++i) projects_ = projects_ || is_projected(i);
  indicator_.reserve(info_.contacts.size());  // blocks refer to them
  Symbols lengths(2 + info_.contacts.size() + static_cast<std::size_t>(step_functions_.size()));
  ex eta = 1;
  for (std::size_t i = 2; i < lengths.size(); ++i) eta *= lengths[i];
  if (options.equilibration == Equilibration::tanh) eta = GiNaC::tanh(eta);
  equilibration_ = {{(lengths[0] - lengths[1]) * eta}, lengths, {}};
  if (step_functions_.size() > 0)
    switch_indicator_ = switch_indicator(tableau.n_s, tableau.n_s + (stiffly_accurate_ ? 1 : 2));
}

/// Whether (10), (11) are stated.
bool FesdEquations::is_projected(int contact) const {
  const ContactInfo& info = info_.contacts[static_cast<std::size_t>(contact)];
  return options_.projects && stiffly_accurate_ && !info.is_affine && info.n_t == 0;
}

/// Whether a contact that stays closed has no normal velocity, but for rounding.
bool FesdEquations::keeps_velocity(int contact) const {
  return !is_element(contact) && (info_.contacts[static_cast<std::size_t>(contact)].is_affine || is_projected(contact));
}

/// J_n' v = plus - minus, both >= 0 where `is_split`, else minus = -1 and plus of either sign.
void FesdEquations::add_normal_velocity(const Point& point, const std::function<bool(int)>& is_split,
                                        std::vector<int>& plus, std::vector<int>& minus, const std::string& name) {
  for (int i = 0; i < info_.n_c(); ++i) {
    const std::string at = fmt::format("{}, {}, normal velocity", name, info_.contacts[i].name);
    plus.push_back(add_variable(is_split(i) ? 0 : -kInfinity, is_split(i) ? kPositive : 0, at + " +"));
    minus.push_back(is_split(i) ? add_variable(0, kPositive, at + " -") : -1);
  }
  add_split(functions_.normal_velocity, join<int>({point.q, point.v}), name + ", normal velocity", plus, minus);
  for (int i = 0; i < info_.n_c(); ++i) {
    if (minus[i] < 0) continue;
    mpcc_.add_pair({plus[i]}, {minus[i]}, fmt::format("{}, {}, normal velocity + _|_ -", name, info_.contacts[i].name));
  }
}

/// (3), (5), (6) and friction of the impulses
void FesdEquations::add_impact(ElementVariables& element, const std::string& name) {
  const int n_c = info_.n_c();
  element.Lambda_n = add_variables(n_c, 0, kPositive, name + ", Lambda_n");
  fix_elements(element.Lambda_n);
  if (element.left.gap.empty()) add_gap(element.left, name + ", left end");
  add_slip_velocity(element.left, name + ", left end");
  element.left_slip = add_slips(element.left, true, name + ", left end");
  element.impulse = add_forces(element.Lambda_n, true, name + ", impulse");
  const int balance = mpcc_.nlp.n_rows();
  add_equations(
      functions_.impulse,
      join<int>({element.left.q, element.left.v, element.v_minus, element.Lambda_n, tangential(element.impulse)}),
      name + ", impulse balance");
  for (int k = 0; k < info_.n_q; ++k) {
    if (!is_of_element(k)) continue;
    mpcc_.nlp.rows[balance + k].lower = -kInfinity;
    mpcc_.nlp.rows[balance + k].upper = kInfinity;
  }
  if (n_c == 0) return;
  add_friction_laws(element.left, element.left_slip, element.impulse, element.Lambda_n, name + ", impulse");

  element.s_plus = add_variables(n_c, 0, kPositive, name + ", s+");
  element.s_minus = add_variables(n_c, 0, kPositive, name + ", s-");
  fix_elements(element.s_plus);
  fix_elements(element.s_minus);
  const int restitution = mpcc_.nlp.n_rows();
  add_split(functions_.restitution, join<int>({element.left.q, element.left.v, element.v_minus}),
            name + ", restitution", element.s_plus, element.s_minus);
  drop_elements(restitution);
  for (int i = 0; i < n_c; ++i) {
    if (is_element(i)) continue;
    const std::string at = fmt::format("{}, {}", name, info_.contacts[i].name);
    const int y = element.left.gap[i], Lambda = element.Lambda_n[i], plus = element.s_plus[i],
              minus = element.s_minus[i];
    if (options_.impulses == Impulses::slack) {
      mpcc_.add_pair({Lambda}, {y, plus, minus}, at + ", Lambda_n _|_ gap + s+ + s-", kNoImpact);
    } else {
      mpcc_.add_pair({Lambda}, {y}, at + ", Lambda_n _|_ gap", kNoImpact);
      mpcc_.add_pair({Lambda}, {plus, minus}, at + ", Lambda_n _|_ s+ + s-", kNoImpact);
    }
    if (options_.impulses == Impulses::slack || options_.bounded_parts)
      mpcc_.add_pair({plus}, {minus}, at + ", s+ _|_ s-");
  }
  if (options_.no_capture) {  // (9)
    const auto is_split = [this](int i) { return keeps_velocity(i); };
    add_normal_velocity(element.left, is_split, element.z_plus, element.z_minus, name + ", left end");
  }
  if (options_.eps_c > 0) {  // (6)
    std::vector<int> rows;
    for (int i = 0; i < n_c; ++i)
      rows.push_back(mpcc_.nlp.add_row(0, kInfinity, fmt::format("{}, {}, gap ahead", name, info_.contacts[i].name)));
    drop_elements(rows.front());
    mpcc_.nlp.add_block(std::make_unique<FunctionBlock>(
        functions_.ahead, join<int>({element.left.q, element.left.v, {element.h}}), rows));
  }
}

/// (1), (2) and the contact quantities of every stage
void FesdEquations::add_stages(ElementVariables& element, const std::vector<int>& u, const std::string& name) {
  const int n_q = info_.n_q;
  for (int j = 0; j < tableau_.n_s; ++j) {
    element.stages.push_back(add_stage(u, true, fmt::format("{}, stage {}", name, j + 1)));
  }
  if (stiffly_accurate_) {
    element.right = element.stages.back().point;
    if (projects_) add_projection(element, name);
  } else {
    element.right = add_point(name + ", right end");
    add_gap(element.right, name + ", right end");
    add_slip_velocity(element.right, name + ", right end");
    element.right_slip = add_slips(element.right, false, name + ", right end");
  }
  for (int k = 0; k < n_q; ++k) {
    if (is_of_element(k)) continue;  // constants
    std::vector<int> q{element.h, element.left.q[k]}, v{element.h, element.left.v[k]}, slopes_q, slopes_v;
    for (const auto& stage : element.stages) {
      q.push_back(stage.point.q[k]);
      v.push_back(stage.point.v[k]);
      slopes_q.push_back(stage.point.v[k]);
      slopes_v.push_back(stage.w[k]);
    }
    add_equations(runge_kutta_, join<int>({q, slopes_q}), fmt::format("{}, stage positions {}", name, k));
    add_equations(runge_kutta_, join<int>({v, slopes_v}), fmt::format("{}, stage velocities {}", name, k));
    if (stiffly_accurate_) continue;
    add_equations(right_end_, join<int>({{element.h, element.left.q[k], element.right.q[k]}, slopes_q}),
                  fmt::format("{}, end position {}", name, k));
    add_equations(right_end_, join<int>({{element.h, element.left.v[k], element.right.v[k]}, slopes_v}),
                  fmt::format("{}, end velocity {}", name, k));
  }
}

/// (10), (11)
void FesdEquations::add_projection(ElementVariables& element, const std::string& name) {
  const Point& last = element.stages.back().point;
  element.right.v = add_velocity(name + ", right end");
  const auto add_impulse = [&](bool is_free, const std::string& of) {
    const double bound = is_free ? kInfinity : 0;
    return mpcc_.nlp.add_variable(-bound, bound, 0, fmt::format("{}, {}, P", name, of));
  };
  std::vector<int> tangential;
  for (int i = 0; i < info_.n_c(); ++i) {
    const auto& contact = info_.contacts[i];
    element.P.push_back(add_impulse(is_projected(i), contact.name));
    for (int d = 0; d < contact.n_t; ++d) tangential.push_back(add_impulse(false, contact.name));
  }
  add_equations(functions_.impulse, join<int>({last.q, element.right.v, last.v, element.P, tangential}),
                name + ", projection");
  const auto is_split = [this](int i) { return is_projected(i); };
  add_normal_velocity(element.right, is_split, element.r_plus, element.r_minus, name + ", right end");
  for (int i = 0; i < info_.n_c(); ++i) {
    element.p_plus.push_back(-1);
    element.p_minus.push_back(-1);
    if (!is_projected(i)) continue;
    const std::string at = fmt::format("{}, {}", name, info_.contacts[i].name);
    element.p_plus.back() = add_variable(0, kPositive, at + ", p+");
    element.p_minus.back() = add_variable(0, kPositive, at + ", p-");
    add_linear({{element.P[i], -1}, {element.p_plus.back(), 1}, {element.p_minus.back(), -1}}, 0, 0, at + ", P");
    mpcc_.add_pair({element.p_plus.back()}, {element.p_minus.back()}, at + ", p+ _|_ p-");
    std::vector<int> gaps{element.left.gap[i]}, forces;
    for (const auto& stage : element.stages) {
      gaps.push_back(stage.point.gap[i]);
      forces.push_back(stage.lambda_n[i]);
    }
    mpcc_.add_pair({element.p_plus.back(), element.p_minus.back()}, gaps, at + ", P _|_ gap");
    mpcc_.add_pair({element.r_plus[i], element.r_minus[i]}, forces, at + ", normal velocity _|_ lambda_n");
  }
}

/// a_k or b_k of (12) at the left end, the stages and the right end.
std::vector<int> FesdEquations::parts_of_psi(const ElementVariables& element, PartOfPsi part, std::size_t k) const {
  std::vector<int> numbers{(element.left.*part)[k]};
  for (const auto& stage : element.stages) numbers.push_back((stage.point.*part)[k]);
  if (!stiffly_accurate_) numbers.push_back((element.right.*part)[k]);
  return numbers;
}

/// Pairs of every stage value with every point value, or of their sums.
void FesdEquations::add_cross(const std::vector<int>& stages, const std::vector<int>& points, const std::string& name) {
  switch (options_.cross) {
    case CrossComplementarity::sparse:
      for (const int a : stages) {
        for (const int b : points) mpcc_.add_pair({a}, {b}, name);
      }
      break;
    case CrossComplementarity::per_stage:
      for (const int a : stages) mpcc_.add_pair({a}, points, name);
      break;
    case CrossComplementarity::aggregated:
      mpcc_.add_pair(stages, points, name);
      break;
  }
}

/// The pairs of (4), (9) and (12), and those of friction
void FesdEquations::add_cross_complementarity(const ElementVariables& element, const std::string& name) {
  // Values of a quantity at the stages, and at the left end, the stages and the right end.
  const auto at_stages = [&](const auto& value) {
    std::vector<int> numbers;
    for (const auto& stage : element.stages) numbers.push_back(value(stage));
    return numbers;
  };
  for (std::size_t k = 0; k < element.left.psi_plus.size(); ++k) {  // (12)
    const std::string at = fmt::format("{}, psi {}", name, k);
    add_cross(at_stages([&](const Stage& s) { return s.theta_rest[k]; }), parts_of_psi(element, &Point::psi_plus, k),
              at + ", 1 - theta _|_ psi+");
    add_cross(at_stages([&](const Stage& s) { return s.theta[k]; }), parts_of_psi(element, &Point::psi_minus, k),
              at + ", theta _|_ psi-");
  }
  for (std::size_t i = 0; i < info_.contacts.size(); ++i) {
    const std::string at = fmt::format("{}, {}", name, info_.contacts[i].name);
    std::vector<int> gaps{element.left.gap[i]};
    for (const auto& stage : element.stages) gaps.push_back(stage.point.gap[i]);
    if (!stiffly_accurate_) gaps.push_back(element.right.gap[i]);
    if (!info_.contacts[i].is_friction_element)
      add_cross(at_stages([&](const Stage& s) { return s.lambda_n[i]; }), gaps, at + ", lambda_n _|_ gap");
    if (options_.no_capture && keeps_velocity(static_cast<int>(i)))
      add_cross(at_stages([&](const Stage& s) { return s.lambda_n[i]; }), {element.z_plus[i]},
                at + ", lambda_n _|_ z+");

    const int n_t = info_.contacts[i].n_t;
    if (n_t == 0) continue;
    const auto at_points = [&](const auto& value) {  // of a Slip; gamma is not known at a right end that is no stage
      std::vector<int> numbers;
      const auto append = [&](const Slip& slip) {
        const auto& list = value(slip);
        numbers.insert(numbers.end(), list.begin(), list.end());
      };
      append(element.left_slip[i]);
      for (const auto& stage : element.stages) append(stage.slip[i]);
      if (!stiffly_accurate_) append(element.right_slip[i]);
      return numbers;
    };
    const auto component = [](const std::vector<int>& list, int d) {
      return list.empty() ? std::vector<int>{} : std::vector<int>{list[d]};
    };
    for (int d = 0; d < n_t; ++d) {
      const auto plus = at_points([&](const Slip& s) { return component(s.xi_plus, d); });
      const auto minus = at_points([&](const Slip& s) { return component(s.xi_minus, d); });
      if (!plus.empty()) add_cross(plus, minus, at + ", xi+ _|_ xi-");
    }
    add_friction_pairs(element.left_slip[i], element.impulse[i], kNoImpact, at + ", impulse");
    if (options_.cone == Cone::exact && n_t == 1) {
      const auto plus = at_points([](const Slip& s) { return s.xi_plus; });
      const auto minus = at_points([](const Slip& s) { return s.xi_minus; });
      add_cross(at_stages([&](const Stage& s) { return s.force[i].slack[0]; }), plus, at + ", cone _|_ xi+");
      add_cross(at_stages([&](const Stage& s) { return s.force[i].slack[1]; }), minus, at + ", cone _|_ xi-");
      continue;
    }
    add_cross(at_stages([&](const Stage& s) { return s.force[i].slack[0]; }),
              at_points([](const Slip& s) { return s.gamma; }), at + ", cone _|_ gamma");
    for (std::size_t f = 0; f < element.stages.front().force[i].facets.size(); ++f) {
      add_cross(at_stages([&](const Stage& s) { return s.force[i].facets[f]; }),
                at_points([&](const Slip& s) { return component(s.rates, static_cast<int>(f)); }),
                at + ", l _|_ D' v_t + gamma");
    }
  }
}

/// The inputs of switch_indicator() of one element.
std::vector<int> FesdEquations::switch_lists(const ElementVariables& element, std::size_t k) const {
  std::vector<int> theta, rest;
  for (const auto& stage : element.stages) {
    theta.push_back(stage.theta[k]);
    rest.push_back(stage.theta_rest[k]);
  }
  return join<int>(
      {theta, rest, parts_of_psi(element, &Point::psi_plus, k), parts_of_psi(element, &Point::psi_minus, k)});
}

/// The lists of variables whose sums (8) is made of: gaps at the points, lambda_n, then for a contact with friction
/// the cone slacks and everything whose sums stay positive while the contact goes on slipping in one direction.
std::vector<std::vector<int>> FesdEquations::indicator_lists(const ElementVariables& element, int contact) const {
  const auto i = static_cast<std::size_t>(contact);
  std::vector<std::vector<int>> lists(2);
  lists[0] = {element.left.gap[i]};
  for (const auto& stage : element.stages) {
    lists[0].push_back(stage.point.gap[i]);
    lists[1].push_back(stage.lambda_n[i]);
  }
  if (info_.contacts[i].n_t == 0) return lists;
  const Stage& first = element.stages.front();
  for (std::size_t k = 0; k < first.force[i].slack.size(); ++k) {
    lists.emplace_back();
    for (const auto& stage : element.stages) lists.back().push_back(stage.force[i].slack[k]);
  }
  const auto add_slip_list = [&](const auto& value) {
    for (std::size_t k = 0; k < value(element.left_slip[i]).size(); ++k) {
      lists.push_back({value(element.left_slip[i])[k]});
      for (const auto& stage : element.stages) lists.back().push_back(value(stage.slip[i])[k]);
    }
  };
  add_slip_list([](const Slip& slip) { return slip.xi_plus; });
  add_slip_list([](const Slip& slip) { return slip.xi_minus; });
  if (first.slip[i].xi_plus.empty() && first.force[i].facets.empty())
    add_slip_list([](const Slip& slip) { return slip.gamma; });
  for (std::size_t f = 0; f < first.force[i].facets.size(); ++f) {
    lists.emplace_back();
    for (const auto& stage : element.stages) lists.back().push_back(stage.force[i].facets[f]);
  }
  return lists;
}

/// nu of (8) with the lists of both neighbours as inputs, minus nu itself, the last input.
SmoothFunction FesdEquations::indicator(const std::vector<std::vector<int>>& lists, int n_slacks) const {
  Symbols inputs;
  std::vector<Symbols> before, after;
  for (auto* side : {&before, &after}) {
    for (const auto& list : lists) {
      side->emplace_back(list.size());
      inputs.insert(inputs.end(), side->back().begin(), side->back().end());
    }
  }
  const symbol nu;
  inputs.push_back(nu);
  const auto sum = [](const Symbols& list) {
    ex total = 0;
    for (const auto& x : list) total += x;
    return total;
  };
  const ex Y_before = sum(before[0]), Y_after = sum(after[0]);
  ex zeta = 1;
  if (n_slacks > 0) {
    // Both slacks of the plane make the cone slack of (8): their product.
    const auto cone = [&](const std::vector<Symbols>& side) {
      ex total = 0;
      for (std::size_t j = 0; j < side[2].size(); ++j) {
        ex product = 1;
        for (int k = 0; k < n_slacks; ++k) product *= side[2 + k][j];
        total += product;
      }
      return total;
    };
    zeta = Y_before + Y_after + cone(before) * cone(after);
    for (std::size_t k = 2 + n_slacks; k < lists.size(); ++k) zeta += sum(before[k]) * sum(after[k]);
  }
  const ex kappa = after[0][0] * Y_before * Y_after + sum(before[1]) * sum(after[1]);
  return {{kappa * zeta - nu}, inputs, {}};
}

/// (8)
void FesdEquations::add_equilibration(const ElementVariables& before, const ElementVariables& element,
                                      const std::string& name) {
  if (options_.equilibration == Equilibration::none) return;
  if (options_.equilibration == Equilibration::objective) {
    mpcc_.nlp.add_block(std::make_unique<SquareBlock>(options_.rho, Terms{{element.h, 1}, {before.h, -1}}));
    return;
  }
  std::vector<int> lengths{element.h, before.h};
  for (int i = 0; i < info_.n_c(); ++i) {
    const auto left = indicator_lists(before, i), right = indicator_lists(element, i);
    const int n_slacks = info_.contacts[i].n_t == 0 ? 0 : static_cast<int>(element.stages[0].force[i].slack.size());
    if (static_cast<int>(indicator_.size()) <= i) indicator_.push_back(indicator(left, n_slacks));
    std::vector<int> inputs;
    for (const auto* side : {&left, &right}) {
      for (const auto& list : *side) inputs.insert(inputs.end(), list.begin(), list.end());
    }
    const std::string at = fmt::format("{}, {}, indicator", name, info_.contacts[i].name);
    const int nu = add_variable(0, kPositive, at);
    inputs.push_back(nu);
    add_equations(indicator_[i], inputs, at);
    lengths.push_back(nu);
  }
  for (std::size_t k = 0; k < element.left.psi_plus.size(); ++k) {  // (13)
    const std::string at = fmt::format("{}, psi {}, indicator", name, k);
    const int nu = add_variable(0, kPositive, at);
    add_equations(switch_indicator_, join<int>({switch_lists(before, k), switch_lists(element, k), {nu}}), at);
    lengths.push_back(nu);
  }
  add_equations(equilibration_, lengths, name + ", step equilibration");
}

FesdEquations::Point FesdEquations::add_interval(const Point& start, const std::vector<int>& u, double H, int T,
                                                 double share) {
  const int n_fe = options_.n_fe;
  const std::string interval = fmt::format("interval {}", intervals_.size() + 1);
  std::vector<ElementVariables> elements(static_cast<std::size_t>(n_fe));
  Point left = start;
  Terms lengths;
  for (int n = 0; n < n_fe; ++n) {
    const std::string name = fmt::format("{}, element {}", interval, n + 1);
    ElementVariables& element = elements[n];
    element.h = mpcc_.nlp.add_variable(options_.shortest * H / n_fe, T >= 0 ? kInfinity : H, H / n_fe, name + ", h");
    lengths.emplace_back(element.h, 1);
    element.left.q = left.q;
    element.left.gap = left.gap;
    element.v_minus = left.v;
    element.left.v = add_velocity(name + ", left end");
    add_impact(element, name);
    add_stages(element, u, name);
    add_switching(element.left, element.stages.front().theta, name + ", left end");
    if (!stiffly_accurate_) add_switching(element.right, element.stages.back().theta, name + ", right end");
    add_cross_complementarity(element, name);
    if (n > 0) add_equilibration(elements[n - 1], element, name);
    left = element.right;
  }
  if (T >= 0) lengths.emplace_back(T, -share);
  add_linear(lengths, T >= 0 ? 0 : H, T >= 0 ? 0 : H, interval + ", sum of h");  // (7)
  intervals_.push_back(std::move(elements));
  return left;
}

/// The mode of a contact in an element, by which side of its pairs is the larger.
ContactMode FesdEquations::mode(const ElementVariables& element, int contact, const Vector& x) const {
  const auto i = static_cast<std::size_t>(contact);
  double force = 0, slack = 0;
  Vector slip = Vector::Zero(info_.contacts[i].n_t);
  for (const auto& stage : element.stages) {
    force = std::max(force, x[stage.lambda_n[i]]);
    for (Eigen::Index d = 0; d < slip.size(); ++d)
      slip[d] += x[stage.point.slip[info_.contacts[i].tangent_index + d]] / tableau_.n_s;
    double product = 1;
    for (const int k : stage.force[i].slack) product *= x[k];
    slack = std::max(slack, product);
  }
  if (force <= x[element.right.gap[i]]) return ContactMode::open;
  if (slip.size() == 0) return ContactMode::closed;
  return slip.norm() > slack ? slip_mode(info_.contacts[i].n_t, slip.data()) : ContactMode::stick;
}

FesdStep FesdEquations::read(const Vector& x, int interval) const {
  const auto& elements = intervals_[static_cast<std::size_t>(interval)];
  FesdStep step;
  step.resize(plant_, tableau_.n_s, static_cast<int>(elements.size()));
  step.n_elements = static_cast<int>(elements.size());
  for (int n = 0; n < step.n_elements; ++n) {
    const ElementVariables& element = elements[n];
    Element& stages = step.elements[n];
    stages.h = x[element.h];
    step.H += stages.h;
    stages.q0 = values(x, element.left.q);
    stages.v0 = values(x, element.left.v);
    stages.q1 = values(x, element.right.q);
    stages.v1 = values(x, element.right.v);
    for (int j = 0; j < tableau_.n_s; ++j) {
      const Stage& stage = element.stages[j];
      stages.q.col(j) = values(x, stage.point.q);
      stages.v.col(j) = values(x, stage.point.v);
      stages.a.col(j) = values(x, stage.w);
      stages.lambda_n.col(j) = values(x, stage.lambda_n);
      stages.lambda_t.col(j) = values(x, tangential(stage.force));
    }
    step.v_minus.col(n) = values(x, element.v_minus);
    step.Lambda_n.col(n) = values(x, element.Lambda_n);
    step.Lambda_t.col(n) = values(x, tangential(element.impulse));
    for (int i = 0; i < info_.n_c(); ++i) stages.modes[i] = mode(element, i, x);
  }
  return step;
}

Matrix FesdEquations::theta(const Vector& x, int interval, int element) const {
  const auto& stages = intervals_[static_cast<std::size_t>(interval)][static_cast<std::size_t>(element)].stages;
  Matrix result(step_functions_.size(), tableau_.n_s);
  for (int j = 0; j < tableau_.n_s; ++j) result.col(j) = values(x, stages[j].theta);
  return result;
}

/// Cone::squared, from the guesses of v_t and lambda_t: 0 = -v_t - 2 gamma lambda_t.
void FesdEquations::guess_gamma(const Point& point, const std::vector<Slip>& slips, const std::vector<Force>& forces) {
  if (options_.cone != Cone::squared) return;
  auto& variables = mpcc_.nlp.variables;
  for (std::size_t i = 0; i < slips.size(); ++i) {
    if (slips[i].gamma.empty()) continue;
    double v_t = 0, lambda_t = 0;
    for (int d = 0; d < info_.contacts[i].n_t; ++d) {
      v_t = std::hypot(v_t, variables[point.slip[info_.contacts[i].tangent_index + d]].guess);
      lambda_t = std::hypot(lambda_t, variables[forces[i].lambda_t[d]].guess);
    }
    variables[slips[i].gamma[0]].guess = v_t > 0 ? std::min(v_t / (2 * lambda_t), kLargeGamma) : 0;
  }
}

void FesdEquations::set_guess(const FesdStep& step, int interval) {
  auto& variables = mpcc_.nlp.variables;
  const auto& elements = intervals_[static_cast<std::size_t>(interval)];
  for (std::size_t n = 0; n < elements.size(); ++n) {
    const ElementVariables& element = elements[n];
    const Element& stages = step.elements[n];
    const auto column = static_cast<Eigen::Index>(n);
    variables[element.h].guess = stages.h;
    guess_point(element.left, stages.q0, stages.v0, element.left_slip);
    guess_forces(element.impulse, step.Lambda_n.col(column), step.Lambda_t.col(column));
    guess_gamma(element.left, element.left_slip, element.impulse);
    const Vector theta =  // in the middle, since psi is zero at an end
        step_functions_.sides(0.5 * (stages.q0 + stages.q1), 0.5 * (stages.v0 + stages.v1));
    guess_switching(element.left, stages.q0, stages.v0, theta);
    const Matrix J = plant_.normal_jacobian(stages.q0);
    for (int i = 0; i < info_.n_c(); ++i) variables[element.Lambda_n[i]].guess = step.Lambda_n(i, column);
    guess_split(restitution(J, stages.v0, step.v_minus.col(column)), element.s_plus, element.s_minus);
    if (options_.no_capture) guess_split(J.transpose() * stages.v0, element.z_plus, element.z_minus);
    if (projects_) {
      const Matrix J_end = plant_.normal_jacobian(stages.q1), directions = plant_.force_directions(J_end);
      const Vector impulse = plant_.mass_matrix(stages.q1) * (stages.v1 - stages.v.col(tableau_.n_s - 1));
      Vector P = Vector::Zero(info_.n_c());
      std::vector<int> projected;
      for (int i = 0; i < info_.n_c(); ++i) {
        if (is_projected(i) && stages.modes[i] != ContactMode::open) projected.push_back(i);
      }
      if (!projected.empty()) {  // Eigen's decomposition needs a column
        const Vector solved = least_squares(directions(Eigen::all, projected), impulse);
        P(projected) = solved;
      }
      for (const int i : projected) variables[element.P[i]].guess = P[i];
      guess_split(P, element.p_plus, element.p_minus);
      guess_split(J_end.transpose() * stages.v1, element.r_plus, element.r_minus);
      for (int k = 0; k < info_.n_q; ++k) variables[element.right.v[k]].guess = stages.v1[k];
    }
    for (int j = 0; j < tableau_.n_s; ++j) {
      const Stage& stage = element.stages[j];
      guess_stage(stage, stages.q.col(j), stages.v.col(j), stages.a.col(j), stages.lambda_n.col(j),
                  stages.lambda_t.col(j), theta);
      guess_gamma(stage.point, stage.slip, stage.force);
    }
    if (stiffly_accurate_) continue;
    guess_point(element.right, stages.q1, stages.v1, element.right_slip);
    guess_switching(element.right, stages.q1, stages.v1, theta);
  }
}

}  // namespace ricochet
