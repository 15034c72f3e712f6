#include "bench/commands/run_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "bench/measure/environment.h"
#include "problems/vector_json.h"
#include "reports/run.h"

namespace ricochet {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr const char* kOpenWedge =
    "are a wedge at a jump of the motion with the data: the motion is one limit of those of neighbouring scenes";

std::string numbers(const Eigen::Ref<const Vector>& x) {
  return fmt::format("{:.15g}", fmt::join(x.begin(), x.end(), "  "));
}

void print_state(const RunReport& report) {
  const Solution& solution = report.solution;
  const ProblemInfo& info = report.problem.info();
  fmt::print("status     {}{}\n", to_string(solution.status), solution.message.empty() ? "" : ": " + solution.message);
  fmt::print("t          {:.15g} of {:.15g} s\nq          {}\nv          {}\n", solution.t, info.end_time,
             numbers(solution.q.head(info.n_mechanical())), numbers(solution.v.head(info.n_mechanical())));
  if (solution.succeeded() && info.until >= 0)
    fmt::print("until      {} = 0{}\n", info.switches[info.until].formula,
               solution.t < info.end_time ? "" : ", which it did not reach");
  const auto before = report.problem.energy(info.q0, info.v0), after = report.problem.energy(solution.q, solution.v);
  if (before && after) fmt::print("energy     {:.12g} J, {:+.3g} J since the start\n", *after, *after - *before);
}

void print_events(const RunReport& report, std::size_t shown) {
  const Solution& solution = report.solution;
  const ProblemInfo& info = report.problem.info();
  if (solution.events.empty()) return;
  fmt::print("events     {}\n", solution.events.size());
  // Events that repeat at one instant, where impacts accumulate, are printed once and counted.
  std::string instant;
  std::set<std::string> at_instant;
  std::size_t repeated = 0, lines = 0, k = 0;
  const auto print_repeated = [&] {
    if (repeated > 0) fmt::print("  and {} more events of these kinds at t = {}\n", repeated, instant);
    repeated = 0;
  };
  for (; k < solution.events.size(); ++k) {
    const Event& e = solution.events[k];
    const std::string t = fmt::format("{:.12g}", e.t);
    if (t != instant) {
      print_repeated();
      at_instant.clear();
      instant = t;
    }
    const std::string& name = info.contacts[e.contact].name;
    if (!at_instant.insert(fmt::format("{} {}", to_string(e.kind), name)).second && !solution.succeeded()) {
      ++repeated;
      continue;
    }
    if (lines == shown) break;
    ++lines;
    fmt::print("  {:<8} t = {:.15g}  {}{}\n", to_string(e.kind), e.t, name,
               e.kind == EventKind::impact ? fmt::format("  Lambda_n = {:.6g} N s", e.Lambda_n[e.contact]) : "");
  }
  print_repeated();
  if (k < solution.events.size()) fmt::print("  and {} more events, see --events\n", solution.events.size() - k);
}

/// "'disc 5, floor', 'discs 1, 5'"
std::string names(const std::vector<int>& contacts, const ProblemInfo& info) {
  std::string text;
  for (const int i : contacts) text += fmt::format("{}'{}'", text.empty() ? "" : ", ", info.contacts[i].name);
  return text;
}

void print_groups(const RunReport& report) {
  const Solution& solution = report.solution;
  if (!solution.captures.empty())
    fmt::print("captures   {} groups of contacts came to rest: {:.3g} m and {:.3g} m/s removed in all\n",
               solution.captures.size(), solution.captured_height(), solution.captured_speed());
  for (const OpenWedge& wedge : solution.wedges)
    fmt::print("note       at t = {:.12g} s {} {}\n", wedge.t, names(wedge.contacts, report.problem.info()),
               kOpenWedge);
}

void print_sensitivities(const RunReport& report, std::size_t shown) {
  const int n = report.problem.info().n_mechanical();
  const Solution& solution = report.solution;
  for (std::size_t k = 0; k < report.settings.sensitivities.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    Vector dt(static_cast<Eigen::Index>(shown));
    for (Eigen::Index e = 0; e < dt.size(); ++e) dt[e] = solution.events[static_cast<std::size_t>(e)].dt[column];
    fmt::print("d/d {}{}\n  dq       {}\n  dv       {}\n", report.settings.sensitivities[k],
               report.by_differences ? ", by differences of its solution" : "",
               numbers(solution.dq.col(column).head(n)), numbers(solution.dv.col(column).head(n)));
    if (dt.size() > 0) fmt::print("  dt       {}\n", numbers(dt));
  }
}

void print_work(const RunReport& report) {
  const Counters& c = report.solution.counters;
  fmt::print(
      "work       {} steps, {} elements, {} force evaluations, {} Newton iterations, {} factorizations, {} contact "
      "problems\n",
      c.steps, c.elements, c.force_evaluations, c.inner_iterations, c.matrix_factorizations, c.complementarity_solves);
  std::string cost;
  if (report.n_solutions() > 1)
    cost = fmt::format(", for {} solutions", report.n_solutions());
  else if (c.steps > 0)
    cost = fmt::format(", {:.3f} us a step (one run, not a benchmark)",
                       report.seconds * 1e6 / static_cast<double>(c.steps));
  fmt::print("wall time  {:.3f} ms{}\n", report.seconds * 1e3, cost);
}

json names(const std::vector<ContactMode>& modes) {
  json list = json::array();
  for (const ContactMode mode : modes) list.push_back(to_string(mode));
  return list;
}

ordered_json event_json(const Event& event, const Problem& problem) {
  const ProblemInfo& info = problem.info();
  const int n = info.n_mechanical();
  return {{"t", event.t},
          {"kind", to_string(event.kind)},
          {"contact", event.contact},
          {"name", info.contacts[event.contact].name},
          {"q", Vector(event.q.head(n))},
          {"v_minus", Vector(event.v_minus.head(n))},
          {"v_plus", Vector(event.v_plus.head(n))},
          {"Lambda_n", event.Lambda_n},
          {"Lambda_t", problem.friction_forces(event.q, event.Lambda_t)},
          {"modes", names(event.modes)}};
}

ordered_json problem_json(const ProblemInfo& info) {
  ordered_json parameters = ordered_json::object();
  for (const auto& parameter : info.parameters) parameters[parameter.name] = parameter.value;
  std::vector<std::string> contacts;
  for (const auto& contact : info.contacts) contacts.push_back(contact.name);
  return {{"id", info.id},
          {"title", info.title},
          {"parameters", parameters},
          {"contacts", contacts},
          {"q0", Vector(info.q0.head(info.n_mechanical()))},
          {"v0", Vector(info.v0.head(info.n_mechanical()))},
          {"T", info.end_time},
          {"until", info.until < 0 ? json() : json(info.switches[info.until].formula)}};
}

ordered_json sensitivities_json(const RunReport& report) {
  ordered_json all = ordered_json::array();
  const Solution& solution = report.solution;
  if (!solution.succeeded()) return all;
  const int n = report.problem.info().n_mechanical();
  for (std::size_t k = 0; k < report.settings.sensitivities.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    json dt = json::array();
    for (const Event& event : solution.events) dt.push_back(event.dt[column]);
    all.push_back({{"by", report.settings.sensitivities[k]},
                   {"by_differences", report.by_differences},
                   {"dq", Vector(solution.dq.col(column).head(n))},
                   {"dv", Vector(solution.dv.col(column).head(n))},
                   {"dt", dt}});
  }
  return all;
}

ordered_json captures_json(const Solution& solution) {
  ordered_json groups = ordered_json::array();
  for (const CapturedGroup& group : solution.captures)
    groups.push_back(
        {{"t", group.t}, {"contacts", group.n_contacts}, {"height", group.height}, {"speed", group.speed}});
  return {{"height", solution.captured_height()}, {"speed", solution.captured_speed()}, {"groups", groups}};
}

ordered_json notes_json(const Solution& solution, const ProblemInfo& info) {
  ordered_json notes = ordered_json::array();
  for (const OpenWedge& wedge : solution.wedges) {
    ordered_json contacts = ordered_json::array();
    for (const int i : wedge.contacts) contacts.push_back(info.contacts[i].name);
    notes.push_back({{"t", wedge.t},
                     {"contacts", contacts},
                     {"text", fmt::format("{} {}", names(wedge.contacts, info), kOpenWedge)}});
  }
  return notes;
}

ordered_json or_null(const std::optional<double>& x) {
  return x ? ordered_json(*x) : ordered_json();
}

constexpr const char* kRunSchema = R"~({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "A run of Ricochet",
  "description": "The output of `ricochet run --json`. Units are those of the SI, contacts and components are numbered from 0, numbers have all digits, and null means that a number does not exist. Vectors q and v have one entry per coordinate, without a clock.",
  "type": "object", "additionalProperties": false,
  "required": ["program", "problem", "method", "settings", "status", "message", "t", "q", "v", "energy", "error", "disagreement", "reference", "events", "initial_modes", "captures", "notes", "counters", "seconds", "solutions", "sensitivities"],
  "properties": {
    "program": {"type": "string", "description": "Version and revision of the program.", "examples": ["ricochet 0.1.0, revision ab12cd3"]},
    "problem": {"type": "object", "additionalProperties": false, "required": ["id", "title", "parameters", "contacts", "q0", "v0", "T", "until"], "description": "The problem.", "examples": [{"id": "bouncing_ball"}], "properties": {
      "id": {"type": "string", "description": "Name of the problem.", "examples": ["bouncing_ball"]},
      "title": {"type": "string", "description": "Short description.", "examples": ["bouncing ball in one dimension"]},
      "parameters": {"type": "object", "additionalProperties": {"type": "number"}, "description": "All parameters, with their values in this run.", "examples": [{"e": 0.9}]},
      "contacts": {"type": "array", "items": {"type": "string"}, "description": "Names of the contacts.", "examples": [["ground"]]},
      "q0": {"$ref": "#/$defs/numbers", "description": "Initial coordinates.", "examples": [[1]]},
      "v0": {"$ref": "#/$defs/numbers", "description": "Initial velocities.", "examples": [[0]]},
      "T": {"type": "number", "description": "End time [s].", "examples": [2]},
      "until": {"type": ["string", "null"], "description": "The formula at whose zero the run ends; null: none.", "examples": ["q[1] - 0.3"]}}},
    "method": {"type": "object", "additionalProperties": false, "required": ["spec", "title", "source", "order_smooth", "order_impacts"], "description": "The method.", "examples": [{"spec": "moreau_jean"}], "properties": {
      "spec": {"type": "string", "description": "As on the command line.", "examples": ["fesd:gauss:2"]},
      "title": {"type": "string", "description": "Short description.", "examples": ["Moreau-Jean"]},
      "source": {"type": "string", "description": "Publication.", "examples": ["Jean (1999)"]},
      "order_smooth": {"type": "number", "description": "Order on smooth motion.", "examples": [4]},
      "order_impacts": {"type": "number", "description": "Order of the final state, through impacts.", "examples": [4]}}},
    "settings": {"type": "object", "additionalProperties": false, "required": ["steps", "tolerance", "inner_tolerance", "event_tolerance", "time_limit"], "description": "Settings of the run.", "examples": [{"steps": 100}], "properties": {
      "steps": {"type": "integer", "description": "Number of steps of a fixed-step method; else 0.", "examples": [100]},
      "tolerance": {"type": "number", "description": "Tolerance of an error-controlled method; else 0.", "examples": [1e-9]},
      "inner_tolerance": {"type": "number", "description": "Relative size of the last Newton correction.", "examples": [1e-13]},
      "event_tolerance": {"type": "number", "description": "Relative width of the interval that brackets an event.", "examples": [1e-13]},
      "time_limit": {"type": "number", "description": "Limit of the wall time [s]; 0: none.", "examples": [60]}}},
    "status": {"type": "string", "enum": ["success", "infeasible", "inner_solver_failed", "step_limit", "time_limit", "non_finite"], "description": "How the run ended.", "examples": ["success"]},
    "message": {"type": "string", "description": "Why it stopped early; empty on success.", "examples": [""]},
    "t": {"type": "number", "description": "Time that was reached [s].", "examples": [2]},
    "q": {"$ref": "#/$defs/numbers", "description": "Coordinates there.", "examples": [[0.25]]},
    "v": {"$ref": "#/$defs/numbers", "description": "Velocities there, the left limit at an impact.", "examples": [[-1.5]]},
    "energy": {"type": ["object", "null"], "additionalProperties": false, "required": ["start", "end"], "description": "null if the scene has no potential energy.", "examples": [{"start": 9.81, "end": 9.5}], "properties": {
      "start": {"type": "number", "description": "Energy at t = 0 [J].", "examples": [9.81]},
      "end": {"type": ["number", "null"], "description": "Energy at t [J].", "examples": [9.5]}}},
    "error": {"type": ["number", "null"], "description": "Largest component of the difference of (q, v) at the end time to the reference; null if there is no reference, if the run failed, or if they disagree.", "examples": [2.5e-11]},
    "disagreement": {"type": ["object", "null"], "additionalProperties": false, "required": ["difference", "method_claims", "reference_claims"], "description": "The method and the reference differ by more than the sum of their claimed errors: one of them is wrong, and it is unknown which. null if they agree, or if the method claims no error.", "examples": [null], "properties": {
      "difference": {"type": "number", "description": "Largest component of the difference of (q, v) at the end time.", "examples": [0.85]},
      "method_claims": {"type": "number", "description": "Claimed error: 1e4 tolerances relative to the size of the solution.", "examples": [1e-5]},
      "reference_claims": {"type": "number", "description": "Claimed bound for the error of the reference.", "examples": [1e-13]}}},
    "reference": {"type": "object", "additionalProperties": false, "required": ["how", "uncertainty"], "description": "The reference solution of the error.", "examples": [{"how": "CVODE", "uncertainty": 1e-13}], "properties": {
      "how": {"type": "string", "description": "Its origin, or the reason why there is none.", "examples": ["CVODE with event location"]},
      "uncertainty": {"type": ["number", "null"], "description": "Bound for its own error; null if there is none.", "examples": [1e-13]}}},
    "events": {"type": "array", "description": "All changes of the set of active contacts, in their order.", "items": {"type": "object", "additionalProperties": false, "required": ["t", "kind", "contact", "name", "q", "v_minus", "v_plus", "Lambda_n", "Lambda_t", "modes"], "properties": {
      "t": {"type": "number", "description": "Time [s].", "examples": [0.45]},
      "kind": {"type": "string", "enum": ["impact", "detach", "slip_to_stick", "stick_to_slip", "slip_reversal", "facet_change"], "description": "Kind of the event.", "examples": ["impact"]},
      "contact": {"type": "integer", "minimum": 0, "description": "Number of the contact.", "examples": [0]},
      "name": {"type": "string", "description": "Name of the contact.", "examples": ["ground"]},
      "q": {"$ref": "#/$defs/numbers", "description": "Coordinates there.", "examples": [[0.1]]},
      "v_minus": {"$ref": "#/$defs/numbers", "description": "Velocities before it.", "examples": [[-4.2]]},
      "v_plus": {"$ref": "#/$defs/numbers", "description": "Velocities after it.", "examples": [[3.8]]},
      "Lambda_n": {"$ref": "#/$defs/numbers", "description": "Normal impulses of all contacts [N s]; zero unless an impact.", "examples": [[0.8]]},
      "Lambda_t": {"$ref": "#/$defs/numbers", "description": "Tangential impulses of all contacts [N s], contact after contact.", "examples": [[]]},
      "modes": {"$ref": "#/$defs/modes", "description": "Modes of all contacts after it; empty if the method has no modes.", "examples": [["open"]]}}}},
    "initial_modes": {"$ref": "#/$defs/modes", "description": "Modes after t = 0; empty if the method has no modes.", "examples": [["open"]]},
    "captures": {"type": "object", "additionalProperties": false, "required": ["height", "speed", "groups"], "description": "Groups of contacts that were closed at one instant, in place of infinitely many impacts that become ever lower; what this removed bounds the change of the state.", "examples": [{"height": 0, "speed": 0, "groups": []}], "properties": {
      "height": {"type": "number", "description": "Sum over the groups [m].", "examples": [1.3e-8]},
      "speed": {"type": "number", "description": "Sum over the groups [m/s].", "examples": [1.7e-3]},
      "groups": {"type": "array", "description": "The groups, in the order of time.", "items": {"type": "object", "additionalProperties": false, "required": ["t", "contacts", "height", "speed"], "properties": {
        "t": {"type": "number", "description": "Time [s].", "examples": [0.26]},
        "contacts": {"type": "integer", "minimum": 2, "description": "Number of contacts of the group.", "examples": [5]},
        "height": {"type": "number", "description": "Largest gap, or height of the next bounce, of one of its contacts [m].", "examples": [4e-9]},
        "speed": {"type": "number", "description": "Largest normal velocity of one of its contacts [m/s].", "examples": [3e-4]}}}}}},
    "notes": {"type": "array", "description": "Where the motion is one limit of those of neighbouring scenes: a wedge of contacts, such as that of a disc above a row exactly as wide as its box, was left open.", "items": {"type": "object", "additionalProperties": false, "required": ["t", "contacts", "text"], "properties": {
      "t": {"type": "number", "description": "Time [s].", "examples": [0.2587]},
      "contacts": {"type": "array", "items": {"type": "string"}, "description": "Names of the contacts of the wedge.", "examples": [["discs 1, 5", "discs 2, 5"]]},
      "text": {"type": "string", "description": "The same as a sentence.", "examples": ["'discs 1, 5', 'discs 2, 5' are a wedge at a jump of the motion with the data: the motion is one limit of those of neighbouring scenes"]}}}},
    "counters": {"type": "object", "additionalProperties": {"type": "integer"}, "description": "Work, counted in the same way by every method.", "examples": [{"steps": 100}]},
    "seconds": {"type": "number", "description": "Wall time of all solutions [s]; one run, not a benchmark.", "examples": [0.002]},
    "solutions": {"type": "integer", "minimum": 1, "description": "Number of solutions in this time; all but one are for differences.", "examples": [1]},
    "sensitivities": {"type": "array", "description": "Derivatives, for each --sensitivity; empty if the run failed.", "items": {"type": "object", "additionalProperties": false, "required": ["by", "by_differences", "dq", "dv", "dt"], "properties": {
      "by": {"type": "string", "description": "Variable: q0:K, v0:K or param:NAME.", "examples": ["param:e"]},
      "by_differences": {"type": "boolean", "description": "Whether they are finite differences, for a method without sensitivities.", "examples": [false]},
      "dq": {"$ref": "#/$defs/numbers", "description": "Derivative of q at the end time.", "examples": [[0.5]]},
      "dv": {"$ref": "#/$defs/numbers", "description": "Derivative of v at the end time.", "examples": [[0.5]]},
      "dt": {"$ref": "#/$defs/numbers", "description": "Derivatives of the event times.", "examples": [[0]]}}}}
  },
  "$defs": {
    "numbers": {"type": "array", "items": {"type": ["number", "null"]}, "description": "A list of numbers."},
    "modes": {"type": "array", "items": {"type": "string", "enum": ["open", "closed", "stick", "slip+", "slip-", "slip", "vertex slip", "edge slip"]}, "description": "One mode per contact."}
  }
})~";

}  // namespace

