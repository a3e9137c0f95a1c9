// Sessions between two daemons: one that drains writes them down with the samples of their pictures, the next one makes
// them again under their ids.
//
// A session is a file of CheckpointFiles: the header is a SessionRecord, the body a PictureCheckpoint or nothing. Its
// scene is held in the SceneStore like a job's. Both go once the session was taken up or is too old for that.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/session_record.h"
#include "server/sessions/service_core.h"
#include "server/state/checkpoint_files.h"
#include "server/state/scene_store.h"

namespace helio {

class SessionKeeper {
 public:
  // The scenes may be opened later.
  SessionKeeper(ServiceCore& core, const std::string& folder, SceneStore& scenes)
      : core_(core), files_(folder), scenes_(scenes) {}
  ~SessionKeeper();  // precondition: no task of the loader and the placer goes on
  SessionKeeper(const SessionKeeper&) = delete;

  // Finds what an earlier daemon has kept. Records that are damaged or older than their sessions' grace are told in
  // `notices` and removed. Errors: those of CheckpointFiles::open().
  Status open(std::vector<std::string>& notices);
  // The scenes of what was found.
  std::vector<SceneStore::Held> held() const;
  // Takes the sessions up, one after the other, on the thread that loads scenes; loads that are asked for come between.
  // Until then callers are told to wait.
  void begin();

  // Of a daemon that drains: all sessions are frozen (Session::freeze()), and then kept, on threads of their own, those
  // with a listener first. Their listeners' calls end, with UNAVAILABLE and what became of them.
  // Precondition: the core says that it drains. deadline_s: now_s() clock: no picture is copied after it. Once.
  void keep_all(double deadline_s);
  // False: not all are kept by then.
  bool wait_until_kept(double deadline_s);

 private:
  struct Found {
    std::string id;
    SessionRecord record;
  };

  void take_up_next();
  void take_up(const Found& found);
  Status make_again(const Found& found);
  void keep(Session& session, double deadline_s);
  std::string keep_picture(Session& session, SessionRecord& record, const Session::State& state, double deadline_s);

  ServiceCore& core_;
  CheckpointFiles files_;
  SceneStore& scenes_;
  std::vector<Found> found_;  // not yet taken up, in reverse order; after begin(): of the task in hand
  std::mutex removing_;  // held while the files of a session go that was taken up
  // What a timer that may come late looks at.
  struct Life {
    std::mutex mutex;
    bool over = false;
  };
  const std::shared_ptr<Life> life_ = std::make_shared<Life>();

  std::vector<std::shared_ptr<Session>> sessions_;  // to be kept
  std::atomic<std::size_t> next_ = 0, kept_ = 0;    // of them
  std::atomic<std::uint64_t> bytes_ = 0;            // of their pictures
  std::vector<std::thread> keepers_;
};

}  // namespace helio
