#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/input_error.h"
#include "problems/scene_file/scene_writer.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A small scene that is valid; tests spoil one field of it.
json good_scene() {
  return json::parse(R"({
    "params": {"m": "1", "g": "9.81", "e": "0.5", "mu": "0.2"},
    "q0": ["0", "1"], "v0": ["1", "0"], "T": "2",
    "M": [["m", "0"], ["0", "m"]], "f": ["0", "-m*g"],
    "contacts": [{"name": "floor", "gap": "q[1]", "Jn": ["0", "1"], "Jt": [["1", "0"]], "e": "e", "mu": "mu"}]
  })");
}

class SceneFile : public testing::Test {
 protected:
  std::string path =
      (std::filesystem::temp_directory_path() / ("ricochet_scene_" + std::to_string(::getpid()) + ".json")).string();
  ~SceneFile() override { std::filesystem::remove(path); }

  std::unique_ptr<Problem> read(const json& scene, const ParameterChanges& changes = {}) {
    std::ofstream(path) << scene.dump();
    return read_scene_file(path, changes);
  }
  std::string error(const json& scene) {
    try {
      read(scene);
    } catch (const InputError& e) {
      std::string message = e.what();
      if (message.starts_with(path)) message = "FILE" + message.substr(path.size());
      return message.substr(0, message.find('\n'));
    }
    return "no error";
  }
};

TEST_F(SceneFile, ReadsAScene) {
  const auto p = read(good_scene());
  EXPECT_EQ(p->n_q(), 2);
  EXPECT_EQ(p->info().contacts[0].name, "floor");
  EXPECT_EQ(p->info().contacts[0].mu, 0.2);
  EXPECT_EQ(p->info().n_lambda_t, 1);
  EXPECT_EQ(p->force(p->info().q0, p->info().v0), Vector(Eigen::Vector2d(0, -9.81)));
}

TEST_F(SceneFile, ParametersCanBeChanged) {
  EXPECT_EQ(read(good_scene(), {{"e", 0.75}})->info().contacts[0].eps_r, 0.75);
  EXPECT_THROW(read(good_scene(), {{"nothing", 1}}), InputError);
}

TEST_F(SceneFile, ParametersMayBeFormulas) {
  json scene = good_scene();
  scene["params"]["L"] = "2*r";  // before the parameter that it refers to
  scene["params"]["a"] = "L+mu";
  scene["params"]["r"] = "1/2";
  scene["q0"][1] = "a";
  EXPECT_EQ(read(scene)->info().q0[1], 1.2);
  EXPECT_EQ(read(scene, {{"r", 2}})->info().q0[1], 4.2) << "L follows r";
  EXPECT_EQ(read(scene, {{"r", 2}, {"L", 3}})->info().q0[1], 3.2) << "L is a number now";
}

/// A parameter that follows others has no derivative of its own: theirs go through it.
TEST_F(SceneFile, FormulasOfParametersAreDifferentiated) {
  json scene = good_scene();
  scene["params"]["weight"] = "m*g";
  scene["q0"][1] = "weight";
  const auto problem = read(scene);
  std::vector<std::string> names;
  for (const auto& parameter : problem->info().parameters) names.push_back(parameter.name);
  EXPECT_EQ(names, (std::vector<std::string>{"e", "g", "m", "mu"}));
  Matrix C = Matrix::Zero(7, 4);  // of q0, v0, eps_r, mu, T
  problem->parameter_derivative_of_constants(C.data());
  EXPECT_EQ(C(1, 1), 1) << "d(m g)/dg";
  EXPECT_EQ(C(1, 2), 9.81) << "d(m g)/dm";
}

TEST_F(SceneFile, FormulasOfParametersHaveLimits) {
  json scene = good_scene();
  scene["params"]["a"] = "b+1";
  scene["params"]["b"] = "2*c";
  scene["params"]["c"] = "a";
  EXPECT_EQ(error(scene), "FILE: params.a = b+1: circular reference: a, b, c have no values");
  scene["params"]["c"] = "m**1000";
  scene["params"]["b"] = "c**1000";
  EXPECT_TRUE(error(scene).starts_with("FILE: params.b, column 2: exponents up to 1000")) << error(scene);
  // Every one has twice the operations of the one before.
  scene["params"] = {{"m", "1"}, {"g", "9.81"}, {"e", "0"}, {"mu", "0"}, {"x10", "sin(g)"}};
  for (int k = 11; k < 60; ++k) {
    const std::string before = "x" + std::to_string(k - 1);
    scene["params"]["x" + std::to_string(k)] = "max(" + before + ", 1-" + before + ")";
  }
  EXPECT_NE(error(scene).find("the expression is too large"), std::string::npos) << error(scene);
}

