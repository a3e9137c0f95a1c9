// Memory that is out, wherever a worker or an update asks for it: that picture fails and says so, the next one is as it
// would have been.
#include <gtest/gtest.h>

#include <new>
#include <thread>

#include "tests/support/failing_allocations.h"
#include "tests/support/loop_views.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

struct Course {
  const char* name;
  RenderMode mode;
  Integrator integrator;
  ModeVariant variant = ModeVariant::bounded;
};

void PrintTo(const Course& course, std::ostream* out) {
  *out << course.name;
}

class FailedAllocation : public testing::TestWithParam<Course> {
 protected:
  FailedAllocation() {
    settings_.width = 32;
    settings_.height = 24;
    settings_.mode = GetParam().mode;
    settings_.variant = GetParam().variant;
    settings_.integrator = GetParam().integrator;
    settings_.max_segments = 4;
    settings_.adaptive.min_samples = 2;
    options_.tile_size = 16;
    options_.publish_passes = true;
    options_.publish_interval_s = 1e6;
  }

  std::shared_ptr<const RenderScene> scene_ = build(lambert_room());
  RenderSettings settings_;
  RenderLoopOptions options_;
  CameraPose here_ = camera_at({0, 0, 0.95}, {0, -0.2, -1}, 75), there_ = turned_and_shifted(here_, 3, 0.02);
};

constexpr std::uint32_t kSamples = 4;

TEST_P(FailedAllocation, OfAWorkerFailsThePictureAndOnlyIt) {
  const ExemptFromFailing exempt;
  RenderEngine engine(2);
  const ViewPicture expected = LoopViews(engine, scene_, settings_, options_).render(there_, kSamples);
  LoopViews views(engine, scene_, settings_, options_);
  LoopViews other(engine, scene_, settings_, options_);
  std::uint64_t first = 1, failed = 0;
  for (bool thrown = true; thrown && first < 100000; first += 1 + first / 3) {
    FrameEnd end;
    {
      views.render(here_, kSamples);  // so that what follows has a picture to draw on
      const FailingAllocations failing(first);
      end = views.render(there_, kSamples).end;
      thrown = failing.thrown() > 0;
    }
    if (end.reason != FrameEndReason::failed) {
      EXPECT_EQ(end.reason, FrameEndReason::samples) << first;
      EXPECT_TRUE(reuses(settings_.mode) || same_pixels(views.render(there_, kSamples), expected)) << first;
      continue;
    }
    EXPECT_TRUE(thrown);
    EXPECT_EQ(end.message, "out of memory") << first;
    ++failed;
    if (failed % 4 == 0) {
      EXPECT_TRUE(same_pixels(views.render(there_, kSamples), expected)) << first;
    }
  }
  EXPECT_GE(failed, 5u);
  EXPECT_TRUE(same_pixels(other.render(there_, kSamples), expected));
}

TEST_P(FailedAllocation, OfAnUpdateChangesNothing) {
  const ExemptFromFailing exempt;
  RenderEngine engine(2);
  LoopViews views(engine, scene_, settings_, options_);
  views.render(there_, kSamples);
  RenderLoop::Update update;
  update.view = View{77, here_, 0, 0};
  update.settings = settings_;
  update.settings->width = 24;
  update.scene = build(lambert_room());
  const std::uint64_t revision = views.loop().revision();
  std::uint64_t first = 1;
  for (;; ++first) {
    ASSERT_LT(first, 1000u);
    FailingAllocations failing(first);
    std::thread caller([&] {  // which is not exempt
      try {
        views.loop().update(update);
      } catch (const std::bad_alloc&) {
      }
    });
    caller.join();
    if (views.loop().revision() != revision) break;
    EXPECT_GT(failing.thrown(), 0u);
  }
  EXPECT_GT(first, 3u);
}

INSTANTIATE_TEST_SUITE_P(Courses, FailedAllocation,
                         testing::Values(Course{"pt", RenderMode::pt, Integrator::path},
                                         Course{"bdpt", RenderMode::pt, Integrator::bdpt},
                                         Course{"pt_bdpt", RenderMode::pt, Integrator::pt_bdpt},
                                         Course{"vcm", RenderMode::pt, Integrator::vcm},
                                         Course{"adaptive", RenderMode::adaptive, Integrator::path},
                                         Course{"combined", RenderMode::combined, Integrator::path},
                                         Course{"paper", RenderMode::combined, Integrator::path, ModeVariant::paper}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace helio::test
