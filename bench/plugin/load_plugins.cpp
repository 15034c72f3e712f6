#include "bench/plugin/load_plugins.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>

#include "bench/plugin/plugin.h"
#include "problems/input_error.h"
#include "problems/split.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOption = "--plugin";

std::vector<std::string>& loaded() {
  static std::vector<std::string> files;
  return files;
}

std::string difference(const PluginInterface& plugin) {
  if (plugin.version != kPluginVersion)
    return fmt::format(
        "it is made for interface {}, this program has {}: build it again with the headers of this program",
        plugin.version, kPluginVersion);
  if (plugin.alignment != kPluginInterface.alignment)
    return fmt::format(
        "it is compiled for another instruction set (Eigen's alignment {}, here {}): build it without -march, or both with "
        "the same",
        plugin.alignment, kPluginInterface.alignment);
  return "its classes have other sizes: build it with the headers and the compiler of this program";
}

/// Loads a plugin. @throws InputError
void load(const std::string& path) {
  std::error_code error;
  // A name without a folder would be looked for in those of the system.
  const std::string file = fs::absolute(path, error).lexically_normal();
  if (!fs::is_regular_file(file, error)) throw InputError("plugin", path, "there is no such file");
  if (std::ranges::count(loaded(), file) > 0) return;
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library) throw InputError("plugin", path, fmt::format("it cannot be loaded: {}", dlerror()));
  const auto* interface = static_cast<const PluginInterface*>(dlsym(library, "ricochet_plugin_interface"));
  auto* const registers = reinterpret_cast<void (*)()>(dlsym(library, "ricochet_register_plugin"));
  if (!interface || !registers)
    throw InputError("plugin", path, "not a plugin of ricochet: RICOCHET_PLUGIN() is missing");
  if (!(*interface == kPluginInterface)) throw InputError("plugin", path, difference(*interface));
  try {
    registers();
  } catch (const std::exception& thrown) {
    throw InputError("plugin", path, thrown.what());
  }
  loaded().push_back(file);  // and never closed: its methods live as long as the program
}

/// Shared libraries in a `folder`, by name.
std::vector<std::string> libraries_in(const fs::path& folder) {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".so") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// Plugins that come with the program: beside its folder where it was built, in RICOCHET_PLUGIN_FOLDER where installed.
std::vector<std::string> shipped() {
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  const auto built = libraries_in(folder / "../plugins");
  return built.empty() ? libraries_in(folder / RICOCHET_PLUGIN_FOLDER) : built;
}

/// Loads a plugin of our own. Where the library that it is made for has gone, its methods are not there, and the
/// program is.
void load_shipped(const std::string& file) {
  try {
    load(file);
  } catch (const InputError& error) {
    const std::string name = fs::path(file).stem();
    add_method({.name = name,
                .usage = name,
                .summary = "a plugin that cannot be loaded",
                .examples = {name},
                .not_built = error.what()});
  }
}

/// Plugins in the user's folder.
std::vector<std::string> configured() {
  const char *config = std::getenv("XDG_CONFIG_HOME"), *home = std::getenv("HOME");
  fs::path folder;
  if (config && *config)
    folder = config;
  else if (home && *home)
    folder = fs::path(home) / ".config";
  else
    return {};
  return libraries_in(folder / "ricochet" / "plugins");
}

std::vector<std::string> in_environment() {
  const char* const text = std::getenv("RICOCHET_PLUGINS");
  std::vector<std::string> files;
  if (!text) return files;
  for (const auto& file : split(text, ':')) {
    if (!file.empty()) files.push_back(file);
  }
  return files;
}

/// "--plugin FILE" and "--plugin=FILE", taken out of the words.
std::vector<std::string> on_command_line(std::vector<std::string>& words) {
  std::vector<std::string> files, others;
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string& word = words[k];
    if (word.starts_with(std::string(kOption) + "=")) {
      files.push_back(word.substr(std::string(kOption).size() + 1));
    } else if (word == kOption) {
      if (k + 1 == words.size()) throw InputError(kOption, "", "a file is required");
      files.push_back(words[++k]);
    } else {
      others.push_back(word);
    }
  }
  words = std::move(others);
  return files;
}

}  // namespace

void load_plugins(std::vector<std::string>& words) {
  const auto named = on_command_line(words);
  for (const auto& file : shipped()) load_shipped(file);
  for (const auto& files : {configured(), in_environment(), named}) {
    for (const auto& file : files) load(file);
  }
}

const std::vector<std::string>& loaded_plugins() {
  return loaded();
}

}  // namespace ricochet
