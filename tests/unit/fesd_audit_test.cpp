// The auditor finds each single number of an accepted step that is changed, by the residual of the equation that the
// number is in.
#include "methods/fesd/fesd_audit.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <set>

#include "methods/fesd/pivoting_solver.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr double kChange = 1e-6, kSmall = 1e-3;
// Accepted steps fulfil their equations to rounding.
constexpr double kFulfilled = 1e-12;
// What no test would accept.
constexpr double kFound = 10 * kFulfilled;

struct AuditedScene {
  const char *id, *family;
  int n_s, steps, facets;
  std::set<std::string> kinds;  ///< some of what happens in it
};

void PrintTo(const AuditedScene& scene, std::ostream* out) {
  *out << fmt::format("{} {}:{} facets={}", scene.id, scene.family, scene.n_s, scene.facets);
}

class FesdAuditOf : public testing::TestWithParam<AuditedScene> {
 protected:
  std::unique_ptr<Problem> problem = make_problem(GetParam().id);
  const ButcherTableau tableau = make_tableau(GetParam().family, GetParam().n_s);
  FesdStep step;  // at hand
  const FesdStep* previous = nullptr;

  std::vector<Residual> audit() const {
    FesdAudit::Claims claims;
    if (GetParam().facets > 0) claims.cone = {.cone = FrictionCone::polyhedral, .facets = GetParam().facets};
    FesdAudit audit(*problem, tableau, claims);
    audit.add(step, previous, 0);
    return audit.residuals();
  }

  double largest(const std::vector<std::string>& residuals) const {
    double value = 0;
    for (const Residual& residual : audit()) {
      if (std::ranges::count(residuals, residual.name) > 0) value = std::max(value, residual.value);
    }
    return value;
  }

  /// Changes every number of an array in turn, by kChange of the largest of them; where they are all small, of
  /// an SI unit, or of the load. One of the residuals has to rise above kFound.
  /// @param factor  of the change
  template <class Array>
  void change_each(const std::string& name, Array&& array, const std::vector<std::string>& residuals,
                   double factor = 1) {
    const bool is_of_force = name.find("ambda") != std::string::npos;
    const double unit =
        is_of_force ? std::max(1.0, problem->force(problem->info().q0, problem->info().v0).cwiseAbs().maxCoeff()) : 1;
    EXPECT_LE(largest(residuals), kFulfilled) << name;
    const double size = array.size() > 0 ? array.cwiseAbs().maxCoeff() : 0;
    for (Eigen::Index column = 0; column < array.cols(); ++column) {
      for (Eigen::Index row = 0; row < array.rows(); ++row) {
        double& number = array(row, column);
        const double before = number;
        number += factor * kChange * (size > kSmall * unit ? size : unit);
        const double found = largest(residuals);
        number = before;
        EXPECT_GT(found, kFound) << fmt::format("{}({}, {}) = {}, by {}", name, row, column, before, residuals.front());
      }
    }
  }

  void change_each_number_of_element(int n) {
    Element& e = step.elements[static_cast<std::size_t>(n)];
    const auto column = [n](Matrix& matrix) { return matrix.col(n); };
    // Forces are known by what they make of velocities: less in an element shorter than others.
    const double shortness = std::max(1.0, step.H / (step.n_elements * e.h));
    change_each("q", e.q, {"stage position"});
    change_each("v", e.v, {"stage velocity"});
    change_each("a", e.a, {"stage acceleration"}, shortness);
    change_each("lambda_n", e.lambda_n, {"stage acceleration"}, shortness);
    change_each("lambda_t", e.lambda_t, {"stage acceleration"}, shortness);
    change_each("h", Eigen::Map<Vector>(&e.h, 1), {"step length"});
    change_each("q0", e.q0, {"stage position"});
    change_each("v0", e.v0, {"stage velocity"});
    change_each("q1", e.q1, {"end position"});
    // The projection (10) of end_projection.h may take velocity away across closed contacts, until none is left.
    change_each("v1", e.v1, {"end velocity", "end tangency"});
    change_each("v_minus", column(step.v_minus), {"impulse balance"});
    change_each("Lambda_n", column(step.Lambda_n), {"impulse balance"});
    change_each("Lambda_t", column(step.Lambda_t), {"impulse balance"});
    // Without a stage at the right end, on curved contacts, these are no unknowns of FESD-J but the solver's
    // extrapolation of the stage forces, which may be divided among redundant contacts in another way.
    if (!e.has_end_forces && !tableau.is_stiffly_accurate()) return;
    const std::vector<std::string> of_end =
        e.has_end_forces ? std::vector<std::string>{"end force", "stage slip"} : std::vector<std::string>{"end stage"};
    change_each("end_lambda_n", e.end_lambda_n, of_end);
    change_each("end_lambda_t", e.end_lambda_t, of_end);
  }

  /// Moves either end of an element across a bilateral constraint, which the equations of its stages do not see.
  void push_off_the_constraints(int n) {
    Element& e = step.elements[static_cast<std::size_t>(n)];
    const auto expect_found = [&](Vector& x, const Vector& push, const char* residual) {
      const Vector before = x;
      x += kChange * push;
      EXPECT_GT(largest({residual}), kFound) << residual;
      x = before;
    };
    for (const int i : problem->info().bilateral) {
      const Vector left = problem->normal_jacobian(e.q0).col(i), right = problem->normal_jacobian(e.q1).col(i);
      expect_found(e.v0, left, "bilateral velocity");
      expect_found(e.v1, right, "bilateral velocity");
      expect_found(e.q0, left, "bilateral gap");
      expect_found(e.q1, right, "bilateral gap");
    }
  }

