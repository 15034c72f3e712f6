#include "problems/regions/region_problems.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "problems/dense_solve.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kZero = 1e-13;        // of the terms of a gap or psi_k: a rounded zero
constexpr double kOnBorder = 1e-9;     // of the terms of psi_k: a border that was located
constexpr double kBegin = 1e-12;       // of the time: an impact with which a piece begins
constexpr double kSlow = 0.1;          // of leaves_slowly()
constexpr double kDifference = 1e-5;   // [s], along which slopes of psi_k are compared
constexpr double kPenetration = 1e-6;  // of a gap that jumps below zero, relative to 1 + |q|

/// The derivative of psi_k by (q, v), 2 n_q.
Vector slope_at(const Problem& region, int k, const Vector& q, const Vector& v) {
  Matrix D(std::ssize(region.info().region), 2 * q.size() + std::ssize(region.info().parameters));
  region.switching_derivative(q.data(), v.data(), D.data());
  return D.row(k).head(2 * q.size());
}

struct BorderRate {
  double rate, terms;  // psi_k' of (1) in the header, without contact forces; the size of its terms
  Vector of_q, of_v;   // derivatives of psi_k
};

BorderRate rate_at(const Problem& region, int k, const Vector& q, const Vector& v) {
  const Vector slope = slope_at(region, k, q, v), a = region.free_acceleration(q, v);
  const Vector of_q = slope.head(q.size()), of_v = slope.tail(q.size());
  return {.rate = of_q.dot(v) + of_v.dot(a), .terms = of_q.cwiseAbs().dot(v.cwiseAbs()), .of_q = of_q, .of_v = of_v};
}

std::vector<int> with_side(std::vector<int> signs, int k, int sigma) {
  signs[static_cast<std::size_t>(k)] = sigma;
  return signs;
}

/// Whether contact i acts on the functions on which the `region` slides.
bool acts_on_sliding(const Problem& region, int i) {
  const SymbolicProblem* formulas = region.symbolic();
  if (formulas == nullptr) return false;
  const std::vector<int>& acting = formulas->model().acting;
  return i < std::ssize(acting) && acting[static_cast<std::size_t>(i)] != 0;
}

}  // namespace

RegionProblems::~RegionProblems() {
  const std::lock_guard lock(formulas_mutex());
  made_.clear();
}

Problem& RegionProblems::at(const std::vector<int>& signs) {
  auto& region = made_[signs];
  if (!region) {
    const std::lock_guard lock(formulas_mutex());
    region = problem_.in_region(signs);
  }
  return *region;
}

std::string jumped_gap(const Problem& region, const Vector& q, const SwitchInfo& psi) {
  const Vector gap = region.gap(q),
               size = region.normal_jacobian(q).cwiseAbs().transpose() * (1 + q.array().abs()).matrix();
  for (const int i : region.info().unilateral) {
    if (gap[i] < -kPenetration * (1 + size[i]))
      return fmt::format("the gap of '{}' jumps to {:.3g} m where {} = 0", region.info().contacts[i].name, gap[i],
                         psi.formula);
  }
  return {};
}

std::string ambiguous_start(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs) {
  const ProblemInfo& info = problem.info();
  const Vector &q = info.q0, &v = info.v0;
  const Eigen::Index n_s = std::ssize(info.switches);
  Vector psi(n_s);
  problem.switching(q.data(), v.data(), psi.data());
  const Vector size = problem.switching_sizes(q, v);
  const Vector gap_size = problem.normal_jacobian(q).cwiseAbs().transpose() * (1 + q.array().abs()).matrix();
  const bool touches = (problem.gap(q).array() <= kZero * (1 + gap_size.array())).any();
  for (int k = 0; k < n_s; ++k) {
    if (touches || info.switches[k].is_of_time || k == info.until || std::abs(psi[k]) > kZero * size[k]) continue;
    const auto away = [&](int sigma) {  // sigma psi_k', or sigma psi_k''
      const BorderRate at = rate_at(regions.at(with_side(signs, k, sigma)), k, q, v);
      if (!at.of_v.isZero(0) || std::abs(at.rate) > kZero * (at.terms + size[k])) return sigma * at.rate;
      const Problem& region = regions.at(with_side(signs, k, sigma));
      const Vector change =
          (slope_at(region, k, q + kDifference * v, v) - slope_at(region, k, q - kDifference * v, v)).head(q.size()) /
          (2 * kDifference);
      return sigma * (at.of_q.dot(region.free_acceleration(q, v)) + change.dot(v));
    };
    if (away(1) > 0 && away(-1) > 0)
      return fmt::format("the motion is not unique: it begins at {} = 0, and both sides lead away",
                         info.switches[k].formula);
  }
  return {};
}

