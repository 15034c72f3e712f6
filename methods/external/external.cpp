#include <fmt/format.h>
#include <fmt/ranges.h>

#include "methods/external/external_client.h"
#include "methods/registry.h"
#include "problems/input_error.h"
#include "problems/levers.h"

namespace ricochet {
namespace {

constexpr std::size_t kManyColons = 100;  // that a command may have

std::string command_of(const MethodSpec& spec) {
  const std::string command = fmt::format("{}", fmt::join(spec.arguments(), ":"));
  if (command.empty())
    throw InputError("method", spec.text(), "a command is required, for example external:python3 my_client.py");
  return command;
}

/// Somebody else's program as a method, by the line protocol of README.md. No equations: they are those of its program.
class External final : public Method {
 public:
  explicit External(const MethodSpec& spec)
      : id_(spec.text()),
        seed_(spec.whole_number("seed", 0, 0, 2'000'000'000)),
        client_(ExternalClient::of(command_of(spec))) {
    client_->greeting();
  }

  MethodInfo info() const override {
    const ClientGreeting& greeting = client_->greeting();
    return {.id = id_,
            .title = greeting.title,
            .source = greeting.source,
            .order_smooth = greeting.order_smooth,
            .order_impacts = greeting.order_impacts,
            .is_adaptive = greeting.is_adaptive,
            .has_restitution_of_speed = greeting.features.contains("restitution_of_speed")};
  }

  Support supports(const ProblemInfo& problem) const override {
    const auto& can = client_->greeting().features;
    const auto lacks = [&](bool needed, const char* feature) { return needed && !can.contains(feature); };
    const auto has_tangents = [&](int n) {
      return std::ranges::any_of(problem.contacts, [&](const ContactInfo& contact) { return contact.n_t == n; });
    };
    if (!problem.structure.has_formulas) return Support::no("a scene without formulas cannot be sent to its program");
    if (lacks(has_tangents(1), "friction_2d")) return Support::no("its program has no friction in the plane");
    if (lacks(has_tangents(2), "friction_3d")) return Support::no("its program has no friction in space");
    if (lacks(problem.has_bilateral(), "bilateral")) return Support::no("its program has no bilateral constraints");
    if (lacks(problem.n_friction_elements > 0, "friction_elements"))
      return Support::no("its program has no friction elements");
    if (has_levers(problem))
      return Support::no("friction elements that are bounded by the force of a contact are not sent to programs");
    if (lacks(std::ranges::any_of(problem.contacts, &ContactInfo::mu_varies), "friction_of_place"))
      return Support::no("its program has no friction coefficients that depend on the place");
    if (lacks(problem.clock >= 0, "time"))
      return Support::no("its program has no forces or contacts that depend on time");
    return Support::yes();
  }

 protected:
  Solution do_solve(const Problem& problem, const Settings& settings) const override {
    return client_->solve(problem, settings, seed_);
  }

 private:
  const std::string id_;
  const int seed_;
  const std::shared_ptr<ExternalClient> client_;
};

const bool registered = register_method<External>({
    .name = "external",
    .usage = "external:COMMAND[,seed=0]",
    .max_arguments = kManyColons,
    .summary = "a program of yours, in any language, by lines of JSON: methods/external/README.md",
    .examples = {},
});

}  // namespace
}  // namespace ricochet
