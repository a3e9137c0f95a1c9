// An edited scene renders what a scene loaded with the edited values renders, and shares what it did not change.
#include "renderer/trace/scene/edit_scene.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "renderer/scene/images/environment.h"
#include "renderer/trace/sampling/warp.h"
#include "renderer/trace/scene/scene_data.h"
#include "tests/support/random.h"
#include "tests/support/small_rooms.h"

namespace helio::test {
namespace {

using ScenePointer = std::shared_ptr<const RenderScene>;

const CameraPose kPose = camera_at({0.1, 0, 0.95}, {0, -0.2, -1}, 75);

ScenePointer edit(const ScenePointer& base, const std::vector<SceneEdit>& edits, const EditOptions& options = {}) {
  const auto changes = resolve_edits(base->description(), edits);
  EXPECT_TRUE(changes.ok()) << changes.error().to_string();
  auto edited = edit_scene(base, *changes, options);
  EXPECT_TRUE(edited.ok()) << edited.error().to_string();
  return edited.ok() ? *edited : nullptr;
}

std::string refusal(const ScenePointer& base, const SceneEdit& edit) {
  const auto changes = resolve_edits(base->description(), std::vector<SceneEdit>{edit});
  if (!changes) return changes.error().to_string();
  const auto edited = edit_scene(base, *changes);
  return edited ? "accepted" : edited.error().to_string();
}

MaterialEdit material(std::uint32_t index, std::optional<Rgb> color, std::optional<Rgb> emission = std::nullopt,
                      std::optional<float> roughness = std::nullopt) {
  return {index, color, emission, roughness};
}

M44d transform(const V3d& translation, double scale = 1, double turn = 0) {
  M44d m;
  m[0][0] = m[2][2] = scale * std::cos(turn);
  m[0][2] = scale * std::sin(turn);
  m[2][0] = -scale * std::sin(turn);
  m[1][1] = scale;
  for (int i = 0; i < 3; ++i) m[3][i] = translation[i];
  return m;
}

// Bytes of the edited scene that its base has not; the rest is the same memory.
std::uint64_t new_bytes(const RenderScene& edited, const RenderScene& base) {
  std::uint64_t bytes = 0;
  for (const MemoryShare& share : edited.memory()) {
    bool shared = false;
    for (const MemoryShare& other : base.memory()) shared |= other.what == share.what;
    if (!shared) bytes += share.bytes;
  }
  return bytes;
}

bool same_bvh(const RenderScene& a, const RenderScene& b) {
  const auto p = a.impl().accel->shares(), q = b.impl().accel->shares();
  if (p.size() != q.size()) return false;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i].what != q[i].what) return false;
  }
  return true;
}

// Rays through the box of radius 1 around a point of the world, in either scene. Differences in the distance of hits
// beyond the tolerance, and hits on something else, count.
int differing_hits(const RenderScene& a, const RenderScene& b, const V3d& around, double extent, double tolerance) {
  constexpr int kRays = 4096;
  Random random(7);
  std::vector<Ray> rays[2] = {std::vector<Ray>(kRays), std::vector<Ray>(kRays)};
  std::vector<Hit> hits[2] = {std::vector<Hit>(kRays), std::vector<Hit>(kRays)};
  std::vector<std::uint32_t> order(kRays);
  const RenderScene* scenes[2] = {&a, &b};
  for (int i = 0; i < kRays; ++i) {
    order[std::size_t(i)] = std::uint32_t(i);
    const V3d from = around + V3d(square_to_sphere(random.next_v2f())) * (0.9 * extent);
    const V3d to = around + V3d(square_to_sphere(random.next_v2f())) * (0.7 * extent);
    for (int s = 0; s < 2; ++s) {
      Ray& ray = rays[s][std::size_t(i)];
      ray.origin = V3f(from - scenes[s]->origin());
      ray.direction = V3f(normalize(to - from));
      ray.t_max = std::numeric_limits<float>::infinity();
    }
  }
  for (int s = 0; s < 2; ++s) {
    scenes[s]->impl().accel->intersect(rays[s].data(), order.data(), kRays, hits[s].data(), RayOrder::scattered);
  }
  int differing = 0;
  const auto name = [&](const RenderScene& scene, const Hit& hit) {
    const SceneData& data = scene.impl();
    return hit.instance == kNoHit ? data.flat_names[hit.part] : data.instance_names[hit.instance];
  };
  int met = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    const Hit &p = hits[0][i], &q = hits[1][i];
    met += p.valid();
    if (p.valid() != q.valid()) {
      ++differing;
    } else if (p.valid()) {
      differing += !(std::abs(double(p.t) - double(q.t)) <= tolerance) || name(a, p) != name(b, q);
    }
  }
  EXPECT_GT(met, kRays / 4);
  return differing;
}

