#include "renderer/trace/reuse/reprojection.h"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "renderer/base/check.h"
#include "renderer/film/core/film_windows.h"
#include "renderer/film/core/packed_values.h"
#include "renderer/film/history/film_history.h"
#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/reuse/history_view.h"
#include "renderer/trace/sampling/sampler.h"
#include "renderer/trace/scene/scene_data.h"

namespace helio {
namespace {

// Of a glance: the side of the squares of which one pixel is looked at, and of a region the pixels at least.
constexpr int kMostGlanceCell = 8;
constexpr int kLeastGlances = 64;

// By source, as many as were asked.
struct Sights {
  SourceSight of[Reprojection::kMostSources];
  std::size_t asked = 0;

  bool waits() const {
    return std::any_of(of, of + asked, [](const SourceSight& sight) { return sight.evidence.has_value(); });
  }
};

// Of a block of the film.
struct BlockSights {
  PixelRect block;
  Sights pixels[kPathGroupSize * kPathGroupSize];

  Sights& at(int x, int y) { return pixels[std::size_t(y - block.y0) * kPathGroupSize + std::size_t(x - block.x0)]; }
};

// Of a picture's surfaces, by some of its pixels; what is brighter than nearly all of them counts as if it were not.
Rgb mean_radiance(const HistorySource& source, const PixelRect& region) {
  constexpr int kAcross = 64;
  constexpr double kUsual = 0.95;
  const PixelRect r = intersect(region, {0, 0, source.width(), source.height()});
  const int columns = std::min(kAcross, r.width()), rows = std::min(kAcross, r.height());
  std::vector<Rgb> found;
  std::vector<float> brightness;
  for (int j = 0; j < rows; ++j) {
    const int y = r.y0 + int(std::int64_t(j) * r.height() / rows);
    for (int i = 0; i < columns; ++i) {
      const int x = r.x0 + int(std::int64_t(i) * r.width() / columns);
      const SourcePixel& pixel = source.pixel(x, y);
      if (pixel.empty() || source.centre(x, y).shines) continue;
      const Rgb mean = pixel.means.mean(0) * 0.5f + pixel.means.mean(1) * 0.5f;
      if (!is_finite(mean)) continue;
      found.push_back(mean);
      brightness.push_back(luminance(mean));
    }
  }
  if (found.empty()) return {0, 0, 0};
  const auto usual = brightness.begin() + std::ptrdiff_t(kUsual * double(brightness.size()));
  std::nth_element(brightness.begin(), usual, brightness.end());
  V3d sum(0, 0, 0);
  for (const Rgb& mean : found)
    sum += V3d(mean) * std::min(1.0, double(*usual) / std::max(double(luminance(mean)), DBL_MIN));
  return Rgb(sum * (1.0 / double(found.size())));
}

// From where `source` looks at the scene, when `now` looks at it from elsewhere; rebased.
std::optional<V3f> other_viewpoint(const CameraPose& source, const CameraPose& now, const RenderScene& scene) {
  const bool far_away = source.projection == Projection::orthographic;
  if (source.projection == now.projection) {
    if (far_away ? source.forward == now.forward : source.position == now.position) return std::nullopt;
  }
  if (!far_away) return V3f(source.position - scene.origin());
  return V3f(source.forward) * (-1e4f * scene.impl().radius);
}

// Overwrites what the pixel holds. swap: the source's first half is of the lineage of the film's second.
void fill(const HistorySample& lookup, bool swap, Film& film, int x, int y) {
  CarriedPixel& carried = film.history()->carried(x, y);
  DirectionReservoir& directions = film.history()->directions(x, y);
  carried = {};
  directions = {};
  const auto from = [swap](int h) { return swap ? 1 - h : h; };
  Rgb means[kHalves];
  for (int h = 0; h < kHalves; ++h) {
    const float* mean = lookup.mean[lookup.count[from(h)] > 0 ? from(h) : from(1 - h)];
    means[h] = Rgb(mean[0], mean[1], mean[2]);
  }
  carried.means = PackedMeans(means[0], means[1]);
  for (int h = 0; h < kHalves; ++h) {
    const auto count = std::min(std::uint32_t(lookup.count[from(h)] + 0.5f), CarriedPixel::kMostCount);
    HalfPixel& half = film.half(h, x, y);
    half = {};
    carried.count[h] = half.count = count;
    if (count == 0) continue;
    const Rgb mean = carried.means.mean(h);
    for (int c = 0; c < 3; ++c) {
      half.sum[c] = double(mean[c]) * count;
      half.deviations[c] = std::min(lookup.spread[from(h)][c] * (float(count) - 1), 0x1p127f);
    }
  }
  if (carried.count[0] + carried.count[1] == 0) return;
  carried.bias2 = lookup.bias2;
  carried.age = lookup.age + 1;
  if (!lookup.kept || lookup.kept->looked_up()) carried.note_looked_up();
  if (lookup.kept && lookup.kept->mixed()) carried.note_mixed();
  for (int h = 0; h < kHalves; ++h) {
    for (int k = 0; k < DirectionReservoir::kPlaces; ++k)
      directions.set_direction(h, k, lookup.directions.direction(from(h), k));
    directions.set_share(h, lookup.directions.share(from(h)));
  }
}

}  // namespace

bool can_reproject(const CameraPose& pose, const PixelFilter& filter) {
  return pose.lens_radius == 0 && filter_reach(filter) <= Reprojection::kMostReach;
}

void ReprojectionStats::add(const ReprojectionStats& other) {
  rays += other.rays;
  carried += other.carried;
  samples += other.samples;
}

Reprojection::Reprojection(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                           const CameraPose& pose, const PixelFilter& filter, std::vector<PictureSource> sources)
    : film_(film), centres_(std::move(scene), film, region, pose, filter), sources_(std::move(sources)) {
  HELIO_DCHECK(sources_.size() <= kMostSources && film_.history());
  const V3d& p = pose.position;
  const V3d& f = pose.forward;
  for (const double number : {p.x, p.y, p.z, f.x, f.y, f.z})
    key_ = combine_hash(key_, std::uint32_t(std::bit_cast<std::uint64_t>(number) >> 20));
}

void Reprojection::prepare_lookups() const {
  std::call_once(prepared_, [this] {
    const RenderScene& scene = centres_.scene();
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const PictureSource& source = sources_[i];
      if (!scene.features().only_lambert && other_viewpoint(source.pose, centres_.pose(), scene))
        light_[i] = mean_radiance(*source.pixels, centres_.region());
    }
  });
}

