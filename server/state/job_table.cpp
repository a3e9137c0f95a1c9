#include "server/state/job_table.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>

#include "renderer/base/unix_time.h"
#include "renderer/codec/sha256.h"
#include "server/state/commit_group.h"
#include "server/state/versioned_database.h"

namespace helio {
namespace {

// Every version that was ever released, in order: a change of the schema is a new step.
constexpr std::string_view kSteps[] = {
    R"(
CREATE TABLE jobs (
  number INTEGER PRIMARY KEY AUTOINCREMENT,  -- in order of submission
  id TEXT NOT NULL UNIQUE,
  owner TEXT NOT NULL,
  client_token TEXT NOT NULL,
  name TEXT NOT NULL,
  scene_id TEXT NOT NULL,
  priority INTEGER NOT NULL,
  state INTEGER NOT NULL CHECK (state BETWEEN 1 AND 6),
  target INTEGER NOT NULL CHECK (target BETWEEN 1 AND 6),
  target_by TEXT NOT NULL,
  reason TEXT NOT NULL,
  attempt INTEGER NOT NULL,
  updated_seq INTEGER NOT NULL,
  submitted_s REAL NOT NULL,
  started_s REAL NOT NULL,
  ended_s REAL NOT NULL,
  views INTEGER NOT NULL,
  views_done INTEGER NOT NULL,
  same_bits INTEGER NOT NULL,
  build TEXT NOT NULL,
  request BLOB NOT NULL
);
CREATE UNIQUE INDEX jobs_by_token ON jobs (owner, client_token) WHERE client_token <> '';
CREATE INDEX jobs_by_state ON jobs (state, number);
CREATE INDEX jobs_by_turn ON jobs (priority DESC, number) WHERE state = 1;
CREATE INDEX jobs_by_end ON jobs (ended_s) WHERE ended_s > 0;
CREATE TABLE events (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  from_state INTEGER NOT NULL CHECK (from_state BETWEEN 0 AND 6),  -- 0: none
  to_state INTEGER NOT NULL CHECK (to_state BETWEEN 1 AND 6),
  reason TEXT NOT NULL,
  asked_by TEXT NOT NULL,
  attempt INTEGER NOT NULL,
  time_s REAL NOT NULL
);
CREATE INDEX events_by_job ON events (job, seq);
CREATE TABLE results (
  job INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
  view_number INTEGER NOT NULL,
  frame_end BLOB NOT NULL,
  file TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (job, view_number)
) WITHOUT ROWID;
)",
    // Counting the rows of an index took a submission as long as the queue.
    R"(
CREATE TABLE job_counts (
  state INTEGER PRIMARY KEY,
  jobs INTEGER NOT NULL
);
INSERT INTO job_counts (state, jobs) VALUES (1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (6, 0);
UPDATE job_counts SET jobs = (SELECT count(*) FROM jobs WHERE jobs.state = job_counts.state);
CREATE TRIGGER job_added AFTER INSERT ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs + 1 WHERE state = NEW.state;
END;
CREATE TRIGGER job_changed AFTER UPDATE OF state ON jobs WHEN OLD.state <> NEW.state BEGIN
  UPDATE job_counts SET jobs = jobs - 1 WHERE state = OLD.state;
  UPDATE job_counts SET jobs = jobs + 1 WHERE state = NEW.state;
END;
CREATE TRIGGER job_removed AFTER DELETE ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs - 1 WHERE state = OLD.state;
END;
)",
    // Camera paths of ten thousand views are megabytes, which lists and a start read with every row.
    R"(
CREATE TABLE requests (
  job INTEGER PRIMARY KEY REFERENCES jobs (number) ON DELETE CASCADE,
  request BLOB NOT NULL
);
CREATE TABLE request_bytes (one INTEGER PRIMARY KEY CHECK (one = 1), bytes INTEGER NOT NULL);
INSERT INTO request_bytes VALUES (1, 0);
CREATE TRIGGER request_added AFTER INSERT ON requests BEGIN
  UPDATE request_bytes SET bytes = bytes + length(NEW.request);
END;
CREATE TRIGGER request_removed AFTER DELETE ON requests BEGIN
  UPDATE request_bytes SET bytes = bytes - length(OLD.request);
END;
ALTER TABLE jobs RENAME COLUMN request TO summary;
ALTER TABLE jobs ADD COLUMN request_sha256 TEXT NOT NULL DEFAULT '';
)"};
constexpr DatabaseSchema kSchema{0x68656c6a, kSteps};  // "helj"

constexpr std::string_view kSelectJob =
    "SELECT number, id, owner, client_token, name, scene_id, priority, state, target, target_by, reason, attempt, "
    "updated_seq, submitted_s, started_s, ended_s, views, views_done, same_bits, build, request_sha256, summary "
    "FROM jobs ";

constexpr std::string_view kByToken = "WHERE owner = ? AND client_token = ? AND client_token <> ''";

struct Row {
  std::int64_t number = 0;
  JobRecord job;
};

Row read_row(const SqliteRows& rows) {
  Row row;
  int column = 0;
  const auto text = [&] { return rows.text(column++); };
  const auto integer = [&] { return rows.integer(column++); };
  const auto real = [&] { return rows.real(column++); };
  row.number = integer();
  row.job.id = text();
  row.job.owner = text();
  row.job.client_token = text();
  row.job.name = text();
  row.job.scene_id = text();
  row.job.priority = int(integer());
  row.job.state = JobState(integer());
  row.job.target = JobState(integer());
  row.job.target_by = text();
  row.job.reason = text();
  row.job.attempt = std::uint32_t(integer());
  row.job.updated_seq = std::uint64_t(integer());
  row.job.submitted_s = real();
  row.job.started_s = real();
  row.job.ended_s = real();
  row.job.views = std::uint32_t(integer());
  row.job.views_done = std::uint32_t(integer());
  row.job.same_bits = integer() != 0;
  row.job.build = text();
  row.job.request_sha256 = text();
  row.job.summary = text();
  return row;
}

Result<std::vector<Row>> select_jobs(SqliteDatabase& database, std::string_view clause,
                                     std::initializer_list<SqliteValue> values) {
  auto rows = database.query(std::string(kSelectJob).append(clause), values);
  if (!rows) return rows.error();
  std::vector<Row> found;
  while (true) {
    const auto more = rows->next();
    if (!more) return more.error();
    if (!*more) return found;
    found.push_back(read_row(*rows));
  }
}

std::vector<JobRecord> records(std::vector<Row> rows) {
  std::vector<JobRecord> jobs;
  jobs.reserve(rows.size());
  for (Row& row : rows) jobs.push_back(std::move(row.job));
  return jobs;
}

Error no_job(const std::string& id) {
  return {ErrorCode::not_found, "there is no job '" + id + "'", "job_id"};
}

Result<Row> find_job(SqliteDatabase& database, const std::string& id) {
  auto found = select_jobs(database, "WHERE id = ?", {id});
  if (!found) return found.error();
  if (found->empty()) return no_job(id);
  return std::move(found->front());
}

std::string sha256_of(const std::string& bytes) {
  Sha256 hash;
  hash.update(bytes);
  return to_hex(hash.finish());
}

std::int64_t as_integer(JobState state) {
  return std::int64_t(state);
}

// Adds the event of the job's new state; its sequence number.
Result<std::uint64_t> add_event(CommitGroup::Transaction& transaction, std::int64_t number,
                                std::optional<JobState> from, const JobRecord& job, const std::string& by,
                                double time_s) {
  const Status added = transaction.database.run(
      "INSERT INTO events (job, from_state, to_state, reason, asked_by, attempt, time_s) VALUES (?, ?, ?, ?, ?, ?, ?)",
      {number, from ? as_integer(*from) : 0, as_integer(job.state), job.reason, by, std::int64_t(job.attempt), time_s});
  if (!added.ok()) return added.error();
  transaction.noteworthy = true;
  return std::uint64_t(transaction.database.last_insert_id());
}

std::string names_of(const std::vector<JobState>& states) {
  std::string names;
  for (const JobState state : states) names += (names.empty() ? "" : ", ") + std::string(to_string(state));
  return names;
}

// failed_precondition, unless the change may be made.
Status check_change(const JobRecord& job, const JobChange& change) {
  if (!change.from.empty() && std::find(change.from.begin(), change.from.end(), job.state) == change.from.end()) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("job '{}' is {}; only one that is {} becomes {} by this", job.id, to_string(job.state),
                             names_of(change.from), to_string(change.to)),
                 "job_id"};
  }
  if (may_follow(job.state, change.to)) return ok_status();
  if (job.state == change.to) {
    return Error{ErrorCode::failed_precondition, fmt::format("job '{}' is {} already", job.id, to_string(job.state)),
                 "job_id"};
  }
  std::vector<JobState> allowed;
  for (const JobState state : kJobStates) {
    if (may_follow(job.state, state)) allowed.push_back(state);
  }
  return Error{ErrorCode::failed_precondition,
               fmt::format("job '{}' is {}, which {} does not follow; allowed: {}", job.id, to_string(job.state),
                           to_string(change.to), allowed.empty() ? "nothing, it is at its end" : names_of(allowed)),
               "job_id"};
}

