#include "server/state/commit_group.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <stdexcept>
#include <thread>

#include "tests/service/process.h"

namespace helio::test {
namespace {

using Transaction = CommitGroup::Transaction;

class CommitGroupTest : public testing::Test {
 protected:
  CommitGroupTest() {
    auto database = SqliteDatabase::open(file_, SqliteDatabase::Access::write);
    EXPECT_TRUE((*database)->use_write_ahead_log().ok());
    EXPECT_TRUE((*database)->execute("CREATE TABLE numbers (number INTEGER PRIMARY KEY)").ok());
    group_ = std::make_unique<CommitGroup>(std::move(*database));
  }

  static Status insert(Transaction& transaction, int number) {
    return transaction.database.run("INSERT INTO numbers VALUES (?)", {number});
  }
  Status add(int number) {
    return group_->run([number](Transaction& transaction) { return insert(transaction, number); });
  }
  // As another connection sees it.
  std::string numbers() {
    const auto reader = SqliteDatabase::open(file_, SqliteDatabase::Access::read);
    auto rows = (*reader)->query("SELECT group_concat(number) FROM (SELECT number FROM numbers ORDER BY number)");
    EXPECT_TRUE(rows && rows->next().ok());
    return rows->text(0);
  }

  TemporaryFolder folder_;
  std::string file_ = folder_ / "numbers.sqlite";
  std::unique_ptr<CommitGroup> group_;
};

TEST_F(CommitGroupTest, AnswersWhatIsCommitted) {
  EXPECT_TRUE(add(3).ok());
  EXPECT_EQ(numbers(), "3");
  EXPECT_TRUE(add(1).ok());
  EXPECT_EQ(numbers(), "1,3");
  EXPECT_EQ(group_->commits(), 2u);
}

// Seven calls come while the first one's transaction is under way: they share the second one. The one of them that
// fails, because the number is taken, leaves the six others as they are.
TEST_F(CommitGroupTest, CallsThatComeTogetherShareACommit) {
  std::latch begun(1);
  std::jthread first([&] {
    const Status done = group_->run([&](Transaction& transaction) {
      begun.count_down();
      while (group_->waiting() < 7) std::this_thread::yield();
      return insert(transaction, 100);
    });
    EXPECT_TRUE(done.ok());
  });
  begun.wait();
  std::atomic<int> failed = 0;
  std::vector<std::jthread> others;
  for (int i = 1; i <= 7; ++i) {
    others.emplace_back([&, i] {
      const Status done = add(i == 4 ? 100 : i);
      if (!done.ok()) {
        ++failed;
        EXPECT_NE(done.error().message.find("UNIQUE"), std::string::npos) << done.error().to_string();
      }
    });
  }
  others.clear();
  first.join();
  EXPECT_EQ(failed, 1);
  EXPECT_EQ(group_->commits(), 2u);
  EXPECT_EQ(numbers(), "1,2,3,5,6,7,100");
}

TEST_F(CommitGroupTest, WhatFailsHalfwayLeavesNothing) {
  const Status done = group_->run([](Transaction& transaction) -> Status {
    EXPECT_TRUE(insert(transaction, 1).ok());
    return Error{ErrorCode::failed_precondition, "no", "here"};
  });
  EXPECT_EQ(done.error().to_string(), "here: no");
  EXPECT_EQ(numbers(), "");
}

TEST_F(CommitGroupTest, AnExceptionIsAnError) {
  const Status done = group_->run([](Transaction& transaction) -> Status {
    EXPECT_TRUE(insert(transaction, 1).ok());
    throw std::runtime_error("thrown");
  });
  EXPECT_EQ(done.error().message, "thrown");
  EXPECT_TRUE(add(2).ok());
  EXPECT_EQ(numbers(), "2");
}

// A full disk makes SQLite roll back the whole transaction: nobody is told that his change is there.
TEST_F(CommitGroupTest, ALostTransactionFailsAllOfItsCalls) {
  std::latch begun(1);
  std::jthread first([&] {
    (void)group_->run([&](Transaction& transaction) {
      begun.count_down();
      while (group_->waiting() < 3) std::this_thread::yield();
      return insert(transaction, 100);
    });
  });
  begun.wait();
  std::atomic<int> failed = 0;
  std::vector<std::jthread> others;
  const auto lost = [&](const Status& done) {
    if (done.ok()) return;
    ++failed;
    EXPECT_EQ(done.error().message, "the disk is full");
  };
  others.emplace_back([&] { lost(add(1)); });
  while (group_->waiting() < 1) std::this_thread::yield();
  others.emplace_back([&] {
    lost(group_->run([](Transaction& transaction) -> Status {
      EXPECT_TRUE(transaction.database.execute("ROLLBACK").ok());
      return Error{ErrorCode::unavailable, "the disk is full", {}};
    }));
  });
  while (group_->waiting() < 2) std::this_thread::yield();
  others.emplace_back([&] { lost(add(3)); });
  others.clear();
  first.join();
  EXPECT_EQ(failed, 3);
  EXPECT_EQ(numbers(), "100");
  EXPECT_TRUE(add(4).ok());
  EXPECT_EQ(numbers(), "4,100");
}

// The call may change the database itself, for it is made without a lock and after the commit.
TEST_F(CommitGroupTest, TellsOfNoteworthyChanges) {
  std::string seen;
  group_->on_noteworthy([&] {
    seen += numbers() + ";";
    EXPECT_TRUE(add(50).ok());
  });
  EXPECT_TRUE(add(1).ok());
  EXPECT_EQ(seen, "");
  const auto noteworthy = [&](int number) {
    return group_->run([&](Transaction& transaction) {
      transaction.noteworthy = true;
      return insert(transaction, number);
    });
  };
  EXPECT_TRUE(noteworthy(2).ok());
  EXPECT_EQ(seen, "1,2;");
  EXPECT_EQ(numbers(), "1,2,50");
}

TEST_F(CommitGroupTest, NoChangeIsLostAmongThreads) {
  constexpr int kThreads = 8, kEach = 50;
  std::vector<std::jthread> threads;
  for (int thread = 0; thread < kThreads; ++thread) {
    threads.emplace_back([&, thread] {
      for (int i = 0; i < kEach; ++i) EXPECT_TRUE(add(thread * kEach + i).ok());
    });
  }
  threads.clear();
  const auto reader = SqliteDatabase::open(file_, SqliteDatabase::Access::read);
  EXPECT_EQ(*(*reader)->query_integer("SELECT count(*) FROM numbers"), kThreads * kEach);
  EXPECT_LE(group_->commits(), std::uint64_t(kThreads * kEach));
}

}  // namespace
}  // namespace helio::test
