// Settings of physics engines, whether an engine is installed or not.
#include "methods/peers/engines/engine_settings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "problems/input_error.h"

namespace ricochet {
namespace {

TEST(EngineSettings, AreDefaultsOursOrAUsers) {
  const char* const known = R"({"engine": "an engine", "settings": {
      "erp": {"default": 0.2, "tuned": 0, "reason": "it is energy"}, "slop": {"default": 1}}})";
  EXPECT_EQ(EngineSettings(known, "defaults")["erp"], 0.2);
  const EngineSettings tuned(known, "tuned");
  EXPECT_EQ(tuned["erp"], 0);
  EXPECT_EQ(tuned.all()[0].reason, "it is energy");
  EXPECT_EQ(tuned.all()[1].reason, "");

  const std::string file = std::filesystem::temp_directory_path() / "ricochet_engine_settings.json";
  const auto with = [&](const std::string& text) {
    std::ofstream(file) << text;
    return EngineSettings(known, "@" + file);
  };
  EXPECT_EQ(with(R"({"base": "tuned", "settings": {"slop": 3}})")["slop"], 3);
  EXPECT_EQ(with(R"({"base": "tuned", "settings": {"slop": 3}})")["erp"], 0);
  EXPECT_EQ(with(R"({"settings": {"slop": 3}})")["erp"], 0.2);
  EXPECT_THROW(with(R"({"settings": {"slob": 3}})"), InputError);
  EXPECT_THROW(with(R"({"settings": {"slop": "3"}})"), InputError);
  EXPECT_THROW(with(R"({"base": "mine"})"), InputError);
  EXPECT_THROW(with(R"([1])"), InputError);
  EXPECT_THROW(EngineSettings(known, "@no_such_file.json"), InputError);
  EXPECT_THROW(EngineSettings(known, file), InputError) << "a file has an @ before it";
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace ricochet
