#include "methods/event_driven/explicit_steps.h"

#include "problems/names.h"

namespace ricochet {
namespace {

/// Calls visit.operator()<Pair>() for the pair of this name. @return whether there is one
template <class... Pairs>
struct PairList {
  static bool visit(const std::string& pair, auto visitor) {
    return ((Pairs::id == pair && (visitor.template operator()<Pairs>(), true)) || ...);
  }
  static std::vector<std::string> names() { return {std::string(Pairs::id)...}; }
};
using AllPairs = PairList<PrinceDormand87, DormandPrince853, DormandPrince54, Tsitouras54, BogackiShampine54>;

void visit_pair(const std::string& pair, auto visitor) {
  if (!AllPairs::visit(pair, visitor)) throw_unknown_name("explicit pair", pair, AllPairs::names());
}

template <class Pair>
std::unique_ptr<ExplicitStep> make(int n_q, ModeDynamics& dynamics) {
  switch (n_q) {
    case 1:
      return std::make_unique<ExplicitPairStep<Pair, 1>>(n_q, dynamics);
    case 2:
      return std::make_unique<ExplicitPairStep<Pair, 2>>(n_q, dynamics);
    case 3:
      return std::make_unique<ExplicitPairStep<Pair, 3>>(n_q, dynamics);
    case 4:
      return std::make_unique<ExplicitPairStep<Pair, 4>>(n_q, dynamics);
    case 6:
      return std::make_unique<ExplicitPairStep<Pair, 6>>(n_q, dynamics);
    default:
      return std::make_unique<ExplicitPairStep<Pair, 0>>(n_q, dynamics);
  }
}

}  // namespace

std::vector<std::string> explicit_pair_names() {
  return AllPairs::names();
}

std::unique_ptr<ExplicitStep> make_explicit_step(const std::string& pair, int n_q, ModeDynamics& dynamics) {
  std::unique_ptr<ExplicitStep> step;
  visit_pair(pair, [&]<class Pair>() { step = make<Pair>(n_q, dynamics); });
  return step;
}

ExplicitPairInfo explicit_pair_info(const std::string& pair) {
  ExplicitPairInfo info;
  visit_pair(pair, [&]<class Pair>() { info = {std::string(Pair::name), std::string(Pair::source), Pair::order}; });
  return info;
}

}  // namespace ricochet