void print_run(const RunReport& report, std::size_t most_events) {
  const std::size_t shown = std::min(report.solution.events.size(), most_events);
  const ProblemInfo& info = report.problem.info();
  fmt::print("problem    {}: {}\nmethod     {}: {}\n", info.id, info.title, report.method, report.method_info.title);
  print_state(report);
  print_events(report, shown);
  print_groups(report);
  if (report.solution.succeeded()) print_sensitivities(report, shown);
  print_work(report);
  std::fflush(stdout);
}

std::optional<double> RunReport::claim() const {
  constexpr double kClaimed = 1e4;  // tolerances are of a step; global errors in the suite are up to 1e3 of them
  if (!method_info.is_adaptive || !(settings.tolerance > 0) || !reference) return std::nullopt;
  const ProblemInfo& info = problem.info();
  const double start = std::max(info.q0.cwiseAbs().maxCoeff(), info.v0.cwiseAbs().maxCoeff());
  const double end = std::max(solution.q.cwiseAbs().maxCoeff(), solution.v.cwiseAbs().maxCoeff());
  return kClaimed * settings.tolerance * std::max({start, end, reference->size()});
}

bool RunReport::exceeds_claims() const {
  const auto claimed = claim();
  return claimed && settings.sensitivities.empty() && solution.succeeded() &&
         reference->error_of(solution) > *claimed + reference->uncertainty;
}

