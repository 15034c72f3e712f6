#include "methods/mpcc_equations/time_stepping_equations.h"

#include <fmt/format.h>

#include <algorithm>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "problems/input_error.h"
#include "problems/join.h"

namespace ricochet {
namespace {

using Law = TimeSteppingEquations::Law;

// q_m of (4).
constexpr double kPredicted = 0.5;

Law law_of(const ProblemInfo& info, const std::optional<Law>& wanted) {
  const bool rebounds =
      std::ranges::any_of(info.contacts, [](const ContactInfo& contact) { return contact.eps_r > 0; });
  if (rebounds && wanted == Law::position)
    throw InputError("contact law", "position", "a plant without restitution is required: every eps_r = 0");
  return wanted.value_or(rebounds ? Law::velocity : Law::position);
}

/// x_1 - x_0 - h d: inputs (h, x_0, x_1, d).
SmoothFunction implicit_euler() {
  const GiNaC::symbol h, start, end, slope;
  return {{end - start - h * slope}, {h, start, end, slope}, {}};
}

}  // namespace

TimeSteppingEquations::TimeSteppingEquations(const Problem& plant, const Options& options, Mpcc& mpcc)
    : ContactEquations(plant, options.cone, options.facets, kPredicted, mpcc),
      law_(law_of(plant.info(), options.law)),
      implicit_euler_(implicit_euler()) {}

ContactEquations::Point TimeSteppingEquations::add_step(const Point& left, const std::vector<int>& u, int h) {
  const std::string name = fmt::format("step {}", steps_.size() + 1);
  Step step{.h = h, .left = left, .end = {}, .g_plus = {}, .g_minus = {}, .s_plus = {}, .s_minus = {}};
  step.end = add_stage(u, law_ == Law::position, name);  // (2)
  const Point& point = step.end.point;
  for (int k = 0; k < info_.n_q; ++k) {  // (1)
    if (is_of_element(k)) continue;
    add_equations(implicit_euler_, {h, left.q[k], point.q[k], point.v[k]}, fmt::format("{}, position {}", name, k));
    add_equations(implicit_euler_, {h, left.v[k], point.v[k], step.end.w[k]}, fmt::format("{}, velocity {}", name, k));
  }
  if (law_ == Law::velocity) add_velocity_law(step, name);
  for (std::size_t i = 0; i < info_.contacts.size(); ++i) {
    const std::string at = fmt::format("{}, {}", name, info_.contacts[i].name);
    if (info_.contacts[i].is_friction_element) {
      // lambda_n is its bound
    } else if (law_ == Law::position) {
      mpcc_.add_pair({step.end.lambda_n[i]}, {point.gap[i]}, at + ", lambda_n _|_ gap");  // (3)
    } else {                                                                              // (4)
      mpcc_.add_pair({step.end.lambda_n[i]}, {step.g_plus[i], step.s_plus[i]}, at + ", lambda_n _|_ g+ + s+");
      mpcc_.add_pair({step.g_plus[i]}, {step.g_minus[i]}, at + ", g+ _|_ g-");
      mpcc_.add_pair({step.g_minus[i]}, {step.s_minus[i]}, at + ", g- _|_ s-");
    }
    if (info_.contacts[i].n_t == 0) continue;
    const Slip& slip = step.end.slip[i];
    for (std::size_t d = 0; d < slip.xi_plus.size(); ++d)
      mpcc_.add_pair({slip.xi_plus[d]}, {slip.xi_minus[d]}, at + ", xi+ _|_ xi-");
    add_friction_pairs(slip, step.end.force[i], 1, at);
  }
  for (int k = 0; k < step_functions_.size(); ++k) {  // (5) of contact_equations.h
    const std::string at = fmt::format("{}, psi {}", name, k);
    mpcc_.add_pair({point.psi_plus[k]}, {step.end.theta_rest[k]}, at + ", psi+ _|_ 1 - theta");
    mpcc_.add_pair({point.psi_minus[k]}, {step.end.theta[k]}, at + ", psi- _|_ theta");
  }
  steps_.push_back(std::move(step));
  return steps_.back().end.point;
}

/// The rows of (4)
void TimeSteppingEquations::add_velocity_law(Step& step, const std::string& name) {
  const int n_c = info_.n_c();
  const auto add_parts = [&](std::vector<int>& plus, std::vector<int>& minus, const std::string& what) {
    plus = add_variables(n_c, 0, kPositive, fmt::format("{}, {}+", name, what));
    minus = add_variables(n_c, 0, kPositive, fmt::format("{}, {}-", name, what));
  };
  add_parts(step.g_plus, step.g_minus, "g");
  add_parts(step.s_plus, step.s_minus, "s");
  for (const auto* parts : {&step.g_plus, &step.g_minus, &step.s_plus, &step.s_minus}) fix_elements(*parts);
  const int first = mpcc_.nlp.n_rows();
  add_split(functions_.ahead, join<int>({step.left.q, step.left.v, {step.h}}), name + ", predicted gap", step.g_plus,
            step.g_minus);
  add_split(functions_.restitution, join<int>({step.end.point.q, step.end.point.v, step.left.v}),
            name + ", restitution", step.s_plus, step.s_minus);
  drop_elements(first);
  drop_elements(first + n_c);
}

void TimeSteppingEquations::set_guess(int number, double h, const Vector& q_k, const Vector& v_k, const Vector& q,
                                      const Vector& v, const Vector& lambda_n, const Vector& lambda_t) {
  auto& variables = mpcc_.nlp.variables;
  const Step& step = steps_[number];
  variables[step.h].guess = h;
  guess_stage(step.end, q, v, (v - v_k) / h, lambda_n, lambda_t, step_functions_.sides(q, v));
  if (law_ == Law::position) return;
  guess_split(plant_.gap(q_k + kPredicted * h * v_k), step.g_plus, step.g_minus);
  guess_split(restitution(plant_.normal_jacobian(q), v, v_k), step.s_plus, step.s_minus);
}

}  // namespace ricochet
