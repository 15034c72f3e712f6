// Compiled scenes in other units: lengths, masses and times by powers of two, which round nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "methods/registry.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

/// Exponents of two of the units of length, mass and time.
struct UnitChange {
  const char* name;
  int m, kg, s;
};

constexpr UnitChange kChanges[] = {{"small", -30, 0, 0}, {"large", 30, 0, 0}, {"light", 0, -30, 0}, {"heavy", 0, 30, 0},
                                   {"short", 0, 0, -30}, {"long", 0, 0, 30},  {"all", 20, -40, 10}};

/// Of "kg m^2" and the like: factors by spaces, divisors after a slash.
int exponent_of(const std::string& unit, const UnitChange& change) {
  const int force = change.kg + change.m - 2 * change.s;
  const std::map<std::string, int> known{{"1", 0},        {"rad", 0},      {"kg", change.kg},
                                         {"m", change.m}, {"s", change.s}, {"N", force}};
  int exponent = 0, sign = 1;
  std::string word;
  const auto end_word = [&] {
    const auto caret = word.find('^');
    const int power = caret == std::string::npos ? 1 : std::stoi(word.substr(caret + 1));
    exponent += sign * power * known.at(word.substr(0, caret));
    word.clear();
  };
  for (const char c : unit) {
    if (c != ' ' && c != '/') {
      word += c;
      continue;
    }
    end_word();
    if (c == '/') sign = -1;
  }
  end_word();
  return exponent;
}

ParameterChanges in_units(const std::vector<ParameterInfo>& parameters, const UnitChange& change) {
  ParameterChanges changed;
  for (const auto& parameter : parameters)
    changed[parameter.name] = std::ldexp(parameter.value, exponent_of(parameter.unit, change));
  return changed;
}

/// By coordinate: a length where the unit of its mass is one of mass, and none where it is one of inertia.
Vector units_of(const Problem& here, const Problem& there, const UnitChange& change) {
  const Matrix M = here.mass_matrix(here.info().q0), M_there = there.mass_matrix(there.info().q0);
  Vector units(here.n_q());
  for (int i = 0; i < here.n_q(); ++i)
    units[i] = M_there(i, i) / M(i, i) == std::ldexp(1.0, change.kg) ? std::ldexp(1.0, change.m) : 1;
  return units;
}

/// All compiled scenes whose numbers are parameters with units, so that their start is the same in others.
std::vector<std::string> scenes_with_units() {
  constexpr UnitChange kChange = {"all", 20, -40, 10};
  std::vector<std::string> ids;
  for (const SceneEntry& scene : scenes()) {
    const auto parameters = parameters_of(scene);
    if (parameters.empty() || make_problem(scene.id)->info().parameters.empty()) continue;
    if (scene.id == "box_3d") continue;  // its corners strike in turn, and make 1e-9 of a rounding
    try {
      const auto here = make_problem(scene.id), there = make_problem(scene.id, in_units(parameters, kChange));
      const ProblemInfo &a = here->info(), &b = there->info();
      const Vector units = units_of(*here, *there, kChange);
      const Vector unit_masses = there->mass_matrix(b.q0).diagonal().cwiseQuotient(here->mass_matrix(a.q0).diagonal());
      const Vector unit_forces = unit_masses.cwiseProduct(units) * std::ldexp(1.0, -2 * kChange.s);
      const bool is_same = b.end_time == std::ldexp(a.end_time, kChange.s) && b.q0 == units.cwiseProduct(a.q0) &&
                           b.v0 * std::ldexp(1.0, kChange.s) == units.cwiseProduct(a.v0) &&
                           there->force(b.q0, b.v0) == unit_forces.cwiseProduct(here->force(a.q0, a.v0)) &&
                           there->gap(b.q0) == here->gap(a.q0) * std::ldexp(1.0, kChange.m);
      if (is_same) ids.push_back(scene.id);
    } catch (const InputError&) {  // a number that is no parameter makes no sense beside the others
    }
  }
  return ids;
}

class ScenesInOtherUnits : public testing::TestWithParam<std::tuple<std::string, std::tuple<const char*, double>>> {};

TEST_P(ScenesInOtherUnits, EndTheSame) {
  const auto [scene, of_method] = GetParam();
  const auto [name, allowed] = of_method;
  const auto method = make_method(name);
  const auto problem = make_problem(scene);
  ASSERT_FALSE(problem->info().parameters.empty());
  if (!method->can_run(problem->info()).ok) GTEST_SKIP() << "not for this method";
  Settings settings;
  settings.steps = 200;
  const Solution here = method->solve(*problem, settings);
  for (const UnitChange& change : kChanges) {
    const auto other = make_problem(scene, in_units(problem->info().parameters, change));
    ASSERT_EQ(other->info().end_time, std::ldexp(problem->info().end_time, change.s));
    const Solution there = method->solve(*other, settings);
    EXPECT_EQ(there.status, here.status) << change.name << ": " << there.message << "\n" << here.message;
    EXPECT_EQ(there.counters.events, here.counters.events) << change.name;
    if (!here.succeeded()) continue;
    const Vector units = units_of(*problem, *other, change);
    for (int i = 0; i < problem->n_q(); ++i) {
      const double unit = units[i];
      EXPECT_NEAR(there.q[i] / unit, here.q[i], allowed) << change.name << ", q " << i;
      EXPECT_NEAR(there.v[i] / (unit * std::ldexp(1.0, -change.s)), here.v[i], 100 * allowed)
          << change.name << ", v " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, ScenesInOtherUnits,
    testing::Combine(
        testing::ValuesIn(scenes_with_units()),
        // Pivoting ends with rounding, FESD with its inner tolerance of 1e-13 over 200 steps; the others may
        // leave their tolerance of a contact problem, in each step: 1e-9 of some m/s, over a second.
        testing::Values(std::tuple{"moreau_jean", 1e-10}, std::tuple{"moreau_jean,solver=exact", 1e-7},
                        std::tuple{"moreau_jean,solver=pgs", 1e-7}, std::tuple{"moreau_jean,solver=newton", 1e-7},
                        std::tuple{"moreau_jean,solver=interior_point", 1e-7},
                        std::tuple{"moreau_jean,solver=admm", 1e-7}, std::tuple{"moreau_jean,solver=staggered", 1e-7},
                        std::tuple{"schatzman_paoli", 1e-10}, std::tuple{"stewart_trinkle", 1e-10},
                        std::tuple{"anitescu_potra", 1e-10}, std::tuple{"generalized_alpha", 1e-10},
                        std::tuple{"d1_minus", 1e-10}, std::tuple{"fesd:radau-iia:3,elements=as_needed", 1e-9})),
    [](const auto& test) {
      std::string name = fmt::format("{}_{}", std::get<0>(test.param), std::get<0>(std::get<1>(test.param)));
      for (char& c : name) {
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
      }
      return name;
    });

}  // namespace
}  // namespace ricochet
