// Derivatives that Newton's method for elements is made of, against differences of what they are derivatives of: in
// every mode of the contacts and for every kind of switch, on each scene that has it, at states where nothing is solved.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "methods/elements/switch_solver.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

constexpr int kFacets = 6;
constexpr double kLength = 0.03;

bool can_have(const ContactInfo& contact, ContactMode mode) {
  switch (mode) {
    case ContactMode::open:
    case ContactMode::closed:
      return contact.n_t == 0;
    case ContactMode::stick:
      return contact.n_t > 0;
    case ContactMode::slip_positive:
    case ContactMode::slip_negative:
      return contact.n_t == 1;
    case ContactMode::slip:
    case ContactMode::vertex_slip:
    case ContactMode::edge_slip:
      return contact.n_t == 2;
  }
  return false;
}

std::vector<SceneMode> cases() {
  std::vector<SceneMode> list;
  for (const auto& problem : all_problems()) {
    const ProblemInfo& info = problem.problem->info();
    if (info.contacts.empty() || info.n_q > 16) continue;  // differences of many unknowns take long, and say no more
    for (const ContactMode mode :
         {ContactMode::closed, ContactMode::stick, ContactMode::slip_positive, ContactMode::slip_negative,
          ContactMode::slip, ContactMode::vertex_slip, ContactMode::edge_slip}) {
      if (std::ranges::none_of(info.contacts, [&](const auto& contact) { return can_have(contact, mode); })) continue;
      for (const char* tableau : {"radau-iia", "gauss"}) list.push_back({problem.id, tableau, mode, problem.problem});
    }
  }
  return list;
}

/// An element near the initial state with made-up accelerations and forces: its equations do not hold.
class MadeUpElement {
 public:
  /// @param only  contact that has the mode; -1: all that can
  explicit MadeUpElement(const SceneMode& of, int only = -1)
      : problem(*of.problem),
        polygon(of.mode == ContactMode::vertex_slip || of.mode == ContactMode::edge_slip ? kFacets : 0),
        system(problem, make_tableau(of.tableau, 2), counters, polygon, ElementSystem::Form::newton),
        function(system) {
    const ProblemInfo& info = problem.info();
    e.resize(info, 2);
    e.h = kLength;
    e.q0 = info.q0 + 0.01 * random(info.n_q, 1).col(0);
    e.v0 = info.v0 + 0.5 * random(info.n_q, 1).col(0);
    if (info.clock >= 0) e.v0[info.clock] = 1;
    e.a = random(info.n_q, 2);
    if (info.clock >= 0) e.a.row(info.clock).setZero();
    e.lambda_n = Matrix::Ones(info.n_c(), 2) + 0.5 * random(info.n_c(), 2);
    e.lambda_t = 0.3 * random(info.n_lambda_t, 2);
    for (const int i : info.unilateral) {
      if (!can_have(info.contacts[i], of.mode) || (only >= 0 && i != only)) continue;
      e.modes[i] = of.mode;
      if (info.contacts[i].n_t == 2) e.facets[i] = 1;
    }
    system.set_active(e);
    k.set(system.tableau, kLength);
    if (system.end.applies_to(e)) move_along_contacts();
    evaluate(e);
    system.equations.derivatives(k, e, system.work);
  }

  Matrix random(Eigen::Index rows, Eigen::Index columns) {
    return Matrix::NullaryExpr(rows, columns, [&] { return 2.0 * double(engine() % 10001) / 10000.0 - 1; });
  }

  /// Changes v0 until the velocity at the right end is along the closed contacts. Variations of P in (10), which Newton's
  /// method leaves out, vanish there.
  void move_along_contacts() {
    for (int iteration = 0; iteration < 20; ++iteration) {
      system.equations.set_stages(k, e, system.work);
      system.equations.set_right_end(k, e);
      const Vector before = e.v1;
      system.end.project(e, system.end_work);
      e.v0 += e.v1 - before;
    }
  }

  int n_x() const { return system.active.n_unknowns(); }

  /// Stages and residual of the element.
  const Vector& evaluate(Element& element) {
    system.equations.set_initial_values(element, kLength, system.work);
    system.equations.set_stages(k, element, system.work);
    system.equations.residual(k, element, system.work);
    return system.work.r;
  }

  Element moved(const Vector& dx) {
    Element other = e;
    system.unknowns.correct(dx.data(), kLength, system.work.K, other);
    return other;
  }