// Both pictures' means agree within four standard errors of their difference.
void expect_same_light(const RenderScene& a, const RenderScene& b, const CameraPose& pose = kPose,
                       std::uint32_t samples = 64) {
  PathSettings first, second;
  first.seed = 1;
  second.seed = 2;
  const MeanEstimate p = mean_of(render(a, pose, 48, 36, samples, first));
  const MeanEstimate q = mean_of(render(b, pose, 48, 36, samples, second));
  for (int c = 0; c < 3; ++c) {
    const double error = std::hypot(p.standard_error[c], q.standard_error[c]);
    EXPECT_NEAR(p.mean[c], q.mean[c], 4 * error) << "channel " << c;
    EXPECT_GT(p.mean[c], 8 * error);  // else the test could not fail
  }
}

Image gradient_map() {
  Image map;
  map.name = "sky";
  map.width = 16;
  map.height = 8;
  map.channels = 3;
  map.format = TexelFormat::f32;
  std::vector<float> texels;
  for (int i = 0; i < 16 * 8 * 3; ++i) texels.push_back(0.1f + 0.01f * float(i * 37 % 101));
  map.texels.resize(texels.size() * sizeof(float));
  std::memcpy(map.texels.data(), texels.data(), map.texels.size());
  return map;
}

TEST(EditScene, ColoursAndLightsHaveTheBitsOfAReload) {
  SceneDescription loaded = mixed_scene();
  const ScenePointer base = build(mixed_scene());
  const ScenePointer edited = edit(base, {material(0, Rgb(0.2f, 0.7f, 0.4f)), material(1, std::nullopt, Rgb(2, 3, 4)),
                                          material(3, std::nullopt, std::nullopt, 0.15f),
                                          LightEdit{0u, std::nullopt, 5}, EnvironmentEdit{Rgb(0.5f, 0.2f, 0.1f), 1}});
  loaded.materials[0].base_color = Rgb(0.2f, 0.7f, 0.4f);
  loaded.materials[1].emission = Rgb(2, 3, 4);
  loaded.materials[3].roughness = 0.15f;
  loaded.lights[0].intensity *= 5;
  loaded.environment->radiance = Rgb(0.5f, 0.2f, 0.1f);
  const ScenePointer reloaded = build(std::move(loaded));
  const Film a = render(*edited, kPose, 40, 30, 4), b = render(*reloaded, kPose, 40, 30, 4);
  EXPECT_TRUE(same_bits(a, b));
  EXPECT_FALSE(same_bits(a, render(*base, kPose, 40, 30, 4)));
  EXPECT_EQ(edited->features(), reloaded->features());
}

TEST(EditScene, ColoursAndLightsShareTheWholeBvh) {
  for (const bool mixed : {false, true}) {
    const ScenePointer base = build(mixed ? mixed_scene() : lambert_room());
    const ScenePointer edited =
        edit(base, {material(0, Rgb(0.1f, 0.1f, 0.1f)), material(1, std::nullopt, Rgb(1, 1, 1))});
    EXPECT_TRUE(same_bvh(*edited, *base));
    EXPECT_EQ(&edited->impl().assets->objects, &base->impl().assets->objects);
    ASSERT_NE(edited->edit(), nullptr);
    EXPECT_TRUE(edited->edit()->shares_bvh);
    EXPECT_EQ(edited->edit()->materials, std::vector<std::uint32_t>{0});
    EXPECT_EQ(edited->edit()->emissions, std::vector<std::uint32_t>{1});
    EXPECT_TRUE(edited->edit()->lighting_changed());
    EXPECT_EQ(edited->edit()->parent.lock(), base);
    EXPECT_EQ(edited->features().fast_rays, base->features().fast_rays);
    EXPECT_EQ(edited->stats().own_bytes, new_bytes(*edited, *base));
    EXPECT_EQ(edited->stats().own_bytes + base->stats().memory_bytes - base->impl().table_bytes,
              edited->stats().memory_bytes);
    EXPECT_EQ(base->edit(), nullptr);
  }
}