void print_error(const RunReport& report) {
  if (report.disagrees())
    fmt::print(
        "disagree   method and reference differ by {:.3g} in (q, v) at the end time, more than both claim: one of them "
        "is wrong\n  method     claims {:.1g}\n  reference  {}; claims {:.1g}\n    q          {}\n    v          {}\n",
        report.reference->error_of(report.solution), *report.claim(), report.reference->how,
        report.reference->uncertainty, numbers(report.reference->solution.q.head(report.problem.info().n_mechanical())),
        numbers(report.reference->solution.v.head(report.problem.info().n_mechanical())));
  else if (report.reference)
    fmt::print("error      {:.3g} in (q, v) at the end time{}\n{:<10} {}; its own error is below {:.1g}\n",
               report.reference->error_of(report.solution),
               report.exceeds_claims() ? fmt::format(": the method is wrong, it claims {:.1g}", *report.claim()) : "",
               report.reference->is_truth ? "truth" : "reference", report.reference->how,
               report.reference->uncertainty);
  else if (!report.without_reference.empty())
    fmt::print("error      unknown: {}\n", report.without_reference);
}

ordered_json run_json(const RunReport& report) {
  const Solution& solution = report.solution;
  const ProblemInfo& info = report.problem.info();
  const auto before = report.problem.energy(info.q0, info.v0), after = report.problem.energy(solution.q, solution.v);
  ordered_json events = ordered_json::array();
  for (const Event& event : solution.events) events.push_back(event_json(event, report.problem));
  const auto& reference = report.reference;
  return {{"program", version_text()},
          {"problem", problem_json(info)},
          {"method",
           {{"spec", report.method},
            {"title", report.method_info.title},
            {"source", report.method_info.source},
            {"order_smooth", report.method_info.order_smooth},
            {"order_impacts", report.method_info.order_impacts}}},
          {"settings",
           {{"steps", report.settings.steps},
            {"tolerance", report.settings.tolerance},
            {"inner_tolerance", report.settings.inner_tolerance},
            {"event_tolerance", report.settings.event_tolerance},
            {"time_limit", report.settings.time_limit}}},
          {"status", to_string(solution.status)},
          {"message", solution.message},
          {"t", solution.t},
          {"q", Vector(solution.q.head(info.n_mechanical()))},
          {"v", Vector(solution.v.head(info.n_mechanical()))},
          {"energy", before ? ordered_json{{"start", *before}, {"end", or_null(after)}} : ordered_json()},
          {"error", reference && !report.disagrees() ? ordered_json(reference->error_of(solution)) : ordered_json()},
          {"disagreement", report.disagrees() ? ordered_json{{"difference", reference->error_of(solution)},
                                                             {"method_claims", *report.claim()},
                                                             {"reference_claims", reference->uncertainty}}
                                              : ordered_json()},
          {"reference",
           {{"how", reference ? reference->how : report.without_reference},
            {"uncertainty", reference ? ordered_json(reference->uncertainty) : ordered_json()}}},
          {"events", events},
          {"initial_modes", names(solution.initial_modes)},
          {"captures", captures_json(solution)},
          {"notes", notes_json(solution, info)},
          {"counters", json(solution.counters)},
          {"seconds", report.seconds},
          {"solutions", report.n_solutions()},
          {"sensitivities", sensitivities_json(report)}};
}

const JsonSchema& run_schema() {
  static const JsonSchema schema = JsonSchema::parse(kRunSchema);
  return schema;
}

}  // namespace ricochet
