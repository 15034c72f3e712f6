// Contact problems as files of FCLib, where it is built: written and read again, and read as FCLib itself writes them.
#include "methods/contact_laws/contact_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "problems/input_error.h"
#include "tests/contact_problems.h"

#ifdef RICOCHET_HAS_HDF5
#include <hdf5.h>
#include <hdf5_hl.h>
#endif

namespace ricochet {
namespace {

namespace fs = std::filesystem;

class ContactFile : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("ricochet_contact_file_" + std::to_string(getpid()));
  void SetUp() override { fs::create_directories(folder); }
  ~ContactFile() override { fs::remove_all(folder); }
  std::string path(const std::string& name) const { return (folder / name).string(); }
};

#ifndef RICOCHET_HAS_HDF5

TEST_F(ContactFile, WithoutItsLibrarySaysWhatIsMissing) {
  try {
    read_contact_file(path("none.hdf5"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), "contact files are not built: libhdf5-dev not found");
  }
  EXPECT_THROW(write_contact_file({}, path("none.hdf5")), InputError);
}

#else

void expect_same(const ContactProblem& a, const ContactProblem& b) {
  ASSERT_EQ(a.contacts.size(), b.contacts.size());
  for (std::size_t i = 0; i < a.contacts.size(); ++i) {
    EXPECT_EQ(a.contacts[i].n_t, b.contacts[i].n_t);
    EXPECT_EQ(a.contacts[i].mu, b.contacts[i].mu);
  }
  EXPECT_EQ((Matrix(sparse_matrix(a.G)) - Matrix(sparse_matrix(b.G))).norm(), 0);
  EXPECT_EQ((a.b - b.b).norm(), 0);
}

TEST_F(ContactFile, ReadsWhatItWrites) {
  for (const int n_t : {0, 1, 2}) {
    StoredContactProblem stored{.problem = random_problem(FrictionLaw::coulomb, 5, n_t, 9, 7),
                                .title = "five contacts",
                                .description = "random",
                                .math_info = "singular"};
    stored.solution = Vector::LinSpaced(stored.problem.G.n_rows(), 1, 2);
    stored.guess = 0.5 * stored.solution;
    const std::string file = path(std::to_string(n_t) + ".hdf5");
    write_contact_file(stored, file);
    EXPECT_FALSE(fs::exists(file + ".partial"));
    const StoredContactProblem read = read_contact_file(file);
    expect_same(stored.problem, read.problem);
    EXPECT_EQ((stored.solution - read.solution).norm(), 0);
    EXPECT_EQ((stored.guess - read.guess).norm(), 0);
    EXPECT_EQ(read.title, "five contacts");
    EXPECT_EQ(read.description, "random");
    EXPECT_EQ(read.math_info, "singular");
    EXPECT_THROW(write_contact_file(stored, file), InputError) << "it exists";
  }
}

/// A contact without friction beside one in the plane and one in space.
TEST_F(ContactFile, KeepsContactsOfDifferentKinds) {
  ContactProblem problem;
  Matrix G = Matrix::Identity(6, 6);
  G(0, 1) = G(1, 0) = 0.25;
  G(2, 4) = G(4, 2) = -0.5;
  set_operator(problem, G, {{.id = 0}, {.id = 1, .n_t = 1, .mu = 0.3}, {.id = 2, .n_t = 2, .mu = 0.6}});
  problem.b = Vector::LinSpaced(6, -1, 1);
  write_contact_file({.problem = problem}, path("mixed.hdf5"));
  const ContactProblem read = read_contact_file(path("mixed.hdf5")).problem;
  ASSERT_EQ(read.contacts.size(), 3u);
  EXPECT_EQ(read.contacts[0].n_t, 0);
  EXPECT_EQ(read.contacts[1].n_t, 2) << "in space, with a tangent that nothing moves";
  const auto solver = make_newton_contact_solver(1e-13, 100);
  const SolverAnswer ours = solve(*solver, problem), theirs = solve(*solver, read);
  ASSERT_EQ(theirs.status, ContactStatus::solved);
  EXPECT_NEAR(theirs.r[3], 0, 1e-15);
  for (const auto& [a, b] : {std::pair{0, 0}, {1, 1}, {2, 2}, {3, 4}, {4, 5}, {5, 6}})
    EXPECT_NEAR(ours.r[a], theirs.r[b], 1e-12) << "1e-13 of velocities of size 1";
}

TEST_F(ContactFile, HasNoWordsForOtherLaws) {
  ContactProblem convex = random_problem(FrictionLaw::associated, 2, 1, 6, 1);
  EXPECT_THROW(write_contact_file({.problem = convex}, path("convex.hdf5")), InputError);
  ContactProblem present = random_problem(FrictionLaw::coulomb, 2, 1, 6, 1);
  present.contacts[0].present = 1;
  EXPECT_THROW(write_contact_file({.problem = present}, path("present.hdf5")), InputError);
  EXPECT_THROW(write_contact_file({}, path("empty.hdf5")), InputError);
  EXPECT_TRUE(fs::is_empty(folder));
  EXPECT_THROW(write_contact_file({.problem = random_problem(FrictionLaw::coulomb, 2, 1, 6, 1)}, "/no/folder/x.hdf5"),
               InputError);
}

/// A group, and data sets in it, in the layout of FCLib's src/fclib.c.
struct Hdf5File {
  hid_t id;
  explicit Hdf5File(const std::string& path) : id(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    EXPECT_GE(id, 0);
  }
  ~Hdf5File() { H5Fclose(id); }
  void group(const std::string& name) const {
    H5Gclose(H5Gcreate2(id, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  }
  void put(const std::string& name, const std::vector<int>& values) const {
    const hsize_t n = values.size();
    EXPECT_GE(H5LTmake_dataset_int(id, name.c_str(), 1, &n, values.data()), 0) << name;
  }
  void put(const std::string& name, const std::vector<double>& values) const {
    const hsize_t n = values.size();
    EXPECT_GE(H5LTmake_dataset_double(id, name.c_str(), 1, &n, values.data()), 0) << name;
  }
  void matrix(const std::string& name, int m, int n, int nz, const std::vector<int>& p, const std::vector<int>& i,
              const std::vector<double>& x) const {
    group(name);
    put(name + "/nzmax", std::vector<int>{static_cast<int>(x.size())});
    put(name + "/m", std::vector<int>{m});
    put(name + "/n", std::vector<int>{n});
    put(name + "/nz", std::vector<int>{nz});
    put(name + "/p", p);
    put(name + "/i", i);
    put(name + "/x", x);
  }
  /// As triplets.
  void matrix(const std::string& name, const Matrix& full) const {
    std::vector<int> rows, columns;
    std::vector<double> values;
    for (int i = 0; i < full.rows(); ++i) {
      for (int j = 0; j < full.cols(); ++j) {
        if (full(i, j) == 0) continue;
        rows.push_back(i);
        columns.push_back(j);
        values.push_back(full(i, j));
      }
    }
    matrix(name, static_cast<int>(full.rows()), static_cast<int>(full.cols()), static_cast<int>(values.size()), rows,
           columns, values);
  }
  void put(const std::string& name, const Vector& values) const {
    put(name, std::vector<double>(values.begin(), values.end()));
  }
};

/// A file as FCLib writes it. W = [2 1; 1 3] of one contact in the plane.
struct FclibFile {
  int m = 2, n = 2, nz = -1, spacedim = 2;
  std::vector<int> p{0, 2, 4}, i{0, 1, 0, 1};
  std::vector<double> x{2, 1, 1, 3}, q{-1, 0.5}, mu{0.4};
  bool has_constraints = false;

  void write(const std::string& path) {
    const Hdf5File file(path);
    file.group("/fclib_local");
    file.put("/fclib_local/spacedim", std::vector<int>{spacedim});
    for (const char* name : {"/fclib_local/W", "/fclib_local/V", "/fclib_local/R"}) {
      file.matrix(name, m, n, nz, p, i, x);
      if (!has_constraints) break;
    }
    file.group("/fclib_local/vectors");
    file.put("/fclib_local/vectors/q", q);
    file.put("/fclib_local/vectors/mu", mu);
  }
};

TEST_F(ContactFile, ReadsEverySparseFormat) {
  const Matrix W{{2, 1}, {1.5, 3}};
  FclibFile columns, rows, triplets;
  columns.x = {2, 1.5, 1, 3};
  rows.nz = -2;
  rows.x = {2, 1, 1.5, 3};
  triplets.nz = 4;
  triplets.p = {1, 0, 0, 1};
  triplets.i = {1, 0, 1, 0};
  triplets.x = {3, 2, 1, 1.5};
  int number = 0;
  for (auto* file : {&columns, &rows, &triplets}) {
    const std::string name = path(std::to_string(number++) + ".hdf5");
    file->write(name);
    const ContactProblem problem = read_contact_file(name).problem;
    EXPECT_EQ((Matrix(sparse_matrix(problem.G)) - W).norm(), 0) << number;
    ASSERT_EQ(problem.contacts.size(), 1u);
    EXPECT_EQ(problem.contacts[0].mu, 0.4);
    EXPECT_EQ(problem.b[1], 0.5);
  }
}

/// The layout that FCLib's own reader asks for.
TEST_F(ContactFile, HasTheDataSetsOfFclib) {
  StoredContactProblem stored{.problem = random_problem(FrictionLaw::coulomb, 4, 2, 20, 3)};
  stored.solution = stored.guess = Vector::Ones(12);
  write_contact_file(stored, path("ours.hdf5"));
  const hid_t file = H5Fopen(path("ours.hdf5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  for (const char* name : {"/fclib_local/spacedim", "/fclib_local/W/nzmax", "/fclib_local/W/m", "/fclib_local/W/n",
                           "/fclib_local/W/nz", "/fclib_local/W/p", "/fclib_local/W/i", "/fclib_local/W/x",
                           "/fclib_local/vectors/q", "/fclib_local/vectors/mu", "/fclib_local/info/title",
                           "/solution/u", "/solution/r", "/guesses/number_of_guesses", "/guesses/1/u", "/guesses/1/r"})
    EXPECT_GT(H5Lexists(file, name, H5P_DEFAULT), 0) << name;
  H5Fclose(file);
}

/// M v = H r + G l + f, G'v + b = 0, u = H'v + w of three coordinates, one of which G prescribes.
TEST_F(ContactFile, ReadsGlobalProblems) {
  const Matrix M{{2, 0.5, 0}, {0.5, 1, 0.2}, {0, 0.2, 4}}, H{{1, 0}, {0.3, 1}, {-1, 2}}, G{{0}, {1}, {0.5}};
  const Vector f = Vector::LinSpaced(3, -1, 1), w = Vector::LinSpaced(2, 0.5, -0.25), b = Vector::Constant(1, 0.75);
  for (const bool is_constrained : {false, true}) {
    const std::string name = path(is_constrained ? "constrained.hdf5" : "free.hdf5");
    {
      const Hdf5File file(name);
      file.group("/fclib_global");
      file.put("/fclib_global/spacedim", std::vector<int>{2});
      file.matrix("/fclib_global/M", M);
      file.matrix("/fclib_global/H", H);
      if (is_constrained) file.matrix("/fclib_global/G", G);
      file.group("/fclib_global/vectors");
      file.put("/fclib_global/vectors/f", f);
      file.put("/fclib_global/vectors/w", w);
      file.put("/fclib_global/vectors/mu", std::vector<double>{0.4});
      if (is_constrained) file.put("/fclib_global/vectors/b", b);
      file.group("/solution");
      file.put("/solution/r", std::vector<double>{1, 0.25, 0});  // as long as H has rows: FCLib's own length
    }
    const StoredContactProblem stored = read_contact_file(name);
    ASSERT_EQ(stored.problem.contacts.size(), 1u);
    EXPECT_EQ(stored.problem.contacts[0].n_t, 1);
    // u for the impulses r, from the equations themselves
    for (const Vector& r : {Vector(Vector::Zero(2)), Vector(Vector::Unit(2, 0)), Vector(stored.solution)}) {
      Vector v = M.inverse() * (H * r + f);
      if (is_constrained) {
        const Vector push = M.inverse() * G.col(0);
        v -= push * ((G.col(0).dot(v) + b[0]) / G.col(0).dot(push));
      }
      Vector u(2);
      stored.problem.G.times(r, stored.problem.b, u);
      EXPECT_LE((u - (H.transpose() * v + w)).norm(), 1e-14) << "rounding of numbers of size 1";
    }
    EXPECT_EQ(stored.solution[1], 0.25);
  }
}

/// Puts another data set in the place of one, or nothing: what FCLib itself would not write.
void replace(const std::string& path, const std::string& name, const std::vector<double>& values, bool integers) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  EXPECT_GE(H5Ldelete(file, name.c_str(), H5P_DEFAULT), 0);
  const hsize_t n = values.size();
  const std::vector<int> whole(values.begin(), values.end());
  if (n > 0) {
    EXPECT_GE(integers ? H5LTmake_dataset_int(file, name.c_str(), 1, &n, whole.data())
                       : H5LTmake_dataset_double(file, name.c_str(), 1, &n, values.data()),
              0);
  }
  H5Fclose(file);
}

struct Replacement {
  std::string name;
  std::vector<double> values;
  bool integers = true;
};

/// Error texts name the data set.
TEST_F(ContactFile, SaysWhatIsWrong) {
  const auto expect_error = [&](FclibFile file, const std::string& part, const Replacement& other = {}) {
    static int number = 0;
    const std::string name = path("bad" + std::to_string(number++) + ".hdf5");
    file.write(name);
    if (!other.name.empty()) replace(name, other.name, other.values, other.integers);
    try {
      read_contact_file(name);
      ADD_FAILURE() << part;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  expect_error({.mu = {-0.4}}, "/fclib_local/vectors/mu: -0.4 of contact 0");
  expect_error({.mu = {std::nan("")}}, "/fclib_local/vectors/mu: finite numbers");
  expect_error({.i = {0, 1, 0, 7}}, "/fclib_local/W: entry 3 is at (7, 1) of 2 x 2");
  expect_error({.i = {0, -1, 0, 1}}, "/fclib_local/W: entry 1 is at (-1, 0)");
  expect_error({.p = {0, 3, 2}}, "/fclib_local/W/p: ascending");
  expect_error({.p = {1, 2, 4}}, "/fclib_local/W/p: 0");
  expect_error({.p = {0, 2, 9}}, "/fclib_local/W: 9 entries");
  expect_error({.x = {0, 1, 1, 3}}, "/fclib_local/W: 0 on the diagonal");
  expect_error({.has_constraints = true}, "/fclib_local/V: local problems with equality constraints");
  expect_error({}, "/fclib_local/spacedim: 4: 2 or 3", {"/fclib_local/spacedim", {4}});
  expect_error({}, "/fclib_local/W: 2 rows, no multiple of spacedim", {"/fclib_local/spacedim", {3}});
  expect_error({}, "/fclib_local/W: 3 x 2: a square matrix", {"/fclib_local/W/m", {3}});
  expect_error({}, "/fclib_local/W/nz: -2, -1", {"/fclib_local/W/nz", {-5}});
  expect_error({}, "/fclib_local/W/p: 3 are required", {"/fclib_local/W/p", {0, 4}});
  expect_error({}, "/fclib_local/vectors/q: 2 numbers", {"/fclib_local/vectors/q", {1, 2, 3}, false});
  expect_error({}, "/fclib_local/vectors/q: is missing", {"/fclib_local/vectors/q", {}});
  expect_error({}, "/fclib_local/vectors/mu: numbers are required", {"/fclib_local/vectors/mu", {1}});
  expect_error({.n = 0}, "/fclib_local/W: 2 x 0: rows and columns");
  expect_error({}, "/fclib_local: is missing", {"/fclib_local", {}});

  EXPECT_THROW(read_contact_file(path("missing.hdf5")), InputError);
  std::ofstream(path("text.hdf5")) << "no HDF5";
  EXPECT_THROW(read_contact_file(path("text.hdf5")), InputError);
}

#endif

}  // namespace
}  // namespace ricochet
