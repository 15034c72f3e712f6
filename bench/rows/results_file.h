#pragma once

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/rows/shard.h"
#include "reports/results.h"

namespace ricochet {

/// Results of one experiment, written row by row. During the run the file is called FILE.partial; it is renamed after
/// the last line, so that a file without this suffix is complete. Results of another build or experiment are kept with
/// a date in their name.
///
/// The partial file is locked while rows are written, so that two processes do not write the same results.
///
/// A study makes its rows in a fixed order. An interrupted run can therefore be continued: rows that are in the file
/// are returned instead of made again.
class ResultsFile {
 public:
  /// Makes the next row of a piece, or reuses it. @param how  function that makes the row
  template <class Row>
  using NextRow = std::function<Row(const std::function<Row()>& how)>;

  /// Nothing is written before the first row, so that an experiment with a mistake leaves no file.
  /// @param header  with "key": rows can be reused if the keys are equal
  /// @param force  no row is reused
  /// @throws InputError if another process is writing them
  ResultsFile(const std::string& folder, const std::string& name, nlohmann::json header, bool force = false);
  ~ResultsFile();
  ResultsFile(const ResultsFile&) = delete;
  ResultsFile& operator=(const ResultsFile&) = delete;

  /// A sentence on rows that are reused or files that are renamed; empty if no results existed.
  const std::string& message() const { return message_; }
  const std::string& path() const { return path_; }
  /// Whether all rows exist already.
  bool is_complete() const { return is_complete_; }
  /// The header; a study may add fields before its first row.
  nlohmann::json& header() { return header_; }

  /// The next row, reused or made. @param make  function that makes the row
  /// A shard makes rows before its pieces, which may depend on them, but only the merge writes them.
  /// @throws InputError if the file cannot be written
  /// @throws ShardIsMade after the pieces of a shard
  template <class Row, class Make>
  Row row(const Make& make) {
    if (!is_written_here()) return make();
    if (can_take(Row::kKind, 1)) return taken_[next_++].second.get<Row>();
    Row made = make();
    append(line_of(made));
    return made;
  }

  /// The next n rows of one session, such as times that are compared with each other: either all of them are reused, or
  /// all are made. @param make  function that makes n rows
  template <class Row, class Make>
  std::vector<Row> rows(std::size_t n, const Make& make) {
    if (!is_written_here()) return make();
    std::vector<Row> list;
    if (can_take(Row::kKind, n)) {
      for (std::size_t k = 0; k < n; ++k) list.push_back(taken_[next_++].second.get<Row>());
      return list;
    }
    list = make();
    for (const Row& made : list) append(line_of(made));
    return list;
  }

  /// Thrown by row() and rows() after the pieces of a shard, which has no more rows.
  struct ShardIsMade {};

  /// Makes rows in independent pieces 0, ..., n - 1, possibly in several processes; the file is the same, to the last
  /// digit. Reused rows are read by this process. May be called again for rows that do not depend on the first ones;
  /// the numbers of pieces continue.
  /// @param make  make(piece, next) makes any number of rows, each by next(how); in another process it has no other
  ///              effect
  /// @param done  called with each piece, in their order
  /// @returns the rows; for a shard its own
  /// @throws std::runtime_error if another process crashes or throws
  template <class Row>
  std::vector<Row> pieces(std::size_t n, const std::function<void(std::size_t piece, const NextRow<Row>& next)>& make,
                          const std::function<void(std::size_t piece)>& done) {
    std::vector<Row> list;
    std::vector<std::size_t> todo;
    for (std::size_t piece = 0; piece < n; ++piece) {
      if (shard_.has(first_piece_ + piece)) todo.push_back(piece);
    }
    std::size_t k = 0;
    for (; k < todo.size() && (processes_ == 1 || next_ < taken_.size() || shards_); ++k) {
      const std::size_t piece = todo[k];
      const NextRow<Row> here = [&](const auto& how) { return list.emplace_back(row_of<Row>(piece, how)); };
      if (!shards_) {
        make(piece, here);
      } else {
        for (const nlohmann::json& line : lines_in_shards(piece)) here([&] { return line.get<Row>(); });
      }
      done(piece);
    }
    const auto lines_of_piece = [&](std::size_t piece) {
      std::string lines;
      make(piece, [&](const auto& how) {
        Row made = how();
        lines += line_in_piece(piece, made).dump() + "\n";
        return made;
      });
      return lines;
    };
    make_elsewhere(
        {todo.begin() + static_cast<std::ptrdiff_t>(k), todo.end()}, lines_of_piece,
        [&](const nlohmann::json& line) { list.push_back(line.get<Row>()); }, done);
    first_piece_ += n;
    return list;
  }

