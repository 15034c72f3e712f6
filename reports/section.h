#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "reports/chart.h"
#include "reports/figures.h"
#include "reports/results.h"
#include "reports/table.h"

namespace ricochet {

/// Presentation of the results of a study, in reading order. The terminal, the page and the Markdown page of results each
/// show the parts for which they have room.
class Section {
 public:
  enum class Role {
    choice,    ///< which method to take, for whom and why: on the first screen of the site, too
    result,    ///< what the study is for
    summary,   ///< the same where there are no figures: not on the page
    failures,  ///< what has no result, and why; a reader of the results is told how many
    details    ///< every run: for those who ask for it
  };
  struct NamedTable {
    std::string name;  ///< "orders": of the view, and of its CSV
    Table table;
    Role role;
    nlohmann::json data = {};  ///< of a choice: from what the site answers a reader (reports/site/src/choice.js)
  };
  /// Drawings of a scene.
  struct Drawings {
    std::function<std::vector<Figure>(const FigureFolder&)> draw;
  };
  struct Heading {
    std::string text;
  };
  /// A chart. The site draws its panels (reports/site/src/curves.js), or a form of them that offers more and needs `data`.
  struct ShownChart {
    Chart chart;
    std::string kind;  ///< of that form, "work_precision"; empty: panels of curves
    nlohmann::json data;
  };
  using Part = std::variant<NamedTable, Drawings, Heading, ShownChart>;

  void choice(std::string name, Table table, nlohmann::json data) {
    parts_.push_back(NamedTable{std::move(name), std::move(table), Role::choice, std::move(data)});
  }
  void result(std::string name, Table table) { add(std::move(name), std::move(table), Role::result); }
  void summary(std::string name, Table table) { add(std::move(name), std::move(table), Role::summary); }
  void details(std::string name, Table table) { add(std::move(name), std::move(table), Role::details); }
  /// Nothing when the table is empty; a terminal prints a paragraph per row.
  void failures(std::string name, Table table);
  void drawings(std::function<std::vector<Figure>(const FigureFolder&)> draw) {
    parts_.push_back(Drawings{std::move(draw)});
  }
  void chart(Chart chart, std::string kind = "", nlohmann::json data = nlohmann::json::object()) {
    parts_.push_back(ShownChart{std::move(chart), std::move(kind), std::move(data)});
  }
  void heading(std::string text) { parts_.push_back(Heading{std::move(text)}); }

  const std::vector<Part>& parts() const { return parts_; }
  std::vector<const NamedTable*> tables() const;

 private:
  void add(std::string name, Table table, Role role) {
    parts_.push_back(NamedTable{std::move(name), std::move(table), role});
  }

  std::vector<Part> parts_;
};

/// Results with what is to be said of them.
struct ShownResults {
  Results results;
  Section section;
};

}  // namespace ricochet
