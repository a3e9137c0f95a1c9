// One earlier picture as seen from a new one: the pixels that show what a new pixel shows, and what they say of it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "renderer/base/math.h"
#include "renderer/film/history/film_history.h"
#include "renderer/film/history/history_source.h"
#include "renderer/trace/camera/camera_projection.h"
#include "renderer/trace/gbuffer/primary_hits.h"
#include "renderer/trace/gbuffer/view_reweighting.h"
#include "renderer/trace/gbuffer/weighed_directions.h"
#include "renderer/trace/reuse/history_sample.h"

namespace helio {

struct HistoryTap {
  int x = 0, y = 0;
  float weight = 0;
  Rgb modulation;  // new albedo over old
};

// The pixels around a point inside a surface that show that surface, and nothing else.
struct HistoryTaps {
  HistoryTap tap[kMostTaps];
  int count = 0;
  float total = 0;       // weight, at most 1
  double u = 0, v = 0;   // where the point lies, in pixels from the centre of the first of the film
  float fx = 0, fy = 0;  // between the four around it, [0, 1)
  double footprint = 0;  // side of a pixel there
};

// What a pixel finds in a source.
struct SourceSight {
  HistoryTaps taps;
  float zoom = 1;  // size of a pixel of the source over that of a new one
  bool glossy = false;
  // Of surfaces that look different from there: neighbours have a say, and `lookup` is not known yet.
  std::optional<ViewEvidence> evidence;
  WeighedDirections directions;  // of the evidence: what each counts for the new camera
  HistorySample lookup;

  bool usable() const { return taps.total >= kLeastLookupWeight; }
  // Of neighbours that ask the same pixel of the source.
  float shared() const { return std::max(zoom * zoom, 1.0f); }
};

// Not thread safe.
class HistoryView {
 public:
  // viewpoint: where it was taken from (rebased) if surfaces are seen from elsewhere now. now: the new picture's
  // camera. region: pixels outside it are of pictures that are no longer true. The pixels, which are of the new film's
  // size, outlive this.
  HistoryView(const HistorySource& pixels, const CameraPose& pose, const std::optional<V3f>& viewpoint,
              const CameraPose& now, const PixelRect& region, const V3d& scene_origin);

  // Pixels are those of the new picture, whatever they show.
  bool same_camera() const { return same_camera_; }

  // Of the pixel whose centre sees `here` at `position`, or nothing in that direction. footprint: side of a new
  // pixel there. centres: has the pixel in hand.
  void see(const CentreHit& here, const V3d& position, double footprint, const PrimaryHits& centres, std::uint32_t key,
           SourceSight& sight);

  // Without the directions of surfaces that look different from there. light: the picture's mean radiance.
  HistorySample look(const CentreHit& here, const SourceSight& sight, const ViewReweighting& change, const Rgb& light,
                     std::uint32_t key) const;

  // Whether what the pixel showed was next to another surface.
  bool border(int x, int y) const { return pixels_.centre(x, y).border; }

  // What it knew of the pixel itself, if that and all around it, so far, show what they showed. Precondition:
  // same_camera().
  HistorySample keep(const FilmHistory& now, int x, int y, int reach) const;

 private:
  // The normal that was met last: neighbours share it.
  struct Normal {
    std::uint32_t packed;
    V3d direction;
    CameraProjection::Heights heights;

    Normal(std::uint32_t bits, const CameraProjection& projection)
        : packed(bits), direction(unpack_direction(bits)), heights(projection.heights_along(direction)) {}
  };

  // Of the pixel in hand, by where its light came from as the nearest pixel knows it: neighbours ask the others. Where
  // surfaces are textured every pixel asks for itself.
  ViewEvidence evidence_of(const HistoryTaps& taps, const PrimaryHits& centres, WeighedDirections& directions) const;
  HistoryTaps find_taps(const CentreHit& here, const V3d& position);
  // Adds the pixel if it shows what `here` is, and nothing else. False: it shows part of what nobody knows.
  bool add_tap(const CentreHit& here, const V3d& from_camera, double footprint, HistoryTap tap, HistoryTaps& taps);
  // Those of the pixels that weigh `least` and more, by what they counted there.
  WeighedDirections directions_of(const HistoryTaps& taps, float least) const;

  const HistorySource& pixels_;
  PixelRect region_;
  CameraProjection projection_;
  bool same_camera_;
  std::optional<V3f> viewpoint_;  // none: where the new picture's is
  Normal normal_;
};

}  // namespace helio