  /// (3), (4), (7) of stage_equations.h by all unknowns, from the derivatives at the stages.
  Matrix newton_matrix() const {
    const StageDerivatives& K = system.work.K;
    const int n = problem.n_q();
    Matrix result = Matrix::Zero(2 * n_x(), 2 * n_x());
    for (int j = 0; j < 2; ++j) {
      const Eigen::Map<const Matrix> M(K.M[j], n, n);
      for (int l = 0; l < 2; ++l) {
        auto block = result.block(j * n_x(), l * n_x(), n_x(), n_x());
        if (j == l) block.topLeftCorner(n, n) = M;
        if (K.has_dynamics) block.topLeftCorner(n, n) += k.h2A2(j, l) * K.Dq[j] + k.hA(j, l) * K.Dv[j];
        for (const ActiveContact& active : system.active.closed()) {
          const auto& contact = problem.info().contacts[active.contact];
          const auto entries = static_cast<int>(contact.support.size());
          for (int row = 0; row < active.n_rows; ++row) {
            for (int s = 0; s < entries; ++s) {
              const int entry = active.entry + row * entries + s, at = contact.support[s];
              block(n + active.row + row, at) += k.h2A2(j, l) * K.Rq[j][entry] + k.hA(j, l) * K.Rv[j][entry];
              if (j == l && s < int(contact.pushed().size())) block(at, n + active.row + row) -= K.forces[j][entry];
            }
            for (int column = 0; column < active.n_rows && j == l; ++column)
              block(n + active.row + row, n + active.row + column) +=
                  K.Rl[j][9 * (&active - system.active.closed().data()) + 3 * row + column];
          }
        }
      }
    }
    return result;
  }

  const Problem& problem;
  Counters counters;
  FrictionPolygon polygon;
  ElementSystem system;
  SwitchFunction function;
  StageCoefficients k;
  Element e;

 private:
  std::mt19937 engine{7};
};

class ElementDerivatives : public testing::TestWithParam<SceneMode> {};

TEST_P(ElementDerivatives, NewtonMatrixIsThatOfTheResidual) {
  MadeUpElement made(GetParam());
  const Matrix K = made.newton_matrix();
  const double size = K.cwiseAbs().maxCoeff();
  for (int column = 0; column < K.cols(); ++column) {
    const int at = column % made.n_x();
    if (at == made.problem.info().clock) continue;  // its acceleration is zero
    const double step = 1e-5;
    Vector dx = Vector::Zero(K.cols());
    dx[column] = step;
    Element plus = made.moved(dx), minus = made.moved(-dx);
    Vector difference = made.evaluate(plus);
    difference = (difference - made.evaluate(minus)) / (2 * step);
    // Central differences: third derivatives times step^2, and rounding of the residual, 1e-16 / step.
    EXPECT_LT((difference - K.col(column)).cwiseAbs().maxCoeff(), 1e-7 * size)
        << "stage " << column / made.n_x() + 1 << ", unknown " << at;
  }
}

TEST_P(ElementDerivatives, NewtonSystemSolvesWithThatMatrix) {
  const ProblemInfo& info = GetParam().problem->info();
  if (info.clock >= 0) GTEST_SKIP() << "the clock's column is left out";
  for (const int i : info.unilateral) {
    if (!can_have(info.contacts[i], GetParam().mode)) continue;
    MadeUpElement made(GetParam(), i);  // several of them might be redundant
    const Matrix K = made.newton_matrix(), rhs = made.random(K.rows(), 2);
    const Matrix dense = -K.fullPivLu().solve(rhs);
    Matrix response;
    made.system.newton.solve_once(made.k, made.system.work.K, rhs, made.system.work.x, response);
    // Both have the rounding of a matrix with entries of 1 and 1/h^2.
    EXPECT_LT((response - dense).norm(), 1e-9 * dense.norm()) << info.contacts[i].name;
  }
}

/// Switches that a contact in this mode may come to.
std::vector<Switch> switches_of(const MadeUpElement& made, int i) {
  using Kind = SwitchKind;
  const ContactInfo& contact = made.problem.info().contacts[i];
  const ContactMode mode = made.e.modes[i];
  if (mode == ContactMode::open) return {{.kind = Kind::gap_closes, .contact = i}};
  if (contact.is_bilateral) return {};
  std::vector<Switch> list = {{.kind = Kind::force_vanishes, .contact = i}};
  if (made.polygon.applies(contact.n_t)) {
    for (int c = 0; c < made.polygon.n_conditions(mode); ++c) {
      const FacetCondition condition = made.polygon.condition(mode, made.e.facets[i], c);
      const Kind kind = mode == ContactMode::vertex_slip ? Kind::slip_turns
                        : condition.is_of_force          ? Kind::edge_left
                                                         : Kind::slip_stops;
      list.push_back({.kind = kind, .contact = i, .condition = condition});
    }
  } else if (mode == ContactMode::stick) {
    list.push_back({.kind = Kind::cone_reached, .contact = i});
  } else if (mode == ContactMode::slip && made.system.tableau.ends_with_stage) {
    list.push_back({.kind = Kind::slip_stops, .contact = i});
    list.push_back({.kind = Kind::slip_stops, .contact = i, .together = true});
  } else if (is_slipping(mode) && contact.n_t == 1) {
    list.push_back({.kind = Kind::slip_stops, .contact = i});
  }
  return list;
}

