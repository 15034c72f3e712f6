#include "bench/contacts/impact_law_study.h"

#include <Eigen/Dense>
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "methods/contact_laws/impact_laws/lzb_impact.h"
#include "methods/contact_laws/impact_laws/planar_impact.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

constexpr double kFrictionOfKane[]{0, 0.1, 0.2, 0.3, 0.5, 0.7, 1};

struct KanesTip {
  PlanarContact contact{};
  PlanarPair w{};
  double energy = 0;  ///< kinetic, before the impact [J]
};

KanesTip kanes_tip(double e, double mu) {
  const auto scene = make_problem("kane_pendulum");
  const Vector &q = scene->info().q0, &v = scene->info().v0;
  Eigen::Matrix2d M, D;  // D = (J_n, J_t), both entries of each: the tip moves with both rods
  scene->mass_matrix(q.data(), M.data());
  scene->normal_jacobian(q.data(), D.data());
  scene->tangent_jacobian(q.data(), D.data() + 2);
  const Eigen::Matrix2d G = D.transpose() * M.inverse() * D;
  const Eigen::Vector2d w = D.transpose() * v;
  return {{G(0, 0), G(1, 1), G(0, 1), e, mu}, {w[0], w[1]}, v.dot(M * v) / 2};
}

Table table_of_kane(double e) {
  Table table;
  table.title = "Kane's pendulum: change of the kinetic energy in the impact";
  table.note =
      fmt::format("relative to the energy before it; e = {}; the impact at the initial state; -: no solution", e);
  table.columns = {{"law", true}};
  for (const double mu : kFrictionOfKane) table.columns.push_back({fmt::format("mu = {}", mu)});
  table.columns.push_back({"gains energy", true});
  for (const auto law : kPlanarHypotheses) {
    std::vector<std::string> row{std::string(name_of(law))};
    bool gains = false;
    for (const double mu : kFrictionOfKane) {
      const KanesTip tip = kanes_tip(e, mu);
      std::optional<double> change;
      if (const auto impact = planar_impact(law, tip.contact, tip.w))
        change = energy_change(*impact, tip.w) / tip.energy;
      gains = gains || change.value_or(0) > 1e-12;  // rounding of a sum of terms of size 1
      row.push_back(cell_text("{:+.1f} %", change ? std::optional(100 * *change) : change));
    }
    row.emplace_back(gains ? "yes" : "no");
    table.rows.push_back(row);
  }
  return table;
}

// G and w- of n beads of mass 1 that touch; the first strikes with velocity 1.
struct Row {
  Matrix G;
  Vector w;
};

Row row_of(int n) {
  Matrix B = Matrix::Zero(n - 1, n);  // w = B v
  for (int i = 0; i < n - 1; ++i) {
    B(i, i) = -1;
    B(i, i + 1) = 1;
  }
  return {B * B.transpose(), B.col(0)};
}

// Moreau's law keeps every contact active here: G^-1 has positive entries only.
Vector moreau_impulses(const Row& row, double e) {
  return row.G.ldlt().solve(-(1 + e) * row.w);
}

Table table_of_cradle(double e, int beads) {
  Table table;
  table.title = "Row of equal touching beads, hit by the first: velocities after the impact";
  table.note = fmt::format("relative to that of the first bead; e = {}; energy relative to that before", e);
  table.columns = {{"law", true}, {"beads"}, {"energy"}};
  for (int i = 1; i <= beads; ++i) table.columns.push_back({fmt::format("v_{}", i)});
  struct Law {
    const char* name;
    double eta;  // 0: Moreau
  };
  for (const Law law : {Law{"moreau", 0}, {"lzb, linear springs", 1}, {"lzb, Hertz", 1.5}}) {
    for (int n = 2; n <= beads; ++n) {
      const Row row = row_of(n);
      const Vector P = law.eta == 0
                           ? moreau_impulses(row, e)
                           : lzb_impact({Vector::Ones(n - 1), Vector::Constant(n - 1, e), law.eta}, row.G, row.w).P;
      Vector v = Vector::Unit(n, 0);
      v.head(n - 1) -= P;
      v.tail(n - 1) += P;
      std::vector<std::string> cells{law.name, std::to_string(n), cell_text("{:.4f}", v.squaredNorm())};
      for (const double velocity : v) cells.push_back(cell_text("{:+.4f}", velocity));
      cells.resize(table.columns.size());
      table.rows.push_back(cells);
    }
  }
  return table;
}

}  // namespace

ImpactLawStudy run_impact_law_study(double e, int beads) {
  return {table_of_kane(e), table_of_cradle(e, beads)};
}

}  // namespace ricochet
