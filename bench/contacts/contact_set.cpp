#include "bench/contacts/contact_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "methods/contact_laws/delassus_matrix.h"
#include "problems/input_error.h"
#include "problems/input_text.h"

namespace ricochet {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

[[noreturn]] void refuse(const std::string& where, const std::string& field, const std::string& why) {
  throw InputError(fmt::format("{}: {}: {}", where, field, why));
}

double number_of(const json& value, const std::string& where, const std::string& field) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) refuse(where, field, "a finite number is required");
  return value.get<double>();
}

int whole_of(const json& value, int low, int high, const std::string& where, const std::string& field) {
  if (!value.is_number_integer() || value < low || value > high)
    refuse(where, field, fmt::format("a whole number from {} to {} is required", low, high));
  return value.get<int>();
}

/// @param n  how many there have to be
Vector vector_of(const json& document, const char* field, Eigen::Index n, const std::string& where) {
  const json& values = document.at(field);
  if (!values.is_array() || static_cast<Eigen::Index>(values.size()) != n)
    refuse(where, field, fmt::format("{} numbers are required", n));
  Vector x(n);
  for (Eigen::Index k = 0; k < n; ++k) x[k] = number_of(values[k], where, fmt::format("{}[{}]", field, k));
  return x;
}

json list_of(const Vector& x) {
  return std::vector<double>(x.begin(), x.end());
}

bool is_text(const fs::path& path) {
  return path.extension() == ".json" || path.extension() == ".jsonl";
}

std::vector<StoredContactProblem> read_file(const fs::path& path) {
  std::vector<StoredContactProblem> problems;
  if (!is_text(path)) {
    problems.push_back(read_contact_file(path.string()));
  } else {
    std::istringstream lines(read_input_text(path.string(), "contact file"));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      const std::string where = fmt::format("{}, line {}", path.string(), number);
      problems.push_back(read_contact_problem(parse_input_json(line, where), where));
    }
  }
  for (std::size_t k = 0; k < problems.size(); ++k) {
    if (problems[k].title.empty())
      problems[k].title = problems.size() == 1 ? path.string() : fmt::format("{}:{}", path.string(), k + 1);
  }
  return problems;
}

constexpr int kMostRows = 30000;

}  // namespace

json contact_problem_json(const StoredContactProblem& stored) {
  const ContactProblem& problem = stored.problem;
  json document = {{"title", stored.title},
                   {"law", problem.law == FrictionLaw::coulomb ? "coulomb" : "associated"},
                   {"contacts", json::array()},
                   {"G", json::array()},
                   {"b", list_of(problem.b.head(problem.G.n_rows()))}};
  for (const auto& contact : problem.contacts) {
    json& entry = document["contacts"].emplace_back(json{{"id", contact.id}, {"n_t", contact.n_t}, {"mu", contact.mu}});
    if (contact.present != 0) entry["present"] = contact.present;
  }
  const SparseMatrix G = sparse_matrix(problem.G);
  for (int column = 0; column < G.outerSize(); ++column) {
    for (SparseMatrix::InnerIterator entry(G, column); entry; ++entry)
      document["G"].push_back({entry.row(), column, entry.value()});
  }
  if (stored.solution.size() > 0) document["solution"] = list_of(stored.solution);
  if (stored.guess.size() > 0) document["guess"] = list_of(stored.guess);
  return document;
}

StoredContactProblem read_contact_problem(const json& document, const std::string& where) {
  if (!document.is_object()) refuse(where, "contact problem", "an object is required");
  for (const auto& [field, value] : document.items()) {
    static const std::vector<std::string> known = {"title", "law", "contacts", "G", "b", "solution", "guess"};
    if (std::ranges::find(known, field) == known.end()) refuse(where, field, "no field of a contact problem");
  }
  for (const char* field : {"law", "contacts", "G", "b"}) {
    if (!document.contains(field)) refuse(where, field, "is missing");
  }
  StoredContactProblem stored;
  if (document.contains("title")) {
    if (!document["title"].is_string()) refuse(where, "title", "a text is required");
    stored.title = document["title"];
  }
  ContactProblem& problem = stored.problem;
  if (document["law"] != "coulomb" && document["law"] != "associated")
    refuse(where, "law", "coulomb or associated is required");
  problem.law = document["law"] == "coulomb" ? FrictionLaw::coulomb : FrictionLaw::associated;
  const json& contacts = document["contacts"];
  if (!contacts.is_array() || contacts.empty() || contacts.size() > kMostRows / 3)
    refuse(where, "contacts", fmt::format("a list of 1 to {} is required", kMostRows / 3));
  std::vector<int> sizes;
  int n = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const std::string field = fmt::format("contacts[{}]", i);
    const json& entry = contacts[i];
    if (!entry.is_object() || !entry.contains("n_t") || !entry.contains("mu"))
      refuse(where, field, "an object with n_t and mu is required");
    ContactProblem::Contact contact{.id = static_cast<int>(i)};
    if (entry.contains("id")) contact.id = whole_of(entry["id"], 0, 1'000'000'000, where, field + ".id");
    contact.n_t = whole_of(entry["n_t"], 0, 2, where, field + ".n_t");
    contact.mu = number_of(entry["mu"], where, field + ".mu");
    if (entry.contains("present")) contact.present = number_of(entry["present"], where, field + ".present");
    if (!(contact.mu >= 0)) refuse(where, field + ".mu", ">= 0 is required");
    if (!(contact.present >= 0)) refuse(where, field + ".present", ">= 0 is required");
    if (contact.present > 0 && problem.law == FrictionLaw::associated)
      refuse(where, field + ".present", "0 is required with the associated law");
    problem.contacts.push_back(contact);
    sizes.push_back(1 + contact.n_t);
    n += sizes.back();
  }
  if (!document["G"].is_array()) refuse(where, "G", "a list of [row, column, value] is required");
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < document["G"].size(); ++k) {
    const std::string field = fmt::format("G[{}]", k);
    const json& entry = document["G"][k];
    if (!entry.is_array() || entry.size() != 3) refuse(where, field, "[row, column, value] is required");
    entries.emplace_back(whole_of(entry[0], 0, n - 1, where, field + "[0]"),
                         whole_of(entry[1], 0, n - 1, where, field + "[1]"), number_of(entry[2], where, field + "[2]"));
  }
  SparseMatrix G(n, n);
  G.setFromTriplets(entries.begin(), entries.end());
  for (int k = 0; k < n; ++k) {
    if (!(G.coeff(k, k) > 0)) refuse(where, "G", fmt::format("row {} has {} on the diagonal: > 0", k, G.coeff(k, k)));
  }
  set_operator(problem.G, sizes, G);
  problem.b = vector_of(document, "b", n, where);
  if (document.contains("solution")) stored.solution = vector_of(document, "solution", n, where);
  if (document.contains("guess")) stored.guess = vector_of(document, "guess", n, where);
  return stored;
}

std::vector<StoredContactProblem> read_contact_problems(const std::string& path) {
  if (!fs::is_directory(path)) return read_file(path);
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(path)) {
    const auto& file = entry.path();
    if (entry.is_regular_file() && (is_text(file) || file.extension() == ".hdf5" || file.extension() == ".h5"))
      files.push_back(file);
  }
  std::ranges::sort(files);
  std::vector<StoredContactProblem> problems;
  for (const auto& file : files) std::ranges::move(read_file(file), std::back_inserter(problems));
  if (problems.empty())
    throw InputError("contact files", path, "a directory with files .json, .jsonl, .hdf5 or .h5 is required");
  return problems;
}

}  // namespace ricochet
