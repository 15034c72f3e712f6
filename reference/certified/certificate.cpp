#include "reference/certified/certificate.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "problems/input_error.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference::certified {
namespace {

using nlohmann::ordered_json;
constexpr const char* kFormat = "ricochet certificate 1";

ordered_json to_json(const CertifiedNumber& number) {
  return {{"value", number.text}, {"radius", number.radius}, {"decimals", number.decimals}};
}

ordered_json to_json(const std::vector<CertifiedNumber>& numbers) {
  ordered_json list = ordered_json::array();
  for (const auto& number : numbers) list.push_back(to_json(number));
  return list;
}

CertifiedNumber to_number(const ordered_json& json) {
  return {json.at("value").get<std::string>(), json.at("radius").get<double>(), json.at("decimals").get<int>()};
}

std::vector<CertifiedNumber> to_numbers(const ordered_json& json) {
  std::vector<CertifiedNumber> numbers;
  for (const auto& entry : json) numbers.push_back(to_number(entry));
  return numbers;
}

std::string hexadecimal(double value) {
  return fmt::format("{:a}", value);
}

/// @throws InputError unless it is a finite number >= 0
double from_hexadecimal(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value) || value < 0)
    throw InputError(fmt::format("'{}' is no hexadecimal number >= 0", text));
  return value;
}

ordered_json to_json(const CertifiedStep& step) {
  ordered_json json = {{"t", step.time}, {"h", hexadecimal(step.length)}, {"end", step.end}, {"modes", step.modes}};
  json["x"] = step.state;
  json["rho"] = ordered_json::array();
  for (const double rho : step.remainders) json["rho"].push_back(hexadecimal(rho));
  return json;
}

CertifiedStep to_step(const ordered_json& json) {
  CertifiedStep step;
  step.time = json.at("t").get<std::string>();
  step.length = from_hexadecimal(json.at("h").get<std::string>());
  step.end = json.at("end").get<std::string>();
  step.modes = json.at("modes").get<std::vector<std::string>>();
  step.state = json.at("x").get<std::vector<std::string>>();
  for (const auto& rho : json.at("rho")) step.remainders.push_back(from_hexadecimal(rho.get<std::string>()));
  return step;
}

ordered_json to_json(const CertificateEvent& event) {
  return {{"step", event.step},   {"kind", event.kind},          {"contact", event.contact},
          {"modes", event.modes}, {"time", to_json(event.time)}, {"Lambda_n", to_json(event.Lambda_n)}};
}

CertificateEvent to_event(const ordered_json& json) {
  CertificateEvent event;
  event.step = json.at("step").get<int>();
  event.kind = json.at("kind").get<std::string>();
  event.contact = json.at("contact").get<std::string>();
  event.modes = json.at("modes").get<std::vector<std::string>>();
  event.time = to_number(json.at("time"));
  event.Lambda_n = to_numbers(json.at("Lambda_n"));
  return event;
}

Grade to_grade(const std::string& name) {
  for (const Grade grade : {Grade::proven, Grade::assumed, Grade::computed, Grade::open}) {
    if (name == name_of(grade)) return grade;
  }
  throw InputError("grade", name, "must be proven or assumed");
}

Reading to_reading(const std::string& name) {
  if (name != "decimal" && name != "rounded") throw InputError("reading", name, "must be decimal or rounded");
  return name == "decimal" ? Reading::decimal : Reading::rounded;
}

/// Everything but the hash.
ordered_json content_of(const Certificate& c) {
  ordered_json json = {{"format", kFormat}, {"scene", c.scene}, {"scene_sha256", c.scene_hash}};
  json["reading"] = c.reading == Reading::decimal ? "decimal" : "rounded";
  json["digits"] = c.digits;
  json["bits"] = c.bits;
  json["order"] = c.order;
  json["grade"] = name_of(c.grade);
  json["assumptions"] = c.assumptions;
  json["steps"] = ordered_json::array();
  for (const auto& step : c.steps) json["steps"].push_back(to_json(step));
  json["events"] = ordered_json::array();
  for (const auto& event : c.events) json["events"].push_back(to_json(event));
  json["final"] = {{"x", c.final_state}, {"modes", c.final_modes}, {"q", to_json(c.q)}, {"v", to_json(c.v)}};
  json["versions"] = ordered_json::object();
  for (const auto& [name, version] : c.versions) json["versions"][name] = version;
  return json;
}

Certificate from_json(const ordered_json& json) {
  if (const auto format = json.at("format").get<std::string>(); format != kFormat)
    throw InputError("format", format, fmt::format("must be {}", kFormat));
  Certificate c;
  c.scene = json.at("scene").get<std::string>();
  c.scene_hash = json.at("scene_sha256").get<std::string>();
  c.reading = to_reading(json.at("reading").get<std::string>());
  c.digits = json.at("digits").get<int>();
  c.bits = json.at("bits").get<long>();
  c.order = json.at("order").get<int>();
  c.grade = to_grade(json.at("grade").get<std::string>());
  c.assumptions = json.at("assumptions").get<std::vector<std::string>>();
  for (const auto& step : json.at("steps")) c.steps.push_back(to_step(step));
  for (const auto& event : json.at("events")) c.events.push_back(to_event(event));
  const ordered_json& end = json.at("final");
  c.final_state = end.at("x").get<std::vector<std::string>>();
  c.final_modes = end.at("modes").get<std::vector<std::string>>();
  c.q = to_numbers(end.at("q"));
  c.v = to_numbers(end.at("v"));
  for (const auto& [name, version] : json.at("versions").items()) c.versions.emplace_back(name, version);
  return c;
}

}  // namespace

std::string certificate_text(const Certificate& certificate) {
  ordered_json json = content_of(certificate);
  json["sha256"] = sha256(json.dump());
  return json.dump(1) + "\n";
}

Certificate read_certificate(const std::string& text) {
  try {
    ordered_json json = ordered_json::parse(text);
    Certificate certificate = from_json(json);
    certificate.stated_hash = json.at("sha256").get<std::string>();
    json.erase("sha256");
    certificate.hash = sha256(json.dump());
    return certificate;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("the certificate cannot be read: {}", error.what()));
  }
}

}  // namespace ricochet::reference::certified
