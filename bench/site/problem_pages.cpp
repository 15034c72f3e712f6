#include "bench/site/problem_pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "bench/site/drawn_scene.h"
#include "bench/site/expression_tex.h"
#include "bench/site/proven_motion.h"
#include "bench/site/site_texts.h"
#include "bench/studies/grid/fastest_rows.h"
#include "methods/registry.h"
#include "problems/derivatives/symbolic_problem.h"
#include "problems/registry.h"
#include "reference/truths.h"
#include "reports/drawing/scene_drawing.h"
#include "reports/markup.h"

namespace ricochet {
namespace {

const char* const kProblemFolder = "problems";
// Whose events are shown: error-controlled, it holds contacts on curves, and solves all modes of the scenes.
const char* const kShownMethod = "fesd_adaptive:radau-iia:4";
constexpr double kShownTolerance = 1e-9, kShownTimeLimit = 2;
constexpr std::size_t kShownEvents = 60;

std::string tex_line(const std::string& tex) {
  return fmt::format("<div class=\"tex\" tabindex=\"0\">{}</div>\n", escape_html(tex));
}

std::string column_tex(const SymbolicModel::Expressions& entries) {
  std::string tex = "\\begin{pmatrix} ";
  for (std::size_t k = 0; k < entries.size(); ++k) tex += (k ? " \\\\ " : "") + expression_tex(entries[k]);
  return tex + " \\end{pmatrix}";
}

std::string matrix_tex(const std::vector<SymbolicModel::Expressions>& rows) {
  std::string tex = "\\begin{pmatrix} ";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    tex += r ? " \\\\ " : "";
    for (std::size_t c = 0; c < rows[r].size(); ++c) tex += (c ? " & " : "") + expression_tex(rows[r][c]);
  }
  return tex + " \\end{pmatrix}";
}

std::string contact_tex(const SymbolicModel::Contact& contact) {
  std::string tex = fmt::format("f_c^{{\\text{{{}}}}} = {}", contact.name, expression_tex(contact.gap));
  if (contact.is_bilateral) return tex + " = 0";
  tex += fmt::format(" \\ge 0, \\quad \\varepsilon_r = {}", expression_tex(contact.eps_r));
  if (!contact.tangents.empty()) {
    tex += fmt::format(", \\quad \\mu = {}", expression_tex(contact.mu));
    if (!contact.mu_static.is_zero())
      tex += fmt::format(", \\quad \\mu_{{\\text{{static}}}} = {}", expression_tex(contact.mu_static));
    for (const auto& tangent : contact.tangents) tex += ", \\quad J_t = " + column_tex(tangent);
  }
  return tex;
}

std::string friction_tex(const SymbolicModel& model, const SymbolicModel::FrictionElement& element) {
  std::string tex = fmt::format("|\\lambda_t^{{\\text{{{}}}}}| \\le {}", element.name, expression_tex(element.bound));
  if (element.contact >= 0)
    tex +=
        fmt::format("\\, \\lambda_n^{{\\text{{{}}}}}", model.contacts[static_cast<std::size_t>(element.contact)].name);
  if (!element.static_ratio.is_zero())
    tex += fmt::format(" \\cdot ({} \\text{{ in stick}})", expression_tex(element.static_ratio));
  for (const auto& tangent : element.tangents) tex += ", \\quad J_t = " + column_tex(tangent);
  return tex;
}

/// Equations (2) and (3) of Problem with what is this scene's. Matrices of more than a few coordinates are no reading.
std::string equations_html(const SymbolicModel& model) {
  constexpr std::size_t kMostRows = 12, kMostContacts = 16;
  std::string html = site_heading("Equations", "equations");
  html +=
      tex_line("\\dot q = v, \\qquad M(q)\\,\\dot v = f_v(q, v)" + std::string(model.u.empty() ? "" : " + B_u u") +
               " + \\sum_i \\left( J_n^i \\lambda_n^i + J_t^i \\lambda_t^i \\right), \\qquad J_n^i = \\nabla f_c^i");
  if (model.q.size() > kMostRows)
    return html + fmt::format("<p>{} coordinates: <code>ricochet export -p {}</code> prints the formulas.</p>\n",
                              model.q.size(), escape_html(model.id));
  html += tex_line("M = " + matrix_tex(model.mass) + ", \\qquad f_v = " + column_tex(model.force));
  if (!model.u.empty())
    html += tex_line("B_u = " + matrix_tex(model.input) + ", \\qquad u = " + column_tex(model.control));
  for (std::size_t i = 0; i < std::min(kMostContacts, model.contacts.size()); ++i)
    html += tex_line(contact_tex(model.contacts[i]));
  if (model.contacts.size() > kMostContacts)
    html += fmt::format("<p>and {} contacts more.</p>\n", model.contacts.size() - kMostContacts);
  for (std::size_t i = 0; i < std::min(kMostContacts, model.frictions.size()); ++i)
    html += tex_line(friction_tex(model, model.frictions[i]));
  const std::string end = expression_tex(model.end_time);
  html += tex_line("q(0) = " + column_tex(model.q0) + ", \\qquad v(0) = " + column_tex(model.v0) +
                   (end == "T" ? "" : ", \\qquad T = " + end));  // a parameter of that name has its value below
  return html;
}

/// Description of the scene in its source file. If the page shows formulas, whose indices are those of scene files, only
/// the text is included: sketch and equations of the source file use other names.
std::string statement_html(const SceneEntry& scene, bool has_formulas) {
  const auto statement = statement_of(scene);
  if (!statement || statement->text.empty()) return "";
  std::string html;
  if (has_formulas) {
    for (const auto& paragraph : paragraphs_of(*statement)) html += fmt::format("<p>{}</p>\n", escape_html(paragraph));
  } else {
    html = fmt::format("<pre class=\"statement\" tabindex=\"0\">{}</pre>\n", escape_html(statement->text));
  }
  return html + fmt::format("<p class=\"links\">From {}</p>\n", escape_html(statement->file));
}

/// Equations of a scene with any number of bodies (assembled_problem.h).
std::string assembled_equations_html() {
  return site_heading("Equations", "equations") +
         tex_line(
             "M\\,\\dot v = f + \\sum_i \\left( J_n^i \\lambda_n^i + J_t^i \\lambda_t^i \\right), \\qquad M = "
             "\\operatorname{diag}(m), \\qquad J_n^i = \\nabla f_c^i") +
         "<p>Constant masses and forces, and contacts that are copies of a few, as the file of the scene states them. "
         "How many there are is a parameter, so formulas of all coordinates are not printed.</p>\n";
}

/// Events as marks over time, a line per contact.
std::string timeline_svg(const ProblemInfo& info, const Solution& solution) {
  constexpr double kLeft = 130, kWidth = 760, kLine = 22;
  const auto x = [&](double t) { return kLeft + (kWidth - kLeft - 14) * t / info.end_time; };
  std::set<int> used;
  for (const Event& event : solution.events) used.insert(event.contact);
  std::string body;
  double y = 16;
  for (const int contact : used) {
    const auto& name = info.contacts[static_cast<std::size_t>(contact)].name;
    body += fmt::format(
        "<text class=\"label\" x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text><path class=\"axis-line\" "
        "d=\"M{},{}H{}\"/>",
        kLeft - 10, y + 4, escape_xml(name), kLeft, y, kWidth - 14);
    for (const Event& event : solution.events) {
      if (event.contact != contact) continue;
      const bool is_impact = event.kind == EventKind::impact;
      const std::string mark = is_impact ? fmt::format("M{0:.1f},{1}V{2}", x(event.t), y - 8, y + 8)
                                         : fmt::format("M{:.1f},{}l4,5l-4,5l-4,-5z", x(event.t), y - 5);
      body += fmt::format("<path class=\"{}\" d=\"{}\"><title>{} of {}, t = {:.6g} s</title></path>",
                          is_impact ? "curve c1" : "mark c0", mark, to_string(event.kind), escape_xml(name), event.t);
    }
    y += kLine;
  }
  for (int k = 0; k <= 4; ++k)
    body += fmt::format("<text class=\"label\" x=\"{:.1f}\" y=\"{}\" text-anchor=\"{}\">{:.3g}{}</text>",
                        x(k * info.end_time / 4), y + 6, k == 4 ? "end" : "middle", k * info.end_time / 4,
                        k == 4 ? " s" : "");
  return fmt::format(
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Events over time\"><svg "
      "class=\"timeline\" viewBox=\"0 0 {} {}\" role=\"img\" "
      "aria-label=\"{} events over time\">{}</svg></div>\n",
      kWidth, y + 14, solution.events.size(), body);
}

/// An SVG as an image of its own, whose colours and names are not those of the page.
std::string image_html(const std::string& svg, const std::string& description) {
  std::string uri;
  for (const char c : svg)
    uri += std::string("%#\"<>\n").find(c) == std::string::npos ? std::string(1, c)
                                                                : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  return fmt::format("<img class=\"scene\" alt=\"{}\" src=\"data:image/svg+xml,{}\">", escape_html(description), uri);
}

/// The scene as it starts; its motion, which moves by itself, for those who open it.
std::string sketch_html(const Problem& scene, const Solution& solution) {
  const auto picture = scene.info().geometry ? nullptr : with_picture(scene);
  const Problem& problem = picture ? *picture : scene;
  if (!problem.info().geometry) return "";
  std::string html = fmt::format("<figure>{}<figcaption>The scene as it starts.</figcaption></figure>\n",
                                 image_html(scene_svg(problem), problem.info().title + ", as it starts"));
  if (solution.motion.empty()) return html;
  return html + fmt::format(
                    "<details><summary>The scene in motion</summary><figure>{}<figcaption>The ways of its bodies, "
                    "and they on them, by {}.</figcaption></figure></details>\n",
                    image_html(scene_svg(problem, solution), problem.info().title + ", in motion"), kShownMethod);
}

/// Its motion up to where it came; empty where the method declines it.
std::optional<Solution> shown_motion(const Problem& problem) {
  const auto method = make_method(kShownMethod);
  if (!method->can_run(problem.info()).ok) return std::nullopt;
  Settings settings;
  settings.tolerance = kShownTolerance;
  settings.time_limit = kShownTimeLimit;
  settings.recording = Recording::motion;
  return method->solve(problem, settings);
}

/// @param with_list  list the events of the run, too
std::string events_html(const ProblemInfo& info, const std::optional<Solution>& motion, bool with_list) {
  std::string html = site_heading("Events", "events");
  if (!motion)
    return html + fmt::format("<p>{} declines it: {}.</p>\n", kShownMethod,
                              escape_html(make_method(kShownMethod)->can_run(info).reason));
  const Solution& solution = *motion;
  const std::string command =
      fmt::format("ricochet run -p {} -m {} --tolerance {:.0e}", info.id, kShownMethod, kShownTolerance);
  if (!solution.succeeded())
    html += fmt::format("<p class=\"warning\">The run ends at t = {:.4g} s: {}</p>\n", solution.t,
                        escape_html(solution.message));
  if (solution.events.empty()) return html + "<p>None.</p>\n";
  using E = Event;
  const std::vector<Column<E>> columns = {
      {"t", "s", "{:.9g}", &E::t},
      {"what", [](const E& e) { return std::string(to_string(e.kind)); }},
      {"contact", [&](const E& e) { return info.contacts[static_cast<std::size_t>(e.contact)].name; }},
      {"normal impulse", "N s", "{:.4g}",
       [](const E& e) { return when(e.kind == EventKind::impact, e.Lambda_n[e.contact]); }},
  };
  std::vector<E> shown(solution.events.begin(), solution.events.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                              kShownEvents, solution.events.size())));
  const Table table = table_of(fmt::format("{} of {} events", shown.size(), solution.events.size()), columns, shown);
  html += fmt::format(
      "<figure>{}<figcaption>Bars: impacts; diamonds: contacts that open, stick or slip.</figcaption>"
      "<p class=\"links\"><code class=\"command\">{}</code></p></figure>\n",
      timeline_svg(info, solution), escape_html(command));
  return with_list ? html + site_table(table, "event-list", {}, shown.size() > 12) : html;
}

