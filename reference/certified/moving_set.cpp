#include "reference/certified/moving_set.h"

#include <arb_mat.h>

#include <algorithm>
#include <cmath>

namespace ricochet::reference::certified {
namespace {

constexpr slong kMatrixBits = 128;  // of products with radii

// The variation multiplies radii only. The degree D of its polynomials is a third of N. Where the last term of the motion
// is (z h)^N / N! = 2^-bits, that of degree D is about 2^(-(bits - N log2(3)) / 3), which is 2^(-bits / 7); of a series
// with a radius of convergence it is 2^(-bits / 3). A relative error of this size does not matter to radii.
constexpr slong kVariationBits = 96;
constexpr int kVariationShare = 3;

/// Orthonormal directions of the columns of D, those of greatest length first, filled up with unit vectors. Doubles
/// suffice: every regular matrix is allowed as Q.
std::vector<std::vector<double>> orthonormal_directions(const std::vector<std::vector<double>>& D) {
  const std::size_t m = D.size();
  std::vector<std::vector<double>> columns;
  for (std::size_t k = 0; k < m; ++k) {
    columns.emplace_back();
    for (std::size_t i = 0; i < m; ++i) columns.back().push_back(D[i][k]);
  }
  const auto dot = [&](const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < m; ++i) sum += a[i] * b[i];
    return sum;
  };
  std::ranges::stable_sort(columns, [&](const auto& a, const auto& b) { return dot(a, a) > dot(b, b); });
  for (std::size_t k = 0; k < m; ++k) {
    columns.emplace_back(m, 0.0);
    columns.back()[k] = 1;
  }
  std::vector<std::vector<double>> basis;
  for (auto& column : columns) {
    const double length = dot(column, column);
    for (int pass = 0; pass < 2; ++pass) {
      for (const auto& known : basis) {
        const double along = dot(column, known);
        for (std::size_t i = 0; i < m; ++i) column[i] -= along * known[i];
      }
    }
    const double rest = dot(column, column);
    if (basis.size() == m || !(rest > 1e-24 * length) || !std::isfinite(rest)) continue;
    for (double& entry : column) entry /= std::sqrt(rest);
    basis.push_back(column);
  }
  return basis;
}

/// The inverse of a matrix of doubles, given by columns. @throws Undecided if it may be singular
std::vector<std::vector<Ball>> inverse(const std::vector<std::vector<double>>& columns) {
  const auto m = static_cast<slong>(columns.size());
  arb_mat_t A, I;
  arb_mat_init(A, m, m);
  arb_mat_init(I, m, m);
  for (slong i = 0; i < m; ++i) {
    for (slong k = 0; k < m; ++k) arb_set_d(arb_mat_entry(A, i, k), columns[k][i]);
  }
  const bool regular = arb_mat_inv(I, A, kMatrixBits) != 0;
  std::vector<std::vector<Ball>> result(m);
  for (slong i = 0; i < m; ++i) {
    for (slong k = 0; k < m; ++k) result[i].emplace_back(arb_mat_entry(I, i, k));
  }
  arb_mat_clear(A);
  arb_mat_clear(I);
  if (!regular) throw Undecided("the directions of the mean value form are dependent");
  return result;
}

}  // namespace

MovingSet::MovingSet(const SceneFormulas& scene, SeriesProgram& program, TaylorStep& step, bool mean_value_form)
    : scene_(scene), p_(program), step_(step), box_(scene.start) {
  if (mean_value_form) take_mean_value_form();
}

void MovingSet::take_mean_value_form() {
  if (form_) return;
  form_ = true;
  phi_.assign(box_.size(), std::vector<Node>(box_.size()));
  for (auto& row : phi_) {
    for (Node& entry : row) entry = p_.state();
  }
  reset();
}

void MovingSet::set_box(std::vector<Ball> box) {
  box_ = std::move(box);
  if (form_) reset();
}

void MovingSet::reset() {
  const std::size_t m = box_.size();
  center_.resize(m);
  r_.resize(m);
  Q_.assign(m, std::vector<Ball>(m));
  for (std::size_t i = 0; i < m; ++i) {
    center_[i] = box_[i].midpoint();
    r_[i] = Ball();
    r_[i].widen(arb_radref(box_[i].get()));
    Q_[i][i] = Ball(1.0);
  }
}

