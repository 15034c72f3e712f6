#include "bench/fuzz/scene_draw.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <regex>

#include "bench/measure/environment.h"

namespace ricochet {
namespace {

constexpr int kDecimals = 10000;  // numbers have four

std::string decimal(long ten_thousandths) {
  const long size = std::labs(ten_thousandths);
  return fmt::format("{}{}.{:04}", ten_thousandths < 0 ? "-" : "", size / kDecimals, size % kDecimals);
}

}  // namespace

std::string plus(const std::string& sum, const std::string& term) {
  return sum.empty() ? term : term.front() == '-' ? sum + term : sum + "+" + term;
}

SceneDraw::SceneDraw(const std::string& key) : engine_(std::stoull(hash_of(key), nullptr, 16)) {}

int SceneDraw::integer(int low, int high) {
  const auto n = static_cast<std::uint64_t>(high - low + 1);
  return low + static_cast<int>(engine_() % n);  // the bias of the remainder, n / 2^64, is no matter here
}

std::string SceneDraw::number(const std::string& name, double low, double high) {
  return constant(name, decimal(integer(static_cast<int>(std::lround(low * kDecimals)),
                                        static_cast<int>(std::lround(high * kDecimals)))));
}

std::string SceneDraw::constant(const std::string& name, const std::string& value) {
  parameters_[name] = value;
  return name;
}

std::string SceneDraw::restitution(const std::string& name) {
  const int draw = integer(1, 100);
  if (draw <= 35) return constant(name, "0");
  if (draw <= 43) return constant(name, "1");
  return number(name, 0.05, 0.98);
}

std::string SceneDraw::clearance(const std::string& name, double high, int percent_touching) {
  return chance(percent_touching) ? constant(name, "0") : number(name, 0.01, high);
}

std::string SceneDraw::velocity(const std::string& name, double high) {
  return chance(12) ? constant(name, "0") : number(name, -high, high);
}

std::string SceneDraw::q(int k) {
  return fmt::format("q[{}]", k);
}

std::string SceneDraw::v(int k) {
  return fmt::format("v[{}]", k);
}

int SceneDraw::coordinate(const std::string& q0, const std::string& v0, const std::string& mass_entry) {
  const int k = n_q();
  q0_.push_back(q0);
  v0_.push_back(v0);
  force_.emplace_back();
  for (auto& row : mass_) row.emplace_back("0");
  mass_.emplace_back(static_cast<std::size_t>(k) + 1, "0");
  mass(k, k, mass_entry);
  return k;
}

void SceneDraw::mass(int row, int column, const std::string& entry) {
  const auto i = static_cast<std::size_t>(row), j = static_cast<std::size_t>(column);
  mass_[i][j] = mass_[j][i] = entry;
}

void SceneDraw::force(int k, const std::string& expression) {
  std::string& sum = force_[static_cast<std::size_t>(k)];
  sum = plus(sum, expression);
}

void SceneDraw::potential(const std::string& expression) {
  potential_ = plus(potential_, expression);
}

void SceneDraw::gravity(int k, const std::string& mass_entry) {
  force(k, fmt::format("-{}*9.81", mass_entry));
  potential(fmt::format("{}*9.81*{}", mass_entry, q(k)));
}

void SceneDraw::spring(const std::vector<int>& a, const std::vector<int>& b, const std::string& stiffness,
                       const std::string& length, const std::vector<std::string>& anchor) {
  std::vector<std::string> difference;
  for (std::size_t d = 0; d < b.size(); ++d)
    difference.push_back(fmt::format("({}-{})", q(b[d]), a.empty() ? anchor[d] : q(a[d])));
  std::string extent = difference.front();
  if (b.size() > 1) {
    std::string squares;
    for (const auto& part : difference) squares = plus(squares, part + "**2");
    extent = fmt::format("sqrt({})", squares);
  }
  for (std::size_t d = 0; d < b.size(); ++d) {
    const std::string direction = b.size() > 1 ? fmt::format("*{}/{}", difference[d], extent) : "";
    const std::string pull = fmt::format("{}*({}-{}){}", stiffness, extent, length, direction);
    force(b[d], "-" + pull);
    if (!a.empty()) force(a[d], pull);
  }
  potential(fmt::format("{}/2*({}-{})**2", stiffness, extent, length));
}

void SceneDraw::contact(const std::string& name, const std::string& gap, const std::string& eps_r) {
  contacts_.push_back({{"name", name}, {"gap", gap}, {"e", eps_r}});
}

void SceneDraw::contact(const std::string& name, const std::string& gap, const std::string& eps_r,
                        const Friction& friction) {
  contact(name, gap, eps_r);
  contacts_.back()["mu"] = friction.mu;
  contacts_.back()["Jt"] = rows_of(friction.tangents);
  if (!friction.drives.empty()) contacts_.back()["vt_drive"] = friction.drives;
}

nlohmann::ordered_json SceneDraw::rows_of(const std::vector<Direction>& tangents) const {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const auto& direction : tangents) {
    std::vector<std::string> entries(q0_.size(), "0");
    for (const auto& [k, entry] : direction) entries[static_cast<std::size_t>(k)] = entry;
    rows.push_back(entries);
  }
  return rows;
}

