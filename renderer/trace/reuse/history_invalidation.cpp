#include "renderer/trace/reuse/history_invalidation.h"

#include <algorithm>
#include <cmath>

#include "renderer/film/core/film_windows.h"
#include "renderer/trace/gbuffer/primary_hits.h"

namespace helio {
namespace {

// Sides of the cells in which changes are measured, in pixels: of one view 4 / 36 of the paths of a frame of one sample
// per pixel, of two views 2 * 4 / 64.
constexpr int kCellSide = 6, kCellSideOfTwo = 8;
constexpr double kLargestBias2 = 1e36;  // beyond, a pixel knows nothing

bool same_view(const OutdatedPicture& a, const OutdatedPicture& b) {
  return a.scene == b.scene && a.pose == b.pose;
}

// Of a picture to which so much light is added.
void scale(const Rgb& factor, SourcePixel& pixel) {
  const float most2 = sqr(max_component(factor));
  pixel.means = PackedMeans(pixel.means.mean(0) * factor, pixel.means.mean(1) * factor);
  for (int h = 0; h < kHalves; ++h) pixel.set_spread(h, pixel.spread(h) * factor * factor);
  pixel.set_structure(pixel.bend2(0) * most2, pixel.bend2(1) * most2, pixel.slope2() * most2);
  pixel.set_bias2(pixel.bias2() * most2);
}

// Where an object of several materials shows one that looks different, in a pixel or next to it.
class EditedMaterials {
 public:
  // Of a block and the pixels around it.
  static constexpr int kBlock = kPathGroupSize - 2;

  EditedMaterials(const OutdatedPicture& picture, const SceneDifference& difference)
      : difference_(difference),
        film_{0, 0, picture.pixels->width(), picture.pixels->height()},
        camera_(picture.pose, film_.x1, film_.y1, picture.scene->origin()),
        centres_(*picture.scene, camera_, picture.pose.forward) {}

  // Returns the number of rays.
  std::uint64_t trace(const PixelRect& block) {
    const PixelRect window = intersect({block.x0 - 1, block.y0 - 1, block.x1 + 1, block.y1 + 1}, film_);
    centres_.trace(window);
    return std::uint64_t(window.area());
  }
  // Of a pixel of the block that was traced last.
  bool at(int x, int y) const {
    const PixelRect around = intersect({x - 1, y - 1, x + 2, y + 2}, film_);
    for (int py = around.y0; py < around.y1; ++py) {
      for (int px = around.x0; px < around.x1; ++px) {
        const int material = centres_.material(px, py);
        if (material >= 0 && difference_.materials[std::size_t(material)]) return true;
      }
    }
    return false;
  }

