// Brings pictures of a scene that was edited up to date, so that later ones can go on drawing on them.
//
// Exactly: pixels whose centres have met a surface that was edited or an object that was moved know nothing any more,
// nor do those that look past everything at an environment that was edited; the others that look past everything know
// what they knew. What has come into a pixel's view, or gone from it, is seen by the new picture's own centre hits
// (trace/reuse/reprojection.h). When all that shines was scaled alike, so is the picture.
//
// Measured: of all other pixels, what shadows, reflections and bounced light may have changed
// (trace/reuse/change_samples.h) is added to what reuse may have added to them before: bounds, not their squares, for
// edits in a row may all go one way. It caps what they count, and travels on with them.
#pragma once

#include <memory>
#include <vector>

#include "renderer/film/history/history_source.h"
#include "renderer/trace/reuse/change_samples.h"
#include "renderer/trace/reuse/reprojection.h"
#include "renderer/trace/scene/scene_difference.h"

namespace helio {

// A picture of an earlier scene.
struct OutdatedPicture {
  std::shared_ptr<const RenderScene> scene;
  CameraPose pose;  // a pinhole's
  HistorySource* pixels = nullptr;
};

// Four stages, one after the other, each all of its parts; parts of one stage are thread safe.
//
// Stopped on the way, pictures are outdated still, and may be revised again: bounds only grow. Not so those that are
// scaled.
class HistoryInvalidation {
 public:
  // The pictures' pixels outlive this. settings.seed: of none of their samples, nor of those of other revisions.
  HistoryInvalidation(std::shared_ptr<const RenderScene> scene, const PixelRect& region, const PixelFilter& filter,
                      const PathSettings& settings, std::vector<OutdatedPicture> pictures);

  void compare();  // one part
  // After compare(): revise() multiplies the pixels of this picture, and must not stop on the way.
  bool scales(std::size_t picture) const;
  // After compare(): surfaces or the environment were edited, and not merely all light scaled alike.
  bool edits_what_shows(std::size_t picture) const;
  // 0 parts where nothing has to be measured.
  std::size_t measure_parts() const;
  void measure(std::size_t part, ReprojectionStats& stats);
  std::size_t collect_parts() const;
  void collect(std::size_t part);
  void finish_collecting();
  // Windows of the region, disjoint.
  void revise(const PixelRect& window, ReprojectionStats& stats);

 private:
  struct Item {
    OutdatedPicture picture;
    std::optional<SceneDifference> difference;
    ChangeSamples* changes = nullptr;  // null: exact without
  };
  void revise(const Item& item, const PixelRect& window, ReprojectionStats& stats);

  std::shared_ptr<const RenderScene> scene_;
  PixelRect region_;
  bool wide_filter_;  // reaches beyond the next pixel
  PathSettings settings_;
  std::vector<Item> items_;
  std::vector<std::unique_ptr<ChangeSamples>> changes_;  // pictures of one scene and view share
};

}  // namespace helio