  /// Like pieces(), with one row per piece. @param make  make(piece) returns the row
  template <class Row>
  std::vector<Row> each(std::size_t n, const std::function<Row(std::size_t piece)>& make,
                        const std::function<void(std::size_t piece)>& done) {
    return pieces<Row>(
        n, [&](std::size_t piece, const NextRow<Row>& next) { next([&] { return make(piece); }); }, done);
  }

  /// The same for pieces whose rows belong to one session, as those of rows().
  /// @param n_rows  number of rows of a piece  @param make  make(piece) returns the rows
  template <class Row>
  std::vector<Row> sessions(std::size_t n, const std::function<std::size_t(std::size_t piece)>& n_rows,
                            const std::function<std::vector<Row>(std::size_t piece)>& make,
                            const std::function<void(std::size_t piece)>& done) {
    const auto make_piece = [&](std::size_t piece, const NextRow<Row>& next) {
      const std::size_t rows = n_rows(piece);
      const std::vector<Row> made = can_take(Row::kKind, rows) ? std::vector<Row>(rows) : make(piece);
      for (const Row& row : made) next([&] { return row; });
    };
    return pieces<Row>(n, make_piece, done);
  }

  /// Number of processes for pieces() (default: this one only). @param n  >= 1
  void set_processes(int n) { processes_ = n; }

  /// Makes only the pieces of the shard; each row then contains the number of its piece.
  void set_shard(Shard shard) { shard_ = shard; }

  /// Rows of all pieces(), which are then not made.
  void set_shards(ShardRows rows) { shards_ = std::move(rows); }

  /// Function that is called with each new row before it is written.
  void set_observer(std::function<void(const nlohmann::json& line)> observer) { observer_ = std::move(observer); }

  /// Writes the last line and renames the file.
  void finish();

 private:
  /// Whether the next n lines of the interrupted run are of this kind. If not, the rest of that run is discarded.
  bool can_take(const std::string& kind, std::size_t n);
  void append(const nlohmann::json& line);
  /// Whether this file contains rows that belong to no piece. @throws ShardIsMade
  bool is_written_here() const {
    if (shard_.is_all()) return true;
    if (first_piece_ > 0) throw ShardIsMade();
    return false;
  }
  /// @param piece  number within this call of pieces()
  std::vector<nlohmann::json> lines_in_shards(std::size_t piece) const;
  template <class Row>
  nlohmann::json line_in_piece(std::size_t piece, const Row& made) const {
    nlohmann::json line = line_of(made);
    if (!shard_.is_all()) line["piece"] = first_piece_ + piece;
    return line;
  }
  template <class Row, class Make>
  Row row_of(std::size_t piece, const Make& make) {
    if (can_take(Row::kKind, 1)) return taken_[next_++].second.get<Row>();
    Row made = make();
    append(line_in_piece(piece, made));
    return made;
  }
  /// Makes pieces in several processes. @param lines_of_piece  called there  @param take  called here, with every
  /// line in their order, after it was written
  void make_elsewhere(const std::vector<std::size_t>& todo,
                      const std::function<std::string(std::size_t piece)>& lines_of_piece,
                      const std::function<void(const nlohmann::json& line)>& take,
                      const std::function<void(std::size_t piece)>& done);
  void open();
  void lock();
  /// Creates `file` and locks it. @return the descriptor of the lock. @throws InputError if it is locked
  int locked(const std::string& file) const;

  std::string path_, partial_;
  nlohmann::json header_;
  bool is_complete_ = false;
  int processes_ = 1;
  Shard shard_;
  std::optional<ShardRows> shards_;  ///< empty: pieces are made
  std::size_t first_piece_ = 0;      ///< first piece of the next call of pieces()
  std::function<void(const nlohmann::json& line)> observer_;
  std::vector<std::pair<std::string, nlohmann::json>> taken_;  ///< lines of an interrupted run, as text and parsed
  std::size_t next_ = 0;                                       ///< first line that was not used yet
  std::string message_;
  int lock_ = -1;  ///< descriptor of the partial file
  std::ofstream file_;
};

}  // namespace ricochet
