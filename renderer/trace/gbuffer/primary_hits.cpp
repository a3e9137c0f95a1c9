#include "renderer/trace/gbuffer/primary_hits.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <optional>

#include "renderer/film/core/direction_reservoir.h"
#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/history_source.h"
#include "renderer/trace/bsdf/bsdf_views.h"
#include "renderer/trace/gbuffer/light_reweighting.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/scene/shading_point.h"

namespace helio {
namespace {

constexpr int kMostPixels = kPathGroupSize * kPathGroupSize;
constexpr int kDirections = 8;  // of lobe_change()
constexpr int kViewpoints = 2;  // from which a picture is compared

// Of an albedo between two views of a surface.
constexpr float kMostAlbedoChange = 4;

// What a few samples of a surface's BSDF say of its two views, new and old.
struct LobeChange {
  float unseen = 1;      // how much of the light along the new one comes otherwise along the old, [0, 1]
  Rgb arrival{0, 0, 0};  // albedo of directions that the old one hardly sees
};

// wo, from: local, the new and the old view, as `views` has them; beyond `expected`, new over old.
LobeChange lobe_change(const BsdfViews& views, const V3f& wo, const V3f& from, float expected, std::uint32_t key) {
  LobeChange told;
  if (!(from.z * wo.z > 0)) return told;
  float whole = 0, changed = 0;
  for (int k = 0; k < kDirections; ++k) {
    const SamplePair u = sample_pair(key, reverse_bits(std::uint32_t(k)), 0);
    const BsdfSample sample = views.first().sample((float(k) + 0.5f) / kDirections, V2f(u.x, u.y));
    if (!sample.valid() || !is_finite(sample.weight)) continue;
    const float weight = luminance(sample.weight);
    whole += weight;
    const float there = sample.delta ? 0.0f : expected * luminance(views.second_f_cos(sample.wi)) / sample.pdf_w;
    changed += std::fabs(there - weight);
    // What ratios that are cut off at the most leave out.
    if (!sample.delta && there * kMostRatio < weight)
      told.arrival += sample.weight * ((1 - there * kMostRatio / weight) / kDirections);
  }
  told.unseen = whole > 0 ? std::min(changed / whole, 1.0f) : 0.0f;
  return told;
}

// Geometric, towards the viewer.
std::uint32_t packed_normal(const Surface& s) {
  return pack_direction(s.facing_normal());
}

}  // namespace

CentreHit surface_at(const SceneData& scene, const Ray& ray, const Hit& hit) {
  CentreHit at;
  if (!hit.valid()) return at;
  at.instance = scene.instance_name(hit);
  at.normal = packed_normal(make_surface<true>(scene, ray, hit));
  return at;
}

struct PrimaryHits::Block {
  PixelRect window;
  Ray rays[kMostPixels];
  Hit hits[kMostPixels];
  std::uint32_t order[kMostPixels];
  std::uint32_t slot[kMostPixels];      // of a pixel of the window, row-major: its ray
  std::optional<ShadingPoint> shading;  // of the pixel in hand; none: it looks alike from everywhere
  V3f wo;                               // local
  Rgb albedo;                           // of the pixel in hand, as centres tell it
  bool albedo_known = false;            // it is the surface's, seen along wo
  PixelFeatures features;               // of the pixel in hand
  std::uint32_t key = 0;

  // lobe_change() of the pixel that asked last in a cell: others there that show the like take it over.
  struct CellChange {
    const MaterialRecord* material = nullptr;
    V3f viewpoint{0}, normal{0};
    LobeChange change;
  };
  static constexpr int kCell = 4, kCells = kPathGroupSize / kCell;
  CellChange changes[kCells][kCells][kViewpoints];

  // Of the pixel in hand.
  CellChange (*cell)[kViewpoints] = nullptr;

