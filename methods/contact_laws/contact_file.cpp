// Contact problems as FCLib files, written and read through HDF5 itself: FCLib's reader ends the program where a file is
// not what it expects, and takes the lengths of vectors on trust.

#include "methods/contact_laws/contact_file.h"

#include <hdf5.h>
#include <hdf5_hl.h>

#include <Eigen/SparseLU>
#include <cmath>
#include <filesystem>

#include "methods/contact_laws/uniform_contacts.h"
#include "problems/input_error.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;

/// Data sets of an HDF5 file, each with the length that it has.
class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are ours to tell
    file_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file_ < 0) throw InputError("contact file", path, "a file in HDF5 is required");
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { H5Fclose(file_); }

  bool has(const std::string& name) const {
    for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
      if (H5Lexists(file_, name.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
      if (end == std::string::npos) return true;
    }
  }

  std::vector<int> integers(const std::string& name) const {
    std::vector<int> values(length(name, H5T_INTEGER, "integers are required"));
    if (H5LTread_dataset_int(file_, name.c_str(), values.data()) < 0) fail(name, "cannot be read");
    return values;
  }
  int integer(const std::string& name) const {
    const auto values = integers(name);
    if (values.size() != 1) fail(name, "one integer is required");
    return values.front();
  }
  /// @param n  how many there have to be
  Vector numbers(const std::string& name, std::size_t n) const {
    const Vector values = numbers(name);
    if (static_cast<std::size_t>(values.size()) != n) fail(name, fmt::format("{} numbers are required", n));
    return values;
  }
  Vector numbers(const std::string& name) const {
    Vector values(static_cast<Eigen::Index>(length(name, H5T_FLOAT, "numbers are required")));
    if (H5LTread_dataset_double(file_, name.c_str(), values.data()) < 0) fail(name, "cannot be read");
    if (!values.allFinite()) fail(name, "finite numbers are required");
    return values;
  }
  /// Empty where there is none.
  std::string text(const std::string& name) const {
    if (!has(name)) return {};
    hsize_t size[H5S_MAX_RANK];
    H5T_class_t kind;
    std::size_t bytes = 0;
    if (H5LTget_dataset_info(file_, name.c_str(), size, &kind, &bytes) < 0 || kind != H5T_STRING) return {};
    std::string value(bytes + 1, '\0');
    if (H5LTread_dataset_string(file_, name.c_str(), value.data()) < 0) return {};
    return value.c_str();
  }

  [[noreturn]] void fail(const std::string& name, const std::string& why) const {
    throw InputError(fmt::format("contact file {}: {}: {}", path_, name, why));
  }

 private:
  std::size_t length(const std::string& name, H5T_class_t kind, const char* required) const {
    if (!has(name)) fail(name, "is missing");
    int rank = 0;
    hsize_t size[H5S_MAX_RANK];
    H5T_class_t found;
    std::size_t bytes = 0;
    if (H5LTget_dataset_ndims(file_, name.c_str(), &rank) < 0 ||
        H5LTget_dataset_info(file_, name.c_str(), size, &found, &bytes) < 0 || found != kind)
      fail(name, required);
    std::size_t n = 1;
    for (int d = 0; d < rank; ++d) n *= size[d];
    return n;
  }

  std::string path_;
  hid_t file_;
};

