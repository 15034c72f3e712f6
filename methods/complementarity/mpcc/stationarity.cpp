#include "methods/complementarity/mpcc/stationarity.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace ricochet {

namespace {

/// Contribution of one variable to linear rows: a x.
class LinearColumn : public NlpBlock {
 public:
  explicit LinearColumn(int variable) { variables = {variable}; }
  void add(double a, int row) {
    a_.push_back(a);
    rows.push_back(row);
  }

  void evaluate(const double* x, double* values) const override {
    std::ranges::transform(a_, values, [x](double a) { return a * x[0]; });
  }
  void jacobian(const double*, double* J) const override { std::ranges::copy(a_, J); }
  void hessian(const double*, const double*, double*) const override {}

 private:
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
    case Stationarity::unknown:
      break;
  }
  return "unknown";
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

  // (1) as rows: sum_i lambda_i g_i' - nu - residual = -f'.
  std::vector<std::unique_ptr<LinearColumn>> columns;
  for (int k = 0; k < n; ++k) {
    least_squares_.add_row(-gradient[k], -gradient[k], mpcc.nlp.variables[k].name);
    columns.push_back(
        std::make_unique<LinearColumn>(least_squares_.add_variable(-kInfinity, kInfinity, 0, "residual")));
    columns[k]->add(-1, k);
    least_squares_.add_block(std::make_unique<HalfSquare>(k));
  }
  // The multiplier of a value between bounds, `upper_sign` being its sign at the upper one; null when inactive.
  const auto add_multiplier = [&](double value, double lower, double upper, bool is_free, double upper_sign,
                                  const std::string& name) -> LinearColumn* {
    const bool at_lower = value - lower <= zero, at_upper = upper - value <= zero;
    if (!at_lower && !at_upper && !is_free) return nullptr;
    const bool has_sign = !is_free && at_lower != at_upper;
    const double sign = at_upper ? upper_sign : -upper_sign;
    columns.push_back(std::make_unique<LinearColumn>(least_squares_.add_variable(
        has_sign && sign > 0 ? 0 : -kInfinity, has_sign && sign < 0 ? 0 : kInfinity, 0, name)));
    return columns.back().get();
  };
  for (int k = 0; k < n; ++k) {
    const auto& variable = mpcc.nlp.variables[k];
    const bool is_free = is_held[k] && is_zero(k);
    LinearColumn* nu = add_multiplier(x[k], variable.lower, variable.upper, is_free, -1, variable.name);
    nu_.push_back(nu ? nu->variables[0] : -1);
    if (nu) nu->add(-1, k);
  }
  std::vector<LinearColumn*> lambda;
  for (int i = 0; i < m; ++i) {
    const auto& row = mpcc.nlp.rows[i];
    lambda.push_back(add_multiplier(g[i], row.lower, row.upper, false, 1, row.name));
  }
  for (int e = 0; e < jacobian.size(); ++e) {
    const int i = evaluator.jacobian_pattern().rows[e], k = evaluator.jacobian_pattern().columns[e];
    if (lambda[i]) lambda[i]->add(jacobian[e], k);
  }
  for (auto& column : columns)
    if (!column->rows.empty()) least_squares_.add_block(std::move(column));
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
