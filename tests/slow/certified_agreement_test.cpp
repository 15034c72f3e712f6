// Proofs and event-located integration share no equations: where both have an answer, they agree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/agreement.h"
#include "reference/certified/certified_motion.h"
#include "tests/test_data.h"

namespace ricochet::reference::certified {
namespace {

double value(const CertifiedNumber& number) {
  return std::strtod(number.text.c_str(), nullptr);
}

double distance_to_nearest(double t, const std::vector<double>& times) {
  double nearest = HUGE_VAL;
  for (const double other : times) nearest = std::min(nearest, std::abs(other - t));
  return nearest;
}

/// An impact with an approach velocity that only the rounding of the scene's numbers makes: a reference sees none.
bool is_rounding(const CertifiedEvent& event) {
  constexpr double kImpulse = 1e-15;  // some roundings of the scenes, whose masses and velocities are of size one [N s]
  return event.kind == "impact" &&
         std::ranges::all_of(event.Lambda_n, [](const auto& impulse) { return std::abs(value(impulse)) < kImpulse; });
}

/// Largest difference of the final state, and of the times of events where both lists have as many. References resolve
/// fewer impacts that accumulate, and list a slip that begins at t = 0.
double difference(const CertifiedMotion& proven, const Solution& solution) {
  double largest = 0;
  for (std::size_t k = 0; k < proven.q.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    largest =
        std::max({largest, std::abs(value(proven.q[k]) - solution.q[i]), std::abs(value(proven.v[k]) - solution.v[i])});
  }
  std::vector<double> times, others;
  for (const auto& event : proven.events) {
    if (!is_rounding(event)) times.push_back(value(event.time));
  }
  for (const auto& event : solution.events) others.push_back(event.t);
  if (times.size() != others.size()) return largest;
  for (const double t : times) largest = std::max(largest, distance_to_nearest(t, others));
  for (const double t : others) largest = std::max(largest, distance_to_nearest(t, times));
  return largest;
}

/// The scenes of the program, and those of the files in a folder; a file may state several cases.
std::vector<std::string> scenes_in(const std::string& folder) {
  std::vector<std::string> names;
  if (folder.empty()) {
    for (const auto& scene : scenes()) names.push_back(scene.id);
    return names;
  }
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.path().extension() != ".json") continue;
    const auto document = nlohmann::json::parse(std::ifstream(file.path()));
    if (document.contains("problem") || document.contains("T")) names.push_back(file.path().string());
    for (const auto& entry : document.value("cases", nlohmann::json::array())) {
      if (entry.contains("problem")) names.push_back(file.path().string() + "#" + entry.at("id").get<std::string>());
    }
  }
  std::ranges::sort(names);
  return names;
}

std::unique_ptr<Problem> scene_named(const std::string& name) {
  return name.find(".json") == std::string::npos ? make_problem(name) : read_scene_file(name);
}

struct Scenes {
  std::string folder;
  int n_least;  ///< scenes with a proof and a reference
};

class CertifiedAgreement : public testing::TestWithParam<Scenes> {};

/// On every scene whose motion is proven, the CVODE reference is right within its claim. Numbers are doubles, as in the
/// reference.
TEST_P(CertifiedAgreement, ReferencesAreRightWithinTheirClaim) {
  if (!can_certify()) GTEST_SKIP() << "built without Arb";
  int n_compared = 0;
  for (const auto& name : scenes_in(GetParam().folder)) {
    const auto problem = scene_named(name);
    Options options;
    options.digits = 20;
    options.max_seconds = 3;
    options.reading = Reading::rounded;
    const CertifiedMotion proven = certified_motion(*problem, options);
    if (proven.grade > Grade::assumed) continue;
    Reference reference;
    try {
      reference = make_reference(*problem);
    } catch (const std::runtime_error&) {  // no reference
      continue;
    }
    EXPECT_LE(difference(proven, reference.solution), reference.uncertainty) << name;
    ++n_compared;
  }
  EXPECT_GE(n_compared, GetParam().n_least);
}

INSTANTIATE_TEST_SUITE_P(Scenes, CertifiedAgreement,
                         testing::Values(Scenes{"", 30}, Scenes{test_data(""), 15}, Scenes{reference_data(""), 2},
                                         Scenes{reference_data("public_reports/scenes"), 20}),
                         [](const auto& info) {
                           return info.index == 0 ? "Program" : "Folder" + std::to_string(info.index);
                         });

}  // namespace
}  // namespace ricochet::reference::certified
