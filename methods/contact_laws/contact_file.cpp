// Contact problems as FCLib files: written by FCLib, read through HDF5 itself. FCLib's reader ends the program where a
// file is not what it expects, and takes the lengths of vectors on trust.

#include "methods/contact_laws/contact_file.h"

#include <hdf5.h>
#include <hdf5_hl.h>
extern "C" {  // a header of C that does not say so
#include <fclib.h>
}

#include <cmath>
#include <filesystem>
#include <fstream>

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

/// The square matrix W: nz entries as triplets, or with nz = -1 in compressed columns, -2 in compressed rows.
SparseMatrix read_matrix(const Reader& file, const std::string& name) {
  const int m = file.integer(name + "/m"), n = file.integer(name + "/n"), nz = file.integer(name + "/nz");
  if (m <= 0 || m != n) file.fail(name, fmt::format("{} x {}: a square matrix is required", m, n));
  const auto p = file.integers(name + "/p"), i = file.integers(name + "/i");
  const Vector x = file.numbers(name + "/x");
  if (nz < -2) file.fail(name + "/nz", "-2, -1 or a number of triplets is required");
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, int at) {
    if (row < 0 || row >= m || column < 0 || column >= m)
      file.fail(name, fmt::format("entry {} is at ({}, {}) of {} x {}", at, row, column, m, m));
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
    if (p.size() != static_cast<std::size_t>(m) + 1) file.fail(name + "/p", fmt::format("{} are required", m + 1));
    if (p.front() != 0) file.fail(name + "/p", "0 is required at the front");
    check_length(p.back());
    for (int line = 0; line < m; ++line) {
      if (p[line + 1] < p[line] || p[line + 1] > p.back()) file.fail(name + "/p", "ascending numbers are required");
      for (int k = p[line]; k < p[line + 1]; ++k) {
        if (nz == -1)
          add(i[k], line, k);
        else
          add(line, i[k], k);
      }
    }
  }
  SparseMatrix matrix(m, m);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

void require_contact_files() {}

StoredContactProblem read_contact_file(const std::string& path) {
  if (!fs::exists(path)) throw InputError("contact file", path, "it does not exist");
  const Reader file(path);
  if (!file.has("/fclib_local")) {
    file.fail("/fclib_local", file.has("/fclib_global") ? "is missing: this is a global problem, local ones are read"
                                                        : "is missing: this is no file of FCLib");
  }
  for (const char* name : {"/fclib_local/V", "/fclib_local/R"}) {
    if (file.has(name)) file.fail(name, "problems with equality constraints are not read");
  }
  const int spacedim = file.integer("/fclib_local/spacedim");
  if (spacedim != 2 && spacedim != 3) file.fail("/fclib_local/spacedim", fmt::format("{}: 2 or 3", spacedim));
  const SparseMatrix W = read_matrix(file, "/fclib_local/W");
  const int m = static_cast<int>(W.rows());
  if (m % spacedim != 0) file.fail("/fclib_local/W", fmt::format("{} rows, no multiple of spacedim", m));
  const Vector q = file.numbers("/fclib_local/vectors/q", m);
  const Vector mu = file.numbers("/fclib_local/vectors/mu", m / spacedim);

  StoredContactProblem stored;
  stored.title = file.text("/fclib_local/info/title");
  stored.description = file.text("/fclib_local/info/description");
  stored.math_info = file.text("/fclib_local/info/math_info");
  ContactProblem& problem = stored.problem;
  std::vector<int> sizes;
  const Vector diagonal = W.diagonal();
  for (int i = 0; i < mu.size(); ++i) {
    if (!(mu[i] >= 0)) file.fail("/fclib_local/vectors/mu", fmt::format("{} of contact {}: >= 0", mu[i], i));
    problem.contacts.push_back({.id = i, .n_t = mu[i] > 0 ? spacedim - 1 : 0, .mu = mu[i]});
    sizes.push_back(1 + problem.contacts.back().n_t);
    for (int d = 0; d < sizes.back(); ++d) {
      const double entry = diagonal[i * spacedim + d];
      if (!(entry > 0)) file.fail("/fclib_local/W", fmt::format("{} on the diagonal, contact {}: > 0", entry, i));
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
  problem.b = problem_rows(q);
  if (file.has("/solution/r")) stored.solution = problem_rows(file.numbers("/solution/r", m));
  if (file.has("/guesses/1/r")) stored.guess = problem_rows(file.numbers("/guesses/1/r", m));
  return stored;
}

void write_contact_file(const StoredContactProblem& stored, const std::string& path) {
  if (stored.problem.contacts.empty()) throw InputError("contact file", path, "the problem has no contact");
  UniformContacts uniform(stored.problem, 2);
  if (fs::exists(path)) throw InputError("contact file", path, "it exists; a new file is required");
  SparseMatrix& W = uniform.W;
  fclib_matrix matrix{.nzmax = static_cast<int>(W.nonZeros()),
                      .m = static_cast<int>(W.rows()),
                      .n = static_cast<int>(W.cols()),
                      .p = W.outerIndexPtr(),
                      .i = W.innerIndexPtr(),
                      .x = W.valuePtr(),
                      .nz = -1,
                      .info = nullptr};
  std::string title = stored.title, description = stored.description, math_info = stored.math_info;
  fclib_info info{.title = title.data(), .description = description.data(), .math_info = math_info.data()};
  fclib_local local{.W = &matrix,
                    .V = nullptr,
                    .R = nullptr,
                    .mu = uniform.mu.data(),
                    .q = uniform.q.data(),
                    .s = nullptr,
                    .spacedim = uniform.dimension,
                    .info = &info};
  const auto with_velocities = [&](Vector& r, Vector& u) {
    u = W * r + uniform.q;
    return fclib_solution{.v = nullptr, .u = u.data(), .r = r.data(), .l = nullptr};
  };

  const std::string partial = path + ".partial";  // FCLib would write into a file that exists
  if (!std::ofstream(partial, std::ios::trunc)) throw InputError("contact file", path, "cannot be written");
  fs::remove(partial);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  bool ok = fclib_write_local(&local, partial.c_str()) == 1;
  if (ok && stored.solution.size() > 0) {
    Vector r = uniform.pack(stored.solution), u;
    fclib_solution solution = with_velocities(r, u);
    ok = fclib_write_solution(&solution, partial.c_str()) == 1;
  }
  if (ok && stored.guess.size() > 0) {
    Vector r = uniform.pack(stored.guess), u;
    fclib_solution guess = with_velocities(r, u);
    ok = fclib_write_guesses(1, &guess, partial.c_str()) == 1;
  }
  std::error_code error;
  if (ok) fs::rename(partial, path, error);
  if (ok && !error) return;
  fs::remove(partial, error);
  throw InputError("contact file", path, "cannot be written");
}

}  // namespace ricochet
