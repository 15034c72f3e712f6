#include "bench/contacts/merit_study.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <random>

#include "methods/contact_laws/contact_residuals.h"
#include "methods/contact_laws/delassus_matrix.h"
#include "reports/quantile.h"

namespace ricochet {
namespace {

/// A kind of problem, contacts in space.
struct Kind {
  const char* name;
  int contacts, coordinates;
  double mass = 1;      ///< of all bodies [kg]
  double ratio = 1;     ///< of the largest to the smallest mass
  bool sticks = false;  ///< at every contact, in place of open, slip and stick by turns
};

constexpr Kind kKinds[] = {{.name = "6 contacts, 1 kg", .contacts = 6, .coordinates = 30},
                           {.name = "the same, 1 g", .contacts = 6, .coordinates = 30, .mass = 1e-3},
                           {.name = "the same, 1 t", .contacts = 6, .coordinates = 30, .mass = 1e3},
                           {.name = "masses 1 : 1e4", .contacts = 6, .coordinates = 30, .ratio = 1e4},
                           {.name = "redundant", .contacts = 6, .coordinates = 9},
                           {.name = "all stick, ill", .contacts = 6, .coordinates = 18, .sticks = true},
                           {.name = "60 contacts", .contacts = 60, .coordinates = 200}};
constexpr double kDeltas[] = {1e-2, 1e-4, 1e-6, 1e-8};
constexpr double kMoves = 1e-7;  // velocities over impulses, both relative: below is the rounding of a null space
constexpr int kMerits = 3;
constexpr const char* kMeritNames[kMerits] = {"violation()", "laws", "FCLib"};

struct Exact {
  ContactProblem problem;
  Vector r, w, softest;
};

Exact draw(const Kind& kind, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int n = 3 * kind.contacts;
  Matrix D(kind.coordinates, n);  // M^-1/2 times the directions
  for (int q = 0; q < kind.coordinates; ++q) {
    const double mass = kind.mass * std::pow(kind.ratio, uniform(generator) - 0.5);
    for (int k = 0; k < n; ++k) D(q, k) = normal(generator) / std::sqrt(mass);
  }
  Exact exact;
  exact.r = exact.w = Vector::Zero(n);
  for (int i = 0; i < kind.contacts; ++i) {
    ContactProblem::Contact contact{.id = i, .n_t = 2, .mu = 0.2 + 0.6 * uniform(generator)};
    const double angle = 2 * std::numbers::pi * uniform(generator), normal_impulse = 0.1 + uniform(generator);
    auto r = exact.r.segment<3>(3 * i), w = exact.w.segment<3>(3 * i);
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    if (i % 3 == 0 && !kind.sticks) {  // open
      w[0] = 0.1 + uniform(generator);
      w.tail<2>() = normal(generator) * direction;
    } else {
      const bool slips = i % 3 == 1 && !kind.sticks;
      r[0] = kind.mass * normal_impulse;
      r.tail<2>() = -(slips ? 1 : 0.9 * uniform(generator)) * contact.mu * r[0] * direction;
      if (slips) w.tail<2>() = (0.1 + uniform(generator)) * direction;
    }
    exact.problem.contacts.push_back(contact);
  }
  const Matrix G = D.transpose() * D;
  set_operator(exact.problem.G, std::vector<int>(kind.contacts, 3), SparseMatrix(G.sparseView(0, 0)));
  exact.problem.b = exact.w - G * exact.r;
  exact.softest = Eigen::SelfAdjointEigenSolver<Matrix>(G).eigenvectors().col(0);
  return exact;
}

struct Measured {
  double velocity = 0, impulse = 0;  ///< distances (2)
  std::array<double, kMerits> merits{};
};

Measured measure_disturbed(const Exact& exact, const Vector& direction, double delta) {
  const ContactProblem& problem = exact.problem;
  const Vector r = exact.r + delta * exact.r.norm() * direction;
  Vector w(r.size());
  problem.G.times(r, problem.b, w);
  const ContactScale scale = scale_of(problem, exact.r);
  const ContactResiduals laws = residuals_of(problem, r, w);
  const double product = scale.velocity * scale.impulse;
  return {.velocity = (w - exact.w).cwiseAbs().maxCoeff() / scale.velocity,
          .impulse = delta,
          .merits = {violation(problem, r, w, FrictionPolygon()),
                     std::max({laws.signorini / product, laws.pull / scale.impulse, laws.approach / scale.velocity,
                               laws.cone / scale.impulse, laws.dissipation / product}),
                     fclib_merit(problem, r, w)}};
}

}  // namespace

MeritStudy run_merit_study(int draws) {
  MeritStudy study;
  study.values.title = "Merit values of disturbed exact solutions";
  study.values.note = "medians; distances of velocities and impulses relative to those of the problem";
  study.values.columns = {{"problem", true}, {"direction", true}, {"delta"}, {"velocities"}, {"impulses"}};
  study.of_velocities.title = "Merit value over the true distance of velocities";
  study.of_both.title = "Merit value over the larger distance, of velocities or impulses";
  for (Table* table : {&study.of_velocities, &study.of_both}) {
    table->note = fmt::format("smallest .. largest over {} draws, 2 directions and 4 sizes of the disturbance", draws);
    table->columns = {{"problem", true}};
    for (const char* name : kMeritNames) table->columns.push_back({name});
  }
  for (const char* name : kMeritNames) study.values.columns.push_back({name});

  using Ratios = std::array<std::vector<double>, kMerits>;
  struct Bands {
    Ratios velocities, both;
  };
  const auto add_bands = [&](const std::string& name, const Bands& bands) {
    for (const auto& [table, ratios] :
         {std::pair{&study.of_velocities, &bands.velocities}, {&study.of_both, &bands.both}}) {
      auto& row = table->rows.emplace_back();
      row.push_back(name);
      for (const auto& band : *ratios)
        row.push_back(fmt::format("{:.1e} .. {:.1e}", quantile(band, 0), quantile(band, 1)));
    }
  };
  Bands all;
  for (const Kind& kind : kKinds) {
    Bands bands;
    for (const bool is_soft : {false, true}) {
      for (const double delta : kDeltas) {
        std::vector<double> velocity, impulse;
        Ratios merits;
        for (int seed = 1; seed <= draws; ++seed) {
          const Exact exact = draw(kind, seed);
          std::mt19937 generator(1000 + seed);
          std::normal_distribution<double> normal;
          Vector direction(exact.r.size());
          for (auto& entry : direction) entry = normal(generator);
          const Measured m = measure_disturbed(exact, is_soft ? exact.softest : direction.normalized(), delta);
          velocity.push_back(m.velocity);
          impulse.push_back(m.impulse);
          for (int k = 0; k < kMerits; ++k) {
            merits[k].push_back(m.merits[k]);
            // A change in the null space of a redundant problem moves nothing, and has no distance of velocities.
            if (m.velocity > kMoves * delta) bands.velocities[k].push_back(m.merits[k] / m.velocity);
            bands.both[k].push_back(m.merits[k] / std::max(m.velocity, m.impulse));
          }
        }
        auto& row = study.values.rows.emplace_back();
        row = {kind.name, is_soft ? "softest" : "any", fmt::format("{:.0e}", delta), scientific(median(velocity)),
               scientific(median(impulse))};
        for (const auto& of_merit : merits) row.push_back(scientific(median(of_merit)));
      }
    }
    add_bands(kind.name, bands);
    for (int k = 0; k < kMerits; ++k) {
      for (const auto member : {&Bands::velocities, &Bands::both}) {
        auto& list = (all.*member)[k];
        list.insert(list.end(), (bands.*member)[k].begin(), (bands.*member)[k].end());
      }
    }
  }
  add_bands("all", all);
  return study;
}

}  // namespace ricochet
