#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "problems/problem.h"

namespace ricochet {

/// Whether a tableau file has the second solution of an embedded pair, "b_hat" or "e".
/// @throws InputError when the file cannot be opened or is no JSON
bool is_pair_file(const std::string& path);

/// JSON file of a tableau. Numbers may be exact expressions in quotes, "1/4-sqrt(3)/6". Every accessor throws an
/// InputError with the file, the field, its value and what is required.
class TableauFile {
 public:
  /// @throws InputError when the file cannot be opened or is no JSON object, a required field is missing, or it has
  /// fields other than those and `optional`
  TableauFile(const std::string& path, const std::set<std::string>& required, const std::set<std::string>& optional);

  bool has(const std::string& key) const { return json_.contains(key); }

  /// "PATH: key", as errors name it.
  std::string field(const std::string& key) const { return path_ + ": " + key; }

  std::string text(const std::string& key, const std::string& otherwise) const;

  /// The number of weights b, at least 1.
  int stages() const;

  Vector vector(const std::string& key, int size) const;
  Matrix square_matrix(const std::string& key, int size) const;

  /// The field c, which must be the row sums of A within the tolerance; these where there is no c.
  Vector abscissae(const Matrix& A, double tolerance) const;

  /// The stated order, at least 1 and at most the one that the order conditions confirm; the latter where none is
  /// stated.
  int order(const std::string& key, int confirmed) const;

 private:
  std::string path_;
  nlohmann::json json_;
};

}  // namespace ricochet
