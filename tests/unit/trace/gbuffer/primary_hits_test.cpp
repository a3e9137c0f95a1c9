// How a surface looks from elsewhere, told from where its light came from.
#include "renderer/trace/gbuffer/primary_hits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "renderer/film/core/direction_reservoir.h"
#include "renderer/trace/paths/path_integrator.h"
#include "renderer/trace/scene/scene_data.h"
#include "tests/support/test_scenes.h"
#include "tests/unit/trace/bsdf/bsdf_questions.h"

namespace helio::test {
namespace {

constexpr int kSide = 8;  // the picture's; its middle pixel is looked at

Material metal(float alpha) {
  Material material;
  material.base_color = Rgb(0.9f, 0.6f, 0.3f);
  material.metallic = 1;
  material.roughness = std::sqrt(alpha);
  return material;
}

// A floor at y = 0, seen at its middle from a height of 1.
class AFloor {
 public:
  explicit AFloor(const Material& material) {
    description_.materials = {material};
    add_mesh(description_, quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, 0));
    scene_ = build(description_);
    pose_ = camera_at({0.6, 1, 0}, {0, 0, 0}, 1);
    camera_.emplace(pose_, kSide, kSide, scene_->origin());
    centres_.emplace(*scene_, *camera_, pose_.forward);
    centres_->trace({0, 0, kSide, kSide});
    look_at(kSide / 2, kSide / 2);
  }

  void look_at(int x, int y) { centres_->at(x, y); }

  ViewEvidence evidence_from(const V3d& viewpoint, WeighedDirections& directions) const {
    return centres_->evidence_from(V3f(viewpoint - scene_->origin()), directions);
  }
  // Directions with the luminance that came along each, to be seen from `viewpoint`.
  WeighedDirections weighed(const V3d& viewpoint, const std::vector<WeighedDirection>& directions) const {
    WeighedDirections weighed;
    for (const WeighedDirection& d : directions) {
      weighed.light += double(d.weight);
      weighed.of[weighed.count++] = {d.packed, d.weight * counting(viewpoint, d.packed)};
    }
    return weighed;
  }
  ViewEvidence evidence_from(const V3d& viewpoint, const std::vector<WeighedDirection>& directions) const {
    WeighedDirections all = weighed(viewpoint, directions);
    return evidence_from(viewpoint, all);
  }
  // DirectionReservoir::counting() of light from there, seen from `viewpoint`.
  float counting(const V3d& viewpoint, std::uint32_t packed) const {
    if (packed == DirectionReservoir::kNone) return 1;
    if (packed == DirectionReservoir::kAny) return DirectionReservoir::kMatte;
    const SurfaceParams& params = scene_->impl().materials[0].params;
    const Frame frame(V3f(0, 1, 0));
    const V3f wo = frame.to_local(V3f(viewpoint.normalized()));
    const V3f wi = frame.to_local(unpack_direction<DirectionReservoir::kAxisBits>(packed));
    return DirectionReservoir::counting(varying_share(evaluate_bsdf(params, wo, wi).f_cos, matte_cos(params, wo, wi)));
  }
  bool depends_on_view() const { return centres_->depends_on_view(); }
  ViewReweighting change_from(const V3d& viewpoint, const std::vector<WeighedDirection>& directions) const {
    if (!depends_on_view()) return {};
    const ViewEvidence told = evidence_from(viewpoint, directions), *all[] = {&told};
    return pooled_change(told, all, 1);
  }
  // What a lamp in that direction, unit, makes the floor send to a viewpoint: what path tracing sees.
  double seen_from(const V3d& viewpoint, const V3d& lamp) const {
    SceneDescription description = description_;
    PunctualLight light;
    light.kind = PunctualKind::directional;
    light.direction = -lamp;
    description.lights = {light};
    const auto lit = build(std::move(description));
    return double(mean_of(render(*lit, camera_at(viewpoint, {0, 0, 0}, 1), kSide, kSide, 16)).mean.y);
  }

  // Under a sky of radiance 1.
  double under_sky(const V3d& viewpoint) const {
    SceneDescription description = description_;
    description.environment.emplace().radiance = Rgb(1, 1, 1);
    const auto lit = build(std::move(description));
    return double(mean_of(render(*lit, camera_at(viewpoint, {0, 0, 0}, 1), kSide, kSide, 256)).mean.y);
  }

