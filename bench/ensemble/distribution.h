#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ricochet {

/// A quantity that varies between the runs of an ensemble, with its values:
///
///   uniform:FROM:TO            FROM + (TO - FROM) u, u uniform in (0, 1)
///   log-uniform:FROM:TO        FROM (TO / FROM)^u
///   normal:MEAN:DEVIATION      MEAN + DEVIATION Phi^-1(u)
///   grid:FROM:TO:POINTS        equally spaced, including both ends
///   log-grid:FROM:TO:PER_DECADE
///   values:A:B:...             a list
///
/// The first three are drawn; the others are grids.
class VariedQuantity {
 public:
  /// @param text  "NAME=DISTRIBUTION"  @throws InputError with the text and what is allowed
  explicit VariedQuantity(const std::string& text);

  const std::string& name() const { return name_; }  ///< a parameter, or "q0:0", "v0:1"
  const std::string& text() const { return text_; }

  bool is_drawn() const { return kind_ != Kind::grid; }
  double drawn(double u) const;                            ///< @param u  in (0, 1)
  const std::vector<double>& grid() const { return at_; }  ///< its points

 private:
  enum class Kind { uniform, log_uniform, normal, grid };

  std::string text_, name_;
  Kind kind_ = Kind::grid;
  std::vector<double> at_;  ///< points; or the two numbers of a distribution
};

}  // namespace ricochet
