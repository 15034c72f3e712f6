#pragma once

#include <memory>
#include <vector>

#include "methods/complementarity/mpcc/static_ldl.h"

namespace ricochet {

/// While it lives, the linear solver that Ipopt knows as "ma57" is StaticLdl, for solves in this thread. Debian's Ipopt
/// 3.11 has no other public way to a solver of one's own: its loader of HSL's libraries accepts the five functions of
/// MA57, which are those of the whole process. They find their data through a pointer of the thread to the innermost
/// IpoptLdl, so solves in several threads share nothing.
class IpoptLdl {
 public:
  /// @param n_rows  unknowns of the rows in Ipopt's systems, the last ones
  explicit IpoptLdl(int n_rows);
  ~IpoptLdl();
  IpoptLdl(const IpoptLdl&) = delete;
  IpoptLdl& operator=(const IpoptLdl&) = delete;

  static constexpr const char* ipopt_name = "ma57";

  /// Factorisations and solves since construction.
  struct Work {
    int factorisations = 0, singular = 0, solves = 0;
    double worst_residual = 0;
  };
  const Work& work() const { return work_; }

 private:
  friend struct Ma57;

  struct System {
    StaticLdl factors;
    int n_entries = 0;
    double quality = -1;  // Ipopt raises its pivot tolerance if the last solution was not accurate enough
  };

  IpoptLdl* outer_ = nullptr;
  int n_rows_ = 0;
  std::vector<std::unique_ptr<System>> systems_;  // MA57's array `keep` has the index
  Work work_;
};

}  // namespace ricochet
