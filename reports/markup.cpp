#include "reports/markup.h"

#include <fmt/format.h>

#include <cstdint>
#include <string_view>

namespace ricochet {
namespace {

/// The length of the UTF-8 sequence at the front of the text if XML 1.0 allows its character; 0 otherwise.
std::size_t allowed_in_xml(std::string_view text) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<std::uint8_t>(text[k]) : 0; };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return first >= 0x20 || first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  const std::size_t length = first >= 0xf8 ? 0 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc0 ? 2 : 0;
  if (length == 0) return 0;
  std::uint32_t point = first & (0x7fu >> length);
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xc0u) != 0x80) return 0;
    point = (point << 6) | (byte(k) & 0x3fu);
  }
  constexpr std::uint32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // shorter ones exist for smaller points
  const bool is_allowed = point >= kSmallest[length] && point <= 0x10ffff && !(point >= 0xd800 && point <= 0xdfff) &&
                          point != 0xfffe && point != 0xffff;
  return is_allowed ? length : 0;
}

}  // namespace

std::string escape_html(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '&')
      escaped += "&amp;";
    else if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '"')
      escaped += "&quot;";
    else
      escaped += c;
  }
  return escaped;
}

std::string escape_xml(std::string_view text) {
  std::string allowed;
  while (!text.empty()) {
    const std::size_t length = allowed_in_xml(text);
    allowed += length > 0 ? std::string(text.substr(0, length)) : "\xEF\xBF\xBD";
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  std::string escaped;
  for (const char c : escape_html(allowed)) {
    if (c == '\n' || c == '\r' || c == '\t')
      escaped += fmt::format("&#{};", static_cast<int>(c));
    else
      escaped += c;
  }
  return escaped;
}

std::string escape_markdown(const std::string& text) {
  std::string escaped;
  for (const char c : escape_html(text)) {
    if (c == '|' || c == '`' || c == '*' || c == '_' || c == '[' || c == ']' || c == '\\') escaped += '\\';
    escaped += c == '\n' || c == '\r' ? ' ' : c;
  }
  return escaped;
}

}  // namespace ricochet
