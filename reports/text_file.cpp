#include "reports/text_file.h"

#include <fstream>
#include <sstream>

#include "problems/input_error.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

fs::path unfinished(const fs::path& path) {
  return path.string() + ".unfinished";
}

/// A link, a pipe, a terminal: something that a new file must not take the place of.
bool is_written_through(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status);
}

[[noreturn]] void refuse(const std::string& what, const fs::path& path, const std::string& why) {
  std::error_code ignored;
  fs::remove(unfinished(path), ignored);
  throw InputError(what, path.string(), "cannot be written: " + why);
}

}  // namespace

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_text(const std::string& what, const fs::path& path, const std::string& text) {
  const bool is_through = is_written_through(path);
  {
    std::ofstream file(is_through ? path : unfinished(path), std::ios::binary);
    if (!file) refuse(what, path, "the folder does not exist or is closed");
    file << text;
    file.close();
    if (!file) refuse(what, path, "is the disk full?");
  }
  if (is_through) return;
  std::error_code error;
  fs::rename(unfinished(path), path, error);
  if (error) refuse(what, path, error.message());
}

void require_writable(const std::string& what, const fs::path& path) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  if (error) refuse(what, path, error.message());
  require_writable_there(what, path);
}

void require_writable_there(const std::string& what, const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) refuse(what, path, "it is a folder");
  if (is_written_through(path)) return;
  if (!std::ofstream(unfinished(path))) refuse(what, path, "the folder does not exist or is closed");
  fs::remove(unfinished(path), error);
}

void require_new_file(const std::string& what, const fs::path& path) {
  if (fs::exists(path)) throw InputError(what, path.string(), "the file exists; a new file is required");
  require_writable_there(what, path);
}

void require_writable_folder(const std::string& what, const fs::path& path) {
  std::error_code error;
  fs::path there = fs::absolute(path);
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, error)) throw InputError(what, path.string(), "cannot be written: it is not a folder");
  const fs::path probe = there / ".ricochet";
  if (!std::ofstream(unfinished(probe))) throw InputError(what, path.string(), "cannot be written: it is closed");
  fs::remove(unfinished(probe), error);
}

}  // namespace ricochet