/// A sparse matrix: nz entries as triplets, or with nz = -1 in compressed columns, -2 in compressed rows.
SparseMatrix read_matrix(const Reader& file, const std::string& name) {
  const int m = file.integer(name + "/m"), n = file.integer(name + "/n"), nz = file.integer(name + "/nz");
  if (m <= 0 || n <= 0) file.fail(name, fmt::format("{} x {}: rows and columns are required", m, n));
  const auto p = file.integers(name + "/p"), i = file.integers(name + "/i");
  const Vector x = file.numbers(name + "/x");
  if (nz < -2) file.fail(name + "/nz", "-2, -1 or a number of triplets is required");
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, int at) {
    if (row < 0 || row >= m || column < 0 || column >= n)
      file.fail(name, fmt::format("entry {} is at ({}, {}) of {} x {}", at, row, column, m, n));
    entries.emplace_back(row, column, x[at]);
  };
  const auto check_length = [&](int count) {
    if (count > static_cast<int>(i.size()) || count > x.size())
      file.fail(name, fmt::format("{} entries, but {} indices and {} values", count, i.size(), x.size()));
  };
  if (nz >= 0) {
    check_length(nz);
    if (nz > static_cast<int>(p.size())) file.fail(name + "/p", fmt::format("{} row indices are required", nz));
    for (int k = 0; k < nz; ++k) add(p[k], i[k], k);
  } else {
    const int lines = nz == -1 ? n : m;
    if (p.size() != static_cast<std::size_t>(lines) + 1)
      file.fail(name + "/p", fmt::format("{} are required", lines + 1));
    if (p.front() != 0) file.fail(name + "/p", "0 is required at the front");
    check_length(p.back());
    for (int line = 0; line < lines; ++line) {
      if (p[line + 1] < p[line] || p[line + 1] > p.back()) file.fail(name + "/p", "ascending numbers are required");
      for (int k = p[line]; k < p[line + 1]; ++k) {
        if (nz == -1)
          add(i[k], line, k);
        else
          add(line, i[k], k);
      }
    }
  }
  SparseMatrix matrix(m, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

SparseMatrix read_square_matrix(const Reader& file, const std::string& name) {
  SparseMatrix matrix = read_matrix(file, name);
  if (matrix.rows() != matrix.cols())
    file.fail(name, fmt::format("{} x {}: a square matrix is required", matrix.rows(), matrix.cols()));
  return matrix;
}

/// u = W r + q
struct LocalForm {
  SparseMatrix W;
  Vector q;
};

LocalForm read_local_form(const Reader& file) {
  for (const char* name : {"/fclib_local/V", "/fclib_local/R"}) {
    if (file.has(name)) file.fail(name, "local problems with equality constraints are not read");
  }
  LocalForm local{.W = read_square_matrix(file, "/fclib_local/W"), .q = {}};
  local.q = file.numbers("/fclib_local/vectors/q", local.W.rows());
  return local;
}

/// The global problem, velocities v and multipliers l eliminated:
///
///   M v = H r + G l + f,   G'v + b = 0,   u = H'v + w                                               (1)
///   K = (M -G; G' 0),   W = (H' 0) K^-1 (H; 0),   q = (H' 0) K^-1 (f; -b) + w                       (2)
LocalForm read_global_form(const Reader& file) {
  const SparseMatrix M = read_square_matrix(file, "/fclib_global/M"), H = read_matrix(file, "/fclib_global/H");
  const Eigen::Index n = M.rows(), m = H.cols();
  if (H.rows() != n) file.fail("/fclib_global/H", fmt::format("{} rows, {} are required", H.rows(), n));
  const Vector f = file.numbers("/fclib_global/vectors/f", n), w = file.numbers("/fclib_global/vectors/w", m);
  SparseMatrix G(n, 0);
  Vector b(0);
  if (file.has("/fclib_global/G")) {
    G = read_matrix(file, "/fclib_global/G");
    if (G.rows() != n) file.fail("/fclib_global/G", fmt::format("{} rows, {} are required", G.rows(), n));
    b = file.numbers("/fclib_global/vectors/b", G.cols());
  }
  const Eigen::Index size = n + G.cols();
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](const SparseMatrix& matrix, const auto& place) {
    for (int column = 0; column < matrix.outerSize(); ++column) {
      for (SparseMatrix::InnerIterator entry(matrix, column); entry; ++entry) place(entry);
    }
  };
  add(M, [&](const auto& e) { entries.emplace_back(e.row(), e.col(), e.value()); });
  add(G, [&](const auto& e) {
    entries.emplace_back(e.row(), n + e.col(), -e.value());
    entries.emplace_back(n + e.col(), e.row(), e.value());
  });
  SparseMatrix K(size, size), directions(size, m);
  K.setFromTriplets(entries.begin(), entries.end());
  entries.clear();
  add(H, [&](const auto& e) { entries.emplace_back(e.row(), e.col(), e.value()); });
  directions.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<SparseMatrix> lu(K);
  if (lu.info() != Eigen::Success)
    file.fail("/fclib_global/M", "a matrix is required that is regular with the constraints G");
  const SparseMatrix responses = lu.solve(directions);
  Vector right(size);
  right << f, -b;
  const Vector free = lu.solve(right);
  return {.W = directions.transpose() * responses, .q = directions.transpose() * free + w};  // (2)
}

