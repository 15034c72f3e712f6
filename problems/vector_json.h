#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

/// Vectors as JSON lists of numbers: json(q), j.at("q").get<Vector>().
template <>
struct nlohmann::adl_serializer<Eigen::VectorXd> {
  template <class Json>
  static void to_json(Json& j, const Eigen::VectorXd& x) {
    j = std::vector<double>(x.begin(), x.end());
  }
  template <class Json>
  static void from_json(const Json& j, Eigen::VectorXd& x) {
    const auto values = j.template get<std::vector<double>>();
    x = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  }
};