void SceneDraw::contact_with_chance(const std::string& name, const std::string& gap, const std::string& eps_r,
                                    int percent_rough, const Range& mu, const std::vector<Direction>& tangents) {
  restitution(eps_r);
  if (chance(percent_rough))
    contact(name, gap, eps_r, {number(mu.name, mu.low, mu.high), tangents});
  else
    contact(name, gap, eps_r);
}

void SceneDraw::joint(const std::string& name, const std::string& gap) {
  contacts_.push_back({{"name", name}, {"gap", gap}, {"bilateral", true}});
}

void SceneDraw::friction_element(const std::string& name, const std::vector<Direction>& tangents,
                                 const std::string& bound, const std::vector<std::string>& drives) {
  elements_.push_back({{"name", name}, {"Jt", rows_of(tangents)}, {"bound", bound}});
  if (!drives.empty()) elements_.back()["vt_drive"] = drives;
}

void SceneDraw::static_friction(double low, double high) {
  int n = 0;
  const auto has_one_direction = [](const nlohmann::ordered_json& entry) {
    return entry.contains("Jt") && entry["Jt"].size() == 1;
  };
  for (auto& contact : contacts_) {
    if (!has_one_direction(contact)) continue;
    const std::string ratio = number(fmt::format("ratio{}", n++), low, high);
    contact["mu_static"] = fmt::format("{}*{}", ratio, contact["mu"].get<std::string>());
  }
  for (auto& element : elements_) {
    if (has_one_direction(element)) element["static_ratio"] = number(fmt::format("ratio{}", n++), low, high);
  }
}

void SceneDraw::change_units(int mass_unit, int length, int time) {
  has_units_ = true;
  constant("unit_mass", fmt::format("1e{}", mass_unit));
  constant("unit_length", fmt::format("1e{}", length));
  constant("unit_time", fmt::format("1e{}", time));
}

namespace {

/// A formula in the old units, of quantities in the new ones, times the unit of its value.
std::string in_new_units(const std::string& formula, const std::string& unit) {
  if (formula.empty() || formula == "0") return "0";
  static const std::regex position(R"((q\[\d+\]))"), velocity(R"((v\[\d+\]))"), time(R"(\bt\b)");
  std::string text = std::regex_replace(formula, position, "($1/unit_length)");
  text = std::regex_replace(text, velocity, "($1*unit_time/unit_length)");
  text = std::regex_replace(text, time, "(t/unit_time)");
  return fmt::format("{}*({})", unit, text);
}

void change_units_of(nlohmann::ordered_json& texts, const std::string& unit) {
  if (texts.is_array()) {
    for (auto& text : texts) change_units_of(text, unit);
  } else {
    texts = in_new_units(texts.get<std::string>(), unit);
  }
}

}  // namespace

nlohmann::ordered_json SceneDraw::scene(const std::string& id, const std::string& title) const {
  nlohmann::ordered_json scene = {{"id", id}, {"title", title}, {"params", parameters_}, {"q0", q0_}, {"v0", v0_},
                                  {"T", "T"}, {"M", mass_}};
  for (const auto& sum : force_) scene["f"].push_back(sum.empty() ? "0" : sum);
  scene["contacts"] = contacts_;
  if (!elements_.empty()) scene["friction"] = elements_;
  if (!potential_.empty()) scene["potential_energy"] = potential_;
  if (!has_units_) return scene;
  change_units_of(scene["q0"], "unit_length");
  change_units_of(scene["v0"], "unit_length/unit_time");
  change_units_of(scene["T"], "unit_time");
  change_units_of(scene["M"], "unit_mass");
  change_units_of(scene["f"], "unit_mass*unit_length/unit_time**2");
  for (auto& contact : scene["contacts"]) change_units_of(contact["gap"], "unit_length");
  for (const char* list : {"contacts", "friction"}) {
    if (!scene.contains(list)) continue;
    for (auto& contact : scene[list]) {
      if (contact.contains("Jt")) change_units_of(contact["Jt"], "1");
      if (contact.contains("vt_drive")) change_units_of(contact["vt_drive"], "unit_length/unit_time");
      if (contact.contains("bound")) change_units_of(contact["bound"], "unit_mass*unit_length/unit_time**2");
    }
  }
  if (!potential_.empty()) change_units_of(scene["potential_energy"], "unit_mass*unit_length**2/unit_time**2");
  return scene;
}

}  // namespace ricochet
