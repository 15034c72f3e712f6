#include "bench/commands/schema_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "bench/commands/run_report.h"
#include "bench/experiment/experiment_schema.h"
#include "problems/scene_file/scene_schema.h"

namespace ricochet {
namespace {

using nlohmann::json;

/// A word of a field, of itself or of what its $ref stands for.
json word(const JsonSchema& schema, const json& field, const char* name) {
  if (field.contains(name)) return field[name];
  return schema.resolved(field).value(name, json());
}

std::string type_of(const JsonSchema& schema, const json& field) {
  if (field.contains("$ref")) {
    const std::string reference = field["$ref"];
    return reference.substr(reference.rfind('/') + 1);
  }
  if (field.contains("anyOf")) {
    std::vector<std::string> types;
    for (const json& other : field["anyOf"]) types.push_back(type_of(schema, other));
    return fmt::format("{}", fmt::join(types, " or "));
  }
  json types = field.value("type", json::array());
  if (types.is_string()) types = json::array({types});
  std::string text = fmt::format("{}", fmt::join(types.get<std::vector<std::string>>(), " or "));
  if (text == "array" && field.contains("items")) return "list of " + type_of(schema, field["items"]);
  if (field.contains("enum") && field["enum"].size() == 1) return field["enum"][0].dump();
  for (const auto& [name, sign] :
       {std::pair{"minimum", ">="}, {"exclusiveMinimum", ">"}, {"maximum", "<="}, {"exclusiveMaximum", "<"}})
    if (field.contains(name)) text += fmt::format(" {} {}", sign, field[name].dump());
  return text;
}

/// A line for each field that is described, and below it those inside it.
std::string lines_of(const JsonSchema& schema, const json& object, const std::string& prefix) {
  std::string lines;
  const json required = object.value("required", json::array()),
             properties = object.value("properties", json::object());
  for (const auto& [name, field] : properties.items()) {
    const json description = word(schema, field, "description"), examples = word(schema, field, "examples");
    if (description.is_null()) continue;
    const bool is_required = std::ranges::find(required, json(name)) != required.end();
    lines += fmt::format("| `{}{}` | {} | {}{} | {} |\n", prefix, name, type_of(schema, field),
                         is_required ? "Required. " : "", description.get<std::string>(),
                         examples.is_array() ? fmt::format("`{}`", examples[0].dump()) : "");
    std::vector<const json*> inside{&field};
    if (field.contains("anyOf")) {
      for (const json& other : field["anyOf"]) inside.push_back(&other);
    }
    for (const json* part : inside) {
      if (part->contains("items")) lines += lines_of(schema, (*part)["items"], prefix + name + "[].");
      lines += lines_of(schema, *part, prefix + name + ".");
    }
  }
  return lines;
}

std::string section(const JsonSchema& schema, const std::string& title, const json& object) {
  return fmt::format("\n## {}\n\n{}\n\n| field | type | | example |\n|:--|:--|:--|:--|\n{}", title,
                     object.value("description", ""), lines_of(schema, object, ""));
}

}  // namespace

std::string scene_file_page() {
  const JsonSchema& schema = scene_schema();
  std::string page = fmt::format(
      "# Scene files\n\n<!-- Written by `ricochet schema scene --page`; the source is scene.schema.json. -->\n\n"
      "A scene is a JSON file, which `ricochet run --scene FILE.json` reads; no compiler is needed. {} Units are those of "
      "the SI. Fields that are not listed here are refused, and so are fields that are given twice, nesting beyond 64 "
      "levels and control characters.\n\n**formula**: {} A message names the field and the column of a mistake.\n\n"
      "**formulas**: a list of them; **rows**: a list of lists; **label**: a text; **bound**: {}\n",
      schema.document()["description"].get<std::string>(),
      schema.definition("formula")["description"].get<std::string>(),
      schema.definition("bound")["description"].get<std::string>());
  page += section(schema, "A scene", schema.definition("scene"));
  page += section(schema, "A contact", schema.definition("contact"));
  page += section(schema, "A friction element", schema.definition("friction"));
  page += section(schema, "A law of impacts", schema.definition("impact_law"));
  page += section(schema, "A control problem", schema.definition("control"));
  page += section(schema, "A constraint of a control problem", schema.definition("constraint"));
  page += section(schema, "A square of a cost", schema.definition("square"));
  page += section(schema, "A geometry", schema.definition("geometry"));
  for (const char* part : {"body", "shape", "link"})
    page += section(schema, fmt::format("A {}", part), schema.definition(part));
  page += section(schema, "A scene with a label", schema.definition("labelled"));
  page += section(schema, "Several scenes", schema.definition("set"));
  page +=
      "\n## Example\n\nA ball that is thrown on a rough floor, and bounces:\n\n```json\n"
      "{\n  \"title\": \"a ball thrown on a rough floor\",\n"
      "  \"params\": {\"m\": \"0.1\", \"R\": \"0.05\", \"g\": \"9.81\"},\n"
      "  \"units\": {\"m\": \"kg\", \"R\": \"m\", \"g\": \"m/s2\"},\n"
      "  \"q0\": [\"0\", \"1\", \"0\"], \"v0\": [\"2\", \"0\", \"0\"], \"T\": \"1\",\n"
      "  \"M\": [[\"m\", \"0\", \"0\"], [\"0\", \"m\", \"0\"], [\"0\", \"0\", \"2/5*m*R**2\"]],\n"
      "  \"f\": [\"0\", \"-m*g\", \"0\"],\n"
      "  \"contacts\": [{\"name\": \"floor\", \"gap\": \"q[1]-R\", \"e\": \"0.8\", \"mu\": \"0.3\", "
      "\"Jt\": [[\"1\", \"0\", \"R\"]]}],\n"
      "  \"potential_energy\": \"m*g*q[1]\"\n}\n```\n";
  return page;
}

std::string experiment_file_page() {
  std::string page =
      "# Experiment files\n\n<!-- Written by `ricochet schema experiment --page`; the source is Study::fields in "
      "bench/studies/. -->\n\n"
      "An experiment is a JSON file, which `ricochet run-experiment FILE.json` runs. Paths in it are relative to its "
      "folder. A method that cannot run a scene gets a row with the reason. Fields not listed here are refused.\n";
  for (const Study& study : studies()) {
    const JsonSchema& schema = experiment_schema(study);
    if (!study.fields.empty()) page += section(schema, study.kind, schema.document());
  }
  page += section(experiment_group_schema(), "With parts", experiment_group_schema().document());
  const JsonSchema& shared = experiment_schema(studies().front());
  page += "\n## Shared parts\n\n";
  for (const auto& [name, part] : shared.document()["$defs"].items()) {
    page += fmt::format("- **{}**: {}\n", name, part.value("description", ""));
  }
  page += section(shared, "range", shared.definition("range"));
  return page;
}

std::string run_page() {
  return "# A run as JSON\n\n<!-- Written by `ricochet schema run --page`; the source is run_report.cpp. -->\n" +
         section(run_schema(), "ricochet run --json", run_schema().document());
}

}  // namespace ricochet
