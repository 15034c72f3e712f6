#include "reference/certified/motion_by_regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>

#include "problems/derivatives/symbolic_problem.h"

namespace ricochet::reference::certified {

MotionByRegions::MotionByRegions(const Problem& problem, const Options& options, const Precision& precision,
                                 const TimeLimit& limit, int cut)
    : problem_(problem),
      options_(options),
      precision_(precision),
      limit_(limit),
      cut_(cut),
      signs_(problem.info().switches.size(), 1) {}

MotionByRegions::~MotionByRegions() {
  motion_.reset();
  const std::lock_guard lock(formulas_mutex());
  regions_.clear();
}

MotionByRegions::Region& MotionByRegions::region(const Signs& signs) {
  auto& region = regions_[signs];
  if (region) return *region;
  region = std::make_unique<Region>(precision_);
  if (!signs.empty()) {
    const std::lock_guard lock(formulas_mutex());
    region->problem = problem_.in_region(signs);
  }
  const Problem& problem = region->problem ? *region->problem : problem_;
  region->scene = scene_formulas(problem, options_.reading, region->program);
  return *region;
}

std::unique_ptr<HybridMotion> MotionByRegions::in(const Signs& signs) {
  Region& place = region(signs);
  return std::make_unique<HybridMotion>(place.scene, place.program, options_, limit_, cut_);
}

/// Finds the signs at t = 0, one after the other, since psi_k depends on those before it. @returns the borders that
/// are zero
std::vector<int> MotionByRegions::find_start(Signs& signs) {
  std::vector<int> zero;
  for (std::size_t k = 0; k < signs.size(); ++k) {
    const auto piece = in(signs);
    std::vector<int> others;
    for (std::size_t j = 0; j < signs.size(); ++j) {
      if (j != k) others.push_back(static_cast<int>(j));
    }
    if (region(signs).scene.borders[k].is_zero)
      zero.push_back(static_cast<int>(k));
    else if (!piece->borders_left(others).empty())
      signs[k] = -1;
  }
  return zero;
}

void MotionByRegions::start() {
  const std::vector<int> zero = find_start(signs_);
  if (!zero.empty()) {
    start_on_borders(signs_, zero);
    return;
  }
  motion_ = in(signs_);
  if (sensitivities_ && signs_.empty()) motion_->follow(*sensitivities_);
}

/// Chooses the signs of functions that are zero at the start by (7).
void MotionByRegions::start_on_borders(Signs signs, const std::vector<int>& zero) {
  constexpr std::size_t kMost = 4;  // borders
  const auto doubt = [&](std::size_t k) {
    return fmt::format("the motion slides on {} = 0 at t = 0, or is not unique",
                       region(signs).scene.borders[static_cast<std::size_t>(zero[k])].formula);
  };
  if (zero.size() > kMost) throw Unsupported("many borders meet at t = 0");
  std::vector<Sign> common;
  for (unsigned choice = 0; choice < 1U << zero.size(); ++choice) {
    for (std::size_t k = 0; k < zero.size(); ++k) signs[zero[k]] = (choice >> k & 1U) != 0 ? -1 : 1;
    auto piece = in(signs);
    if (!piece->borders_left(zero).empty()) throw Unsupported("borders inside of borders at t = 0");
    for (const int k : zero) {
      if (!region(signs).scene.borders[k].is_zero) throw Unsupported("borders inside of borders at t = 0");
    }
    const std::vector<Sign> rates = piece->begin_on_borders(zero);  // of sigma_k psi_k
    bool is_inside = true;
    for (std::size_t k = 0; k < zero.size(); ++k) {
      const bool is_positive = rates[k] == Sign::positive;
      is_inside = is_inside && is_positive;
      const Sign direction = is_positive == (signs[zero[k]] > 0) ? Sign::positive : Sign::negative;  // of psi_k
      if (choice == 0) common.push_back(direction);
      if (common[k] != direction) throw Unsupported(doubt(k));
    }
    if (!is_inside) continue;
    motion_ = std::move(piece);
    signs_ = signs;
  }
}

/// Enters the region after a border or an impact.
void MotionByRegions::cross() {
  const HybridMotion::Exit exit = *motion_->exit();
  for (const int k : exit.changed) signs_[k] = -signs_[k];
  const std::vector<int> zero = exit.border < 0 ? std::vector<int>{} : std::vector<int>{exit.border};
  std::unique_ptr<HybridMotion> next;
  for (std::size_t n = 0;; ++n) {  // psi_j depends on the signs before it
    next = in(signs_);
    next->place_at(*motion_);
    const std::vector<int> left = next->borders_left(zero);
    if (left.empty()) break;
    if (n > signs_.size()) throw Unsupported("a formula jumps to and fro");
    signs_[left.front()] *= -1;
  }
  const auto before = std::move(motion_);
  motion_ = std::move(next);
  motion_->enter(*before);
}

/// Whether ProblemInfo::until has changed its sign.
bool MotionByRegions::has_ended() const {
  const auto& exit = motion_->exit();
  if (!exit || std::ranges::count(exit->changed, problem_.info().until) == 0) return false;
  if (!motion_->has_advanced())
    throw Unsupported("an impact at t = 0 changes the sign of the formula that ends the run");
  return true;
}

void MotionByRegions::run() {
  start();
  motion_->run();
  while (motion_->exit() && !has_ended()) {
    cross();
    motion_->run();
  }
}

}  // namespace ricochet::reference::certified
