// The engine, a session, the loader and the render loop through a session's life, without gRPC, while one allocation
// after the other fails: each of the first 3,000 once, then each 101st. A request may fail. The process lives, the
// session's place is free afterwards, and the memory account is back at zero.
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>

#include "heliograph/v1/picture_origin.pb.h"
#include "server/base/arena_message.h"
#include "server/base/guarded.h"
#include "server/base/parse_message.h"
#include "server/jobs/message_json.h"
#include "server/sessions/service_core.h"
#include "server/stream/convert.h"
#include "server/stream/stream_messages.h"
#include "tests/support/failing_allocations.h"

namespace helio::test {
namespace {

namespace pb = heliograph::v1;

// A square that shines and a second instance of it, and a camera before them.
constexpr char kScene[] = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
 "nodes": [{"mesh": 0}, {"camera": 0, "name": "front", "translation": [0, 0, 3]},
   {"mesh": 0, "translation": [0, 1, -1]}],
 "cameras": [{"name": "front", "type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
 "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 1, 1]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
   {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
 "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAACAPwAAgD8AAAAAAACAvwAAgD8AAAAAAAABAAIAAAACAAMA"}]})";

SceneRequest scene_request() {
  SceneBundle bundle;
  bundle.main_file = "quad.gltf";
  const std::string gltf = kScene;
  bundle.files.push_back({bundle.main_file, {gltf.begin(), gltf.end()}});
  Sha256 hash;
  hash.update(gltf);
  bundle.digests[bundle.main_file] = hash.finish();
  SceneRequest request;
  request.files = std::move(bundle);
  return request;
}

pb::View view(std::uint64_t id, double x) {
  pb::View view;
  view.set_id(id);
  view.mutable_camera()->mutable_position()->set_x(x);
  view.mutable_camera()->mutable_position()->set_z(3);
  view.mutable_camera()->mutable_look_at()->mutable_target();
  view.mutable_camera()->set_aspect(2);  // pictures have a notice
  return view;
}

// Stands for a client: nothing is sent, and the ends of frames are counted.
class Listener final : public OutboundStream::Call {
 public:
  explicit Listener(TimerQueue& timers)
      : stream_(std::make_shared<OutboundStream>(
            *this,
            [this](Outbound message) {
              if (const auto* report = std::get_if<FrameReport>(&message)) {
                const std::lock_guard lock(mutex_);
                ++ends_;
                failed_ |= report->end.reason == FrameEndReason::failed;
                changed_.notify_all();
              }
              return grpc::ByteBuffer();
            },
            timers)) {}

  const std::shared_ptr<OutboundStream>& stream() { return stream_; }
  bool wait_for_ends(int ends) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(10), [&] { return ends_ >= ends || finished_; });
  }
  // A frame or the call.
  bool failed() {
    const std::lock_guard lock(mutex_);
    return failed_ || finished_;
  }
  void start_write(const grpc::ByteBuffer*) override {}
  void finish(const grpc::Status&) override {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int ends_ = 0;
  bool failed_ = false, finished_ = false;
  std::shared_ptr<OutboundStream> stream_;
};

class FailedAllocations : public testing::Test {
 protected:
  FailedAllocations() {
    spdlog::set_level(spdlog::level::off);
    small_.set_width(8);
    small_.set_height(8);
    large_.set_width(16);
    large_.set_height(12);
    large_.set_mode(pb::MODE_COMBINED);
    large_.set_integrator(pb::INTEGRATOR_PT_BDPT);
    MaterialEdit red;
    red.target = 0u;
    red.emission = Rgb(2, 0, 0);
    edits_.emplace_back(red);
    one_sample_.samples = 1;
    ServerConfig config;
    config.max_sessions = 1;
    config.max_scenes = 2;
    config.render_threads = 2;
    config.max_memory = 1ull << 30;
    core_.emplace(complete(config), *SceneRoots::open({}));
  }