 private:
  SceneDescription description_;
  std::shared_ptr<const RenderScene> scene_;
  CameraPose pose_;
  std::optional<Camera> camera_;
  std::optional<PrimaryHits> centres_;
};

const V3d kHere(0.6, 1, 0), kThere(0.5, 1, 0.1);

TEST(PrimaryHits, LambertSurfacesLookAlikeFromEverywhere) {
  const AFloor floor(lambert(Rgb(0.5f, 0.5f, 0.5f)));
  EXPECT_FALSE(floor.depends_on_view());
  const ViewReweighting change =
      floor.change_from(kThere, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(0, 1, 0)), 1}});
  EXPECT_EQ(change.error, 0);
  EXPECT_EQ(change.ratio, Rgb(1, 1, 1));
}

TEST(PrimaryHits, AHighlightFollowsTheCamera) {
  // All light from one direction: the ratio is that of two pictures lit from there.
  const AFloor floor(metal(0.2f));
  ASSERT_TRUE(floor.depends_on_view());
  for (const V3d& lamp : {V3d(-0.6, 1, 0), V3d(-0.3, 1, -0.2), V3d(-0.9, 1, 0.3)}) {
    const V3d wi = lamp.normalized();
    const double truth = floor.seen_from(kHere, wi) / floor.seen_from(kThere, wi);
    ASSERT_GT(std::abs(truth - 1), 0.02) << "nothing to be seen";
    const ViewReweighting change =
        floor.change_from(kThere, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(wi)), 2},
                                   {pack_direction<DirectionReservoir::kAxisBits>(V3f(wi)), 3}});
    // One direction, known once and to twelve bits an axis: taken at its word, and said to be in doubt.
    EXPECT_NEAR((double(change.ratio.y) - 1) / (truth - 1), 1, 0.05);
    EXPECT_GT(double(change.error) * double(change.ratio.y), 0.4 * std::abs(truth - 1));
  }
}

// Light from everywhere: what changes is the albedo, as pictures of it have it, and directions say nothing beyond it.
TEST(PrimaryHits, UnderEvenLightTheAlbedoIsTheChange) {
  Material coated;
  coated.base_color = Rgb(0.1f, 0.1f, 0.1f);
  coated.metallic = 0;
  coated.roughness = 0.6f;
  const AFloor floor(coated);
  const V3d flat = V3d(1, 0.4, 0).normalized();
  const ViewReweighting change = floor.change_from(flat, {});
  const double truth = floor.under_sky(kHere) / floor.under_sky(flat);
  ASSERT_LT(truth, 0.85);
  EXPECT_NEAR(change.albedo.y, truth, 0.02);
  EXPECT_EQ(change.ratio, change.albedo);
}

// A step of next to nothing changes nothing, whatever the albedo is rounded to: the like would add up over many.
TEST(PrimaryHits, ATinyStepChangesNothing) {
  for (const float base : {0.02f, 0.1f, 0.313f, 0.9f}) {
    Material coated;
    coated.base_color = Rgb(base, base, base);
    coated.metallic = 0;
    coated.roughness = 0.5f;
    const AFloor floor(coated);
    std::vector<WeighedDirection> directions;
    for (int i = 0; i < 16; ++i) {
      const V3f wi(V3d(0.1 * i - 0.8, 1, 0.05 * i).normalized());
      directions.push_back({pack_direction<DirectionReservoir::kAxisBits>(wi), 1});
    }
    const ViewReweighting change = floor.change_from(kHere + V3d(1e-5, 0, 0), directions);
    EXPECT_NEAR(change.ratio.y / change.albedo.y, 1, 1e-4) << base;
  }
}

// A BSDF next to nothing that a rare direction had light through.
TEST(PrimaryHits, TinyDensitiesStayNumbers) {
  const AFloor floor(metal(0.02f));
  for (const float weight : {1e-30f, 1.0f, 1e30f, 1e38f}) {
    const ViewReweighting change =
        floor.change_from(kThere, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(0.999f, 0.0447f, 0)), weight}});
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(std::isfinite(change.ratio[c]));
      EXPECT_GT(change.ratio[c], 0.9f * change.ratio.y);
    }
  }
}