Error not_running(const JobRecord& job, const char* what) {
  return {ErrorCode::failed_precondition,
          fmt::format("job '{}' is {}; only a RUNNING one {}", job.id, to_string(job.state), what), "job_id"};
}

// Page tokens: the number of the last job of the page and the filter, both hexadecimal, with a '.' between.
struct PageToken {
  std::int64_t number = 0;
  unsigned filter = 0;

  std::string text() const { return fmt::format("{:x}.{:x}", number, filter); }
};

std::optional<PageToken> read_page_token(const std::string& text) {
  PageToken token;
  const char *begin = text.data(), *end = begin + text.size();
  const auto number = std::from_chars(begin, end, token.number, 16);
  if (number.ec != std::errc() || number.ptr == end || *number.ptr != '.' || token.number <= 0) return std::nullopt;
  const auto filter = std::from_chars(number.ptr + 1, end, token.filter, 16);
  if (filter.ec != std::errc() || filter.ptr != end) return std::nullopt;
  return token;
}

}  // namespace

struct JobTable::State {
  State(std::unique_ptr<SqliteDatabase> write, std::unique_ptr<SqliteDatabase> read)
      : writer(std::move(write)), reader(std::move(read)) {}

  // Runs `ask` on the reading connection, which sees one state of the table throughout.
  template <class Ask>
  auto read(Ask&& ask) -> decltype(ask(std::declval<SqliteDatabase&>())) {
    const std::lock_guard lock(mutex);
    if (reader->in_transaction()) (void)reader->execute("ROLLBACK");  // of an `ask` that threw
    if (const Status begun = reader->execute("BEGIN"); !begun.ok()) return begun.error();
    auto answer = ask(*reader);
    (void)reader->execute("COMMIT");
    return answer;
  }