void MovingSet::begin(const ModeMotion& motion) {
  varies_ = form_ && motion.starts.empty();
  if (!varies_) return;
  variation_ = variation_of(motion, scene_, phi_, p_);
  variation_.bits = kVariationBits;
  variation_.degree = p_.precision().order / kVariationShare;
}

void MovingSet::expand(const ModeMotion& motion, const Ball& t) {
  step_.load(box_, t);
  if (varies_)
    step_.expand(motion, variation_, Q_);
  else
    step_.expand(motion, p_.precision().order);
}

bool MovingSet::validate(const ModeMotion& motion, double h) {
  return step_.validate(motion, h) && (!varies_ || step_.validate(motion, variation_, h));
}

void MovingSet::advance(const ModeMotion& motion, const Ball& t, double h, const Ball& tau, bool at_event) {
  const std::size_t m = box_.size(), n = m / 2;
  const slong bits = p_.precision().bits;
  const auto state = [&](std::size_t i) { return i < n ? scene_.q[i] : scene_.v[i - n]; };
  std::vector<Ball> image(m);
  for (std::size_t i = 0; i < m; ++i) image[i] = step_.at(state(i), h, tau, bits);
  if (!varies_) {
    set_box(std::move(image));
    return;
  }
  BallMatrix B(m, std::vector<Ball>(m));
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t k = 0; k < m; ++k) B[i][k] = step_.at_of_variation(variation_, i, k, h, tau, kMatrixBits);
  }
  step_.load(center_, t);
  step_.expand(motion, p_.precision().order);
  if (!step_.validate(motion, h)) throw Undecided("the remainder of the centre is not proven");
  const Precision& a = p_.precision();
  std::vector<Ball> moved(m);
  for (std::size_t i = 0; i < m; ++i) moved[i] = step_.at(state(i), h, tau, bits);
  if (at_event) {
    for (std::size_t i = 0; i < m; ++i) {
      Ball sum = moved[i], both;
      for (std::size_t k = 0; k < m; ++k) sum = a.add(sum, a.mul(B[i][k], r_[k]));
      box_[i] = arb_intersection(both.get(), sum.get(), image[i].get(), bits) ? both : sum;
    }
    reset();
    return;
  }
  turn(B, moved);
}

/// New directions: c + Q r contains `moved` + B r. The box must contain c, so that the mean value theorem applies.
void MovingSet::turn(const BallMatrix& B, const std::vector<Ball>& moved) {
  const std::size_t m = box_.size();
  const Precision a{kMatrixBits, p_.precision().order};
  double widest = -1e300;
  std::vector<double> width(m);
  for (std::size_t k = 0; k < m; ++k) {
    width[k] = std::max(-1e5, r_[k].log10_radius());
    widest = std::max(widest, width[k]);
  }
  std::vector<std::vector<double>> D(m, std::vector<double>(m));
  for (std::size_t k = 0; k < m; ++k) {
    const double weight = std::pow(10., std::max(-250., width[k] - widest));
    for (std::size_t i = 0; i < m; ++i) D[i][k] = B[i][k].nearest() * weight;
  }
  const auto U = orthonormal_directions(D);
  if (U.size() != m) throw Undecided("the directions of the mean value form are not finite");
  const BallMatrix inverse_U = inverse(U);
  std::vector<Ball> rest(m), r(m);
  for (std::size_t i = 0; i < m; ++i) {
    center_[i] = moved[i].midpoint();
    rest[i].widen(arb_radref(moved[i].get()));
  }
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j < m; ++j) r[i] = a.add(r[i], a.mul(inverse_U[i][j], rest[j]));
    for (std::size_t k = 0; k < m; ++k) {
      Ball along;
      for (std::size_t j = 0; j < m; ++j) along = a.add(along, a.mul(inverse_U[i][j], B[j][k]));
      r[i] = a.add(r[i], a.mul(along, r_[k]));
    }
  }
  r_ = std::move(r);
  const Precision& full = p_.precision();
  for (std::size_t i = 0; i < m; ++i) {
    Ball sum = center_[i];
    for (std::size_t k = 0; k < m; ++k) {
      Q_[i][k] = Ball(U[k][i]);
      sum = full.add(sum, full.mul(Q_[i][k], r_[k]));
    }
    box_[i] = sum;
  }
}

}  // namespace ricochet::reference::certified
