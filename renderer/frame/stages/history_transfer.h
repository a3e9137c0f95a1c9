// Stage `reproject`, on a camera move or an edit: (1) the film becomes a source (a stored earlier picture), (2) sources
// of an older version of the scene are updated (trace/reuse/history_invalidation.h), (3) a glance tells how much of the
// new picture they know, (4) they are reprojected into the film of the new camera (trace/reuse/reprojection.h), tile by
// tile. The last is a stage of a plan of its own, which follows it with samples.
//
// After a jump, and for a session's first picture, nothing is found. The primary hits of pixel centres are found all
// the same, tile by tile before the first sample: whoever leaves the picture again need not wait for them.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/film/history/film_history.h"
#include "renderer/frame/stages/temporal_reprojection.h"
#include "renderer/frame/window_order.h"
#include "renderer/trace/reuse/history_invalidation.h"
#include "renderer/trace/reuse/reprojection.h"

namespace helio {

// Which pictures a film's sources are, and whether the film itself is one.
//
// Two sources: the anchor is a picture that took many samples; the newest is the one before this. Each lookup uses the
// source with more effective samples. So a camera that moves on and on with a sample or two a step keeps drawing on the
// anchor, not on a copy of a copy, and one that returns finds it as it was; the newest fills in what the anchor did not
// see. A picture with at least a quarter of the anchor's fresh samples becomes the new anchor; the old one is
// overwritten only when the next picture is stored.
class PictureHistory {
 public:
  struct Slot {
    bool valid = false;
    std::shared_ptr<const RenderScene> scene;
    CameraPose pose;
    double samples = 0;    // fresh ones, per pixel, both halves
    bool swapped = false;  // its half A holds lineage B: the halves swap roles with every picture
    bool edited = false;   // visible surfaces or the environment were edited since
  };

  // The film's pixels are of no use to any later picture: other settings, another load. Returns the scenes that were
  // held, which may take long to free.
  std::vector<std::shared_ptr<const RenderScene>> forget();
  // The film holds a picture of this camera, all of its pixels in a defined state.
  void film_complete(const std::shared_ptr<const RenderScene>& scene, const CameraPose& pose) {
    film_ = {true, scene, pose, 0, film_swapped()};
  }
  bool film_swapped() const { return generation % 2 != 0; }  // of the picture in hand
  bool film_usable() const { return film_.valid; }
  const CameraPose& film_pose() const { return film_.pose; }

  // The source to overwrite with the film, which has had so many fresh samples per pixel; that source holds nothing
  // from now on.
  int take_slot(double samples);
  void slot_complete(int slot);
  // Until slot_revised() the slot's pixels are of neither scene.
  void slot_in_revision(int slot) { slots_[slot].valid = false; }
  void slot_revised(int slot, const std::shared_ptr<const RenderScene>& scene, bool what_shows_edited) {
    slots_[slot].valid = true;
    slots_[slot].scene = scene;
    slots_[slot].edited |= what_shows_edited;
  }
  void film_overwritten() { film_ = {}; }
  const Slot& slot(int i) const { return slots_[i]; }
  int anchor() const { return anchor_; }

  // How many pictures have been begun with what earlier ones knew. Samples of each are drawn with another seed.
  std::uint64_t generation = 0;

 private:
  static constexpr double kAnchorShare = 0.25;

  int anchor_ = 0;
  bool promoted_ = false;  // the slot that was taken last becomes the anchor once it is complete
  Slot slots_[FilmHistory::kSources], film_;
};

// The sweeps of one move or edit: gather (film to source, unless the film is of no use); where sources are of an
// earlier scene compare, measure, collect, revise; then glance. After resume(): carry, in an order that makes one tile
// after the other ready, or clear where pictures of this camera can neither draw on others nor be drawn on.
class HistoryTransfer final : public TemporalReprojection {
 public:
  // film_samples: fresh ones per pixel, both halves. Film and history outlive this.
  HistoryTransfer(std::shared_ptr<const RenderScene> scene, Film& film, const PixelRect& region,
                  PictureHistory& history, const CameraPose& pose, const PixelFilter& filter, double film_samples,
                  const PathSettings& settings);

  std::size_t parts() const override;
  int sweeps() const override { return int(sweeps_.size()); }
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  WindowOrder* order() override;
  void note(PictureState& picture) override;
  void resume(const TileGrid& grid, bool first_samples) override;

 private:
  enum class Sweep {
    gather,
    compare,
    measure,
    collect,
    revise,
    glance,
    clear,
    carry,  // all three sweeps of Reprojection
  };
  void carry(std::size_t part, ReprojectionStats& stats);
  void prepare_revision();
  void prepare_reprojection();
  void free_scenes();

  std::shared_ptr<const RenderScene> scene_;
  Film& film_;
  PixelRect region_;
  PictureHistory& history_;
  CameraPose pose_;
  PixelFilter filter_;
  PathSettings settings_;
  int slot_ = -1;              // that the film goes to; -1: none
  std::vector<Sweep> sweeps_;  // as far as they are known
  int current_ = 0;
  std::vector<PixelRect> windows_;
  std::unique_ptr<HistoryInvalidation> revision_;
  std::vector<int> revised_slots_;  // in the order of its pictures
  std::unique_ptr<Reprojection> reprojection_;
  std::atomic<std::uint64_t> asked_ = 0, known_ = 0;  // pixels, at the glance
  std::optional<WindowOrder> order_;                  // of the sweep `carry`
  bool first_samples_ = false;
  std::atomic<std::uint64_t> targets_ = 0;  // samples that first_samples_ asks for
};

}  // namespace helio