  // Runs `change` in a transaction; what it answers once that is on the disk.
  template <class T>
  Result<T> write(const std::function<Result<T>(CommitGroup::Transaction&)>& change) {
    std::optional<T> answer;
    const Status done = writer.run([&](CommitGroup::Transaction& transaction) -> Status {
      auto made = change(transaction);
      if (!made) return made.error();
      answer = std::move(*made);
      return ok_status();
    });
    if (!done.ok()) return done.error();
    return std::move(*answer);
  }

  CommitGroup writer;
  std::mutex mutex;  // of reader; never held during a commit
  std::unique_ptr<SqliteDatabase> reader;
};

JobTable::JobTable(std::unique_ptr<State> state) : state_(std::move(state)) {}
JobTable::~JobTable() = default;

Result<std::unique_ptr<JobTable>> JobTable::open(const std::string& file, std::vector<std::string>& notices) {
  auto writer = open_versioned_database(file, kSchema, notices);
  if (!writer) return writer.error();
  auto reader = SqliteDatabase::open(file, SqliteDatabase::Access::read);
  if (!reader) return reader.error();
  return std::unique_ptr<JobTable>(new JobTable(std::make_unique<State>(std::move(*writer), std::move(*reader))));
}

void JobTable::on_events(std::function<void()> told) {
  state_->writer.on_noteworthy(std::move(told));
}

