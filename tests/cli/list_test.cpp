// `ricochet list NAME` of everything that there is.
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "methods/registry.h"
#include "problems/control/optimal_control_problem.h"
#include "problems/registry.h"
#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

void expect_parameters(const std::string& name) {
  const Outcome outcome = run("list " + name);
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  static const std::regex parameter("  --set \\w+=[-+.\\de]+ +(\\S.*)");
  int n = 0;
  for (const auto& line : lines_of(outcome.text)) {
    if (!line.starts_with("  --set ")) continue;
    EXPECT_TRUE(std::regex_match(line, parameter)) << name << ": no default or no unit: " << line;
    ++n;
  }
  EXPECT_GT(n, 0) << outcome.text;
}

TEST(List, ProblemsHaveParametersWithDefaultsAndUnits) {
  for (const auto& scene : scenes()) expect_parameters(scene.id);
  for (const auto& problem : control_problems()) expect_parameters(problem.id);
}

/// Names before an = sign.
std::set<std::string> options_in(const std::string& text, const std::string& before) {
  const std::regex option(before + "([a-z_0-9]+)=");
  std::set<std::string> names;
  for (std::sregex_iterator at(text.begin(), text.end(), option), end; at != end; ++at) names.insert((*at)[1]);
  return names;
}

/// What a method asks for is what its usage says.
TEST(List, MethodsHaveTheirOptions) {
  for (const auto& method : methods()) {
    const Outcome outcome = run("list " + method.name);
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    EXPECT_HAS(outcome.text, method.usage);
    if (!method.make || method.examples.empty()) continue;  // without an example nobody knows what it asks for
    EXPECT_EQ(options_in(outcome.text, "\n  "), options_in(method.usage, "[\\[,]")) << method.name;
  }
  EXPECT_HAS(run("list fesd").text, "\n  max_elements=64              a whole number from 1 to 100000\n");
  EXPECT_HAS(run("list fesd").text, "\n  elements=fixed               one of fixed, as_needed\n");
}

TEST(List, OfAStudyAndAnExperimentOfOneNameSaysBoth) {
  const Outcome outcome = run("list zeno");
  EXPECT_HAS(outcome.text, "study zeno: ");
  EXPECT_HAS(outcome.text, "\n  restitution ");
  EXPECT_HAS(outcome.text, "experiment zeno: ");
}

}  // namespace
}  // namespace ricochet::cli
