// Sets of states that move: what starts within a set stays within its image.
#include <gtest/gtest.h>

#include <memory>

#include "problems/scene_file/scene_file.h"
#include "reference/certified/moving_set.h"

namespace ricochet::reference::certified {
namespace {

/// Two pendulums coupled by a weak spring, with a drag of one.
const char* const kScene =
    R"json({"q0": ["0.9", "-0.4"], "v0": ["0.2", "1.1"], "T": "5", "M": [["1", "0.1"], ["0.1", "2"]],
  "f": ["-4*sin(q[0]) + 0.3*(q[1]-q[0])", "-3*sin(q[1]) + 0.3*(q[0]-q[1]) - 0.2*v[1]/(1+v[1]*v[1])"]})json";

/// The set after `steps` steps of length h from a box.
std::vector<Ball> moved(const Precision& precision, const std::vector<Ball>& box, int steps, double h, bool form) {
  SeriesProgram program(precision);
  const auto problem = read_scene_text(kScene, "scene");
  const SceneFormulas scene = scene_formulas(*problem, Reading::decimal, program);
  const TimeLimit limit(60);
  TaylorStep step(scene, program, limit);
  MovingSet set(scene, program, step, form);
  set.set_box(box);
  Ball t;
  step.load(box, t);
  const ModeMotion motion = mode_motion(scene, {}, program);
  set.begin(motion);
  for (int k = 0; k < steps; ++k) {
    set.expand(motion, t);
    if (!set.validate(motion, h)) return {};
    set.advance(motion, t, h, Ball(1.0), false);
    t = precision.add(t, Ball(h));
  }
  return set.box();
}

std::vector<Ball> box_of(const std::vector<double>& middle, double radius) {
  std::vector<Ball> box;
  Magnitude r;
  mag_set_d(r.get(), radius);
  for (const double x : middle) {
    box.emplace_back(x);
    box.back().widen(r.get());
  }
  return box;
}

const std::vector<double> kMiddle{0.9, -0.4, 0.2, 1.1};
const Precision kFine{300, 60};

/// Corners of a box, as points.
std::vector<double> corner(double radius, int which) {
  std::vector<double> point = kMiddle;
  for (int k = 0; k < 4; ++k) point[k] += (which >> k & 1 ? 1 : -1) * radius * 0.999;
  return point;
}

/// Steps of low order have remainders that are far from zero; the true motion lies within them.
TEST(TaylorSteps, RemaindersContainTheMotion) {
  for (const auto& [order, h] : {std::pair(3, 0.02), {6, 0.1}, {10, 0.2}, {16, 0.3}}) {
    for (const bool form : {false, true}) {
      const auto coarse = moved({160, order}, box_of(kMiddle, 0), 3, h, form);
      const auto fine = moved(kFine, box_of(kMiddle, 0), 3, h, false);
      ASSERT_EQ(coarse.size(), 4u) << order;
      ASSERT_EQ(fine.size(), 4u);
      for (int k = 0; k < 4; ++k) {
        EXPECT_GT(coarse[k].log10_radius(), -20) << order;  // a remainder, not rounding
        EXPECT_LT(coarse[k].log10_radius(), -3) << order;
        EXPECT_TRUE(arb_contains(coarse[k].get(), fine[k].get())) << order << (form ? " form " : " box ") << k;
      }
    }
  }
}

/// The image of a wide set contains the images of its corners. The mean value form is narrower than the box.
TEST(MovingSets, ContainTheImagesOfTheirCorners) {
  constexpr double kRadius = 1e-3, h = 0.0625;
  constexpr int kSteps = 16;
  const auto box = moved({160, 24}, box_of(kMiddle, kRadius), kSteps, h, false);
  const auto form = moved({160, 24}, box_of(kMiddle, kRadius), kSteps, h, true);
  ASSERT_EQ(box.size(), 4u);
  ASSERT_EQ(form.size(), 4u);
  for (int which = 0; which < 16; ++which) {
    const auto image = moved(kFine, box_of(corner(kRadius, which), 0), kSteps, h, false);
    for (int k = 0; k < 4; ++k) {
      EXPECT_TRUE(arb_contains(box[k].get(), image[k].get())) << which << " " << k;
      EXPECT_TRUE(arb_contains(form[k].get(), image[k].get())) << which << " " << k;
    }
  }
  for (int k = 0; k < 4; ++k) EXPECT_LT(form[k].log10_radius(), box[k].log10_radius());
}

}  // namespace
}  // namespace ricochet::reference::certified
