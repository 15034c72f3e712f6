// Certificates: written, read, verified; and refused after every change.
#include "reference/certified/certificate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "problems/input_error.h"
#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/certificate_checker.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference::certified {
namespace {

using nlohmann::ordered_json;

Certificate certificate_of_problem(const Problem& problem, int digits = 30) {
  Options options;
  options.with_steps = true;
  options.digits = digits;
  options.max_seconds = 60;
  return certificate_of(problem, certified_motion(problem, options), options);
}

ordered_json json_of_problem(const std::string& id) {
  return ordered_json::parse(certificate_text(certificate_of_problem(*make_problem(id))));
}

/// The content with the hash that belongs to it: what somebody writes who changes a certificate on purpose.
std::string sealed(ordered_json json) {
  json.erase("sha256");
  const std::string hash = sha256(json.dump());
  json["sha256"] = hash;
  return json.dump();
}

/// Why a text is refused; empty if it is valid.
std::string refusal(const std::string& text) {
  try {
    const CertificateReport report = check_certificate(read_certificate(text));
    return report.is_valid ? "" : fmt::format("step {}: {}", report.step, report.reason);
  } catch (const InputError& error) {
    return error.what();
  }
}

class ValidCertificate : public testing::TestWithParam<const char*> {};

/// With RICOCHET_CERTIFICATES the file is left in that folder, for other checkers.
void expect_valid_certificate(const Problem& problem, const std::string& name) {
  const std::string text = certificate_text(certificate_of_problem(problem));
  EXPECT_EQ(refusal(text), "");
  EXPECT_EQ(certificate_text(read_certificate(text)), text);
  EXPECT_LT(text.size(), 100000U);
  if (const char* folder = std::getenv("RICOCHET_CERTIFICATES"))
    std::ofstream(fmt::format("{}/{}.json", folder, name)) << text;
}

TEST_P(ValidCertificate, IsAccepted) {
  expect_valid_certificate(*make_problem(GetParam()), GetParam());
}

TEST(ValidCertificateOfFrictionElement, IsAccepted) {
  const auto problem = read_scene_text(
      R"~({"q0": ["0", "0"], "v0": ["2", "0"], "T": "5", "M": [["1", "0"], ["0", "2"]], "f": ["2.5*cos(3*t)", "-0.3*v[1]"],
          "friction": [{"name": "clutch", "Jt": [["1", "-1"]], "bound": "1+0.5*sin(2*t)"}]})~",
      "clutch");
  expect_valid_certificate(*problem, "clutch");
}

INSTANTIATE_TEST_SUITE_P(Scenes, ValidCertificate,
                         testing::Values("bouncing_ball", "two_balls_spring", "pendulum_wall", "oblique_impact",
                                         "rocking_block", "belt_oscillator", "woodpecker_toy", "double_pendulum_wall",
                                         "falling_rod", "shaken_table", "pendulum_wall_cartesian", "sliding_block",
                                         "ball_in_box", "kane_pendulum", "stacked_blocks", "slider_crank_stop",
                                         "block_on_ramp", "ball_row"),
                         [](const auto& name) { return std::string(name.param); });

TEST(Certificate, HasImpactsAtTheStart) {
  const auto problem = read_scene_text(
      R"({"q0": ["0"], "v0": ["-1"], "T": "0.9", "M": [["1"]], "f": ["-1"],
          "contacts": [{"name": "floor", "gap": "q[0]", "e": "0.5"}]})",
      "scene");
  const Certificate certificate = certificate_of_problem(*problem);
  ASSERT_EQ(certificate.events.size(), 1U);
  EXPECT_EQ(certificate.events[0].step, -1);
  EXPECT_EQ(refusal(certificate_text(certificate)), "");
}

