#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "problems/registry.h"
#include "problems/scene_file/scene_file.h"

namespace ricochet {
namespace {

struct Case {
  const char *id, *title;
  int certified_decimals;
  const char *method, *scene;
};

// id, title, certified decimals, what they were computed by, and scene of every case, taken from
// tests/data/ground_truth.json by CMake.
const Case cases[] = {
#include "ground_truth_cases.inc"
};

/// What a method finds hard in a case, and where its scene is from. The file of the cases says neither.
struct CaseText {
  const char *id, *hard_feature, *literature;
};

const char* const kOurs = "stated for this suite";
const char* const kBall = "Brogliato, Nonsmooth Mechanics, 3rd ed., section 1.2";

const CaseText kCaseTexts[] = {
    {"P1a_ball_e09", "three impacts and no other error: what an impact's instant is wrong by, all later ones inherit",
     kBall},
    {"P1b_ball_e05_pre_zeno",
     "impacts at ever shorter distances: it ends 22 ms behind the fourth, before they accumulate at 1.285 s", kBall},
    {"P1c_ball_e0",
     "an inelastic impact that begins a rest: the contact closes for good, and must neither sink nor lift", kBall},
    {"P1d_ball_e05_through_zeno",
     "infinitely many impacts until 1.285 s, and rest behind them: no method can locate them one by one", kBall},
    {"P2_two_balls_spring", "two elastic impacts 19 ms apart, and a spring whose oscillation goes on at 141 rad/s",
     "Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, section 5.1; first in Chen, Acary, Virlez, Bruls, IJNME 96 (2013)"},
    {"P3_sliding_block",
     "friction ends with the slip: its force is discontinuous at the instant at which the block stops", kOurs},
    {"P4a_clock_driven_block",
     "four changes between slip and stick under a load that depends on time: a block at rest must notice when to slip",
     kOurs},
    {"P4b_spring_driven_block",
     "eight changes of the friction mode in a row, three of them reversals of slip without a rest; errors of one shift "
     "all that follow",
     kOurs},
    {"P5_slip_reversal", "slip that changes its direction without sticking, since the force exceeds friction",
     "Nurkanovic, Frey, Pozharskiy, Diehl, FESD-J, figure of the switches due to friction, middle"},
    {"P6a_oblique_slip",
     "impacts with friction: three slip, and the fourth stops the tangential motion, so the law's mode changes", kOurs},
    {"P6b_oblique_stick",
     "the first impact takes all tangential velocity with less than the largest impulse: it sticks from then on",
     kOurs},
    {"P6c_spinning_disc",
     "impulses of friction couple spin and path: backspin turns the disc back at the second impact, the third sticks",
     kOurs},
    {"P7a_slide3d_to_stick",
     "slip in space that turns towards the force while it ends: the component across vanishes like (t_s - t)^2.5, and a "
     "method of high order loses its order in the last step",
     kOurs},
    {"P7b_slide3d_no_stick",
     "the direction of friction turns all the time, without an event: a force that is nonlinear in v", kOurs},
    {"P8a_bead_leaves_circle",
     "a closed contact on a curve that opens smoothly, with neither a jump in velocity nor one in force to be seen",
     kOurs},
    {"P8b_spring_table",
     "a contact between two bodies that opens smoothly where the spring is relaxed, and an impact of both", kOurs},
};

const CaseText& case_text(const std::string& id) {
  const auto found = std::ranges::find(kCaseTexts, id, &CaseText::id);
  if (found == std::end(kCaseTexts)) throw std::logic_error("no text says what is hard in " + id);
  return *found;
}

bool register_cases() {
  for (const Case& known : cases) {
    const CaseText& text = case_text(known.id);
    // Its source is a file, where bench/measure/known_truth.cpp finds the solution.
    SceneEntry entry{known.id, known.title, "tests/data/ground_truth.json", text.hard_feature, nullptr};
    entry.literature = text.literature;
    entry.solution = fmt::format("known to {} decimals, by {}", known.certified_decimals, known.method);
    const nlohmann::json document = {{"id", entry.id},
                                     {"title", entry.title},
                                     {"source", entry.source},
                                     {"hard_feature", entry.hard_feature},
                                     {"problem", nlohmann::json::parse(known.scene)}};
    entry.make = [text = document.dump(), id = entry.id](const ParameterChanges& changes) {
      return read_scene_text(text, id, changes);
    };
    add_scene(std::move(entry));
  }
  return true;
}

const bool registered = register_cases();

}  // namespace
}  // namespace ricochet