// Emission where there was none, and none where there was some.
TEST(EditScene, SurfacesStartAndStopToShine) {
  const ScenePointer base = build(lambert_room());
  const ScenePointer edited =
      edit(base, {material(0, std::nullopt, Rgb(0.3f, 0.2f, 0.1f)), material(1, Rgb(0.5f, 0.5f, 0.5f), Rgb(0, 0, 0))});
  SceneDescription loaded = lambert_room();
  loaded.materials[0].emission = Rgb(0.3f, 0.2f, 0.1f);
  loaded.materials[1].emission = Rgb(0, 0, 0);
  loaded.materials[1].base_color = Rgb(0.5f, 0.5f, 0.5f);
  EXPECT_TRUE(same_bits(render(*edited, kPose, 40, 30, 4), render(*build(std::move(loaded)), kPose, 40, 30, 4)));
  const ScenePointer dark = edit(edited, {material(0, std::nullopt, Rgb(0, 0, 0))});
  EXPECT_EQ(dark->features().light_count, 0u);
  EXPECT_EQ(mean_of(render(*dark, kPose, 8, 8, 1)).mean, V3d(0, 0, 0));
}

TEST(EditScene, ScaledEnvironmentKeepsItsTable) {
  SceneDescription description = lambert_room();
  description.objects.erase(description.objects.begin());  // the walls
  description.instances.erase(description.instances.begin());
  for (Instance& instance : description.instances) --instance.object;
  description.images = {gradient_map()};
  description.environment = Environment{};
  description.environment->image = 0;
  description.environment->radiance = Rgb(0.9f, 0.6f, 0.3f);
  const ScenePointer base = build(description);
  for (const double scale : {4.0, 0.37}) {
    const ScenePointer edited = edit(base, {EnvironmentEdit{std::nullopt, scale}});
    description.environment->radiance = Rgb(V3d(Rgb(0.9f, 0.6f, 0.3f)) * scale);
    const Film film = render(*edited, kPose, 40, 30, 4);
    EXPECT_TRUE(same_bits(film, render(*build(description), kPose, 40, 30, 4))) << scale;
    EXPECT_FALSE(same_bits(film, render(*base, kPose, 40, 30, 4)));
  }
  const auto& table = base->impl().environment_table.distribution;
  EXPECT_EQ(edit(base, {EnvironmentEdit{std::nullopt, 4}})->impl().environment_table.distribution, table);
  const ScenePointer blue = edit(base, {EnvironmentEdit{Rgb(0, 0, 1), 1}});
  EXPECT_NE(blue->impl().environment_table.distribution, table);
  EXPECT_GE(blue->stats().own_bytes, blue->impl().environment_table.distribution->memory_bytes());
}

TEST(EditScene, MovedObjectsStandWhereALoadPutsThem) {
  const M44d place = transform({0.3, 0.2, -0.1}, 0.8, 0.5);
  M44d mirrored = place, stretched = place;
  for (int j = 0; j < 3; ++j) mirrored[0][j] = -mirrored[0][j];
  for (int j = 0; j < 3; ++j) stretched[1][j] *= 1.7;
  for (const bool mixed : {false, true}) {
    const SceneDescription description = mixed ? mixed_scene() : lambert_room();
    const ScenePointer base = build(description);
    // The room, a box in it, its lamp; a sphere, and two instances of one object.
    for (std::uint32_t moved = 1; moved < description.instances.size(); ++moved) {
      for (const M44d& m : {place, mirrored, stretched}) {
        const ScenePointer edited = edit(base, {ObjectEdit{moved, m, false}});
        SceneDescription loaded = description;
        loaded.instances[moved].to_world = m;
        const ScenePointer reloaded = build(std::move(loaded));
        ASSERT_TRUE(edited && reloaded);
        // Grazing rays and edges may go either way: a few of 4096.
        EXPECT_LE(differing_hits(*edited, *reloaded, {0, 0, 0}, 1, 1e-4), 8) << moved << " mixed " << mixed;
        EXPECT_GT(differing_hits(*edited, *base, {0, 0, 0}, 1, 1e-4), 8) << moved;
        EXPECT_EQ(edited->origin(), base->origin());
        const Box3d a = edited->world_bounds(), b = reloaded->world_bounds();
        EXPECT_LT(length(a.min - b.min) + length(a.max - b.max), 1e-12);
      }
    }
  }
}

