// A connection to an SQLite database: opened, asked and closed; what SQLite says becomes an Error.
//
// An Error names the file and quotes SQLite. unavailable: the disk or another program is in the way (full, read-only,
// locked for longer than 5 s, an input or output error). internal: the file is damaged, or a statement is wrong.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "renderer/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace helio {

struct SqliteBlob {
  std::string_view bytes;
};
// What a parameter of a statement is bound to. Texts and blobs live until the statement has run.
using SqliteValue = std::variant<std::int64_t, double, std::string_view, SqliteBlob>;

class SqliteDatabase;

// The rows of a query. Outlived by its database.
class SqliteRows {
 public:
  SqliteRows(SqliteRows&& other) noexcept;
  SqliteRows& operator=(SqliteRows&&) = delete;
  ~SqliteRows();

  // Goes on to the next row, at first to the first one; false: there is none.
  Result<bool> next();
  // Columns of the row, from 0. What is of another type is converted as SQLite does; null is 0 or "".
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;  // of blobs, too

 private:
  friend class SqliteDatabase;
  SqliteRows(SqliteDatabase* database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}

  SqliteDatabase* database_;
  sqlite3_stmt* statement_;
};

// For one thread at a time.
class SqliteDatabase {
 public:
  enum class Access { write, read };
  // How long a statement waits for the lock that another program holds.
  static constexpr int kBusyTimeoutMs = 5000;

  // Makes the file when it is to be written and not there. Nothing of it is read yet.
  static Result<std::unique_ptr<SqliteDatabase>> open(const std::string& file, Access access);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // Statements without parameters, separated by ';'.
  Status execute(const char* statements);
  // One statement, to its end. Statements are compiled once and kept.
  Status run(std::string_view statement, std::initializer_list<SqliteValue> values = {});
  Result<SqliteRows> query(std::string_view statement, std::initializer_list<SqliteValue> values = {});
  // First column of the first row; 0 without one.
  Result<std::int64_t> query_integer(std::string_view statement, std::initializer_list<SqliteValue> values = {});

  // Reads all of the file. What is wrong with it; empty: nothing. Error: it could not be read for another reason.
  Result<std::string> find_damage();
  // WAL, and synchronous = FULL: a commit is on the disk when it returns.
  Status use_write_ahead_log();

  bool in_transaction() const;
  std::int64_t last_insert_id() const;
  std::int64_t changed_rows() const;  // by the last statement

 private:
  friend class SqliteRows;
  SqliteDatabase(std::string file, sqlite3* connection) : file_(std::move(file)), connection_(connection) {}
  Result<sqlite3_stmt*> compile(std::string_view statement);
  Error failure(int code) const;

  const std::string file_;
  sqlite3* const connection_;
  std::multimap<std::string, sqlite3_stmt*, std::less<>> idle_;  // compiled statements by text
};

// Renames a database with its -wal and -shm to FILE.damaged-YYYYMMDD-HHMMSS (UTC; with a number behind it, when that is
// there). The new name.
Result<std::string> set_database_aside(const std::string& file);

}  // namespace helio
