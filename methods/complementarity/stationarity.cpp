#include "methods/complementarity/stationarity.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ricochet {

namespace {

/// c + sum_k a_k x_k
class LinearRow : public NlpBlock {
 public:
  LinearRow(int row, double c) : c_(c) { rows = {row}; }
  void add(double a, int variable) {
    a_.push_back(a);
    variables.push_back(variable);
  }

  void evaluate(const double* x, double* values) const override {
    values[0] = std::inner_product(a_.begin(), a_.end(), x, c_);
  }
  void jacobian(const double*, double* J) const override { std::ranges::copy(a_, J); }
  void hessian(const double*, const double*, double*) const override {}

 private:
  double c_;
  std::vector<double> a_;
};

/// x^2 / 2
class HalfSquare : public NlpBlock {
 public:
  explicit HalfSquare(int variable) { variables = {variable}; }

  void evaluate(const double* x, double* values) const override { values[0] = x[0] * x[0] / 2; }
  void jacobian(const double* x, double* J) const override { J[0] = x[0]; }
  void hessian(const double*, const double* weights, double* H) const override { H[0] = weights[0]; }
};

}  // namespace

const char* to_string(Stationarity stationarity) {
  switch (stationarity) {
    case Stationarity::W:
      return "W";
    case Stationarity::C:
      return "C";
    case Stationarity::M:
      return "M";
    case Stationarity::S:
      return "S";
    default:
      return "unknown";
  }
}

StationarityTest::StationarityTest(const Mpcc& mpcc, const Vector& x, double zero) {
  const int n = mpcc.nlp.n_variables(), m = mpcc.nlp.n_rows();
  NlpEvaluator evaluator(mpcc.nlp);
  Vector gradient(n), g(m), jacobian(evaluator.jacobian_pattern().size());
  evaluator.gradient(x.data(), gradient.data());
  evaluator.constraints(x.data(), g.data());
  evaluator.jacobian(x.data(), jacobian.data());
  tolerance_ = zero * (1 + gradient.lpNorm<Eigen::Infinity>());
  n_residuals_ = n;

  const auto is_zero = [&](int k) { return x[k] <= zero; };
  std::vector<char> is_held(n, false);  // by a variable of the other side that is not zero
  for (const auto& pair : mpcc.pairs) {
    const bool G_is_held = !std::ranges::all_of(pair.H, is_zero), H_is_held = !std::ranges::all_of(pair.G, is_zero);
    for (const int v : pair.G) is_held[v] |= G_is_held;
    for (const int w : pair.H) is_held[w] |= H_is_held;
  }
  for (const auto& pair : mpcc.pairs) {
    for (const int v : pair.G)
      for (const int w : pair.H)
        if (is_zero(v) && is_zero(w) && !is_held[v] && !is_held[w]) biactive_.push_back({v, w});
  }

  std::vector<LinearRow*> equations;  // (1)
  for (int k = 0; k < n; ++k) {
    const int r = least_squares_.add_variable(-kInfinity, kInfinity, 0, "residual");
    least_squares_.add_block(std::make_unique<HalfSquare>(r));
    const int row = least_squares_.add_row(0, 0, mpcc.nlp.variables[k].name);
    auto equation = std::make_unique<LinearRow>(row, gradient[k]);
    equation->add(-1, r);
    equations.push_back(equation.get());
    least_squares_.add_block(std::move(equation));
  }
  /// The multiplier of a value between bounds; -1 when it is inactive.
  const auto add_multiplier = [&](double value, double lower, double upper, bool is_free, double upper_sign,
                                  const std::string& name) {
    const bool at_lower = value - lower <= zero, at_upper = upper - value <= zero;
    if (!at_lower && !at_upper && !is_free) return -1;
    const double sign = at_lower ? -upper_sign : upper_sign;
    const bool has_sign = !is_free && at_lower != at_upper;
    return least_squares_.add_variable(has_sign && sign > 0 ? 0 : -kInfinity, has_sign && sign < 0 ? 0 : kInfinity, 0,
                                       name);
  };
  for (int k = 0; k < n; ++k) {
    const auto& variable = mpcc.nlp.variables[k];
    nu_.push_back(add_multiplier(x[k], variable.lower, variable.upper, is_held[k] && is_zero(k), -1, variable.name));
    if (nu_[k] >= 0) equations[k]->add(-1, nu_[k]);
  }
  std::vector<int> lambda;
  for (int i = 0; i < m; ++i)
    lambda.push_back(
        add_multiplier(g[i], mpcc.nlp.rows[i].lower, mpcc.nlp.rows[i].upper, false, 1, mpcc.nlp.rows[i].name));
  for (int e = 0; e < jacobian.size(); ++e) {
    const int i = evaluator.jacobian_pattern().rows[e], k = evaluator.jacobian_pattern().columns[e];
    if (lambda[i] >= 0) equations[k]->add(jacobian[e], lambda[i]);
  }
}

/// Whether (1) has a solution with these signs.
bool StationarityTest::exists(const std::vector<Signs>& signs, const IpoptOptions& ipopt) {
  const auto set = [&](int k, double lower, double upper) {
    auto& nu = least_squares_.variables[nu_[k]];
    nu.lower = std::max(nu.lower, lower);
    nu.upper = std::min(nu.upper, upper);
  };
  for (const auto& [v, w] : biactive_) {
    for (const int k : {v, w}) {
      least_squares_.variables[nu_[k]].lower = -kInfinity;
      least_squares_.variables[nu_[k]].upper = kInfinity;
    }
  }
  for (std::size_t i = 0; i < signs.size(); ++i) {
    const auto [v, w] = biactive_[i];
    if (signs[i] == Signs::v_zero) set(v, 0, 0);
    if (signs[i] == Signs::w_zero) set(w, 0, 0);
    for (const int k : {v, w}) {
      if (signs[i] == Signs::both_positive) set(k, 0, kInfinity);
      if (signs[i] == Signs::both_negative) set(k, -kInfinity, 0);
    }
  }
  const NlpResult result = IpoptSolver(least_squares_).solve(ipopt);
  return is_solved(result.status) && result.point.x.head(n_residuals_).lpNorm<Eigen::Infinity>() <= tolerance_;
}

/// Whether (1) has a solution with one of the choices for each biactive pair.
bool StationarityTest::exists_any(const std::vector<Signs>& choices, const IpoptOptions& ipopt) {
  std::vector<std::size_t> choice(biactive_.size(), 0);
  std::vector<Signs> signs(biactive_.size());
  while (true) {
    std::ranges::transform(choice, signs.begin(), [&](std::size_t k) { return choices[k]; });
    if (exists(signs, ipopt)) return true;
    std::size_t i = 0;  // counts in base choices.size()
    while (i < choice.size() && ++choice[i] == choices.size()) choice[i++] = 0;
    if (i == choice.size()) return false;
  }
}

bool StationarityTest::is_S(const IpoptOptions& ipopt) {
  return exists_any({Signs::both_positive}, ipopt);
}

Stationarity StationarityTest::classify(const IpoptOptions& ipopt) {
  if (is_S(ipopt)) return Stationarity::S;
  if (!exists_any({Signs::any}, ipopt)) return Stationarity::unknown;
  if (biactive_.size() > max_enumerated) return Stationarity::W;
  if (exists_any({Signs::v_zero, Signs::w_zero, Signs::both_positive}, ipopt)) return Stationarity::M;
  return exists_any({Signs::both_positive, Signs::both_negative}, ipopt) ? Stationarity::C : Stationarity::W;
}

}  // namespace ricochet
