#include "renderer/trace/microfacet_albedo.h"

#include <array>
#include <memory>

#include "renderer/trace/fresnel.h"
#include "renderer/trace/microfacet.h"

namespace helio {

namespace {

// Nodes are equidistant in sqrt(mu) and in sqrt(alpha): the albedo of a smooth surface falls within mu < alpha.
constexpr int kMuNodes = 64, kAlphaNodes = 32, kQuadraturePoints = 512;

struct AlbedoTable {
  std::array<std::array<AlbedoTerms, kMuNodes>, kAlphaNodes> directional;
  std::array<AlbedoTerms, kAlphaNodes> mean;
};

AlbedoTerms mirror_terms(float mu) {
  const float s = schlick_term(mu);
  return {1 - s, s, s};
}

// Mean over visible normals by a rank-1 lattice (golden ratio), whose error is far below that of the interpolation.
AlbedoTerms integrate_terms(const Microfacet& microfacet, float mu) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  const V3f wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
  double a = 0, b = 0;
  for (int i = 0; i < kQuadraturePoints; ++i) {
    const double turn = (i + 0.5) * kGoldenRatio;
    const V2f u(static_cast<float>((i + 0.5) / kQuadraturePoints), static_cast<float>(turn - std::floor(turn)));
    const V3f m = microfacet.sample_visible_normal(wo, u);
    const float cos_m = std::max(0.0f, dot(wo, m));
    const double kept = microfacet.masking(m * (2 * cos_m) - wo), s = schlick_term(cos_m);
    a += kept * (1 - s);
    b += kept * s;
  }
  return {static_cast<float>(a / kQuadraturePoints), static_cast<float>(b / kQuadraturePoints),
          static_cast<float>(b / (a + b))};
}

AlbedoTerms mix(const AlbedoTerms& p, const AlbedoTerms& q, float t) {
  return {p.a + (q.a - p.a) * t, p.b + (q.b - p.b) * t, p.s + (q.s - p.s) * t};
}

// 2 int E(mu) mu dmu = 4 int E(x) x^3 dx with x = sqrt(mu), E linear in x within a cell: a polynomial of degree 4,
// which three Gauss points integrate exactly.
AlbedoTerms integrate_mean(const std::array<AlbedoTerms, kMuNodes>& row) {
  constexpr double kNode[3] = {0.112701665379258311, 0.5, 0.887298334620741689};
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  double a = 0, b = 0, s = 0;
  for (int i = 0; i + 1 < kMuNodes; ++i) {
    for (int q = 0; q < 3; ++q) {
      const double x = (i + kNode[q]) / (kMuNodes - 1), weight = 4 * x * x * x * kWeight[q] / (kMuNodes - 1);
      const AlbedoTerms terms = mix(row[i], row[i + 1], static_cast<float>(kNode[q]));
      a += weight * terms.a;
      b += weight * terms.b;
      s += weight * terms.s;
    }
  }
  return {static_cast<float>(a), static_cast<float>(b), static_cast<float>(s)};
}

std::unique_ptr<const AlbedoTable> build_table(MicrofacetDistribution distribution) {
  auto table = std::make_unique<AlbedoTable>();
  for (int j = 0; j < kAlphaNodes; ++j) {
    const Microfacet microfacet{distribution, sqr(float(j) / (kAlphaNodes - 1))};
    for (int i = 0; i < kMuNodes; ++i) {
      const float mu = sqr(float(i) / (kMuNodes - 1));
      table->directional[j][i] = j == 0 ? mirror_terms(mu) : integrate_terms(microfacet, mu);
    }
    table->mean[j] = integrate_mean(table->directional[j]);
  }
  return table;
}

const AlbedoTable& table_of(MicrofacetDistribution distribution) {
  if (distribution == MicrofacetDistribution::beckmann ||
      distribution == MicrofacetDistribution::beckmann_anisotropic) {
    static const std::unique_ptr<const AlbedoTable> beckmann = build_table(MicrofacetDistribution::beckmann);
    return *beckmann;
  }
  static const std::unique_ptr<const AlbedoTable> ggx = build_table(MicrofacetDistribution::ggx);
  return *ggx;
}

// Cell and position of a coordinate in [0, 1] among `nodes` equidistant nodes.
struct CellPosition {
  int index;
  float t;
};

CellPosition locate(float coordinate, int nodes) {
  const float x = std::clamp(coordinate, 0.0f, 1.0f) * (nodes - 1);
  const int index = std::min(static_cast<int>(x), nodes - 2);
  return {index, x - index};
}

}  // namespace

AlbedoTerms directional_albedo(MicrofacetDistribution distribution, float alpha, float mu) {
  const AlbedoTable& table = table_of(distribution);
  const CellPosition row = locate(safe_sqrt(alpha), kAlphaNodes), column = locate(safe_sqrt(mu), kMuNodes);
  const auto& low = table.directional[row.index];
  const auto& high = table.directional[row.index + 1];
  return mix(mix(low[column.index], low[column.index + 1], column.t),
             mix(high[column.index], high[column.index + 1], column.t), row.t);
}

AlbedoTerms mean_albedo(MicrofacetDistribution distribution, float alpha) {
  const AlbedoTable& table = table_of(distribution);
  const CellPosition row = locate(safe_sqrt(alpha), kAlphaNodes);
  return mix(table.mean[row.index], table.mean[row.index + 1], row.t);
}

void prepare_albedo_tables(MicrofacetDistribution distribution) {
  table_of(distribution);
}

}  // namespace helio
