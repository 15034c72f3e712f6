#pragma once

#include <string>
#include <vector>

/// @file
/// The settings of an engine: the defaults, our tuned ones, or those of a user's file.

namespace ricochet {

/// A number that can be set in an engine.
struct EngineSetting {
  std::string name;    ///< of the adapter's list, "erp"
  double value = 0;    ///< what the run uses
  std::string reason;  ///< why it is no default; empty where it is one
};

/// The settings of a run. A file settings/ENGINE.json has for each the engine's default, our choice, and its reason:
///
///     {"engine": "Bullet 3.24", "settings": {"erp": {"default": 0.2, "tuned": 0, "reason": "why"}, ...}}
///
/// A user's file changes some: {"base": "tuned", "settings": {"erp": 0.1}}; "base" may be left out: "defaults".
class EngineSettings {
 public:
  /// @param known   the text of settings/ENGINE.json
  /// @param choice  "defaults", "tuned" or "@" and the name of a user's file
  /// @throws InputError for a file that cannot be read, a setting that the engine has not, or a value that is no number
  EngineSettings(const char* known, const std::string& choice);

  /// The value of a setting. @throws std::logic_error for a name that is not in settings/ENGINE.json
  double operator[](const std::string& name) const;
  bool on(const std::string& name) const { return (*this)[name] != 0; }  ///< A setting that is 0 or 1.
  const std::string& engine() const { return engine_; }                  ///< Its name and version.
  const std::vector<EngineSetting>& all() const { return all_; }         ///< In the order of the file.

 private:
  std::string engine_;
  std::vector<EngineSetting> all_;
};

}  // namespace ricochet
