#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/commands/commands.h"
#include "bench/commands/number_checks.h"
#include "bench/commands/problem_options.h"
#include "problems/input_error.h"
#include "reference/certified/certificate.h"
#include "reference/proven.h"
#include "reports/text_file.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;
using reference::certified::CertifiedEvent;
using reference::certified::CertifiedMotion;
using reference::certified::CertifiedNumber;
using reference::certified::Grade;
using reference::certified::Reading;

struct TruthArguments {
  ProblemOptions problem;
  reference::certified::Options options;
  bool rounded = false, as_json = false;
  std::string output, check;  ///< files of certificates to write and to check
};

/// "0.123 +- 4.5e-32"
std::string with_radius(const CertifiedNumber& number) {
  return number.radius > 0 ? fmt::format("{} +- {:.1e}", number.text, number.radius) : number.text;
}

void print_event(const CertifiedEvent& event, const ProblemInfo& info) {
  fmt::print("event      t = {}  {}, {}; modes {}\n", with_radius(event.time), event.kind, event.contact,
             fmt::join(event.modes, ", "));
  for (std::size_t i = 0; i < event.Lambda_n.size(); ++i) {
    if (event.Lambda_n[i].text != "0")
      fmt::print("           Lambda_n of {}: {} N s\n", info.contacts[i].name, with_radius(event.Lambda_n[i]));
  }
}

void print_sensitivities(const CertifiedMotion& motion) {
  if (!motion.no_sensitivities.empty()) fmt::print("no d/dtheta {}\n", motion.no_sensitivities);
  for (const auto& column : motion.sensitivities) {
    if (!column.reason.empty()) fmt::print("d/d({})  none: {}\n", column.variable, column.reason);
    const auto print = [&](const char* name, const std::vector<CertifiedNumber>& numbers) {
      for (std::size_t k = 0; k < numbers.size(); ++k)
        fmt::print("d {}[{}] / d {}  {}\n", name, k, column.variable, with_radius(numbers[k]));
    };
    print("q", column.q);
    print("v", column.v);
  }
}

void print_motion(const CertifiedMotion& motion, std::optional<double> moved, const ProblemInfo& info) {
  fmt::print("problem    {}: {}\n", info.id, info.title);
  fmt::print(
      "grade      {}{}\n", name_of(motion.grade),
      motion.grade == Grade::open ? ": " + motion.reason : fmt::format(", {} decimal places", motion.decimals()));
  for (const auto& assumption : motion.assumptions) fmt::print("assumed    {}\n", assumption);
  fmt::print("numbers    {}\n", motion.reading == Reading::decimal
                                    ? "as written; parameters as the shortest decimals that read back to their doubles"
                                    : "rounded to doubles, as methods integrate them");
  if (moved) fmt::print("           rounded to doubles, they move the final state by {:.1e}\n", *moved);
  for (const auto& event : motion.events) print_event(event, info);
  if (motion.grade == Grade::open) {
    fmt::print("stopped    t = {}\n", motion.end_time.text);
  } else {
    fmt::print("end        t = {}; modes {}\n", motion.end_time.text, fmt::join(motion.modes, ", "));
  }
  for (std::size_t k = 0; k < motion.q.size(); ++k) fmt::print("q[{}]       {}\n", k, with_radius(motion.q[k]));
  for (std::size_t k = 0; k < motion.v.size(); ++k) fmt::print("v[{}]       {}\n", k, with_radius(motion.v[k]));
  print_sensitivities(motion);
  fmt::print("work       {:.3g} s; {} bits, order {}, {} steps, {}, {} attempt{}\n", motion.seconds, motion.bits,
             motion.order, motion.n_steps, motion.mean_value_form ? "mean value form" : "boxes", motion.attempts,
             motion.attempts == 1 ? "" : "s");
}

ordered_json json_of(const std::vector<CertifiedNumber>& numbers) {
  ordered_json list = ordered_json::array();
  for (const auto& number : numbers) list.push_back({{"value", number.text}, {"radius", number.radius}});
  return list;
}

