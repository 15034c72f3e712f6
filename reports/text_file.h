#pragma once

#include <filesystem>
#include <string>

namespace ricochet {

/// The bytes of a file; empty where it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Writes a whole file or, on a full disk, nothing: what stood there stays until all bytes are written.
/// @param what  "baseline file", for messages  @throws InputError when it cannot be written
void write_text(const std::string& what, const std::filesystem::path& path, const std::string& text);

/// Before the work that a file is the result of: makes its folder. @throws InputError when it could not be written
void require_writable(const std::string& what, const std::filesystem::path& path);

/// Like require_writable(), for a folder that must exist.
void require_writable_there(const std::string& what, const std::filesystem::path& path);

/// Like require_writable(), for a file that must not exist yet.
void require_new_file(const std::string& what, const std::filesystem::path& path);

/// Requires that the folder exists or can be made; leaves no files. @throws InputError
void require_writable_folder(const std::string& what, const std::filesystem::path& path);

}  // namespace ricochet
