#include "bench/control/control_claim.h"

#include <algorithm>
#include <cmath>

#include "bench/control/replay.h"

namespace ricochet {
namespace {

constexpr int kSamples = 240;  // of a picture: a line between two of them is not seen as one

std::vector<double> list(const Vector& x) {
  return {x.begin(), x.end()};
}

/// The cubic with the positions and velocities of both points, which has the order of a stage; (q, v) are those between
/// the impacts at t_0 and t_1.
///
///   q(s) = q_0 + h v_0 s + (3 d - h (2 v_0 + v_1)) s^2 + (h (v_0 + v_1) - 2 d) s^3,   d = q_1 - q_0,  s = (t - t_0) /
///   h
Vector position(const ControlTrajectory::Point& a, const ControlTrajectory::Point& b, double t) {
  const double h = b.t - a.t, s = (t - a.t) / h;
  const Vector d = b.q - a.q;
  return a.q + s * (h * a.v + s * ((3 * d - h * (2 * a.v + b.v)) + s * (h * (a.v + b.v) - 2 * d)));
}

/// What acts at an instant: the control of its interval, the forces of the next stage, at T of the last point.
Forces forces_at(const ProblemInfo& info, const ControlTrajectory& trajectory, double t) {
  Forces forces{{}, Vector::Zero(info.n_c()), Vector::Zero(info.n_c())};
  const auto N = trajectory.u.cols();
  forces.u = trajectory.u.col(std::min(static_cast<Eigen::Index>(t / trajectory.T * static_cast<double>(N)), N - 1));
  const auto stage = std::ranges::find_if(trajectory.points, [&](const ControlTrajectory::Point& point) {
    return (point.t > t || point.t == trajectory.points.back().t) && point.lambda_n.size() > 0;
  });
  if (stage == trajectory.points.end()) return forces;
  forces.lambda_n = stage->lambda_n;
  for (int i = 0; i < info.n_c(); ++i) {
    const ContactInfo& contact = info.contacts[i];
    if (contact.n_t > 0) forces.friction[i] = stage->lambda_t[contact.tangent_index];
  }
  return forces;
}

/// Equally spaced samples, and the instants of impacts.
MotionPicture picture_of(const OptimalControlProblem& problem, const ControlTrajectory& trajectory,
                         const std::vector<ControlRun::Impact>& impacts) {
  MotionPicture picture;
  if (!problem.shapes) return picture;
  std::vector<double> instants;
  for (int k = 0; k <= kSamples; ++k) instants.push_back(trajectory.T * k / kSamples);
  for (const auto& impact : impacts) instants.push_back(impact.t);
  std::ranges::sort(instants);
  instants.erase(std::unique(instants.begin(), instants.end()), instants.end());
  for (const double t : instants) {
    const auto behind = std::ranges::find_if(trajectory.points, [t](const auto& point) { return point.t > t; });
    Vector q = trajectory.points.back().q;
    if (behind != trajectory.points.end()) q = position(*std::prev(behind), *behind, t);
    picture.frames.push_back(
        {t, problem.shapes(q), problem.arrows(q, forces_at(problem.plant->info(), trajectory, t))});
  }
  return picture;
}

}  // namespace

void describe_claim(const OptimalControlProblem& problem, const ControlTrajectory& trajectory, ControlRun& run) {
  const ProblemInfo& info = problem.plant->info();
  run.claimed_cost = trajectory.objective;
  run.T = trajectory.T;
  for (const auto& u : trajectory.u.colwise()) run.u.push_back(list(u));
  for (const auto& point : trajectory.points) {
    run.claimed.t.push_back(point.t);
    run.claimed.q.push_back(list(point.q.head(info.n_mechanical())));
    run.claimed.v.push_back(list(point.v.head(info.n_mechanical())));
    if (info.n_c() > 0) run.penetration = std::max(run.penetration, -problem.plant->gap(point.q).minCoeff());
    if (point.lambda_n.size() == 0) continue;
    run.force_t.push_back(point.t);
    run.lambda_n.push_back(list(point.lambda_n));
    run.lambda_t.push_back(list(point.lambda_t));
  }
  const double least = smallest_impact(problem, trajectory);
  for (const auto& impulse : trajectory.impulses) {
    if (impulse.Lambda_n > least)
      run.impacts.push_back({impulse.t, impulse.contact, impulse.Lambda_n, list(impulse.Lambda_t)});
  }
  for (int i = 0; i < info.n_c(); ++i) {
    run.contacts.push_back(info.contacts[i].name);
    run.friction.insert(run.friction.end(), static_cast<std::size_t>(info.contacts[i].n_t), i);
  }
  run.picture = picture_of(problem, trajectory, run.impacts);
}

}  // namespace ricochet
