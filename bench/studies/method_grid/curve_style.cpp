#include "bench/studies/method_grid/curve_style.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
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

/// Behind the first comma: "elements=as_needed".
std::string options_of(const std::string& method) {
  const auto comma = method.find(',');
  return comma == std::string::npos ? "" : method.substr(comma + 1);
}

// Steps of one hue per family, dark for many stages, so that a family reads as one; colours after ColorBrewer
// (Blues, Oranges), which keep their order in print and for colour-blind readers.
const std::map<std::string, std::vector<std::string>>& ramps() {
  static const std::map<std::string, std::vector<std::string>> colors = {
      {"fesd:radau-iia", {"#9ecae1", "#6baed6", "#2171b5", "#08306b"}},
      {"fesd:gauss", {"#fdae6b", "#fd8d3c", "#d94801", "#7f2704"}},
      {"fesd_adaptive:radau-iia", {"#dadaeb", "#bcbddc", "#9e9ac8", "#807dba", "#6a51a3", "#3f007d"}},
      {"fesd_adaptive:gauss", {"#c7e9c0", "#a1d99b", "#74c476", "#41ab5d", "#238b45", "#00441b"}},
  };
  return colors;
}

/// Options behind the tableau, when another method of the results differs in nothing else.
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

CurveStyle curve_style(const GridResults& results, const std::string& method) {
  static const std::vector<std::string> others = {"#525252", "#969696", "#ae017e", "#8c6d31", "#c994c7",
                                                  "#02818a", "#000000", "#e6ab02", "#66c2a4"};
  static const std::vector<int> points = {7, 5, 9, 13};
  const auto [family, member] = take_apart(method);
  const int dash = distinguishing_options(results, method).empty() ? 1 : 3;
  if (const auto ramp = ramps().find(family); ramp != ramps().end() && !member.empty()) {
    const auto k =
        std::clamp<std::size_t>(static_cast<std::size_t>(std::atoi(member.c_str())), 1, ramp->second.size()) - 1;
    return {ramp->second[k], points[k % points.size()], dash};
  }
  std::size_t index = 0;  // among the methods without a hue of their family
  for (const auto& other : results.methods()) {
    if (other == method) break;
    index += !ramps().contains(take_apart(other).family);
  }
  // Nine colours and four points differ up to 36 methods.
  return {others[index % others.size()], points[index % points.size()], dash};
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

std::string curve_label(const GridResults& results, const Record& record) {
  const auto [family, member] = take_apart(record.method);
  if (member.empty() || !ramps().contains(family)) return record.title;
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
