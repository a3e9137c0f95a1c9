#include "renderer/trace/bsdf/bsdf_sheen.h"

#include <array>
#include <memory>

namespace helio {

namespace {

// Nodes are equidistant in sqrt(mu) and in sqrt(alpha), from kLeastSheenAlpha on.
constexpr int kMuNodes = 48, kAlphaNodes = 24, kQuadrature = 64;
const float kLeastRoot = std::sqrt(kLeastSheenAlpha);

using SheenTable = std::array<std::array<float, kMuNodes>, kAlphaNodes>;

float bare_sheen(float alpha, const V3f& wo, const V3f& wi) {
  const V3f h = wo + wi;
  const float squared = length_squared(h);
  if (!(squared > 1e-24f)) return 0;
  const float sin2 = std::min(1.0f, (h.x * h.x + h.y * h.y) / squared);
  const float density = (2 + 1 / alpha) * std::pow(sin2, 0.5f / alpha) * (0.5f * kInvPi);
  // At least wo.z and wi.z, written without cancellation.
  const float denominator = 4 * (wi.z * (1 - wo.z) + wo.z);
  return density * wi.z / denominator;
}

// Cubes of the variates gather points at the horizon and at the azimuth of forward scattering, where the lobe is.
float integrate_albedo(float alpha, float mu) {
  const V3f wo(std::sqrt((1 - mu) * (1 + mu)), 0, mu);
  double sum = 0;
  for (int i = 0; i < kQuadrature; ++i) {
    const double t = (i + 0.5) / kQuadrature, z = t * t * t;
    const double s = std::sqrt((1 - z) * (1 + z));
    for (int j = 0; j < kQuadrature; ++j) {
      const double v = (j + 0.5) / kQuadrature, phi = std::numbers::pi * v * v * v;
      // Azimuth pi is opposite to wo in the plane: the half vector stands up; azimuth 0 leaves it lying.
      const V3f wi(V3d(s * std::cos(phi), s * std::sin(phi), z));
      sum += bare_sheen(alpha, wo, wi) * 9 * t * t * v * v;
    }
  }
  return static_cast<float>(sum * 2 * std::numbers::pi / (double(kQuadrature) * kQuadrature));
}

std::unique_ptr<const SheenTable> build_table() {
  auto table = std::make_unique<SheenTable>();
  for (int j = 0; j < kAlphaNodes; ++j) {
    const float alpha = sqr(kLeastRoot + (1 - kLeastRoot) * float(j) / (kAlphaNodes - 1));
    for (int i = 0; i < kMuNodes; ++i) {
      const float mu = std::max(1e-5f, sqr(float(i) / (kMuNodes - 1)));
      (*table)[std::size_t(j)][std::size_t(i)] = integrate_albedo(alpha, mu);
    }
  }
  return table;
}

const SheenTable& sheen_table() {
  static const std::unique_ptr<const SheenTable> table = build_table();
  return *table;
}

}  // namespace

float evaluate_sheen(float alpha, const V3f& wo, const V3f& wi, float albedo_o, float albedo_i) {
  return bare_sheen(alpha, wo, wi) / std::max({1.0f, albedo_o, albedo_i});
}

float sheen_albedo(float alpha, float mu) {
  const SheenTable& table = sheen_table();
  const float y = std::clamp((safe_sqrt(alpha) - kLeastRoot) / (1 - kLeastRoot), 0.0f, 1.0f) * (kAlphaNodes - 1);
  const float x = std::clamp(safe_sqrt(mu), 0.0f, 1.0f) * (kMuNodes - 1);
  const int j = std::min(static_cast<int>(y), kAlphaNodes - 2), i = std::min(static_cast<int>(x), kMuNodes - 2);
  const float s = x - float(i), t = y - float(j);
  const auto row = [&](int k) {
    const auto& nodes = table[std::size_t(k)];
    return nodes[std::size_t(i)] + (nodes[std::size_t(i) + 1] - nodes[std::size_t(i)]) * s;
  };
  return row(j) + (row(j + 1) - row(j)) * t;
}

void prepare_sheen_table() {
  sheen_table();
}

}  // namespace helio
