#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/ensemble/distribution.h"
#include "bench/measure/problem_choice.h"
#include "methods/method.h"
#include "problems/adjustable_problem.h"
#include "problems/json_schema.h"

namespace ricochet {

/// One scene with many parameters and initial states, one method and one setting: a parameter study, or Monte Carlo.
///
/// Grids are combined with each other, the last one varying fastest. At every point of the grids there are `draws`
/// runs. Number k of the drawn quantities of run i is uniform_number(seed, i, k). It depends on nothing else, so that
/// the values are the same for every method and number of threads.
struct Ensemble {
  ProblemChoice problem;
  std::string method;
  Settings settings;
  std::vector<VariedQuantity> varied;
  std::int64_t draws = 1;
  std::uint64_t seed = 1;

  std::int64_t n_runs() const;
  /// Values of the varied quantities in run i = 0, 1, ...
  std::vector<double> values(std::int64_t run) const;
  std::vector<std::string> names() const;
  /// The document that read_ensemble() reads.
  nlohmann::json document() const;
};

/// Schema of the documents for read_ensemble().
const JsonSchema& ensemble_schema();

/// Reads the fields "problem" and "parameters" (problem_choice.h), "vary": ["NAME=DISTRIBUTION"], "runs": draws at each
/// point of the grids, "seed"; "method", "steps" or "tolerance", "time_limit" of a run [s].
/// @throws InputError with field, value and what is allowed; nlohmann::json::exception for one that is missing
Ensemble read_ensemble(const nlohmann::json& document);

/// Result of a run. A failed run has a status and a message, too.
struct EnsembleRun {
  std::int64_t number = 0;
  std::vector<double> values;
  std::string status, message;  ///< "bad_input" for values that the scene does not allow; or to_string(Status)
  double t = 0;                 ///< time that was reached [s]
  Vector q, v;                  ///< there, without the clock; empty for bad input
  std::int64_t steps = 0, events = 0;

  bool succeeded() const { return status == "success"; }
};

/// Data of one thread: its own problem, whose values are changed for every run, and a method.
class EnsembleWorker {
 public:
  /// Takes milliseconds. @throws InputError for an unknown quantity or a method that declines the scene
  explicit EnsembleWorker(const Ensemble& ensemble);

  EnsembleRun run(std::int64_t number);
  /// The runs as CSV, see below.
  std::string csv_lines(std::int64_t begin, std::int64_t end);
  /// The problem of a run, without running it. @throws InputError
  const Problem& problem(std::int64_t number) { return problem_.at(ensemble_.values(number)); }
  const ProblemInfo& base() const { return problem_.base(); }

 private:
  Ensemble ensemble_;
  AdjustableProblem problem_;
  std::unique_ptr<Method> method_;
  std::unique_ptr<Solver> solver_;  // where initial states vary alone; made with that of the scene in every thread
};

/// One worker per thread. @throws InputError for threads < 1, or for several if the method's library has global
/// state
std::vector<std::unique_ptr<EnsembleWorker>> make_workers(const Ensemble& ensemble, int threads);

/// CSV: a header line "run,k,e,status,t,q[0],...,v[0],...,steps,events,message", and one line per run. Numbers are the
/// shortest texts that represent the same double.
std::string csv_header(const Ensemble& ensemble, const ProblemInfo& problem);
std::string csv_line(const EnsembleRun& run, const ProblemInfo& problem);

}  // namespace ricochet
