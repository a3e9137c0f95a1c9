#include "renderer/trace/lights/light_groups.h"

#include <array>

namespace helio {
namespace {

// Corners may miss each other by this share of the longest edge: transforms and the edges themselves round in float.
constexpr float kCornerTolerance = 1e-5f;
constexpr float kUvTolerance = 1e-4f;
// Largest 1 - cos between the normals of two halves.
constexpr float kNormalTolerance = 1e-6f;
// The other half of a quad follows it closely in the files that exporters write.
constexpr std::uint32_t kLookAhead = 8;

V3f corner(const AreaEmitter& e, int i) {
  return i == 0 ? e.p0 : e.p0 + (i == 1 ? e.e1 : e.e2);
}

bool usable(const AreaEmitter& e) {
  return is_finite(e.radiance) && !is_black(e.radiance);
}

// A light together with its alpha, while it is being put together.
struct Candidate {
  AreaLight light;
  LightAlpha alpha;
};

class Grouping {
 public:
  Grouping(const std::vector<AreaEmitter>& emitters, const std::vector<EmitterAlpha>& alphas)
      : emitters_(emitters), alphas_(alphas) {}

  AreaLights run() const;

 private:
  const EmitterAlpha* alpha_of(const AreaEmitter& e) const {
    return e.alpha == kOpaqueEmitter ? nullptr : &alphas_[e.alpha];
  }
  bool same_emission(const AreaEmitter& a, const AreaEmitter& b) const;
  Candidate single_light(const AreaEmitter& e) const;
  Candidate join(const AreaEmitter& a, int apex, const AreaEmitter& b) const;
  Candidate join(const AreaEmitter& a, const AreaEmitter& b) const;

