#pragma once

#include <string>
#include <vector>

namespace ricochet {

/// A table, once: terminal text, Markdown, HTML and CSV are four ways to print it.
struct Table {
  struct Column {
    std::string header;
    bool is_text = false;  ///< left-aligned; numbers are right-aligned
  };
  std::string title, note;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;

  std::string text() const;
  std::string list() const;  ///< terminal text, a paragraph per row: for cells that hold sentences
  std::string markdown() const;
  std::string html() const;
  std::string csv() const;
};

/// Of a cell: "1.2e-05"; "-" where there is no finite number.
std::string scientific(double x, int digits = 1);

std::string escape_html(const std::string& text);

}  // namespace ricochet
