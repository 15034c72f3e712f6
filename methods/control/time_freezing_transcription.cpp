#include "methods/control/time_freezing_transcription.h"

#include <fmt/format.h>

#include "methods/mpcc_equations/nlp_blocks.h"
#include "methods/time_freezing/regions.h"
#include "problems/join.h"

namespace ricochet {
namespace {

// An element in which time runs less than this part of its pseudo time is frozen: its forces are an impulse.
constexpr double kFrozen = 1e-3;

TimeFreezingEquations::Options equation_options(const OptimalControlProblem& problem,
                                                const TimeFreezingTranscription::Options& options) {
  const AuxiliaryDynamics auxiliary(*problem.plant, options.a_n,
                                    options.bounce * problem.plant->info().end_time / problem.n_intervals);
  return {.n_fe = problem.n_fe,
          .push = auxiliary.push,
          .k = auxiliary.k,
          .damping = auxiliary.damping,
          .rho = options.rho,
          .no_capture = options.no_capture};
}

}  // namespace

TimeFreezingTranscription::TimeFreezingTranscription(const OptimalControlProblem& problem,
                                                     const ButcherTableau& tableau, const Options& options)
    : Transcription(problem, {tableau, {.n_fe = problem.n_fe, .as_needed = true}}),
      tableau_(tableau),
      n_fe_(problem.n_fe),
      equations_(*problem.plant, tableau, equation_options(problem, options), mpcc_) {
  const ProblemInfo& info = problem.plant->info();
  equations_.set_bounds({problem.q.lower, problem.q.upper, problem.v.lower, problem.v.upper});
  u_ = add_controls();
  T_ = add_time();
  begin_sections();
  auto node = equations_.add_start(equations_.add_initial_state(info.q0, info.v0));
  end_section(node.point);
  for (int k = 0; k < problem.n_intervals; ++k) {
    node = equations_.add_interval(node, u_[k], info.end_time / problem.n_intervals, T_, 1.0 / problem.n_intervals);
    for (const auto& element : equations_.intervals().back()) {
      for (int j = 0; j < tableau_.n_s; ++j) {
        const auto& stage = element.stages[j];
        const auto& at = stage.node.point;
        mpcc_.nlp.add_block(std::make_unique<QuadratureBlock>(problem.running_cost, tableau_.b[j], stage.theta,
                                                              join<int>({at.q, at.v, u_[k]})));  // (1)
        add_path(at.q, at.v, u_[k], fmt::format("interval {}, stage {}", k + 1, j + 1));
      }
    }
    end_section(node.point);
  }
  add_terminal(node.point.q, node.point.v);
}

ControlTrajectory TimeFreezingTranscription::trajectory(const Vector& x) const {
  ControlTrajectory trajectory = read_controls(x);
  const ProblemInfo& info = problem_.plant->info();
  const auto values = [&](const std::vector<int>& variables) {
    Vector result(static_cast<Eigen::Index>(variables.size()));
    for (std::size_t k = 0; k < variables.size(); ++k) result[static_cast<Eigen::Index>(k)] = x[variables[k]];
    return result;
  };
  double t = 0;
  Vector q = info.q0, v = info.v0, impulse_n = Vector::Zero(info.n_c()), impulse_t = Vector::Zero(info.n_lambda_t);
  trajectory.points.push_back({t, q, v});
  // Frozen elements that follow each other are one impact.
  const auto end_impact = [&] {
    for (int i = 0; i < info.n_c(); ++i) {
      const ContactInfo& contact = info.contacts[i];
      trajectory.impulses.push_back({t, i, impulse_n[i], impulse_t.segment(contact.tangent_index, contact.n_t)});
    }
    trajectory.points.push_back({t, q, v});
    impulse_n.setZero();
    impulse_t.setZero();
  };
  bool is_frozen = false;
  for (int k = 0; k < problem_.n_intervals; ++k) {
    for (const auto& element : equations_.intervals()[static_cast<std::size_t>(k)]) {
      const double h = x[element.h];
      double dt = 0;
      for (int j = 0; j < tableau_.n_s; ++j) dt += tableau_.b[j] * x[element.stages[j].theta];
      if (is_frozen && dt > kFrozen * h) end_impact();
      is_frozen = dt <= kFrozen * h;
      double passed = 0;
      for (int j = 0; j < tableau_.n_s; ++j) {
        const auto& stage = element.stages[j];
        q = values(stage.node.point.q);
        v = values(stage.node.point.v);
        trajectory.interval_cost[k] +=
            tableau_.b[j] * x[stage.theta] * problem_.running_cost.at(q, v, trajectory.u.col(k))[0];
        if (is_frozen) {
          impulse_n += h * tableau_.b[j] * values(stage.Lambda_n);
          impulse_t += h * tableau_.b[j] * values(stage.Lambda_t);
          continue;
        }
        passed = 0;
        for (int l = 0; l < tableau_.n_s; ++l) passed += tableau_.A(j, l) * x[element.stages[l].theta];
        trajectory.points.push_back(
            {t + passed, q, v, values(stage.Lambda_n) / x[stage.s], values(stage.Lambda_t) / x[stage.s]});
      }
      t += dt;
    }
  }
  if (is_frozen) end_impact();
  trajectory.objective = trajectory.interval_cost.sum() + problem_.terminal_cost.at(q, v)[0];
  return trajectory;
}

/// Stages at equal times of the motion: an impact is a large force of the stages around it.
Status TimeFreezingTranscription::guess_interval(PivotingSolver& solver, double H, int k, Vector& q, Vector& v) {
  const double h = H / n_fe_;
  for (const auto& element : equations_.intervals()[static_cast<std::size_t>(k)]) {
    double c = 0;
    for (int j = 0; j < tableau_.n_s; ++j) {
      const double duration = (tableau_.c[j] - c) * h;
      if (const Status status = solver.advance(duration); status != Status::success) return status;
      const MeanForces forces = mean_forces(solver.step(), simulation_.tableau);
      const Vector v_before = v;
      q = solver.step().last().q1;
      v = solver.step().last().v1;
      equations_.set_guess(element.stages[j], q, v, (v - v_before) / duration, forces.lambda_n, forces.lambda_t);
      c = tableau_.c[j];
    }
    equations_.set_length_guess(element, h);
  }
  return Status::success;
}

}  // namespace ricochet
