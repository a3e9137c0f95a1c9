#include "server/state/sqlite_database.h"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>
#include <sqlite3.h>

#include <ctime>
#include <filesystem>

namespace helio {
namespace {

int primary(int code) {
  return code & 0xff;
}

bool tells_damage(int code) {
  return primary(code) == SQLITE_CORRUPT || primary(code) == SQLITE_NOTADB;
}

// The text that the statement was compiled from, by which it is found again.
std::string_view text_of(sqlite3_stmt* statement) {
  return sqlite3_sql(statement);
}

struct Bind {
  sqlite3_stmt* statement;
  int index;

  int operator()(std::int64_t value) const { return sqlite3_bind_int64(statement, index, value); }
  int operator()(double value) const { return sqlite3_bind_double(statement, index, value); }
  int operator()(std::string_view value) const {
    return sqlite3_bind_text64(statement, index, not_null(value), value.size(), SQLITE_STATIC, SQLITE_UTF8);
  }
  int operator()(SqliteBlob value) const {
    return sqlite3_bind_blob64(statement, index, not_null(value.bytes), value.bytes.size(), SQLITE_STATIC);
  }
  // A null pointer would bind NULL.
  static const char* not_null(std::string_view value) { return value.data() == nullptr ? "" : value.data(); }
};

}  // namespace

SqliteRows::SqliteRows(SqliteRows&& other) noexcept
    : database_(other.database_), statement_(std::exchange(other.statement_, nullptr)) {}

SqliteRows::~SqliteRows() {
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  try {
    database_->idle_.emplace(text_of(statement_), statement_);
  } catch (const std::bad_alloc&) {
    sqlite3_finalize(statement_);
  }
}

Result<bool> SqliteRows::next() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_->failure(code);
}

std::int64_t SqliteRows::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}

double SqliteRows::real(int column) const {
  return sqlite3_column_double(statement_, column);
}

std::string SqliteRows::text(int column) const {
  // The pointer first: the size is that of what it made of the value.
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_, column));
  const int size = sqlite3_column_bytes(statement_, column);
  return bytes == nullptr ? std::string() : std::string(bytes, std::size_t(size));
}

Result<std::unique_ptr<SqliteDatabase>> SqliteDatabase::open(const std::string& file, Access access) {
  sqlite3* connection = nullptr;
  const int flags = (access == Access::write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY) |
                    SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  const int code = sqlite3_open_v2(file.c_str(), &connection, flags, nullptr);
  // There is a connection even then, unless memory is out; it knows the error's text.
  if (connection == nullptr) throw std::bad_alloc();
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(file, connection));
  if (code != SQLITE_OK) return database->failure(code);
  sqlite3_busy_timeout(connection, kBusyTimeoutMs);
  if (access == Access::write && sqlite3_db_readonly(connection, "main") == 1) {
    return Error{ErrorCode::unavailable, "cannot be written: the file is read-only", file};
  }
  return database;
}

SqliteDatabase::~SqliteDatabase() {
  for (const auto& [text, statement] : idle_) sqlite3_finalize(statement);
  sqlite3_close_v2(connection_);
}

Error SqliteDatabase::failure(int code) const {
  const char* said = sqlite3_errmsg(connection_);
  switch (primary(code)) {
    case SQLITE_NOMEM:
      throw std::bad_alloc();
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {ErrorCode::unavailable,
              fmt::format("another program has held the database locked for {} s ({})", kBusyTimeoutMs / 1000, said),
              file_};
    case SQLITE_FULL:
      return {ErrorCode::unavailable, fmt::format("the disk is full ({})", said), file_};
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return {ErrorCode::unavailable, fmt::format("cannot be written ({})", said), file_};
    case SQLITE_CANTOPEN:
      return {ErrorCode::unavailable, fmt::format("cannot be opened ({})", said), file_};
    case SQLITE_IOERR:
    case SQLITE_PROTOCOL:
      return {ErrorCode::unavailable, fmt::format("cannot be read or written ({}, code {})", said, code), file_};
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return {ErrorCode::internal, fmt::format("the database is damaged ({})", said), file_};
    default:
      return {ErrorCode::internal, fmt::format("{} (code {})", said, code), file_};
  }
}

Status SqliteDatabase::execute(const char* statements) {
  const int code = sqlite3_exec(connection_, statements, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) return failure(code);
  return ok_status();
}

