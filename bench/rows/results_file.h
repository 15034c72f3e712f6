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

/// Results of one experiment, written row by row as they come. While the run lasts the file is called FILE.partial; it
/// gets its own name when the last line is written, so that a file that looks complete is complete. Results of another
/// build or experiment are kept under a dated name.
///
/// While rows are written the partial file is locked: two processes do not write the same results.
///
/// A study makes its rows in a fixed order, so an interrupted run is continued without further ado: what the file has
/// already is returned instead of made again.
class ResultsFile {
 public:
  /// Makes the next row of a piece, or takes it over. @param how  returns it
  template <class Row>
  using NextRow = std::function<Row(const std::function<Row()>& how)>;

  /// Nothing is written before the first row, so that an experiment with a mistake leaves no file.
  /// @param header  with "key": equal keys mean that rows can be taken over
  /// @param force  nothing is taken over
  /// @throws InputError when another process is writing them
  ResultsFile(const std::string& folder, const std::string& name, nlohmann::json header, bool force = false);
  ~ResultsFile();
  ResultsFile(const ResultsFile&) = delete;
  ResultsFile& operator=(const ResultsFile&) = delete;

  /// A sentence on rows that are reused or files that are renamed; empty if no results existed.
  const std::string& message() const { return message_; }
  const std::string& path() const { return path_; }
  /// Everything is there already: nothing to do.
  bool is_complete() const { return is_complete_; }
  /// To which a study may add fields before its first row.
  nlohmann::json& header() { return header_; }

  /// The next row, taken over or made. @param make  returns it
  /// A shard makes one in front of its pieces, which they may need, and leaves it to the merge to write it.
  /// @throws InputError when the file cannot be written
  /// @throws ShardIsMade behind the pieces of a shard
  template <class Row, class Make>
  Row row(const Make& make) {
    if (!is_written_here()) return make();
    if (can_take(Row::kKind, 1)) return taken_[next_++].second.get<Row>();
    Row made = make();
    append(line_of(made));
    return made;
  }

  /// The next n rows, which belong to one session, as times that are compared with each other do: all of them are taken
  /// over, or all made. @param make  returns n of them
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

  /// Thrown by row() and rows() behind the pieces of a shard, which has no more rows.
  struct ShardIsMade {};

  /// Rows in pieces 0, ..., n - 1 that know nothing of each other, so that several processes may make them: the file is
  /// the same, to the last digit. What is taken over is read by this one. May be called again for rows that need none
  /// of the first: their pieces are those behind them.
  /// @param make  make(piece, next): any number of rows, each by next(how), which returns it; in another process it
  ///              leaves nothing behind but these rows
  /// @param done  done(piece), in their order
  /// @returns the rows, of a shard its own
  /// @throws std::runtime_error when another process crashes, or its work throws
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

  /// The same with one row in each piece. @param make  make(piece) returns it
  template <class Row>
  std::vector<Row> each(std::size_t n, const std::function<Row(std::size_t piece)>& make,
                        const std::function<void(std::size_t piece)>& done) {
    return pieces<Row>(
        n, [&](std::size_t piece, const NextRow<Row>& next) { next([&] { return make(piece); }); }, done);
  }

  /// The same of pieces whose rows belong to one session, as those of rows() do.
  /// @param n_rows  n_rows(piece)  @param make  make(piece) returns so many
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

  /// Of pieces(), which are made one after the other here without it. @param n  >= 1
  void set_processes(int n) { processes_ = n; }

  /// Of pieces(), of which only those of the shard are made; each row then says of which piece it is.
  void set_shard(Shard shard) { shard_ = shard; }

  /// Of all pieces(), which are not made but taken from here.
  void set_shards(ShardRows rows) { shards_ = std::move(rows); }

  /// Called with each row that was made, before it is written.
  void set_observer(std::function<void(const nlohmann::json& line)> observer) { observer_ = std::move(observer); }

  /// Writes the end line and gives the file its name.
  void finish();

 private:
  /// Whether the next n lines of the interrupted run are of this kind. What is left of it otherwise is given up.
  bool can_take(const std::string& kind, std::size_t n);
  void append(const nlohmann::json& line);
  /// Whether a row that is of no piece is in this file. @throws ShardIsMade
  bool is_written_here() const {
    if (shard_.is_all()) return true;
    if (first_piece_ > 0) throw ShardIsMade();
    return false;
  }
  /// @param piece  of this call of pieces()
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
  /// Pieces by several processes. @param lines_of_piece  called there  @param take  called here, with every
  /// line in their order, which is in the file
  void make_elsewhere(const std::vector<std::size_t>& todo,
                      const std::function<std::string(std::size_t piece)>& lines_of_piece,
                      const std::function<void(const nlohmann::json& line)>& take,
                      const std::function<void(std::size_t piece)>& done);
  void open();
  void lock();
  /// @return a descriptor that holds the lock of `file`, which is made. @throws InputError when another process has it
  int locked(const std::string& file) const;

  std::string path_, partial_;
  nlohmann::json header_;
  bool is_complete_ = false;
  int processes_ = 1;
  Shard shard_;
  std::optional<ShardRows> shards_;  ///< nothing: pieces are made
  std::size_t first_piece_ = 0;      ///< of the next call of pieces(): so many were in those before
  std::function<void(const nlohmann::json& line)> observer_;
  std::vector<std::pair<std::string, nlohmann::json>> taken_;  ///< lines of an interrupted run, as text and parsed
  std::size_t next_ = 0;                                       ///< the first of them that is not asked for yet
  std::string message_;
  int lock_ = -1;  ///< descriptor of the partial file
  std::ofstream file_;
};

}  // namespace ricochet
