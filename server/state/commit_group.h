// Changes of a database, from any thread, in transactions that calls share: a flush of the disk costs the same for one
// change as for many.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "renderer/base/result.h"
#include "server/state/sqlite_database.h"

namespace helio {

// Calls that arrive while a commit is under way wait; one of them then runs the changes of all in the next transaction,
// each under a savepoint, so that one that fails leaves the others as they are. There is no thread of its own.
class CommitGroup {
 public:
  explicit CommitGroup(std::unique_ptr<SqliteDatabase> database) : database_(std::move(database)) {}

  struct Transaction {
    SqliteDatabase& database;
    bool noteworthy = false;  // set by changes: on_noteworthy is called once they are committed
  };
  // An Error undoes what the change did. It must not call run().
  using Change = std::function<Status(Transaction&)>;
  // Runs the change, on this thread or another caller's, and returns when it is on the disk. Errors: the change's, and
  // those of SqliteDatabase; then nothing of it is there.
  Status run(const Change& change);

  // Called on the committing thread, without a lock. To be set before the first run().
  void on_noteworthy(std::function<void()> call) { on_noteworthy_ = std::move(call); }

  std::uint64_t commits() const;  // so far
  std::size_t waiting() const;    // calls that no transaction has taken up yet

 private:
  struct Call {
    const Change* change;
    Status result = ok_status();
    bool done = false;
  };
  void wait_for_company(std::unique_lock<std::mutex>& lock);
  // True: committed, and something noteworthy with it.
  bool commit(const std::vector<Call*>& group);
  Status run_all(const std::vector<Call*>& group, Transaction& transaction);

  const std::unique_ptr<SqliteDatabase> database_;  // used by the leading call alone
  std::function<void()> on_noteworthy_;

  mutable std::mutex mutex_;
  std::condition_variable turn_;     // a group is done
  std::condition_variable arrived_;  // a call has come while the leading one waits for company
  std::vector<Call*> waiting_;
  bool leading_ = false;           // a call is running a group
  std::size_t expected_ = 1;       // calls that the newest group had, or that came while it was committed
  double commit_s_ = 0;            // time that the newest commit took
  std::uint64_t commits_ = 0;
};

}  // namespace helio