  std::size_t at(int x, int y) const {
    return slot[std::size_t(y - window.y0) * std::size_t(window.width()) + std::size_t(x - window.x0)];
  }
};

PrimaryHits::PrimaryHits(const RenderScene& scene, const Camera& camera, const V3d& axis)
    : scene_(scene.impl()),
      camera_(camera),
      axis_(axis),
      only_lambert_(scene.features().only_lambert),
      block_(std::make_unique<Block>()) {}

PrimaryHits::~PrimaryHits() = default;

void PrimaryHits::trace(const PixelRect& window) {
  constexpr int kTile = 4;  // neighbours share a packet
  Block& b = *block_;
  b.window = window;
  std::fill_n(&b.changes[0][0][0], Block::kCells * Block::kCells * kViewpoints, Block::CellChange{});
  std::uint32_t count = 0;
  for (int ty = window.y0; ty < window.y1; ty += kTile) {
    for (int tx = window.x0; tx < window.x1; tx += kTile) {
      for (int y = ty; y < std::min(ty + kTile, window.y1); ++y) {
        for (int x = tx; x < std::min(tx + kTile, window.x1); ++x) {
          const CameraRay camera = camera_.generate_ray(x, y, V2f(0.5f, 0.5f), V2f(0.5f, 0.5f));
          Ray& ray = b.rays[count];
          ray.origin = camera.origin;
          ray.direction = camera.direction;
          ray.t_max = std::numeric_limits<float>::infinity();
          ray.alpha_key = kCentreAlphaKey;
          b.order[count] = count;
          b.slot[std::size_t(y - window.y0) * std::size_t(window.width()) + std::size_t(x - window.x0)] = count;
          ++count;
        }
      }
    }
  }
  scene_.accel->intersect(b.rays, b.order, count, b.hits, RayOrder::camera);
}

CentreHit PrimaryHits::at(int x, int y) {
  Block& b = *block_;
  const std::size_t i = b.at(x, y);
  const Ray& ray = b.rays[i];
  const Hit& hit = b.hits[i];
  b.shading.reset();
  b.features = {};
  b.features.depth = hit.valid() ? hit.t : std::numeric_limits<float>::infinity();
  b.features.add(Rgb(0), V3f(0), hit.valid());
  CentreHit centre;
  centre.shines = 1;
  if (!hit.valid()) return centre;
  centre.shines = scene_.materials[scene_.part(hit).material].emissive;
  b.features.primitive = hit.primitive;
  const auto see = [&b](const Rgb& albedo, const V3f& normal) {
    for (int c = 0; c < 3; ++c) {
      b.features.albedo[c] = albedo[c];
      b.features.normal[c] = normal[c];
    }
  };
  centre.depth = hit.t * dot(ray.direction, axis_);
  centre.instance = scene_.instance_name(hit);
  if (only_lambert_) {
    Surface surface = make_surface<true>(scene_, ray, hit);
    if (!surface.material->textured) {
      const Rgb& albedo = surface.material->params.base_color;
      centre.normal = packed_normal(surface);
      centre.albedo = pack_reflectance(albedo);
      surface.shading_normal = surface.geometric_normal;
      if (has_shading_normals(surface)) interpolate_normal(scene_, hit, -ray.direction, 0.0f, surface);
      const bool black = surface.material->one_sided && !surface.front;
      see(black ? Rgb(0) : albedo, shading_frame(surface).n);
      return centre;
    }
  }
  const ShadingPoint& shading = b.shading.emplace(scene_, camera_, ray, hit);
  b.wo = shading.frame.to_local(-ray.direction);
  b.key = pixel_key(x, y, 0, 0);
  const auto cell = [](int at) { return (at & (kPathGroupSize - 1)) / Block::kCell; };
  b.cell = &b.changes[cell(y)][cell(x)];
  centre.normal = packed_normal(shading.surface);
  const SurfaceParams& params = shading.params;
  const V3f seen = params.mapped ? shading.frame.to_world(params.map_normal) : shading.frame.n;
  if (shading.black) {
    see(Rgb(0), seen);
    b.shading.reset();
    return centre;
  }
  // A point of a texture is not the mean over a pixel, and the mean of ratios of points not that of their means (+1.5 %
  // in Sponza): only where textures are filtered does their albedo count.
  const bool point_of_texture = shading.surface.material->textured && !scene_.mip_mapped;
  const bool lambert = params.model == LobeModel::lambert && !params.mapped;
  const Rgb albedo = lambert ? params.base_color : shading.bsdf().albedo();
  see(albedo, seen);
  centre.albedo = pack_reflectance(point_of_texture ? Rgb(1, 1, 1) : albedo);
  b.albedo = unpack_reflectance(centre.albedo);
  b.albedo_known = !point_of_texture;
  if (params.model == LobeModel::none || lambert) b.shading.reset();
  return centre;
}

const PixelFeatures& PrimaryHits::features() const {
  return block_->features;
}

bool PrimaryHits::depends_on_view() const {
  return block_->shading.has_value();
}

Rgb PrimaryHits::albedo_change(const BsdfViews& views, const V3f& from) const {
  const Block& b = *block_;
  if (!b.albedo_known || !(from.z * b.wo.z > 0)) return {1, 1, 1};
  // As the picture from there has it, rounded like it: what is not changed is 1 to the bit.
  const Rgb there = unpack_reflectance(pack_reflectance(views.second().albedo()));
  Rgb change = demodulation(b.albedo) / demodulation(there);
  for (int c = 0; c < 3; ++c) {
    // One of the two was too dark to divide by.
    if (!(change[c] <= kMostAlbedoChange && change[c] >= 1 / kMostAlbedoChange)) change[c] = 1;
  }
  return change;
}

void PrimaryHits::ask_lobes(const V3f& viewpoint, const BsdfViews& views, const V3f& from, ViewEvidence& told) const {
  constexpr float kAlike = 0.99f;  // cosine between normals
  const Block& b = *block_;
  const Surface& surface = b.shading->surface;
  const V3f& normal = b.shading->frame.n;
  const bool varies = textured();
  Block::CellChange* keep = nullptr;
  for (Block::CellChange& known : *b.cell) {
    if (known.material && !(known.viewpoint == viewpoint)) continue;
    if (known.material == surface.material && dot(known.normal, normal) > kAlike && !varies) {
      told.unseen = known.change.unseen;
      told.arrival = known.change.arrival;
      return;
    }
    keep = &known;
    break;
  }
  const LobeChange change = lobe_change(views, b.wo, from, luminance(told.albedo), b.key);
  told.unseen = change.unseen;
  told.arrival = change.arrival;
  if (keep) *keep = {surface.material, viewpoint, normal, change};
}

bool PrimaryHits::textured() const {
  const ShadingPoint& shading = *block_->shading;
  const MaterialRecord& m = *shading.surface.material;
  const TriangleMesh* mesh = shading.surface.part->mesh;
  return m.textured || m.layers_textured || m.normal_mapped || m.scatters_mapped ||
         shading.params.model == LobeModel::blend || (mesh && !mesh->colors.empty());
}

ViewEvidence PrimaryHits::evidence_from(const V3f& viewpoint, WeighedDirections& directions) const {
  const Block& b = *block_;
  const Frame& frame = b.shading->frame;
  const V3f from = frame.to_local(normalize_any(viewpoint - b.shading->surface.position));
  const BsdfViews views(b.shading->bsdf(), b.shading->params, from);
  ViewEvidence told;
  told.material = b.shading->surface.material;
  told.normal = frame.n;
  told.pools = !textured();
  // What is known of all directions together. Ratios are over it from here on.
  told.albedo = albedo_change(views, from);
  const Rgb inverse(1 / told.albedo.x, 1 / told.albedo.y, 1 / told.albedo.z);
  ask_lobes(viewpoint, views, from, told);

  LightReweighting change(directions.light);
  directions.merge_equal();
  for (std::size_t i = 0; i < directions.count; ++i) {
    WeighedDirection& d = directions.of[i];
    SeenLight before{Rgb(1, 1, 1), Rgb(1, 1, 1)}, now{inverse, inverse};
    if (d.packed == DirectionReservoir::kNone) {
      change.add_unknown(d.weight);
      continue;
    }
    if (d.packed != DirectionReservoir::kAny) {
      const V3f wi = frame.to_local(unpack_direction<DirectionReservoir::kAxisBits>(d.packed));
      const BsdfViews::Values values = views.f_cos(wi);
      before = {values.second, values.second_matte};
      now = {values.first * inverse, values.first_matte * inverse};
    }
    const float counts = change.add(d.weight, before, now);
    if (counts >= 0) d.weight = std::min(d.weight * counts * luminance(told.albedo), FLT_MAX);
  }
  change.tell(told);
  directions.light *= double(luminance(told.albedo)) * std::max(1 + double(told.off), 0.0);
  return told;
}

int PrimaryHits::material(int x, int y) const {
  const Hit& hit = block_->hits[block_->at(x, y)];
  return hit.valid() ? int(scene_.part(hit).material) : -1;
}

}  // namespace helio
