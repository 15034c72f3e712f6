#include "bench/studies/questions/toss_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "methods/peers/engines/engine_scene.h"
#include "problems/input_error.h"
#include "problems/registry.h"

namespace ricochet {
namespace {

constexpr std::size_t kColumns =
    19;  // position 3, quaternion 4 (real first), velocity 3, angular velocity 3, control 6

template <class Number>
std::vector<double> numbers_at(const std::string& bytes, std::size_t begin, std::size_t n) {
  std::vector<double> numbers(n);
  for (std::size_t k = 0; k < n; ++k) {
    Number number;
    std::memcpy(&number, bytes.data() + begin + k * sizeof(Number), sizeof(Number));
    numbers[k] = number;
  }
  return numbers;
}

/// The storage: a count of 8 bytes and as many numbers up to the end of the file, whole rows of them.
std::vector<double> storage_of(const std::string& bytes, const std::string& path) {
  for (std::size_t begin = 0; begin + 8 < bytes.size(); ++begin) {
    std::uint64_t n = 0;
    std::memcpy(&n, bytes.data() + begin, 8);
    const std::size_t rest = bytes.size() - begin - 8;
    if (n == 0 || n % kColumns != 0 || n > rest) continue;
    if (n * 8 == rest) return numbers_at<double>(bytes, begin + 8, n);
    if (n * 4 == rest) return numbers_at<float>(bytes, begin + 8, n);
  }
  throw InputError("toss", path, "it does not end in rows of 19 numbers, as files of the ContactNets data do");
}

Matrix3<double> rotation_of(double w, double x, double y, double z) {
  const double s = 2 / (w * w + x * x + y * y + z * z);
  return {{{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
           {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
           {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}}};
}

/// The rotations that take a cube into itself.
std::vector<Matrix3<double>> symmetries_of_cube() {
  std::vector<Matrix3<double>> list;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Matrix3<double> S{};
      for (std::size_t k = 0; k < 3; ++k) S[k][static_cast<std::size_t>(axes[k])] = signs >> k & 1 ? -1 : 1;
      if (dot(S[0], cross(S[1], S[2])) > 0) list.push_back(S);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return list;
}

/// Axes of the world, turned about z, and of the cube.
struct Axes {
  Matrix3<double> world, cube;

  Pose seen(const Pose& pose) const { return {times(world, pose.centre), times(times(world, pose.R), cube)}; }
};

/// The axes in which |sin(beta)| = |R[0][2]| stays smallest over all rows.
Axes best_axes(const std::vector<TossRow>& rows) {
  constexpr int kYaws = 12;
  Axes best{};
  double least = HUGE_VAL;
  for (const auto& cube : symmetries_of_cube()) {
    for (int yaw = 0; yaw < kYaws; ++yaw) {
      const Axes axes{geometry_detail::about(2, std::acos(-1.0) * yaw / kYaws), cube};
      double worst = 0;
      for (const TossRow& row : rows) worst = std::max(worst, std::abs(axes.seen(row.pose).R[0][2]));
      if (worst < least) least = worst, best = axes;
    }
  }
  return best;
}

double lowest_corner(const Pose& pose) {
  double reach = 0;
  for (const double x : pose.R[2]) reach += kCubeHalfWidth * std::abs(x);
  return pose.centre[2] - reach;
}

Vector3<double> middle(const Vector3<double>& a, const Vector3<double>& b) {
  return scaled(0.5, sum(a, b));
}

}  // namespace

std::vector<TossRow> read_toss(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError("toss", path, "it cannot be opened");
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::vector<double> x = storage_of(bytes, path);
  std::vector<TossRow> rows;
  for (std::size_t k = 0; k < x.size(); k += kColumns) {
    const double* r = x.data() + k;
    if (!std::all_of(r, r + kColumns, [](double number) { return std::isfinite(number); }))
      throw InputError("toss", path, "it contains entries that are not finite numbers");
    const Vector3<double> position{r[0], r[1], r[2]}, velocity{r[7], r[8], r[9]};
    rows.push_back({{scaled(kCubeHalfWidth, position), rotation_of(r[3], r[4], r[5], r[6])},
                    scaled(kCubeHalfWidth, velocity),  // lengths of the data are in half widths
                    {r[10], r[11], r[12]}});
  }
  if (rows.size() < 3) throw InputError("toss", path, "three rows at least are required");
  return rows;
}

std::vector<std::string> toss_files(const std::string& folder) {
  std::vector<std::pair<int, std::string>> numbered;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".pt")
      numbered.emplace_back(std::atoi(entry.path().stem().c_str()), entry.path().string());
  }
  if (numbered.empty()) throw InputError("data", folder, "a folder with tosses N.pt is required");
  std::sort(numbered.begin(), numbered.end());
  std::vector<std::string> files;
  for (auto& [number, path] : numbered) files.push_back(std::move(path));
  return files;
}

Toss toss_of(const std::vector<TossRow>& rows, double e, double mu) {
  constexpr std::size_t kStart = 1;
  const Axes axes = best_axes(rows);
  const double floor = lowest_corner(rows.back().pose);
  Toss toss;
  for (std::size_t k = kStart; k < rows.size(); ++k) {
    Pose pose = axes.seen(rows[k].pose);
    pose.centre[2] -= floor;
    toss.measured.push_back(pose);
  }
  toss.problem = make_problem("box_3d", {{"a", kCubeHalfWidth},
                                         {"b", kCubeHalfWidth},
                                         {"c", kCubeHalfWidth},
                                         {"m", kCubeMass},
                                         {"e", e},
                                         {"mu", mu},
                                         {"height", 1},
                                         {"duration", static_cast<double>(rows.size() - 1 - kStart) / kTossRate}});
  const BodyState start{
      toss.measured.front(), times(axes.world, middle(rows[kStart].velocity, rows[kStart + 1].velocity)),
      times(toss.measured.front().R, times_transposed(axes.cube, middle(rows[kStart].omega, rows[kStart + 1].omega)))};
  Vector q = toss.problem->info().q0, v = toss.problem->info().v0;
  q.setZero();
  v.setZero();
  EngineScene(*toss.problem).coordinates_of(std::span(&start, 1), 0, q, v);
  toss.problem->set_initial_state(q, v);
  return toss;
}

}  // namespace ricochet
