#include "reference/ground_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "problems/input_error.h"
#include "problems/input_text.h"
#include "problems/names.h"

namespace ricochet::reference {
namespace {

using nlohmann::json;

double number(const json& value) {
  return value.is_string() ? std::stod(value.get<std::string>()) : value.get<double>();
}

Vector vector(const json& values) {
  Vector result(static_cast<Eigen::Index>(values.size()));
  for (std::size_t k = 0; k < values.size(); ++k) result[static_cast<Eigen::Index>(k)] = number(values[k]);
  return result;
}

}  // namespace

Solution GroundTruth::solution(const std::vector<std::string>& wrt) const {
  Solution solution;
  solution.q = q;
  solution.v = v;
  solution.dq.resize(q.size(), static_cast<Eigen::Index>(wrt.size()));
  solution.dv = solution.dq;
  for (std::size_t k = 0; k < wrt.size(); ++k) {
    const auto known =
        std::find_if(sensitivities.begin(), sensitivities.end(), [&](const auto& s) { return s.wrt == wrt[k]; });
    if (known == sensitivities.end()) {
      std::vector<std::string> names;
      for (const auto& s : sensitivities) names.push_back(s.wrt);
      throw_unknown_name("sensitivity in the ground truth of " + id, wrt[k], names);
    }
    solution.dq.col(static_cast<Eigen::Index>(k)) = known->dq;
    solution.dv.col(static_cast<Eigen::Index>(k)) = known->dv;
  }
  return solution;
}

std::vector<GroundTruth> ground_truth_of(const json& document, const std::string& name) {
  std::vector<GroundTruth> cases;
  try {
    for (const auto& entry : document.at("cases")) {
      GroundTruth truth{entry.at("id"),
                        entry.at("title"),
                        vector(entry.at("final").at("q")),
                        vector(entry.at("final").at("v")),
                        entry.at("initial_modes"),
                        {},
                        {}};
      for (const auto& event : entry.at("events")) {
        GroundTruth::Event e{number(event.at("t")), event.at("kind"), event.at("contact"), {}, {}, {}};
        if (event.contains("Ln")) {
          for (const auto& [contact, impulse] : event["Ln"].items()) e.Lambda_n.emplace_back(contact, number(impulse));
        }
        if (event.contains("Lt")) {
          for (const auto& [contact, impulse] : event["Lt"].items()) e.Lambda_t.emplace_back(contact, vector(impulse));
        }
        if (event.contains("modes_after")) event["modes_after"].get_to(e.modes);
        truth.events.push_back(std::move(e));
      }
      for (const auto& s : entry.at("sensitivities"))
        truth.sensitivities.push_back({s.at("wrt"), vector(s.at("dq")), vector(s.at("dv")), vector(s.at("dt_events"))});
      cases.push_back(std::move(truth));
    }
  } catch (const std::exception& error) {
    throw InputError(fmt::format("{}: not a ground truth file: {}", name, error.what()));
  }
  return cases;
}

std::vector<GroundTruth> read_ground_truth(const std::string& path) {
  return ground_truth_of(read_input_json(path, "ground truth file"), path);
}

GroundTruth read_ground_truth(const std::string& path, const std::string& id) {
  std::vector<std::string> known;
  for (auto& truth : read_ground_truth(path)) {
    if (truth.id == id) return truth;
    known.push_back(truth.id);
  }
  throw_unknown_name("case of " + path, id, known);
}

}  // namespace ricochet::reference