std::string contacts_html(const ProblemInfo& info) {
  using P = ParameterInfo;
  static const std::vector<Column<P>> columns = {
      {"parameter", &P::name}, {"value", "", "{:g}", &P::value}, {"unit", [](const P& p) { return p.unit; }}};
  return info.parameters.empty() ? "" : table_of("Parameters", columns, info.parameters).html();
}

/// The first example of each method: whether it can run the scene.
std::string methods_html(const ProblemInfo& info) {
  struct Line {
    std::string method, answer;
  };
  static const std::vector<Column<Line>> columns = {{"method", &Line::method}, {"can it?", &Line::answer}};
  std::vector<Line> lines;
  for (const auto& entry : methods()) {
    if (!entry.make || entry.examples.empty()) continue;
    const Support support = make_method(entry.examples.front())->supports(info);
    lines.push_back({entry.examples.front(), support.ok ? "yes" : "no: " + support.reason});
  }
  return table_of("Which methods can run it", columns, lines).html();
}

/// Results that pages of problems show, read once.
struct ProblemResults {
  /// The runs of each results file that has some, by problem; scenes of `fastest` have names of their own.
  std::vector<std::map<std::string, std::vector<FastestRun>>> competitions;
  std::vector<std::set<std::string>> problems;  ///< of each results file
  std::map<std::string, std::string> proofs;    ///< of scenes that are proven: HTML, by the experiment `proofs`
};

