#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ricochet {

/// The bytes of a file, or of a pipe, that a user names.
/// @param what  it is to be, for messages: "scene file"
/// @throws InputError for one that does not exist, is a directory, cannot be read, or has more than 256 MB
std::string read_input_text(const std::string& path, const std::string& what);

/// A JSON text in which nothing is lost, as RFC 8259 leaves to the reader: no field is given twice, values are nested
/// at most 64 deep, and no text has a control character, with which it could write over the message that shows it.
/// Comments // and /* */ are skipped.
/// @param name  of the text for messages, a file for example
/// @throws InputError with the place: "scene.json: contacts[1].e: this field is given twice"
nlohmann::json parse_input_json(const std::string& text, const std::string& name);

/// parse_input_json() of read_input_text(). @throws InputError
nlohmann::json read_input_json(const std::string& path, const std::string& what);

}  // namespace ricochet