  const std::vector<AreaEmitter>& emitters_;
  const std::vector<EmitterAlpha>& alphas_;
};

bool Grouping::same_emission(const AreaEmitter& a, const AreaEmitter& b) const {
  if (a.radiance != b.radiance || a.two_sided != b.two_sided || !(a.texture == b.texture)) return false;
  const EmitterAlpha *p = alpha_of(a), *q = alpha_of(b);
  if (!p || !q) return p == q;
  return p->texture == q->texture && p->mask == q->mask && (!p->mask || p->cutoff == q->cutoff);
}

// The alpha of the planar light whose p0, p0 + e1 and p0 + e2 are the corners i, s and t of a triangle.
LightAlpha planar_alpha(const EmitterAlpha& a, std::size_t i, std::size_t s, std::size_t t) {
  LightAlpha out;
  out.texture = a.texture;
  out.mask = a.mask;
  out.cutoff = a.cutoff;
  out.uv = a.uv[i];
  out.uv_s = a.uv[s] - a.uv[i];
  out.uv_t = a.uv[t] - a.uv[i];
  out.factor = a.factor[i];
  out.factor_s = a.factor[s] - a.factor[i];
  out.factor_t = a.factor[t] - a.factor[i];
  return out;
}

Candidate Grouping::single_light(const AreaEmitter& e) const {
  Candidate out;
  const EmitterAlpha* alpha = alpha_of(e);
  if (e.shape == AreaEmitter::Shape::triangle) {
    out.light.shape = make_triangle_shape(e.p0, e.e1, e.e2, e.normal, e.two_sided);
    out.light.uv = e.uv[0];
    out.light.uv_s = e.uv[1] - e.uv[0];
    out.light.uv_t = e.uv[2] - e.uv[0];
    if (alpha) out.alpha = planar_alpha(*alpha, 0, 1, 2);
    return out;
  }
  out.light.shape = e.shape == AreaEmitter::Shape::sphere ? make_sphere_shape(e.p0, e.e1.x, e.two_sided)
                                                          : make_ellipsoid_shape(e.p0, e.e1, e.e2, e.e3, e.two_sided);
  if (alpha) {
    out.alpha.texture = alpha->texture;
    out.alpha.factor = alpha->factor[0];
    out.alpha.mask = alpha->mask;
    out.alpha.cutoff = alpha->cutoff;
  }
  return out;
}

// The corner of `b` that is not on the edge of `a` opposite its corner `apex`, when that edge is shared; else -1.
// partner[j] receives the corner of b that coincides with corner j of a.
int far_corner(const AreaEmitter& a, int apex, const AreaEmitter& b, float tolerance, std::array<int, 3>& partner) {
  int used = 0;
  for (int j = 0; j < 3; ++j) {
    if (j == apex) continue;
    partner[j] = -1;
    for (int i = 0; i < 3; ++i) {
      if (length(corner(b, i) - corner(a, j)) <= tolerance) partner[j] = i;
    }
    if (partner[j] < 0) return -1;
    used |= 1 << partner[j];
  }
  return used == 6 ? 0 : used == 5 ? 1 : used == 3 ? 2 : -1;
}

bool differs(const V2f& a, const V2f& b) {
  return !(std::abs(a.x - b.x) <= kUvTolerance && std::abs(a.y - b.y) <= kUvTolerance);
}

// Whether the texture coordinates of two halves continue across the diagonal.
bool continues(const CornerUvs& a, const CornerUvs& b, int apex, int s, int t, const std::array<int, 3>& partner,
               int far) {
  return !differs(a[s] + a[t] - a[apex], b[far]) && !differs(a[s], b[partner[s]]) && !differs(a[t], b[partner[t]]);
}

bool continues(const std::array<float, 3>& a, const std::array<float, 3>& b, int apex, int s, int t,
               const std::array<int, 3>& partner, int far) {
  const auto near = [](float x, float y) { return std::abs(x - y) <= kUvTolerance; };
  return near(a[s] + a[t] - a[apex], b[far]) && near(a[s], b[partner[s]]) && near(a[t], b[partner[t]]);
}

// The parallelogram whose one half is `a`, with corner `apex` opposite the diagonal, and whose other half is `b`;
// shape.area is 0 when they do not make one.
Candidate Grouping::join(const AreaEmitter& a, int apex, const AreaEmitter& b) const {
  Candidate out;
  const int s = (apex + 1) % 3, t = (apex + 2) % 3;
  const V3f p0 = corner(a, apex), e1 = corner(a, s) - p0, e2 = corner(a, t) - p0;
  const float tolerance = kCornerTolerance * std::max({length(e1), length(e2), length(e2 - e1)});
  std::array<int, 3> partner{};
  const int far = far_corner(a, apex, b, tolerance, partner);
  if (far < 0 || !(length(p0 + e1 + e2 - corner(b, far)) <= tolerance)) return out;
  if (a.texture.present() && !continues(a.uv, b.uv, apex, s, t, partner, far)) return out;
  if (const EmitterAlpha* p = alpha_of(a)) {
    const EmitterAlpha& q = *alpha_of(b);
    if (p->texture.present() && !continues(p->uv, q.uv, apex, s, t, partner, far)) return out;
    if (!continues(p->factor, q.factor, apex, s, t, partner, far)) return out;
    out.alpha = planar_alpha(*p, apex, s, t);
  }
  out.light.uv = a.uv[apex];
  out.light.uv_s = a.uv[s] - out.light.uv;
  out.light.uv_t = a.uv[t] - out.light.uv;
  out.light.shape = make_parallelogram_shape(p0, e1, e2, a.normal, a.two_sided);
  return out;
}

Candidate Grouping::join(const AreaEmitter& a, const AreaEmitter& b) const {
  Candidate out;
  if (b.shape != AreaEmitter::Shape::triangle || !usable(b) || !same_emission(a, b) ||
      !(dot(a.normal, b.normal) >= 1 - kNormalTolerance) || !(single_light(b).light.shape.area > 0)) {
    return out;
  }
  for (int apex = 0; apex < 3 && !(out.light.shape.area > 0); ++apex) out = join(a, apex, b);
  return out;
}

AreaLights Grouping::run() const {
  AreaLights out;
  out.light_of_emitter.assign(emitters_.size(), kNoLight);
  for (std::uint32_t i = 0; i < emitters_.size(); ++i) {
    const AreaEmitter& e = emitters_[i];
    if (out.light_of_emitter[i] != kNoLight || !usable(e)) continue;
    Candidate candidate = single_light(e);
    if (!(candidate.light.shape.area > 0)) continue;
    const std::uint32_t index = std::uint32_t(out.lights.size());
    const std::uint32_t end = std::uint32_t(std::min<std::size_t>(emitters_.size(), std::size_t(i) + 1 + kLookAhead));
    for (std::uint32_t j = i + 1; j < end && e.shape == AreaEmitter::Shape::triangle; ++j) {
      if (out.light_of_emitter[j] != kNoLight) continue;
      const Candidate joined = join(e, emitters_[j]);
      if (!(joined.light.shape.area > 0)) continue;
      candidate = joined;
      out.light_of_emitter[j] = index;
      break;
    }
    AreaLight& light = candidate.light;
    light.radiance = e.radiance;
    light.textured = e.texture.present();
    light.emitter = i;
    if (e.alpha != kOpaqueEmitter) {
      light.alpha = std::uint32_t(out.alphas.size());
      out.alphas.push_back(candidate.alpha);
    }
    out.light_of_emitter[i] = index;
    out.lights.push_back(light);
  }
  return out;
}

}  // namespace

AreaLights group_area_emitters(const std::vector<AreaEmitter>& emitters, const std::vector<EmitterAlpha>& alphas) {
  return Grouping(emitters, alphas).run();
}

}  // namespace helio