/// The id of the problem of a run: of a scene file that of its case, or its name.
std::string problem_of(const Run& run) {
  if (const auto hash = run.problem.rfind('#'); hash != std::string::npos) return run.problem.substr(hash + 1);
  return run.problem.ends_with(".json") ? std::filesystem::path(run.problem).stem().string() : run.problem;
}

ProblemResults problem_results(const std::vector<ShownResults>& list) {
  ProblemResults results;
  for (const auto& shown : list) {
    auto& problems = results.problems.emplace_back();
    for (const auto& row : shown.results.rows) {
      if (row.value("kind", "") == "proof" && row.value("decimals", 0) > 0)
        results.proofs[row.at("scene")] =
            fmt::format("<a href=\"../experiments/{}.html\">{} to {} decimals</a>", site_id(shown.results.experiment()),
                        row.at("grade").get<std::string>(), row.at("decimals").get<int>());
      for (const char* field : {"problem", "scene"}) {
        if (const auto name = row.find(field); name != row.end() && name->is_string()) problems.insert(*name);
      }
    }
    for (const Run& run : shown.results.all<Run>()) problems.insert(problem_of(run));
    auto& competition = results.competitions.emplace_back();
    for (const FastestRun& run : shown.results.all<FastestRun>()) {
      if (run.labels.contains("family") && run.solver() == "new") competition[problem_of(run)].push_back(run);
    }
  }
  return results;
}