TEST(Certificate, OfSimultaneousImpactsDoesNotExist) {
  const auto problem = read_scene_text(
      R"({"q0": ["1", "1"], "v0": ["0", "0"], "T": "0.6", "M": [["1", "0"], ["0", "1"]], "f": ["-9.81", "-9.81"],
          "contacts": [{"name": "a", "gap": "q[0]", "e": "0.5"}, {"name": "b", "gap": "q[1]", "e": "0.5"}]})",
      "scene");
  EXPECT_THROW(certificate_of_problem(*problem), InputError);
}

TEST(Certificate, ThatCannotBeReadIsAnInputError) {
  EXPECT_THROW(read_certificate("{"), InputError);
  EXPECT_THROW(read_certificate("{}"), InputError);
  ordered_json json = json_of_problem("bouncing_ball");
  json["steps"][0]["h"] = "half";
  EXPECT_THROW(read_certificate(json.dump()), InputError);
}

/// A change of a certificate, with a name for messages.
struct Change {
  std::string name;
  std::function<void(ordered_json&)> apply;
};

std::string text_of(const Ball& ball) {
  char* const dump = arb_dump_str(ball.get());
  std::string text = dump;
  flint_free(dump);
  return text;
}

/// Moves a ball by a multiple of its radius, exactly.
void move(ordered_json& text, double radii) {
  Ball ball = ball_of_text(text.get<std::string>()), by(radii), radius;
  arf_set_mag(arb_midref(radius.get()), arb_radref(ball.get()));
  arb_mul(by.get(), by.get(), radius.get(), ARF_PREC_EXACT);
  arf_add(arb_midref(ball.get()), arb_midref(ball.get()), arb_midref(by.get()), ARF_PREC_EXACT, ARF_RND_DOWN);
  text = text_of(ball);
}

/// Multiplies a radius by a power of two.
void scale_radius(ordered_json& text, int exponent) {
  Ball ball = ball_of_text(text.get<std::string>());
  mag_mul_2exp_si(arb_radref(ball.get()), arb_radref(ball.get()), exponent);
  text = text_of(ball);
}

bool has_radius(const ordered_json& text) {
  const Ball ball = ball_of_text(text.get<std::string>());
  return !mag_is_zero(arb_radref(ball.get()));
}

/// A digit of a midpoint that is smaller than the radius is no statement.
bool is_far_from_zero(const ordered_json& text) {
  const Ball ball = ball_of_text(text.get<std::string>());
  Magnitude middle(ball.midpoint());
  mag_mul_2exp_si(middle.get(), middle.get(), -40);
  return mag_cmp(middle.get(), arb_radref(ball.get())) > 0;
}

/// Adds one to a digit of a decimal or hexadecimal number, the `place`-th one that is not zero.
void change_digit(ordered_json& text, int place) {
  auto digits = text.get<std::string>();
  int seen = 0;
  for (char& digit : digits) {
    if (digit < '1' || digit > '8' || seen++ != place) continue;
    ++digit;
    break;
  }
  text = digits;
}

void scale_hexadecimal(ordered_json& text, double factor) {
  text = fmt::format("{:a}", std::strtod(text.get<std::string>().c_str(), nullptr) * factor);
}

