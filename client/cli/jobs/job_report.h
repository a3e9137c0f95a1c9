// Jobs of a daemon as JSON, and as lines and tables to read.
#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal.h"
#include "heliograph/v1/durable_job.pb.h"

namespace helio::cli {

// "running", "succeeded", ...
std::string state_name(heliograph::v1::JobState state);
std::vector<std::string> state_names();

// job_id, name, state, target_state, reason, scene_id, priority, attempt, views, views_done, done (share, [0, 1]),
// submitted_s, started_s, ended_s, checkpoint_s (Unix time; null: not yet), same_bits, require_same_bits, owner,
// output, samples, samples_per_second, estimated_rmse (null where unknown), left_s {estimate, low, high} or null,
// width, height, settings and budget (as in the protocol), results: [{view, file, bytes, sha256, ended_by, ...}].
Json to_json(const heliograph::v1::Job& job);

// All that is known of a job, a line each.
std::vector<std::string> describe(const heliograph::v1::Job& job, double now_s);
// "running, 42 %, 3.1 M samples/s, 2 min 10 s left (1 min 40 s to 3 min 00 s)"
std::string describe_progress(const heliograph::v1::Job& job);
// "queued -> running (attempt 2)", with reason and who asked for it.
std::string describe(const heliograph::v1::JobEvent& event);
// "12 min 05 s (9 min 40 s to 15 min 10 s)"; empty: not known.
std::string left_text(const heliograph::v1::Job& job);

// A heading and a line for each job. `columns`: that a line may have, at least 40; 0: as many as it needs.
std::vector<std::string> job_table(const std::vector<heliograph::v1::Job>& jobs, double now_s, int columns);
// The table of a live display: bars of progress, pace and time left.
std::vector<std::string> live_table(const std::vector<heliograph::v1::Job>& jobs, double now_s, int columns);

// "[#####-----]"
std::string bar(double share, int width);
// At most `width` characters of UTF-8 text, the last three "..." where it is cut; control characters become spaces.
std::string fit(const std::string& text, std::size_t width);
// The beginning of each job's id that no other listed job has, at least 10 characters.
std::vector<std::string> short_ids(const std::vector<heliograph::v1::Job>& jobs);

}  // namespace helio::cli
