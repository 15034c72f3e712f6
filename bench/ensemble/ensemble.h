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

/// One scene for many parameters and initial states, by one method with one setting: a parameter study, or Monte Carlo.
///
/// Grids are combined with each other, the last one fastest, and at every point of theirs `draws` runs follow each
/// other. Number k of the drawn quantities of run i is uniform_number(seed, i, k): it depends on nothing else, so that
/// another method, or any number of threads, meets the same values.
struct Ensemble {
  ProblemChoice problem;
  std::string method;
  Settings settings;
  std::vector<VariedQuantity> varied;
  std::int64_t draws = 1;
  std::uint64_t seed = 1;

  std::int64_t n_runs() const;
  /// Of the varied quantities in run i = 0, 1, ...
  std::vector<double> values(std::int64_t run) const;
  std::vector<std::string> names() const;
  /// As it is read.
  nlohmann::json document() const;
};

/// Of the documents that read_ensemble() takes.
const JsonSchema& ensemble_schema();

/// Of the fields "problem" and "parameters" (problem_choice.h), "vary": ["NAME=DISTRIBUTION"], "runs": draws at each
/// point of the grids, "seed"; "method", "steps" or "tolerance", "time_limit" of a run [s].
/// @throws InputError with field, value and what is allowed; nlohmann::json::exception for one that is missing
Ensemble read_ensemble(const nlohmann::json& document);

/// What is kept of a run. One that failed is a run with a status and a message, too.
struct EnsembleRun {
  std::int64_t number = 0;
  std::vector<double> values;
  std::string status, message;  ///< "bad_input" for values that the scene does not allow; or to_string(Status)
  double t = 0;                 ///< time that was reached [s]
  Vector q, v;                  ///< there, without the clock; empty for bad input
  std::int64_t steps = 0, events = 0;

  bool succeeded() const { return status == "success"; }
};

/// What one thread needs for runs: a problem of its own, whose values are set again, and a method.
class EnsembleWorker {
 public:
  /// Takes milliseconds. @throws InputError for what does not fit: an unknown quantity, a method that declines
  explicit EnsembleWorker(const Ensemble& ensemble);

  EnsembleRun run(std::int64_t number);
  /// As CSV, see below.
  std::string csv_lines(std::int64_t begin, std::int64_t end);
  /// The problem of a run, without the run. @throws InputError
  const Problem& problem(std::int64_t number) { return problem_.at(ensemble_.values(number)); }
  const ProblemInfo& base() const { return problem_.base(); }

 private:
  Ensemble ensemble_;
  AdjustableProblem problem_;
  std::unique_ptr<Method> method_;
  std::unique_ptr<Solver> solver_;  // where initial states vary alone; made with that of the scene in every thread
};

/// One worker per thread. @throws InputError for threads < 1, or more than one where the method's library has state that
/// threads share
std::vector<std::unique_ptr<EnsembleWorker>> make_workers(const Ensemble& ensemble, int threads);

/// As CSV: a line of headers "run,k,e,status,t,q[0],...,v[0],...,steps,events,message", and one per run. Numbers are the
/// shortest texts that give the same double back.
std::string csv_header(const Ensemble& ensemble, const ProblemInfo& problem);
std::string csv_line(const EnsembleRun& run, const ProblemInfo& problem);

}  // namespace ricochet
