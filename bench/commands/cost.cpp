#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "bench/commands.h"
#include "bench/studies/contact_cost.h"

namespace ricochet {

void add_cost_command(CLI::App& app, int&) {
  static std::vector<std::string> methods{"fesd:radau-iia:2,n_fe=1", "fesd:radau-iia:3,n_fe=1", "moreau_jean",
                                          "anitescu_potra"};
  static bool quick = false;
  auto* command = app.add_subcommand("cost", "time of a step of a box in space per active contact");
  command->add_option("-m,--method", methods, "fixed-step methods, see `ricochet list methods`")->capture_default_str();
  command->add_flag("--quick", quick, "measure three times only");
  command->callback([] { fmt::print("{}\n", contact_cost(methods, quick).text()); });
}

}  // namespace ricochet
