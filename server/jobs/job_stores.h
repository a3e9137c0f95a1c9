// What the jobs that the daemon keeps are made of: the service, and the stores of its state folder.
#pragma once

#include <mutex>
#include <string>

#include "server/jobs/output_roots.h"
#include "server/sessions/service_core.h"
#include "server/state/checkpoint_files.h"
#include "server/state/job_table.h"
#include "server/state/scene_store.h"

namespace helio {

struct JobStores {
  ServiceCore& core;
  JobTable& table;
  CheckpointFiles& checkpoints;
  SceneStore& scenes;
  const OutputRoots& outputs;
  const std::string results;          // folder of the pictures that the daemon keeps
  const double checkpoint_interval_s;
  std::mutex loading;                 // one job loads its scene at a time
};

// Of a job's kept pictures, which are VIEW.exr in it.
inline std::string result_folder(const std::string& results, const std::string& job_id) {
  return results + "/" + job_id;
}

}  // namespace helio
