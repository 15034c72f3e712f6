#pragma once

namespace CLI {
class App;
}

namespace ricochet {

// One function per command of the program, which adds the command with its options and its action. Commands set
// `exit_code` to 1 if a run or a check failed; InputError means exit code 2.

void add_list_command(CLI::App& app, int& exit_code);
void add_run_command(CLI::App& app, int& exit_code);
void add_audit_command(CLI::App& app, int& exit_code);
void add_ensemble_command(CLI::App& app, int& exit_code);
void add_export_command(CLI::App& app, int& exit_code);
void add_truth_command(CLI::App& app, int& exit_code);
void add_contacts_command(CLI::App& app, int& exit_code);
void add_control_command(CLI::App& app, int& exit_code);
void add_mpc_command(CLI::App& app, int& exit_code);
void add_run_experiment_command(CLI::App& app, int& exit_code);
void add_show_command(CLI::App& app, int& exit_code);
void add_report_command(CLI::App& app, int& exit_code);
void add_results_command(CLI::App& app, int& exit_code);
void add_table_command(CLI::App& app, int& exit_code);
void add_check_command(CLI::App& app, int& exit_code);
void add_verify_command(CLI::App& app, int& exit_code);
void add_check_gradient_command(CLI::App& app, int& exit_code);
void add_history_command(CLI::App& app, int& exit_code);
void add_schema_command(CLI::App& app, int& exit_code);
void add_fuzz_command(CLI::App& app, int& exit_code);

}  // namespace ricochet
