#pragma once

#include <string>
#include <string_view>

namespace ricochet {

// Any text, in what others read.

std::string escape_html(const std::string& text);

/// For an attribute: line breaks in one would be read as spaces. What XML 1.0 does not allow is a replacement character.
std::string escape_xml(std::string_view text);

/// For a cell of a table in Markdown.
std::string escape_markdown(const std::string& text);

}  // namespace ricochet
