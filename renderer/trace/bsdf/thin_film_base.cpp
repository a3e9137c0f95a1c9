#include "renderer/trace/bsdf/thin_film_base.h"

#include "renderer/trace/bsdf/fresnel.h"
#include "renderer/trace/bsdf/recent_values.h"

namespace helio {

FilmedBase::FilmedBase(const ThinFilm& film, float bare_f0, float f90, MicrofacetDistribution distribution, float alpha)
    : row_(albedo_row(distribution, alpha)), f90_(f90) {
  // At a cosine of 0 all reflect f90 and q is a limit: taken close to it.
  constexpr float kLeastCosine = 0.01f;
  for (std::size_t k = 0; k < q_.size(); ++k) {
    const float cosine = std::max(kLeastCosine, float(k) / float(q_.size() - 1)), s = schlick_term(cosine);
    const Rgb covered = thin_film_reflectance(cosine, film.ior, film.thickness, film.dielectric_f0) * f90;
    for (int c = 0; c < 3; ++c) {
      q_[k][c] = bare_f0 * (1 - film.cover) + (covered[c] - f90 * s) / (1 - s) * film.cover;
    }
  }
  // Crests lie above the chords between nodes by up to an eighth of the second difference: raised by that, no light is
  // gained.
  const std::array<Rgb, CosineWeights::kNodes> at_nodes = q_;
  for (std::size_t k = 0; k < q_.size(); ++k) {
    const std::size_t i = std::clamp(k, std::size_t(1), q_.size() - 2);
    for (int c = 0; c < 3; ++c) {
      const float crest = 2 * at_nodes[i][c] - at_nodes[i - 1][c] - at_nodes[i + 1][c];
      q_[k][c] += std::max(0.0f, crest) / 8;
      largest_[c] = std::clamp(q_[k][c], largest_[c], 1.0f);
    }
  }
  const Rgb mean = entering(mean_albedo(row_), mean_weights(row_));
  for (int c = 0; c < 3; ++c) per_mean_[c] = mean[c] > 0 ? 1 / mean[c] : 0.0f;
}

FilmedBase FilmedBase::recent(const ThinFilm& film, float bare_f0, float f90, MicrofacetDistribution distribution,
                              float alpha) {
  static thread_local RecentValues<FilmedBase, 10> bases;
  const Rgb& f0 = film.dielectric_f0;
  return bases.get({film.cover, film.ior, film.thickness, f0.x, f0.y, f0.z, bare_f0, f90, float(distribution), alpha},
                   [&] { return FilmedBase(film, bare_f0, f90, distribution, alpha); });
}

Rgb FilmedBase::entering(const AlbedoTerms& terms, const CosineWeights& weights) const {
  Rgb albedo(f90_ * terms.b);
  for (std::size_t k = 0; k < q_.size(); ++k) albedo += q_[k] * weights.w[k];
  const Rgb lost = largest_ * largest_ * (1 - terms.a - terms.b), passed = Rgb(1, 1, 1) - albedo - lost;
  return {std::clamp(passed.x, 0.0f, 1.0f), std::clamp(passed.y, 0.0f, 1.0f), std::clamp(passed.z, 0.0f, 1.0f)};
}

Rgb FilmedBase::entering(float mu) const {
  return entering(directional_albedo(row_, mu), directional_weights(row_, mu));
}

Rgb FilmedBase::leaving(float mu) const {
  return entering(mu) * per_mean_;
}

}  // namespace helio
