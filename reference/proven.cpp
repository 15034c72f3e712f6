#include "reference/proven.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "problems/scene_file/scene_writer.h"
#include "reference/certified/certified_motion.h"
#include "reference/certified/sha256.h"

namespace ricochet::reference {

extern const char* const kStoredProofs;  // the text of reference/data/proofs.json, by CMake

namespace {

using certified::CertifiedMotion;
using certified::Grade;
using nlohmann::json;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kRounding = 64 * kEps;  // of a scene whose numbers are rounded, where no second proof exists
constexpr int kDigits = 20;              // decimals that are wanted: three more than doubles have
constexpr int kLeastDecimals = 17;

/// A proven final state, rounded to double.
struct Proof {
  std::string grade;
  int decimals = 0;
  Vector q, v;                  ///< of the bodies
  double t = 0;                 ///< of the end [s]
  double radius = 0;            ///< largest, of q and v
  std::optional<double> moved;  ///< max|x - x_rounded| of (1), if it is proven
};

/// The state of bodies with those of friction elements, which are zero, and of the clock.
Vector appended(const Vector& x, const ProblemInfo& info, double clock) {
  Vector longer = Vector::Zero(info.n_q);
  longer.head(x.size()) = x;
  if (info.clock >= 0) longer[info.clock] = clock;
  return longer;
}

bool is_certain(const CertifiedMotion& motion) {
  return motion.grade <= Grade::assumed && motion.decimals() >= kLeastDecimals;
}

Vector rounded(const std::vector<certified::CertifiedNumber>& numbers) {
  Vector x(static_cast<Eigen::Index>(numbers.size()));
  for (Eigen::Index k = 0; k < x.size(); ++k) x[k] = std::stod(numbers[static_cast<std::size_t>(k)].text);
  return x;
}

double largest_radius(const CertifiedMotion& motion) {
  double radius = 0;
  for (const auto* list : {&motion.q, &motion.v})
    for (const auto& number : *list) radius = std::max(radius, number.radius);
  return radius;
}

std::optional<Proof> new_proof(const Problem& problem, double max_seconds) {
  const CertifiedMotion motion =
      certified::certified_motion(problem, {.digits = kDigits, .max_seconds = max_seconds, .may_compute = false});
  if (!is_certain(motion)) return std::nullopt;
  Proof proof{name_of(motion.grade),
              motion.decimals(),
              rounded(motion.q),
              rounded(motion.v),
              std::strtod(motion.end_time.text.c_str(), nullptr),
              std::max(largest_radius(motion), problem.info().until < 0 ? 0.0 : motion.end_time.radius),
              std::nullopt};
  proof.moved = certified::moved_by_rounding(
      problem, motion, {.digits = kDigits, .max_seconds = std::max(0.1, max_seconds - motion.seconds)});
  return proof;
}

Vector vector_of(const json& numbers) {
  Vector x(static_cast<Eigen::Index>(numbers.size()));
  for (Eigen::Index k = 0; k < x.size(); ++k)
    x[k] = std::stod(numbers[static_cast<std::size_t>(k)].at("value").get<std::string>());
  return x;
}

std::optional<Proof> stored_proof(const Problem& problem) {
  static const json document = json::parse(kStoredProofs);
  if (!certified::is_small(problem) || !problem.formulas() || problem.info().until >= 0) return std::nullopt;
  const std::string hash = hash_of_formulas(problem);
  const auto& proofs = document.at("proofs");
  const auto known =
      std::ranges::find_if(proofs, [&](const json& entry) { return entry.at("formulas_sha256") == hash; });
  if (known == proofs.end()) return std::nullopt;
  Proof proof{known->at("grade"),
              known->at("decimals"),
              vector_of(known->at("q")),
              vector_of(known->at("v")),
              problem.info().end_time,
              0,
              std::nullopt};
  for (const char* list : {"q", "v"})
    for (const json& number : known->at(list)) proof.radius = std::max(proof.radius, number.at("radius").get<double>());
  if (!known->at("moved_by_rounding").is_null()) proof.moved = known->at("moved_by_rounding").get<double>();
  return proof;
}

}  // namespace

std::string hash_of_formulas(const Problem& problem) {
  return certified::sha256(scene_text(problem, {.with_title = false}));
}

std::optional<Reference> proven_reference(const Problem& problem, double max_seconds) {
  auto proof = stored_proof(problem);
  if (!proof) proof = new_proof(problem, max_seconds);
  if (!proof) return std::nullopt;
  Reference reference;
  reference.solution.q = appended(proof->q, problem.info(), proof->t);
  reference.solution.v = appended(proof->v, problem.info(), 1);
  reference.solution.t = proof->t;
  reference.ends_early = problem.info().until >= 0;
  const double size = reference.size();
  reference.uncertainty = proof->radius + proof->moved.value_or(kRounding * size) + kEps * size;  // (1)
  reference.is_truth = proof->grade == "proven" && proof->moved;
  reference.how = fmt::format("{} to {} decimals by Taylor series in ball arithmetic{}",
                              proof->grade == "proven" ? "proven" : "proven, but for assumptions,", proof->decimals,
                              proof->moved ? "" : "; the effect of rounded numbers is estimated");
  return reference;
}

Reference truth_of(const Problem& problem) {
  if (auto proven = proven_reference(problem)) return *std::move(proven);
  return make_reference(problem);
}

}  // namespace ricochet::reference
