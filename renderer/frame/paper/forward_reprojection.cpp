#include "renderer/frame/paper/forward_reprojection.h"

#include <algorithm>
#include <cmath>

#include "renderer/base/check.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/paper/paper_film.h"
#include "renderer/frame/paper/view_error.h"
#include "renderer/trace/scene/scene_data.h"
#include "renderer/trace/scene/shading_point.h"

namespace helio {
namespace {

constexpr std::uint32_t kBatch = kPathGroupSize * kPathGroupSize;

// Of all samples of a pixel.
Rgb mean_irradiance(const LeftPicture::Pixel& pixel) {
  const double a = pixel.half[0].count, b = pixel.half[1].count;
  const auto channel = [&](int c) {
    const float(&mean)[kHalves][3] = pixel.hits.irradiance;
    return float((a * double(mean[0][c]) + b * double(mean[1][c])) / std::max(a + b, 1.0));
  };
  return {channel(0), channel(1), channel(2)};
}

bool same_view_of_everything(const CameraPose& a, const CameraPose& b) {
  if (a.projection != b.projection) return false;
  return a.projection == Projection::orthographic ? a.forward == b.forward : a.position == b.position;
}

}  // namespace

// Rays towards stored hits.
struct ForwardReprojection::Batch {
  struct Bidder {
    int x, y, from_x, from_y;  // pixel that it asks for | its own
    float distance;
    const StoredHit* directed;  // null: no direction was sampled at the hit
  };
  Ray rays[kBatch];
  Hit hits[kBatch];
  std::uint32_t order[kBatch];
  Bidder bidders[kBatch];
  std::uint32_t count = 0;
};

bool can_reproject_forward(const CameraPose& pose, const PixelFilter& filter) {
  return pose.lens_radius == 0 && filter.kind == PixelFilterKind::box;
}

ForwardReprojection::ForwardReprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                                         const CameraPose& from, const CameraPose& to, float max_error)
    : scene_(std::move(scene)),
      film_(film),
      region_(region),
      camera_(to, film.width(), film.height(), scene_->origin()),
      projection_(to, film.width(), film.height(), scene_->origin()),
      viewpoint_(from.position - scene_->origin()),
      view_direction_(-from.forward),
      same_viewpoint_(same_view_of_everything(from, to)),
      far_away_(from.projection == Projection::orthographic),
      max_error_(max_error) {
  HELIO_DCHECK(paper_film(film).first_hits() && film.history());
}

// The third validation. `hit` lies where the stored hit was, whose pixel that is.
bool ForwardReprojection::accepts(const Ray& ray, const Hit& hit, const LeftPicture::Pixel& pixel,
                                  const StoredHit* directed) const {
  const ShadingPoint point(scene_->impl(), camera_, ray, hit);
  if (is_specular_or_refractive(point.params)) return false;
  if (same_viewpoint_) return true;
  const V3f now = -ray.direction;
  const V3f before = far_away_ ? view_direction_ : normalize_any(viewpoint_ - point.surface.position);
  const V3f& normal = point.surface.geometric_normal;
  if (!(dot(normal, now) * dot(normal, before) > 0)) return false;  // the other side
  const bool lambert = point.params.model == LobeModel::lambert && !point.params.mapped;
  if (lambert || point.params.model == LobeModel::none || point.black) return true;
  if (!directed) return false;
  const Frame& frame = point.frame;
  const float error = view_error(point.params, frame.to_local(now), frame.to_local(before),
                                 frame.to_local(unpack_direction(directed->direction)), mean_irradiance(pixel));
  return error <= max_error_;
}

void ForwardReprojection::verify(Batch& batch, ReprojectionStats& stats) {
  if (batch.count == 0) return;
  LeftPicture& left = paper_film(film_).first_hits()->left();
  scene_->impl().accel->intersect(batch.rays, batch.order, batch.count, batch.hits, RayOrder::camera);
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    const Batch::Bidder& bidder = batch.bidders[i];
    const Hit& hit = batch.hits[i];
    if (!hit.valid() || !(std::fabs(hit.t - bidder.distance) <= kVerification * bidder.distance)) continue;
    if (accepts(batch.rays[i], hit, left.pixel(bidder.from_x, bidder.from_y), bidder.directed))
      left.bid(bidder.x, bidder.y, bidder.distance, bidder.from_x, bidder.from_y);
  }
  stats.rays += batch.count;
  batch.count = 0;
}

void ForwardReprojection::project(const PixelRect& window, ReprojectionStats& stats) {
  static thread_local std::unique_ptr<Batch> batch(new Batch);
  Batch& b = *batch;
  const FirstHits& first_hits = *paper_film(film_).first_hits();
  const LeftPicture& left = first_hits.left();
  const int per_pixel = first_hits.per_pixel();
  b.count = 0;
  for (const PixelRect& block : cut_aligned(window, kFilmBlock, kFilmBlock)) {
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        const PixelHits& known = left.pixel(x, y).hits;
        if (known.met == 0 || known.edge) continue;
        for (int k = 0; k < per_pixel; ++k) {
          if (!(known.met >> k & 1)) continue;
          const StoredHit& stored = left.hits(x, y)[std::size_t(k)];
          const V3d position(stored.position);
          const FilmPoint p = projection_.point(position);
          // Compared as numbers: far off the film they are too large for an int.
          if (!p.in_front || !(p.x >= region_.x0 && p.x < region_.x1 && p.y >= region_.y0 && p.y < region_.y1))
            continue;
          const V3d origin = projection_.orthographic() ? projection_.position_at(p.x, p.y, 0) : projection_.origin();
          const V3d offset = position - origin;
          const auto distance = float(length(offset));
          if (!(distance > 0 && distance < std::numeric_limits<float>::infinity())) continue;
          Ray& ray = b.rays[b.count];
          ray.origin = V3f(origin);
          ray.direction = V3f(offset.normalized());
          ray.t_max = std::numeric_limits<float>::infinity();
          ray.alpha_key = 0x9e3779b9u;  // any: a surface with alpha that the sample met may let this ray pass
          b.order[b.count] = b.count;
          b.bidders[b.count] = {int(p.x), int(p.y), x, y, distance, known.directed >> k & 1 ? &stored : nullptr};
          if (++b.count == kBatch) verify(b, stats);
        }
      }
    }
    verify(b, stats);  // rays that are traced together influence each other in the last bit
  }
}

void ForwardReprojection::carry(const PixelRect& window, ReprojectionStats& stats) {
  film_.clear(window);
  const LeftPicture& left = paper_film(film_).first_hits()->left();
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const std::uint64_t samples = left.place(film_, x, y);
      if (samples == 0) continue;
      ++stats.carried;
      stats.samples += double(samples);
    }
  }
}

}  // namespace helio