std::vector<HistoryView> Reprojection::views() const {
  prepare_lookups();
  const RenderScene& scene = centres_.scene();
  std::vector<HistoryView> views;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const PictureSource& source = sources_[i];
    views.emplace_back(*source.pixels, source.pose, other_viewpoint(source.pose, centres_.pose(), scene),
                       centres_.pose(), centres_.region(), scene.origin());
  }
  return views;
}

// Looks sources up for one pixel after the other. Not thread safe.
class Reprojection::Seeker {
 public:
  explicit Seeker(const Reprojection& of)
      : of_(of), now_(pose(), of.film_.width(), of.film_.height(), of.centres_.scene().origin()), views_(of.views()) {}

  struct Found {
    HistorySample lookup;
    bool swap = false;
  };
  // centres: has the pixel in hand, which met `here`. Sources are asked until one knows enough; of glossy surfaces, as
  // far as the pixel's own directions tell.
  void see(const CentreHit& here, int x, int y, const PrimaryHits& centres, Sights& sights) {
    const V3d position =
        here.hit() ? now_.position_at(x + 0.5, y + 0.5, here.depth) : now_.direction_at(x + 0.5, y + 0.5);
    const double footprint = now_.footprint(here.hit() ? double(here.depth) : dot(position, pose().forward));
    sights.asked = 0;
    while (sights.asked < views_.size()) {
      const std::size_t i = sights.asked++;
      SourceSight& sight = sights.of[i];
      if (!views_[i].same_camera()) {
        views_[i].see(here, position, footprint, centres, key_of(x, y, i), sight);
      } else {
        sight.evidence.reset();
        sight.lookup = views_[i].border(x, y) ? HistorySample{} : views_[i].keep(*of_.film_.history(), x, y, 0);
      }
      if (sights.asked == views_.size()) break;
      const HistorySample known = sight.evidence ? look(here, x, y, sights, i, nullptr) : sight.lookup;
      if (known.total() >= of_.sources_[i].enough) break;
    }
  }