Result<sqlite3_stmt*> SqliteDatabase::compile(std::string_view statement) {
  if (const auto found = idle_.find(statement); found != idle_.end()) {
    sqlite3_stmt* kept = found->second;
    idle_.erase(found);
    return kept;
  }
  sqlite3_stmt* compiled = nullptr;
  const int code = sqlite3_prepare_v3(connection_, statement.data(), int(statement.size()), SQLITE_PREPARE_PERSISTENT,
                                      &compiled, nullptr);
  if (code != SQLITE_OK) return failure(code);
  return compiled;
}

Result<SqliteRows> SqliteDatabase::query(std::string_view statement, std::initializer_list<SqliteValue> values) {
  const auto compiled = compile(statement);
  if (!compiled) return compiled.error();
  SqliteRows rows(this, *compiled);
  HELIO_CHECK(sqlite3_bind_parameter_count(*compiled) == int(values.size()));
  int index = 0;
  for (const SqliteValue& value : values) {
    const int code = std::visit(Bind{*compiled, ++index}, value);
    if (code != SQLITE_OK) return failure(code);
  }
  return rows;
}

Status SqliteDatabase::run(std::string_view statement, std::initializer_list<SqliteValue> values) {
  auto rows = query(statement, values);
  if (!rows) return rows.error();
  while (true) {
    const auto more = rows->next();
    if (!more) return more.error();
    if (!*more) return ok_status();
  }
}

Result<std::int64_t> SqliteDatabase::query_integer(std::string_view statement,
                                                   std::initializer_list<SqliteValue> values) {
  auto rows = query(statement, values);
  if (!rows) return rows.error();
  const auto more = rows->next();
  if (!more) return more.error();
  return *more ? rows->integer(0) : 0;
}

Result<std::string> SqliteDatabase::find_damage() {
  // Closing would otherwise write the log into a file that may be damaged, and remove it.
  sqlite3_db_config(connection_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  const auto told = [&](const Error& error) -> Result<std::string> {
    if (tells_damage(sqlite3_errcode(connection_))) return std::string(sqlite3_errmsg(connection_));
    return error;
  };
  auto rows = query("PRAGMA quick_check(1)");
  if (!rows) return told(rows.error());
  const auto first = rows->next();
  if (!first) return told(first.error());
  if (const std::string found = rows->text(0); found != "ok") return found;
  sqlite3_db_config(connection_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
  return std::string();
}

Status SqliteDatabase::use_write_ahead_log() {
  {
    auto mode = query("PRAGMA journal_mode = WAL");
    if (!mode) return mode.error();
    if (const auto first = mode->next(); !first) return first.error();
    if (const std::string now = mode->text(0); now != "wal") {
      return Error{ErrorCode::unavailable, "the file system has no write-ahead log (journal mode " + now + ")", file_};
    }
  }
  return execute("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA journal_size_limit = 67108864");
}

bool SqliteDatabase::in_transaction() const {
  return sqlite3_get_autocommit(connection_) == 0;
}

std::int64_t SqliteDatabase::last_insert_id() const {
  return sqlite3_last_insert_rowid(connection_);
}

std::int64_t SqliteDatabase::changed_rows() const {
  return sqlite3_changes64(connection_);
}

Result<std::string> set_database_aside(const std::string& file) {
  namespace fs = std::filesystem;
  const std::string base = fmt::format("{}.damaged-{:%Y%m%d-%H%M%S}", file, fmt::gmtime(std::time(nullptr)));
  const auto taken = [](const std::string& name) {
    std::error_code unknown;
    return fs::exists(name, unknown) || fs::exists(name + "-wal", unknown) || fs::exists(name + "-shm", unknown);
  };
  std::string name = base;
  for (int number = 2; taken(name); ++number) name = fmt::format("{}-{}", base, number);
  // The log first: a log without its database is of no harm to the next one, but one with a new database would be.
  for (const char* ending : {"-wal", "-shm", ""}) {
    std::error_code failed;
    if (!fs::exists(file + ending, failed)) continue;
    fs::rename(file + ending, name + ending, failed);
    if (failed) {
      return Error{ErrorCode::unavailable, fmt::format("is damaged and cannot be set aside ({})", failed.message()),
                   file + ending};
    }
  }
  return name;
}

}  // namespace helio
