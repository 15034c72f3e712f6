#include "methods/complementarity/mpcc/ipopt_ldl.h"

#include <HSLLoader.h>  // of coinor-libipopt-dev

#include <algorithm>

namespace ricochet {

namespace {

thread_local IpoptLdl* innermost = nullptr;

// Values of info[0] that Ipopt distinguishes.
constexpr ipfint kDone = 0, kIsSingular = 4, kFailed = -1;
constexpr int kNegativeEigenvalues = 23, kRank = 24;  // places in info
/// Sizes of the arrays of factors that Ipopt allocates, which are not used but for an index.
constexpr ipfint kArraySize = 16;

}  // namespace

/// The functions of MA57, with the arguments of HSLLoader.h. They catch all exceptions, since Fortran has none.
struct Ma57 {
  static IpoptLdl::System* system(ipfint index) {
    if (!innermost || index < 0 || index >= static_cast<ipfint>(innermost->systems_.size())) return nullptr;
    return innermost->systems_[index].get();
  }

  static void set_defaults(double* cntl, ipfint* icntl) {
    std::fill_n(cntl, 5, 0.0);
    std::fill_n(icntl, 20, 0);
  }

  static void analyse(ipfint* n, ipfint* n_entries, const ipfint* rows, const ipfint* columns, ipfint*, ipfint* keep,
                      ipfint*, ipfint*, ipfint* info, double*) {
    info[0] = kFailed;
    keep[0] = -1;
    if (!innermost) return;
    try {
      auto& systems = innermost->systems_;
      systems.push_back(
          std::make_unique<IpoptLdl::System>(StaticLdl(*n, innermost->n_rows_, *n_entries, rows, columns), *n_entries));
      keep[0] = static_cast<ipfint>(systems.size()) - 1;
      info[0] = kDone;
      info[8] = info[9] = kArraySize;
    } catch (...) {
    }
  }

  static void factorise(ipfint*, ipfint*, double* values, double*, ipfint*, ipfint* factors, ipfint*, ipfint*,
                        ipfint* keep, ipfint*, ipfint*, double* cntl, ipfint* info, double*) {
    info[0] = kFailed;
    factors[0] = keep[0];
    IpoptLdl::System* system = Ma57::system(keep[0]);
    if (!system) return;
    try {
      const bool again = system->quality >= 0 && cntl[0] > system->quality;
      system->quality = cntl[0];
      const bool is_regular = system->factors.factorise(values, again);
      info[0] = is_regular ? kDone : kIsSingular;
      info[kNegativeEigenvalues] = system->factors.n_negative();
      info[kRank] = system->factors.size();
      ++innermost->work_.factorisations;
      innermost->work_.singular += !is_regular;
    } catch (...) {
    }
  }

  static void solve(ipfint*, ipfint*, double*, ipfint*, ipfint* factors, ipfint*, ipfint* n_sides, double* sides,
                    ipfint* distance, double*, ipfint*, ipfint*, ipfint*, ipfint* info) {
    info[0] = kFailed;
    IpoptLdl::System* system = Ma57::system(factors[0]);
    if (!system) return;
    try {
      for (ipfint k = 0; k < *n_sides; ++k) {
        const double residual = system->factors.solve(sides + static_cast<std::ptrdiff_t>(k) * *distance);
        innermost->work_.worst_residual = std::max(innermost->work_.worst_residual, residual);
        ++innermost->work_.solves;
      }
      info[0] = kDone;
    } catch (...) {
    }
  }

  /// Larger arrays for factors, which are never too small.
  static void enlarge(ipfint*, ipfint*, ipfint*, double*, ipfint*, double*, ipfint*, ipfint*, ipfint*, ipfint*, ipfint*,
                      ipfint* info) {
    info[0] = kFailed;
  }
};

IpoptLdl::IpoptLdl(int n_rows) : outer_(innermost), n_rows_(n_rows) {
  static const bool is_installed = [] {
    LSL_setMA57(Ma57::analyse, Ma57::factorise, Ma57::solve, Ma57::enlarge, Ma57::set_defaults);
    return true;
  }();
  static_cast<void>(is_installed);
  innermost = this;
}

IpoptLdl::~IpoptLdl() {
  innermost = outer_;
}

}  // namespace ricochet
