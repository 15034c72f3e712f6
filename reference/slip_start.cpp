#include "reference/slip_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/dense_solve.h"

namespace ricochet::reference {
namespace {

constexpr int kStages = 5;
using StageVector = Eigen::Matrix<double, kStages, 1>;
using StageMatrix = Eigen::Matrix<double, kStages, kStages>;

struct RadauIIA {
  StageMatrix A;
  StageVector c;
};

/// c are the zeros of d^4/dx^4 (x^4 (x - 1)^5); A integrates polynomials up to degree 4 from 0 to c_i exactly.
RadauIIA radau_iia() {
  RadauIIA tableau;
  tableau.c << 0.057104196114517682193, 0.27684301363812382768, 0.58359043236891682006, 0.86024013565621944785, 1;
  StageMatrix powers, integrals;  // c_j^k and int_0^c_i x^k
  for (int k = 0; k < kStages; ++k) {
    powers.col(k) = tableau.c.array().pow(k);
    integrals.col(k) = tableau.c.array().pow(k + 1) / (k + 1);
  }
  tableau.A = integrals * inverse_of(powers);
  return tableau;
}

class Collocation {
 public:
  Collocation(const Problem& problem, ContactDynamics& dynamics, const std::vector<BeginningSlip>& beginning)
      : problem_(problem),
        dynamics_(dynamics),
        beginning_(beginning),
        lambda_n_(Vector::Zero(problem.n_c())),
        lambda_t_(Vector::Zero(problem.info().n_lambda_t)) {}

  /// Makes one step. @param angles  of the directions at its start, on return at its end
  bool step(double h, Vector& q, Vector& v, Vector& angles) {
    const auto n = static_cast<Eigen::Index>(beginning_.size());
    begin_step(h, q, v);
    Vector phi = angles.replicate(kStages, 1);
    for (int iteration = 0; iteration < 20; ++iteration) {
      const auto residual = across(phi);
      if (!residual) return false;
      Matrix derivative(phi.size(), phi.size());
      for (Eigen::Index j = 0; j < phi.size(); ++j) {
        constexpr double kStep = 1e-7;  // square root of the rounding
        const auto moved = across(phi + kStep * Vector::Unit(phi.size(), j));
        if (!moved) return false;
        derivative.col(j) = (*moved - *residual) / kStep;
      }
      const Vector change = -PartialPivotingFactors(derivative).solve(*residual);
      if (!change.allFinite() || change.cwiseAbs().maxCoeff() > 1) return false;
      phi += change;
      if (change.cwiseAbs().maxCoeff() < 1e-9) break;  // the next one would be rounding
      if (iteration == 19) return false;
    }
    if (!across(phi) || !forward_) return false;
    q = q_[kStages - 1];  // c_5 = 1
    v = v_[kStages - 1];
    angles = phi.tail(n);
    return true;
  }

 private:
  void begin_step(double h, const Vector& q, const Vector& v) {
    h_ = h;
    q0_ = q;
    v0_ = v;
    a_ = Matrix::Zero(problem_.n_q(), kStages);
  }

  Vector direction(const Vector& phi, int stage, std::size_t k) const {
    const double angle = phi[stage * static_cast<Eigen::Index>(beginning_.size()) + static_cast<Eigen::Index>(k)];
    Vector d(2);
    d << std::cos(angle), std::sin(angle);
    return d;
  }

  /// Left side of (3) divided by h, after (1) and (2) are solved; sets forward_ if every slip is along its direction.
  std::optional<Vector> across(const Vector& phi) {
    const auto& [A, c] = tableau_;
    const StageMatrix A2 = A * A;
    for (int sweep = 0;; ++sweep) {
      Matrix a(problem_.n_q(), kStages);
      for (int i = 0; i < kStages; ++i) {
        q_[i] = q0_ + c[i] * h_ * v0_ + h_ * h_ * a_ * A2.row(i).transpose();  // (1)
        v_[i] = v0_ + h_ * a_ * A.row(i).transpose();                          // (1)
        for (std::size_t k = 0; k < beginning_.size(); ++k)
          dynamics_.hold_direction(beginning_[k].contact, direction(phi, i, k));
        const bool solved = dynamics_.acceleration(q_[i].data(), v_[i].data(), a.col(i).data(), lambda_n_.data(),
                                                   lambda_t_.data());  // (2)
        for (const auto& slip : beginning_) dynamics_.hold_direction(slip.contact, {});
        if (!solved || !a.col(i).allFinite()) return std::nullopt;
      }
      const double change = (a - a_).cwiseAbs().maxCoeff();
      a_ = a;
      if (change <= 1e-15 * a.cwiseAbs().maxCoeff()) break;
      if (sweep == 50) return std::nullopt;  // h is too long for a contraction
    }
    Vector residual(phi.size());
    forward_ = true;
    Eigen::Index row = 0;
    for (int i = 0; i < kStages; ++i) {
      const Matrix J_t = problem_.tangent_jacobian(q_[i]);
      for (std::size_t k = 0; k < beginning_.size(); ++k, ++row) {
        const Vector d = direction(phi, i, k);
        const Vector v_t =
            J_t.middleCols(problem_.info().contacts[beginning_[k].contact].tangent_index, 2).transpose() * v_[i];
        residual[row] = (-d[1] * v_t[0] + d[0] * v_t[1]) / h_;  // (3)
        forward_ = forward_ && d.dot(v_t) > 0;
      }
    }
    return residual;
  }