void add_changes_of_step(const ordered_json& json, std::size_t k, std::vector<Change>& changes) {
  const ordered_json& step = json["steps"][k];
  const auto add = [&](const std::string& name, std::function<void(ordered_json&)> apply) {
    changes.push_back({fmt::format("step {}: {}", k, name), [=](ordered_json& c) { apply(c["steps"][k]); }});
  };
  changes.push_back({fmt::format("step {} left out", k), [=](ordered_json& c) { c["steps"].erase(k); }});
  changes.push_back({fmt::format("step {} twice", k), [=](ordered_json& c) {
                       const ordered_json copy = c["steps"][k];
                       c["steps"].insert(c["steps"].begin() + static_cast<std::ptrdiff_t>(k), copy);
                     }});
  add("h longer by 1 of 1000", [](ordered_json& s) { scale_hexadecimal(s["h"], 1.001); });
  add("h shorter by half", [](ordered_json& s) { scale_hexadecimal(s["h"], 0.5); });
  add("modes", [](ordered_json& s) { s["modes"][0] = s["modes"][0] == "open" ? "closed" : "open"; });
  for (std::size_t i = 0; i < step["x"].size(); ++i) {
    if (step["rho"][i] != "0x0p+0")
      add(fmt::format("rho[{}] / 16", i), [=](ordered_json& s) { scale_hexadecimal(s["rho"][i], 1. / 16); });
    if (!has_radius(step["x"][i]) || k == 0) continue;
    add(fmt::format("x[{}] moved by 8 radii", i), [=](ordered_json& s) { move(s["x"][i], 8); });
    if (is_far_from_zero(step["x"][i]))
      add(fmt::format("a digit of x[{}]", i), [=](ordered_json& s) { change_digit(s["x"][i], 0); });
    add(fmt::format("radius of x[{}] left out", i), [=](ordered_json& s) { scale_radius(s["x"][i], -400); });
    add(fmt::format("radius of x[{}] * 2^20", i), [=](ordered_json& s) { scale_radius(s["x"][i], 20); });
  }
  if (has_radius(step["t"])) {
    add("t moved by 8 radii", [](ordered_json& s) { move(s["t"], 8); });
    if (k > 1) add("radius of t left out", [](ordered_json& s) { scale_radius(s["t"], -400); });
    add("radius of t * 2^20", [](ordered_json& s) { scale_radius(s["t"], 20); });
  }
  if (!has_radius(step["end"])) return;
  add("end moved by 8 radii", [](ordered_json& s) { move(s["end"], 8); });
  add("radius of the end left out", [](ordered_json& s) { scale_radius(s["end"], -400); });
  if (k + 1 < json["steps"].size())  // at rest, the end of the last step has no effect
    add("radius of the end * 64", [](ordered_json& s) { scale_radius(s["end"], 6); });
}

void add_changes_of_event(const ordered_json& json, std::size_t k, std::vector<Change>& changes) {
  const auto add = [&](const std::string& name, std::function<void(ordered_json&)> apply) {
    changes.push_back({fmt::format("event {}: {}", k, name), [=](ordered_json& c) { apply(c["events"][k]); }});
  };
  changes.push_back({fmt::format("event {} left out", k), [=](ordered_json& c) { c["events"].erase(k); }});
  add("kind", [](ordered_json& e) { e["kind"] = e["kind"] == "impact" ? "detach" : "impact"; });
  add("contact", [](ordered_json& e) { e["contact"] = "nothing"; });
  add("modes", [](ordered_json& e) { e["modes"][0] = e["modes"][0] == "open" ? "closed" : "open"; });
  add("step", [](ordered_json& e) { e["step"] = e["step"].get<int>() + 1; });
  add("a digit of the time", [](ordered_json& e) { change_digit(e["time"]["value"], 20); });
  add("radius of the time", [](ordered_json& e) { e["time"]["radius"] = e["time"]["radius"].get<double>() / 2; });
  add("decimals of the time", [](ordered_json& e) { e["time"]["decimals"] = e["time"]["decimals"].get<int>() + 1; });
  for (std::size_t i = 0; i < json["events"][k]["Lambda_n"].size(); ++i) {
    if (json["events"][k]["Lambda_n"][i]["radius"] == 0.0) continue;
    add("a digit of Lambda_n", [=](ordered_json& e) { change_digit(e["Lambda_n"][i]["value"], 10); });
    add("radius of Lambda_n",
        [=](ordered_json& e) { e["Lambda_n"][i]["radius"] = e["Lambda_n"][i]["radius"].get<double>() / 16; });
  }
}