TEST(PrimaryHits, BlackChannelsStayBlackNumbers) {
  Material red = metal(0.2f);
  red.base_color = Rgb(1, 0, 0);
  red.metallic = 0.5f;
  for (const float specular : {0.0f, 1.0f}) {
    red.specular = specular;
    const ViewReweighting change =
        AFloor(red).change_from(kThere, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(0, 1, 0)), 1}});
    for (int c = 0; c < 3; ++c) EXPECT_TRUE(std::isfinite(change.ratio[c])) << c;
  }
}

// By which the next view may pick among them.
TEST(PrimaryHits, DirectionsWeighWhatTheyBringToTheNewCamera) {
  for (const float metallic : {1.0f, 0.3f}) {  // the second one with an albedo that depends on the view
    Material material = metal(0.2f);
    material.metallic = metallic;
    const AFloor floor(material);
    const V3d left = V3d(-0.5, 1, -0.2).normalized(), right = V3d(0.3, 1, 0.1).normalized();
    const std::uint32_t a = pack_direction<DirectionReservoir::kAxisBits>(V3f(left));
    const std::uint32_t b = pack_direction<DirectionReservoir::kAxisBits>(V3f(right));
    WeighedDirections directions =
        floor.weighed(kThere, {{a, 2}, {DirectionReservoir::kAny, 5}, {b, 3}, {DirectionReservoir::kNone, 7}, {a, 1}});
    floor.evidence_from(kThere, directions);
    ASSERT_EQ(directions.count, 4u);
    const auto change = [&](const V3d& lamp) { return floor.seen_from(kHere, lamp) / floor.seen_from(kThere, lamp); };
    EXPECT_GT(std::abs(change(left) - change(right)), 0.1);
    EXPECT_EQ(directions.of[0].packed, a);
    EXPECT_NEAR(double(directions.of[0].weight) / (3 * change(left) * double(floor.counting(kHere, a))), 1, 0.02);
    EXPECT_NEAR(directions.of[1].weight, 5 * DirectionReservoir::kMatte, 1e-4f);
    EXPECT_NEAR(double(directions.of[2].weight) / (3 * change(right) * double(floor.counting(kHere, b))), 1, 0.02);
    EXPECT_EQ(directions.of[3].weight, 7);  // of a delta lobe: nobody can tell
  }
}

TEST(PrimaryHits, ManyDirectionsAreTakenAtTheirWord) {
  // Sixteen that say nearly the same leave little noise to shrink for.
  const AFloor floor(metal(0.2f));
  std::vector<WeighedDirection> directions;
  double truth = 0;
  for (int i = 0; i < 16; ++i) {
    const V3d wi = V3d(-0.3 + 0.001 * i, 1, -0.2).normalized();
    directions.push_back({pack_direction<DirectionReservoir::kAxisBits>(V3f(wi)), 1});
    truth += floor.seen_from(kHere, wi) / floor.seen_from(kThere, wi) / 16;
  }
  const ViewReweighting change = floor.change_from(kThere, directions);
  EXPECT_NEAR((double(change.ratio.y) - 1) / (truth - 1), 1, 0.1);
}

// Of pixels that see one flat surface, or nothing: two walls side by side fill the lower half.
void compare_features(const Material& left, const Material& right) {
  SceneDescription description;
  description.materials = {left, right};
  add_mesh(description, quad({-4, -4, 0}, {4, 0, 0}, {0, 4, 0}, 0));
  add_mesh(description, quad({0, -4, 0}, {4, 0, 0}, {0, 4, 0}, 1));
  const auto scene = build(description);
  const CameraPose pose = camera_at({0, 0, 3}, {0, 0, 0});
  const Camera camera(pose, kSide, kSide, scene->origin());
  PrimaryHits centres(*scene, camera, pose.forward);
  centres.trace({0, 0, kSide, kSide});
  Film film(kSide, kSide);
  TraceStats stats;
  ASSERT_TRUE(trace_window(*scene, camera, {}, {0, 0, 1}, film.bounds(), {}, film, stats));
  int hits = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      centres.at(x, y);
      const PixelFeatures &centre = centres.features(), &sample = film.features(x, y);
      EXPECT_EQ(centre.count, 1u);
      EXPECT_EQ(centre.hits, sample.hits);
      hits += int(centre.hits);
      EXPECT_EQ(std::isinf(centre.depth), std::isinf(sample.depth));
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(centre.normal[c], sample.normal[c], 1e-6f);
        EXPECT_NEAR(centre.albedo[c], sample.albedo[c], 0.05f);
      }
    }
  }
  EXPECT_EQ(hits, kSide * kSide / 2);

  // Where a picture was carried they stand until the first sample.
  Film carried(kSide, kSide, {.history = true});
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      centres.at(x, y);
      carried.features(x, y) = centres.features();
    }
  }
  ASSERT_TRUE(trace_window(*scene, camera, {}, {0, 0, 2}, film.bounds(), {}, carried, stats));
  EXPECT_EQ(carried.features(3, 6).count, 2u);
}

