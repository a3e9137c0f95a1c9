// The jobs of a daemon as they are now, kept up to date by what a watch tells of them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "heliograph/v1/durable_job.pb.h"

namespace helio {

// Share of the job that is done, [0, 1]: whole views, and the share of its budget that the one in hand has used.
double done_share(const heliograph::v1::Job& job);

// Not thread safe.
class JobBoard {
 public:
  // A job as a call or a watch told it. What an event has told since counts more.
  void take(const heliograph::v1::Job& job);
  // False: the job is not known yet, and has to be asked for.
  bool take(const heliograph::v1::JobEvent& event);

  // Those that run, the longest first; those that wait, in the order of their turns; those that are paused; of those
  // that are over the newest, at most `most_over`.
  std::vector<heliograph::v1::Job> rows(std::size_t most_over) const;
  // Forgets those that are over, but for the newest: at most `most_over` stay.
  void forget_over(std::size_t most_over);
  std::size_t count(heliograph::v1::JobState state) const;

 private:
  std::map<std::string, heliograph::v1::Job> jobs_;  // by id
};

}  // namespace helio