  // Its allocation of this number fails; 0: none. The error of the request that failed, if one did.
  std::optional<Error> live(std::uint64_t failing) {
    SceneRequest request = scene_request();
    has_scene_ = has_session_ = false;
    std::optional<Listener> listener(core_->timers);
    Status done = ok_status();
    {
      const FailingAllocations allocations(failing);
      done = guarded([&] { return steps(std::move(request), *listener); });
      seen_ = allocations.seen();
    }
    // A session or scene that the client was not told of is not there.
    EXPECT_TRUE(has_scene_ || core_->scenes.list().empty());
    EXPECT_TRUE(has_session_ || core_->sessions.list().empty());
    for (const auto& session : core_->sessions.list()) {
      session->detach(listener->stream().get());
      EXPECT_TRUE(core_->sessions.close(session->id(), "", grpc::Status::OK).ok());
    }
    listener->stream()->finish(grpc::Status::OK);
    // The session lets go of its scene at once, though not of its memory.
    for (const auto& scene : core_->scenes.list()) EXPECT_TRUE(core_->scenes.unload(scene->id, "").ok());
    core_->reaper.wait_until_idle();
    if (done.ok()) return std::nullopt;
    return done.error();
  }

  Status steps(SceneRequest request, Listener& listener) {
    auto loaded = core_->scenes.load(std::move(request), CancelToken());
    if (!loaded) return loaded.error();
    has_scene_ = true;
    loaded_id_ = loaded->scene->id;
    loaded->scene.reset();
    auto scene = core_->scenes.acquire(loaded_id_, "scene_id");
    if (!scene) return scene.error();
    auto created = core_->sessions.create(core_->resources(), std::move(*scene), read(small_), one_sample_, 60,
                                          core_->render_limits());
    if (!created) return created.error();
    const std::shared_ptr<Session> session = *created;
    has_session_ = true;
    if (const Status attached = session->attach(listener.stream(), TileFormat()); !attached.ok()) return attached;
    const auto show = [&](Session::Change change, int frame) -> Status {
      change.view = &views_[frame];
      const auto revision = session->update(change);
      if (!revision) return revision.error();
      EXPECT_TRUE(listener.wait_for_ends(frame + 1)) << "frame " << frame << " does not end";
      if (listener.failed()) return Error{ErrorCode::internal, "the frame failed", {}};
      return ok_status();
    };
    Session::Change resize, edit;
    if (const Status shown = show({}, 0); !shown.ok()) return shown;
    resize.settings = &large_;
    if (const Status shown = show(resize, 1); !shown.ok()) return shown;
    if (const Status shown = show({}, 2); !shown.ok()) return shown;  // draws on the picture before
    auto base = core_->scenes.acquire(loaded_id_, "scene_id");
    if (!base) return base.error();
    auto edited = core_->scenes.edit(*base, edits_, CancelToken());
    if (!edited) return edited.error();
    auto lease = core_->scenes.acquire(edited->scene->id, "scene_id");
    if (!lease) return lease.error();
    SceneLease shown_scene = std::move(*lease);
    edit.scene = &shown_scene;
    if (const Status shown = show(edit, 3); !shown.ok()) return shown;
    session->detach(listener.stream().get());
    if (const Status attached = session->attach(listener.stream(), TileFormat()); !attached.ok()) return attached;
    EXPECT_TRUE(listener.wait_for_ends(5)) << "the picture is not shown again";
    session->detach(listener.stream().get());
    return core_->sessions.close(session->id(), "", grpc::Status::OK);
  }

  RenderSettings read(const pb::RenderSettings& message) const {
    Problems problems;
    return read_settings(message, core_->render_limits(), "settings", problems);
  }

  pb::RenderSettings small_, large_;
  const pb::View views_[4] = {view(1, 0), view(2, 0), view(3, 0.05), view(4, 0.05)};
  std::vector<SceneEdit> edits_;
  std::string loaded_id_;
  Budget one_sample_;
  std::uint64_t seen_ = 0;                          // allocations of the newest life
  bool has_scene_ = false, has_session_ = false;  // the client was told so
  std::optional<ServiceCore> core_;
};

TEST_F(FailedAllocations, EndARequestAndNothingElse) {
  for (int i = 0; i < 3; ++i) {  // what is made once is made
    const auto failed = live(0);
    ASSERT_FALSE(failed) << failed->to_string();
  }
  const std::uint64_t in_a_life = seen_;
  int failed_requests = 0, lives = 0;
  for (std::uint64_t fails = 1;; fails += fails < 3000 ? 1 : 101) {
    const auto failed = live(fails);
    ++lives;
    if (failed) {
      ++failed_requests;
      for (const char* limit : {"max_sessions", "max_scenes", "max_memory:"}) {  // that a leak would have used up
        ASSERT_EQ(failed->to_string().find(limit), std::string::npos) << fails << ": " << failed->to_string();
      }
    }
    ASSERT_EQ(core_->memory.used(), 0u) << "allocation " << fails;
    ASSERT_TRUE(core_->sessions.list().empty()) << "allocation " << fails;
    ASSERT_TRUE(core_->scenes.list().empty()) << "allocation " << fails;
    ASSERT_FALSE(HasFailure()) << "allocation " << fails;
    if (seen_ < fails) break;
  }
  std::printf("%llu allocations in a life; of %d lives %d had a request that failed\n",
              static_cast<unsigned long long>(in_a_life), lives, failed_requests);
  EXPECT_GT(lives, 500);
  EXPECT_GT(failed_requests, lives / 2);
  EXPECT_FALSE(live(0));
}