// The version of the schema is written again, to its page.
Status JobTable::probe() {
  const std::string statement = fmt::format("PRAGMA user_version = {}", std::size(kSteps));
  return state_->writer.run(
      [&](CommitGroup::Transaction& transaction) { return transaction.database.run(statement); });
}

Result<JobTable::Submitted> JobTable::submit(const JobRecord& job, int max_queued, const std::string& by) {
  if (job.id.empty()) return Error{ErrorCode::invalid_argument, "is empty; allowed: a unique name", "job_id"};
  return state_->write<Submitted>([&](CommitGroup::Transaction& transaction) -> Result<Submitted> {
    SqliteDatabase& database = transaction.database;
    if (!job.client_token.empty()) {
      auto known = select_jobs(database, kByToken, {job.owner, job.client_token});
      if (!known) return known.error();
      if (!known->empty()) {
        JobRecord& before = known->front().job;
        if (has_request(before, job.request)) return Submitted{std::move(before), true};
        return Error{ErrorCode::invalid_argument,
                     fmt::format("'{}' was used for another request, which is job '{}'; allowed: a token of its own "
                                 "for each request",
                                 job.client_token, before.id),
                     "client_token"};
      }
    }
    const auto taken = database.query_integer("SELECT count(*) FROM jobs WHERE id = ?", {job.id});
    if (!taken) return taken.error();
    if (*taken > 0) return Error{ErrorCode::invalid_argument, "'" + job.id + "' is taken", "job_id"};
    const auto queued = database.query_integer("SELECT sum(jobs) FROM job_counts WHERE state IN (1, 3)");
    if (!queued) return queued.error();
    if (*queued >= max_queued) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("max_queued_jobs: {} jobs are queued or paused; allowed: {}", *queued, max_queued), {}};
    }
    const bool is_long = !job.summary.empty() && job.summary != job.request;
    if (is_long) {
      const auto bytes = database.query_integer("SELECT bytes FROM request_bytes");
      if (!bytes) return bytes.error();
      if (std::uint64_t(*bytes) + job.request.size() > kMostRequestBytes) {
        return Error{ErrorCode::resource_exhausted,
                     fmt::format("the requests of jobs that are not at their end have {} bytes, this one {}; allowed: "
                                 "{} together; camera paths of fewer views have fewer",
                                 *bytes, job.request.size(), kMostRequestBytes),
                     {}};
      }
    }
    Submitted submitted{job};
    JobRecord& added = submitted.job;
    added.request.clear();
    if (!is_long) added.summary = job.request;
    added.request_sha256 = is_long ? sha256_of(job.request) : std::string();
    added.state = JobState::queued;
    added.target = JobState::succeeded;
    added.target_by.clear();
    added.reason.clear();
    added.build.clear();
    added.attempt = added.views_done = 0;
    added.same_bits = true;
    added.started_s = added.ended_s = 0;
    if (added.submitted_s == 0) added.submitted_s = unix_time_s();
    const Status inserted = database.run(
        "INSERT INTO jobs (id, owner, client_token, name, scene_id, priority, state, target, target_by, reason, "
        "attempt, updated_seq, submitted_s, started_s, ended_s, views, views_done, same_bits, build, request_sha256, "
        "summary) VALUES (?, ?, ?, ?, ?, ?, 1, 4, '', '', 0, 0, ?, 0, 0, ?, 0, 1, '', ?, ?)",
        {added.id, added.owner, added.client_token, added.name, added.scene_id, std::int64_t(added.priority),
         added.submitted_s, std::int64_t(added.views), added.request_sha256, SqliteBlob{added.summary}});
    if (!inserted.ok()) return inserted.error();
    const std::int64_t number = database.last_insert_id();
    if (is_long) {
      const Status kept =
          database.run("INSERT INTO requests (job, request) VALUES (?, ?)", {number, SqliteBlob{job.request}});
      if (!kept.ok()) return kept.error();
    }
    const auto seq = add_event(transaction, number, std::nullopt, added, by, added.submitted_s);
    if (!seq) return seq.error();
    added.updated_seq = *seq;
    const Status updated =
        database.run("UPDATE jobs SET updated_seq = ? WHERE number = ?", {std::int64_t(*seq), number});
    if (!updated.ok()) return updated.error();
    return submitted;
  });
}

