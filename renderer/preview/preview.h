// A preview: a whole picture for the eye within a time budget, biased, never part of a film.
//
// In sweeps over the picture: the resting film's light is taken over (film_capture.h), where there is one, after surfaces
// that were found as blocks of pixels away from a gaze have been found pixel by pixel; visibility
// (surface_pass.h) and temporal reprojection (history_lookup.h); fresh samples as long as time is left
// (sample_order.h); an edge-avoiding filter over what is still noisy or missing (edge_avoiding_filter.h).
//
// It does not show: how glossy surfaces change with the view before fresh samples tell; what moves in mirrors and
// behind glass; light of integrators that find what paths do not.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "renderer/base/cancel.h"
#include "renderer/preview/edge_avoiding_filter.h"
#include "renderer/preview/history_lookup.h"
#include "renderer/preview/preview_history.h"
#include "renderer/preview/preview_maker.h"
#include "renderer/preview/preview_target.h"
#include "renderer/preview/sample_order.h"
#include "renderer/preview/surface_pass.h"
#include "renderer/trace/paths/path_integrator.h"

namespace helio {

class Preview final : public PreviewMaker {
 public:
  // history: of the film's size; nobody else uses it until the sweeps are over or given up.
  Preview(std::shared_ptr<PreviewHistory> history, PreviewTarget target, std::shared_ptr<const CancelToken> cancel);

  int sweeps() const override { return int(sweeps_.size()); }
  std::size_t parts() const override;
  void run(int sweep, std::size_t part, TraceStats& stats) override;
  void finish_sweep(int sweep) override;
  void resolve(const PixelRect& window, std::vector<float> (&display)[3]) const override;

 private:
  enum class Sweep { colors, refine, capture, surfaces, samples, filter };

  // The surfaces of the preview before are known from here on.
  void begin_surfaces();
  // Surfaces of the preview before, of every pixel: for the film's light is that of pixels, not of blocks.
  void refine(const PixelRect& window, TraceStats& stats);
  void take_light(const PixelRect& part);
  void find_surfaces(const PixelRect& window, TraceStats& stats);  // and what is remembered of their light
  void plan_rest();
  void trace(std::size_t part, TraceStats& stats);
  void finish_samples();
  void complete();

  std::shared_ptr<PreviewHistory> history_;
  PreviewTarget target_;
  std::shared_ptr<const CancelToken> cancel_;
  PreviewView view_;
  Camera surface_camera_, camera_;  // through pixels' centres | with the filter of the samples
  std::vector<PixelRect> windows_;
  std::vector<Sweep> sweeps_;  // as far as they are known
  int current_ = 0;            // sweep that comes next
  int first_level_ = 0;        // sweep of the filter's level 0
  bool colors_before_ = false;             // history.colors are those of the preview before
  const PreviewBuffer* before_ = nullptr;  // its surfaces, to which history.colors_before belong; null: unknown
  std::optional<HistoryLookup> lookup_;
  std::optional<EdgeAvoidingFilter> filter_;
  std::vector<SampleOrder::Wanted> wanted_;  // by window, until the samples are chosen
  std::vector<std::size_t> unsettled_;       // pixels to be filtered, by window
  std::size_t filtered_ = 0;                 // of all windows
  std::vector<PixelPosition> chosen_;
  std::atomic<double> sweep_begun_s_ = 0;  // 0: no part of it was run
  std::atomic<std::size_t> traced_ = 0;
  std::vector<Rgb> sums_;            // by part of the samples: of light
  std::vector<std::size_t> counts_;  // and how many
};

}  // namespace helio
