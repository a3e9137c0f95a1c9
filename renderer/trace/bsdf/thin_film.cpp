#include "renderer/trace/bsdf/thin_film.h"

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/recent_values.h"

namespace helio {

namespace {

float schlick(float f0, float cosine) {
  return f0 + (1 - f0) * schlick_term(cosine);
}

// Fourier transform of the colour matching functions at an optical path difference (nm) and a phase shift for each of
// x, y and z: Gaussians fitted to the CIE 1931 observer, constants of the paper's supplement.
Rgb spectral_response(float path_nm, const Rgb& shift) {
  constexpr float kHeight[4] = {5.4856e-13f, 4.4201e-13f, 5.2481e-13f, 9.7470e-14f};
  constexpr float kCenter[4] = {1.6810e6f, 1.7953e6f, 2.2084e6f, 2.2399e6f};
  constexpr float kWidth[4] = {4.3278e9f, 9.3046e9f, 6.6121e9f, 4.5282e9f};
  constexpr float kNorm = 1.0685e-7f;
  constexpr float kLeastExponent = -87;  // below it exp() is denormal, or 0
  const float phase = kTwoPi * path_nm * 1e-9f;
  const auto lobe = [&](int i, float offset) {
    const float exponent = -kWidth[i] * phase * phase;
    if (!(exponent > kLeastExponent)) return 0.0f;
    return kHeight[i] / kNorm * std::sqrt(kTwoPi * kWidth[i]) * std::cos(kCenter[i] * phase + offset) *
           std::exp(exponent);
  };
  const float x = lobe(0, shift.x) + lobe(3, shift.x), y = lobe(1, shift.y), z = lobe(2, shift.z);
  // CIE XYZ to linear sRGB (IEC 61966-2-1).
  return {3.2404542f * x - 1.5371385f * y - 0.4985314f * z, -0.9692660f * x + 1.8760108f * y + 0.0415560f * z,
          0.0556434f * x - 0.2040259f * y + 1.0572252f * z};
}

// The film fades in over 0.03 nm, so that thickness 0 is the bare surface.
float effective_ior(float ior, float thickness_nm) {
  const float t = std::clamp(thickness_nm / 0.03f, 0.0f, 1.0f);
  return 1 + (ior - 1) * t * t * (3 - 2 * t);
}

}  // namespace

Rgb thin_film_reflectance(float cos_i, float film_ior, float thickness_nm, const Rgb& base_f0) {
  const float c1 = std::clamp(cos_i, 0.0f, 1.0f), ior = effective_ior(film_ior, thickness_nm);
  const float c2 = std::sqrt(std::max(0.0f, 1 - (1 - c1) * (1 + c1) / (ior * ior)));
  const float r12 = schlick(dielectric_f0(ior), c1), t121 = 1 - r12;
  const float path = 2 * ior * thickness_nm * c2;

  Rgb r23, phase;
  for (int c = 0; c < 3; ++c) {
    const float root = std::sqrt(std::clamp(base_f0[c], 0.0f, 0.9999f));
    const float base_ior = (1 + root) / (1 - root);
    r23[c] = schlick(dielectric_f0(base_ior / ior), c2);
    phase[c] = kPi + (base_ior < ior ? kPi : 0.0f);
  }
  const Rgb first = spectral_response(path, phase), second = spectral_response(2 * path, phase * 2.0f);
  Rgb reflectance;
  for (int c = 0; c < 3; ++c) {
    const float r123 = std::clamp(r12 * r23[c], 1e-5f, 0.9999f), amplitude = std::sqrt(r123);
    const float inner = t121 * t121 * r23[c] / (1 - r123);
    const float order_1 = (inner - t121) * amplitude;
    const float total = r12 + inner + 2 * order_1 * (first[c] + amplitude * second[c]);
    reflectance[c] = std::clamp(total, 0.0f, 1.0f);
  }
  return reflectance;
}

Rgb ThinFilm::over_opaque(const Rgb& bare, float cos_i) const {
  Rgb covered(0, 0, 0);
  if (metal > 0) covered += thin_film_reflectance(cos_i, ior, thickness, metal_f0) * metal;
  if (dielectric > 0) covered += thin_film_reflectance(cos_i, ior, thickness, dielectric_f0) * dielectric;
  return bare * (1 - cover) + covered * cover;
}

Rgb ThinFilm::mean_over_metal() const {
  constexpr int kPoints = 16;
  static thread_local RecentValues<Rgb, 5> sums;
  const Rgb covered = sums.get({ior, thickness, metal_f0.x, metal_f0.y, metal_f0.z}, [this] {
    Rgb sum(0, 0, 0);
    for (int i = 0; i < kPoints; ++i) {
      sum += thin_film_reflectance(std::sqrt((float(i) + 0.5f) / kPoints), ior, thickness, metal_f0);
    }
    return sum;
  });
  return mean_schlick(metal_f0) * (1 - cover) + covered * (cover / kPoints);
}

Rgb ThinFilm::over_glass(const Rgb& bare, float cos_i) const {
  return bare * (1 - cover) + thin_film_reflectance(cos_i, ior, thickness, dielectric_f0) * (cover * glass_weight);
}

}  // namespace helio
