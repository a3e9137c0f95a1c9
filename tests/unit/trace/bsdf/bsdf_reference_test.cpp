// Rough lobes against another renderer: Mitsuba 3.9.1 (scalar_rgb, roughdielectric and roughconductor, sample_visible),
// f |cos| in radiance mode and density, wo at azimuth 0. Mitsuba takes Smith's Beckmann masking from a rational
// approximation that is off by up to 0.4 %, and each value holds up to two of them.
#include <gtest/gtest.h>

#include "renderer/trace/bsdf/bsdf.h"
#include "tests/unit/trace/bsdf/bsdf_cases.h"

namespace helio::test {
namespace {

constexpr auto kGgx = MicrofacetDistribution::ggx, kBeckmann = MicrofacetDistribution::beckmann;

double tolerance(MicrofacetDistribution distribution) {
  return distribution == kGgx ? 2e-4 : 8e-3;
}

struct DielectricRow {
  MicrofacetDistribution distribution;
  float alpha;
  int theta_o, theta_i, phi_i;  // degrees
  float f_cos, pdf_w;
};

// int_ior 1.5, ext_ior 1.
constexpr DielectricRow kDielectric[] = {
    {kGgx, 0.1f, 30, 35, 170, 0.174035f, 0.174248f},
    {kGgx, 0.1f, 60, 50, 200, 0.0191308f, 0.0191985f},
    {kGgx, 0.1f, 80, 75, 185, 0.532761f, 0.550707f},
    {kGgx, 0.1f, 30, 160, 175, 33.5549f, 75.5236f},
    {kGgx, 0.1f, 60, 150, 190, 0.624883f, 1.40716f},
    {kGgx, 0.1f, 150, 20, 170, 0.0629628f, 0.0279927f},
    {kGgx, 0.1f, 140, 130, 180, 3.36638f, 3.37829f},
    {kGgx, 0.1f, 155, 150, 180, 0.304119f, 0.304372f},
    {kGgx, 0.3f, 30, 35, 170, 0.0383124f, 0.0387305f},
    {kGgx, 0.3f, 60, 50, 200, 0.0391556f, 0.0403692f},
    {kGgx, 0.3f, 80, 75, 185, 0.430243f, 0.538057f},
    {kGgx, 0.3f, 30, 160, 175, 9.35464f, 21.1105f},
    {kGgx, 0.3f, 60, 150, 190, 1.0089f, 2.28693f},
    {kGgx, 0.3f, 150, 20, 170, 0.500786f, 0.223233f},
    {kGgx, 0.3f, 140, 130, 180, 0.950693f, 0.98016f},
    {kGgx, 0.3f, 155, 150, 180, 0.0454375f, 0.0457757f},
    {kGgx, 0.7f, 30, 35, 170, 0.00712091f, 0.0075256f},
    {kGgx, 0.7f, 60, 50, 200, 0.0127674f, 0.0146971f},
    {kGgx, 0.7f, 80, 75, 185, 0.0545736f, 0.103616f},
    {kGgx, 0.7f, 30, 160, 175, 1.86219f, 4.25684f},
    {kGgx, 0.7f, 60, 150, 190, 0.302269f, 0.706827f},
    {kGgx, 0.7f, 150, 20, 170, 1.59772f, 0.721442f},
    {kGgx, 0.7f, 140, 130, 180, 0.16788f, 0.193254f},
    {kGgx, 0.7f, 155, 150, 180, 0.0081989f, 0.00852103f},
    {kBeckmann, 0.1f, 30, 35, 170, 0.237792f, 0.237792f},
    {kBeckmann, 0.1f, 60, 50, 200, 0.00122332f, 0.00122332f},
    {kBeckmann, 0.1f, 80, 75, 185, 0.261172f, 0.261172f},
    {kBeckmann, 0.1f, 30, 160, 175, 48.3625f, 108.816f},
    {kBeckmann, 0.1f, 60, 150, 190, 0.133648f, 0.300708f},
    {kBeckmann, 0.1f, 140, 130, 180, 4.90613f, 4.90613f},
    {kBeckmann, 0.1f, 155, 150, 180, 0.356783f, 0.356783f},
    {kBeckmann, 0.3f, 30, 35, 170, 0.0411149f, 0.0411149f},
    {kBeckmann, 0.3f, 60, 50, 200, 0.0622413f, 0.0622413f},
    {kBeckmann, 0.3f, 80, 75, 185, 0.905656f, 0.941054f},
    {kBeckmann, 0.3f, 30, 160, 175, 10.1759f, 22.8958f},
    {kBeckmann, 0.3f, 60, 150, 190, 1.50993f, 3.39734f},
    {kBeckmann, 0.3f, 150, 20, 170, 3.98741e-05f, 1.77218e-05f},
    {kBeckmann, 0.3f, 140, 130, 180, 1.07642f, 1.07642f},
    {kBeckmann, 0.3f, 155, 150, 180, 0.0469625f, 0.0469625f},
    {kBeckmann, 0.7f, 30, 35, 170, 0.00790028f, 0.00790028f},
    {kBeckmann, 0.7f, 60, 50, 200, 0.0201325f, 0.020296f},
    {kBeckmann, 0.7f, 80, 75, 185, 0.125509f, 0.168735f},
    {kBeckmann, 0.7f, 30, 160, 175, 1.99488f, 4.48847f},
    {kBeckmann, 0.7f, 60, 150, 190, 0.422278f, 0.950126f},
    {kBeckmann, 0.7f, 150, 20, 170, 1.51392f, 0.672855f},
    {kBeckmann, 0.7f, 140, 130, 180, 0.210217f, 0.211923f},
    {kBeckmann, 0.7f, 155, 150, 180, 0.00877621f, 0.00877621f},
};

struct ConductorRow {
  MicrofacetDistribution distribution;
  float alpha;
  int theta_o, theta_i, phi_i;  // degrees
  float f_cos[3], pdf_w;
};

// eta 0.2 0.92 1.1, k 3.9 2.45 2.14.
constexpr ConductorRow kConductor[] = {
    {kGgx, 0.1f, 30, 35, 170, {3.92959f, 2.56028f, 2.11207f}, 4.13513f},
    {kGgx, 0.1f, 60, 50, 200, {0.273739f, 0.179546f, 0.150592f}, 0.289777f},
    {kGgx, 0.1f, 80, 75, 185, {1.64605f, 1.22955f, 1.1223f}, 1.80223f},
    {kGgx, 0.3f, 30, 35, 170, {0.865068f, 0.563626f, 0.464955f}, 0.919126f},
    {kGgx, 0.3f, 60, 50, 200, {0.560269f, 0.367481f, 0.308222f}, 0.609321f},
    {kGgx, 0.3f, 80, 75, 185, {1.32931f, 0.992949f, 0.906337f}, 1.76084f},
    {kGgx, 0.7f, 30, 35, 170, {0.160785f, 0.104758f, 0.0864186f}, 0.178592f},
    {kGgx, 0.7f, 60, 50, 200, {0.182686f, 0.119824f, 0.100501f}, 0.221833f},
    {kGgx, 0.7f, 80, 75, 185, {0.168614f, 0.125949f, 0.114963f}, 0.339091f},
    {kBeckmann, 0.1f, 30, 35, 170, {5.36918f, 3.49823f, 2.88582f}, 5.64312f},
    {kBeckmann, 0.1f, 60, 50, 200, {0.0175042f, 0.011481f, 0.00962962f}, 0.0184644f},
    {kBeckmann, 0.1f, 80, 75, 185, {0.806933f, 0.602754f, 0.550177f}, 0.854706f},
    {kBeckmann, 0.3f, 30, 35, 170, {0.928348f, 0.604855f, 0.498966f}, 0.975712f},
    {kBeckmann, 0.3f, 60, 50, 200, {0.890598f, 0.584144f, 0.489946f}, 0.939452f},
    {kBeckmann, 0.3f, 80, 75, 185, {2.79817f, 2.09014f, 1.90783f}, 3.07967f},
    {kBeckmann, 0.7f, 30, 35, 170, {0.178383f, 0.116224f, 0.0958769f}, 0.187484f},
    {kBeckmann, 0.7f, 60, 50, 200, {0.288072f, 0.188947f, 0.158478f}, 0.306341f},
    {kBeckmann, 0.7f, 80, 75, 185, {0.38778f, 0.28966f, 0.264393f}, 0.5522f},
};

TEST(BsdfReference, RoughDielectric) {
  for (const DielectricRow& row : kDielectric) {
    const SurfaceParams params = glass(row.distribution, row.alpha, 1.5f, false);
    const BsdfValue value = evaluate_bsdf(params, direction_at(row.theta_o, 0), direction_at(row.theta_i, row.phi_i));
    const double allowed = tolerance(row.distribution);
    EXPECT_NEAR(value.f_cos.x / row.f_cos, 1, allowed) << row.alpha << ' ' << row.theta_o << ' ' << row.theta_i;
    EXPECT_NEAR(value.pdf_w / row.pdf_w, 1, allowed) << row.alpha << ' ' << row.theta_o << ' ' << row.theta_i;
  }
}

TEST(BsdfReference, RoughConductor) {
  for (const ConductorRow& row : kConductor) {
    SurfaceParams params;
    params.model = LobeModel::conductor;
    params.distribution = row.distribution;
    params.alpha = row.alpha;
    params.eta = {0.2f, 0.92f, 1.1f};
    params.k = {3.9f, 2.45f, 2.14f};
    const BsdfValue value = evaluate_bsdf(params, direction_at(row.theta_o, 0), direction_at(row.theta_i, row.phi_i));
    const double allowed = tolerance(row.distribution);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(value.f_cos[c] / row.f_cos[c], 1, allowed) << row.alpha << ' ' << row.theta_o << ' ' << row.theta_i;
    }
    EXPECT_NEAR(value.pdf_w / row.pdf_w, 1, allowed) << row.alpha << ' ' << row.theta_o << ' ' << row.theta_i;
  }
}

}  // namespace
}  // namespace helio::test
