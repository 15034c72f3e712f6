#include "reports/table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "reports/markup.h"

namespace ricochet {
namespace {

/// Width in characters of UTF-8 text without combining characters.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xC0U) != 0x80U; }));
}

std::string pad(const std::string& text, std::size_t to, bool left_aligned) {
  const std::string space(to - std::min(to, width(text)), ' ');
  return left_aligned ? text + space : space + text;
}

}  // namespace

Table without_empty(Table table, const std::vector<std::string>& headers) {
  for (std::size_t c = table.columns.size(); c-- > 0;) {
    const bool is_empty = std::ranges::all_of(table.rows, [&](const auto& row) { return row[c] == "-"; });
    if (table.rows.empty() || !is_empty || std::ranges::find(headers, table.columns[c].header) == headers.end())
      continue;
    const auto at = static_cast<std::ptrdiff_t>(c);
    table.columns.erase(table.columns.begin() + at);
    for (auto& row : table.rows) row.erase(row.begin() + at);
  }
  return table;
}

std::string scientific(double x, int digits) {
  return std::isfinite(x) ? fmt::format("{:.{}e}", x, digits) : "-";
}

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < columns.size(); ++c) {
    std::size_t widest = width(columns[c].header);
    for (const auto& row : rows) widest = std::max(widest, width(row[c]));
    widths.push_back(widest);
  }
  std::string out = title.empty() ? "" : title + "\n\n";
  const auto line = [&](const auto& cell) {
    std::string text;
    for (std::size_t c = 0; c < columns.size(); ++c)
      text += (c ? "  " : "  ") + pad(cell(c), widths[c], columns[c].is_text);
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  };
  line([&](std::size_t c) { return columns[c].header; });
  line([&](std::size_t c) { return std::string(widths[c], '-'); });
  for (const auto& row : rows) line([&](std::size_t c) { return row[c]; });
  if (!note.empty()) out += "\n  " + note + "\n";
  return out;
}

std::string Table::list() const {
  std::string out = title.empty() ? "" : title + "\n";
  std::size_t widest = 0;
  for (const auto& column : columns) widest = std::max(widest, width(column.header));
  for (const auto& row : rows) {
    out += "\n";
    for (std::size_t c = 0; c < columns.size(); ++c)
      out += fmt::format("  {}  {}\n", pad(columns[c].header, widest, true), row[c]);
  }
  if (!note.empty()) out += "\n  " + note + "\n";
  return out;
}

std::string Table::markdown(std::size_t most) const {
  std::string out = title.empty() ? "" : "### " + title + "\n\n";
  const auto escape = [](std::string cell) {
    for (std::size_t at = 0; (at = cell.find('|', at)) != std::string::npos; at += 2) cell.insert(at, "\\");
    return cell;
  };
  out += "|";
  for (const auto& column : columns) out += " " + escape(column.header) + " |";
  out += "\n|";
  for (const auto& column : columns) out += column.is_text ? ":---|" : "---:|";
  out += "\n";
  const std::size_t shown = most == 0 ? rows.size() : std::min(most, rows.size());
  for (std::size_t k = 0; k < shown; ++k) {
    out += "|";
    for (const auto& cell : rows[k]) out += " " + escape(cell) + " |";
    out += "\n";
  }
  if (shown < rows.size()) out += fmt::format("\n{} of {} rows.\n", shown, rows.size());
  if (!note.empty()) out += "\n" + note + "\n";
  return out;
}

std::string Table::html() const {
  std::string out = "<figure class=\"table\">\n";
  if (!title.empty()) out += fmt::format("<figcaption><h3>{}</h3></figcaption>\n", escape_html(title));
  const std::string name = escape_html(title.empty() ? "table" : title);
  out += fmt::format("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\"><table{}>\n<thead><tr>",
                     name, filters.empty() ? "" : fmt::format(" data-filters=\"{}\"", fmt::join(filters, " ")));
  for (const auto& column : columns) {
    out +=
        fmt::format("<th scope=\"col\"{}>{}</th>", column.is_text ? " class=\"text\"" : "", escape_html(column.header));
  }
  out += "</tr></thead>\n<tbody>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto& row = rows[r];
    out += row_ids.empty() ? "<tr>" : fmt::format("<tr id=\"{}\">", escape_html(row_ids[r]));
    for (std::size_t c = 0; c < row.size(); ++c) {
      const char* css_class = !columns[c].is_text  ? ""
                              : row[c].size() > 60 ? " class=\"text long\""
                                                   : " class=\"text\"";
      out += fmt::format("<td{}>{}</td>", css_class, escape_html(row[c]));
    }
    out += "</tr>\n";
  }
  out += "</tbody></table></div>\n";
  if (!note.empty()) out += fmt::format("<p class=\"note\">{}</p>\n", escape_html(note));
  return out + "</figure>\n";
}

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string Table::csv() const {
  std::string out;
  for (std::size_t c = 0; c < columns.size(); ++c) out += (c ? "," : "") + csv_cell(columns[c].header);
  out += "\n";
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) out += (c ? "," : "") + csv_cell(row[c]);
    out += "\n";
  }
  return out;
}

}  // namespace ricochet