TEST(EditScene, MovedObjectsAreLitAsAfterALoad) {
  const SceneDescription description = mixed_scene();
  const ScenePointer base = build(description);
  // The lamp itself, a box, the glass sphere stretched, and an instance, one after the other.
  M44d egg = transform({0.05, 0.1, 0}, 1, 0.3);
  for (int j = 0; j < 3; ++j) egg[1][j] *= 0.6;
  const std::vector<SceneEdit> edits = {ObjectEdit{2u, transform({0.2, -0.4, 0.1}, 1.3, 0.4), false},
                                        ObjectEdit{1u, transform({0.3, 0.1, 0}, 0.7, 1), false},
                                        ObjectEdit{3u, egg, false}, ObjectEdit{4u, transform({0.5, 0.4, 0}), false}};
  SceneDescription loaded = description;
  ScenePointer edited = base;
  for (const SceneEdit& one : edits) {
    edited = edit(edited, {one});
    loaded.instances[std::get<std::uint32_t>(std::get<ObjectEdit>(one).target)].to_world =
        std::get<ObjectEdit>(one).transform;
  }
  const ScenePointer reloaded = build(std::move(loaded));
  expect_same_light(*edited, *reloaded);
  // All at once is the same scene, in the same bits.
  EXPECT_TRUE(same_bits(render(*edited, kPose, 40, 30, 4), render(*edit(base, edits), kPose, 40, 30, 4)));
  EXPECT_EQ(edited->features().light_count, reloaded->features().light_count);
}

TEST(EditScene, ObjectsMayBeMovedThereAndBack) {
  const ScenePointer base = build(lambert_room());
  const ScenePointer away = edit(base, {ObjectEdit{1u, transform({0.3, 0.2, 0}), false}});
  const ScenePointer back = edit(away, {ObjectEdit{1u, base->description().instances[1].to_world, false}});
  EXPECT_LE(differing_hits(*back, *base, {0, 0, 0}, 1, 1e-5), 8);
  // Steps do not add up.
  ScenePointer scene = away;
  for (int i = 0; i < 100; ++i) {
    scene = edit(scene, {ObjectEdit{1u, transform({1e3 * i, 0, 0}, std::pow(1.1, i % 7)), false}});
  }
  scene = edit(scene, {ObjectEdit{1u, transform({0.3, 0.2, 0}), false}});
  EXPECT_TRUE(same_bits(render(*scene, kPose, 40, 30, 4), render(*away, kPose, 40, 30, 4)));
}

TEST(EditScene, SecondMoveBuildsOnlyTheTopLevel) {
  // A room of 20,000 triangles and a box.
  SceneDescription description = lambert_room();
  TriangleMesh fine;
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    const V3f at(random.next_float() - 0.5f, random.next_float() - 0.5f, random.next_float() - 0.5f);
    for (const V3f& p : {at, at + V3f(0.01f, 0, 0), at + V3f(0, 0.01f, 0)}) {
      fine.indices.push_back(std::uint32_t(fine.positions.size()));
      fine.positions.push_back(p);
    }
  }
  add_mesh(description, fine);
  const ScenePointer base = build(std::move(description));
  const ScenePointer first = edit(base, {ObjectEdit{1u, transform({0.1, 0, 0}), false}});
  const ScenePointer second = edit(first, {ObjectEdit{1u, transform({0.2, 0, 0}), false}});
  const ScenePointer other = edit(second, {ObjectEdit{2u, transform({0, -0.2, 0}), false}});
  // The first builds a BVH of the rest, but no vertex is copied: those of the base take 720 kB.
  EXPECT_GT(first->stats().own_bytes, 20000u * 16);
  EXPECT_EQ(first->impl().assets, base->impl().assets);
  EXPECT_EQ(second->stats().own_bytes, new_bytes(*second, *first));
  EXPECT_LT(second->stats().own_bytes, first->stats().own_bytes / 20);
  EXPECT_GT(other->stats().own_bytes, 20000u * 16);  // another object leaves another rest
  const ScenePointer painted = edit(second, {material(0, Rgb(0, 0, 1))});
  EXPECT_TRUE(same_bvh(*painted, *second));
  ASSERT_EQ(second->edit()->moves.size(), 1u);
  EXPECT_EQ(second->edit()->moves[0].instance, 1u);
  EXPECT_NEAR(second->edit()->moves[0].to.min.x - second->edit()->moves[0].from.min.x, 0.1, 1e-6);
  EXPECT_FALSE(second->edit()->shares_bvh);
  EXPECT_FALSE(second->edit()->lighting_changed());
  EXPECT_TRUE(edit(second, {ObjectEdit{2u, transform({0, -0.1, 0}), false}})->edit()->lighting_changed());  // the lamp
}