ordered_json json_of(const CertifiedMotion& motion, std::optional<double> moved, const Problem& problem) {
  ordered_json document = {{"problem", problem.info().id}, {"grade", name_of(motion.grade)}, {"reason", motion.reason}};
  if (reference::certified::is_small(problem) && problem.formulas())
    document["formulas_sha256"] = reference::hash_of_formulas(problem);
  document["assumptions"] = motion.assumptions;
  document["reading"] = motion.reading == Reading::decimal ? "decimal" : "rounded";
  document["moved_by_rounding"] = moved ? ordered_json(*moved) : ordered_json();
  document["decimals"] = motion.grade == Grade::open ? ordered_json() : ordered_json(motion.decimals());
  document["t"] = motion.end_time.text;
  document["q"] = json_of(motion.q);
  document["v"] = json_of(motion.v);
  document["modes"] = motion.modes;
  if (!motion.no_sensitivities.empty()) document["no_sensitivities"] = motion.no_sensitivities;
  for (const auto& column : motion.sensitivities) {
    document["sensitivities"].push_back(
        {{"variable", column.variable}, {"reason", column.reason}, {"q", json_of(column.q)}, {"v", json_of(column.v)}});
  }
  document["events"] = ordered_json::array();
  for (const auto& event : motion.events) {
    document["events"].push_back({{"t", event.time.text},
                                  {"radius", event.time.radius},
                                  {"kind", event.kind},
                                  {"contact", event.contact},
                                  {"modes", event.modes},
                                  {"Lambda_n", json_of(event.Lambda_n)},
                                  {"grade", name_of(event.grade)}});
  }
  document["bits"] = motion.bits;
  document["order"] = motion.order;
  document["steps"] = motion.n_steps;
  document["attempts"] = motion.attempts;
  document["seconds"] = motion.seconds;
  return document;
}

/// Writes the certificate to a new file. @throws InputError where there is none
void write_certificate(const Problem& problem, const CertifiedMotion& motion, const TruthArguments& arguments) {
  write_text("--output", arguments.output, certificate_text(certificate_of(problem, motion, arguments.options)));
}

/// Verifies a certificate and prints the result. @throws InputError for a file that is none
void print_check(const std::string& path, int& exit_code) {
  if (!std::ifstream(path)) throw InputError("--check", path, "cannot be read");
  const auto certificate = reference::certified::read_certificate(read_text(path));
  const auto report = check_certificate(certificate);
  if (report.is_valid) {
    fmt::print("valid      {}: grade {}, {} steps, {} events; {:.3g} s\n", path, name_of(certificate.grade),
               certificate.steps.size(), certificate.events.size(), report.seconds);
    return;
  }
  const std::string place = report.step < 0 ? "before the first step" : fmt::format("step {}", report.step);
  fmt::print("refused    {}: {}: {}\n", path, place, report.reason);
  exit_code = 1;
}

void print_truth(TruthArguments& arguments, int& exit_code) {
  const auto problem = arguments.problem.make_problem();
  if (!reference::certified::can_certify())
    throw InputError("this program was built without Arb: install libflint-arb-dev and build again");
  arguments.options.reading = arguments.rounded ? Reading::rounded : Reading::decimal;
  if (!arguments.output.empty()) require_new_file("--output", arguments.output);
  arguments.options.with_steps = !arguments.output.empty();
  const CertifiedMotion motion = certified_motion(*problem, arguments.options);
  const auto moved =
      arguments.rounded ? std::nullopt : reference::certified::moved_by_rounding(*problem, motion, arguments.options);
  if (arguments.as_json)
    fmt::print("{}\n", json_of(motion, moved, *problem).dump(2));
  else
    print_motion(motion, moved, problem->info());
  if (motion.grade == Grade::open)
    exit_code = 1;
  else if (!arguments.output.empty())
    write_certificate(*problem, motion, arguments);
}

}  // namespace

void add_truth_command(CLI::App& app, int& exit_code) {
  static TruthArguments arguments;
  constexpr int kMostDigits = 1000;
  auto* command = app.add_subcommand("truth", "prove digits of the motion and its events in ball arithmetic");
  arguments.problem.add_problem(*command);
  command->add_option("--digits", arguments.options.digits, "number of proven decimal places (default: 30)")
      ->check(CLI::Range(1, kMostDigits));
  command->add_flag("--rounded", arguments.rounded,
                    "round every number of the scene to double first, as methods do (default: decimals are exact)");
  command
      ->add_option("--time-limit", arguments.options.max_seconds,
                   "limit of the wall time in seconds, after which the motion is left open (default: 10)")
      ->check(positive_number());
  command->add_flag("--sensitivities", arguments.options.with_sensitivities,
                    "also enclose the derivatives of the final state by q0, v0 and every parameter");
  command->add_flag("--json", arguments.as_json, "print JSON");
  command->add_option("--output,-o", arguments.output,
                      "new FILE for a certificate, which others can check; balls are slightly wider then");
  command->add_option("--check", arguments.check,
                      "verify the certificate in FILE, without a search for steps or events; exit code 1 if refused");
  command->footer(
      "Grades: proven; assumed (relies on the listed equalities); computed (takes the listed numbers as zero; two runs\n"
      "agree); open (undecided, with the reason; exit code 1).\n"
      "Example:\n  ricochet truth --problem rocking_block --set mu=0.5 --digits 40\n"
      "  ricochet truth --problem pendulum_wall -o pendulum.cert.json\n"
      "  ricochet truth --check pendulum.cert.json");
  command->callback([&exit_code] {
    if (arguments.check.empty())
      print_truth(arguments, exit_code);
    else
      print_check(arguments.check, exit_code);
  });
}

}  // namespace ricochet
