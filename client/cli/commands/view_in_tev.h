// The scene's own camera in tev, beside the viewer's page.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "client/cli/terminal.h"
#include "client/render_client.h"
#include "client/tev/tev_bridge.h"

namespace helio::cli {

// Frames of the page's session go to the page alone, since a session has one listener. So this is a job: it renders
// what the scene's first camera sees, to kSamples a pixel, and jobs together have a ninth of the machine while a page
// works.
class ViewInTev {
 public:
  static constexpr int kSamples = 1024;

  // Starts at once. Warns on the terminal, as a job that fails does. `server`: the daemon's address; empty: in process.
  // All of these have to outlive this object.
  ViewInTev(RenderClient& client, const heliograph::v1::SceneInfo& scene, const std::string& scene_name,
            const std::string& server, const TevAddress& address, Terminal& terminal);
  ~ViewInTev();  // cancels the job
  ViewInTev(const ViewInTev&) = delete;
  ViewInTev& operator=(const ViewInTev&) = delete;

  const std::string& camera() const { return camera_; }
  void cancel();  // from any thread
  void wait();    // until the job has ended

 private:
  void run(const heliograph::v1::RunJobRequest& request);

  RenderClient& client_;
  const std::string scene_name_;
  Terminal& terminal_;
  std::string camera_;
  CallControl control_;
  std::unique_ptr<TevBridge> tev_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool cancelled_ = false, over_ = false;
  std::thread thread_;  // last: it uses what is above
};

}  // namespace helio::cli