TEST_F(SceneFile, NumbersMayBePlain) {
  json scene = good_scene();
  scene["T"] = 2.5;
  scene["q0"] = {0, 1.25};
  EXPECT_EQ(read(scene)->info().q0[1], 1.25);
  EXPECT_EQ(read(scene)->info().end_time, 2.5);
}

TEST_F(SceneFile, ASceneNeedsNoContact) {
  json scene = good_scene();
  scene.erase("contacts");
  EXPECT_EQ(read(scene)->n_c(), 0);
}

TEST_F(SceneFile, ErrorsNameTheFieldAndWhatIsAllowed) {
  const auto spoiled = [&](const std::function<void(json&)>& spoil) {
    json scene = good_scene();
    spoil(scene);
    return error(scene);
  };
  EXPECT_EQ(spoiled([](json& s) { s.erase("f"); }), "FILE: f: this field is missing");
  EXPECT_EQ(spoiled([](json& s) { s["f"][1] = "-m*gg"; }),
            "FILE: f[1], column 4: unknown name 'gg'; known are e, g, m, mu, t, q[i], v[i], pi and the functions");
  EXPECT_EQ(spoiled([](json& s) { s["f"] = {"0"}; }), "FILE: f, number of entries = 1: 2 are required");
  EXPECT_EQ(spoiled([](json& s) {
              s["M"][1] = {"0", "0"};
            }),
            "FILE: M(q0) = smallest pivot 0 relative to the diagonal: a positive definite, non-singular mass matrix is "
            "required");
  EXPECT_EQ(
      spoiled([](json& s) {
        s["M"][0] = {"m", "1"};
      }),
      "FILE: M(q0) = not symmetric: a symmetric matrix is required, largest difference 1 relative to the diagonal");
  EXPECT_EQ(spoiled([](json& s) { s["q0"][1] = "-0.1"; }),
            "FILE: contacts[0].gap (floor) = -0.1: gap(q0) >= 0 is required, the scene starts in penetration; "
            "--allow-penetration DEPTH starts from the nearest position that respects all gaps");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["e"] = "1.5"; }),
            "FILE: contacts[0].e (floor) = 1.5: eps_r in [0, 1] is required");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["e"] = "-0.5"; }),
            "FILE: contacts[0].e (floor) = -0.5: eps_r in [0, 1] is required");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["mu"] = "-1"; }),
            "FILE: contacts[0].mu (floor) = -1: mu >= 0 is required");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0].erase("Jt"); }),
            "FILE: contact 'floor': mu = 0.2: friction needs tangent directions Jt");
  EXPECT_EQ(spoiled([](json& s) {
              s["contacts"][0]["Jn"] = {"0", "2"};
            }),
            "FILE: contacts[0].Jn[1] = 2: the gradient of the gap is 1 there, not 2");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["gap"] = "1"; }),
            "FILE: contacts[0].Jn[1] = 1: the gradient of the gap is 0 there, not 1");
  EXPECT_EQ(spoiled([](json& s) { s["T"] = "0"; }), "FILE: T = 0: a positive number of seconds is required");
  EXPECT_EQ(spoiled([](json& s) { s["T"] = "-1"; }), "FILE: T = -1: a positive number of seconds is required");
  EXPECT_EQ(spoiled([](json& s) { s["params"]["m"] = "nan"; }), "FILE: params.m = nan: a finite number is required");
  EXPECT_EQ(spoiled([](json& s) { s["params"]["m"] = "1kg"; }),
            "FILE: params.m = '1kg', column 2: an operator or the end of the expression is expected");
  EXPECT_NE(spoiled([](json& s) {
              s["contact"] = "1";
            }).find("= 'contact': unknown; did you mean contacts or control? Known: Bu, M, T"),
            std::string::npos);
}

TEST_F(SceneFile, RestitutionHasTwoNames) {
  json scene = good_scene();
  scene["contacts"][0].erase("e");
  scene["contacts"][0]["eps_r"] = "e/2";
  EXPECT_EQ(read(scene)->info().contacts[0].eps_r, 0.25);
  scene["contacts"][0]["e"] = "e/2";
  EXPECT_EQ(error(scene), "FILE: contacts[0].eps_r = e/2: e is also given and means the same");
}