  const RadauIIA tableau_ = radau_iia();
  const Problem& problem_;
  ContactDynamics& dynamics_;
  const std::vector<BeginningSlip>& beginning_;
  Vector lambda_n_, lambda_t_;
  double h_ = 0;
  Vector q0_, v0_, q_[kStages], v_[kStages];
  Matrix a_;  // n_q x stages
  bool forward_ = true;
};

/// Whether a multistep method can continue from the state `now`: every contact is fast enough, or its slip slows down
/// and is still far from its end.
bool can_go_on(const Problem& problem, const SlipStart& before, const SlipStart& now,
               const std::vector<BeginningSlip>& beginning) {
  constexpr double kFarFromEnd = 0.01;  // of the fast speed, ten v_stop of Slips at least
  const auto speed = [&](const SlipStart& at, const BeginningSlip& slip) {
    const int column = problem.info().contacts[slip.contact].tangent_index;
    return (problem.tangent_jacobian(at.q).middleCols(column, 2).transpose() * at.v).norm();
  };
  return std::ranges::all_of(beginning, [&](const BeginningSlip& slip) {
    const double fast = speed(now, slip);
    return fast >= slip.fast || (fast >= kFarFromEnd * slip.fast && fast < speed(before, slip));
  });
}

/// Whether two states differ by no more than `tolerance` of their sizes.
bool agree(const Vector& once, const Vector& twice, const Vector& size, double tolerance) {
  return ((once - twice).cwiseAbs().array() <= tolerance * (twice.cwiseAbs() + size).array()).all();
}

}  // namespace

std::optional<SlipStart> start_slip(const Problem& problem, const Scales& scales, ContactDynamics& dynamics,
                                    const Vector& q, const Vector& v, const std::vector<BeginningSlip>& beginning,
                                    const SlipStartSettings& settings) {
  Vector angles(static_cast<Eigen::Index>(beginning.size()));
  for (std::size_t k = 0; k < beginning.size(); ++k)
    angles[static_cast<Eigen::Index>(k)] = std::atan2(beginning[k].direction[1], beginning[k].direction[0]);

  Collocation collocation(problem, dynamics, beginning);
  SlipStart start{0, q, v};
  constexpr int kSteps = 1000, kHalvings = 30;  // nine decades, below which h v is rounding
  double h = settings.longest_step;
  for (int step = 0, halvings = 0; step < kSteps && halvings < kHalvings; ++step) {
    h = std::min(h, settings.end - start.duration);
    Vector q_once = start.q, v_once = start.v, angles_once = angles;
    Vector q_twice = start.q, v_twice = start.v, angles_twice = angles;
    const bool solved =
        collocation.step(h, q_once, v_once, angles_once) && collocation.step(h / 2, q_twice, v_twice, angles_twice) &&
        collocation.step(h / 2, q_twice, v_twice, angles_twice) && settings.keeps_modes(q_twice, v_twice);
    if (!solved || !agree(q_once, q_twice, scales.position(), settings.tolerance) ||
        !agree(v_once, v_twice, scales.velocity(), settings.tolerance)) {
      h /= 2;
      ++halvings;
      continue;
    }
    const SlipStart before = std::exchange(start, {start.duration + h, q_twice, v_twice});
    angles = angles_twice;
    if (can_go_on(problem, before, start, beginning) || start.duration >= settings.end) break;
  }
  if (start.duration == 0) return std::nullopt;
  return start;
}

}  // namespace ricochet::reference