  /// What happens in a step, as far as it has equations of its own.
  std::set<std::string> kinds() const {
    std::set<std::string> found;
    for (int n = 0; n < step.n_elements; ++n) {
      const Element& e = step.elements[static_cast<std::size_t>(n)];
      for (const ContactMode mode : e.modes) found.insert(to_string(mode));
      for (int i = 0; i < problem->n_c(); ++i) {
        if (problem->info().contacts[i].is_bilateral) found.insert("bilateral");
        if (step.Lambda_n(i, n) > 0) found.insert("impact");
      }
      if (e.is_projected) found.insert("projection");
    }
    return found;
  }
};

TEST_P(FesdAuditOf, FindsEachNumberThatIsChanged) {
  Counters counters;
  PivotingSolver solver(*problem, tableau, {.as_needed = true, .facets = GetParam().facets}, counters);
  const ProblemInfo& info = problem->info();
  solver.start(info.q0, info.v0);
  std::set<std::set<std::string>> audited;
  for (int k = 0; k < GetParam().steps; ++k) {
    ASSERT_EQ(solver.advance(info.end_time / GetParam().steps), Status::success) << solver.failure_message();
    step = solver.step();
    previous = solver.previous_step();
    if (!audited.insert(kinds()).second) continue;
    for (int n = 0; n < step.n_elements; ++n) {
      change_each_number_of_element(n);
      push_off_the_constraints(n);
    }
    if (HasFailure()) FAIL() << "step " << k;
  }
  std::set<std::string> seen;
  for (const auto& of_step : audited) seen.insert(of_step.begin(), of_step.end());
  EXPECT_TRUE(std::ranges::includes(seen, GetParam().kinds)) << fmt::format("{}", fmt::join(seen, ", "));
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, FesdAuditOf,
    testing::Values(AuditedScene{"bouncing_ball", "radau-iia", 3, 20, 0, {"open", "impact"}},
                    AuditedScene{"two_balls_spring", "gauss", 2, 20, 0, {"open", "impact"}},
                    AuditedScene{"P1c_ball_e0", "gauss", 2, 20, 0, {"open", "closed", "impact"}},
                    AuditedScene{"sliding_block", "radau-iia", 2, 20, 0, {"slip+", "stick"}},
                    AuditedScene{"block_on_ramp", "radau-iia", 3, 20, 0, {"slip-"}},
                    AuditedScene{"belt_oscillator", "gauss", 2, 20, 0, {"stick"}},
                    AuditedScene{"block_on_ramp_3d", "radau-iia", 3, 20, 0, {"slip"}},
                    AuditedScene{"block_on_ramp_3d", "radau-iia", 3, 20, 8, {"edge slip"}},
                    AuditedScene{"ball_3d", "radau-iia", 3, 20, 0, {"impact"}},
                    AuditedScene{"ball_3d", "radau-iia", 3, 20, 8, {"impact"}},
                    AuditedScene{"box_3d", "radau-iia", 2, 12, 0, {"slip", "projection"}},
                    AuditedScene{"pendulum_wall_cartesian", "radau-iia", 3, 20, 0, {"bilateral", "projection"}},
                    AuditedScene{"disc_in_chute", "radau-iia", 3, 20, 0, {"slip+"}},
                    AuditedScene{"rocking_block", "radau-iia", 3, 40, 0, {"projection", "stick"}},
                    AuditedScene{"slider_crank_stop", "radau-iia", 3, 20, 0, {"projection", "impact"}},
                    AuditedScene{"shaken_table", "radau-iia", 3, 20, 0, {"impact"}}));

/// A box that spins on four corners comes to rest on all of them at once: it must not go on spinning about the corner
/// that the switch names.
TEST(FesdAudit, FindsABodyThatStillSpinsAboutACornerAtRest) {
  const auto problem = make_problem("box_3d", {{"height", 0.05},
                                               {"alpha0", 0},
                                               {"beta0", 0},
                                               {"gamma0", 0},
                                               {"d_alpha0", 0},
                                               {"d_beta0", 0},
                                               {"d_gamma0", 5},
                                               {"v_x0", 0},
                                               {"v_y0", 0}});
  const ButcherTableau tableau = make_tableau("radau-iia", 2);
  Counters counters;
  PivotingSolver solver(*problem, tableau, {.as_needed = true}, counters);
  solver.start(problem->info().q0, problem->info().v0);
  int stops = 0;
  for (int k = 0; k < 10 && stops == 0; ++k) {
    ASSERT_EQ(solver.advance(0.015), Status::success) << solver.failure_message();
    FesdStep step = solver.step();
    const auto tangency = [&] {
      FesdAudit audit(*problem, tableau, {});
      audit.add(step, solver.previous_step(), 0);
      const auto residuals = audit.residuals();
      return std::ranges::find(residuals, std::string("end tangency"), &Residual::name)->value;
    };
    for (std::size_t n = 0; n < static_cast<std::size_t>(step.n_elements); ++n) {
      if (!step.ends[n].together) continue;
      ++stops;
      EXPECT_LE(tangency(), kFulfilled);
      Element& e = step.elements[n];
      const Matrix J_t = problem->tangent_jacobian(e.q1);
      const int t = problem->info().contacts[step.ends[n].contact].tangent_index;
      const Vector spin = Vector::Unit(6, 5) - J_t(5, t) * Vector::Unit(6, 0) - J_t(5, t + 1) * Vector::Unit(6, 1);
      ASSERT_LE((J_t.middleCols(t, 2).transpose() * spin).norm(), with_rounding(0)) << "the corner stays where it is";
      e.v1 += kChange * spin;
      EXPECT_GT(tangency(), kFound);
    }
  }
  EXPECT_EQ(stops, 1);
}

}  // namespace
}  // namespace ricochet
