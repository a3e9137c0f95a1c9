// Two views of a surface at once are those of each alone.
#include "renderer/trace/bsdf/bsdf_views.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/unit/trace/bsdf/all_cases.h"

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

bool near(const Rgb& a, const Rgb& b) {
  for (int c = 0; c < 3; ++c) {
    if (!(std::fabs(a[c] - b[c]) <= 2e-6f * std::fabs(b[c]) + 1e-20f)) return false;
  }
  return true;
}

TEST(BsdfViews, AreThoseOfEachDirectionToTheBit) {
  std::vector<V3f> directions;
  for (const V3f& d : {V3f(0, 0, 1), V3f(0.6f, 0, 0.8f), V3f(-0.3f, 0.5f, 0.4f), V3f(1, 0, 1e-6f), V3f(0.2f, 0.1f, -1),
                       V3f(1, 0, 0), V3f(0, -1, -1e-3f)})
    directions.push_back(normalize(d));
  int bright = 0;
  for (const SurfaceParams& params : surfaces()) {
    for (const V3f& first : directions) {
      const Bsdf bsdf(params, first);
      for (const V3f& second : directions) {
        const BsdfViews views(bsdf, params, second);
        for (const V3f& wi : directions) {
          const BsdfViews::Values values = views.f_cos(wi);
          EXPECT_EQ(values.first, evaluate_bsdf(params, first, wi).f_cos);
          EXPECT_EQ(values.second, evaluate_bsdf(params, second, wi).f_cos);
          EXPECT_EQ(views.second_f_cos(wi), values.second);
          EXPECT_TRUE(near(values.first_matte, matte_cos(params, first, wi)));
          EXPECT_TRUE(near(values.second_matte, matte_cos(params, second, wi)));
          bright += values.first.x > 0;
        }
      }
    }
  }
  EXPECT_GT(bright, 500);
}

// evaluate_both_ways() is that of either direction to the bit.
TEST(BsdfBothWays, AreThoseOfEachDirectionToTheBit) {
  std::vector<SurfaceParams> all = surfaces();
  for (const NamedMaterial& material : all_materials()) all.push_back(material.params);
  int there = 0, back = 0;
  for (const SurfaceParams& params : all) {
    for (double theta = 3; theta < 180; theta += 22) {
      const V3f wo = direction_at(theta, 10);
      const Bsdf bsdf(params, wo);
      for (double other = 8; other < 180; other += 19) {
        const V3f wi = direction_at(other, 150);
        const BsdfBothWays both = bsdf.evaluate_both_ways(params, wo, wi);
        const BsdfValue one = evaluate_bsdf(params, wo, wi), reverse = evaluate_bsdf(params, wi, wo);
        EXPECT_EQ(both.there.f_cos, one.f_cos);
        EXPECT_EQ(both.there.pdf_w, one.pdf_w);
        EXPECT_EQ(bsdf.evaluate_back(params, wo, wi).f_cos, reverse.f_cos);
        EXPECT_EQ(both.back.f_cos, reverse.f_cos);
        EXPECT_EQ(both.back.pdf_w, reverse.pdf_w);
        there += one.f_cos.x > 0;
        back += reverse.f_cos.x > 0;
      }
    }
  }
  EXPECT_GT(there, 500);
  EXPECT_GT(back, 500);
}

// What is matte is part of what is scattered; the rest is all of it where there are lobes alone, and none of it where
// there are none.
TEST(MatteCos, IsAPartOfTheBsdf) {
  int matte = 0, glossy = 0;
  for (const NamedMaterial& material : all_materials()) {
    for (const double theta : {5.0, 40.0, 80.0}) {
      const V3f above = direction_at(theta, 10), wo = material.from_inside ? -above : above;
      for (double other = 8; other < 180; other += 9) {
        const V3f wi = direction_at(other, 150);
        const Rgb f = evaluate_bsdf(material.params, wo, wi).f_cos, m = matte_cos(material.params, wo, wi);
        for (int c = 0; c < 3; ++c) {
          EXPECT_GE(m[c], 0) << material.name;
          EXPECT_LE(m[c], f[c] * (1 + 1e-5f) + 1e-7f) << material.name << ", " << theta << ", " << other;
        }
        if (material.params.model == LobeModel::lambert) {
          EXPECT_EQ(m, f);
        }
        if (material.params.model == LobeModel::conductor) {
          EXPECT_EQ(m, Rgb(0, 0, 0));
        }
        matte += m.y > 0;
        glossy += f.y > m.y * 1.01f;
      }
    }
  }
  EXPECT_GT(matte, 500);
  EXPECT_GT(glossy, 500);
}

// But for the retroreflection of Burley's model, and where layers let through the lesser of two: a function of each
// direction, so that directions agree on what a change of view does to it.
TEST(MatteCos, IsAFunctionOfEachDirection) {
  int compared = 0;
  for (const NamedMaterial& material : all_materials()) {
    const LobeModel model = material.params.model;
    if (model == LobeModel::principled || model == LobeModel::stack || model == LobeModel::blend) continue;
    // Two of these are one sum.
    if (material.params.metallic > 0 && material.params.metallic < 1) continue;
    if (model == LobeModel::specular_glossiness) continue;
    const V3f a = direction_at(20, 0), b = direction_at(65, 70), i = direction_at(30, 200), j = direction_at(75, 120);
    const auto m = [&](const V3f& wo, const V3f& wi) { return luminance(matte_cos(material.params, wo, wi)); };
    if (!(m(a, i) > 0)) continue;
    EXPECT_NEAR(m(a, i) * m(b, j) / (m(a, j) * m(b, i)), 1, material.params.mapped ? 1e-3 : 1e-4) << material.name;
    ++compared;
  }
  EXPECT_GT(compared, 4);
}

}  // namespace
}  // namespace helio::test