  // sights: the pixel's, as see() left them. block: holds those of its neighbours; null: has none.
  Found tell(const CentreHit& here, int x, int y, const Sights& sights, BlockSights* block) const {
    Found best;
    for (std::size_t i = 0; i < sights.asked; ++i) {
      const SourceSight& sight = sights.of[i];
      const HistorySample lookup = sight.evidence ? look(here, x, y, sights, i, block) : sight.lookup;
      if (lookup.total() > best.lookup.total()) best = {lookup, of_.sources_[i].swap};
      if (lookup.total() >= of_.sources_[i].enough) break;
    }
    return best;
  }

 private:
  std::uint32_t key_of(int x, int y, std::size_t source) const {
    return combine_hash(pixel_key(x, y, 0, std::uint64_t(source)), of_.key_);
  }

  // By the pixel's own directions and those of the pixels around. Precondition: it has evidence of that source.
  HistorySample look(const CentreHit& here, int x, int y, const Sights& sights, std::size_t source,
                     BlockSights* block) const {
    const SourceSight& sight = sights.of[source];
    const ViewEvidence& own = *sight.evidence;
    const ViewEvidence* alike[9];
    const WeighedDirections* directions[9];
    std::size_t count = 0;
    const PixelRect around = block ? intersect({x - 1, y - 1, x + 2, y + 2}, block->block) : PixelRect{};
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const Sights& there = block->at(px, py);
        if ((px == x && py == y) || there.asked <= source || !there.of[source].evidence) continue;
        const ViewEvidence& evidence = *there.of[source].evidence;
        if (!evidence.like(own) || !same_surface(here, of_.film_.history()->centre(px, py))) continue;
        directions[count] = &there.of[source].directions;
        alike[count++] = &evidence;
      }
    }
    directions[count] = &sight.directions;
    alike[count++] = &own;
    const ViewReweighting change = pooled_change(own, {alike, count}, sight.shared());
    const std::uint32_t key = key_of(x, y, source);
    HistorySample lookup = views_[source].look(here, sight, change, of_.light_[source], key);
    // From there on they stand for what the new camera sees: by what they counted for the old one they would lag behind
    // from the next move on, and meet lobes that leave them more often than lobes that come.
    if (block && lookup.total() > 0) pick_directions({directions, count}, key, lookup.directions);
    return lookup;
  }

  const CameraPose& pose() const { return of_.centres_.pose(); }

  const Reprojection& of_;
  CameraProjection now_;
  std::vector<HistoryView> views_;
};

