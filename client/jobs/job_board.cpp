#include "client/jobs/job_board.h"

#include <algorithm>
#include <tuple>

#include "client/jobs/job_client.h"

namespace helio {

namespace pb = heliograph::v1;

namespace {

int place_of(pb::JobState state) {
  if (state == pb::JOB_STATE_RUNNING) return 0;
  if (state == pb::JOB_STATE_QUEUED) return 1;
  return is_over(state) ? 3 : 2;
}

// Jobs of one place by what counts there: priority, then time.
std::tuple<int, int, double, std::string> order_of(const pb::Job& job) {
  const int place = place_of(job.state());
  const double time = place == 0 ? job.started_s() : place == 3 ? -job.ended_s() : job.submitted_s();
  return {place, place == 1 ? -job.priority() : 0, time, job.job_id()};
}

}  // namespace

double done_share(const pb::Job& job) {
  if (job.state() == pb::JOB_STATE_SUCCEEDED) return 1;
  const double views = std::max(1u, job.views());
  const bool in_hand = job.has_progress() && job.views_done() < job.views();
  const double part = in_hand ? std::clamp(job.progress().budget_used(), 0.0, 1.0) : 0;
  return std::min(1.0, (job.views_done() + part) / views);
}

void JobBoard::take(const pb::Job& job) {
  pb::Job& known = jobs_[job.job_id()];
  if (job.updated_seq() >= known.updated_seq()) known = job;
}

bool JobBoard::take(const pb::JobEvent& event) {
  const auto found = jobs_.find(event.job_id());
  if (found == jobs_.end()) return false;
  pb::Job& job = found->second;
  if (event.seq() <= job.updated_seq()) return true;
  job.set_updated_seq(event.seq());
  job.set_state(event.to());
  job.set_target_state(is_over(event.to()) ? event.to() : pb::JOB_STATE_SUCCEEDED);
  job.set_reason(event.reason());
  job.set_attempt(event.attempt());
  if (event.to() == pb::JOB_STATE_RUNNING && job.started_s() == 0) job.set_started_s(event.time_s());
  if (event.to() != pb::JOB_STATE_RUNNING) job.clear_left();
  if (event.to() == pb::JOB_STATE_SUCCEEDED) job.set_views_done(job.views());
  if (is_over(event.to())) job.set_ended_s(event.time_s());
  return true;
}

std::vector<pb::Job> JobBoard::rows(std::size_t most_over) const {
  std::vector<pb::Job> rows;
  for (const auto& [id, job] : jobs_) rows.push_back(job);
  std::sort(rows.begin(), rows.end(), [](const pb::Job& a, const pb::Job& b) { return order_of(a) < order_of(b); });
  const auto over = std::find_if(rows.begin(), rows.end(), [](const pb::Job& job) { return is_over(job.state()); });
  const auto kept = std::min<std::size_t>(most_over, std::size_t(rows.end() - over));
  rows.resize(std::size_t(over - rows.begin()) + kept);
  return rows;
}

void JobBoard::forget_over(std::size_t most_over) {
  std::vector<std::tuple<double, std::string>> over;  // the newest first
  for (const auto& [id, job] : jobs_)
    if (is_over(job.state())) over.emplace_back(-job.ended_s(), id);
  if (over.size() <= most_over) return;
  std::sort(over.begin(), over.end());
  for (std::size_t i = most_over; i < over.size(); ++i) jobs_.erase(std::get<std::string>(over[i]));
}

std::size_t JobBoard::count(pb::JobState state) const {
  return std::size_t(
      std::count_if(jobs_.begin(), jobs_.end(), [&](const auto& entry) { return entry.second.state() == state; }));
}

}  // namespace helio
