// `ricochet truth -o FILE` and `ricochet truth --check FILE`.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "reference/certified/certified_motion.h"
#include "tests/cli/program.h"

namespace ricochet::cli {
namespace {

TEST_F(Cli, CertificatesAreWrittenCheckedAndRefused) {
  if (!reference::certified::can_certify()) GTEST_SKIP() << "built without Arb";
  const std::string path = (folder / "pendulum.cert.json").string();
  const std::string prove = "truth -p pendulum_wall --digits 20 -o " + path;
  ASSERT_EQ(run(prove).code, 0);
  const Outcome valid = run("truth --check " + path);
  EXPECT_EQ(valid.code, 0) << valid.text;
  EXPECT_HAS(valid.text, "valid      ");
  EXPECT_EQ(run(prove).code, 2);  // the file exists
  std::string text = read(path);
  text.replace(text.find("9.81"), 4, "9.82");
  std::ofstream(path) << text;
  const Outcome refused = run("truth --check " + path);
  EXPECT_EQ(refused.code, 1);
  EXPECT_HAS(refused.text, "refused    ");
  std::ofstream(path) << "{}";
  EXPECT_EQ(run("truth --check " + path).code, 2);
  EXPECT_EQ(run("truth --check " + path + ".missing").code, 2);
}

}  // namespace
}  // namespace ricochet::cli