TEST_F(SceneFile, TangentsAreDirections) {
  const auto with_tangents = [](const char* directions, const char* mu) {
    json scene = good_scene();
    scene["contacts"][0]["Jt"] = json::parse(directions);
    scene["contacts"][0]["mu"] = mu;
    return scene;
  };
  for (const char* mu : {"mu", "0"}) {
    EXPECT_EQ(error(with_tangents(R"([["0", "0"]])", mu)),
              "FILE: contacts[0].Jt[0] = 0: a direction that is not zero at q0 is required");
    EXPECT_EQ(error(with_tangents(R"([["1", "0"], ["q[0]", "t"]])", mu)),
              "FILE: contacts[0].Jt[1] = 0: a direction that is not zero at q0 is required");
    EXPECT_EQ(error(with_tangents(R"([["1", "1e-10"], ["-2", "q[0]"]])", mu)),
              "FILE: contacts[0].Jt[1] = [\"-2\",\"q[0]\"]: a direction that is not parallel to Jt[0] "
              "at q0 is required");
    EXPECT_EQ(error(with_tangents(R"([["1", "if(q[0] > 0, 1, 1e200)**2"]])", mu)),
              "FILE: contacts[0].Jt[0] = not finite: finite entries at q0 are required");
    EXPECT_EQ(error(with_tangents(R"([["1", "0"], ["1", "1e-3"]])", mu)), "no error");
  }
}

TEST_F(SceneFile, NamesAreUsable) {
  const auto with_parameter = [](const std::string& name) {
    json scene = good_scene();
    scene["params"][name] = "1";
    return scene;
  };
  EXPECT_EQ(error(with_parameter("sin")),
            "FILE: params.sin = 1: 'sin' is a word of formulas; another name is required");
  EXPECT_EQ(error(with_parameter("pi")), "FILE: params.pi = 1: 'pi' is a word of formulas; another name is required");
  EXPECT_EQ(error(with_parameter("if")), "FILE: params.if = 1: 'if' is a word of formulas; another name is required");
  for (const char* name : {"a b", "", "2m", "m-1"})
    EXPECT_NE(error(with_parameter(name)).find("cannot stand in a formula; a name of letters, digits and _"),
              std::string::npos)
        << name;
  EXPECT_EQ(error(with_parameter("u")), "no error");
  EXPECT_EQ(error(with_parameter("_a1")), "no error");
  json twice = good_scene();
  twice["contacts"].push_back(twice["contacts"][0]);
  EXPECT_EQ(error(twice), "FILE: contacts[1].name = floor: contacts[0] has this name, another one is required");
}

TEST_F(SceneFile, TypesAndFieldsAroundAScene) {
  const auto around = [](const std::function<void(json&)>& change) {
    json document = {{"problem", good_scene()}};
    change(document);
    return document;
  };
  EXPECT_EQ(error(around([](json&) {})), "no error");
  EXPECT_EQ(error(json(5)), "FILE = number: an object with a scene is required");
  EXPECT_EQ(error(around([](json& d) { d["problem"] = 7; })), "FILE: problem = 7: an object is required");
  EXPECT_EQ(error(around([](json& d) { d["id"] = 7; })), "FILE: id = 7: a text in quotes is required");
  EXPECT_NE(error(around([](json& d) { d["parms"] = 7; })).find("'parms': unknown"), std::string::npos);
  EXPECT_EQ(error(json{{"cases", 7}}), "FILE: cases = 7: a list is required");
  EXPECT_EQ(error(json{{"cases", {7}}}), "FILE: cases[0] = 7: an object is required");
  EXPECT_EQ(error(json{{"cases", {{{"id", "a"}}}}}), "FILE: cases[0].problem: this field is missing");
}

TEST_F(SceneFile, ManyContactsHaveALimit) {
  json scene = good_scene();
  json contact = {{"gap", "q[1]"}};
  scene["contacts"] = json::array();
  for (int k = 0; k < 3000; ++k) scene["contacts"].push_back(contact);
  EXPECT_EQ(read(scene)->n_c(), 3000);
  scene["contacts"].insert(scene["contacts"].end(), 17000, contact);
  EXPECT_EQ(error(scene), "FILE: contacts, number of entries = 20000: at most 10000 are possible");
}