/// r of a solution. FCLib writes that of a global problem as long as H has rows.
Vector read_impulses(const Reader& file, const std::string& name, Eigen::Index m, bool is_global) {
  const Vector r = file.numbers(name);
  if (r.size() != m && !(is_global && r.size() > m)) file.fail(name, fmt::format("{} numbers are required", m));
  return r.head(m);
}

}  // namespace

void require_contact_files() {}

StoredContactProblem read_contact_file(const std::string& path) {
  if (!fs::exists(path)) throw InputError("contact file", path, "it does not exist");
  const Reader file(path);
  const bool is_global = file.has("/fclib_global");
  const std::string group = is_global ? "/fclib_global" : "/fclib_local";
  if (!file.has(group)) file.fail("/fclib_local", "is missing, and /fclib_global is: this is no file of FCLib");
  const int spacedim = file.integer(group + "/spacedim");
  if (spacedim != 2 && spacedim != 3) file.fail(group + "/spacedim", fmt::format("{}: 2 or 3", spacedim));
  const LocalForm local = is_global ? read_global_form(file) : read_local_form(file);
  const SparseMatrix& W = local.W;
  const std::string name_of_W = is_global ? "/fclib_global/H'M^-1 H" : "/fclib_local/W";
  const int m = static_cast<int>(W.rows());
  if (m % spacedim != 0) file.fail(name_of_W, fmt::format("{} rows, no multiple of spacedim", m));
  const Vector mu = file.numbers(group + "/vectors/mu", m / spacedim);

  StoredContactProblem stored;
  stored.title = file.text(group + "/info/title");
  stored.description = file.text(group + "/info/description");
  stored.math_info = file.text(group + "/info/math_info");
  ContactProblem& problem = stored.problem;
  std::vector<int> sizes;
  const Vector diagonal = W.diagonal();
  for (int i = 0; i < mu.size(); ++i) {
    if (!(mu[i] >= 0)) file.fail(group + "/vectors/mu", fmt::format("{} of contact {}: >= 0", mu[i], i));
    problem.contacts.push_back({.id = i, .n_t = mu[i] > 0 ? spacedim - 1 : 0, .mu = mu[i]});
    sizes.push_back(1 + problem.contacts.back().n_t);
    for (int d = 0; d < sizes.back(); ++d) {
      const double entry = diagonal[i * spacedim + d];
      if (!(entry > 0)) file.fail(name_of_W, fmt::format("{} on the diagonal, contact {}: > 0", entry, i));
    }
  }
  std::vector<int> rows;  // of each row of W, that of the problem, or -1
  int n = 0;
  for (const int size : sizes) {
    for (int d = 0; d < spacedim; ++d) rows.push_back(d < size ? n++ : -1);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < m; ++column) {
    for (SparseMatrix::InnerIterator entry(W, column); entry; ++entry) {
      if (rows[entry.row()] >= 0 && rows[column] >= 0)
        entries.emplace_back(rows[entry.row()], rows[column], entry.value());
    }
  }
  const auto problem_rows = [&](const Vector& all) {
    Vector x(n);
    for (int k = 0; k < m; ++k) {
      if (rows[k] >= 0) x[rows[k]] = all[k];
    }
    return x;
  };
  SparseMatrix G(n, n);
  G.setFromTriplets(entries.begin(), entries.end());
  set_operator(problem.G, sizes, G);
  problem.b = problem_rows(local.q);
  if (file.has("/solution/r")) stored.solution = problem_rows(read_impulses(file, "/solution/r", m, is_global));
  if (file.has("/guesses/1/r")) stored.guess = problem_rows(read_impulses(file, "/guesses/1/r", m, is_global));
  return stored;
}

