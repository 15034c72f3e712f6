#include "bench/measure/timing.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <ctime>

#include "reports/quantile.h"

namespace ricochet {
namespace {

constexpr const char* kOwnSeconds = "own_seconds";

/// Collects the CPU time per iteration of each repetition; a benchmark's name is its index.
class Collector final : public benchmark::BenchmarkReporter {
 public:
  Collector(std::size_t n_runs, std::size_t n_repetitions, const std::function<void(double)>& progress)
      : times_(n_runs), total_(n_repetitions), progress_(progress) {}

  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.iterations == 0) continue;
      const double own = run.counters.at(kOwnSeconds);
      times_[std::stoul(run.run_name.function_name)].push_back(
          own > 0 ? own : run.cpu_accumulated_time / static_cast<double>(run.iterations));
      ++done_;
    }
    progress_(static_cast<double>(done_) / static_cast<double>(total_));
  }
  std::vector<std::vector<double>> times_;

 private:
  std::size_t done_ = 0, total_;
  const std::function<void(double)>& progress_;
};

}  // namespace

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double seconds_of(const std::function<Solution()>& run, Solution& solution) {
  const auto begin = std::chrono::steady_clock::now();
  solution = run();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return solution.own_seconds > 0 ? solution.own_seconds : seconds;
}

std::vector<Timing> time_runs(const std::vector<TimedRun>& runs, bool quick,
                              const std::function<void(double)>& progress) {
  if (runs.empty()) return {};  // else Google Benchmark complains on the terminal
  static const bool initialized = [] {
    static char program[] = "ricochet", interleave[] = "--benchmark_enable_random_interleaving=true";
    static char* arguments[] = {program, interleave, nullptr};
    int count = 2;
    benchmark::Initialize(&count, arguments);
    return true;
  }();
  static_cast<void>(initialized);

  benchmark::ClearRegisteredBenchmarks();
  std::size_t total = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const bool is_long = runs[k].expected_seconds > 0.2;
    const int repetitions = quick || is_long ? 3 : 9;
    total += static_cast<std::size_t>(repetitions);
    auto* registered =
        benchmark::RegisterBenchmark(std::to_string(k).c_str(), [&run = runs[k].run](benchmark::State& state) {
          double own = 0;
          for (auto _ : state) own += run();
          state.counters[kOwnSeconds] = benchmark::Counter(own, benchmark::Counter::kAvgIterations);
        });
    registered->Repetitions(repetitions)->Unit(benchmark::kSecond);
    if (is_long)
      registered->Iterations(1);
    else
      registered->MinTime(quick ? 0.002 : 0.01)->MinWarmUpTime(0.002);
  }
  Collector collector(runs.size(), total, progress);
  benchmark::RunSpecifiedBenchmarks(&collector);

  std::vector<Timing> timings;
  for (const auto& times : collector.times_) {
    timings.push_back(times.empty() ? Timing{}
                                    : Timing{median(times), std::ranges::min(times), quantile(times, 0.25),
                                             quantile(times, 0.75), static_cast<int>(times.size())});
  }
  return timings;
}

}  // namespace ricochet
