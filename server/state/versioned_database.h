// A database of a state folder: opened sound and with the newest schema, or not at all.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"
#include "server/state/sqlite_database.h"

namespace helio {

struct DatabaseSchema {
  std::int32_t application_id;              // PRAGMA application_id: tells that a file is of this schema
  std::span<const std::string_view> steps;  // step i makes version i + 1 of version i; 0 is the empty database
};

// Opens or makes `file` for writing, in WAL mode, reads all of it and brings it to the schema's last version in one
// transaction. A damaged file, or one of another schema, is set aside (set_database_aside()) and a new one begins. Both
// are told in `notices`, a sentence each. failed_precondition: the file's version is a newer one.
Result<std::unique_ptr<SqliteDatabase>> open_versioned_database(const std::string& file, const DatabaseSchema& schema,
                                                                std::vector<std::string>& notices);

}  // namespace helio