std::string speed_html(const ProblemResults& results, const std::string& id) {
  std::vector<FastestRun> runs;
  for (const auto& competition : results.competitions) {
    const auto found = competition.find(id);
    if (found == competition.end()) continue;
    runs = found->second;
    break;  // times of one session
  }
  const std::string heading = site_heading("Who solves it fastest", "fastest");
  if (runs.empty())
    return heading +
           "<p>No results of this site say: experiments <code>opponents</code> and <code>classes</code> do of "
           "their scenes.</p>\n";
  return heading + choice_table(runs).html();
}

/// Experiments with a row of this problem.
std::string experiments_html(const std::vector<ShownResults>& list, const ProblemResults& results,
                             const std::string& id) {
  std::string html;
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (!results.problems[k].contains(id)) continue;
    html += fmt::format("<li><a href=\"../experiments/{}.html\">{}</a></li>\n", site_id(list[k].results.experiment()),
                        escape_html(list[k].results.title()));
  }
  return html.empty() ? "" : site_heading("Experiments with it", "experiments") + "<ul>\n" + html + "</ul>\n";
}

SitePage page_of(const SceneEntry& scene, const std::vector<ShownResults>& list, const ProblemResults& results) {
  const auto problem = make_problem(scene.id);
  const ProblemInfo& info = problem->info();
  SitePage page{.folder = kProblemFolder,
                .id = site_id(scene.id),
                .title = scene.title,
                .label = scene.id,
                .html = "",
                .has_equations = true};
  const SymbolicModel* formulas = problem->formulas();
  page.html = fmt::format(
      "<dl><dt>what is hard</dt><dd>{}</dd><dt>source</dt><dd>{}</dd><dt>size</dt><dd>{} coordinates, {} contacts, until "
      "{:g} s</dd>",
      escape_html(scene.hard_feature), escape_html(scene.source), info.n_mechanical(), info.n_c(), info.end_time);
  if (!scene.solution.empty())
    page.html += fmt::format("<dt>solution</dt><dd>{}: <code>{}</code></dd>", escape_html(scene.solution),
                             reference::kCertifiedFile);
  if (formulas != nullptr)
    page.html += fmt::format("<dt>as a file</dt><dd><code>ricochet export -p {0} -o {0}.json</code></dd>", scene.id);
  const ProvenMotion proven = proven_motion(*problem);
  const auto published = results.proofs.find(scene.id);  // by a proof that may take longer
  const bool is_published = proven.section.empty() && published != results.proofs.end();
  if (const auto& summary = is_published ? published->second : proven.summary; !summary.empty())
    page.html += fmt::format("<dt>motion</dt><dd>{}</dd>", summary);
  page.html += "</dl>\n";
  const auto motion = shown_motion(*problem);
  page.html += sketch_html(*problem, motion ? *motion : Solution());
  const bool is_assembled = problem->symbolic() == nullptr;
  page.html += statement_html(scene, !is_assembled);
  page.html += is_assembled ? assembled_equations_html() : equations_html(*formulas);
  page.html += contacts_html(info) + proven.section + events_html(info, motion, proven.section.empty()) +
               speed_html(results, scene.id);
  page.html += site_heading("Methods", "methods") + methods_html(info) + experiments_html(list, results, scene.id);
  return page;
}

}  // namespace

SiteGroup problem_pages(const std::vector<ShownResults>& list) {
  SiteGroup group{"Problems", {}};
  const ProblemResults results = problem_results(list);
  for (const auto& scene : scenes()) group.pages.push_back(page_of(scene, list, results));
  return group;
}

}  // namespace ricochet