TEST_P(ElementDerivatives, SwitchSlopesAreThoseOfTheSwitchFunctions) {
  MadeUpElement made(GetParam());
  const ProblemInfo& info = made.problem.info();
  const int n = info.n_q;
  int compared = 0;
  for (int i = 0; i < info.n_c(); ++i) {
    for (const Switch& end : switches_of(made, i)) {
      if (end.together && !info.contacts[i].is_affine) continue;  // its slope leaves out second derivatives of J_t
      Element& e = made.e;
      const bool rests = end.kind == SwitchKind::slip_stops && e.modes[i] == ContactMode::slip;
      made.system.active.set_slip_end(rests ? SlipEnd{i, end.together} : SlipEnd{});
      Vector direction = made.random(2 * made.n_x(), 1).col(0);
      for (int j = 0; j < 2 && info.clock >= 0; ++j) direction[j * made.n_x() + info.clock] = 0;

      const auto value = [&](double step) {
        Element other = made.moved(step * direction);
        made.system.equations.set_stages(made.k, other, made.system.work);
        made.system.set_right_end(made.k, other);
        made.system.set_end_forces(other);
        return made.function.value(other, end);
      };
      const double step = 1e-4;
      const double difference = (value(step) - value(-step)) / (2 * step);
      // What a difference is not: rounding over the step, and the third derivative.
      const double unknown = std::abs((value(2 * step) - value(-2 * step)) / (4 * step) - difference);

      made.system.equations.set_stages(made.k, e, made.system.work);
      made.system.set_right_end(made.k, e);
      Matrix dq = Matrix::Zero(n, 2), dv = dq, x = Matrix::Zero(direction.size(), 2);
      x.col(0) = direction;
      for (int l = 0; l < 2; ++l) {  // (5)
        dq.col(0) += made.k.h2bA[l] * direction.segment(l * made.n_x(), n);
        dv.col(0) += made.k.hb[l] * direction.segment(l * made.n_x(), n);
      }
      if (made.system.end.applies_to(e)) made.system.end.project_variations(e, dq, dv, made.system.end_work);
      made.system.set_end_forces(e);
      Eigen::RowVector2d slope;
      made.function.slope(e, end, {dq, dv, x}, slope);
      // Slopes of projected forces are differences themselves, to 1e-8 of the forces.
      const double forces = e.end_lambda_n.size() > 0 ? e.end_lambda_n.cwiseAbs().maxCoeff() : 0;
      EXPECT_NEAR(slope[0], difference, 2e-6 * (1 + std::abs(difference)) + 2e-8 * forces + unknown)
          << properties(end.kind).name << " of contact " << info.contacts[i].name << (end.together ? ", together" : "");
      ++compared;
    }
  }
  const bool has_unilateral = !info.unilateral.empty();
  EXPECT_EQ(compared > 0, has_unilateral);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ElementDerivatives, testing::ValuesIn(cases()), [](const auto& test) {
  return test_name(test.param.problem_id, test.param.mode, test.param.tableau);
});

/// (9) of switch_function.h from the dense views of the problem. On a curve slip accelerates by the turning of the
/// tangents, too.
TEST(SwitchFunctions, PowerThatFrictionMissesIsThatOfTheSlipAccelerations) {
  int on_curves = 0;
  for (const SceneMode& of : cases()) {
    if (of.mode != ContactMode::slip || of.tableau != "radau-iia") continue;
    MadeUpElement made(of);
    const auto& contacts = made.problem.info().contacts;
    Element& e = made.e;
    const auto resting = std::ranges::find(e.modes, ContactMode::slip) - e.modes.begin();
    made.system.active.set_slip_end({static_cast<int>(resting), true});
    made.evaluate(e);
    made.system.set_right_end(made.k, e);
    e.v1 = made.random(e.v1.size(), 1);  // (10) of end_projection.h leaves little that turns
    const Vector turning = made.problem.slip_acceleration_bias(e.q1, e.v1),
                 acceleration = made.problem.tangent_jacobian(e.q1).transpose() * e.a.col(1) + turning;
    double missing = 0, size = 0;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (e.modes[i] != ContactMode::slip || contacts[i].support != contacts[resting].support) continue;
      const Vector s = acceleration.segment(contacts[i].tangent_index, 2),
                   force = e.lambda_t.col(1).segment(contacts[i].tangent_index, 2);
      const double most = contacts[i].mu * e.lambda_n(static_cast<Eigen::Index>(i), 1) * s.norm();
      missing += most - force.dot(s);
      size += most + force.norm() * s.norm();
      on_curves += std::abs(turning[contacts[i].tangent_index]) > 0.01;
    }
    const Switch end{.kind = SwitchKind::slip_stops, .contact = static_cast<int>(resting), .together = true};
    EXPECT_NEAR(made.function.value(e, end), missing, with_rounding(0) * size) << of.problem_id;
  }
  EXPECT_GT(on_curves, 0);
}

TEST(SwitchKinds, EachHasARowWithItsOwnWords) {
  std::set<std::string> names, refusals;
  for (const SwitchProperties& kind : switch_kinds()) {
    EXPECT_EQ(&properties(kind.kind), &kind);
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_TRUE(refusals.insert(kind.refusal).second) << kind.refusal;
    EXPECT_FALSE(kind.after.empty());
  }
}

}  // namespace
}  // namespace ricochet
