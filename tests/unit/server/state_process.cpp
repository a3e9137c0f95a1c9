#include "state_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <thread>

#include "server/state/checkpoint_files.h"
#include "server/state/sqlite_database.h"
#include "server/state/state_folder.h"
#include "tests/support/random.h"

namespace helio::test {
namespace {

// In one write(), so that a line is there whole or not at all.
void say(const std::string& line) {
  const std::string text = line + "\n";
  if (::write(1, text.data(), text.size()) != ssize_t(text.size())) _exit(3);
}

[[noreturn]] void wait_for_the_end() {
  while (true) pause();
}

void submit_forever(const std::string& file) {
  std::vector<std::string> notices;
  auto table = JobTable::open(file, notices);
  if (!table) return say(table.error().to_string());
  for (const std::string& notice : notices) say(notice);
  std::vector<std::jthread> threads;
  for (int client = 0; client < 8; ++client) {
    threads.emplace_back([&, client] {
      for (int i = 0;; ++i) {
        const std::string id = std::to_string(getpid()) + "-" + std::to_string(client) + "-" + std::to_string(i);
        const auto expect = [&](bool done, const char* word) {
          say(done ? id + " " + word : "failed: " + std::string(word));
        };
        expect((*table)->submit(make_job(id), 1 << 20, "tester").ok(), "submitted");
        if (i % 2 == 0) expect((*table)->change(id, {JobState::running}).ok(), "running");
        if (i % 4 == 0) expect((*table)->add_result(id, {0, "end", "/file", 7, "sum"}).ok(), "view");
        if (i % 8 == 0) expect((*table)->change(id, {JobState::succeeded}).ok(), "succeeded");
      }
    });
  }
}

void write_checkpoints(const std::string& folder) {
  CheckpointFiles files(folder);
  if (const Status opened = files.open(); !opened.ok()) return say(opened.error().to_string());
  const auto before = files.read("job", 1 << 30);
  for (std::uint64_t number = before.file ? before.file->number + 1 : 1;; ++number) {
    const std::vector<std::uint8_t> body = checkpoint_body(number);
    const std::array<std::span<const std::uint8_t>, 2> parts = {std::span(body).first(body.size() / 3),
                                                                std::span(body).subspan(body.size() / 3)};
    const Status written = files.write("job", "header", parts);
    say(written.ok() ? std::to_string(number) : written.error().to_string());
  }
}

void hold_lock(const std::string& directory) {
  const auto folder = StateFolder::open(directory);
  say(folder ? "held" : folder.error().to_string());
  if (folder) wait_for_the_end();
}

void hold_write_lock(const std::string& file) {
  const auto database = SqliteDatabase::open(file, SqliteDatabase::Access::write);
  const bool held = database && (*database)->execute("BEGIN IMMEDIATE").ok();
  say(held ? "held" : "failed");
  wait_for_the_end();
}

void open_as_nobody(const std::string& directory) {
  constexpr unsigned kNobody = 65534;
  if (getuid() == 0 && (setgid(kNobody) != 0 || setuid(kNobody) != 0)) return say("not permitted");
  const auto folder = StateFolder::open(directory);
  say(folder ? "opened" : folder.error().to_string());
}

void mount_small_disk(const std::string& folder) {
  // Without rights, a user namespace may be had; root needs none.
  if (unshare(getuid() == 0 ? CLONE_NEWNS : CLONE_NEWUSER | CLONE_NEWNS) != 0 ||
      mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      mount("tmpfs", folder.c_str(), "tmpfs", 0, "size=4m") != 0) {
    return say("not permitted");
  }
  small_disk(folder);
}

}  // namespace

std::string this_program() {
  return std::filesystem::read_symlink("/proc/self/exe").string();
}

std::vector<std::uint8_t> checkpoint_body(std::uint64_t number) {
  Random random(number);
  std::vector<std::uint8_t> body(random.next_u32() % (3 << 20));
  for (std::uint8_t& byte : body) byte = std::uint8_t(random.next_u32() >> 24);
  return body;
}

JobRecord make_job(const std::string& id) {
  JobRecord job;
  job.id = id;
  job.owner = "owner";
  job.name = "name of " + id;
  job.request = std::string("request\0of ", 11) + id;
  job.scene_id = "scene";
  return job;
}

}  // namespace helio::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc < 3) return RUN_ALL_TESTS();
  const std::string role = argv[1], path = argv[2];
  if (role == "submit") helio::test::submit_forever(path);
  if (role == "checkpoints") helio::test::write_checkpoints(path);
  if (role == "lock") helio::test::hold_lock(path);
  if (role == "write-lock") helio::test::hold_write_lock(path);
  if (role == "nobody") helio::test::open_as_nobody(path);
  if (role == "small-disk") helio::test::mount_small_disk(path);
  return 0;
}
