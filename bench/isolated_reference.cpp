#include "bench/isolated_reference.h"

#include <fmt/format.h>

#include <stdexcept>

#include "bench/isolated.h"

namespace ricochet {
namespace {

using nlohmann::json;

std::vector<double> list(const Vector& x) {
  return {x.begin(), x.end()};
}

Vector vector(const json& values) {
  const auto list = values.get<std::vector<double>>();
  return Eigen::Map<const Vector>(list.data(), static_cast<Eigen::Index>(list.size()));
}

}  // namespace

reference::Reference isolated_reference(const ProblemChoice& choice, const Problem& made, double seconds) {
  const IsolatedResult result = run_isolated(
      [&] {
        const reference::Reference r = choice.make_reference(made);
        return json{
            {"q", list(r.solution.q)}, {"v", list(r.solution.v)}, {"uncertainty", r.uncertainty}, {"how", r.how}}
            .dump();
      },
      seconds);
  if (result.ending == IsolatedResult::Ending::killed)
    throw std::runtime_error(fmt::format("its reference has no end within {} s", seconds));
  if (result.ending == IsolatedResult::Ending::crashed) throw std::runtime_error(result.text);
  const json made_there = json::parse(result.text);
  reference::Reference reference;
  reference.solution.q = vector(made_there.at("q"));
  reference.solution.v = vector(made_there.at("v"));
  reference.uncertainty = made_there.at("uncertainty");
  reference.how = made_there.at("how");
  return reference;
}

}  // namespace ricochet
