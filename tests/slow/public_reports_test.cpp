// Scenes made from public reports: the methods that have to solve a scene do, and none has a wrong success.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "bench/experiment/experiment_file.h"
#include "bench/studies/verify/public_report_checks.h"
#include "bench/studies/verify/verify.h"
#include "methods/method_spec.h"
#include "tests/test_data.h"

namespace ricochet {
namespace {

const nlohmann::json& battery_field() {
  static const nlohmann::json field = [] {
    auto stated = read_experiment_file("verify").document["public_reports"];
    stated["cases"] = reference_data("public_reports/cases.json");
    return stated;
  }();
  return field;
}

const std::vector<PublicReport>& reports() {
  static const auto list = read_public_reports(battery_field()["cases"]);
  return list;
}

class PublicReports : public testing::TestWithParam<std::size_t> {};

TEST_P(PublicReports, HaveRightAnswers) {
  const PublicReport& report = reports()[GetParam()];
  std::vector<Check> battery;
  add_public_report_checks({{"public_reports", battery_field()}}, battery);
  for (const std::string method :
       {"fesd_adaptive:radau-iia:4", "fesd:radau-iia:3,elements=as_needed", "fesd:gauss:3,elements=as_needed",
        "event_driven", "cvode:adams", "moreau_jean", "moreau_jean,solver=newton", "moreau_jean,solver=exact"}) {
    // 60 s: a method that has no end is a fault, a slow machine is none.
    const CheckRow row = run_check(battery[GetParam()], subject_of(method, 60));
    EXPECT_NE(row.verdict, CheckVerdict::fail) << method << ": " << row.reason << "\n" << row.command;
    if (std::ranges::find(report.must_succeed, MethodSpec(method).name()) != report.must_succeed.end()) {
      EXPECT_EQ(row.verdict, CheckVerdict::pass) << method << " has to succeed: " << row.reason;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, PublicReports, testing::Range(std::size_t{0}, reports().size()),
                         [](const auto& number) { return reports()[number.param].name; });

}  // namespace
}  // namespace ricochet
