// Two views of a surface at once are those of each alone.
#include "renderer/trace/bsdf_views.h"

#include <gtest/gtest.h>

#include <vector>

namespace helio::test {
namespace {

std::vector<SurfaceParams> surfaces() {
  SurfaceParams plain;
  plain.model = LobeModel::metallic_roughness;
  plain.base_color = Rgb(0.8f, 0.4f, 0);
  plain.alpha = 0.1f;
  std::vector<SurfaceParams> all = {plain};
  const auto add = [&](auto change) { change(all.emplace_back(plain)); };
  add([](SurfaceParams& p) { p.metallic = 1; });
  add([](SurfaceParams& p) { p.alpha = 0; });
  add([](SurfaceParams& p) { p.distribution = MicrofacetDistribution::beckmann; });
  add([](SurfaceParams& p) { p.transmission = 0.5f; });
  add([](SurfaceParams& p) { p.transmission = 0.5f, p.thin = false; });
  add([](SurfaceParams& p) { p.base_color = Rgb(0, 0, 0), p.specular = 0; });
  add([](SurfaceParams& p) { p.mapped = true, p.map_normal = normalize(V3f(0.2f, -0.1f, 1)); });
  add([](SurfaceParams& p) { p.model = LobeModel::specular_glossiness; });
  add([](SurfaceParams& p) {
    p.model = LobeModel::conductor, p.eta = Rgb(0.2f, 0.9f, 1.1f), p.k = Rgb(3.9f, 2.5f, 2.4f);
  });
  add([](SurfaceParams& p) { p.model = LobeModel::lambert; });
  return all;
}

TEST(BsdfViews, AreThoseOfEachDirectionToTheBit) {
  std::vector<V3f> directions;
  for (const V3f& d : {V3f(0, 0, 1), V3f(0.6f, 0, 0.8f), V3f(-0.3f, 0.5f, 0.4f), V3f(1, 0, 1e-6f), V3f(0.2f, 0.1f, -1),
                       V3f(1, 0, 0), V3f(0, -1, -1e-3f)})
    directions.push_back(normalize(d));
  int bright = 0;
  for (const SurfaceParams& params : surfaces()) {
    for (const V3f& first : directions) {
      for (const V3f& second : directions) {
        const BsdfViews views(params, first, second);
        for (const V3f& wi : directions) {
          const BsdfViews::Values values = views.f_cos(wi);
          EXPECT_EQ(values.first, evaluate_bsdf(params, first, wi).f_cos);
          EXPECT_EQ(values.second, evaluate_bsdf(params, second, wi).f_cos);
          bright += values.first.x > 0;
        }
      }
    }
  }
  EXPECT_GT(bright, 500);
}

}  // namespace
}  // namespace helio::test