TEST_F(SceneFile, BilateralConstraintsHoldAtTheStart) {
  json rod = good_scene();
  rod["q0"] = {"1", "0"};
  rod["v0"] = {"0", "1"};
  rod["contacts"] = {{{"name", "rod"}, {"gap", "(q[0]**2 + q[1]**2 - 1)/2"}, {"bilateral", true}}};
  const auto spoiled = [&](const std::function<void(json&)>& spoil) {
    json scene = rod;
    spoil(scene);
    return error(scene);
  };
  const std::string projection = "--allow-penetration DEPTH starts from the nearest position that respects all gaps";
  const auto p = read(rod);
  EXPECT_TRUE(p->info().contacts[0].is_bilateral);
  EXPECT_EQ(p->info().bilateral, std::vector<int>{0});
  EXPECT_TRUE(p->info().unilateral.empty());
  EXPECT_EQ(spoiled([](json& s) { s["q0"][0] = "1.5"; }),
            "FILE: contacts[0].gap (rod) = 0.625: |gap(q0)| <= 2.25e-13 is required, it is bilateral; " + projection);
  EXPECT_EQ(spoiled([](json& s) { s["q0"][0] = "0.5"; }),
            "FILE: contacts[0].gap (rod) = -0.375: |gap(q0)| <= 2.5e-14 is required, it is bilateral; " + projection);
  EXPECT_EQ(spoiled([](json& s) { s["v0"][0] = "0.5"; }),
            "FILE: contacts[0].Jn' v0 (rod) = 0.5: |Jn' v0| <= 5e-14 is required, it is bilateral");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["e"] = "0.5"; }),
            "FILE: contacts[0].e (rod) = 0.5: a bilateral constraint has no restitution, 0 is required");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["mu"] = "0.1"; }),
            "FILE: contacts[0].mu (rod) = 0.1: a bilateral constraint has no friction, 0 is required");
  EXPECT_EQ(spoiled([](json& s) { s["contacts"][0]["bilateral"] = "yes"; }),
            "FILE: contacts[0].bilateral = \"yes\": true or false is required");
  json twice = rod["contacts"][0];
  twice["name"] = "second rod";
  EXPECT_NE(spoiled([&](json& s) { s["contacts"].push_back(twice); }).find("bilateral constraints must be independent"),
            std::string::npos);
  EXPECT_EQ(spoiled([&](json& s) {
              s["contacts"].push_back(twice);
              s["contacts"].push_back(twice);
              s["contacts"][2]["name"] = "third rod";
            }),
            "FILE: number of bilateral constraints = 3: at most n_q = 2 are possible");
}

TEST_F(SceneFile, TimeIsACoordinateWhereItOccurs) {
  EXPECT_EQ(read(good_scene())->info().clock, -1);
  const auto moved = [&](const std::function<void(json&)>& change) {
    json scene = good_scene();
    scene["contacts"][0].erase("Jn");
    change(scene);
    return scene;
  };
  const json load = moved([](json&s) { s["f"][0] = "3*t*v[0]"; }),
             table = moved([](json&s) { s["contacts"][0]["gap"] = "q[1]-t**2"; }),
             belt = moved([](json&s) { s["contacts"][0]["vt_drive"] = {"-2*t"}; });
  for (const json& scene : {load, table, belt}) {
    const auto p = read(scene);
    const ProblemInfo& info = p->info();
    EXPECT_EQ(info.clock, 2);
    EXPECT_EQ(info.n_mechanical(), 2);
    EXPECT_EQ(info.q0[2], 0);
    EXPECT_EQ(info.v0[2], 1);
    EXPECT_EQ(p->mass_matrix(info.q0)(2, 2), 1);
    EXPECT_EQ(p->force(info.q0, info.v0)[2], 0);
  }
  const Eigen::Vector3d q(0.5, 4, 3), v(2, 1, 1);
  EXPECT_DOUBLE_EQ(read(load)->force(q, v)[0], 3 * 3 * 2);
  EXPECT_DOUBLE_EQ(read(table)->gap(q)[0], 4 - 9);
  EXPECT_DOUBLE_EQ(read(table)->normal_jacobian(q).col(0).dot(v), 1 - 6);
  EXPECT_DOUBLE_EQ(read(table)->gap_acceleration_bias(q, v)[0], -2);
  EXPECT_DOUBLE_EQ(read(belt)->tangent_jacobian(q).col(0).dot(v), 2 - 6);
  EXPECT_DOUBLE_EQ(read(belt)->slip_acceleration_bias(q, v)[0], -2);
  EXPECT_FALSE(read(table)->info().contacts[0].is_affine);
  EXPECT_FALSE(read(load)->info().contacts[0].is_moving);
  // A control of time is part of the force.
  const auto driven = read(moved([](json& s) {
    s["Bu"] = {{"2"}, {"t"}};
    s["u"] = {"5*t"};
  }));
  EXPECT_EQ(driven->info().n_u, 0);
  EXPECT_DOUBLE_EQ(driven->force(q, v)[0], 30);
  EXPECT_DOUBLE_EQ(driven->force(q, v)[1], -9.81 + 45);
  // A contact without friction has no drive.
  EXPECT_EQ(read(moved([](json& s) {
              s["contacts"][0]["vt_drive"] = {"-2*t"};
              s["contacts"][0]["mu"] = "0";
            }))
                ->info()
                .clock,
            -1);
}

