#include "methods/complementarity/mpcc/relaxation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/input_error.h"

namespace ricochet {

namespace {

/// (1), (2)
PairValue product_minus_sigma(double G, double H, double sigma) {
  return {.value = G * H - sigma, .d_G = H, .d_H = G, .d_GH = 1};
}

/// (3)
PairValue smoothed_fischer_burmeister(double G, double H, double sigma) {
  const double r = std::sqrt(G * G + H * H + 2 * sigma), g = G / r, h = H / r;
  return {G + H - r, 1 - g, 1 - h, (g * g - 1) / r, g * h / r, (h * h - 1) / r};
}

/// (4), upper curve
PairValue product_minus_sigma_squared(double G, double H, double sigma) {
  return {.value = G * H - sigma * sigma, .d_G = H, .d_H = G, .d_GH = 1};
}

/// (4), lower curve; sigma^2 cancels
PairValue shifted_product_minus_sigma_squared(double G, double H, double sigma) {
  return {.value = G * H + sigma * (G + H), .d_G = H + sigma, .d_H = G + sigma, .d_GH = 1};
}

/// (5)
PairValue product_of_excesses(double G, double H, double sigma) {
  return {.value = (G - sigma) * (H - sigma), .d_G = H - sigma, .d_H = G - sigma, .d_GH = 1};
}

/// (6)
PairValue smoothed_twice_minimum(double G, double H, double sigma) {
  const double a = G - H, z = a / sigma;
  double phi = std::abs(a), d_phi = a < 0 ? -1 : 1, dd_phi = 0;
  if (std::abs(z) < 1) {
    phi = sigma * (3 + z * z * (6 - z * z)) / 8;
    d_phi = z * (3 - z * z) / 2;
    dd_phi = 1.5 * (1 - z * z) / sigma;
  }
  return {G + H - phi, 1 - d_phi, 1 + d_phi, -dd_phi, dd_phi, -dd_phi};
}

/// (7)
PairValue product_over_sigma(double G, double H, double sigma) {
  return {.value = G * H / sigma, .d_G = H / sigma, .d_H = G / sigma, .d_GH = 1 / sigma};
}

/// (8)
PairValue product(double G, double H, double) {
  return {.value = G * H, .d_G = H, .d_H = G, .d_GH = 1};
}

/// f(G, H; sigma) - s for sums G, H of variables; the variables of G come first, then those of H, then s if there is
/// one.
class PairBlock : public NlpBlock {
 public:
  PairBlock(const Mpcc::Pair& pair, Relaxation::Function f, const double* sigma)
      : f_(f), sigma_(sigma), n_G_(pair.G.size()), n_GH_(n_G_ + pair.H.size()) {
    variables = pair.G;
    variables.insert(variables.end(), pair.H.begin(), pair.H.end());
  }

  bool is_piecewise() const override { return f_ == smoothed_twice_minimum; }

  void evaluate(const double* x, double* values) const override { values[0] = at(x).value - (has_s() ? x[n_GH_] : 0); }
  void jacobian(const double* x, double* J) const override {
    const PairValue f = at(x);
    for (std::size_t k = 0; k < n_GH_; ++k) J[k] = k < n_G_ ? f.d_G : f.d_H;
    if (has_s()) J[n_GH_] = -1;
  }
  void hessian(const double* x, const double* weights, double* H) const override {
    const PairValue f = at(x);
    for (std::size_t k = 0; k < n_GH_; ++k) {
      for (std::size_t l = 0; l < n_GH_; ++l) {
        const double entry = (k < n_G_) != (l < n_G_) ? f.d_GH : k < n_G_ ? f.d_GG : f.d_HH;
        H[k + l * variables.size()] = weights[0] * entry;
      }
    }
  }

 private:
  bool has_s() const { return variables.size() > n_GH_; }
  PairValue at(const double* x) const {
    double G = 0, H = 0;
    for (std::size_t k = 0; k < n_GH_; ++k) (k < n_G_ ? G : H) += x[k];
    return f_(G, H, *sigma_);
  }

  Relaxation::Function f_;
  const double* sigma_;
  std::size_t n_G_, n_GH_;
};

/// s / sigma of (8)
class ElasticPenalty : public NlpBlock {
 public:
  ElasticPenalty(int s, const double* sigma) : sigma_(sigma) { variables = {s}; }

  void evaluate(const double* x, double* values) const override { values[0] = x[0] / *sigma_; }
  void jacobian(const double*, double* J) const override { J[0] = 1 / *sigma_; }
  void hessian(const double*, const double*, double*) const override {}

 private:
  const double* sigma_;
};

/// Another program's block.
class BorrowedBlock : public NlpBlock {
 public:
  explicit BorrowedBlock(const NlpBlock& block) : block_(block) {
    variables = block.variables;
    rows = block.rows;
  }

