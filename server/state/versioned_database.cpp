#include "server/state/versioned_database.h"

#include <spdlog/fmt/fmt.h>

#include <filesystem>

namespace helio {
namespace {

// SQLite removes a log beside an empty file, as if nothing had ever been committed.
bool lost_its_content(const std::string& file) {
  std::error_code none;
  const auto size = std::filesystem::file_size(file, none);
  if (none || size > 0) return false;
  const auto log = std::filesystem::file_size(file + "-wal", none);
  return !none && log > 0;
}

struct Found {
  std::int64_t version = 0;
  std::string damage;  // empty: none
};

Result<Found> examine(SqliteDatabase& database, const DatabaseSchema& schema) {
  auto damage = database.find_damage();
  if (!damage) return damage.error();
  Found found;
  found.damage = std::move(*damage);
  if (!found.damage.empty()) return found;
  const auto version = database.query_integer("PRAGMA user_version");
  if (!version) return version.error();
  const auto id = database.query_integer("PRAGMA application_id");
  if (!id) return id.error();
  const auto objects = database.query_integer("SELECT count(*) FROM sqlite_master");
  if (!objects) return objects.error();
  found.version = *version;
  const bool empty = *version == 0 && *objects == 0;
  if (!empty && (*version <= 0 || *objects == 0 || *id != schema.application_id)) {
    found.damage = fmt::format("it is of another kind: application id {}, version {}, {} tables and indexes", *id,
                               *version, *objects);
  }
  return found;
}

Status migrate(SqliteDatabase& database, const DatabaseSchema& schema, std::int64_t version) {
  const Status begun = database.execute("BEGIN IMMEDIATE");
  if (!begun.ok()) return begun;
  const auto steps = [&]() -> Status {
    for (const std::string_view step : schema.steps.subspan(std::size_t(version))) {
      if (const Status made = database.execute(std::string(step).c_str()); !made.ok()) return made;
    }
    const std::string marks = fmt::format("PRAGMA application_id = {}; PRAGMA user_version = {}; COMMIT",
                                          schema.application_id, schema.steps.size());
    return database.execute(marks.c_str());
  };
  const Status done = steps();
  if (!done.ok() && database.in_transaction()) (void)database.execute("ROLLBACK");
  return done;
}

Result<std::unique_ptr<SqliteDatabase>> set_aside_and_begin(const std::string& file, const std::string& damage,
                                                            std::vector<std::string>& notices) {
  const auto name = set_database_aside(file);
  if (!name) return name.error();
  notices.push_back(
      fmt::format("{}: the database is damaged ({}); it is kept as {}, and a new one begins", file, damage, *name));
  return SqliteDatabase::open(file, SqliteDatabase::Access::write);
}

}  // namespace

Result<std::unique_ptr<SqliteDatabase>> open_versioned_database(const std::string& file, const DatabaseSchema& schema,
                                                                std::vector<std::string>& notices) {
  auto database = lost_its_content(file)
                      ? set_aside_and_begin(file, "it is empty, but its write-ahead log is not", notices)
                      : SqliteDatabase::open(file, SqliteDatabase::Access::write);
  if (!database) return database;
  auto examined = examine(**database, schema);
  if (!examined) return examined.error();
  if (!examined->damage.empty()) {
    database->reset();
    database = set_aside_and_begin(file, examined->damage, notices);
    if (!database) return database;
    examined = Found{};
  }
  const std::int64_t newest = std::int64_t(schema.steps.size()), version = examined->version;
  if (version > newest) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("the database has version {}, written by a newer program; this one knows versions up to "
                             "{}. Use the newer program or another state folder",
                             version, newest),
                 file};
  }
  if (const Status logged = (*database)->use_write_ahead_log(); !logged.ok()) return logged.error();
  if (version == newest) return database;
  if (const Status migrated = migrate(**database, schema, version); !migrated.ok()) return migrated.error();
  if (version > 0) notices.push_back(fmt::format("{}: brought from version {} to {}", file, version, newest));
  return database;
}

}  // namespace helio