std::vector<Change> changes_of(const ordered_json& json) {
  std::vector<Change> changes;
  for (std::size_t k = 0; k < json["steps"].size(); ++k) add_changes_of_step(json, k, changes);
  for (std::size_t k = 0; k < json["events"].size(); ++k) add_changes_of_event(json, k, changes);
  const auto add = [&](const std::string& name, std::function<void(ordered_json&)> apply) {
    changes.push_back({name, std::move(apply)});
  };
  add("grade", [](ordered_json& c) { c["grade"] = c["grade"] == "proven" ? "assumed" : "proven"; });
  add("an assumption", [](ordered_json& c) { c["assumptions"].push_back("friction is symmetric"); });
  add("digits", [](ordered_json& c) { c["digits"] = 5; });
  add("bits", [](ordered_json& c) { c["bits"] = c["bits"].get<int>() / 2; });
  add("reading", [](ordered_json& c) { c["reading"] = "rounded"; });
  add("hash of the scene", [](ordered_json& c) { change_digit(c["scene_sha256"], 3); });
  add("a number of the scene", [](ordered_json& c) {
    auto scene = c["scene"].get<std::string>();
    scene.replace(scene.find("9.81"), 4, "9.82");
    c["scene"] = scene;
    c["scene_sha256"] = sha256(scene);
  });
  add("final modes", [](ordered_json& c) { c["final"]["modes"][0] = "stuck"; });
  for (std::size_t i = 0; i < json["final"]["x"].size(); ++i) {
    add("final x moved", [=](ordered_json& c) { move(c["final"]["x"][i], 8); });
    add("final radius / 2", [=](ordered_json& c) { scale_radius(c["final"]["x"][i], -1); });
    add("final radius * 2", [=](ordered_json& c) { scale_radius(c["final"]["x"][i], 1); });
  }
  for (const char* const name : {"q", "v"}) {
    for (std::size_t i = 0; i < json["final"][name].size(); ++i) {
      add("a digit of the result", [=](ordered_json& c) { change_digit(c["final"][name][i]["value"], 25); });
      add("radius of the result", [=](ordered_json& c) { c["final"][name][i]["radius"] = 1e-60; });
      add("decimals of the result", [=](ordered_json& c) { c["final"][name][i]["decimals"] = 60; });
    }
  }
  return changes;
}

class ChangedCertificate : public testing::TestWithParam<const char*> {};

/// Even if its hash belongs to the changed content.
TEST_P(ChangedCertificate, IsRefusedByMathematics) {
  const ordered_json original = json_of_problem(GetParam());
  ASSERT_EQ(refusal(sealed(original)), "");
  const std::vector<Change> changes = changes_of(original);
  std::vector<std::string> accepted;
  int n_changed = 0;
  for (const Change& change : changes) {
    ordered_json changed = original;
    change.apply(changed);
    if (changed == original) continue;
    ++n_changed;
    if (refusal(sealed(changed)).empty()) accepted.push_back(change.name);
  }
  EXPECT_TRUE(accepted.empty()) << fmt::format("{} of {} are accepted", accepted.size(), n_changed);
  for (const auto& name : accepted) ADD_FAILURE() << "accepted: " << name;
  EXPECT_GT(n_changed, 100);
  fmt::print("{}: {} changes\n", GetParam(), n_changed);
}

INSTANTIATE_TEST_SUITE_P(Scenes, ChangedCertificate,
                         testing::Values("bouncing_ball", "pendulum_wall", "oblique_impact", "belt_oscillator",
                                         "stacked_blocks"),
                         [](const auto& name) { return std::string(name.param); });

/// One character of the file at a time: a changed digit may leave the statements true, but not the hash.
TEST(ChangedCertificate, IsRefusedByItsHash) {
  const std::string text = certificate_text(certificate_of_problem(*make_problem("oblique_impact")));
  const ordered_json original = ordered_json::parse(text);
  int n_changed = 0;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] < '0' || text[k] > '9') continue;
    std::string changed = text;
    changed[k] = changed[k] == '9' ? '0' : static_cast<char>(changed[k] + 1);
    if (ordered_json::parse(changed, nullptr, false) == original) continue;  // the 17th digit of a double
    ++n_changed;
    EXPECT_NE(refusal(changed), "") << "character " << k;
  }
  EXPECT_GT(n_changed, 1000);
}

TEST(Sha256, OfKnownTexts) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

}  // namespace
}  // namespace ricochet::reference::certified