Result<JobRecord> JobTable::change(const std::string& id, const JobChange& change) {
  return state_->write<JobRecord>([&](CommitGroup::Transaction& transaction) -> Result<JobRecord> {
    auto row = find_job(transaction.database, id);
    if (!row) return row.error();
    JobRecord& job = row->job;
    if (const Status allowed = check_change(job, change); !allowed.ok()) return allowed.error();
    // By people, who may do so without end; what the daemon does has its own bounds, and a pause that was accepted, or an
    // end, is always possible.
    if (!change.by.empty() && !is_final(change.to) && job.state != JobState::running) {
      const auto events =
          transaction.database.query_integer("SELECT count(*) FROM events WHERE job = ?", {row->number});
      if (!events) return events.error();
      if (*events >= kMostEvents) {
        return Error{ErrorCode::failed_precondition,
                     fmt::format("job '{}' has changed {} times; allowed: {}, then it can only be cancelled", id,
                                 *events, kMostEvents),
                     "job_id"};
      }
    }
    const JobState from = job.state;
    const double now = unix_time_s();
    // Whoever asked for a pause or a cancel was told that it comes.
    const bool owed = (job.target == JobState::canceled && !is_final(change.to)) ||
                      (job.target == JobState::paused && change.to == JobState::queued);
    const JobState to = from == JobState::running && owed ? job.target : change.to;
    const std::string by = (change.by.empty() || to != change.to) && to == job.target ? job.target_by : change.by;
    job.state = to;
    job.target = JobState::succeeded;
    job.target_by.clear();
    job.reason = change.reason;
    if (change.same_bits) job.same_bits = *change.same_bits;
    if (change.build) job.build = *change.build;
    if (job.state == JobState::running) {
      ++job.attempt;
      if (job.started_s == 0) job.started_s = now;
    }
    if (is_final(job.state)) job.ended_s = now;
    const auto seq = add_event(transaction, row->number, from, job, by, now);
    if (!seq) return seq.error();
    job.updated_seq = *seq;
    const Status updated = transaction.database.run(
        "UPDATE jobs SET state = ?, target = 4, target_by = '', reason = ?, attempt = ?, updated_seq = ?, "
        "started_s = ?, ended_s = ?, same_bits = ?, build = ? WHERE number = ?",
        {as_integer(job.state), job.reason, std::int64_t(job.attempt), std::int64_t(job.updated_seq), job.started_s,
         job.ended_s, std::int64_t(job.same_bits), job.build, row->number});
    if (!updated.ok()) return updated.error();
    if (is_final(job.state) && !job.request_sha256.empty()) {
      const Status removed = transaction.database.run("DELETE FROM requests WHERE job = ?", {row->number});
      if (!removed.ok()) return removed.error();
    }
    return std::move(job);
  });
}

Result<JobRecord> JobTable::set_target(const std::string& id, JobState target, const std::string& by) {
  if (target != JobState::paused && target != JobState::canceled && target != JobState::succeeded) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("{}; allowed: PAUSED, CANCELED, SUCCEEDED", to_string(target)), "target"};
  }
  return state_->write<JobRecord>([&](CommitGroup::Transaction& transaction) -> Result<JobRecord> {
    auto row = find_job(transaction.database, id);
    if (!row) return row.error();
    JobRecord& job = row->job;
    if (job.state != JobState::running) return not_running(job, "has a target");
    if (job.target == JobState::canceled && target == JobState::paused) {
      return Error{ErrorCode::failed_precondition,
                   fmt::format("job '{}' is being cancelled; it cannot be paused", job.id), "job_id"};
    }
    job.target = target;
    job.target_by = target == JobState::succeeded ? std::string() : by;
    const Status updated = transaction.database.run("UPDATE jobs SET target = ?, target_by = ? WHERE number = ?",
                                                    {as_integer(job.target), job.target_by, row->number});
    if (!updated.ok()) return updated.error();
    return std::move(job);
  });
}