TEST(EditScene, EditedScenesOutliveTheirBase) {
  ScenePointer base = build(mixed_scene());
  ScenePointer moved = edit(base, {ObjectEdit{1u, transform({0.1, 0, 0}), false}});
  const ScenePointer painted = edit(moved, {material(4, Rgb(1, 0, 0))});  // a surface with alpha
  const Film before = render(*painted, kPose, 40, 30, 4);
  base.reset();
  moved.reset();
  EXPECT_EQ(painted->edit()->parent.lock(), nullptr);
  EXPECT_TRUE(same_bits(render(*painted, kPose, 40, 30, 4), before));
}

TEST(EditScene, ScenesThatOutgrowTheirWideningAreTracedRobustly) {
  const ScenePointer base = build(lambert_room());
  ASSERT_TRUE(base->features().fast_rays);
  const ScenePointer near = edit(base, {ObjectEdit{1u, transform({0.1, 0, 0}), false}});
  EXPECT_TRUE(near->features().fast_rays);
  const ScenePointer far = edit(base, {ObjectEdit{1u, transform({50, 0, 0}), false}});
  EXPECT_FALSE(far->features().fast_rays);
  SceneDescription loaded = lambert_room();
  loaded.instances[1].to_world = transform({50, 0, 0});
  const ScenePointer reloaded = build(std::move(loaded));
  EXPECT_LE(differing_hits(*far, *reloaded, {0, 0, 0}, 1, 1e-4), 8);
  EXPECT_LE(differing_hits(*far, *reloaded, {49.9, -0.65, -0.2}, 0.5, 1e-4), 8);
  // Back within reach it is as if it had not been away.
  const ScenePointer again = edit(far, {ObjectEdit{1u, transform({0.1, 0, 0}), false}});
  EXPECT_TRUE(again->features().fast_rays);
  EXPECT_TRUE(same_bits(render(*again, kPose, 40, 30, 4), render(*near, kPose, 40, 30, 4)));
}

TEST(EditScene, TransformsThatCannotBeRenderedAreRefused) {
  const ScenePointer base = build(mixed_scene());
  M44d flat = transform({0, 0, 0});
  flat[1][1] = 0;
  EXPECT_NE(refusal(base, ObjectEdit{1u, flat, false}).find("flattens"), std::string::npos);
  EXPECT_NE(refusal(base, ObjectEdit{1u, transform({1e13, 0, 0}), false}).find("[-1e12, 1e12]"), std::string::npos);
  EXPECT_NE(refusal(base, ObjectEdit{4u, transform({0, 0, 0}, 1e-18), false}).find("too small"), std::string::npos);
  EXPECT_NE(refusal(base, ObjectEdit{4u, transform({0, 0, 0}, 1e-18), false}).find("object 4 'instance 4'"),
            std::string::npos);
  // Far away is allowed.
  EXPECT_EQ(refusal(base, ObjectEdit{1u, transform({1e9, 0, 0}), false}), "accepted");

  SceneDescription pressed = lambert_room();
  pressed.instances[1].to_world[1][1] = 1e-6;
  const ScenePointer thin = build(std::move(pressed));
  EXPECT_NE(refusal(thin, ObjectEdit{1u, M44d(), false}).find("pressed flat"), std::string::npos);
  EXPECT_EQ(refusal(thin, ObjectEdit{1u, transform({0.2, 0, 0}) * thin->description().instances[1].to_world, false}),
            "accepted");
}

TEST(EditScene, LimitsAndCancelEndAnEdit) {
  const ScenePointer base = build(mixed_scene());
  const auto changes =
      resolve_edits(base->description(), std::vector<SceneEdit>{ObjectEdit{1u, transform({0.1, 0, 0}), false}});
  EditOptions small;
  small.max_bytes = 1;
  const auto refused = edit_scene(base, *changes, small);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  CancelToken cancel;
  cancel.cancel();
  EditOptions cancelled;
  cancelled.cancel = &cancel;
  EXPECT_EQ(edit_scene(base, *changes, cancelled).error().code, ErrorCode::cancelled);
  // The base is as it was.
  EXPECT_TRUE(same_bits(render(*base, kPose, 24, 16, 2), render(*build(mixed_scene()), kPose, 24, 16, 2)));
}

}  // namespace
}  // namespace helio::test
