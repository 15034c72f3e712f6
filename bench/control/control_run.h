#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace ricochet {

/// An optimal control problem solved with one discretisation, and the replay of its controls on the plant.
struct ControlRun {
  static constexpr const char* kKind = "control_run";

  /// A motion at some instants; at an impact two with the same t.
  struct Motion {
    std::vector<double> t;
    std::vector<std::vector<double>> q, v;  ///< per instant
  };

  std::string problem, title;
  std::string method = "homotopy";  ///< or "shooting"
  std::string discretisation;       ///< with its numbers of intervals, elements, steps
  std::string command;              ///< reproduces the run
  int variables = 0, pairs = 0;
  std::string status, message;
  int iterations = 0;
  double seconds = 0;  ///< with those for the guess; NaN where times are not measured

  // Results of a solved run.
  double claimed_cost = 0;
  std::string stationarity;  ///< "S, B, 3 biactive pairs"; "B, 2 active guards, LPEC 3e-12"
  double penetration = 0;    ///< deepest in the claimed motion [m, or the unit of the gap]
  double T = 0;
  std::vector<std::vector<double>> u;  ///< per interval
  Motion claimed;
  /// An impact of the claimed motion.
  struct Impact {
    double t = 0;
    int contact = 0;               ///< in `contacts`
    double Lambda_n = 0;           ///< [N s]
    std::vector<double> Lambda_t;  ///< per tangent direction of the contact [N s]
  };
  std::vector<Impact> impacts;
  std::vector<std::string> contacts;
  std::vector<double> force_t;
  std::vector<std::vector<double>> lambda_n, lambda_t;  ///< per instant of force_t [N]
  std::vector<int> friction;                            ///< contact of each component of lambda_t

  // Replay with the event-located reference, or with the pivoting solver if the reference declines.
  std::string replayed_by;     ///< "reference" or "pivoting"
  std::string replay_status;   ///< of that one
  std::string replay_message;  ///< what the first that failed said
  double true_cost = 0;
  double terminal = 0;  ///< max-norm of the difference of (q, v) at T
  double events = 0;    ///< largest difference of impact times [s]; NaN when they are not the same impacts
  Motion replayed;      ///< at the ends of the intervals

  bool succeeded() const { return status == "success"; }
  bool is_replayed() const { return replay_status == "success"; }
};

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlRun::Motion, t, q, v)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlRun::Impact, t, contact, Lambda_n, Lambda_t)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ControlRun, problem, title, method, discretisation, command, variables,
                                                pairs, status, message, iterations, seconds, claimed_cost, stationarity,
                                                penetration, T, u, claimed, impacts, contacts, force_t, lambda_n,
                                                lambda_t, friction, replayed_by, replay_status, replay_message,
                                                true_cost, terminal, events, replayed)

}  // namespace ricochet