Result<JobRecord> JobTable::set_priority(const std::string& id, int priority) {
  return state_->write<JobRecord>([&](CommitGroup::Transaction& transaction) -> Result<JobRecord> {
    auto row = find_job(transaction.database, id);
    if (!row) return row.error();
    JobRecord& job = row->job;
    if (is_final(job.state)) {
      return Error{ErrorCode::failed_precondition,
                   fmt::format("job '{}' is {}; a job at its end has no turn", id, to_string(job.state)), "job_id"};
    }
    job.priority = priority;
    const Status updated = transaction.database.run("UPDATE jobs SET priority = ? WHERE number = ?",
                                                    {std::int64_t(priority), row->number});
    if (!updated.ok()) return updated.error();
    return std::move(job);
  });
}

Status JobTable::add_result(const std::string& id, const JobResult& result) {
  return state_->writer.run([&](CommitGroup::Transaction& transaction) -> Status {
    SqliteDatabase& database = transaction.database;
    const auto row = find_job(database, id);
    if (!row) return row.error();
    if (row->job.state != JobState::running) return not_running(row->job, "gets results");
    if (result.view >= row->job.views) {
      return Error{ErrorCode::invalid_argument, fmt::format("{}; allowed: [0, {})", result.view, row->job.views),
                   "view"};
    }
    const Status added = database.run(
        "INSERT OR REPLACE INTO results (job, view_number, frame_end, file, bytes, sha256) VALUES (?, ?, ?, ?, ?, ?)",
        {row->number, std::int64_t(result.view), SqliteBlob{result.frame_end}, result.file, std::int64_t(result.bytes),
         result.sha256});
    if (!added.ok()) return added;
    return database.run(
        "UPDATE jobs SET views_done = (SELECT count(*) FROM results WHERE job = ?1) WHERE number = ?1", {row->number});
  });
}

Result<JobRecord> JobTable::get(const std::string& id) const {
  return state_->read([&](SqliteDatabase& database) -> Result<JobRecord> {
    auto row = find_job(database, id);
    if (!row) return row.error();
    return std::move(row->job);
  });
}

Result<std::string> JobTable::request(const std::string& id) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::string> {
    auto row = find_job(database, id);
    if (!row) return row.error();
    if (row->job.request_sha256.empty()) return std::move(row->job.summary);
    auto rows = database.query("SELECT request FROM requests WHERE job = ?", {row->number});
    if (!rows) return rows.error();
    const auto there = rows->next();
    if (!there) return there.error();
    if (*there) return rows->text(0);
    return Error{ErrorCode::failed_precondition,
                 fmt::format("job '{}' is {}; its request is gone", id, to_string(row->job.state)), "job_id"};
  });
}

bool JobTable::has_request(const JobRecord& job, const std::string& request) {
  return job.request_sha256.empty() ? job.summary == request : job.request_sha256 == sha256_of(request);
}

Result<std::optional<JobRecord>> JobTable::find_token(const std::string& owner, const std::string& client_token) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::optional<JobRecord>> {
    auto known = select_jobs(database, kByToken, {owner, client_token});
    if (!known) return known.error();
    if (known->empty()) return std::optional<JobRecord>();
    return std::optional(std::move(known->front().job));
  });
}

Result<std::uint64_t> JobTable::next_seq() const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::uint64_t> {
    const auto last =
        database.query_integer("SELECT coalesce((SELECT seq FROM sqlite_sequence WHERE name = 'events'), 0)", {});
    if (!last) return last.error();
    return std::uint64_t(*last) + 1;
  });
}

