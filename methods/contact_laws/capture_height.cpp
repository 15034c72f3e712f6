#include "methods/contact_laws/capture_height.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "problems/geometry.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

constexpr double kLargest = 0.1;  // of the smallest length

/// [m]; infinite without a shape that has a radius.
double smallest_radius(const ProblemInfo& problem) {
  double smallest = std::numeric_limits<double>::infinity();
  if (!problem.geometry) return smallest;
  for (const auto& shape : problem.geometry->shapes) {
    if (shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule)
      smallest = std::min(smallest, shape.size[0]);
  }
  return smallest;
}

/// (1), the smallest of all contacts.
double smallest_gap_size(const Problem& problem) {
  const ProblemInfo& info = problem.info();
  ContactScales scales(problem);
  scales.begin_step(info.q0.data(), info.v0.data(), info.end_time / 10, true);
  double smallest = std::numeric_limits<double>::infinity();
  for (const int i : info.unilateral) smallest = std::min(smallest, scales.gap(i));
  return smallest;
}

}  // namespace

CaptureHeight::CaptureHeight(const MethodSpec& spec)
    : height_(spec.positive_number(kName, "a height above 0 m and up to a tenth of the smallest radius")) {}

void CaptureHeight::set(const Problem& problem, double tolerance, ContactScales& scales) const {
  if (height_ == 0 || problem.info().unilateral.empty()) return scales.set_capture(tolerance);
  const double radius = smallest_radius(problem.info()), gap = smallest_gap_size(problem);
  const bool has_radius = radius < std::numeric_limits<double>::infinity();
  const double largest = kLargest * (has_radius ? radius : gap);
  if (height_ > largest)
    throw InputError(kName, height_,
                     fmt::format("a height above 0 m and up to {:.6g} m, a tenth of the smallest {}, is required",
                                 largest, has_radius ? "radius" : "size of a gap"));
  scales.set_capture(tolerance, height_, height_ / gap);
}

}  // namespace ricochet
