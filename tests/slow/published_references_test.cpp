// Who is right: proofs of the motions whose references others have published.
#include "tests/ground_truth/published_references.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "reference/agreement.h"
#include "reference/certified/certified_motion.h"
#include "tests/test_data.h"

namespace ricochet::reference::certified {
namespace {

/// Two decimals in the precision of long doubles, each rounded once, and the radius of the proof.
void expect_same_decimals(const std::vector<CertifiedNumber>& proven, const std::vector<std::string>& other,
                          const std::vector<double>& published, const std::string& file) {
  ASSERT_EQ(proven.size(), other.size());
  for (std::size_t k = 0; k < proven.size(); ++k) {
    const long double x = std::strtold(proven[k].text.c_str(), nullptr), y = std::strtold(other[k].c_str(), nullptr);
    EXPECT_LE(std::abs(x - y), std::abs(y) * 0x1p-62L + proven[k].radius) << file << " " << k;
    EXPECT_GT(std::abs(x - published[k]), proven[k].radius) << file << " " << k << ": published, and not true";
  }
}

/// Boxes would lose about 140 digits on the squeezing mechanism; the mean value form loses 22, and takes half a minute.
TEST(PublishedReferences, ProofsContainAnIndependentIntegrationAndNotThePublishedNumbers) {
  if (!can_certify()) GTEST_SKIP() << "built without Arb";
  for (const auto& reference : published_references()) {
    const auto problem = read_scene_file(test_data(reference.file + ".json"));
    const CertifiedMotion motion = certified_motion(*problem, {.digits = 20, .max_seconds = 1000});
    ASSERT_EQ(motion.grade, Grade::proven) << reference.file << ": " << motion.reason;
    EXPECT_TRUE(motion.assumptions.empty()) << reference.file;
    EXPECT_GE(motion.decimals(), 20) << reference.file;
    expect_same_decimals(motion.q, reference.q, reference.published_q, reference.file);
    expect_same_decimals(motion.v, reference.v, reference.published_v, reference.file);
  }
}

TEST(PublishedReferences, CvodeIsRightWithinItsClaim) {
  for (const auto& reference : published_references()) {
    const auto problem = read_scene_file(test_data(reference.file + ".json"));
    const Reference cvode = make_reference(*problem);
    for (std::size_t k = 0; k < reference.q.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      EXPECT_NEAR(cvode.solution.q[i], std::stod(reference.q[k]), cvode.uncertainty) << reference.file;
      EXPECT_NEAR(cvode.solution.v[i], std::stod(reference.v[k]), cvode.uncertainty) << reference.file;
    }
  }
}

}  // namespace
}  // namespace ricochet::reference::certified
