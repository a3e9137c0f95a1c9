// Decides what a frame does next. Pure: touches no pixel and no clock, so that it is tested by comparing plans.
//
// The course of a frame: one sample of half A everywhere, each tile shown as soon as it is done; one of half B; then A
// and B to the same power of two, doubling. A plan is cut short of its power of two where it would outlast the
// publication interval, the time budget, or the count at which the target error is expected.
#pragma once

#include <cstddef>
#include <cstdint>

#include "renderer/film/resolve.h"
#include "renderer/frame/frame_plan.h"
#include "renderer/frame/render_settings.h"

namespace helio {

// Samples per pixel, both halves, at which an unlimited frame ends.
inline constexpr std::uint32_t kMaxSamplesPerPixel = 1u << 30;
// A target error is not believed before this many samples per pixel.
inline constexpr std::uint32_t kMinSamplesForError = 16;

// An error estimate and the samples per pixel (both halves) it was made at.
struct ErrorAtCount {
  std::uint32_t samples = 0;
  FilmError error;
};

// What the scheduler knows of a frame. Times in seconds of wall time, points in time on the now_s() clock.
struct FrameState {
  std::uint64_t revision = 0;
  double begun_s = 0;
  std::uint32_t done[kHalves] = {0, 0};    // samples that every pixel of the region has
  ErrorAtCount measured;                   // the newest estimate; samples == 0: none

  bool published = false;               // something of this frame was shown
  bool published_final = false;         // everything was, as final
  std::uint32_t published_samples = 0;  // at the last publication
  double published_s = 0;               // when that was
  bool republish = false;               // someone asked for the newest state

  std::size_t tiles = 1;
  double sample_seconds = 0;   // for one sample of one half in every pixel; 0: not known yet
  double measure_seconds = 0;  // for one error estimate
  double publish_seconds = 0;  // for one publication of every tile
  double publish_bytes = 0;    // of one publication of every tile

  std::uint32_t total() const { return done[0] + done[1]; }
};

struct PublishPolicy {
  bool passes = true;        // false: only the final state (jobs)
  double interval_s = 0.25;  // between publications that are not at powers of two; grows with the age of the view
};

class FrameScheduler {
 public:
  FrameScheduler(const Budget& budget, const PublishPolicy& policy) : budget_(budget), policy_(policy) {}

  // view_age_s: since the view was accepted. backlog: tiles waiting behind the sink.
  FramePlan plan_next(const FrameState& state, double view_age_s, std::size_t backlog, double now_s) const;

  // Share of the budget that is used, [0, 1]; 0 when unlimited.
  double budget_used(const FrameState& state, double now_s) const;

 private:
  std::optional<FrameEndReason> reached(const FrameState& state, double now_s) const;
  bool publication_due(const FrameState& state, double view_age_s, std::size_t backlog, double now_s) const;
  FramePlan plan_integration(const FrameState& state, double view_age_s, double now_s) const;
  std::uint32_t sample_limit() const;
  double deadline_s(const FrameState& state) const;
  double interval_s(double view_age_s) const;
  bool error_usable(const ErrorAtCount& measured) const;
  double variance_over_target(const FilmError& error) const;

  Budget budget_;
  PublishPolicy policy_;
};

}  // namespace helio
