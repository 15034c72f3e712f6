#include "bench/site/proven_motion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "reference/certified/certified_motion.h"
#include "reports/markup.h"
#include "reports/site/site_page.h"

namespace ricochet {
namespace {

using reference::certified::CertifiedEvent;
using reference::certified::CertifiedMotion;
using reference::certified::CertifiedNumber;

constexpr int kProvenDigits = 30;      // as `ricochet truth` by default
constexpr double kProofLimit = 2;      // [s], as for references
constexpr std::size_t kMostRows = 12;  // of a table that is shown at once

/// Proven digits up to kProvenDigits places, "..." for those that follow. All digits where those that follow are zeros
/// or nines alone, and might carry over.
std::string cut_digits(const CertifiedNumber& number) {
  const std::string& text = number.text;
  if (text.starts_with("0e")) return fmt::format("0 ± {:.1e}", number.radius);
  const auto point = text.find('.');
  if (point == std::string::npos || text.find('e') != std::string::npos) return text;
  const std::size_t end = point + 1 + kProvenDigits;
  if (text.size() <= end) return text;
  const std::string rest = text.substr(end, text.size() - end - 1);  // the last digit may be off by one
  for (const char* digit : {"0", "9"}) {
    if (rest.find_first_not_of(digit) == std::string::npos) return text;
  }
  return text.substr(0, end) + "…";
}

/// Grade and digits, in a line.
std::string grade_html(const CertifiedMotion& motion) {
  if (motion.q.empty()) return "not proven: " + escape_html(motion.reason);
  std::string html = fmt::format("<a href=\"#truth\">{} to {} decimals</a>", name_of(motion.grade),
                                 std::min(kProvenDigits, motion.decimals()));
  for (const auto& assumption : motion.assumptions) html += "; assumed: " + escape_html(assumption);
  return html;
}

/// The final state and the events of a motion that is proven, or proven but for assumptions.
std::string truth_html(const CertifiedMotion& motion, const ProblemInfo& info) {
  std::string html = site_heading("Proven motion", "truth") +
                     fmt::format(
                         "<p>Decimals of the scene as it is written, by Taylor series in ball arithmetic: "
                         "<code class=\"command\">ricochet truth -p {} --digits {}</code></p>\n",
                         info.id, kProvenDigits);
  struct Component {
    std::string name;
    const CertifiedNumber* value;
  };
  std::vector<Component> components;
  for (const auto& [name, numbers] : {std::pair("q", &motion.q), std::pair("v", &motion.v)}) {
    for (std::size_t k = 0; k < numbers->size(); ++k)
      components.push_back({fmt::format("{}[{}]", name, k), &(*numbers)[k]});
  }
  const std::vector<Column<Component>> state = {{"component", &Component::name},
                                                {"value", [](const Component& c) { return cut_digits(*c.value); }}};
  html += site_table(table_of(fmt::format("State at t = {:g} s", info.end_time), state, components), "final-state", {},
                     components.size() > kMostRows);
  using E = CertifiedEvent;
  const std::vector<Column<E>> columns = {
      {"t [s]", [](const E& e) { return cut_digits(e.time); }},
      {"what", &E::kind},
      {"contact", &E::contact},
      {"normal impulse [N s]",
       [&](const E& e) {
         const auto contact = std::ranges::find(info.contacts, e.contact, &ContactInfo::name);
         const auto i = static_cast<std::size_t>(contact - info.contacts.begin());
         return i < e.Lambda_n.size() ? cut_digits(e.Lambda_n[i]) : std::string("-");
       }},
      {"modes after it", [](const E& e) { return fmt::format("{}", fmt::join(e.modes, ", ")); }},
  };
  if (motion.events.empty()) return html + "<p>It has no events.</p>\n";
  return html + site_table(table_of("Events with proven times", columns, motion.events), "proven-events", {},
                           motion.events.size() > kMostRows);
}

}  // namespace

ProvenMotion proven_motion(const Problem& problem) {
  if (!reference::certified::can_certify()) return {};
  const CertifiedMotion motion = reference::certified::certified_motion(
      problem, {.digits = kProvenDigits, .max_seconds = kProofLimit, .may_compute = false});
  return {grade_html(motion), motion.q.empty() ? "" : truth_html(motion, problem.info())};
}

}  // namespace ricochet
