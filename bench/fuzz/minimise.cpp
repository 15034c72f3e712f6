#include "bench/fuzz/minimise.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <regex>
#include <string>
#include <vector>

#include "problems/input_error.h"

namespace ricochet {
namespace {

using nlohmann::ordered_json;

/// Calls `change` with every text below `node`.
void for_each_text(ordered_json& node, const std::function<void(std::string&)>& change) {
  if (node.is_string()) {
    change(node.get_ref<std::string&>());
  } else if (node.is_structured()) {
    for (auto& child : node) for_each_text(child, change);
  }
}

/// The fields with expressions in the state.
void for_each_expression(ordered_json& scene, const std::function<void(std::string&)>& change) {
  for (const char* field : {"M", "f", "potential_energy"}) {
    if (scene.contains(field)) for_each_text(scene[field], change);
  }
  for (const char* list : {"contacts", "friction"}) {
    if (!scene.contains(list)) continue;
    for (auto& contact : scene[list]) {
      for (const char* field : {"gap", "Jt", "vt_drive", "bound", "coefficient"}) {
        if (contact.contains(field)) for_each_text(contact[field], change);
      }
    }
  }
}

bool mentions(const std::string& expression, const std::string& name) {
  return std::regex_search(expression, std::regex("\\b" + name + "\\b"));
}

std::size_t length_of(const ordered_json& scene, const char* list) {
  return scene.contains(list) ? scene[list].size() : 0;
}

/// @param list  "contacts" or "friction"
ordered_json without_entry(ordered_json scene, const char* list, std::size_t i) {
  scene[list].erase(i);
  return scene;
}

ordered_json without_friction(ordered_json scene, std::size_t i) {
  for (const char* field : {"mu", "mu_static", "Jt", "vt_drive"}) scene["contacts"][i].erase(field);
  return scene;
}

/// Coordinate k keeps its initial value, and those after it move up. Contacts and friction elements that touch no other
/// one go, too.
ordered_json without_coordinate(ordered_json scene, std::size_t k) {
  const std::string q0 = scene["q0"][k];
  static const std::regex component(R"(([qv])\[(\d+)\])");
  for_each_expression(scene, [&](std::string& text) {
    std::string changed;
    auto from = text.cbegin();
    for (std::sregex_iterator match(text.begin(), text.end(), component), end; match != end; ++match) {
      const std::size_t index = std::stoul((*match)[2]);
      changed.append(from, (*match)[0].first);
      if (index == k)
        changed += (*match)[1] == "q" ? "(" + q0 + ")" : "0";
      else
        changed += fmt::format("{}[{}]", (*match)[1].str(), index - (index > k ? 1 : 0));
      from = (*match)[0].second;
    }
    text = changed.append(from, text.cend());
  });
  for (const char* field : {"q0", "v0", "f", "M"}) scene[field].erase(k);
  for (auto& row : scene["M"]) row.erase(k);
  ordered_json contacts = ordered_json::array();
  for (auto& contact : scene["contacts"]) {
    if (contact.contains("Jt")) {
      for (auto& direction : contact["Jt"]) direction.erase(k);
    }
    const std::string gap = contact["gap"];
    if (std::regex_search(gap, component)) contacts.push_back(contact);
  }
  scene["contacts"] = contacts;
  for (std::size_t i = length_of(scene, "friction"); i-- > 0;) {
    bool is_empty = true;
    for (auto& direction : scene["friction"][i]["Jt"]) {
      direction.erase(k);
      for (const auto& entry : direction) is_empty = is_empty && entry == "0";
    }
    if (is_empty) scene["friction"].erase(i);
  }
  return scene;
}

ordered_json with_parameter(ordered_json scene, const std::string& name, const std::string& value) {
  scene["params"][name] = value;
  return scene;
}

ordered_json without_unused_parameters(ordered_json scene) {
  ordered_json used = ordered_json::object();
  ordered_json rest = scene;
  rest.erase("params");
  for (const char* field : {"id", "title", "source", "hard_feature"}) rest.erase(field);
  for (const auto& [name, value] : scene["params"].items()) {
    bool is_used = false;
    for_each_text(rest, [&, &name = name](std::string& text) { is_used = is_used || mentions(text, name); });
    if (is_used) used[name] = value;
  }
  scene["params"] = used;
  return scene;
}

// A test that does not depend on the end would be shortened for ever [s].
constexpr double kShortest = 1e-3;

/// Simpler values than `text`, the simplest first.
std::vector<std::string> simpler_values(const std::string& name, const std::string& text) {
  std::vector<std::string> values;
  const double x = std::strtod(text.c_str(), nullptr);
  const auto add = [&](const std::string& value) {
    if (value.size() < text.size()) values.push_back(value);
  };
  if (name == "T") {  // the end comes earlier
    for (const double share : {0.3, 0.6, 0.9}) {
      const std::string shorter = fmt::format("{:.2g}", share * x);
      if (share * x >= kShortest && shorter != text) values.push_back(shorter);
    }
  } else {
    add("0");
    add("1");
  }
  for (int decimals = 0; decimals < 4; ++decimals) add(fmt::format("{:.{}f}", x, decimals));
  return values;
}

/// The scenes one change away.
std::vector<ordered_json> simpler(const ordered_json& scene) {
  std::vector<ordered_json> candidates;
  for (std::size_t k = scene["q0"].size(); k-- > 0 && scene["q0"].size() > 1;)
    candidates.push_back(without_coordinate(scene, k));
  for (const char* list : {"contacts", "friction"}) {
    for (std::size_t i = length_of(scene, list); i-- > 0;) candidates.push_back(without_entry(scene, list, i));
  }
  for (std::size_t i = 0; i < scene["contacts"].size(); ++i) {
    if (scene["contacts"][i].contains("mu")) candidates.push_back(without_friction(scene, i));
  }
  for (const auto& [list, field] : {std::pair("contacts", "mu_static"), std::pair("friction", "static_ratio")}) {
    for (std::size_t i = 0; i < length_of(scene, list); ++i) {
      if (!scene[list][i].contains(field)) continue;
      candidates.push_back(scene);
      candidates.back()[list][i].erase(field);
    }
  }
  if (scene.contains("params")) {
    for (const auto& [name, value] : scene["params"].items()) {
      for (const auto& simple : simpler_values(name, value)) candidates.push_back(with_parameter(scene, name, simple));
    }
  }
  return candidates;
}

}  // namespace

ordered_json minimise(ordered_json scene, const SceneTest& test, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  scene.erase("potential_energy");  // no method reads it
  const auto passes = [&](const ordered_json& candidate) {
    try {
      return test(candidate);
    } catch (const InputError&) {
      return false;
    }
  };
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (std::size_t position = 0;;) {  // stays where a change was taken: the rest of the list follows from there
      const auto candidates = simpler(scene);
      if (position >= candidates.size()) break;
      if (Clock::now() >= deadline) return scene;
      if (passes(candidates[position])) {
        scene = without_unused_parameters(candidates[position]);
        has_changed = true;
      } else {
        ++position;
      }
    }
  }
  return scene;
}

}  // namespace ricochet
