// 300 scene files with one mistake each, made from good ones by a generator with a seed: every one is refused, and the
// message names the place of the mistake.
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/scene_file/scene_file.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

using nlohmann::json;

constexpr int kFiles = 300;
constexpr unsigned kSeed = 16;

/// A file with a mistake, and what its message must say.
struct BadScene {
  std::string text, place;
};

class Spoiler {
 public:
  explicit Spoiler(unsigned seed) : random_(seed) {
    for (const char* file : {"press.json", "dragged_block_3d.json", "crank_with_friction.json", "moving_table.json",
                             "double_pendulum_wall.json", "rising_table.json", "simultaneous_balls.json"})
      add(read_input_json(test_data(file), "scene file"));
    for (const char* file : {"friction_scenes.json", "reference_scenes.json"}) {
      const json set = read_input_json(test_data(file), "scene file");
      for (const json& entry : set["cases"]) add(entry);
    }
  }

  /// A mistake of one kind in a random scene.
  BadScene spoil(std::size_t kind) {
    while (true) {
      scene_ = scenes_[below(scenes_.size())];
      text_.clear();
      const std::string place = (this->*kinds()[kind])();
      if (!place.empty()) return {text_.empty() ? scene_.dump() : text_, place};
    }
  }

  using Kind = std::string (Spoiler::*)();
  static const std::vector<Kind>& kinds() {
    static const std::vector<Kind> list = {
        &Spoiler::field_missing,   &Spoiler::field_unknown,     &Spoiler::field_twice,     &Spoiler::type_wrong,
        &Spoiler::entry_missing,   &Spoiler::formula_cut,       &Spoiler::name_unknown,    &Spoiler::function_unknown,
        &Spoiler::index_too_far,   &Spoiler::number_too_large,  &Spoiler::power_too_large, &Spoiler::text_cut,
        &Spoiler::nested_deep,     &Spoiler::control_character, &Spoiler::parameter_word,  &Spoiler::parameter_space,
        &Spoiler::parameter_text,  &Spoiler::unit_of_nothing,   &Spoiler::end_time,        &Spoiler::mass_singular,
        &Spoiler::restitution,     &Spoiler::friction_negative, &Spoiler::tangent_zero,    &Spoiler::tangents_parallel,
        &Spoiler::names_equal,     &Spoiler::penetration,       &Spoiler::eps_r_and_e,     &Spoiler::normal_wrong,
        &Spoiler::division_by_zero};
    return list;
  }

 private:
  void add(const json& document) { scenes_.push_back(document.contains("problem") ? document["problem"] : document); }
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  std::string pick(const std::vector<std::string>& list) { return list[below(list.size())]; }
  std::vector<std::string> keys(const json& object) const {
    std::vector<std::string> list;
    for (const auto& [key, value] : object.items()) list.push_back(key);
    return list;
  }
  /// One of the contacts, and its place; null where the scene has none.
  json* contact(std::string& place) {
    if (!scene_.contains("contacts") || scene_["contacts"].empty()) return nullptr;
    const std::size_t k = below(scene_["contacts"].size());
    place = "contacts[" + std::to_string(k) + "]";
    return &scene_["contacts"][k];
  }
  json* unilateral(std::string& place) {
    json* found = contact(place);
    return found && !found->contains("bilateral") ? found : nullptr;
  }
  /// A formula that is read in every scene, and its place.
  json& formula(std::string& place) {
    const std::string field = pick({"q0", "v0", "f", "M", "T"});
    if (field == "T") {
      place = field;
      return scene_["T"];
    }
    const std::size_t k = below(scene_[field].size());
    place = field + "[" + std::to_string(k) + "]";
    if (field != "M") return scene_[field][k];
    const std::size_t column = below(scene_[field][k].size());
    place += "[" + std::to_string(column) + "]";
    return scene_[field][k][column];
  }
  static std::string text_of(const json& formula) {
    return formula.is_string() ? formula.get<std::string>() : formula.dump();
  }
  std::string in_formula(const std::string& more) {
    std::string place;
    json& text = formula(place);
    text = text_of(text) + more;
    return place + ", column";
  }