// What catches the lack of memory has none itself.
TEST(Guarded, NeedsNoMemory) {
  const std::runtime_error long_one(std::string(100, 'x'));
  const auto message_of = [](auto exception) {
    const FailingAllocations all(1, 1);
    return guarded([&]() -> Status { throw exception; }).error();
  };
  for (const Error& error : {message_of(std::bad_alloc()), message_of(long_one)})
    EXPECT_EQ(error.message, "out of memory");
  EXPECT_EQ(guarded([]() -> Status { throw std::bad_alloc(); }).error().message,
            "the machine's memory is used up, although max_memory is not");
}

// Requests are read and answers written while one allocation after the other fails.
TEST(FailedAllocationsOfMessages, EndTheMessageAlone) {
  const auto bytes_of = [](const google::protobuf::MessageLite& message) {
    const grpc::Slice slice(message.SerializeAsString());
    return grpc::ByteBuffer(&slice, 1);
  };
  const std::string long_name(100, 'n');
  pb::StreamRequest moved;
  *moved.mutable_view() = view(1, 0);
  pb::EditSceneRequest edited;
  edited.add_edits()->mutable_object()->set_name(long_name);
  edited.add_edits()->mutable_material()->set_name(long_name);
  pb::RunJobRequest job;
  *job.add_views() = view(1, 0).camera();
  const auto read = [&]<class Request>(const Request& request) {
    grpc::ByteBuffer bytes = bytes_of(request);
    std::uint64_t failing = 0;
    for (bool threw = true; threw && failing < 1000;) {
      const FailingAllocations allocations(++failing);
      try {
        ArenaMessage<Request> message;
        static_cast<void>(parse_message(bytes, *message));
      } catch (const std::bad_alloc&) {
      }
      threw = allocations.thrown() > 0;
    }
    EXPECT_GT(failing, 2u);
    EXPECT_LT(failing, 1000u);
  };
  read(moved);
  read(edited);
  read(job);

  FrameBegin begin;
  begin.notice = long_name;
  const auto written = [&](const Outbound& outbound) {
    std::uint64_t failing = 0;
    for (bool threw = true; threw && failing < 1000;) {
      Outbound copy = outbound;
      const FailingAllocations allocations(++failing);
      try {
        static_cast<void>(to_stream_response(std::move(copy), long_name));
      } catch (const std::bad_alloc&) {
      }
      threw = allocations.thrown() > 0;
    }
    EXPECT_GT(failing, 2u);
    EXPECT_LT(failing, 1000u);
  };
  written(begin);
  written(FrameProgress());
  written(Notice{NoticeSeverity::warning, long_name});
}

// JSON grows while it is written: what it lacks then is thrown, and the text is whole or none.
TEST(FailedAllocationsOfJson, EndTheTextAlone) {
  pb::PictureOrigin origin;
  origin.set_scene_id(std::string(5000, 's'));
  origin.set_samples_per_pixel(4);
  const std::string whole = *to_json(origin);
  EXPECT_GT(whole.size(), 5000u);
  std::uint64_t failing = 0;
  int texts = 0;
  for (bool threw = true; threw && failing < 10000;) {
    const FailingAllocations allocations(++failing);
    try {
      const auto json = to_json(origin);
      threw = allocations.thrown() > 0;
      ASSERT_TRUE(json.ok());
      ++texts;
      EXPECT_EQ(*json, whole) << failing;
    } catch (const std::bad_alloc&) {
      threw = true;
    }
  }
  EXPECT_GT(failing, 20u);
  EXPECT_LT(failing, 10000u);
  EXPECT_GE(texts, 1);
}

}  // namespace
}  // namespace helio::test
