// The test program started once more, as another process that uses a state folder: `helio_test_state ROLE PATH`.
//
//   submit FILE       JobTable: eight threads submit, start and end jobs until the process is killed; prints the id of
//                     each job, a word and a line end after each answer
//   checkpoints DIR   CheckpointFiles: checkpoints of job "job" until the process is killed; prints the number of each
//   lock DIR          StateFolder: prints "held" or why not, and keeps it until the process is killed
//   write-lock FILE   SqliteDatabase: prints "held" within a transaction, and keeps it
//   nobody DIR        StateFolder: as a user without rights; prints why it cannot be opened
//   small-disk DIR    mounts a file system of 4 MiB there, seen by this process alone; then small_disk() of
//                     disk_trouble_test.cpp. Prints "not permitted" where it must not mount
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/state/job_table.h"
#include "tests/service/process.h"

namespace helio::test {

// Path of this program.
std::string this_program();

// Body of checkpoint `number`: its bytes and their count follow from it.
std::vector<std::uint8_t> checkpoint_body(std::uint64_t number);

JobRecord make_job(const std::string& id);

// What happens on a full disk, a line of text each.
void small_disk(const std::string& folder);

}  // namespace helio::test
