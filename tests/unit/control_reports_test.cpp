// What becomes of results of optimal control: rows, tables, pictures.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "bench/control/control_claim.h"
#include "bench/studies/control/animation.h"
#include "bench/studies/control/gradient_rows.h"
#include "bench/studies/control/seed_rows.h"
#include "problems/input_error.h"
#include "reports/motion_picture.h"
#include "tests/round_trip.h"

namespace ricochet {
namespace {

/// A wheel rolls past its goal and is pushed back.
MotionPicture carts() {
  MotionPicture picture;
  for (const double x : {0.0, 1.5})
    picture.frames.push_back({x, {Shape::ground(0), Shape::circle(1, x, 0.5, 0.5)}, {{0, x + 0.5, 0.5, -2 * x, 0}}});
  return picture;
}

TEST(ControlResults, SurviveTheRoundTripAndShowFailures) {
  ControlRun run;
  run.problem = "two_carts";
  run.discretisation = "FESD-J";
  run.status = "success";
  run.claimed_cost = 19.5;
  run.u = {{1.0}, {2.0}};
  run.T = 1;
  run.claimed = {{0, 1}, {{0.5}, {0.75}}, {{0}, {0.5}}};
  run.contacts = {"bumper"};
  run.friction = {0};
  run.impacts = {{0.5, 0, 2, {-0.25}}};
  run.force_t = {1};
  run.lambda_n = {{3}};
  run.lambda_t = {{-1}};
  run.picture = carts();
  run.replay_status = "inner_solver_failed";
  run.replay_message = "why";
  run.events = std::numeric_limits<double>::quiet_NaN();
  const ControlRun read = round_trip(run);
  EXPECT_SURVIVES(run);
  EXPECT_EQ(read.picture.frames[1].shapes[1].numbers, run.picture.frames[1].shapes[1].numbers);
  EXPECT_TRUE(std::isnan(read.events));
  EXPECT_EQ(control_table({run}).rows[0][6], "19.5");
  EXPECT_EQ(control_table({run}).rows[0][8], "-") << "no replay, no mismatch";
  run.replay_status = "success";
  EXPECT_EQ(control_table({run}).rows[0][9], "other") << "the impacts are not the same";
  run.replay_status = "inner_solver_failed";
  ASSERT_EQ(control_failures({run}).rows.size(), 1u);
  EXPECT_NE(control_failures({run}).rows[0][2].find("why"), std::string::npos);

  const ControlGradient gradient{"two_carts", "fesd", 4, {"q_1"}, {{1, 2}}, 1e-8, 1e-9};
  EXPECT_SURVIVES(gradient);
  EXPECT_EQ(gradient_details({gradient}).rows.size(), 2u);
}

TEST(MotionPicture, LiesInsideOfItsView) {
  const MotionPicture picture = carts();
  const PictureView view = view_of(picture, 200);
  EXPECT_DOUBLE_EQ(view.x(-0.5) + view.x(2.0), 200) << "shapes from -0.5 to 2 m, the same margin on both sides";
  EXPECT_GT(view.x(-0.5), 0);
  EXPECT_GT(view.y(1), 0);
  EXPECT_LT(view.y(0), view.height);
  EXPECT_EQ(view.largest_force, 3);
  EXPECT_EQ(picture.at(1.4).t, 1.5);
  // An arrow of no length is there, without a path, for an animation to draw later.
  EXPECT_NE(svg_of(picture.frames[0], view).find("data-arrow=\"0\""), std::string::npos);
  EXPECT_NE(svg_of(picture.frames[0], view).find("d=\"\""), std::string::npos);
  EXPECT_EQ(svg_of(picture.frames[1], view).find("d=\"\""), std::string::npos);
  EXPECT_EQ(impact_ring(picture.frames[1], view, 7), "") << "no arrow, no place";
}

TEST(MotionPicture, AnUnknownShapeIsBadInput) {
  nlohmann::json j = carts();
  j["shapes"][1]["kind"] = "blob";
  EXPECT_THROW(j.get<MotionPicture>(), InputError);
}

/// Every element is closed, in the order in which it was opened; quotes end where they begin.
bool is_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  for (auto at = xml.find('<'); at != std::string::npos; at = xml.find('<', at)) {
    const auto end = xml.find('>', at);
    if (end == std::string::npos) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (std::ranges::count(tag, '"') % 2 != 0 || tag.find('<') != std::string::npos) return false;
    const std::string name = tag.substr(0, tag.find_first_of(" \n/", 1));
    if (tag.starts_with('/')) {
      if (open.empty() || "/" + open.back() != tag) return false;
      open.pop_back();
    } else if (!tag.ends_with('/')) {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty();
}

TEST(Frames, AndTheAnimationAreWellFormed) {
  const std::string folder = std::filesystem::temp_directory_path() / ("ricochet_frames_" + std::to_string(getpid()));
  ASSERT_TRUE(is_well_formed("<a b=\"c\"><d/></a>"));
  ASSERT_FALSE(is_well_formed("<a><b></a></b>"));
  ControlRun run;
  run.title = "one < two";
  run.T = 1.5;
  run.contacts = {"wall & floor"};
  run.impacts = {{1.5, 0, 2, {}}};
  run.picture = carts();
  const Figure figure = draw_frames(FigureFolder(folder), run, "frames");
  std::ifstream file(folder + "/" + figure.file);
  const std::string svg((std::istreambuf_iterator<char>(file)), {});
  EXPECT_TRUE(is_well_formed(svg)) << svg;
  EXPECT_NE(svg.find("class=\"impact\""), std::string::npos);
  const auto count = [&](const std::string& part) {
    int n = 0;
    for (auto at = svg.find(part); at != std::string::npos; at = svg.find(part, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("<text"), 12);

  std::filesystem::remove_all(folder);

  std::string html = animation_html(run);
  html.erase(html.find("<script"), html.find("</script>") - html.find("<script") + std::string("</script>").size());
  const auto input = html.find("<input");
  ASSERT_NE(input, std::string::npos);
  html.insert(html.find('>', input), "/");  // in HTML it has no end
  EXPECT_TRUE(is_well_formed(html)) << html;
}

TEST(Pictures, OfEveryOptimalControlProblemShowBodiesAndContacts) {
  for (const auto& entry : control_problems()) {
    const auto problem = entry.make({});
    ASSERT_TRUE(problem->shapes) << entry.id;
    const ProblemInfo& info = problem->plant->info();
    const Forces forces{Vector::Ones(info.n_u), Vector::Ones(info.n_c()), Vector::Ones(info.n_c())};
    const auto shapes = problem->shapes(info.q0);
    const auto arrows = problem->arrows(info.q0, forces);
    EXPECT_EQ(problem->shapes(info.q0 + Vector::Ones(info.n_q)).size(), shapes.size()) << entry.id;
    for (int body = 1; body <= 2; ++body)
      EXPECT_TRUE(std::ranges::any_of(shapes, [&](const Shape& s) { return s.body == body && !s.is_goal; }));
    EXPECT_EQ(std::ranges::count(arrows, -1, &Arrow::contact), 1) << entry.id;
    for (int i = 0; i < info.n_c(); ++i) EXPECT_EQ(std::ranges::count(arrows, i, &Arrow::contact), 1) << entry.id;
  }
}

TEST(Pictures, AreSampledFromTheClaimWithItsImpacts) {
  // Cart 2 at 1 + t^3: the cubic through both ends.
  ControlTrajectory trajectory;
  trajectory.u = Matrix::Ones(1, 2);
  trajectory.T = 2;
  trajectory.u(0, 1) = -3;
  for (const double t : {0.0, 2.0})
    trajectory.points.push_back({t, Vector{{0, 1 + t * t * t}}, Vector{{0, 3 * t * t}}, Vector{{5 + t}}, Vector(0)});
  trajectory.impulses = {{0.123456, 0, 100, Vector(0)}, {1.0, 0, 1e-9, Vector(0)}};
  ControlRun run;
  describe_claim(*make_control_problem("two_carts"), trajectory, run);
  ASSERT_EQ(run.impacts.size(), 1u) << "the other one is too small to be an impact";
  EXPECT_EQ(run.picture.at(0.1234).t, 0.123456);
  const auto x_2 = [](const MotionPicture::Frame& frame) {
    return std::ranges::find_if(frame.shapes, [](const Shape& s) { return s.body == 2 && !s.is_goal; })->numbers[0];
  };
  for (const auto& frame : run.picture.frames)
    EXPECT_NEAR(x_2(frame) - x_2(run.picture.frames[0]), frame.t * frame.t * frame.t, 1e-14);  // rounding of 8
  EXPECT_EQ(run.picture.at(0.9).arrows[0].F_x, 1) << "the control of the first interval";
  EXPECT_EQ(run.picture.at(1.1).arrows[0].F_x, -3);
  EXPECT_EQ(run.picture.at(1.1).arrows[1].F_x, 7) << "the force of the next point";
  EXPECT_EQ(run.picture.at(2).arrows[1].F_x, 7);
}

/// Four guesses of one problem, one of them without a solution, and one of another.
std::vector<SeedRun> guesses() {
  std::vector<SeedRun> runs;
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    SeedRun run;
    run.problem = "discs";
    run.arguments = "--noise 0.1 --time-limit 60";
    run.seed = seed;
    run.status = seed == 3 ? "time_limit" : "success";
    run.message = seed == 3 ? "too late; violation 0.1" : "";
    run.iterations = 100 * static_cast<int>(seed);
    run.seconds = 2.0 * seed;
    run.cpu_seconds = seed;
    run.cost = 10.0 * seed;
    run.stationarity = seed == 4 ? "W" : "S";
    run.is_b_stationary = seed != 4;
    run.replay_status = seed < 3 ? "success" : seed == 4 ? "infeasible" : "";
    run.terminal = seed == 4 ? std::numeric_limits<double>::quiet_NaN() : 1e-9 * seed;
    runs.push_back(run);
  }
  runs.push_back(runs[2]);
  runs.back().problem = "three_boxes";
  return runs;
}

TEST(SeedResults, SurviveTheRoundTrip) {
  for (const auto& run : guesses()) EXPECT_SURVIVES(run);
  EXPECT_EQ(guesses()[1].command(), "ricochet control discs --noise 0.1 --time-limit 60 --seed 2");
}

TEST(SeedResults, TheTableCountsFailuresAndHasQuartilesOfTheRest) {
  const Table table = seed_table(guesses());
  ASSERT_EQ(table.rows.size(), 2u);
  const auto cell = [&](std::size_t row, const std::string& header) {
    const auto column = std::ranges::find(table.columns, header, &Table::Column::header);
    return table.rows[row].at(static_cast<std::size_t>(column - table.columns.begin()));
  };
  EXPECT_EQ(cell(0, "solved"), "3 of 4, 75 %");
  EXPECT_EQ(cell(0, "stationary"), "S 2, W 1");
  EXPECT_EQ(cell(0, "B"), "2");
  EXPECT_EQ(cell(0, "least cost"), "10");
  EXPECT_EQ(cell(0, "cost"), "15 | 20 | 30") << "of 10, 20, 40";
  EXPECT_EQ(cell(0, "worst cost"), "40");
  EXPECT_EQ(cell(0, "CPU s"), "1.5 | 2 | 3");
  EXPECT_EQ(cell(0, "iterations"), "150 | 200 | 300");
  EXPECT_EQ(cell(0, "replayed"), "2");
  EXPECT_EQ(cell(0, "off by"), "1.5e-09") << "of the two that were replayed";
  EXPECT_EQ(cell(1, "solved"), "0 of 1, 0 %");
  EXPECT_EQ(cell(1, "cost"), "-");
  EXPECT_EQ(cell(1, "stationary"), "-");

  const Table failed = seed_failures(guesses());
  ASSERT_EQ(failed.rows.size(), 2u);
  EXPECT_EQ(failed.rows[0][3], "too late");
  EXPECT_EQ(failed.rows[0][4], "3");
  EXPECT_EQ(seed_details(guesses()).rows.size(), 5u) << "no run is dropped";
}

}  // namespace
}  // namespace ricochet