  std::string field_missing() {
    const std::string field = pick({"q0", "v0", "T", "M", "f"});
    scene_.erase(field);
    return field + ": this field is missing";
  }
  std::string field_unknown() {
    std::string place;
    json* holder = below(2) == 0 ? &scene_ : contact(place);
    if (!holder) return "";
    const std::string field = pick(keys(*holder)) + pick({"s", "_", "x", "0"});
    (*holder)[field] = "0";
    return "'" + field + "': unknown";
  }
  std::string field_twice() {
    std::string place;
    json* holder = below(2) == 0 ? &scene_ : contact(place);
    if (!holder) return "";
    const std::string field = pick(keys(*holder));
    (*holder)["~"] = (*holder)[field];  // the last one of its object
    text_ = scene_.dump();
    text_.replace(text_.find("\"~\""), 3, json(field).dump());
    return (place.empty() ? "" : place + ".") + field + ": this field is given twice";
  }
  std::string type_wrong() {
    const std::vector<json> wrong = {true, nullptr, json::object({{"a", 1}}), json::array({json::array({1})})};
    std::string place;
    if (below(2) == 0) {
      formula(place) = wrong[below(3)];
    } else {
      place = pick({"q0", "v0", "f", "M", "T"});
      scene_[place] = wrong[below(3)];
    }
    return place + " = ";
  }
  std::string entry_missing() {
    const std::string field = pick({"v0", "f", "M"});
    scene_[field].erase(below(scene_[field].size()));
    return field + ", number of entries";
  }
  std::string formula_cut() { return in_formula(pick({"+", "*", " (", "-2*", "/", "**", " 3", ")", "]"})); }
  std::string name_unknown() { return in_formula(pick({"+nowhere", "*Q", "-p_7", "+q[0]*x"})); }
  std::string function_unknown() {
    return in_formula(pick({"+sinus(1)", "*atan3(1, 2)", "+sin(1, 2)", "-if(1, 2, 3)"}));
  }
  std::string index_too_far() {
    const std::size_t k = below(scene_["f"].size());
    scene_["f"][k] = text_of(scene_["f"][k]) + pick({"+q[99]", "+v[17]", "+q[-1]", "+q[x]"});
    return "f[" + std::to_string(k) + "], column";
  }
  std::string number_too_large() { return in_formula(pick({"+1e999999999", "*1e-5000", "+1e401"})); }
  std::string power_too_large() { return in_formula(pick({"+9**9**9**9", "*2**-100000000", "+(1/3)**1000000"})); }
  std::string division_by_zero() { return in_formula(pick({"+1/0", "+log(0)", "+0**-2", "+1/(2-2)"})); }
  std::string text_cut() {
    text_ = scene_.dump();
    text_.resize(1 + below(text_.size() - 1));
    return "not valid JSON";
  }
  std::string nested_deep() {
    const std::string field = pick({"q0", "T", "params", "contacts"});
    json deep = 1;
    const std::size_t depth = 70 + below(100);
    for (std::size_t k = 0; k < depth; ++k) deep = json::array({deep});
    scene_[field] = deep;
    return field + "[0][0][0]";
  }
  std::string control_character() {
    std::string place;
    json* holder = contact(place);
    if (!holder) return "";
    (*holder)["name"] = "a" + pick({"\n", "\x1b[2J", "\t", "\x7f", "\xc2\x9b"}) + "b";
    return place + ".name";
  }
  std::string parameter_word() {
    const std::string name = pick({"sin", "pi", "if", "t", "max", "atan2", "sqrt"});
    scene_["params"][name] = "1";
    return "params." + name;
  }
  std::string parameter_space() {
    const std::string name = pick({"a b", "", "1a", "m-1", "q[0]", "\xc3\xa4"});
    scene_["params"][name] = "1";
    return "params." + name;
  }
  std::string parameter_text() {
    scene_["params"]["zz"] = pick({"1kg", "", "2*", "0x10", "1/0", "1e999", "one", "zz", "log(-1)", "1e390"});
    return "params.zz = ";
  }
  std::string unit_of_nothing() {
    scene_["units"]["zz"] = "kg";
    return "'zz': unknown";
  }
  std::string end_time() {
    scene_["T"] = pick({"0", "-1", "1-2", "0*1"});
    return "T = ";
  }
  std::string mass_singular() {
    const std::size_t n = scene_["M"].size(), k = below(n);
    for (std::size_t j = 0; j < n; ++j) scene_["M"][k][j] = scene_["M"][j][k] = "0";
    return "M(q0) = ";
  }
  std::string restitution() {
    std::string place;
    json* holder = unilateral(place);
    if (!holder) return "";
    (*holder)["e"] = pick({"1.1", "-0.1", "2"});
    return place + ".e ";
  }
  std::string friction_negative() {
    std::string place;
    json* holder = unilateral(place);
    if (!holder) return "";
    (*holder)["mu"] = "-0.1";
    return place + ".mu ";
  }
  std::string tangent_zero() {
    std::string place;
    json* holder = contact(place);
    if (!holder || !holder->contains("Jt") || (*holder)["Jt"].empty()) return "";
    const std::size_t d = below((*holder)["Jt"].size());
    for (json& entry : (*holder)["Jt"][d]) entry = pick({"0", "1-1", "0*q[0]"});
    return place + ".Jt[" + std::to_string(d) + "]";
  }
  std::string tangents_parallel() {
    std::string place;
    json* holder = contact(place);
    if (!holder || !holder->contains("Jt") || (*holder)["Jt"].empty()) return "";
    json& directions = (*holder)["Jt"];
    json parallel = directions[0];
    for (json& entry : parallel) entry = pick({"-2", "-2.0"}) + "*(" + text_of(entry) + ")";
    directions = json::array({directions[0], parallel});
    holder->erase("vt_drive");
    return place + ".Jt[1]";
  }
  std::string names_equal() {
    std::string place;
    json* holder = contact(place);
    if (!holder) return "";
    const std::size_t n = scene_["contacts"].size();
    (*holder)["name"] = "one of two";
    const json twice = *holder;
    scene_["contacts"].push_back(twice);
    return "contacts[" + std::to_string(n) + "].name = one of two";
  }
  std::string penetration() {
    std::string place;
    json* holder = unilateral(place);
    if (!holder) return "";
    (*holder)["gap"] = "q[0]-(" + text_of(scene_["q0"][0]) + ")-0.5";
    holder->erase("Jn");
    return place + ".gap ";
  }
  std::string eps_r_and_e() {
    std::string place;
    json* holder = contact(place);
    if (!holder) return "";
    (*holder)["e"] = (*holder)["eps_r"] = "0";
    return place + ".eps_r";
  }
  std::string normal_wrong() {
    std::string place;
    json* holder = contact(place);
    if (!holder) return "";
    (*holder)["Jn"] = json::array();
    for (std::size_t k = 0; k < scene_["q0"].size(); ++k) (*holder)["Jn"].push_back("17+q[0]*q[0]");
    return place + ".Jn[";
  }

  std::mt19937 random_;
  std::vector<json> scenes_;
  json scene_;
  std::string text_;  ///< instead of the dumped scene, for mistakes that no json value can have
};

TEST(BadSceneFiles, EachIsRefusedWithItsPlace) {
  Spoiler spoiler(kSeed);
  std::set<std::string> texts;
  for (int k = 0; k < kFiles; ++k) {
    const BadScene bad = spoiler.spoil(static_cast<std::size_t>(k) % Spoiler::kinds().size());
    texts.insert(bad.text);
    try {
      read_scene_text(bad.text, "bad.json");
      ADD_FAILURE() << "not refused: " << bad.place << "\n" << bad.text;
    } catch (const InputError& error) {
      const std::string message = error.what();
      EXPECT_TRUE(message.find("bad.json") != std::string::npos && message.find(bad.place) != std::string::npos)
          << "expected " << bad.place << "\nin       " << message << "\n"
          << bad.text;
    }
  }
  EXPECT_GT(texts.size(), kFiles * 0.9) << "the generator repeats itself";
}

}  // namespace
}  // namespace ricochet
