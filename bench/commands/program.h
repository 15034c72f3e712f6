#pragma once

namespace CLI {
class App;
}

namespace ricochet {

/// Adds every command of the program. Commands are executed while `app` parses.
/// @param exit_code  1 if a run or a check failed; must outlive `app`
void add_commands(CLI::App& app, int& exit_code);

/// The program `ricochet`. @return 0 all went well, 1 a run or a check failed, 2 bad usage or bad input
int run_program(int argc, char** argv);

}  // namespace ricochet