Reprojection::Glance Reprojection::glance(const PixelRect& window, ReprojectionStats& stats) const {
  Glance glance;
  std::vector<const HistorySource*> unmoved;  // pixels of which may be kept as they are
  for (const PictureSource& source : sources_) {
    if (source.pose == centres_.pose()) unmoved.push_back(source.pixels);
  }
  // A strip of one pixel's width, as high as eight of these cells, is in one of them.
  int cell = kMostGlanceCell;
  while (cell > 1 && centres_.region().area() < std::int64_t(cell) * cell * kLeastGlances) cell /= 2;
  PrimaryHits centres(centres_.scene(), centres_.camera(), centres_.pose().forward);
  Seeker seeker(*this);
  for (const PixelRect& part : cut_aligned(window, cell, cell)) {
    const int row = part.y0 / cell, column = part.x0 / cell;
    const int x = std::min(part.x0 + (5 * row + 3) % cell, part.x1 - 1);
    const int y = std::min(part.y0 + (3 * column + 1) % cell, part.y1 - 1);
    ++glance.asked;
    if (!unmoved.empty()) {
      const auto knows = [&](const HistorySource* source) { return !source->pixel(x, y).empty(); };
      if (std::any_of(unmoved.begin(), unmoved.end(), knows)) ++glance.known;
      continue;
    }
    centres.trace({x, y, x + 1, y + 1});
    ++stats.rays;
    const CentreHit here = centres.at(x, y);
    Sights sights;
    seeker.see(here, x, y, centres, sights);
    if (seeker.tell(here, x, y, sights, nullptr).lookup.total() > 0) ++glance.known;
  }
  return glance;
}

void Reprojection::clear(const PixelRect& window) {
  film_.clear(window);
}

void Reprojection::carry(const PixelRect& window, ReprojectionStats& stats) {
  PrimaryHits centres(centres_.scene(), centres_.camera(), centres_.pose().forward);
  Seeker seeker(*this);
  const auto sights = std::make_unique<BlockSights>();
  std::vector<std::pair<int, int>> waiting;  // pixels whose neighbours have a say
  for (const PixelRect& block : cut_aligned(window, kPathGroupSize, kPathGroupSize)) {
    film_.clear(block);
    sights->block = block;
    centres.trace(block);
    waiting.clear();
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        const CentreHit& here = film_.history()->centre(x, y) = centres.at(x, y);
        film_.features(x, y) = centres.features();  // until the first fresh sample has its own
        Sights& seen = sights->at(x, y);
        seeker.see(here, x, y, centres, seen);
        if (seen.waits()) {
          waiting.push_back({x, y});
          continue;
        }
        const Seeker::Found found = seeker.tell(here, x, y, seen, nullptr);
        fill(found.lookup, found.swap, film_, x, y);
      }
    }
    for (const auto& [x, y] : waiting) {
      const Seeker::Found found = seeker.tell(film_.history()->centre(x, y), x, y, sights->at(x, y), sights.get());
      fill(found.lookup, found.swap, film_, x, y);
    }
  }
  stats.rays += std::uint64_t(window.area());
}

void Reprojection::find_borders(const PixelRect& window, ReprojectionStats& stats) {
  stats.rays += centres_.find_borders(window);
}

void Reprojection::settle(const PixelRect& window, ReprojectionStats& stats) {
  const PixelRect& region = centres_.region();
  const std::vector<HistoryView> views = this->views();
  FilmHistory& history = *film_.history();
  centres_.settle(window);
  for (int y = window.y0; y < window.y1; ++y) {
    for (int x = window.x0; x < window.x1; ++x) {
      const bool border = history.centre(x, y).border;
      CarriedPixel& carried = history.carried(x, y);
      if (border) fill({}, false, film_, x, y);
      for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].same_camera() || !(border || views[i].border(x, y))) continue;
        const PixelRect reached = centres_.reached_from(x, y);
        if (sources_[i].edited && intersect(reached, region).area() < reached.area()) continue;
        const HistorySample lookup = views[i].keep(history, x, y, centres_.reach());
        if (lookup.total() > float(carried.count[0]) + float(carried.count[1]))
          fill(lookup, sources_[i].swap, film_, x, y);
        if (lookup.total() >= sources_[i].enough) break;
      }
      const std::uint32_t count = carried.count[0] + carried.count[1];
      if (count == 0) {
        film_.features(x, y) = {};  // there is nothing to show
        continue;
      }
      ++stats.carried;
      stats.samples += double(count);
    }
  }
}

}  // namespace helio