TEST_F(SceneFile, TimeHasItsPlaces) {
  const auto spoiled = [&](const std::function<void(json&)>& spoil) {
    json scene = good_scene();
    spoil(scene);
    return error(scene);
  };
  EXPECT_EQ(spoiled([](json& s) { s["params"]["t"] = "1"; }),
            "FILE: params.t = 1: t is the time; another name is required");
  EXPECT_EQ(spoiled([](json& s) {
              s["contacts"][0]["vt_drive"] = {"1", "2"};
            }),
            "FILE: contacts[0].vt_drive, number of entries = 2: 1 are required");
  EXPECT_EQ(spoiled([](json& s) { s["q0"][0] = "t"; }),
            "FILE: q0[0], column 1: 't' is not allowed here: this field is a constant of the motion, a formula of "
            "parameters; allowed are e, g, m, mu, pi and the functions");
  EXPECT_NE(spoiled([](json& s) { s["M"][0][0] = "m*t"; }).find("'t' is not allowed here"), std::string::npos);
  EXPECT_EQ(spoiled([](json& s) {
              s["contacts"][0] = {{"name", "nothing"}, {"gap", "1+t"}};
            }),
            "FILE: contacts[0].Jn (nothing) = 0: the gap does not depend on any coordinate at q0");
}

TEST(SceneText, HasTheInitialStateAndTheImpactLawThatWereSet) {
  const auto problem = make_problem("bouncing_ball");
  problem->set_initial_state(2 * problem->info().q0, problem->info().v0);
  ImpactLaw law = problem->info().impact_law;
  law.hypothesis = ImpactHypothesis::poisson;
  problem->set_impact_law(law);
  const auto copy = read_scene_text(scene_text(*problem), "copy");
  EXPECT_EQ(copy->info().q0, problem->info().q0);
  EXPECT_EQ(copy->info().impact_law.hypothesis, ImpactHypothesis::poisson);
}

TEST_F(SceneFile, IsWrittenWithItsTime) {
  const auto p = read_scene_file(test_data("moving_table.json"));
  const std::string text = scene_text(*p);
  EXPECT_NE(text.find("\"vt_drive\""), std::string::npos);
  const auto again = read_scene_text(text, "written");
  EXPECT_EQ(scene_text(*again), text);
  const Eigen::Vector3d q(0.1, 0.2, 0.3), v(-0.4, 0.5, 1);
  EXPECT_EQ(p->gap(q), again->gap(q));
  EXPECT_EQ(p->force(q, v), again->force(q, v));
  EXPECT_EQ(p->tangent_jacobian(q), again->tangent_jacobian(q));
}

TEST_F(SceneFile, UnreadableFiles) {
  EXPECT_THROW(read_scene_file("/nonexistent/scene.json"), InputError);
  std::ofstream(path) << "{\"q0\": [";
  EXPECT_THROW(read_scene_file(path), InputError);
  EXPECT_THROW(read_scene_file(reference_data("ground_truth.json")), InputError) << "several scenes need a choice";
  EXPECT_THROW(read_scene_file(reference_data("ground_truth.json") + "#P99"), InputError);
}

TEST(Registry, UnknownNamesComeWithTheNearest) {
  try {
    make_problem("bouncing_bal");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean bouncing_ball?"), std::string::npos) << e.what();
  }
}

TEST(Registry, BadParametersOfACompiledScene) {
  EXPECT_THROW(make_problem("bouncing_ball", {{"e", 1.5}}), InputError);
  EXPECT_THROW(make_problem("bouncing_ball", {{"m", 0}}), InputError) << "singular M";
  EXPECT_THROW(make_problem("bouncing_ball", {{"height", std::nan("")}}), InputError);
  EXPECT_THROW(make_problem("bouncing_ball", {{"height", -1}}), InputError) << "penetration";
  EXPECT_THROW(make_problem("sliding_block", {{"mu", -0.1}}), InputError);
  EXPECT_THROW(make_problem("bouncing_ball", {{"wind", 1}}), InputError);
}

}  // namespace
}  // namespace ricochet
