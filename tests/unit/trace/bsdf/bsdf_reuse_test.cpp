// A BSDF that is made once for many questions answers each as one that is made for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "tests/unit/trace/bsdf/all_cases.h"
#include "tests/unit/trace/bsdf/bsdf_checks.h"

namespace helio::test {
namespace {

std::vector<NamedMaterial> materials() {
  std::vector<NamedMaterial> all = all_materials();
  const SurfaceParams inner = blend(all[0].params, all[2].params, 0.3f);
  all.push_back({"blend within a blend", blend(inner, all[4].params, 0.6f)});
  NamedMaterial mapped = all.back();
  mapped.params.mapped = true;
  mapped.params.map_normal = normalize(V3f(-0.1f, 0.2f, 1));
  all.push_back({"mapped blend", mapped.params});
  SurfaceParams smooth = all[0].params;
  smooth.alpha = 0;
  all.push_back({"mirror", smooth});
  SurfaceParams none;
  none.model = LobeModel::none;
  all.push_back({"none", none});
  return all;
}

void expect_equal(const BsdfSample& a, const BsdfSample& b) {
  EXPECT_EQ(a.wi, b.wi);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ(a.pdf_w, b.pdf_w);
  EXPECT_EQ(a.eta, b.eta);
  EXPECT_EQ(a.delta, b.delta);
  EXPECT_EQ(a.transmitted, b.transmitted);
}

// The parameters are changed once it is made: it keeps none.
class Made {
 public:
  Made(const SurfaceParams& params, const V3f& wo) : params_(params) {
    if (params.layers) {
      layers_ = *params.layers;
      params_.layers = &layers_;
    }
    bsdf_.emplace(params_, wo);
    params_ = SurfaceParams();
    layers_ = LayerParams();
  }
  const Bsdf* operator->() const { return &*bsdf_; }

 private:
  SurfaceParams params_;
  LayerParams layers_;
  std::optional<Bsdf> bsdf_;
};

TEST(BsdfReuse, AnswersAreThoseOfOneMadeForTheQuestion) {
  Random random(59);
  int bright = 0, sampled = 0;
  for (const NamedMaterial& material : materials()) {
    SCOPED_TRACE(material.name);
    const SurfaceParams& params = material.params;
    // From the side that it is made for, the other one, and along the surface.
    const float side = material.from_inside ? -1 : 1;
    for (const V3f& wo : {random_direction(random, side), random_direction(random, side),
                          random_direction(random, -side), V3f(1, 0, 0)}) {
      const Made bsdf(params, wo);
      for (int i = 0; i < 60; ++i) {
        const V3f wi = random_direction(random, i % 3 ? 1 : -1);
        const float u_lobe = random.next_float();
        const V2f u = random.next_v2f();
        switch (std::min(4, int(random.next_float() * 5))) {
          case 0:
            EXPECT_EQ(bsdf->is_pure_delta(), is_pure_delta(params));
            break;
          case 1:
            EXPECT_EQ(bsdf->albedo(), surface_albedo(params, wo));
            break;
          case 2: {
            const BsdfValue value = bsdf->evaluate(wi), anew = evaluate_bsdf(params, wo, wi);
            EXPECT_EQ(value.f_cos, anew.f_cos);
            EXPECT_EQ(value.pdf_w, anew.pdf_w);
            bright += value.f_cos.x > 0;
            break;
          }
          case 3:
            EXPECT_EQ(bsdf->matte(wi), matte_cos(params, wo, wi));
            break;
          default: {
            const BsdfSample sample = bsdf->sample(u_lobe, u);
            expect_equal(sample, sample_bsdf(params, wo, u_lobe, u));
            sampled += sample.valid();
          }
        }
      }
    }
  }
  EXPECT_GT(bright, 500);
  EXPECT_GT(sampled, 500);
}

}  // namespace
}  // namespace helio::test
