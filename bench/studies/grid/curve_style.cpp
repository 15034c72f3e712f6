#include "bench/studies/grid/curve_style.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "methods/method_spec.h"

namespace ricochet {
namespace {

/// "fesd:radau-iia:3,..." -> family "fesd:radau-iia", member "3"; "moreau_jean,theta=1" -> "moreau_jean,theta=1", "".
struct MethodName {
  std::string family, member;
};

MethodName take_apart(const std::string& method) {
  const MethodSpec spec(method);
  const auto& arguments = spec.arguments();
  if (arguments.size() < 2) return {method, ""};
  return {fmt::format("{}:{}", spec.name(), fmt::join(arguments.begin(), arguments.end() - 1, ":")), arguments.back()};
}

/// After the first comma: "elements=as_needed".
std::string options_of(const std::string& method) {
  const auto comma = method.find(',');
  return comma == std::string::npos ? "" : method.substr(comma + 1);
}

/// Options after the tableau, when another method of the results differs in nothing else.
std::string distinguishing_options(const GridResults& results, const std::string& method) {
  const auto own = take_apart(method);
  const auto all = results.methods();
  const auto twins = std::count_if(all.begin(), all.end(), [&](const std::string& other) {
    const auto name = take_apart(other);
    return !own.member.empty() && name.family == own.family && name.member == own.member;
  });
  return twins > 1 ? options_of(method) : "";
}

}  // namespace

std::vector<CurveLook> curve_looks(const GridResults& results) {
  std::map<std::string, int> members, taken;  // by family: how many it has, how many have a look
  std::vector<std::string> families;          // of several members
  const auto methods = results.methods();
  for (const auto& method : methods) {
    const auto [family, member] = take_apart(method);
    if (!member.empty() && ++members[family] == 2) families.push_back(family);
  }
  std::vector<CurveLook> looks;
  std::size_t others = 0;
  for (const auto& method : methods) {
    const std::string family = take_apart(method).family;
    const auto at = std::ranges::find(families, family);
    const bool is_variant = !distinguishing_options(results, method).empty();
    if (at != families.end()) {
      const int colour = CurveLook::of(static_cast<std::size_t>(at - families.begin())).colour, k = taken[family]++;
      looks.push_back({colour, k % CurveLook::kSymbols, is_variant ? 2 : k / CurveLook::kSymbols});
    } else {
      CurveLook look = CurveLook::of(families.size() + others++);
      look.dash = 1 + look.dash % (CurveLook::kDashes - 1);
      looks.push_back(look);
    }
  }
  return looks;
}

CurveLook curve_look(const GridResults& results, const std::string& method) {
  const auto methods = results.methods();
  const auto at = std::ranges::find(methods, method);
  return at == methods.end() ? CurveLook{} : curve_looks(results)[static_cast<std::size_t>(at - methods.begin())];
}

std::string family_title(const std::string& family) {
  static const std::map<std::string, std::string> names = {{"fesd:radau-iia", "FESD-J Radau IIA"},
                                                           {"fesd:gauss", "FESD-J Gauss"},
                                                           {"fesd_adaptive:radau-iia", "FESD-J adaptive Radau IIA"},
                                                           {"fesd_adaptive:gauss", "FESD-J adaptive Gauss"},
                                                           {"time_freezing:radau-iia", "Time freezing, Radau IIA"},
                                                           {"time_freezing:gauss", "Time freezing, Gauss"},
                                                           {"event-driven", "Event-driven"},
                                                           {"time stepping", "Time stepping"}};
  const auto known = names.find(family);
  return known != names.end() ? known->second : family;
}

std::string curve_label(const GridResults& results, const Run& record) {
  const auto [family, member] = take_apart(record.method);
  if (member.empty() || family_title(family) == family) return record.title;
  const std::string options = distinguishing_options(results, record.method);
  return family_title(family) + " " + member + (options.empty() ? "" : ", " + options);
}

std::string curve_family(const std::string& method) {
  static const std::set<std::string> event_driven = {"event_driven", "cvode", "arkode", "ida", "siconos_event_driven"};
  const auto [family, member] = take_apart(method);
  if (event_driven.contains(MethodSpec(method).name())) return "event-driven";
  return member.empty() ? "time stepping" : family;
}

}  // namespace ricochet
