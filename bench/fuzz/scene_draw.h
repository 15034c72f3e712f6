#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace ricochet {

/// A random scene in the making, as the JSON text of a scene file. Every number that is drawn is a parameter of the
/// scene with at most four decimals, and stands once, so that a scene can be read, and a minimiser can round its
/// numbers.
///
/// The same key gives the same scene bit for bit everywhere: std::mt19937_64 is specified by the standard, and numbers
/// are made of its words by whole-number arithmetic (the distributions of <random> differ between libraries). Where two
/// draws are arguments of one call their order is the compiler's: a family gives each draw a statement of its own.
class SceneDraw {
 public:
  /// @param key  text that identifies the scene, "blocks/1/17"
  explicit SceneDraw(const std::string& key);

  // Choices.
  bool chance(int percent) { return integer(1, 100) <= percent; }
  int integer(int low, int high);  ///< both included

  // Numbers: a parameter is added, its name is returned.
  std::string number(const std::string& name, double low, double high);
  std::string constant(const std::string& name, const std::string& value);
  /// In [0, 1]: 0 with 35 %, 1 with 8 %.
  std::string restitution(const std::string& name);
  /// A distance that is open: 0, touching, with the given chance, else up to `high`.
  std::string clearance(const std::string& name, double high, int percent_touching = 15);
  /// A velocity of either sign; 0 with a probability of 12 %.
  std::string velocity(const std::string& name, double high);

  // Equations. Expressions are texts in the parameters, q(k) and v(k).
  static std::string q(int k);
  static std::string v(int k);
  int n_q() const { return static_cast<int>(q0_.size()); }
  /// Adds a coordinate with a diagonal entry of M. @return its index
  int coordinate(const std::string& q0, const std::string& v0, const std::string& mass);
  void mass(int row, int column, const std::string& entry);  ///< and its mirror image, in place of the present one
  void force(int k, const std::string& expression);          ///< is added
  void potential(const std::string& expression);             ///< is added; energy reports use it
  /// Weight along coordinate k, upwards.
  void gravity(int k, const std::string& mass);
  /// Linear spring between points with coordinates `a` and `b` (1, 2 or 3 each); an empty `a` is the place `anchor`.
  void spring(const std::vector<int>& a, const std::vector<int>& b, const std::string& stiffness,
              const std::string& length, const std::vector<std::string>& anchor = {});

  using Direction = std::vector<std::pair<int, std::string>>;  ///< the entries that are not 0
  struct Friction {
    std::string mu;
    std::vector<Direction> tangents;
    std::vector<std::string> drives{};  ///< minus the velocity of the surface, one per tangent; empty: it rests
  };
  void contact(const std::string& name, const std::string& gap, const std::string& eps_r);
  void contact(const std::string& name, const std::string& gap, const std::string& eps_r, const Friction& friction);
  struct Range {
    std::string name;
    double low, high;
  };
  /// Draws a coefficient of restitution, then whether the contact has friction, and with friction its coefficient.
  void contact_with_chance(const std::string& name, const std::string& gap, const std::string& eps_r, int percent_rough,
                           const Range& mu, const std::vector<Direction>& tangents);
  void joint(const std::string& name, const std::string& gap);
  /// Friction without a normal contact. @param tangents  one direction or two  @param bound  of the force
  void friction_element(const std::string& name, const std::vector<Direction>& tangents, const std::string& bound,
                        const std::vector<std::string>& drives = {});

  /// Contacts and elements with one direction of friction have a larger coefficient while they stick: by a factor, drawn
  /// for each.
  void static_friction(double low, double high);

  void end_time(double low, double high) { number("T", low, high); }

  /// Units in which numbers are larger by a power of ten. For a scene whose coordinates are all lengths: with
  /// L = 10^length, and so on,
  ///
  ///   q' = L q,   t' = T t,   M' = (mass unit) M,   f' = (mass unit) L / T^2 f,   gap' = L gap,   drive' = L / T drive
  ///
  /// and the bound of a friction element changes as a force.
  /// The parameters unit_length and unit_time are L and T, by which the judge takes the answers back.
  void change_units(int mass, int length, int time);

  /// The scene drawn so far, as a scene file.
  nlohmann::ordered_json scene(const std::string& id, const std::string& title) const;

 private:
  nlohmann::ordered_json rows_of(const std::vector<Direction>& tangents) const;

  std::mt19937_64 engine_;
  nlohmann::ordered_json parameters_ = nlohmann::ordered_json::object();
  nlohmann::ordered_json contacts_ = nlohmann::ordered_json::array(), elements_ = nlohmann::ordered_json::array();
  std::vector<std::string> q0_, v0_, force_;
  std::vector<std::vector<std::string>> mass_;
  std::string potential_;
  bool has_units_ = false;
};

/// "+c", the chain of terms of a sum.
std::string plus(const std::string& sum, const std::string& term);

}  // namespace ricochet