  bool is_piecewise() const override { return block_.is_piecewise(); }
  void evaluate(const double* x, double* values) const override { block_.evaluate(x, values); }
  void jacobian(const double* x, double* J) const override { block_.jacobian(x, J); }
  void hessian(const double* x, const double* weights, double* H) const override { block_.hessian(x, weights, H); }

 private:
  const NlpBlock& block_;
};

}  // namespace

const std::vector<Relaxation>& relaxations() {
  static const std::vector<Relaxation> all = {
      {.name = "scholtes", .constraints = {{product_minus_sigma, -kInfinity, 0}}},
      {.name = "scholtes_equality", .constraints = {{product_minus_sigma, 0, 0}}},
      {.name = "fischer_burmeister", .constraints = {{smoothed_fischer_burmeister, 0, 0}}},
      {.name = "lin_fukushima",
       .constraints = {{product_minus_sigma_squared, -kInfinity, 0},
                       {shifted_product_minus_sigma_squared, 0, kInfinity}},
       .frees_bounds = true},
      {.name = "kadrani", .constraints = {{product_of_excesses, -kInfinity, 0}}, .frees_bounds = true},
      {.name = "steffensen_ulbrich", .constraints = {{smoothed_twice_minimum, -kInfinity, 0}}},
      {.name = "elastic_1", .penalty = product_over_sigma},
      {.name = "elastic_inf", .constraints = {{product, -kInfinity, 0}}, .has_elastic_variable = true},
  };
  return all;
}

const Relaxation& find_relaxation(std::string_view name) {
  const auto& all = relaxations();
  const auto found = std::ranges::find(all, name, &Relaxation::name);
  if (found != all.end()) return *found;
  std::vector<std::string_view> names;
  for (const auto& relaxation : all) names.push_back(relaxation.name);
  throw InputError("relaxation", name, fmt::format("one of {} is required", fmt::join(names, ", ")));
}

Nlp borrow(const Nlp& nlp) {
  Nlp copy;
  copy.variables = nlp.variables;
  copy.rows = nlp.rows;
  for (const auto& block : nlp.blocks) copy.add_block(std::make_unique<BorrowedBlock>(*block));
  return copy;
}

void copy_bounds(const Nlp& from, Nlp& to) {
  for (std::size_t k = 0; k < from.variables.size(); ++k) {
    to.variables[k].lower = from.variables[k].lower;
    to.variables[k].upper = from.variables[k].upper;
    to.variables[k].guess = from.variables[k].guess;
  }
  for (std::size_t i = 0; i < from.rows.size(); ++i) {
    to.rows[i].lower = from.rows[i].lower;
    to.rows[i].upper = from.rows[i].upper;
  }
}

RelaxedMpcc::RelaxedMpcc(const Mpcc& mpcc, const Relaxation& relaxation, double sigma)
    : mpcc_(mpcc), relaxation_(relaxation), sigma_(std::make_unique<double>(sigma)), nlp_(borrow(mpcc.nlp)) {
  int s = -1;
  if (relaxation.has_elastic_variable) {
    s = nlp_.add_variable(0, kInfinity, 1, "elastic variable");
    nlp_.add_block(std::make_unique<ElasticPenalty>(s, sigma_.get()));
  }
  for (const auto& pair : mpcc.pairs) {
    for (const auto& constraint : relaxation.constraints) {
      auto block = std::make_unique<PairBlock>(pair, constraint.c, sigma_.get());
      if (s >= 0) block->variables.push_back(s);
      block->rows = {nlp_.add_row(constraint.lower, constraint.upper, pair.name)};
      nlp_.add_block(std::move(block));
    }
    if (relaxation.penalty) nlp_.add_block(std::make_unique<PairBlock>(pair, relaxation.penalty, sigma_.get()));
  }
  set_sigma(sigma);
}

void RelaxedMpcc::update() {
  copy_bounds(mpcc_.nlp, nlp_);
  set_sigma(*sigma_);
}

void RelaxedMpcc::set_sigma(double sigma) {
  *sigma_ = sigma;
  if (!relaxation_.frees_bounds) return;
  // Every sum is >= -sigma: a variable of several sums obeys the longest.
  const auto for_each_side = [&](auto action) {
    for (const auto& pair : mpcc_.pairs) {
      for (const auto* side : {&pair.G, &pair.H})
        for (const int k : *side) action(nlp_.variables[k].lower, -sigma / static_cast<double>(side->size()));
    }
  };
  for_each_side([&](double& lower, double) { lower = -sigma; });
  for_each_side([](double& lower, double bound) { lower = std::max(lower, bound); });
}

}  // namespace ricochet