Result<std::vector<JobResult>> JobTable::results(const std::string& id) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::vector<JobResult>> {
    const auto job = find_job(database, id);
    if (!job) return job.error();
    auto rows = database.query(
        "SELECT view_number, frame_end, file, bytes, sha256 FROM results WHERE job = ? ORDER BY view_number",
        {job->number});
    if (!rows) return rows.error();
    std::vector<JobResult> results;
    while (true) {
      const auto more = rows->next();
      if (!more) return more.error();
      if (!*more) return results;
      results.push_back({std::uint32_t(rows->integer(0)), rows->text(1), rows->text(2), std::uint64_t(rows->integer(3)),
                         rows->text(4)});
    }
  });
}

Result<JobTable::Page> JobTable::list(const std::vector<JobState>& states, const std::string& after, int limit) const {
  HELIO_CHECK(limit >= 1);
  unsigned filter = 0;
  for (const JobState state : states) filter |= 1u << unsigned(state);
  if (filter == 0) {
    for (const JobState state : kJobStates) filter |= 1u << unsigned(state);
  }
  std::int64_t below = std::numeric_limits<std::int64_t>::max();
  if (!after.empty()) {
    const auto token = read_page_token(after);
    if (!token || token->filter != filter) {
      return Error{ErrorCode::invalid_argument,
                   fmt::format("'{}'; allowed: the token that the page before ended with, with the same states",
                               after.substr(0, 64)),
                   "page_token"};
    }
    below = token->number;
  }
  return state_->read([&](SqliteDatabase& database) -> Result<Page> {
    Page page;
    // The newest of each state by the index, then of all: a filter that few jobs pass costs no look at the others.
    std::vector<std::int64_t> numbers;
    for (const JobState state : kJobStates) {
      if ((filter & 1u << unsigned(state)) == 0) continue;
      const auto count = database.query_integer("SELECT jobs FROM job_counts WHERE state = ?", {as_integer(state)});
      if (!count) return count.error();
      page.total += std::uint64_t(*count);
      auto rows = database.query(
          "SELECT number FROM jobs WHERE state = ? AND number < ? ORDER BY number DESC LIMIT ?",
          {as_integer(state), below, std::int64_t(limit) + 1});
      if (!rows) return rows.error();
      while (true) {
        const auto more = rows->next();
        if (!more) return more.error();
        if (!*more) break;
        numbers.push_back(rows->integer(0));
      }
    }
    std::sort(numbers.begin(), numbers.end(), std::greater<>());
    if (numbers.size() > std::size_t(limit)) {
      numbers.resize(std::size_t(limit));
      page.next = PageToken{numbers.back(), filter}.text();
    }
    for (const std::int64_t number : numbers) {
      auto found = select_jobs(database, "WHERE number = ?", {number});
      if (!found) return found.error();
      for (Row& row : *found) page.jobs.push_back(std::move(row.job));
    }
    return page;
  });
}

Result<std::vector<JobEvent>> JobTable::events(const std::string& job_id, std::uint64_t from_seq, int limit) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::vector<JobEvent>> {
    constexpr std::uint64_t kMost = std::uint64_t(std::numeric_limits<std::int64_t>::max());
    const std::int64_t first = std::int64_t(std::min(from_seq, kMost));
    const std::string select =
        "SELECT seq, id, from_state, to_state, events.reason, asked_by, events.attempt, time_s "
        "FROM events JOIN jobs ON number = job WHERE ";
    auto rows = job_id.empty()
                    ? database.query(select + "seq >= ? ORDER BY seq LIMIT ?", {first, std::int64_t(limit)})
                    : database.query(select + "job = (SELECT number FROM jobs WHERE id = ?) AND seq >= ? "
                                              "ORDER BY seq LIMIT ?",
                                     {job_id, first, std::int64_t(limit)});
    if (!rows) return rows.error();
    std::vector<JobEvent> events;
    while (true) {
      const auto more = rows->next();
      if (!more) return more.error();
      if (!*more) return events;
      JobEvent event;
      event.seq = std::uint64_t(rows->integer(0));
      event.job_id = rows->text(1);
      if (const std::int64_t from = rows->integer(2); from != 0) event.from = JobState(from);
      event.to = JobState(rows->integer(3));
      event.reason = rows->text(4);
      event.by = rows->text(5);
      event.attempt = std::uint32_t(rows->integer(6));
      event.time_s = rows->real(7);
      events.push_back(std::move(event));
    }
  });
}

