#include "server/state/commit_group.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include "renderer/base/clock.h"
#include "server/base/guarded.h"

namespace helio {
namespace {

// Clients that submit one job after the other come back soon after a commit. Without waiting for them, groups of one
// and of all others take turns, which halves the rate; the wait is worth a part of a commit at most.
constexpr double kPartOfCommit = 0.25, kMaxWaitS = 0.002;

}  // namespace

Status CommitGroup::run(const Change& change) {
  Call call{&change};
  std::unique_lock lock(mutex_);
  waiting_.push_back(&call);
  arrived_.notify_one();
  turn_.wait(lock, [&] { return call.done || !leading_; });
  if (call.done) return std::move(call.result);

  leading_ = true;
  wait_for_company(lock);
  const std::vector<Call*> group = std::exchange(waiting_, {});
  lock.unlock();
  const double begin = now_s();
  bool noteworthy = false;
  try {
    noteworthy = commit(group);
  } catch (const std::bad_alloc&) {
    // Short enough to need no memory. The next commit rolls back what this one has left.
    for (Call* each : group) each->result = Error{ErrorCode::resource_exhausted, "out of memory", {}};
  }
  const double took = now_s() - begin;
  lock.lock();
  for (Call* each : group) each->done = true;
  expected_ = group.size() + waiting_.size();
  commit_s_ = took;
  ++commits_;
  leading_ = false;
  lock.unlock();
  turn_.notify_all();
  if (noteworthy && on_noteworthy_) on_noteworthy_();
  return std::move(call.result);
}

void CommitGroup::wait_for_company(std::unique_lock<std::mutex>& lock) {
  const auto wait = std::chrono::duration<double>(std::min(kPartOfCommit * commit_s_, kMaxWaitS));
  arrived_.wait_for(lock, wait, [&] { return waiting_.size() >= expected_; });
}

bool CommitGroup::commit(const std::vector<Call*>& group) {
  Transaction transaction{*database_};
  const Status committed = guarded([&] { return run_all(group, transaction); });
  if (committed.ok()) return transaction.noteworthy;
  if (database_->in_transaction()) (void)guarded([&] { return database_->execute("ROLLBACK"); });
  for (Call* call : group) {
    if (call->result.ok()) call->result = committed;
  }
  return false;
}

// Error: nothing is committed.
Status CommitGroup::run_all(const std::vector<Call*>& group, Transaction& transaction) {
  if (database_->in_transaction()) {
    if (const Status undone = database_->execute("ROLLBACK"); !undone.ok()) return undone;
  }
  if (const Status begun = database_->execute("BEGIN IMMEDIATE"); !begun.ok()) return begun;
  for (Call* call : group) {
    if (const Status saved = database_->execute("SAVEPOINT change"); !saved.ok()) return saved;
    call->result = guarded([&] { return (*call->change)(transaction); });
    if (!call->result.ok()) {
      // A full disk makes SQLite undo the whole transaction.
      if (!database_->in_transaction()) return call->result;
      if (const Status undone = database_->execute("ROLLBACK TO change"); !undone.ok()) return undone;
    }
    if (const Status released = database_->execute("RELEASE change"); !released.ok()) return released;
  }
  return database_->execute("COMMIT");
}

std::uint64_t CommitGroup::commits() const {
  const std::lock_guard lock(mutex_);
  return commits_;
}

std::size_t CommitGroup::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

}  // namespace helio
