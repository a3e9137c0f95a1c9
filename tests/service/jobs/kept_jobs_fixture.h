// A daemon of a test's own with a state folder, and what the tests of kept jobs ask of it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "process.h"
#include "service_fixture.h"

namespace helio::test {

class KeptJobsTest : public ServiceTest {
 protected:
  // A daemon with the test's state folder and, as output root, the folder `out` in it.
  void start_daemon(const std::function<void(ServerConfig&)>& change = {});
  // The daemon stops as by SIGTERM, or not at all by itself; then another one takes up its folder.
  void restart(double grace_s = 10, const std::function<void(ServerConfig&)>& change = {});
  // Loads one of the project's own scenes.
  std::string load_scene(const std::string& name = "cornell-box");

  pb::SubmitJobRequest request(const std::string& scene_id, int size, std::uint32_t samples) const;
  grpc::Status submit(const pb::SubmitJobRequest& request, pb::SubmitJobResponse* response);
  std::string submitted(const pb::SubmitJobRequest& request);  // its id
  pb::Job job(const std::string& id);
  // Waits until the job is in this state, or at an end; as it is then.
  pb::Job wait_for(const std::string& id, pb::JobState state);
  // Waits until so many samples a pixel of the view in hand are there, or the job runs no longer.
  void wait_for_samples(const std::string& id, std::uint32_t samples);
  grpc::Status pause(const std::string& id);
  grpc::Status resume(const std::string& id);
  grpc::Status cancel(const std::string& id);
  std::vector<pb::JobEvent> events(const std::string& id);  // of a job at its end
  // The file of a view; expects that its bytes and hash are those that were announced.
  std::string result(const std::string& id, std::uint32_t view = 0);
  grpc::Status fetch(const std::string& id, std::uint32_t view, std::string* file);
  std::string out(const std::string& name) const { return folder_ / ("out/" + name); }

  TemporaryFolder folder_;
};

// Whether two EXR files hold the same channels and bits.
bool same_picture(const std::string& a, const std::string& b);

}  // namespace helio::test