Result<std::uint64_t> JobTable::unfinished_of(const std::string& owner) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::uint64_t> {
    const auto count =
        database.query_integer("SELECT count(*) FROM jobs WHERE state IN (1, 2, 3) AND owner = ?", {owner});
    if (!count) return count.error();
    return std::uint64_t(*count);
  });
}

Result<std::optional<JobRecord>> JobTable::next_queued(const std::vector<std::string>& except) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::optional<JobRecord>> {
    // By itself SQLite finds the jobs by their state, and sorts the whole queue.
    auto rows = database.query(std::string(kSelectJob) +
                               "INDEXED BY jobs_by_turn WHERE state = 1 ORDER BY priority DESC, number");
    if (!rows) return rows.error();
    while (true) {
      const auto more = rows->next();
      if (!more) return more.error();
      if (!*more) return std::optional<JobRecord>();
      JobRecord job = read_row(*rows).job;
      if (std::find(except.begin(), except.end(), job.id) == except.end()) return std::optional(std::move(job));
    }
  });
}

Result<std::vector<JobRecord>> JobTable::in_state(JobState state) const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::vector<JobRecord>> {
    auto rows = select_jobs(database, "WHERE state = ? ORDER BY number", {as_integer(state)});
    if (!rows) return rows.error();
    return records(std::move(*rows));
  });
}

Result<std::vector<std::uint64_t>> JobTable::counts() const {
  return state_->read([&](SqliteDatabase& database) -> Result<std::vector<std::uint64_t>> {
    std::vector<std::uint64_t> counts(kJobStates.size() + 1);
    for (const JobState state : kJobStates) {
      const auto count = database.query_integer("SELECT jobs FROM job_counts WHERE state = ?", {as_integer(state)});
      if (!count) return count.error();
      counts[std::size_t(state)] = std::uint64_t(*count);
    }
    return counts;
  });
}

Result<std::vector<std::string>> JobTable::forget_ended(const Kept& kept) {
  using Ids = std::vector<std::string>;
  const std::string prefix = kept.folder + "/";  // bound as it is, until the last row
  // The newest that fit, in all of them; the first that does not fit, and all older ones, go.
  const auto oldest = state_->read([&](SqliteDatabase& database) -> Result<double> {
    auto rows = database.query(
        "SELECT ended_s, (SELECT coalesce(sum(bytes), 0) FROM results WHERE job = number AND "
        "substr(file, 1, length(?1)) = ?1) FROM jobs WHERE ended_s > 0 ORDER BY ended_s DESC",
        {prefix});
    if (!rows) return rows.error();
    double since_s = kept.since_s;
    std::uint64_t jobs = 0, bytes = 0;
    while (true) {
      const auto more = rows->next();
      if (!more) return more.error();
      if (!*more) return since_s;
      const auto own = std::uint64_t(rows->integer(1));
      bytes += own;
      if (++jobs > kept.jobs || (jobs > 1 && own > 0 && bytes > kept.bytes))
        return std::max(since_s, std::nextafter(rows->real(0), HUGE_VAL));
    }
  });
  if (!oldest) return oldest.error();
  return state_->write<Ids>([&](CommitGroup::Transaction& transaction) -> Result<Ids> {
    auto rows =
        transaction.database.query("DELETE FROM jobs WHERE ended_s > 0 AND ended_s < ? RETURNING id", {*oldest});
    if (!rows) return rows.error();
    Ids ids;
    while (true) {
      const auto more = rows->next();
      if (!more) return more.error();
      if (!*more) return ids;
      ids.push_back(rows->text(0));
    }
  });
}

}  // namespace helio
