#include "reports/control_results.h"

#include <fmt/format.h>

#include <cmath>

#include "reports/json_number.h"

namespace ricochet {
namespace {

using nlohmann::json;

json to_json(const ControlRun::Motion& motion) {
  return {{"t", motion.t}, {"q", motion.q}, {"v", motion.v}};
}

ControlRun::Motion motion_from_json(const json& j) {
  ControlRun::Motion motion;
  j.at("t").get_to(motion.t);
  j.at("q").get_to(motion.q);
  j.at("v").get_to(motion.v);
  return motion;
}

}  // namespace

json to_json(const ControlRun& r) {
  json impacts = json::array();
  for (const auto& impact : r.impacts) {
    impacts.push_back(
        {{"t", impact.t}, {"contact", impact.contact}, {"Lambda_n", impact.Lambda_n}, {"Lambda_t", impact.Lambda_t}});
  }
  return {{"kind", "control_run"},
          {"problem", r.problem},
          {"title", r.title},
          {"discretisation", r.discretisation},
          {"command", r.command},
          {"variables", r.variables},
          {"pairs", r.pairs},
          {"status", r.status},
          {"message", r.message},
          {"iterations", r.iterations},
          {"seconds", r.seconds},
          {"claimed_cost", r.claimed_cost},
          {"penetration", r.penetration},
          {"T", r.T},
          {"u", r.u},
          {"claimed", to_json(r.claimed)},
          {"impacts", impacts},
          {"contacts", r.contacts},
          {"force_t", r.force_t},
          {"lambda_n", r.lambda_n},
          {"lambda_t", r.lambda_t},
          {"friction", r.friction},
          {"picture", to_json(r.picture)},
          {"replayed_by", r.replayed_by},
          {"replay_status", r.replay_status},
          {"replay_message", r.replay_message},
          {"true_cost", r.true_cost},
          {"terminal", r.terminal},
          {"events", r.events},
          {"replayed", to_json(r.replayed)}};
}

ControlRun control_run_from_json(const json& j) {
  ControlRun r;
  j.at("problem").get_to(r.problem);
  j.at("title").get_to(r.title);
  j.at("discretisation").get_to(r.discretisation);
  j.at("command").get_to(r.command);
  j.at("variables").get_to(r.variables);
  j.at("pairs").get_to(r.pairs);
  j.at("status").get_to(r.status);
  j.at("message").get_to(r.message);
  j.at("iterations").get_to(r.iterations);
  j.at("seconds").get_to(r.seconds);
  j.at("claimed_cost").get_to(r.claimed_cost);
  j.at("penetration").get_to(r.penetration);
  j.at("T").get_to(r.T);
  j.at("u").get_to(r.u);
  r.claimed = motion_from_json(j.at("claimed"));
  for (const auto& impact : j.at("impacts"))
    r.impacts.push_back({impact.at("t"), impact.at("contact"), impact.at("Lambda_n"), impact.at("Lambda_t")});
  j.at("contacts").get_to(r.contacts);
  j.at("force_t").get_to(r.force_t);
  j.at("lambda_n").get_to(r.lambda_n);
  j.at("lambda_t").get_to(r.lambda_t);
  j.at("friction").get_to(r.friction);
  r.picture = motion_picture_from_json(j.at("picture"));
  j.at("replayed_by").get_to(r.replayed_by);
  j.at("replay_status").get_to(r.replay_status);
  j.at("replay_message").get_to(r.replay_message);
  j.at("true_cost").get_to(r.true_cost);
  j.at("terminal").get_to(r.terminal);
  r.events = number_or_nan(j.at("events"));
  r.replayed = motion_from_json(j.at("replayed"));
  return r;
}

json to_json(const ControlGradient& g) {
  return {{"kind", "control_gradient"}, {"problem", g.problem},
          {"method", g.method},         {"steps", g.steps},
          {"components", g.components}, {"derivatives", g.derivatives},
          {"error", g.error},           {"error_after_impact", g.error_after_impact}};
}

ControlGradient control_gradient_from_json(const json& j) {
  ControlGradient g;
  j.at("problem").get_to(g.problem);
  j.at("method").get_to(g.method);
  j.at("steps").get_to(g.steps);
  j.at("components").get_to(g.components);
  j.at("derivatives").get_to(g.derivatives);
  j.at("error").get_to(g.error);
  j.at("error_after_impact").get_to(g.error_after_impact);
  return g;
}

Table control_table(const std::vector<ControlRun>& runs) {
  Table table;
  table.title = "Claimed and true optimal control";
  table.columns = {{"problem", true}, {"discretisation", true}, {"variables"},    {"iterations"},
                   {"seconds"},       {"status", true},         {"claimed cost"}, {"true cost"},
                   {"terminal"},      {"impacts [s]"},          {"penetration"},  {"replayed by", true}};
  for (const auto& run : runs) {
    std::vector<std::string> row{run.problem,
                                 run.discretisation,
                                 fmt::format("{}", run.variables),
                                 fmt::format("{}", run.iterations),
                                 fmt::format("{:.1f}", run.seconds),
                                 run.status};
    row.push_back(run.succeeded() ? fmt::format("{:.6g}", run.claimed_cost) : "-");
    row.push_back(run.is_replayed() ? fmt::format("{:.6g}", run.true_cost) : "-");
    row.push_back(run.is_replayed() ? scientific(run.terminal) : "-");
    row.push_back(!run.is_replayed() ? "-" : std::isnan(run.events) ? "other" : scientific(run.events));
    row.push_back(run.succeeded() ? scientific(run.penetration) : "-");
    row.push_back(run.is_replayed() ? run.replayed_by : "-");
    table.rows.push_back(row);
  }
  table.note =
      "True: the controls, open loop, on the plant with the event-located reference, or with adaptive FESD-J where "
      "that calls the forces indeterminate. Terminal: max-norm of the "
      "difference of (q, v) at T; impacts: the largest difference of their times, \"other\" when they are not the "
      "same; "
      "penetration: the deepest in the claimed motion. Seconds contain those for the guess.";
  return table;
}

Table control_failures(const std::vector<ControlRun>& runs) {
  Table table;
  table.title = "Not solved, or not replayed by the reference";
  table.columns = {{"problem", true}, {"discretisation", true}, {"reason", true}, {"command", true}};
  for (const auto& run : runs) {
    if (run.succeeded() && run.replay_message.empty()) continue;
    const std::string reason =
        run.succeeded() ? "replay: " + run.replay_message : fmt::format("{}: {}", run.status, run.message);
    table.rows.push_back({run.problem, run.discretisation, reason, run.command});
  }
  return table;
}

Table gradient_table(const std::vector<ControlGradient>& gradients) {
  Table table;
  table.title = "Derivatives of the terminal state with respect to the controls";
  table.columns = {{"method", true}, {"steps per interval"}, {"relative error"}, {"after the last impact"}};
  for (const auto& g : gradients) {
    if (g.is_reference()) continue;
    table.rows.push_back({g.method, fmt::format("{}", g.steps), scientific(g.error), scientific(g.error_after_impact)});
  }
  table.note =
      "The largest error over the components of (q, v) at T and the intervals, relative to the largest derivative of "
      "that component; then of the intervals behind the last impact alone. Reference: central differences of "
      "CVODE with located events. Time stepping: differences of the discrete scheme, which are its derivatives.";
  return table;
}

Table gradient_details(const std::vector<ControlGradient>& gradients) {
  Table table;
  table.title = "All derivatives";
  table.columns = {{"method", true}, {"steps per interval"}, {"component", true}, {"control"}, {"derivative"}};
  for (const auto& g : gradients) {
    for (std::size_t c = 0; c < g.components.size(); ++c) {
      for (std::size_t k = 0; k < g.derivatives[c].size(); ++k)
        table.rows.push_back({g.method, g.is_reference() ? "-" : fmt::format("{}", g.steps), g.components[c],
                              fmt::format("{}", k + 1), fmt::format("{:.10g}", g.derivatives[c][k])});
    }
  }
  return table;
}

}  // namespace ricochet
