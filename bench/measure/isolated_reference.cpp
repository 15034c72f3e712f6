#include "bench/measure/isolated_reference.h"

#include <fmt/format.h>

#include <stdexcept>

#include "methods/isolated.h"
#include "problems/vector_json.h"

namespace ricochet {

using nlohmann::json;

reference::Reference isolated_reference(const ProblemChoice& choice, const Problem& made, double seconds) {
  const IsolatedResult result = run_isolated(
      [&] {
        const reference::Reference r = choice.make_reference(made);
        return json{{"q", r.solution.q},
                    {"v", r.solution.v},
                    {"uncertainty", r.uncertainty},
                    {"how", r.how},
                    {"is_truth", r.is_truth}}
            .dump();
      },
      seconds);
  if (result.ending == IsolatedResult::Ending::killed)
    throw std::runtime_error(fmt::format("its reference did not finish within {} s", seconds));
  if (result.ending == IsolatedResult::Ending::crashed) throw std::runtime_error(result.text);
  const json made_there = json::parse(result.text);
  reference::Reference reference;
  reference.solution.q = made_there.at("q").get<Vector>();
  reference.solution.v = made_there.at("v").get<Vector>();
  reference.uncertainty = made_there.at("uncertainty");
  reference.how = made_there.at("how");
  reference.is_truth = made_there.at("is_truth");
  return reference;
}

}  // namespace ricochet