 private:
  const SceneDifference& difference_;
  PixelRect film_;
  Camera camera_;
  PrimaryHits centres_;
};

SurfaceChange surface_change(const SceneDifference& difference, const CentreHit& centre) {
  return centre.hit() && !difference.surfaces.empty() ? difference.surfaces[centre.instance] : SurfaceChange::none;
}

}  // namespace

HistoryInvalidation::HistoryInvalidation(std::shared_ptr<const RenderScene> scene, const PixelRect& region,
                                         const PixelFilter& filter, const PathSettings& settings,
                                         std::vector<OutdatedPicture> pictures)
    : scene_(std::move(scene)), region_(region), wide_filter_(filter_reach(filter) > 1), settings_(settings) {
  // Which estimates what all integrators do whose pictures are reused, without splats.
  settings_.integrator = Integrator::path;
  for (OutdatedPicture& picture : pictures) items_.push_back({std::move(picture), std::nullopt, nullptr});
}

void HistoryInvalidation::compare() {
  std::vector<std::vector<Item*>> views;  // that have to be measured
  for (Item& item : items_) {
    item.difference = scene_difference(*item.picture.scene, *scene_);
    if (!item.difference || item.difference->empty() || item.difference->brightness) continue;
    const auto same = std::find_if(views.begin(), views.end(), [&](const std::vector<Item*>& view) {
      return same_view(view.front()->picture, item.picture);
    });
    if (same == views.end()) {
      views.push_back({&item});
    } else {
      same->push_back(&item);
    }
  }
  for (const std::vector<Item*>& view : views) {
    const OutdatedPicture& picture = view.front()->picture;
    changes_.push_back(std::make_unique<ChangeSamples>(picture.scene, scene_, picture.pose, picture.pixels->width(),
                                                       picture.pixels->height(), region_,
                                                       views.size() > 1 ? kCellSideOfTwo : kCellSide, settings_));
    for (Item* item : view) item->changes = changes_.back().get();
  }
}

bool HistoryInvalidation::scales(std::size_t picture) const {
  const std::optional<SceneDifference>& difference = items_[picture].difference;
  return difference && difference->brightness.has_value();
}

bool HistoryInvalidation::edits_what_shows(std::size_t picture) const {
  const std::optional<SceneDifference>& difference = items_[picture].difference;
  return !difference || difference->edits_what_shows();
}

std::size_t HistoryInvalidation::measure_parts() const {
  std::size_t parts = 0;
  for (const auto& changes : changes_) parts += changes->trace_parts();
  return parts;
}

void HistoryInvalidation::measure(std::size_t part, ReprojectionStats& stats) {
  for (const auto& changes : changes_) {
    if (part < changes->trace_parts()) {
      TraceStats traced;
      changes->trace(part, traced);
      stats.rays += traced.rays;
      return;
    }
    part -= changes->trace_parts();
  }
}

std::size_t HistoryInvalidation::collect_parts() const {
  std::size_t parts = 0;
  for (const auto& changes : changes_) parts += changes->collect_parts();
  return parts;
}

void HistoryInvalidation::collect(std::size_t part) {
  for (const auto& changes : changes_) {
    if (part < changes->collect_parts()) return changes->collect(part);
    part -= changes->collect_parts();
  }
}

void HistoryInvalidation::finish_collecting() {
  for (const auto& changes : changes_) changes->finish();
}

void HistoryInvalidation::revise(const PixelRect& window, ReprojectionStats& stats) {
  for (const Item& item : items_) revise(item, window, stats);
}

void HistoryInvalidation::revise(const Item& item, const PixelRect& window, ReprojectionStats& stats) {
  HistorySource& pixels = *item.picture.pixels;
  if (!item.difference) {  // another load's: nothing is known
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) pixels.pixel(x, y) = {};
    }
    return;
  }
  const SceneDifference& difference = *item.difference;
  if (difference.empty()) return;
  if (difference.brightness) {
    for (int y = window.y0; y < window.y1; ++y) {
      for (int x = window.x0; x < window.x1; ++x) scale(*difference.brightness, pixels.pixel(x, y));
    }
    return;
  }

  EditedMaterials edited(item.picture, difference);
  for (const PixelRect& block : cut_aligned(window, EditedMaterials::kBlock, EditedMaterials::kBlock)) {
    bool traced = false;
    int cell = -1;
    double change = 0;  // of the cell
    for (int y = block.y0; y < block.y1; ++y) {
      for (int x = block.x0; x < block.x1; ++x) {
        SourcePixel& pixel = pixels.pixel(x, y);
        const CentreHit& centre = pixels.centre(x, y);
        if (pixel.empty()) continue;
        SurfaceChange surface = surface_change(difference, centre);
        if (surface == SurfaceChange::some && wide_filter_) surface = SurfaceChange::all;
        if (surface == SurfaceChange::some && !traced) {
          stats.rays += edited.trace(block);
          traced = true;
        }
        const bool past_everything = !centre.hit();
        // Of what a mixed pixel hides its centre does not tell.
        if (surface == SurfaceChange::all || (surface == SurfaceChange::some && edited.at(x, y)) ||
            (pixel.mixed() && difference.edits_what_shows()) ||
            (past_everything && difference.environment)) {
          pixel = {};
          continue;
        }
        if (past_everything && !centre.border) continue;
        if (const int own = item.changes->cell(x, y); own != cell) {
          cell = own;
          change = std::sqrt(item.changes->squared(cell));
        }
        const double bias = std::sqrt(double(pixel.bias2())) + change;
        if (bias * bias <= kLargestBias2) {
          pixel.set_bias2(float(bias * bias));
        } else {
          pixel = {};
        }
      }
    }
  }
}

}  // namespace helio
