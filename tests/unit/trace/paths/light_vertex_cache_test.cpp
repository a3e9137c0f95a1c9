#include "renderer/trace/paths/light_vertex_cache.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "renderer/film/splats/splat_buffer.h"
#include "tests/support/light_cache.h"
#include "tests/support/own_scenes.h"

namespace helio::test {
namespace {

constexpr int kSide = 32;
constexpr std::uint64_t kPaths = 1000;  // the last batch is cut short

class LightVertexCacheTest : public testing::Test {
 protected:
  void SetUp() override {
    scene_ = load_own_scene("cornell-spheres");
    ASSERT_TRUE(scene_);
    settings_.integrator = Integrator::vcm;
    settings_.seed = 11;
    settings_.region = {0, 0, kSide, kSide};
  }
  Camera camera() const {
    return Camera(camera_pose(scene_->description().cameras.at(0)), kSide, kSide, scene_->origin());
  }
  static Film film() {
    FilmState state;
    state.splats = true;
    return Film(kSide, kSide, state);
  }
  std::shared_ptr<LightVertexCache> make(const Camera* camera, Film& film, TraceStats& stats, int half = 0,
                                         std::uint32_t sample = 0) const {
    return make_light_cache(scene_, settings_, half, sample, kPaths, camera, film, stats);
  }

  std::shared_ptr<const RenderScene> scene_;
  PathSettings settings_;
};

bool same(const LightVertex& a, const LightVertex& b) {
  return a.surface.position == b.surface.position && a.arrived == b.arrived && a.near_side == b.near_side &&
         a.throughput == b.throughput && a.mis.vcm == b.mis.vcm && a.mis.vc == b.mis.vc && a.mis.first == b.mis.first &&
         a.depth == b.depth && a.surface.offset == b.surface.offset && a.media.count == b.media.count;
}

// Another order of work, and another camera: the light vertices are the same.
TEST_F(LightVertexCacheTest, HoldsTheSameVerticesWhoeverMakesThem) {
  Film one = film(), other = film();
  TraceStats stats;
  const Camera seen_by = camera();
  const auto cache = make(&seen_by, one, stats);
  LightVertexCache backwards(scene_, settings_, 0, 0, kPaths, mean_light_vertices(*scene_, settings_));
  for (std::size_t b = backwards.batches(); b-- > 0;) backwards.trace(b, nullptr, CancelToken(), other, stats);
  constexpr std::size_t kParts = 3;
  backwards.begin_index(kParts);
  for (int sweep = 0; sweep < LightVertexCache::kIndexSweeps; ++sweep) {
    for (std::size_t part = kParts; part-- > 0;) backwards.run_index(sweep, part);
    backwards.finish_index_sweep(sweep);
  }
  for (std::size_t b = backwards.batches(); b-- > 0;) backwards.gather(b);
  backwards.finish();
  ASSERT_EQ(cache->vertices(), backwards.vertices());
  EXPECT_GT(cache->vertices(), kPaths);
  for (std::size_t v = 0; v < cache->vertices(); ++v) ASSERT_TRUE(same(cache->load(v), backwards.load(v))) << v;
  EXPECT_EQ(other.splats()->light_paths(0), 0u) << "nobody looked";
}

// What is kept is joined to a camera in the very bits of what has just been traced.
TEST_F(LightVertexCacheTest, SplatsAgainAsIfTracedAgain) {
  Film traced = film(), kept = film(), nobody = film();
  TraceStats tracing, splatting;
  const Camera seen_by = camera();
  make(&seen_by, traced, tracing);
  const auto cache = make(nullptr, nobody, splatting);
  splatting = {};
  for (std::size_t b = 0; b < cache->batches(); ++b) cache->splat(b, seen_by, CancelToken(), kept, splatting);
  EXPECT_TRUE(*traced.splats() == *kept.splats());
  EXPECT_EQ(kept.splats()->light_paths(0), kPaths);
  EXPECT_EQ(splatting.rays, splatting.shadow_rays) << "no light path was traced";
  EXPECT_GT(splatting.rays, 0u);
  EXPECT_GT(tracing.rays, splatting.rays);
}

TEST_F(LightVertexCacheTest, PassesAndHalvesHaveTheirOwnPaths) {
  Film ignored = film();
  TraceStats stats;
  const auto first = make(nullptr, ignored, stats), second = make(nullptr, ignored, stats, 0, 1),
             other_half = make(nullptr, ignored, stats, 1, 0);
  EXPECT_FALSE(same(first->load(0), second->load(0)));
  EXPECT_FALSE(same(first->load(0), other_half->load(0)));
}

TEST_F(LightVertexCacheTest, CountsTechniquesAsTheyAreTried) {
  Film ignored = film();
  TraceStats stats;
  settings_.light_cache = {3, 0.01, 0.5};
  const double per_path = mean_light_vertices(*scene_, settings_);
  const auto cache = make(nullptr, ignored, stats, 0, 15);
  EXPECT_NEAR(double(cache->vertices()) / kPaths / per_path, 1, 0.15);
  EXPECT_EQ(cache->counts().light_paths, double(kPaths));
  EXPECT_DOUBLE_EQ(cache->counts().connections, 3 / per_path);
  const double radius = 0.01 * scene_->impl().radius * std::pow(16.0, -0.25);
  EXPECT_NEAR(cache->radius() / radius, 1, 1e-12);
  EXPECT_NEAR(cache->counts().merging / (kPaths * M_PI * radius * radius), 1, 1e-12);
  settings_.integrator = Integrator::lvc;
  EXPECT_EQ(make(nullptr, ignored, stats)->counts().merging, 0);
}

TEST_F(LightVertexCacheTest, FindsWhatLiesNearAndFreesWhatItWasMadeOf) {
  Film ignored = film();
  TraceStats stats;
  settings_.light_cache.radius = 0.05;
  const auto cache = make(nullptr, ignored, stats);
  for (std::size_t v = 0; v < cache->vertices(); v += 97) {
    const LightVertex vertex = cache->load(v);
    std::size_t near = 0, expected = 0;
    cache->for_each_near(vertex.surface.position, [&](const LightVertexCache::Record&) { ++near; });
    for (std::size_t w = 0; w < cache->vertices(); ++w)
      expected += length(cache->load(w).surface.position - vertex.surface.position) <= float(cache->radius());
    EXPECT_NEAR(double(near), double(expected), 1) << "up to what rounds to the radius";
    EXPECT_GE(near, 1u);
  }
  EXPECT_LT(cache->bytes(), cache->vertices() * 160);
}

TEST_F(LightVertexCacheTest, WhatIsCancelledChangesNothing) {
  Film untouched = film();
  CancelToken cancelled;
  cancelled.cancel();
  TraceStats stats;
  LightVertexCache cache(scene_, settings_, 0, 0, kPaths, 3);
  const Camera seen_by = camera();
  EXPECT_FALSE(cache.trace(0, &seen_by, cancelled, untouched, stats));
  EXPECT_EQ(untouched.splats()->light_paths(0), 0u);
  EXPECT_EQ(stats.rays, 0u);
}

}  // namespace
}  // namespace helio::test