bool can_slide(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k,
               const std::vector<ContactMode>& modes, std::string& why_not) {
  try {
    const Problem& region = regions.at(with_side(signs, k, 0));
    for (int i = 0; i < std::ssize(modes); ++i) {
      if (!is_closed(modes[static_cast<std::size_t>(i)]) || !acts_on_sliding(region, i)) continue;
      why_not = fmt::format("'{}', which acts on it, is closed", problem.info().contacts[i].name);
      return false;
    }
  } catch (const InputError& e) {
    why_not = e.what();
    return false;
  }
  return true;
}

bool slides(const Problem& problem, RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q,
            const Vector& v, const std::vector<ContactMode>& modes, std::string& why_not) {
  const double size = problem.switching_sizes(q, v)[k];
  Vector psi(std::ssize(signs));
  problem.switching(q.data(), v.data(), psi.data());
  if (std::abs(psi[k]) > kOnBorder * size) return false;
  for (const int sigma : {1, -1}) {
    const BorderRate at = rate_at(regions.at(with_side(signs, k, sigma)), k, q, v);
    if (at.of_v.isZero(0) || sigma * at.rate >= -kZero * (at.terms + size)) return false;
  }
  return can_slide(problem, regions, signs, k, modes, why_not);
}

bool leaves_slowly(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v) {
  const int side = signs[static_cast<std::size_t>(k)];
  const double here = side * rate_at(regions.at(signs), k, q, v).rate,
               beyond = -side * rate_at(regions.at(with_side(signs, k, -side)), k, q, v).rate;
  return beyond < 0 && std::abs(here) < kSlow * std::abs(beyond);
}

int side_of_exit(RegionProblems& regions, const std::vector<int>& signs, int k, const Vector& q, const Vector& v) {
  const auto away = [&](int sigma) { return sigma * rate_at(regions.at(with_side(signs, k, sigma)), k, q, v).rate; };
  return away(1) > away(-1) ? 1 : -1;
}

void hold_on_borders(RegionProblems& regions, const std::vector<int>& signs, const Vector& q, Vector& v) {
  std::vector<int> inside = signs;  // a region that has psi_k
  std::vector<Eigen::Index> held;
  for (std::size_t k = 0; k < signs.size(); ++k) {
    if (signs[k] != 0) continue;
    held.push_back(static_cast<Eigen::Index>(k));
    inside[k] = 1;
  }
  if (held.empty()) return;
  const Problem& region = regions.at(inside);
  Vector psi(std::ssize(signs));
  for (int iteration = 0; iteration < 2; ++iteration) {
    region.switching(q.data(), v.data(), psi.data());
    Matrix slope(q.size(), std::ssize(held));
    for (Eigen::Index l = 0; l < slope.cols(); ++l)
      slope.col(l) = slope_at(region, static_cast<int>(held[static_cast<std::size_t>(l)]), q, v).tail(q.size());
    const Matrix y = CholeskyFactors(region.mass_matrix(q)).solve_columns(slope);
    v -= y * Eigen::CompleteOrthogonalDecomposition<Matrix>(slope.transpose() * y).solve(Vector(psi(held)));
  }
}

ActingContact acting_contact(const Problem& region, const Solution& piece) {
  const auto event =
      std::ranges::find_if(piece.events, [&](const Event& e) { return acts_on_sliding(region, e.contact); });
  const bool has_event = event != piece.events.end();
  for (int i = 0; i < std::ssize(piece.initial_modes); ++i) {
    const bool begins_with_event = has_event && event->contact == i && event->t <= kBegin * region.info().end_time;
    if (is_closed(piece.initial_modes[static_cast<std::size_t>(i)]) && acts_on_sliding(region, i) && !begins_with_event)
      return {.contact = i, .t = 0, .is_closed = true};
  }
  return has_event ? ActingContact{.contact = event->contact, .t = event->t, .is_closed = false} : ActingContact();
}

}  // namespace ricochet
