#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "problems/problem.h"
#include "problems/solution.h"

namespace ricochet::reference {

/// A solved problem of a ground-truth file. Its numbers are rounded to double from 42 decimals.
struct GroundTruth {
  struct Event {
    double t = 0;
    std::string kind;     ///< impact, detach, slip_to_stick, stick_to_slip, slip_reversal, zeno_end
    std::string contact;  ///< name
    std::vector<std::pair<std::string, double>> Lambda_n;  ///< impulses by contact, of an impact [N s]
    std::vector<std::pair<std::string, Vector>> Lambda_t;  ///< n_t each, empty without friction [N s]
    std::vector<std::string> modes;  ///< of all contacts after the event: open, free (closed without friction), stick,
                                     ///< slip+, slip-, slip; empty if the file states none
  };
  std::string id, title;
  Vector q, v;                             ///< final state
  std::vector<std::string> initial_modes;  ///< as Event::modes
  std::vector<Event> events;

  /// Derivatives of the final state and of the event times with respect to one variable, as Settings::sensitivities.
  struct Sensitivity {
    std::string wrt;
    Vector dq, dv, dt_events;
  };
  std::vector<Sensitivity> sensitivities;

  /// Final state, and its derivatives with respect to `wrt` as columns of dq and dv.
  /// @throws InputError for a derivative that is not among `sensitivities`
  Solution solution(const std::vector<std::string>& wrt = {}) const;
};

/// All cases of a document in the format of reference/data/ground_truth.json.
/// @param name  of the document, for messages  @throws InputError for a document of another format
std::vector<GroundTruth> ground_truth_of(const nlohmann::json& document, const std::string& name);

/// All cases of a file. @throws InputError if the file cannot be read
std::vector<GroundTruth> read_ground_truth(const std::string& path);

/// One case. @throws InputError for an unknown id
GroundTruth read_ground_truth(const std::string& path, const std::string& id);

}  // namespace ricochet::reference