namespace {

/// A new HDF5 file: groups and data sets, the first failure of which is kept.
class Writer {
 public:
  explicit Writer(const std::string& path)
      : file_(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)), ok_(file_ >= 0) {}
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() {
    if (file_ >= 0) H5Fclose(file_);
  }

  /// @return all data sets are in the file
  bool close() {
    if (file_ >= 0 && H5Fclose(file_) < 0) ok_ = false;
    file_ = -1;
    return ok_;
  }

  void group(const std::string& name) {
    const hid_t id = ok_ ? H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT) : -1;
    ok_ = id >= 0 && H5Gclose(id) >= 0;
  }
  void integers(const std::string& name, const int* values, std::size_t n) {
    const hsize_t size = n;
    ok_ = ok_ && H5LTmake_dataset_int(file_, name.c_str(), 1, &size, values) >= 0;
  }
  void integer(const std::string& name, int value) { integers(name, &value, 1); }
  void numbers(const std::string& name, const double* values, std::size_t n) {
    const hsize_t size = n;
    ok_ = ok_ && H5LTmake_dataset_double(file_, name.c_str(), 1, &size, values) >= 0;
  }
  void numbers(const std::string& name, const Vector& values) {
    numbers(name, values.data(), static_cast<std::size_t>(values.size()));
  }
  void text(const std::string& name, const std::string& value) {
    ok_ = ok_ && H5LTmake_dataset_string(file_, name.c_str(), value.c_str()) >= 0;
  }

  /// In compressed columns.
  void matrix(const std::string& name, const SparseMatrix& matrix) {
    const auto nonzeros = static_cast<std::size_t>(matrix.nonZeros());
    group(name);
    integer(name + "/nzmax", static_cast<int>(nonzeros));
    integer(name + "/m", static_cast<int>(matrix.rows()));
    integer(name + "/n", static_cast<int>(matrix.cols()));
    integer(name + "/nz", -1);
    integers(name + "/p", matrix.outerIndexPtr(), static_cast<std::size_t>(matrix.cols()) + 1);
    integers(name + "/i", matrix.innerIndexPtr(), nonzeros);
    numbers(name + "/x", matrix.valuePtr(), nonzeros);
  }

 private:
  hid_t file_;
  bool ok_;
};

}  // namespace

void write_contact_file(const StoredContactProblem& stored, const std::string& path) {
  if (stored.problem.contacts.empty()) throw InputError("contact file", path, "the problem has no contact");
  const UniformContacts uniform(stored.problem, 2);
  if (fs::exists(path)) throw InputError("contact file", path, "it exists; a new file is required");
  const std::string partial = path + ".partial";
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  Writer file(partial);
  file.group("/fclib_local");
  file.integer("/fclib_local/spacedim", uniform.dimension);
  file.matrix("/fclib_local/W", uniform.W);
  file.group("/fclib_local/vectors");
  file.numbers("/fclib_local/vectors/q", uniform.q);
  file.numbers("/fclib_local/vectors/mu", uniform.mu);
  file.group("/fclib_local/info");
  file.text("/fclib_local/info/title", stored.title);
  file.text("/fclib_local/info/description", stored.description);
  file.text("/fclib_local/info/math_info", stored.math_info);
  const auto impulses = [&](const std::string& group, const Vector& of_problem) {
    const Vector r = uniform.pack(of_problem), u = uniform.W * r + uniform.q;
    file.group(group);
    file.numbers(group + "/u", u);
    file.numbers(group + "/r", r);
  };
  if (stored.solution.size() > 0) impulses("/solution", stored.solution);
  if (stored.guess.size() > 0) {
    file.group("/guesses");
    file.integer("/guesses/number_of_guesses", 1);
    impulses("/guesses/1", stored.guess);
  }
  std::error_code error;
  const bool ok = file.close();
  if (ok) fs::rename(partial, path, error);
  if (ok && !error) return;
  fs::remove(partial, error);
  throw InputError("contact file", path, "cannot be written");
}

}  // namespace ricochet