TEST(PrimaryHits, FeaturesAreThoseOfAFirstSample) {
  const Material blue = lambert(Rgb(0.2f, 0.4f, 0.8f));
  Material one_sided = lambert(Rgb(0.7f, 0.1f, 0.3f));
  one_sided.one_sided = true;
  compare_features(blue, metal(0.2f));
  compare_features(blue, one_sided);
}

// Of what a lobe reflects that has moved away from where it was, nothing is known.
TEST(PrimaryHits, AMirrorThatIsSeenFromElsewhereHasLightArrive) {
  const AFloor shiny(metal(0.03f)), dull(metal(0.5f));
  EXPECT_EQ(shiny.evidence_from(kHere + V3d(0.001, 0, 0), {}).arrival, Rgb(0, 0, 0));
  EXPECT_EQ(dull.evidence_from(kThere, {}).arrival, Rgb(0, 0, 0));
  const ViewEvidence far = shiny.evidence_from({-0.6, 1, 0}, {});
  EXPECT_NEAR(far.arrival.x, 0.9, 0.1);  // all that it reflects
  EXPECT_NEAR(far.arrival.z, 0.3, 0.1);
  EXPECT_NEAR(far.unseen, 1, 0.05);
}

TEST(PrimaryHits, LikeNeighboursShareWhatNoDirectionHasMet) {
  // 4x4 pixels: (4, 4) and (6, 5) are of one cell, (3, 4) of another, which asks other samples.
  AFloor floor(metal(0.2f));
  const auto unseen = [&](int x, int y, const V3d& viewpoint) {
    floor.look_at(x, y);
    return floor.change_from(viewpoint, {}).error;
  };
  const float first = unseen(4, 4, kThere);
  EXPECT_EQ(unseen(6, 5, kThere), first);
  EXPECT_NE(unseen(6, 5, kHere), first) << "of another viewpoint";
  EXPECT_EQ(unseen(5, 5, kThere), first);
  const float other = unseen(3, 4, kThere);
  EXPECT_NE(other, first);
  EXPECT_NEAR(other, first, 0.5f * first);
}

TEST(PrimaryHits, WhatIsNotKnownIsAnError) {
  const AFloor floor(metal(0.2f));
  const ViewReweighting nothing = floor.change_from(kThere, {});
  EXPECT_EQ(nothing.ratio, nothing.albedo);
  EXPECT_NEAR(nothing.ratio.y, 1, 0.01f);
  EXPECT_GT(nothing.error, 0.05f);
  // Half of the light through delta lobes: that half may change altogether.
  const ViewReweighting half =
      floor.change_from(kThere, {{DirectionReservoir::kAny, 1}, {DirectionReservoir::kNone, 1}});
  EXPECT_NEAR(half.ratio.y, 1, std::abs(1 - half.albedo.y) + 1e-6f);
  EXPECT_GE(half.error, 0.5f);
  // What a surface emits it emits everywhere.
  EXPECT_LT(floor.change_from(kThere, {{DirectionReservoir::kAny, 1}}).error, nothing.error * 1.001f);
  // The other side of it is another surface.
  EXPECT_GE(floor.change_from({0.5, -1, 0.1}, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(0, 1, 0)), 1}}).error,
            1);
  // Directions that the old camera could not have had light from, and weights that are as large as floats go.
  const ViewReweighting below =
      floor.change_from(kThere, {{pack_direction<DirectionReservoir::kAxisBits>(V3f(0, -1, 0)), 1e38f}});
  EXPECT_EQ(below.ratio, below.albedo);
  EXPECT_TRUE(std::isfinite(below.error));
}

}  // namespace
}  // namespace helio::test
